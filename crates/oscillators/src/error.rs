//! The error type of this crate.

/// Invalid description of oscillators or of a measurement.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the messages name the fields")]
pub enum Error {
    /// The number of oscillators N is zero.
    #[error("at least one oscillator is required, found N = 0")]
    NoOscillators,
    /// A natural frequency is not positive or not finite.
    #[error("oscillator {number}: the frequency must be positive and finite, found {value} rad/s")]
    Frequency {
        /// One-based index of the oscillator, as in the paper.
        number: usize,
        /// Frequency found, in rad/s.
        value: f64,
    },
    /// A coefficient is NaN or infinite.
    #[error("coefficient {name} must be finite, found {value}")]
    Coefficient { name: &'static str, value: f64 },
    /// The half width of the frequency interval is negative or not finite.
    #[error(
        "the half width of the frequency interval must be non-negative and finite, found {value}"
    )]
    HalfWidth {
        /// Half width found, in rad/s.
        value: f64,
    },
    /// The number of frequencies does not match the array.
    #[error("an array of {columns} × {rows} oscillators requires {} frequencies, found {given}",
        columns.saturating_mul(*rows))]
    ArrayFrequencies {
        /// Oscillators along the first axis.
        columns: usize,
        /// Oscillators along the second axis.
        rows: usize,
        given: usize,
    },
    /// A trailing window contains fewer than two samples.
    #[error("the trailing window of {window} s contains {found} samples; at least 2 are required")]
    Window {
        /// Length of the window in seconds.
        window: f64,
        /// Number of samples in the window.
        found: usize,
    },
    /// The radius of a neighborhood is not positive or not finite.
    #[error("the radius of a neighborhood must be positive and finite, found {value}")]
    Radius { value: f64 },
    /// The smoothing radius is not positive or not finite.
    #[error("the smoothing radius must be positive and finite, found {value}")]
    SmoothingRadius { value: f64 },
}
