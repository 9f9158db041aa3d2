//! Curves of periodic states as a function of a parameter, by arc-length continuation.

use super::krylov::{dot, gmres, norm};
use super::shooting::Shooting;
use crate::error::ModelError;

/// Relative residual of the linear solve for a tangent.
const REDUCTION: f64 = 1e-9;
/// The next step may be longer if a step requires at most this number of Newton iterations.
const FEW: usize = 2;
const GROWTH: f64 = 1.5;
/// Maximum number of times that a step is halved.
const HALVINGS: usize = 8;
/// Distance from an end of the range, relative to the length of the range, at which the curve ends.
const AT_THE_END: f64 = 1e-3;
/// Maximum number of secant steps for locating a fold.
const SECANTS: usize = 20;

/// A function that computes the state after one period for a value of the parameter.
pub(super) type Family<'a> = dyn FnMut(&[f64], f64) -> Result<Vec<f64>, ModelError> + 'a;

/// Options of a continuation.
#[derive(Debug, Clone, PartialEq)]
pub struct Continuation {
    /// Options of shooting.
    pub shooting: Shooting,
    /// Scale of the parameter, to which its changes are relative.
    pub parameter_scale: f64,
    /// Range of the parameter. The curve ends when the parameter reaches either end.
    pub range: [f64; 2],
    /// Whether the parameter decreases at the start.
    pub is_descending: bool,
    /// Largest arc-length step of the scaled state and parameter.
    pub max_step: f64,
    /// Maximum number of points.
    pub max_points: usize,
}

/// A periodic state on a curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// State at the start of the period.
    pub state: Vec<f64>,
    /// Value of the parameter.
    pub parameter: f64,
    /// Whether the parameter reverses its direction at this point.
    pub is_fold: bool,
}

/// Follows the curve of periodic states from the periodic `state` at `parameter` to an end of the range. `visit`
/// receives the points along the curve, including the start and all folds.
///
/// # Errors
/// Fails if the curve ends inside the range. The reasons are [`ModelError::NoPeriodicState`] if even short steps fail,
/// [`ModelError::CurveTooLong`] if `max_points` is reached, and errors of the map and of `visit`.
pub fn follow(
    map: &mut Family<'_>,
    (state, parameter): (&[f64], f64),
    continuation: &Continuation,
    visit: &mut dyn FnMut(Point) -> Result<(), ModelError>,
) -> Result<(), ModelError> {
    let mut curve = Tracer { map, continuation };
    let mut x = continuation.shooting.scaled(state);
    x.push(parameter / continuation.parameter_scale);
    visit(curve.point(&x, false))?;
    let mut direction = vec![0.0; x.len()];
    direction[state.len()] = if continuation.is_descending { -1.0 } else { 1.0 };
    let mut tangent = curve.tangent(&x, &direction)?;
    let mut step = 0.1 * continuation.max_step;
    for _ in 1..continuation.max_points {
        let advance = curve.advance_in_range(&x, &tangent, &mut step)?;
        for (target, is_fold) in advance.fold.iter().map(|x| (x, true)).chain([(&advance.x, false)])
        {
            if let Some(bound) = curve.bound_beyond(target, &advance.tangent, is_fold) {
                return visit(curve.at_bound(&x, target, bound)?);
            }
            visit(curve.point(target, is_fold))?;
        }
        (x, tangent) = (advance.x, advance.tangent);
        if advance.iterations <= FEW {
            step = (GROWTH * step).min(continuation.max_step);
        }
    }
    Err(ModelError::CurveTooLong { max_points: continuation.max_points })
}

/// The next point of a curve.
struct Advance {
    x: Vec<f64>,
    tangent: Vec<f64>,
    /// Fold between the previous point and this point.
    fold: Option<Vec<f64>>,
    iterations: usize,
}

/// Method for taking steps along a curve. x contains the scaled state, followed by the scaled parameter.
struct Tracer<'a, 'm> {
    map: &'a mut Family<'m>,
    continuation: &'a Continuation,
}

impl Tracer<'_, '_> {
    /// Returns y(T; x) − y.
    fn residual(&mut self, x: &[f64]) -> Result<Vec<f64>, ModelError> {
        let Continuation { shooting, parameter_scale, .. } = self.continuation;
        let (state, parameter) = x.split_at(x.len() - 1);
        let end = (self.map)(&shooting.unscaled(state), parameter[0] * parameter_scale)?;
        let end = shooting.scaled(&end);
        Ok(end.iter().zip(state).map(|(end, y)| end - y).collect())
    }

    /// Returns the unit tangent of the curve at x. `direction` approximates the tangent and determines its orientation.
    fn tangent(&mut self, x: &[f64], direction: &[f64]) -> Result<Vec<f64>, ModelError> {
        let continuation = self.continuation;
        let shooting = &continuation.shooting;
        let mut product = |v: &[f64]| {
            let mut out = shooting.product(&mut |x| self.residual(x), x, v)?;
            out.push(dot(direction, v));
            Ok(out)
        };
        let mut right = vec![0.0; x.len()];
        right[x.len() - 1] = 1.0;
        let most = shooting.max_products;
        let mut tangent = gmres(&mut product, &right, REDUCTION, most)?;
        let size = norm(&tangent);
        tangent.iter_mut().for_each(|t| *t /= size);
        Ok(tangent)
    }

    /// Returns the point of the curve at the distance `step` from x along the tangent, and the number of iterations.
    fn step(
        &mut self,
        x: &[f64],
        tangent: &[f64],
        step: f64,
    ) -> Result<(Vec<f64>, usize), ModelError> {
        let continuation = self.continuation;
        let predicted: Vec<f64> = x.iter().zip(tangent).map(|(x, t)| x + step * t).collect();
        let mut residual = |x: &[f64]| {
            let mut out = self.residual(x)?;
            let moved: Vec<f64> = x.iter().zip(&predicted).map(|(x, p)| x - p).collect();
            out.push(dot(tangent, &moved));
            Ok(out)
        };
        let shooting = &continuation.shooting;
        let (x, _, iterations) = shooting.solve(&mut residual, predicted.clone())?;
        Ok((x, iterations))
    }

    /// Returns the next point, at a distance of at most `step`. The prediction of the point is in the range. Halves
    /// `step` each time Newton's method or the map fails.
    fn advance_in_range(
        &mut self,
        x: &[f64],
        tangent: &[f64],
        step: &mut f64,
    ) -> Result<Advance, ModelError> {
        let n = x.len() - 1;
        let [low, high] = self.scaled_range();
        let bound = if tangent[n] < 0.0 { low } else { high };
        let room = (bound - x[n]) / tangent[n];
        if room > 0.0 {
            *step = step.min(room);
        }
        for _ in 0..HALVINGS {
            match self.advance(x, tangent, *step) {
                Err(ModelError::NoPeriodicState { .. } | ModelError::PeriodStopped { .. }) => {
                    *step *= 0.5;
                }
                advanced => return advanced,
            }
        }
        self.advance(x, tangent, *step)
    }

    fn scaled_range(&self) -> [f64; 2] {
        let Continuation { range, parameter_scale, .. } = self.continuation;
        range.map(|bound| bound / parameter_scale)
    }

    /// Returns the bound of the range that x has passed. Unless x is a fold, also returns a bound that the curve is
    /// about to reach along the tangent.
    fn bound_beyond(&self, x: &[f64], tangent: &[f64], is_fold: bool) -> Option<f64> {
        let n = x.len() - 1;
        let [low, high] = self.scaled_range();
        let margin = if is_fold { 0.0 } else { AT_THE_END * (high - low) };
        let reaches = |ahead: f64, is_ahead: bool| ahead < 0.0 || is_ahead && ahead <= margin;
        let [first, last] = self.continuation.range;
        match () {
            () if reaches(x[n] - low, tangent[n] < 0.0) => Some(first),
            () if reaches(high - x[n], tangent[n] > 0.0) => Some(last),
            () => None,
        }
    }

    /// Returns the point of the curve near the line from x to `target` at which the parameter equals `bound`.
    fn at_bound(&mut self, x: &[f64], target: &[f64], bound: f64) -> Result<Point, ModelError> {
        let n = x.len() - 1;
        let shooting = &self.continuation.shooting;
        let scaled = bound / self.continuation.parameter_scale;
        let share = ((scaled - x[n]) / (target[n] - x[n])).clamp(0.0, 1.0);
        let both = x[..n].iter().zip(target);
        let guess = both.map(|(x, target)| x + share * (target - x)).collect();
        let mut residual = |state: &[f64]| self.residual(&[state, &[scaled]].concat());
        let (state, _, _) = shooting.solve(&mut residual, guess)?;
        Ok(Point { state: shooting.unscaled(&state), parameter: bound, is_fold: false })
    }

    /// Advances by the distance `step` along the tangent at x. The result includes the fold between the two points, if
    /// there is one.
    fn advance(&mut self, x: &[f64], tangent: &[f64], step: f64) -> Result<Advance, ModelError> {
        let n = x.len() - 1;
        let (next, iterations) = self.step(x, tangent, step)?;
        let next_tangent = self.tangent(&next, tangent)?;
        let fold = match tangent[n] * next_tangent[n] < 0.0 {
            true => Some(self.fold(x, tangent, (step, next_tangent[n]))?),
            false => None,
        };
        Ok(Advance { x: next, tangent: next_tangent, fold, iterations })
    }

    /// Locates the fold between x and the point at the distance `end` by the Illinois method. At a fold, the parameter
    /// does not change along the tangent.
    fn fold(
        &mut self,
        x: &[f64],
        tangent: &[f64],
        (end, slope_at_end): (f64, f64),
    ) -> Result<Vec<f64>, ModelError> {
        let n = x.len() - 1;
        let mut a = (0.0, tangent[n]);
        let mut b = (end, slope_at_end);
        let tolerance = self.continuation.shooting.increment().powi(2);
        let mut secants = 0;
        loop {
            let s = (a.0 * b.1 - b.0 * a.1) / (b.1 - a.1);
            let (at, _) = self.step(x, tangent, s)?;
            let slope = self.tangent(&at, tangent)?[n];
            secants += 1;
            if slope.abs() <= tolerance || secants == SECANTS {
                return Ok(at);
            }
            match slope * b.1 < 0.0 {
                true => a = b,
                false => a.1 *= 0.5,
            }
            b = (s, slope);
        }
    }

    fn point(&self, x: &[f64], is_fold: bool) -> Point {
        let n = x.len() - 1;
        Point {
            state: self.continuation.shooting.unscaled(&x[..n]),
            parameter: x[n] * self.continuation.parameter_scale,
            is_fold,
        }
    }
}
