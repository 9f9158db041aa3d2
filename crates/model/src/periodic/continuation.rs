//! Curves of periodic states over a parameter, by continuation in the arclength.

use super::krylov::{dot, gmres, norm};
use super::shooting::Shooting;
use crate::error::ModelError;

/// Reduction of the residual in the equations of a tangent.
const REDUCTION: f64 = 1e-9;
/// Newton iterations of a step after which steps may grow.
const FEW: usize = 2;
/// Growth of steps.
const GROWTH: f64 = 1.5;
/// Maximum number of halvings of a step.
const HALVINGS: usize = 8;
/// Distance from the end of the range, relative to its length, at which the curve ends.
const AT_THE_END: f64 = 1e-3;
/// Maximum number of secant steps to a fold.
const SECANTS: usize = 20;

/// A function that computes the state after one period for a value of the parameter.
pub(super) type Family<'a> = dyn FnMut(&[f64], f64) -> Result<Vec<f64>, ModelError> + 'a;

/// Options of a continuation.
#[derive(Debug, Clone, PartialEq)]
pub struct Continuation {
    /// Options of shooting.
    pub shooting: Shooting,
    /// Size of the parameter, to which its changes are relative.
    pub parameter_scale: f64,
    /// The curve ends at an end of this range.
    pub range: [f64; 2],
    /// Whether the parameter decreases at the start.
    pub is_descending: bool,
    /// Largest step in the arclength of (state, parameter), in units of the scales.
    pub max_step: f64,
    /// Maximum number of points.
    pub max_points: usize,
}

/// A periodic state of a curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// State at the start of the period.
    pub state: Vec<f64>,
    /// Parameter.
    pub parameter: f64,
    /// Derivative of the parameter with respect to the arclength, both relative to their scales; zero at a fold.
    pub slope: f64,
}

/// A curve of periodic states.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Points along the curve.
    pub points: Vec<Point>,
    /// Points at which the curve turns back in the parameter.
    pub folds: Vec<Point>,
    /// Reason why the curve could not be continued, if it ended early.
    pub failure: Option<String>,
}

/// Follows the curve of periodic states from the state at a parameter, which must be periodic.
///
/// # Errors
/// [`ModelError::NoPeriodicState`] if even short first steps fail; other errors of the map.
pub fn follow(
    map: &mut Family<'_>,
    (state, parameter): (&[f64], f64),
    continuation: &Continuation,
) -> Result<Curve, ModelError> {
    let mut curve = Tracer { map, continuation };
    let mut x = continuation.shooting.scaled(state);
    x.push(parameter / continuation.parameter_scale);
    let mut direction = vec![0.0; x.len()];
    direction[state.len()] = if continuation.is_descending {
        -1.0
    } else {
        1.0
    };
    let mut tangent = curve.tangent(&x, &direction)?;
    let mut points = vec![curve.point(&x, &tangent)];
    let mut folds = Vec::new();
    let mut step = 0.1 * continuation.max_step;
    let [low, high] = continuation.range;
    let margin = AT_THE_END * (high - low);
    while points.len() < continuation.max_points {
        let mut halvings = 0;
        // The predicted parameter stays within the range.
        let slope = continuation.parameter_scale * tangent[state.len()];
        let now = points.last().map_or(parameter, |last| last.parameter);
        let room = if slope < 0.0 { low - now } else { high - now };
        if room / slope > 0.0 {
            step = step.min(room / slope);
        }
        let advanced = loop {
            match curve.advance(&x, &tangent, step) {
                Err(ModelError::NoPeriodicState { .. } | ModelError::PeriodStopped { .. })
                    if halvings < HALVINGS =>
                {
                    halvings += 1;
                    step *= 0.5;
                }
                advanced => break advanced,
            }
        };
        let Advance {
            x: next,
            tangent: next_tangent,
            point,
            fold,
            iterations,
        } = match advanced {
            Ok(advanced) => advanced,
            Err(error) if points.len() > 1 => {
                return Ok(Curve {
                    points,
                    folds,
                    failure: Some(error.to_string()),
                });
            }
            Err(error) => return Err(error),
        };
        folds.extend(fold);
        let is_inside = (low..=high).contains(&point.parameter);
        let ahead = if point.slope < 0.0 {
            point.parameter - low
        } else {
            high - point.parameter
        };
        points.push(point);
        if !is_inside || ahead <= margin {
            return Ok(Curve {
                points,
                folds,
                failure: None,
            });
        }
        (x, tangent) = (next, next_tangent);
        if iterations <= FEW {
            step = (GROWTH * step).min(continuation.max_step);
        }
    }
    Ok(Curve {
        failure: Some(format!("it has max_points = {} points", points.len())),
        points,
        folds,
    })
}

/// The next point of a curve.
struct Advance {
    x: Vec<f64>,
    tangent: Vec<f64>,
    point: Point,
    /// Fold before the point.
    fold: Option<Point>,
    /// Number of Newton iterations.
    iterations: usize,
}

/// Steps along a curve; x = (state, parameter) relative to their scales.
struct Tracer<'a, 'm> {
    map: &'a mut Family<'m>,
    continuation: &'a Continuation,
}

impl Tracer<'_, '_> {
    /// Returns y(T; x) − y.
    fn residual(&mut self, x: &[f64]) -> Result<Vec<f64>, ModelError> {
        let Continuation {
            shooting,
            parameter_scale,
            ..
        } = self.continuation;
        let (state, parameter) = x.split_at(x.len() - 1);
        let end = (self.map)(&shooting.unscaled(state), parameter[0] * parameter_scale)?;
        let end = shooting.scaled(&end);
        Ok(end.iter().zip(state).map(|(end, y)| end - y).collect())
    }

    /// Returns the unit tangent of the curve at x in the `direction` of an approximation.
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

    /// Returns the point of the curve at a distance along the tangent at x, and the number of iterations.
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

    /// Returns the point at a distance along the tangent at x, and a fold in between.
    fn advance(&mut self, x: &[f64], tangent: &[f64], step: f64) -> Result<Advance, ModelError> {
        let (next, iterations) = self.step(x, tangent, step)?;
        let next_tangent = self.tangent(&next, tangent)?;
        let point = self.point(&next, &next_tangent);
        let fold = match tangent[tangent.len() - 1] * point.slope < 0.0 {
            true => Some(self.fold(x, tangent, (step, point.slope))?),
            false => None,
        };
        Ok(Advance {
            x: next,
            tangent: next_tangent,
            point,
            fold,
            iterations,
        })
    }

    /// Returns the point with slope zero between x and the point at a distance `end`, by the Illinois method.
    fn fold(
        &mut self,
        x: &[f64],
        tangent: &[f64],
        (end, slope_at_end): (f64, f64),
    ) -> Result<Point, ModelError> {
        let mut a = (0.0, tangent[tangent.len() - 1]);
        let mut b = (end, slope_at_end);
        let tolerance = self.continuation.shooting.increment().powi(2);
        let mut secants = 0;
        loop {
            let s = (a.0 * b.1 - b.0 * a.1) / (b.1 - a.1);
            let (at, _) = self.step(x, tangent, s)?;
            let own = self.tangent(&at, tangent)?;
            let point = self.point(&at, &own);
            secants += 1;
            if point.slope.abs() <= tolerance || secants == SECANTS {
                return Ok(point);
            }
            match point.slope * b.1 < 0.0 {
                true => a = b,
                false => a.1 *= 0.5,
            }
            b = (s, point.slope);
        }
    }

    fn point(&self, x: &[f64], tangent: &[f64]) -> Point {
        let n = x.len() - 1;
        Point {
            state: self.continuation.shooting.unscaled(&x[..n]),
            parameter: x[n] * self.continuation.parameter_scale,
            slope: tangent[n],
        }
    }
}
