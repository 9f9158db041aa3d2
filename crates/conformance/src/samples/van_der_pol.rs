use super::{Sample, Start};
use myovib_dae::{Problem, StepError, VariableKind};

/// Van der Pol's oscillator, an ordinary differential equation that is stiff for large μ.
///
/// ```text
/// ẏ1 = y2
/// ẏ2 = μ (1 − y1²) y2 − y1
/// ```
///
/// The solution starts at (2, 0).
///
/// Source: B. van der Pol, On relaxation-oscillations, Phil. Mag. 2 (1926) 978; Test Set for IVP
/// Solvers, problem vdpolm (μ = 1000 on [0, 2000]).
#[derive(Debug, Clone, Copy)]
pub struct VanDerPol {
    /// Strength of the nonlinear damping.
    pub vdp_mu: f64,
}

impl Sample for VanDerPol {
    fn start(&self) -> Start {
        Start { t: 0.0, y: vec![2.0, 0.0], y_dot: vec![0.0, -2.0] }
    }
}

impl Problem for VanDerPol {
    fn n_unknowns(&self) -> usize {
        2
    }

    fn residual(
        &mut self,
        _t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        residual[0] = y_dot[0] - y[1];
        residual[1] = y_dot[1] - self.vdp_mu * (1.0 - y[0] * y[0]) * y[1] + y[0];
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
        values[0] = b;
        values[1] = a * (2.0 * self.vdp_mu * y[0] * y[1] + 1.0);
        values[2] = -a;
        values[3] = b - a * self.vdp_mu * (1.0 - y[0] * y[0]);
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        Some(vec![VariableKind::Differential; 2])
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![0, 0])
    }
}
