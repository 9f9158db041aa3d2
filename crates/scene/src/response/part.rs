//! Real columns that represent complex values.

use num_complex::Complex64;

use super::phase;

/// A real number derived from a complex value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Part {
    Real,
    Imaginary,
    Amplitude,
    /// Phase in degrees.
    Phase,
}

impl Part {
    /// All parts in the order of the columns.
    pub(crate) const ALL: [Self; 4] = [Self::Real, Self::Imaginary, Self::Amplitude, Self::Phase];

    /// Returns the names of the columns for a value `u`: `u_re`, `u_im`, `u_amplitude` and `u_phase`.
    pub(crate) fn columns(value: &str) -> [String; 4] {
        ["re", "im", "amplitude", "phase"].map(|part| format!("{value}_{part}"))
    }

    /// Returns the part in the column with the zero-based index `column`, not counting the frequency.
    pub(crate) fn of_column(column: usize) -> Self {
        Self::ALL[column % Self::ALL.len()]
    }

    pub(crate) fn of(self, z: Complex64) -> f64 {
        match self {
            Self::Real => z.re,
            Self::Imaginary => z.im,
            Self::Amplitude => z.norm(),
            Self::Phase => phase(z),
        }
    }

    /// Returns the derivative of this part of `z`, given the derivative of `z`. If `z` is zero, the derivatives of the
    /// amplitude and phase are NaN.
    pub(crate) fn derivative(self, z: Complex64, derivative: Complex64) -> f64 {
        match self {
            Self::Real => derivative.re,
            Self::Imaginary => derivative.im,
            Self::Amplitude => (z.conj() * derivative).re / z.norm(),
            Self::Phase => (derivative / z).im.to_degrees(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_parts() {
        let (z, derivative, step) = (Complex64::new(-0.3, 1.2), Complex64::new(2.0, 0.7), 1e-5);
        for part in Part::ALL {
            let at = |step: f64| part.of(z + step * derivative);
            let slope = (at(step) - at(-step)) / (2.0 * step);
            // The truncation error is the square of the step; the rounding error is 1e-16 times a phase of 100°,
            // divided by the step.
            assert!((part.derivative(z, derivative) - slope).abs() < 1e-8 * slope.abs());
        }
    }
}
