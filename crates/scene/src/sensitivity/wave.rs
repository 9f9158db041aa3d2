//! Plane shear waves in a material with a complex shear modulus.

use num_complex::Complex64;

use crate::scene_file::identification::{ShearWave, WaveQuantity};

impl ShearWave {
    /// Returns the wave speed (m/s) or the attenuation (1/m) for the shear modulus G* at the angular frequency ω. The
    /// slowness k/ω = √(ρ/G*) has a negative imaginary part.
    pub(super) fn of(&self, omega: f64, modulus: Complex64) -> f64 {
        let slowness = (self.density / modulus).sqrt();
        match self.quantity {
            WaveQuantity::Speed => 1.0 / slowness.re,
            WaveQuantity::Attenuation => -omega * slowness.im,
        }
    }

    /// Returns the derivative of the wave speed or attenuation, given the derivative `slope` of G*.
    pub(super) fn derivative(&self, omega: f64, modulus: Complex64, slope: Complex64) -> f64 {
        let slowness = (self.density / modulus).sqrt();
        let change = -0.5 * slowness * slope / modulus;
        match self.quantity {
            WaveQuantity::Speed => -change.re / slowness.re.powi(2),
            WaveQuantity::Attenuation => -omega * change.im,
        }
    }

    /// Returns the name and unit of the wave speed or attenuation.
    pub(super) fn label(&self) -> &'static str {
        match self.quantity {
            WaveQuantity::Speed => "wave speed, m/s",
            WaveQuantity::Attenuation => "attenuation, 1/m",
        }
    }

    /// Returns whether a measured wave speed or attenuation can have this value.
    pub(crate) fn accepts(&self, value: f64) -> bool {
        match self.quantity {
            WaveQuantity::Speed => value > 0.0,
            WaveQuantity::Attenuation => value >= 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares the results with c = √(2 |G|²/(ρ (G' + |G|))) and the attenuation √(ρ ω² (|G| − G')/(2 |G|²)).
    #[test]
    fn waves_have_the_closed_form_and_its_derivative() {
        let (density, omega) = (1100.0, 377.0);
        let (modulus, slope) = (Complex64::new(1500.0, 620.0), Complex64::new(0.4, -1.3));
        let size = modulus.norm();
        let expected = [
            (2.0 * size.powi(2) / (density * (modulus.re + size))).sqrt(),
            omega * (density * (size - modulus.re) / 2.0).sqrt() / size,
        ];
        let quantities = [WaveQuantity::Speed, WaveQuantity::Attenuation];
        for (quantity, expected) in quantities.into_iter().zip(expected) {
            let wave = ShearWave { quantity, density };
            assert!((wave.of(omega, modulus) / expected - 1.0).abs() < 1e-14);
            let step = 1e-2;
            let at = |step: f64| wave.of(omega, modulus + step * slope);
            let difference = (at(step) - at(-step)) / (2.0 * step);
            let derivative = wave.derivative(omega, modulus, slope);
            // The truncation error is (1e-2/1e3)², and the rounding error is 1e-16 divided by 1e-5.
            assert!((derivative / difference - 1.0).abs() < 1e-9);
        }
    }
}
