use super::{Sample, Start};
use myovib_dae::{Problem, StepError, VariableKind};

/// Robertson's chemical kinetics, which are very stiff, with the conservation of mass as an algebraic equation.
///
/// ```text
/// ẏ1 = −0.04 y1 + 1e4 y2 y3
/// ẏ2 =  0.04 y1 − 1e4 y2 y3 − 3e7 y2²
///  0 = y1 + y2 + y3 − 1
/// ```
///
/// Source: H. H. Robertson, The solution of a set of reaction rate equations, 1966; Hairer &
/// Wanner, Solving Ordinary Differential Equations II, IV.1.
#[derive(Debug, Clone, Copy, Default)]
pub struct Robertson;

impl Sample for Robertson {
    /// Returns a state in which all mass is in the first species.
    fn start(&self) -> Start {
        Start { t: 0.0, y: vec![1.0, 0.0, 0.0], y_dot: vec![-0.04, 0.04, 0.0] }
    }
}

impl Problem for Robertson {
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
        let (slow, fast, fastest) = (0.04 * y[0], 1e4 * y[1] * y[2], 3e7 * y[1] * y[1]);
        residual[0] = fast - slow - y_dot[0];
        residual[1] = slow - fast - fastest - y_dot[1];
        residual[2] = y[0] + y[1] + y[2] - 1.0;
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
        let columns = [
            [-0.04 * a - b, 0.04 * a, a],
            [1e4 * y[2] * a, (-1e4 * y[2] - 6e7 * y[1]) * a - b, a],
            [1e4 * y[1] * a, -1e4 * y[1] * a, a],
        ];
        values.copy_from_slice(columns.as_flattened());
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        use VariableKind::{Algebraic, Differential};
        Some(vec![Differential, Differential, Algebraic])
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![0, 0, 1])
    }
}
