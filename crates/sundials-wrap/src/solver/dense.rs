//! Results for the last step: dense output, weights, errors, quadratures.

use crate::error::Error;
use crate::ffi::ida::Counter;
use myovib_dae::checks::{expect_dense_output, expect_finite_value, expect_length};
use myovib_dae::{IntegratorError, Problem};

use super::IdaSolver;

impl<P: Problem> IdaSolver<P> {
    /// Writes a derivative of the solution at the time `t` within the last step to `out`. The steps do not depend on
    /// these calls.
    ///
    /// The interpolating polynomial of the last step is differentiated `derivative` times; 0
    /// returns the solution. The highest derivative is the order of the last step.
    ///
    /// # Shapes
    /// `out`: the number of unknowns.
    ///
    /// # Errors
    /// [`IntegratorError::NoDenseOutput`] outside the last step or for a derivative of too high an order, [`IntegratorError::WrongLength`],
    /// [`IntegratorError::InvalidOption`] for a non-finite time.
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
        let values = self.ida.derivative(t, k);
        let written = values.map(|values| out.copy_from_slice(values));
        self.refused(written)
    }

    /// Writes the error weights of the last step to `out`: the reciprocals of the allowed errors,
    /// or zeros before the first step.
    ///
    /// # Shapes
    /// `out`: the number of unknowns.
    ///
    /// # Errors
    /// [`IntegratorError::WrongLength`].
    pub fn error_weights(&mut self, out: &mut [f64]) -> Result<(), Error> {
        expect_length("error weights", self.n, out.len())?;
        let values = self.ida.error_weights();
        let written = values.map(|values| out.copy_from_slice(values));
        self.refused(written)
    }

    /// Writes the estimated local errors of the last attempted step to `out`, or zeros before the
    /// first step.
    ///
    /// # Shapes
    /// `out`: the number of unknowns.
    ///
    /// # Errors
    /// [`IntegratorError::WrongLength`].
    pub fn estimated_local_errors(&mut self, out: &mut [f64]) -> Result<(), Error> {
        expect_length("local errors", self.n, out.len())?;
        let values = self.ida.estimated_local_errors();
        let written = values.map(|values| out.copy_from_slice(values));
        self.refused(written)
    }

    /// Writes the quadratures at [`t`](IdaSolver::t) to `out`.
    ///
    /// # Errors
    /// [`IntegratorError::NoQuadrature`], [`IntegratorError::WrongLength`].
    pub fn quadrature(&mut self, out: &mut [f64]) -> Result<(), Error> {
        self.quadrature_dense_output(self.t, 0, out)
    }

    /// Evaluates the quadratures like [`dense_output`](IdaSolver::dense_output). If the next step
    /// has a lower order than the last step, only derivatives up to that order are available.
    ///
    /// # Errors
    /// [`IntegratorError::NoQuadrature`], and errors of [`dense_output`](IdaSolver::dense_output).
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
        // IDAS stores derivatives up to the last order but rejects orders above the order of the
        // next step.
        let order = self.ida.last_order().min(self.ida.current_order());
        let k = self.order_within_reach(t, derivative, order)?;
        let values = self.ida.quadrature(t, k);
        let written = values.map(|values| out.copy_from_slice(values));
        self.refused(written)
    }

    /// Returns the order of the derivatives available at `t` if the last step provides derivatives up to `order`. IDAS
    /// checks only one end of the step.
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
