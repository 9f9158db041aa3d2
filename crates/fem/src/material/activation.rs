//! Tension as an unknown of its own: Bestel's model of activation.

use crate::error::FemError;

/// `Ṫ = −|a(t)| T + σ0 max(a(t), 0)`, `a = a_max f + a_min (1 − f)`,
/// `f = ¼ (1 + tanh((t − t_sys)/γ)) (1 − tanh((t − t_dias)/γ))`.
///
/// Source: Bestel, Clément, Sorine 2001; constants by Aróstica et al. 2025.
///
/// # Units
/// σ0 and T in Pa, a in 1/s, times in s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bestel {
    /// σ0.
    pub tension: f64,
    /// a_max.
    pub rise: f64,
    /// a_min, negative.
    pub decay: f64,
    /// t_sys.
    pub systole: f64,
    /// t_dias.
    pub diastole: f64,
    /// γ.
    pub width: f64,
}

impl Bestel {
    /// The constants of Aróstica et al. for a tension σ0.
    pub fn ventricle(tension: f64) -> Self {
        Self {
            tension,
            rise: 5.0,
            decay: -30.0,
            systole: 0.16,
            diastole: 0.484,
            width: 0.005,
        }
    }

    /// Checks the constants.
    ///
    /// # Errors
    /// [`FemError::Parameter`].
    pub fn check(&self) -> Result<(), FemError> {
        let positive = |name, value: f64| (name, value, value > 0.0, "positive and finite");
        for (name, value, fits, condition) in [
            (
                "activation tension",
                self.tension,
                self.tension >= 0.0,
                "zero or positive, and finite",
            ),
            positive("activation rise", self.rise),
            (
                "activation decay",
                self.decay,
                self.decay < 0.0,
                "negative and finite",
            ),
            positive("activation width", self.width),
            (
                "diastole",
                self.diastole,
                self.diastole > self.systole,
                "after systole",
            ),
        ] {
            if !(fits && value.is_finite()) {
                return Err(FemError::Parameter {
                    name,
                    value,
                    condition,
                });
            }
        }
        Ok(())
    }

    /// a(t).
    pub fn activation(&self, t: f64) -> f64 {
        let up = 1.0 + ((t - self.systole) / self.width).tanh();
        let down = 1.0 - ((t - self.diastole) / self.width).tanh();
        let f = 0.25 * up * down;
        self.rise * f + self.decay * (1.0 - f)
    }

    /// Ṫ.
    pub fn rate(&self, t: f64, tension: f64) -> f64 {
        let a = self.activation(t);
        self.tension * a.max(0.0) - a.abs() * tension
    }

    /// ∂Ṫ/∂T.
    pub fn rate_slope(&self, t: f64) -> f64 {
        -self.activation(t).abs()
    }

    /// Times at which a step should end, in order: the two switches, and the sign changes of a
    /// between them, where |a| has kinks; none if the activation never gets positive.
    pub fn breakpoints(&self) -> Vec<f64> {
        let middle = 0.5 * (self.systole + self.diastole);
        let mut times = vec![self.systole, self.diastole];
        if self.activation(middle) > 0.0 {
            // Far from the middle a has come down to a_min, to rounding.
            let far = middle - self.systole + 20.0 * self.width;
            times.push(self.sign_change(middle, middle - far));
            times.push(self.sign_change(middle, middle + far));
        }
        times.sort_by(f64::total_cmp);
        times
    }

    /// Where a changes sign between a time at which it is positive and one at which it is not, by
    /// bisection to the last bit.
    fn sign_change(&self, mut positive: f64, mut negative: f64) -> f64 {
        loop {
            let middle = 0.5 * (positive + negative);
            if middle == positive || middle == negative {
                return middle;
            }
            if self.activation(middle) > 0.0 {
                positive = middle;
            } else {
                negative = middle;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Bestel;

    #[test]
    fn breakpoints_are_the_switches_and_the_changes_of_sign() {
        let model = Bestel::ventricle(1.5e5);
        let times = model.breakpoints();
        // The switches act alone here: f* = 6/7, tanh x = 5/7.
        let shift = 0.005 * (5.0_f64 / 7.0).atanh();
        let expected = [0.16, 0.16 + shift, 0.484 - shift, 0.484];
        assert_eq!(times.len(), 4);
        for (time, expected) in times.iter().zip(expected) {
            // Rounding of a(t) with slope 1e3 and terms of 30.
            assert!((time - expected).abs() < 1e-15 * 100.0, "{time} {expected}");
        }
        assert!((times[1] - 0.16448).abs() < 5e-6 && (times[2] - 0.47952).abs() < 5e-6);
        let asleep = Bestel {
            width: 1e3,
            ..model
        };
        assert_eq!(asleep.breakpoints(), [0.16, 0.484]);
    }

    #[test]
    fn tension_rises_to_what_the_equation_gives() {
        // Runge–Kutta's steps of fourth order; the exact tension for a constant a is
        // σ0 (1 − e^{−a t}).
        let model = Bestel::ventricle(1.5e5);
        let (mut t, mut tension, h) = (0.0, 0.0, 1e-5);
        while t < 0.48 {
            let k1 = model.rate(t, tension);
            let k2 = model.rate(t + 0.5 * h, tension + 0.5 * h * k1);
            let k3 = model.rate(t + 0.5 * h, tension + 0.5 * h * k2);
            let k4 = model.rate(t + h, tension + h * k3);
            tension += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            t += h;
        }
        // `cases/s11`: the largest tension is 118.10 kPa, just before 0.48 s.
        let slope = (model.rate(0.3, 1e3 + 1.0) - model.rate(0.3, 1e3)) - model.rate_slope(0.3);
        assert!(slope.abs() < 1e-9);
        assert!((118.0e3..118.11e3).contains(&tension), "{tension}");
    }

    #[test]
    fn wrong_constants_are_refused() {
        let wrong = Bestel::ventricle(-1.0).check().unwrap_err();
        assert_eq!(
            wrong.to_string(),
            "activation tension = -1 must be zero or positive, and finite"
        );
        let never = Bestel {
            diastole: 0.1,
            ..Bestel::ventricle(1.0)
        };
        assert!(never.check().is_err());
        assert!(Bestel::ventricle(1.5e5).check().is_ok());
    }
}
