//! Statistics of a recorded quantity over a trailing window.

use serde::Serialize;

use crate::error::Error;

/// Mean, range and standard deviation of a quantity over the last part of a recording.
///
/// Mean and standard deviation are time averages, computed with the trapezoidal rule. If the samples resolve the
/// quantity, these averages do not depend on the sampling times.
///
/// # Examples
/// ```
/// use myovib_oscillators::Settled;
/// # fn main() -> Result<(), myovib_oscillators::Error> {
/// let t = [0.0, 1.0, 2.0, 4.0];
/// let settled = Settled::over_window(&t, &[9.0, 1.0, 2.0, 2.0], 3.0)?;
/// assert_eq!((settled.min, settled.max, settled.samples), (1.0, 2.0, 3));
/// assert_eq!(settled.mean, (1.5 + 4.0) / 3.0);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Settled {
    /// Time average.
    pub mean: f64,
    /// Smallest sample.
    pub min: f64,
    /// Largest sample.
    pub max: f64,
    /// Standard deviation, as a time average.
    pub std: f64,
    /// Number of samples in the window.
    pub samples: usize,
}

impl Settled {
    /// Computes the statistics of the samples in the last `window` seconds.
    ///
    /// # Shapes
    /// `t` (ascending) and `values` have the same length.
    ///
    /// # Errors
    /// Returns [`Error::Window`] if the window contains fewer than two samples or has no duration. A NaN window
    /// contains no samples.
    ///
    /// # Panics
    /// Panics if the lengths differ.
    pub fn over_window(t: &[f64], values: &[f64], window: f64) -> Result<Self, Error> {
        assert_eq!(t.len(), values.len(), "one value per time");
        let before = |time: &f64| match t.last() {
            Some(end) => window.is_nan() || *time < end - window,
            None => false,
        };
        let first = t.partition_point(before);
        let (t, values) = (&t[first..], &values[first..]);
        if t.len() < 2 || t[t.len() - 1] <= t[0] {
            return Err(Error::Window { window, found: t.len() });
        }
        let average = |f: &dyn Fn(f64) -> f64| {
            let panels = t.windows(2).zip(values.windows(2));
            panels.map(|(t, v)| (t[1] - t[0]) * (f(v[0]) + f(v[1])) / 2.0).sum::<f64>()
                / (t[t.len() - 1] - t[0])
        };
        let mean = average(&|v| v);
        Ok(Self {
            mean,
            min: values.iter().copied().fold(f64::INFINITY, f64::min),
            max: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            std: average(&|v| (v - mean).powi(2)).sqrt(),
            samples: t.len(),
        })
    }
}
