//! What can be asked about the last step: dense output, weights, errors, quadratures.

use sundials_sys as sys;

use crate::error::Error;
use crate::ffi::call::CallFailed;
use crate::options::{expect_length, finite};
use myovib_dae::Problem;

use super::IdaSolver;

impl<P: Problem> IdaSolver<P> {
    /// Writes the k-th derivative of the solution at `t`, a time within the last step, to `out`.
    /// This never changes the steps.
    ///
    /// The interpolating polynomial of the last step is differentiated `derivative` times; 0 is
    /// the solution itself, and the order of the last step the highest there is.
    ///
    /// # Shapes
    /// `out`: the number of unknowns.
    ///
    /// # Errors
    /// [`Error::NoDenseOutput`] outside of the last step or for too high a derivative,
    /// [`Error::WrongLength`], [`Error::InvalidOption`] for a time that is not finite.
    pub fn dense_output(
        &mut self,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), Error> {
        expect_length("dense output", self.n, out.len())?;
        // IDAS lets a NaN pass.
        finite("t", t)?;
        let k = i32::try_from(derivative).unwrap_or(i32::MAX);
        match self.ida.derivative(t, k) {
            Ok(values) => out.copy_from_slice(values),
            Err(failed) => return Err(self.no_dense_output(failed, t, derivative)),
        }
        Ok(())
    }

    /// Writes the error weights of the last step to `out`: the reciprocals of the allowed errors,
    /// or zeros before the first.
    ///
    /// # Shapes
    /// `out`: the number of unknowns.
    ///
    /// # Errors
    /// [`Error::WrongLength`].
    pub fn error_weights(&mut self, out: &mut [f64]) -> Result<(), Error> {
        expect_length("error weights", self.n, out.len())?;
        match self.ida.error_weights() {
            Ok(values) => out.copy_from_slice(values),
            Err(failed) => return self.refused(Err(failed)),
        }
        Ok(())
    }

    /// Writes the estimated local errors of the last attempted step to `out`, zeros before the
    /// first.
    ///
    /// # Shapes
    /// `out`: the number of unknowns.
    ///
    /// # Errors
    /// [`Error::WrongLength`].
    pub fn estimated_local_errors(&mut self, out: &mut [f64]) -> Result<(), Error> {
        expect_length("local errors", self.n, out.len())?;
        match self.ida.estimated_local_errors() {
            Ok(values) => out.copy_from_slice(values),
            Err(failed) => return self.refused(Err(failed)),
        }
        Ok(())
    }

    /// Writes the quadratures at [`t`](IdaSolver::t) to `out`.
    ///
    /// # Errors
    /// [`Error::NoQuadrature`], [`Error::WrongLength`].
    pub fn quadrature(&mut self, out: &mut [f64]) -> Result<(), Error> {
        self.quadrature_dense_output(self.t, 0, out)
    }

    /// As [`dense_output`](IdaSolver::dense_output), for the quadratures.
    ///
    /// # Errors
    /// [`Error::NoQuadrature`], and as for [`dense_output`](IdaSolver::dense_output).
    pub fn quadrature_dense_output(
        &mut self,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), Error> {
        if self.n_quadratures() == 0 {
            return Err(Error::NoQuadrature);
        }
        expect_length("quadratures", self.n_quadratures(), out.len())?;
        finite("t", t)?;
        let k = i32::try_from(derivative).unwrap_or(i32::MAX);
        match self.ida.quadrature(t, k) {
            Ok(values) => out.copy_from_slice(values),
            Err(failed) => return Err(self.no_dense_output(failed, t, derivative)),
        }
        Ok(())
    }

    fn no_dense_output(&mut self, failed: CallFailed, t: f64, derivative: usize) -> Error {
        let message = self.functions_mut().failures.take_message();
        if !matches!(failed.code, sys::IDA_BAD_T | sys::IDA_BAD_K) {
            return super::call_error(failed, message);
        }
        let to = self.ida.internal_time();
        let (order, from) = (self.ida.last_order(), to - self.ida.last_step());
        Error::NoDenseOutput {
            t,
            derivative,
            order,
            from,
            to,
        }
    }
}
