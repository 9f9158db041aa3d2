//! Systems of index 0, 1 and 2 that have parameters and whose solutions are known in closed form.

use super::{FullMatrix, ParametricSample, Sample, Start};
use myovib_dae::Parameter;
use myovib_dae::{Problem, StepError, VariableKind};

/// Oscillator ẋ = v, v̇ = −ω² x, starting from (1, 0). The solution is x = cos ωt, v = −ω sin ωt, and the parameter is
/// ω.
#[derive(Debug, Clone, Copy)]
pub struct Oscillator {
    /// The angular frequency ω.
    pub omega: f64,
}

impl Sample for Oscillator {
    fn start(&self) -> Start {
        Start { t: 0.0, y: vec![1.0, 0.0], y_dot: vec![0.0, -self.omega * self.omega] }
    }

    fn exact(&self, t: f64) -> Option<Vec<f64>> {
        let (sin, cos) = (self.omega * t).sin_cos();
        Some(vec![cos, -self.omega * sin])
    }
}

impl ParametricSample for Oscillator {
    fn parameters(&self) -> Vec<Parameter> {
        vec![Parameter::new("omega", self.omega)]
    }

    fn set(&mut self, _: usize, value: f64) {
        self.omega = value;
    }

    fn exact_sensitivity(&self, _: usize, t: f64) -> Vec<f64> {
        let (sin, cos) = (self.omega * t).sin_cos();
        vec![-t * sin, -sin - self.omega * t * cos]
    }
}

impl Problem for Oscillator {
    fn n_unknowns(&self) -> usize {
        2
    }

    fn residual(&mut self, _: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        r[0] = v[0] - y[1];
        r[1] = v[1] + self.omega * self.omega * y[0];
        Ok(())
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![0; 2])
    }
}

/// A linear system of index 1 that starts from y = 1:
///
/// ```text
/// ẏ + p y − z = 0
/// z − q cos t = 0
/// ```
///
/// The solution is y = (1 − q p/(1 + p²)) e^(−pt) + q (p cos t + sin t)/(1 + p²). The parameters are p and q.
#[derive(Debug, Clone, Copy)]
pub struct ScaledLinear {
    /// The rate p.
    pub p: f64,
    /// The amplitude q.
    pub q: f64,
}

impl Sample for ScaledLinear {
    fn start(&self) -> Start {
        Start { t: 0.0, y: vec![1.0, self.q], y_dot: vec![self.q - self.p, 0.0] }
    }

    fn exact(&self, t: f64) -> Option<Vec<f64>> {
        let Self { p, q } = *self;
        let (sin, cos) = t.sin_cos();
        let d = 1.0 + p * p;
        let y = (1.0 - q * p / d) * (-p * t).exp() + q * (p * cos + sin) / d;
        Some(vec![y, q * cos])
    }
}

impl ParametricSample for ScaledLinear {
    fn parameters(&self) -> Vec<Parameter> {
        vec![Parameter::new("p", self.p), Parameter::new("q", self.q)]
    }

    fn set(&mut self, j: usize, value: f64) {
        match j {
            0 => self.p = value,
            _ => self.q = value,
        }
    }

    fn exact_sensitivity(&self, j: usize, t: f64) -> Vec<f64> {
        let Self { p, q } = *self;
        let (sin, cos) = t.sin_cos();
        let (d, decay) = (1.0 + p * p, (-p * t).exp());
        // The derivative of p/(1 + p²) is (1 − p²)/(1 + p²)².
        let slope = (1.0 - p * p) / (d * d);
        match j {
            0 => vec![
                -q * slope * decay - t * (1.0 - q * p / d) * decay
                    + q * (slope * cos - 2.0 * p * sin / (d * d)),
                0.0,
            ],
            _ => vec![-p / d * decay + (p * cos + sin) / d, cos],
        }
    }
}

impl Problem for ScaledLinear {
    fn n_unknowns(&self) -> usize {
        2
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        r[0] = v[0] + self.p * y[0] - y[1];
        r[1] = y[1] - self.q * t.cos();
        Ok(())
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![1; 2])
    }
}

/// The system [`JayIndex2`](super::JayIndex2) with a scale c for its first variable and a rate w:
///
/// ```text
/// ẏ1 = w y1 y2 z
/// ẏ2 = w (y1² y2²/c² − 3 y2² z)
///  0 = y1² y2 − c²
/// ```
///
/// The solution is y1 = c exp wt, y2 = exp(−2wt), z = exp 2wt. The parameters are c, on which the initial values
/// depend, and w.
#[derive(Debug, Clone, Copy)]
pub struct ScaledJay {
    /// The scale c.
    pub c: f64,
    /// The rate w.
    pub w: f64,
}

impl Sample for ScaledJay {
    fn start(&self) -> Start {
        Start {
            t: 0.0,
            y: vec![self.c, 1.0, 1.0],
            y_dot: vec![self.c * self.w, -2.0 * self.w, 2.0 * self.w],
        }
    }

    fn exact(&self, t: f64) -> Option<Vec<f64>> {
        let Self { c, w } = *self;
        Some(vec![c * (w * t).exp(), (-2.0 * w * t).exp(), (2.0 * w * t).exp()])
    }
}

impl ParametricSample for ScaledJay {
    fn parameters(&self) -> Vec<Parameter> {
        vec![Parameter::new("c", self.c), Parameter::new("w", self.w)]
    }

    fn set(&mut self, j: usize, value: f64) {
        match j {
            0 => self.c = value,
            _ => self.w = value,
        }
    }

    fn exact_sensitivity(&self, j: usize, t: f64) -> Vec<f64> {
        let Self { c, w } = *self;
        match j {
            0 => vec![(w * t).exp(), 0.0, 0.0],
            _ => vec![
                c * t * (w * t).exp(),
                -2.0 * t * (-2.0 * w * t).exp(),
                2.0 * t * (2.0 * w * t).exp(),
            ],
        }
    }
}

impl Problem for ScaledJay {
    fn n_unknowns(&self) -> usize {
        3
    }

    fn residual(
        &mut self,
        _t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        let (Self { c, w }, y1, y2, z) = (*self, y[0], y[1], y[2]);
        residual[0] = y_dot[0] - w * y1 * y2 * z;
        residual[1] = y_dot[1] - w * y2 * y2 * (y1 * y1 / (c * c) - 3.0 * z);
        residual[2] = y1 * y1 * y2 - c * c;
        Ok(())
    }

    fn jacobian(
        &mut self,
        _t: f64,
        y: &[f64],
        _y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        let (Self { c, w }, y1, y2, z) = (*self, y[0], y[1], y[2]);
        let (aw, c2) = (a * w, c * c);
        let mut matrix = FullMatrix::zeroed(3, values);
        matrix.add(0, 0, b - aw * y2 * z);
        matrix.add(0, 1, -aw * y1 * z);
        matrix.add(0, 2, -aw * y1 * y2);
        matrix.add(1, 0, -2.0 * aw * y1 * y2 * y2 / c2);
        matrix.add(1, 1, b - 2.0 * aw * y2 * (y1 * y1 / c2 - 3.0 * z));
        matrix.add(1, 2, 3.0 * aw * y2 * y2);
        matrix.add(2, 0, 2.0 * a * y1 * y2);
        matrix.add(2, 1, a * y1 * y1);
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        use VariableKind::{Algebraic, Differential};
        Some(vec![Differential, Differential, Algebraic])
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![1, 1, 2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{MechanicalForm, Pendulum};

    /// Compares sensitivities with central differences of the exact solution. For δ = 1e-5, the truncation error δ²
    /// y'''/6 and the rounding error ε/δ are both below 1e-8 times values of up to about 100.
    fn closed_forms_agree<S: ParametricSample + Copy>(sample: S, t: f64) {
        for (j, parameter) in sample.parameters().iter().enumerate() {
            let delta = 1e-5;
            let moved = |by: f64| {
                let mut moved = sample;
                moved.set(j, parameter.value + by);
                moved.exact(t).unwrap()
            };
            let (above, below) = (moved(delta), moved(-delta));
            for (i, s) in sample.exact_sensitivity(j, t).iter().enumerate() {
                let difference = (above[i] - below[i]) / (2.0 * delta);
                let allowed = 1e-7 * (1.0 + s.abs());
                let name = &parameter.name;
                assert!((s - difference).abs() < allowed, "{name}, y[{i}]: {s} {difference}");
            }
        }
    }

    #[test]
    fn sensitivities_in_closed_form_are_those_of_the_exact_solutions() {
        for t in [0.0, 0.7] {
            closed_forms_agree(Oscillator { omega: 3.0 }, t);
            closed_forms_agree(ScaledLinear { p: 2.0, q: 0.6 }, t);
            closed_forms_agree(ScaledJay { c: 1.5, w: 0.8 }, t);
            closed_forms_agree(Pendulum::new(MechanicalForm::Index3).with(0.6, 9.8), t);
        }
    }

    /// The derivative ẏ of the exact solution is computed by central differences, with the same errors as above.
    #[test]
    fn exact_solutions_solve_their_equations() {
        fn check<S: ParametricSample>(mut sample: S) {
            let (t, delta) = (0.4, 1e-5);
            let [below, y, above] = [t - delta, t, t + delta].map(|t| sample.exact(t).unwrap());
            let slope = above.iter().zip(&below);
            let y_dot: Vec<f64> = slope.map(|(a, b)| (a - b) / (2.0 * delta)).collect();
            let mut residual = vec![0.0; y.len()];
            sample.residual(t, &y, &y_dot, &mut residual).unwrap();
            assert!(residual.iter().all(|r| r.abs() < 1e-7), "{residual:?}");
        }
        check(Oscillator { omega: 3.0 });
        check(ScaledLinear { p: 2.0, q: 0.6 });
        check(ScaledJay { c: 1.5, w: 0.8 });
        check(Pendulum::new(MechanicalForm::Index3).with(0.6, 9.8));
    }
}
