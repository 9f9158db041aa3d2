//! Fits from several starting points.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

use crate::error::FitError;
use crate::parameter::Parameter;
use crate::result::Fit;

/// Returns the given starting point and `count − 1` random starting points. The same `seed` returns the same points.
///
/// If both bounds of a parameter are finite, its start is drawn between them, uniformly in the logarithm if both are
/// positive. Otherwise, the start is drawn between half and twice the given start, or within ± `scale` if the given
/// start is 0, and clamped to the bounds.
pub fn several_starts(parameters: &[Parameter], count: usize, seed: u64) -> Vec<Vec<Parameter>> {
    let mut stream = ChaCha8Rng::seed_from_u64(seed);
    let mut uniform = || (stream.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    let mut moved = |parameter: &Parameter| parameter.starting_from(drawn(parameter, uniform()));
    let others = (1..count).map(|_| parameters.iter().map(&mut moved).collect());
    std::iter::once(parameters.to_vec()).chain(others).collect()
}

/// Returns the start that corresponds to a uniform random number `share` in [0, 1).
fn drawn(parameter: &Parameter, share: f64) -> f64 {
    let Parameter { start, scale, low, high, logarithmic, .. } = *parameter;
    let drawn = if low > 0.0 && high.is_finite() {
        low * (high / low).powf(share)
    } else if low.is_finite() && high.is_finite() {
        low + share * (high - low)
    } else if start == 0.0 {
        let [from, to] = [low.max(-scale), high.min(scale)];
        from + share * (to - from)
    } else {
        start * 4_f64.powf(share - 0.5)
    };
    match logarithmic {
        true => drawn.clamp(low.max(f64::MIN_POSITIVE), high),
        false => drawn.clamp(low, high),
    }
}

/// Calls `fit` with each of the `starts` and returns the fit with the smallest cost. Skips starts at which the model
/// fails.
///
/// # Examples
/// ```
/// # use myovib_fit::{Failed, Model, Options, Parameter, best_fit, fit, several_starts};
/// # struct Wave;
/// # impl Model for Wave {
/// #     fn n_residuals(&self) -> usize { 1 }
/// #     fn residuals(&mut self, p: &[f64], out: &mut [f64]) -> Result<(), Failed> {
/// #         out[0] = p[0].sin() + 0.1 * p[0];
/// #         Ok(())
/// #     }
/// # }
/// let wave = [Parameter::new("p", 4.0).within(0.5, 8.0)];
/// let starts = several_starts(&wave, 5, 1);
/// let best = best_fit(&starts, &mut |start| fit(&mut Wave, start, &Options::default()))?;
/// assert!(best.cost < 1e-12);
/// # Ok::<(), myovib_fit::FitError>(())
/// ```
///
/// # Errors
/// If the model fails at all starts, returns the error of the first start.
///
/// # Panics
/// Panics if `starts` is empty.
pub fn best_fit(
    starts: &[Vec<Parameter>],
    fit: &mut dyn FnMut(&[Parameter]) -> Result<Fit, FitError>,
) -> Result<Fit, FitError> {
    let mut starts = starts.iter();
    let first = starts.next().expect("at least one start");
    let mut best = fit(first);
    for start in starts {
        let next = fit(start);
        let better = match (&best, &next) {
            (Ok(best), Ok(next)) => next.cost < best.cost,
            (Err(_), Ok(_)) => true,
            _ => false,
        };
        if better {
            best = next;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn starts_are_within_their_ranges_and_reproducible() {
        let parameters = [
            Parameter::new("positive", 1.0).within(1e-3, 10.0),
            Parameter::new("between", 1.0).within(-1.0, 2.0),
            Parameter::new("free", -3.0),
            Parameter::new("from zero", 0.0),
            Parameter::new("above", 1.0).within(0.9, f64::INFINITY),
            Parameter::new("zero or more", 0.0).within(0.0, f64::INFINITY),
            Parameter::new("positive to a bound", 1.0).within(0.0, 5.0).positive(),
        ];
        let starts = several_starts(&parameters, 200, 7);
        assert_eq!(starts, several_starts(&parameters, 200, 7));
        assert_ne!(starts, several_starts(&parameters, 200, 8));
        assert_eq!((starts.len(), &starts[0][..]), (200, &parameters[..]));
        let ranges = [
            (1e-3, 10.0),
            (-1.0, 2.0),
            (-6.0, -1.5),
            (-1.0, 1.0),
            (0.9, 2.0),
            (0.0, 1.0),
            (0.0, 5.0),
        ];
        for (j, (low, high)) in ranges.into_iter().enumerate() {
            let all = || starts.iter().map(|start| start[j].start);
            assert!(all().all(|start| (low..=high).contains(&start)), "{j}");
            let mut starts = starts.iter();
            assert!(starts.all(|start| start[j].check().is_ok()), "{j}");
            // The draws reach both ends of the range: the probability that none of 199 draws is in a given tenth of the
            // range is 1e-9.
            let tenth = 0.1 * (high - low);
            assert!(all().any(|start| start < low + tenth), "{j}");
            let top = if j == 0 { 0.63 * high } else { high - 2.0 * tenth };
            assert!(all().any(|start| start > top), "{j}");
        }
    }
}
