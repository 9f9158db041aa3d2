//! Natural frequencies drawn from an interval by a named, seeded generator.

use std::f64::consts::PI;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use rand_mt::Mt;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::Error;

/// A stream of pseudo-random numbers, uniform on [0, 1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Generator {
    /// MT19937, as used by MATLAB's `rand`; seed 5489 corresponds to `rng(0)`.
    #[default]
    Matlab,
    /// ChaCha with 8 rounds.
    ChaCha8,
}

impl Generator {
    /// Returns the first `n` numbers of the stream with this seed, each in [0, 1).
    ///
    /// MT19937 generates doubles with 53 random bits; MATLAB's default stream (`rng(0)` or `rng default`) has
    /// seed 5489. ChaCha is seeded by `seed_from_u64` and uses the upper 53 bits of each 64-bit word.
    ///
    /// # Examples
    /// ```
    /// use myovib_oscillators::{Detuning, Generator};
    /// let numbers = Generator::Matlab.uniform(Detuning::DEFAULT_SEED, 3);
    /// assert_eq!(numbers, [0.8147236863931789, 0.9057919370756192, 0.12698681629350606]);
    /// ```
    pub fn uniform(self, seed: u32, n: usize) -> Vec<f64> {
        match self {
            Self::Matlab => {
                let mut stream = Mt::new(seed);
                let mut word = || u64::from(stream.next_u32());
                (0..n).map(|_| unit_interval((word() >> 5) << 26 | word() >> 6)).collect()
            }
            Self::ChaCha8 => {
                let mut stream = ChaCha8Rng::seed_from_u64(u64::from(seed));
                (0..n).map(|_| unit_interval(stream.next_u64() >> 11)).collect()
            }
        }
    }
}

/// Converts a 53-bit integer to a double in [0, 1), exactly.
fn unit_interval(bits: u64) -> f64 {
    bits as f64 / (1_u64 << 53) as f64
}

/// Frequencies distributed around a center: `ω_n = center + ξ_n`, where ξ_n is uniform in ±`half_width`.
///
/// Paper: section 3.1, ω_n = 16π + ξ_n, where ξ_n is a number from MATLAB's `rand`, mapped to the interval.
///
/// # Units
/// `center` and `half_width` are in rad/s.
///
/// # Examples
/// ```
/// use myovib_oscillators::Detuning;
/// # fn main() -> Result<(), myovib_oscillators::Error> {
/// let omega = Detuning { half_width: 0.5, ..Detuning::default() }.frequencies(5)?;
/// assert!(omega.iter().all(|w| (w - 16.0 * std::f64::consts::PI).abs() <= 0.5));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detuning {
    /// Center frequency in rad/s.
    pub center: f64,
    /// Half the width of the interval in rad/s; 0 makes all oscillators identical.
    pub half_width: f64,
    /// Generator of the random numbers.
    pub generator: Generator,
    /// Seed of the generator.
    pub seed: u32,
}

impl Detuning {
    /// Default seed of the Mersenne Twister and of MATLAB.
    pub const DEFAULT_SEED: u32 = Mt::DEFAULT_SEED;

    /// Returns the frequencies ω_1 … ω_N.
    ///
    /// # Errors
    /// Returns [`Error::NoOscillators`] for N = 0, and [`Error::HalfWidth`] if the half width is negative or not
    /// finite.
    pub fn frequencies(&self, n: usize) -> Result<Vec<f64>, Error> {
        let Self { center, half_width, generator, seed } = *self;
        if n == 0 {
            return Err(Error::NoOscillators);
        }
        if !(half_width >= 0.0 && half_width.is_finite()) {
            return Err(Error::HalfWidth { value: half_width });
        }
        let numbers = generator.uniform(seed, n);
        Ok(numbers.iter().map(|x| center + half_width * (2.0 * x - 1.0)).collect())
    }
}

impl Default for Detuning {
    /// Returns the values of the paper's section 3.1: 8 Hz ± 0.05 rad/s from MATLAB's default stream.
    fn default() -> Self {
        Self {
            center: 16.0 * PI,
            half_width: 0.05,
            generator: Generator::Matlab,
            seed: Self::DEFAULT_SEED,
        }
    }
}
