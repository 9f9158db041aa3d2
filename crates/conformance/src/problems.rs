//! Small problems with exact solutions and optional failures.

use std::cell::Cell;
use std::rc::Rc;

use super::Request;
use myovib_dae::{Problem, StepError};

/// Function that returns a perturbation, which is added to a value of [`Circle`], or a failure.
pub(super) type Disturbance = Box<dyn FnMut(f64) -> Result<f64, StepError> + Send>;

/// Numbers of calls of a problem.
#[derive(Default)]
pub(super) struct Calls {
    /// Evaluations of the residual.
    pub(super) residuals: Cell<u64>,
    /// Evaluations of the Jacobian or of its two parts.
    pub(super) jacobians: Cell<u64>,
}

/// The system ẋ = v, v̇ = −x, a − x² − v² = 0 with the solution x = sin t, v = cos t, a = 1. The analytic Jacobian is
/// optional, and calls are counted.
pub(super) struct Circle {
    pub(super) has_jacobian: bool,
    /// Numbers of evaluations, which remain accessible while an integrator owns the problem.
    pub(super) calls: Rc<Calls>,
    /// Function that returns the value added to the first entry of the residual at the given time.
    pub(super) in_residual: Disturbance,
    /// Function that returns the value added to the first entry of the Jacobian.
    pub(super) in_jacobian: Disturbance,
}

impl Circle {
    pub(super) fn new() -> Self {
        Self {
            has_jacobian: true,
            calls: Rc::default(),
            in_residual: Box::new(|_| Ok(0.0)),
            in_jacobian: Box::new(|_| Ok(0.0)),
        }
    }

    pub(super) fn without_jacobian() -> Self {
        Self { has_jacobian: false, ..Self::new() }
    }

    pub(super) fn with_residual(
        trouble: impl FnMut(f64) -> Result<f64, StepError> + Send + 'static,
    ) -> Self {
        Self { in_residual: Box::new(trouble), ..Self::new() }
    }

    pub(super) fn start() -> ([f64; 3], [f64; 3]) {
        ([0.0, 1.0, 1.0], [1.0, 0.0, 0.0])
    }

    /// Returns a request for the solution from t = 0.
    pub(super) fn request(self) -> Request {
        let (y, y_dot) = Self::start();
        Request::new(self, 0.0, &y, &y_dot)
    }

    pub(super) fn exact(t: f64) -> [f64; 3] {
        [t.sin(), t.cos(), 1.0]
    }
}

impl Problem for Circle {
    fn n_unknowns(&self) -> usize {
        3
    }

    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        self.calls.residuals.update(|n| n + 1);
        let &[x, v, a] = y else { unreachable!("the integrator keeps the length") };
        residual[0] = y_dot[0] - v + (self.in_residual)(t)?;
        residual[1] = y_dot[1] + x;
        residual[2] = a - x * x - v * v;
        Ok(())
    }

    fn jacobian(
        &mut self,
        t: f64,
        y: &[f64],
        _y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        if !self.has_jacobian {
            return Err(StepError::NoJacobian);
        }
        self.calls.jacobians.update(|n| n + 1);
        let (x, v) = (y[0], y[1]);
        let trouble = (self.in_jacobian)(t)?;
        values.copy_from_slice(&[b + trouble, a, -2.0 * a * x, -a, b, -2.0 * a * v, 0.0, 0.0, a]);
        Ok(())
    }

    fn jacobian_parts(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        [df_dy, df_dyp]: [&mut [f64]; 2],
    ) -> Result<(), StepError> {
        self.jacobian(t, y, y_dot, 1.0, 0.0, df_dy)?;
        self.jacobian(t, y, y_dot, 0.0, 1.0, df_dyp)?;
        self.calls.jacobians.update(|n| n - 1);
        Ok(())
    }

    fn component_name(&self, i: usize) -> String {
        ["x", "v", "a"][i].to_owned()
    }
}
