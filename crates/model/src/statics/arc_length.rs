//! Arc-length continuation of loading paths: the load is unknown, and the distance between two states is given
//! (Crisfield 1981).

use std::ops::ControlFlow;

use super::newton::{Metric, Newton, Point, is_singular};
use super::path::{PathEnd, PathState, Stability};
use super::{GRADIENT_STEP, Search, Shortfall, not_converged};
use crate::error::ModelError;

/// Target number of iterations per step, used to control the step length.
const ITERATIONS: f64 = 5.0;
/// Target distance between an equilibrium and its prediction, relative to the step length. The step length is chosen to
/// reach this target.
const DISTANCE: f64 = 0.1;
/// Smallest cosine of the angle between the tangents at the ends of a step. If the cosine is smaller, the step may have
/// left the branch.
const SMALLEST_COSINE: f64 = 0.5;
/// Smallest length of a step, relative to the first step.
const SMALLEST_STEP: f64 = 1.0 / 1024.0;

/// Reason why a path ends if the load returns to zero.
const NO_PULL: &str = "the load returns to zero, where an obstacle under a force loses contact: prescribe its \
                       displacement instead";

/// A path followed in steps of controlled arc length.
pub(super) struct ArcLength<'n, 'm> {
    newton: &'n mut Newton<'m>,
    metric: Metric,
    at: Point,
    /// Unit tangent of the path.
    tangent: Point,
    first_length: f64,
    length: f64,
    stability: Stability,
    load_steps: usize,
}

impl<'n, 'm> ArcLength<'n, 'm> {
    pub(super) fn new(newton: &'n mut Newton<'m>, first_load: f64) -> Result<Self, ModelError> {
        let at = Point { x: vec![0.0; newton.layout.n_unknowns()], load: 0.0 };
        let direction = newton.direction(&at.x, 0.0)?;
        let metric = Metric::new(newton, &direction);
        let direction = Point { x: direction, load: 1.0 };
        let norm = metric.length(&direction);
        let mut stability = Stability::default();
        stability.observe(newton, newton.negative_directions(), 0.0, None);
        Ok(Self {
            newton,
            metric,
            tangent: scaled(&direction, 1.0 / norm),
            at,
            first_length: first_load * norm,
            length: first_load * norm,
            stability,
            load_steps: 0,
        })
    }

    /// Takes steps until the load factor is 1 or -1, but at most `max_steps` steps.
    pub(super) fn follow(
        mut self,
        max_steps: usize,
        watch: &mut dyn FnMut(&Search) -> ControlFlow<()>,
        record: &mut dyn FnMut(PathState) -> ControlFlow<()>,
    ) -> Result<PathEnd, ModelError> {
        let mut shortfall = None;
        while self.load_steps < max_steps {
            match self.next(watch)? {
                Err(why) => {
                    shortfall = Some(why);
                    break;
                }
                Ok(step) if step.to.load < 0.0 && self.newton.has_driven_obstacle() => {
                    shortfall = Some(Shortfall::NotConverged {
                        inverted: None,
                        remedy: NO_PULL.to_owned(),
                    });
                    break;
                }
                Ok(step) => {
                    if self.finish(step, record)?.is_break() {
                        break;
                    }
                }
            }
        }
        Ok(PathEnd {
            reached: self.at.load,
            load_steps: self.load_steps,
            newton_iterations: self.newton.iterations,
            critical_points: self.stability.points,
            shortfall,
            is_continued: false,
        })
    }

    /// Computes the next step, and chooses the length of the step after it.
    fn next(
        &mut self,
        watch: &mut dyn FnMut(&Search) -> ControlFlow<()>,
    ) -> Result<Result<PathStep, Shortfall>, ModelError> {
        let n_free = self.newton.n_free();
        loop {
            let tangent = &self.tangent;
            let gradient = self.newton.gradient(&tangent.x[..n_free], tangent.load);
            let length = self.length.min(GRADIENT_STEP / gradient);
            let predicted = self.at.plus(length, tangent);
            let (before_step, mut interrupted) = (self.newton.iterations, false);
            let reported = |[iteration, iterations]: [usize; 2]| {
                let flow = watch(&Search {
                    load_step: self.load_steps + 1,
                    reached: self.at.load,
                    target: predicted.load,
                    iteration,
                    iterations,
                });
                interrupted |= flow.is_break();
                flow
            };
            let found = self.newton.solve_on_sphere(self.metric, &self.at, &predicted, reported)?;
            if interrupted {
                return Ok(Err(Shortfall::Interrupted));
            }
            if let Some(to) = found
                && let Some(tangent) = self.tangent_at(&to)?
            {
                let iterations = (self.newton.iterations - before_step) as f64;
                let distance = self.metric.length(&to.plus(-1.0, &predicted)) / length;
                let factor = (ITERATIONS / iterations).sqrt().min(DISTANCE / distance);
                self.length = length * factor.clamp(0.5, 2.0);
                return Ok(Ok(PathStep { to, tangent, length }));
            }
            self.length = 0.5 * length;
            if self.length < SMALLEST_STEP * self.first_length {
                return Ok(Err(not_converged(self.newton)));
            }
        }
    }

    /// Returns the unit tangent at the equilibrium `to`. Returns `None` if the tangent turns too far or the matrix is
    /// singular.
    fn tangent_at(&mut self, to: &Point) -> Result<Option<Point>, ModelError> {
        let x = match self.newton.direction(&to.x, to.load) {
            Ok(x) => x,
            Err(ModelError::Factorization(error)) if is_singular(&error) => return Ok(None),
            Err(error) => return Err(error),
        };
        let direction = Point { x, load: 1.0 };
        let cosine = self.metric.dot(&self.tangent, &direction) / self.metric.length(&direction);
        let norm = self.metric.length(&direction).copysign(cosine);
        Ok((cosine.abs() >= SMALLEST_COSINE).then(|| scaled(&direction, 1.0 / norm)))
    }

    /// Locates a limit point and the end of the path, if they are within a step, and records the states.
    fn finish(
        &mut self,
        step: PathStep,
        record: &mut dyn FnMut(PathState) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, ModelError> {
        self.load_steps += 1;
        let curve = Curve {
            from: &self.at,
            to: &step.to,
            tangents: [&self.tangent, &step.tangent],
            length: step.length,
        };
        let turns = self.tangent.load * step.tangent.load < 0.0;
        let extremum = turns.then(|| root(0.0, 1.0, |s| curve.load_rate(s)));
        let places: Vec<f64> = [0.0].into_iter().chain(extremum).chain([1.0]).collect();
        let mut pieces = places.windows(2);
        let leaves = pieces.find(|piece| curve.load(piece[1]).abs() >= 1.0);
        let end = leaves.map(|piece| root(piece[0], piece[1], |s| curve.load(s).abs() - 1.0));
        let goes_on = |_: [usize; 2]| ControlFlow::Continue(());

        let negative = self.newton.negative_directions();
        let last = PathState::new(self.newton, &step.to.x, step.to.load);
        let mut limit = None;
        if let Some(s) = extremum.filter(|s| end.is_none_or(|end| *s < end)) {
            let predicted = curve.at(s);
            let (from, metric) = (&self.at, self.metric);
            let found = self.newton.solve_on_sphere(metric, from, &predicted, goes_on)?;
            let located = found.unwrap_or(predicted);
            limit = Some(located.load);
            // The sign of the pivot that vanishes here is arbitrary.
            let state = PathState {
                instabilities: None,
                ..PathState::new(self.newton, &located.x, located.load)
            };
            if record(state).is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        if let Some(s) = end {
            let (predicted, load) = (curve.at(s), curve.load(s).signum());
            let from = &self.at.x;
            let found = self.newton.solve(from, &predicted.x, load, false, goes_on)?;
            if let Some(x) = found {
                let negative = self.newton.negative_directions();
                self.stability.observe(self.newton, negative, load, limit);
                let state = PathState::new(self.newton, &x, load);
                self.at = Point { x, load };
                let _ = record(state);
                return Ok(ControlFlow::Break(()));
            }
        }
        self.stability.observe(self.newton, negative, step.to.load, limit);
        (self.at, self.tangent) = (step.to, step.tangent);
        let flow = record(last);
        Ok(match end {
            Some(_) => ControlFlow::Break(()),
            None => flow,
        })
    }
}

/// A step to another equilibrium.
struct PathStep {
    to: Point,
    /// Unit tangent of the path at `to`.
    tangent: Point,
    length: f64,
}

/// Cubic Hermite interpolation between two states; the parameter is 0 at the start of the step and 1 at its end.
struct Curve<'a> {
    from: &'a Point,
    to: &'a Point,
    tangents: [&'a Point; 2],
    length: f64,
}

impl Curve<'_> {
    fn at(&self, s: f64) -> Point {
        let end = s * s * (3.0 - 2.0 * s);
        let slopes = [s * (1.0 - s) * (1.0 - s), -s * s * (1.0 - s)];
        scaled(self.from, 1.0 - end)
            .plus(end, self.to)
            .plus(self.length * slopes[0], self.tangents[0])
            .plus(self.length * slopes[1], self.tangents[1])
    }

    fn load(&self, s: f64) -> f64 {
        let end = s * s * (3.0 - 2.0 * s);
        let [a, b] = self.tangents.map(|tangent| self.length * tangent.load);
        (1.0 - end) * self.from.load + end * self.to.load + s * (1.0 - s) * ((1.0 - s) * a - s * b)
    }

    fn load_rate(&self, s: f64) -> f64 {
        let change = self.to.load - self.from.load;
        let [a, b] = self.tangents.map(|tangent| self.length * tangent.load);
        6.0 * s * (1.0 - s) * change + (1.0 - s) * (1.0 - 3.0 * s) * a + s * (3.0 * s - 2.0) * b
    }
}

/// Returns a root of `f` between `low` and `high` by bisection. The signs of `f` at `low` and `high` must differ.
fn root(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let is_above = f(high) >= 0.0;
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = 0.5 * (low + high);
        match (f(middle) >= 0.0) == is_above {
            true => high = middle,
            false => low = middle,
        }
    }
    high
}

fn scaled(point: &Point, factor: f64) -> Point {
    Point { x: point.x.iter().map(|x| factor * x).collect(), load: factor * point.load }
}
