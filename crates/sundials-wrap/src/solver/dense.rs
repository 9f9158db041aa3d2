//! Results for the last step: dense output, weights, errors, quadratures.

use crate::error::Error;
use crate::ffi::ida::Counter;
use myovib_dae::checks::{expect_dense_output, expect_finite_value, expect_length};
use myovib_dae::{IntegratorError, Problem};

use super::IdaSolver;

impl<P: Problem> IdaSolver<P> {
    /// Writes the solution or one of its time derivatives at the time `t` within the last step to `out`. The steps do
    /// not depend on these calls.
    ///
    /// The interpolating polynomial of the last step is differentiated `derivative` times; 0 returns the solution. The
    /// highest derivative is the order of the last step.
    ///
    /// # Shapes
    /// `out`: the number of unknowns.
    ///
    /// # Errors
    /// Returns [`IntegratorError::NoDenseOutput`] if `t` is outside the last step or if the order of the derivative is
    /// too high, [`IntegratorError::WrongLength`], and [`IntegratorError::InvalidOption`] if `t` is not finite.
    pub fn dense_output(
        &mut self,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), Error> {
        expect_length("dense output", self.n, out.len())?;
        // IDAS accepts NaN without an error.
        expect_finite_value("t", t)?;
        let [y0, y_dot0] = &self.start;
        if self.ida.counter(Counter::Steps) == 0 && t == self.t0 && derivative <= 1 {
            out.copy_from_slice([y0, y_dot0][derivative]);
            return Ok(());
        }
        let k = self.order_within_reach(t, derivative, self.ida.last_order())?;
        self.call(|ida| ida.derivative(t, k).map(|values| out.copy_from_slice(values)))
    }

    /// Writes the error weights of the last step to `out`. The weights are the reciprocals of the allowed errors;
    /// before the first step, they are zero.
    ///
    /// # Shapes
    /// `out`: the number of unknowns.
    ///
    /// # Errors
    /// Returns [`IntegratorError::WrongLength`] if `out` has the wrong length.
    pub fn error_weights(&mut self, out: &mut [f64]) -> Result<(), Error> {
        expect_length("error weights", self.n, out.len())?;
        self.call(|ida| ida.error_weights().map(|values| out.copy_from_slice(values)))
    }

    /// Writes the estimated local errors of the last attempted step to `out`, or zeros before the
    /// first step.
    ///
    /// # Shapes
    /// `out`: the number of unknowns.
    ///
    /// # Errors
    /// Returns [`IntegratorError::WrongLength`] if `out` has the wrong length.
    pub fn estimated_local_errors(&mut self, out: &mut [f64]) -> Result<(), Error> {
        expect_length("local errors", self.n, out.len())?;
        self.call(|ida| ida.estimated_local_errors().map(|values| out.copy_from_slice(values)))
    }

    /// Writes the quadratures at [`t`](IdaSolver::t) to `out`.
    ///
    /// # Errors
    /// Returns [`IntegratorError::NoQuadrature`] or [`IntegratorError::WrongLength`].
    pub fn quadrature(&mut self, out: &mut [f64]) -> Result<(), Error> {
        self.quadrature_dense_output(self.t, 0, out)
    }

    /// Evaluates the quadratures as [`dense_output`](IdaSolver::dense_output) evaluates the solution. If the order of
    /// the next step is lower than the order of the last step, only derivatives up to the lower order are available.
    ///
    /// # Errors
    /// Returns [`IntegratorError::NoQuadrature`], and the errors of [`dense_output`](IdaSolver::dense_output).
    pub fn quadrature_dense_output(
        &mut self,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), Error> {
        if self.n_quadratures() == 0 {
            return Err(IntegratorError::NoQuadrature.into());
        }
        expect_length("quadratures", self.n_quadratures(), out.len())?;
        expect_finite_value("t", t)?;
        // IDAS stores derivatives up to the order of the last step but rejects orders above the order of the next step.
        let order = self.ida.last_order().min(self.ida.current_order());
        let k = self.order_within_reach(t, derivative, order)?;
        self.call(|ida| ida.quadrature(t, k).map(|values| out.copy_from_slice(values)))
    }

    /// Returns `derivative` in the integer type of IDAS. Fails if `t` is outside the last step or if the order is above
    /// `order`, the highest available order. IDAS itself checks only one end of the step.
    pub(super) fn order_within_reach(
        &self,
        t: f64,
        derivative: usize,
        order: usize,
    ) -> Result<i32, Error> {
        self.expect_not_left()?;
        expect_dense_output(t, derivative, order, self.last_step_interval())?;
        Ok(derivative as i32)
    }
}
