use super::{FullMatrix, Sample, Start};
use myovib_dae::{Problem, StepError, VariableKind};

/// A linear system of index 1 with time-dependent coefficients.
///
/// ```text
/// ẏ1 − t ẏ2 + y1 − (1 + t) y2 = 0
/// y2 − sin t = 0
/// ```
///
/// The exact solution is y1 = exp(−t) + t sin t, y2 = sin t. Note that ẏ2 occurs, although an algebraic equation
/// determines y2. The usual interval is [0, 10].
///
/// Source: K. E. Brenan, S. L. Campbell, L. R. Petzold, Numerical Solution of Initial-Value
/// Problems in Differential-Algebraic Equations, chapter 4.
#[derive(Debug, Clone, Copy, Default)]
pub struct LinearIndex1;

impl Sample for LinearIndex1 {
    fn start(&self) -> Start {
        Start { t: 0.0, y: vec![1.0, 0.0], y_dot: vec![-1.0, 1.0] }
    }

    fn exact(&self, t: f64) -> Option<Vec<f64>> {
        Some(vec![(-t).exp() + t * t.sin(), t.sin()])
    }
}

impl Problem for LinearIndex1 {
    fn n_unknowns(&self) -> usize {
        2
    }

    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        residual[0] = y_dot[0] - t * y_dot[1] + y[0] - (1.0 + t) * y[1];
        residual[1] = y[1] - t.sin();
        Ok(())
    }

    fn jacobian(
        &mut self,
        t: f64,
        _y: &[f64],
        _y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        values.copy_from_slice(&[a + b, 0.0, -(1.0 + t) * a - t * b, a]);
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        Some(vec![VariableKind::Differential; 2])
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![1, 1])
    }
}

/// A nonlinear system of index 2 in Hessenberg form.
///
/// ```text
/// ẏ1 = y1 y2 z
/// ẏ2 = y1² y2² − 3 y2² z
///  0 = y1² y2 − 1
/// ```
///
/// The exact solution is y1 = exp t, y2 = exp(−2t), z = exp 2t. The usual interval is [0, 1].
///
/// Source: L. Jay, Convergence of a class of Runge-Kutta methods for differential-algebraic
/// systems of index 2, BIT 33 (1993), example 7.
#[derive(Debug, Clone, Copy, Default)]
pub struct JayIndex2;

impl Sample for JayIndex2 {
    fn start(&self) -> Start {
        Start { t: 0.0, y: vec![1.0; 3], y_dot: vec![1.0, -2.0, 2.0] }
    }

    fn exact(&self, t: f64) -> Option<Vec<f64>> {
        Some(vec![t.exp(), (-2.0 * t).exp(), (2.0 * t).exp()])
    }
}

impl Problem for JayIndex2 {
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
        let &[y1, y2, z] = y else { unreachable!("the integrator keeps the length") };
        residual[0] = y_dot[0] - y1 * y2 * z;
        residual[1] = y_dot[1] - y1 * y1 * y2 * y2 + 3.0 * y2 * y2 * z;
        residual[2] = y1 * y1 * y2 - 1.0;
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
        let &[y1, y2, z] = y else { unreachable!("the integrator keeps the length") };
        let mut matrix = FullMatrix::zeroed(3, values);
        matrix.add(0, 0, b - a * y2 * z);
        matrix.add(0, 1, -a * y1 * z);
        matrix.add(0, 2, -a * y1 * y2);
        matrix.add(1, 0, -2.0 * a * y1 * y2 * y2);
        matrix.add(1, 1, b - 2.0 * a * y1 * y1 * y2 + 6.0 * a * y2 * z);
        matrix.add(1, 2, 3.0 * a * y2 * y2);
        matrix.add(2, 0, 2.0 * a * y1 * y2);
        matrix.add(2, 1, a * y1 * y1);
        Ok(())
    }

    fn n_constraints(&self) -> usize {
        1
    }

    fn constraints(&mut self, _: f64, y: &[f64], out: &mut [f64]) -> Result<(), StepError> {
        out[0] = y[0] * y[0] * y[1] - 1.0;
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
