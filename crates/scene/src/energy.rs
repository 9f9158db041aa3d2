//! Work and dissipated energy, integrated over time from the corresponding powers.

use myovib_model::{Energies, Powers};

use crate::probe::nan_of_null;

/// Work and dissipated energy since the start (J; in 2D, J per meter of depth).
#[derive(Debug, Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
pub struct Exchanged {
    /// Work done by loads, moving supports and active stresses.
    #[serde(deserialize_with = "nan_of_null")]
    pub work: f64,
    /// Energy dissipated by damping.
    #[serde(deserialize_with = "nan_of_null")]
    pub dissipated: f64,
}

impl Exchanged {
    /// Points of the Gauss quadrature rule of degree 7, as fractions of an interval.
    ///
    /// Simpson's rule is too inaccurate for the large steps of the Radau IIA methods of orders 9 and 13: its error
    /// would dominate the energy imbalance and would barely decrease with the tolerance. All points are in the interior
    /// of the interval because powers may jump at its ends.
    pub const PLACES: [f64; 4] = [
        0.069_431_844_202_973_71,
        0.330_009_478_207_571_9,
        0.669_990_521_792_428_1,
        0.930_568_155_797_026_3,
    ];
    const WEIGHTS: [f64; 4] = [
        0.173_927_422_568_726_93,
        0.326_072_577_431_273_07,
        0.326_072_577_431_273_07,
        0.173_927_422_568_726_93,
    ];

    /// Adds the energy exchanged during an interval of `h` seconds. `at` contains the powers at the points
    /// [`PLACES`](Self::PLACES).
    pub fn add(&mut self, h: f64, at: &[Powers; 4]) {
        let integral = |power: fn(&Powers) -> f64| {
            let terms = Self::WEIGHTS.iter().zip(at);
            h * terms.map(|(weight, at)| weight * power(at)).sum::<f64>()
        };
        self.work += integral(|e| e.load + e.support + e.active);
        self.dissipated += integral(|e| e.dissipation);
    }

    /// Returns the energy imbalance: the sum of the kinetic, elastic and dissipated energies minus the work. It is zero
    /// for the exact motion.
    pub fn imbalance(&self, now: &Energies) -> f64 {
        now.kinetic + now.elastic + self.dissipated - self.work
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that powers up to t⁷ are integrated exactly: the integral of (n + 1) tⁿ over [0, 2] is 2ⁿ⁺¹.
    #[test]
    fn powers_of_degree_7_are_integrated_exactly() {
        for degree in 0..=7 {
            let at = |t: f64| Powers {
                load: 2.0 * t.powi(degree),
                support: 0.5 * t.powi(degree),
                active: 0.5 * t.powi(degree),
                dissipation: 0.5 * t.powi(degree),
            };
            let mut exchanged = Exchanged::default();
            exchanged.add(2.0, &Exchanged::PLACES.map(|place| at(2.0 * place)));
            let exact = 2.0_f64.powi(degree + 1) / f64::from(degree + 1);
            // The tolerance allows for 24 rounding errors in sums of up to 60 plus three times the exact value.
            let allowed = 24.0 * f64::EPSILON * (60.0 + 3.0 * exact);
            for (found, expected) in [
                (exchanged.work, 3.0 * exact),
                (exchanged.dissipated, 0.5 * exact),
                (
                    exchanged.imbalance(&Energies { kinetic: 50.0, elastic: 10.0 }),
                    60.0 - 2.5 * exact,
                ),
            ] {
                let error = (found - expected).abs();
                assert!(error < allowed, "{degree}: {error:e}");
            }
        }
    }
}
