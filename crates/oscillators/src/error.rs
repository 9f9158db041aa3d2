//! The one error type of this crate.

/// What is wrong with the description of the oscillators.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// N = 0.
    #[error("at least one oscillator is needed, got N = 0")]
    NoOscillators,
    /// ω_n enters as a divisor and must be a positive number.
    #[error("oscillator {number}: the frequency must be positive and finite, got {value} rad/s")]
    Frequency {
        /// Number of the oscillator, counted from 1 as in the paper.
        number: usize,
        /// The refused frequency in rad/s.
        value: f64,
    },
    /// A coefficient is not a finite number.
    #[error("the coefficient {name} must be finite, got {value}")]
    Coefficient {
        /// Name of the coefficient.
        name: &'static str,
        /// The refused value.
        value: f64,
    },
    /// The interval of the detuning is negative or not a number.
    #[error("the half width of the frequency interval must be at least 0 and finite, got {value}")]
    HalfWidth {
        /// The refused half width in rad/s.
        value: f64,
    },
    /// No generator has this name.
    #[error("unknown random generator \"{name}\"; allowed are {allowed}")]
    UnknownGenerator {
        /// The name asked for.
        name: String,
        /// The names that exist.
        allowed: String,
    },
    /// The frequencies do not fill the array.
    #[error("an array of {columns} × {rows} oscillators needs {} frequencies, got {given}",
        columns.saturating_mul(*rows))]
    ArrayFrequencies {
        /// Oscillators along the first axis.
        columns: usize,
        /// Oscillators along the second axis.
        rows: usize,
        /// Number of frequencies given.
        given: usize,
    },
    /// A trailing window with too little in it.
    #[error("the trailing window of {window} s holds {found} samples, at least 2 are needed")]
    Window {
        /// Length of the window in seconds.
        window: f64,
        /// Number of samples inside.
        found: usize,
    },
    /// The radius of a neighbourhood is not a positive number.
    #[error("the radius of a neighbourhood must be positive and finite, got {value}")]
    Radius {
        /// The refused radius.
        value: f64,
    },
    /// The smoothing radius would not smooth.
    #[error("the smoothing radius must be positive and finite, got {value}")]
    SmoothingRadius {
        /// The refused radius.
        value: f64,
    },
}
