//! Bestel's activation model, in which the active tension is an additional unknown.

use crate::error::FemError;

/// Activation model `Ṫ = −|a(t)| T + σ0 max(a(t), 0)` with `a = a_max f + a_min (1 − f)`,
/// `f = ¼ (1 + tanh((t − t_sys)/γ)) (1 − tanh((t − t_dias)/γ))`.
///
/// Source: Bestel, Clément, Sorine (2001); constants of Aróstica et al. (2025).
///
/// # Units
/// σ0 and T are in Pa, a is in 1/s, and times are in s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bestel {
    /// Contractility σ0.
    pub tension: f64,
    /// Rate of rise a_max, a positive number.
    pub rise: f64,
    /// Rate of decay a_min, a negative number.
    pub decay: f64,
    /// Start of systole t_sys.
    pub systole: f64,
    /// Start of diastole t_dias.
    pub diastole: f64,
    /// Time scale γ of the transitions.
    pub width: f64,
}

impl Bestel {
    /// Returns the constants of Aróstica et al. with the contractility σ0 = `tension`.
    pub fn ventricle(tension: f64) -> Self {
        Self { tension, rise: 5.0, decay: -30.0, systole: 0.16, diastole: 0.484, width: 0.005 }
    }

    /// Checks the ranges of the constants.
    ///
    /// # Errors
    /// Returns [`FemError::Parameter`] if a constant is out of range.
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
            ("activation decay", self.decay, self.decay < 0.0, "negative and finite"),
            positive("activation width", self.width),
            ("diastole", self.diastole, self.diastole > self.systole, "after systole"),
        ] {
            if !(fits && value.is_finite()) {
                return Err(FemError::Parameter { name, value, condition });
            }
        }
        Ok(())
    }

    /// Returns a(t).
    pub fn activation(&self, t: f64) -> f64 {
        let up = 1.0 + ((t - self.systole) / self.width).tanh();
        let down = 1.0 - ((t - self.diastole) / self.width).tanh();
        let f = 0.25 * up * down;
        self.rise * f + self.decay * (1.0 - f)
    }

    /// Returns Ṫ.
    pub fn rate(&self, t: f64, tension: f64) -> f64 {
        let a = self.activation(t);
        self.tension * a.max(0.0) - a.abs() * tension
    }

    /// Returns ∂Ṫ/∂T.
    pub fn rate_slope(&self, t: f64) -> f64 {
        -self.activation(t).abs()
    }

    /// Returns the times at which a step should end, in ascending order. These are the two transitions and the
    /// sign changes of a between them, where |a| has kinks. Sign changes occur only if the activation becomes
    /// positive.
    pub fn breakpoints(&self) -> Vec<f64> {
        let middle = 0.5 * (self.systole + self.diastole);
        let mut times = vec![self.systole, self.diastole];
        if self.activation(middle) > 0.0 {
            // Far from the middle, a equals a_min up to rounding.
            let far = middle - self.systole + 20.0 * self.width;
            times.push(self.sign_change(middle, middle - far));
            times.push(self.sign_change(middle, middle + far));
        }
        times.sort_by(f64::total_cmp);
        times
    }

    /// Returns the time of a sign change of a between a time at which a is positive and a time at which it is not.
    /// The bisection continues to the last bit.
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
    use super::{Bestel, FemError};

    #[test]
    fn breakpoints_are_switches_and_sign_changes() {
        let model = Bestel::ventricle(1.5e5);
        let times = model.breakpoints();
        // The transitions are far apart, so only one acts at a time: f* = 6/7 and tanh x = 5/7.
        let shift = 0.005 * (5.0_f64 / 7.0).atanh();
        let expected = [0.16, 0.16 + shift, 0.484 - shift, 0.484];
        assert_eq!(times.len(), 4);
        for (time, expected) in times.iter().zip(expected) {
            // The error is the rounding of a(t), which has slope 1e3 and terms of magnitude 30.
            assert!((time - expected).abs() < 1e-15 * 100.0, "{time} {expected}");
        }
        assert!((times[1] - 0.16448).abs() < 5e-6 && (times[2] - 0.47952).abs() < 5e-6);
        let inactive = Bestel { width: 1e3, ..model };
        assert_eq!(inactive.breakpoints(), [0.16, 0.484]);
    }

    #[test]
    fn largest_tension_matches_the_reference() {
        // Classical Runge–Kutta method. For constant a, the tension would be σ0 (1 − e^{−a t}).
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
        // According to the reference `cases/s11`, the largest tension is 118.10 kPa, just before 0.48 s.
        let slope = (model.rate(0.3, 1e3 + 1.0) - model.rate(0.3, 1e3)) - model.rate_slope(0.3);
        assert!(slope.abs() < 1e-9);
        assert!((118.0e3..118.11e3).contains(&tension), "{tension}");
    }

    #[test]
    fn invalid_constants_are_rejected() {
        assert!(matches!(
            Bestel::ventricle(-1.0).check(),
            Err(FemError::Parameter { name: "activation tension", value: -1.0, .. })
        ));
        let reversed = Bestel { diastole: 0.1, ..Bestel::ventricle(1.0) };
        assert!(reversed.check().is_err());
        assert!(Bestel::ventricle(1.5e5).check().is_ok());
    }
}
