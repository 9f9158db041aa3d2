//! Finds the first time within a step at which a function of the state becomes positive.
//!
//! The function is sampled on the dense output at 2k + 1 Chebyshev points for a step of order k, and at the vertices
//! of the parabolas through neighboring samples. A sign change is then bracketed and refined. A peak between two
//! samples is missed if it is too narrow for these parabolas. Polynomials of degree k have no such narrow peaks, but
//! |u| and min det F may have them.

use std::f64::consts::PI;

use crate::error::ModelError;
use crate::integration::integrator::Integrator;

/// Number of intervals between samples, divided by the order of the step.
const SAMPLES: u32 = 2;
/// Maximum number of iterations of the Illinois method; bisection would need 53 to resolve a step.
const MAX_NARROWINGS: usize = 100;

/// Returns the first time in the last step `[from, to]` at which `excess(problem, t, y)` is positive, accurate up to
/// rounding. Returns `None` without such a time.
///
/// # Errors
/// Returns the errors of the dense output and of `excess`.
pub fn first_positive<P>(
    integrator: &mut dyn Integrator<P>,
    [from, to]: [f64; 2],
    y: &mut [f64],
    mut excess: impl FnMut(&mut P, f64, &[f64]) -> Result<f64, ModelError>,
) -> Result<Option<f64>, ModelError> {
    let n = SAMPLES * integrator.counts().last_order.max(1);
    let place =
        |k: u32| from + (to - from) * 0.5 * (1.0 - (PI * f64::from(k) / f64::from(n)).cos());
    let mut at = |t: f64| {
        integrator.dense_output(t, 0, y)?;
        excess(integrator.problem_mut(), t, y)
    };
    let (mut before, mut last) = (None, (from, at(from)?));
    if last.1 > 0.0 {
        return Ok(Some(from));
    }
    for k in 1..=n {
        let t = if k == n { to } else { place(k) };
        let next = (t, at(t)?);
        if next.1 > 0.0 {
            return narrow(last, next, &mut at).map(Some);
        }
        if let Some(before) = before
            && let Some(t) = top([before, last, next])
        {
            let peak = (t, at(t)?);
            if peak.1 > 0.0 {
                let low = if last.0 < t { last } else { before };
                return narrow(low, peak, &mut at).map(Some);
            }
        }
        (before, last) = (Some(last), next);
    }
    Ok(None)
}

/// Returns the position of the maximum of the parabola through three points if the maximum is between them.
fn top([(t0, f0), (t1, f1), (t2, f2)]: [(f64, f64); 3]) -> Option<f64> {
    let (left, right) = ((f1 - f0) / (t1 - t0), (f2 - f1) / (t2 - t1));
    let bends = left > 0.0 && right < 0.0;
    // At the midpoint of each chord, the slope equals the slope of the chord. It varies linearly in between.
    let (from, to) = (0.5 * (t0 + t1), 0.5 * (t1 + t2));
    bends.then(|| from + (to - from) * left / (left - right))
}

/// Refines a sign change between `low` (not positive) and `high` (positive) by the Illinois method. This is the secant
/// method, except that the value at an end is halved if this end is retained twice in a row.
fn narrow(
    mut low: (f64, f64),
    mut high: (f64, f64),
    at: &mut impl FnMut(f64) -> Result<f64, ModelError>,
) -> Result<f64, ModelError> {
    let tolerance = 4.0 * f64::EPSILON * high.0.abs();
    let mut last_moved = None;
    for _ in 0..MAX_NARROWINGS {
        if high.0 - low.0 <= tolerance {
            break;
        }
        let secant = high.0 - high.1 * (high.0 - low.0) / (high.1 - low.1);
        let inside = 0.5 * tolerance;
        let t = secant.clamp(low.0 + inside, high.0 - inside);
        let value = at(t)?;
        let is_high = value > 0.0;
        let stays = last_moved == Some(is_high);
        if is_high {
            high = (t, value);
            low.1 *= if stays { 0.5 } else { 1.0 };
        } else {
            low = (t, value);
            high.1 *= if stays { 0.5 } else { 1.0 };
        }
        last_moved = Some(is_high);
    }
    Ok(high.0)
}
