//! Forward sensitivities by IDAS.

use nalgebra_sparse::pattern::SparsityPattern;

use super::IdaSolver;
use crate::error::Error;
use crate::ffi::ida::Counter;
use myovib_dae::checks::{expect_finite_value, expect_length, expect_positive, expect_vector};
use myovib_dae::{IntegratorError, Jacobian, Linearization, Parameters, Problem, StepError};

/// Method for integrating the sensitivities along with the solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum SensitivityMethod {
    /// The sensitivities are integrated after the solution of each step has passed the error test (IDA_STAGGERED).
    #[default]
    Staggered,
    /// The sensitivities and the solution are integrated together, in one nonlinear system (IDA_SIMULTANEOUS).
    Simultaneous,
}

/// Settings of forward sensitivities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SensitivityOptions {
    /// Method of integration.
    pub method: SensitivityMethod,
    /// Whether the sensitivities are included in the error test. They are scaled to p̄ S and have the tolerances of y.
    pub in_error_test: bool,
}

impl Default for SensitivityOptions {
    fn default() -> Self {
        Self { method: SensitivityMethod::default(), in_error_test: true }
    }
}

/// Counters of forward sensitivities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct SensitivityStatistics {
    /// Evaluations of the residuals of all sensitivity equations.
    pub residual_evaluations: u64,
    /// Steps rejected by the error test of the sensitivities (staggered method).
    pub error_test_failures: u64,
    /// Newton iterations for the sensitivities (staggered method).
    pub newton_iterations: u64,
    /// Setups of the linear solver for the sensitivities (staggered method).
    pub linear_setups: u64,
}

/// Parameters, with the data for the sensitivity equations.
pub(super) struct SensitivityEquations<P> {
    pub(super) parameters: Box<dyn Parameters<P> + Send>,
    pub(super) options: SensitivityOptions,
    pub(super) starts: Vec<[Vec<f64>; 2]>,
    /// Time of the initial values in `starts`.
    pub(super) t_start: f64,
    /// Step size at the last matrix setup, which precedes the sensitivities of the step.
    pub(super) step: f64,
    jacobian: Jacobian,
    /// ∂F/∂y and ∂F/∂ẏ.
    parts: [Vec<f64>; 2],
    /// ∂F/∂p, row by row, and whether it was evaluated at the state of the matrices.
    df_dp: (Vec<f64>, bool),
    /// State and step of the last linearization.
    at: Option<LinearizedState>,
}

/// A state (t, y, ẏ) and the step by which differences are scaled.
#[derive(PartialEq)]
struct LinearizedState {
    t: f64,
    step: f64,
    y: Vec<f64>,
    y_dot: Vec<f64>,
}

impl<P: Problem> SensitivityEquations<P> {
    pub(super) fn new(
        problem: &P,
        parameters: Box<dyn Parameters<P> + Send>,
        options: SensitivityOptions,
        (t_start, starts): (f64, Vec<[Vec<f64>; 2]>),
    ) -> Result<Self, Error> {
        let n = problem.n_unknowns();
        let n_parameters = parameters.list().len();
        expect_starts(&starts, n_parameters, n)?;
        for parameter in parameters.list() {
            expect_positive("scale of a parameter", parameter.scale)?;
        }
        let jacobian = Jacobian::of(problem);
        let nnz = jacobian.pattern().nnz();
        Ok(Self {
            parameters,
            options,
            starts,
            t_start,
            step: 1.0,
            jacobian,
            parts: [vec![0.0; nnz], vec![0.0; nnz]],
            df_dp: (vec![0.0; n * n_parameters], false),
            at: None,
        })
    }

    /// Evaluates ∂F/∂y and ∂F/∂ẏ, once for each state: all iterations of the staggered method for a step, and its error
    /// test, have the same state.
    pub(super) fn linearize(
        &mut self,
        problem: &mut P,
        at: &Linearization<'_>,
    ) -> Result<(), StepError> {
        let is_known = |last: &LinearizedState| {
            (last.t, last.step) == (at.t, at.step) && last.y == at.y && last.y_dot == at.y_dot
        };
        if self.at.as_ref().is_some_and(is_known) {
            return Ok(());
        }
        self.forget();
        let [df_dy, df_dyp] = &mut self.parts;
        self.parameters.linearize(problem, &mut self.jacobian, at, [df_dy, df_dyp])?;
        let (y, y_dot) = (at.y.to_vec(), at.y_dot.to_vec());
        self.at = Some(LinearizedState { t: at.t, step: at.step, y, y_dot });
        Ok(())
    }

    /// Discards the last linearization, because the problem may have changed.
    pub(super) fn forget(&mut self) {
        self.at = None;
        self.df_dp.1 = false;
    }

    /// Returns the number of residual evaluations for difference quotients so far.
    pub(super) fn difference_evaluations(&self) -> u64 {
        self.jacobian.residual_evaluations()
    }

    /// Computes ∂F/∂y S + ∂F/∂ẏ Ṡ + ∂F/∂p_j at the state of the last linearization.
    pub(super) fn residual(
        &mut self,
        problem: &mut P,
        j: usize,
        (t, y, y_dot): (f64, &[f64], &[f64]),
        [s, s_dot]: [&[f64]; 2],
        out: &mut [f64],
    ) -> Result<(), StepError> {
        let (df_dp, is_known) = &mut self.df_dp;
        if !*is_known {
            let evaluated = self.parameters.derivatives(problem, t, [y, y_dot], df_dp);
            evaluated.map_err(|(_, error)| error)?;
            *is_known = true;
        }
        let rows = df_dp.chunks_exact(self.starts.len());
        out.iter_mut().zip(rows).for_each(|(out, row)| *out = row[j]);
        let [df_dy, df_dyp] = &self.parts;
        add_product(self.jacobian.pattern(), df_dy, s, out);
        add_product(self.jacobian.pattern(), df_dyp, s_dot, out);
        Ok(())
    }
}

fn expect_starts(
    starts: &[[Vec<f64>; 2]],
    n_parameters: usize,
    n: usize,
) -> Result<(), IntegratorError> {
    expect_length("starts of sensitivities", n_parameters, starts.len())?;
    for start in starts.iter().flatten() {
        expect_vector("start of a sensitivity", n, start)?;
    }
    Ok(())
}

fn add_product(pattern: &SparsityPattern, values: &[f64], x: &[f64], out: &mut [f64]) {
    let (offsets, rows) = (pattern.major_offsets(), pattern.minor_indices());
    for (x, column) in x.iter().zip(offsets.windows(2)) {
        let entries = column[0]..column[1];
        for (&row, value) in rows[entries.clone()].iter().zip(&values[entries]) {
            out[row] += value * x;
        }
    }
}

impl<P: Problem> IdaSolver<P> {
    /// Restarts as [`reinit`](IdaSolver::reinit) does, with the initial values S and Ṡ in `starts`.
    ///
    /// If the restart does not change y and its time does not depend on the parameters, S is the current
    /// [`sensitivity`](IdaSolver::sensitivity).
    ///
    /// # Errors
    /// Returns the errors of [`reinit`](IdaSolver::reinit). Returns [`IntegratorError::WrongLength`] or
    /// [`IntegratorError::NotFinite`] if `starts` is invalid.
    pub fn reinit_with_sensitivities(
        &mut self,
        t0: f64,
        y0: &[f64],
        y_dot0: &[f64],
        q0: &[f64],
        starts: Vec<[Vec<f64>; 2]>,
    ) -> Result<(), Error> {
        expect_starts(&starts, self.n_parameters(), self.n)?;
        if let Some(linearized) = &mut self.functions_mut().sensitivities {
            (linearized.starts, linearized.t_start) = (starts, t0);
        }
        self.reinit(t0, y0, y_dot0, q0)
    }

    pub(super) fn attach_sensitivities(&mut self) -> Result<(), Error> {
        let Some(of) = &self.functions().sensitivities else {
            return Ok(());
        };
        let mut scales: Vec<f64> = of.parameters.list().iter().map(|p| p.scale).collect();
        let staggered = of.options.method == SensitivityMethod::Staggered;
        let (starts, in_test) = (of.starts.clone(), of.options.in_error_test);
        self.call(|ida| ida.init_sensitivities(&starts, &mut scales, staggered, in_test))
    }

    pub(super) fn attach_quadrature_sensitivities(&mut self, tested: bool) -> Result<(), Error> {
        let functions = self.functions();
        if functions.quadrature_sensitivities.is_none() {
            return Ok(());
        }
        let of = functions.sensitivities.as_ref().map(|of| of.options);
        let Some(options) = of.filter(|_| self.n_quadratures() > 0) else {
            return Err(IntegratorError::NoQuadrature.into());
        };
        let tested = tested && options.in_error_test;
        self.call(|ida| ida.init_quadrature_sensitivities(tested))
    }

    /// Writes the sensitivity of the quadratures to parameter j at [`t`](IdaSolver::t) to `out`.
    ///
    /// # Shapes
    /// `out`: the number of quadratures.
    ///
    /// # Errors
    /// Returns [`Error::NoParameter`], [`IntegratorError::NoQuadrature`] or [`IntegratorError::NoDenseOutput`].
    pub fn quadrature_sensitivity(&mut self, j: usize, out: &mut [f64]) -> Result<(), Error> {
        let of = self.n_parameters();
        if j >= of {
            return Err(Error::NoParameter { parameter: j, of });
        }
        if self.functions().quadrature_sensitivities.is_none() {
            return Err(IntegratorError::NoQuadrature.into());
        }
        expect_length("quadratures", self.n_quadratures(), out.len())?;
        let t = self.t;
        self.order_within_reach(t, 0, self.ida.last_order())?;
        self.call(|ida| ida.quadrature_sensitivity(j, t).map(|values| out.copy_from_slice(values)))
    }

    /// Returns the number of parameters.
    pub fn n_parameters(&self) -> usize {
        self.ida.n_parameters()
    }

    /// Writes ∂y/∂p_j at [`t`](IdaSolver::t) to `out`.
    ///
    /// # Errors
    /// Returns the same errors as [`sensitivity_dense_output`](IdaSolver::sensitivity_dense_output).
    pub fn sensitivity(&mut self, j: usize, out: &mut [f64]) -> Result<(), Error> {
        self.sensitivity_dense_output(j, self.t, 0, out)
    }

    /// Evaluates ∂y/∂p_j as [`dense_output`](IdaSolver::dense_output) evaluates the solution. If the order of the next
    /// step is lower than the order of the last step, only derivatives up to the lower order are available.
    ///
    /// # Shapes
    /// `out`: the number of unknowns.
    ///
    /// # Errors
    /// Returns [`Error::NoParameter`], and the errors of [`dense_output`](IdaSolver::dense_output).
    pub fn sensitivity_dense_output(
        &mut self,
        j: usize,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), Error> {
        let of = self.n_parameters();
        if j >= of {
            return Err(Error::NoParameter { parameter: j, of });
        }
        expect_length("dense output", self.n, out.len())?;
        expect_finite_value("t", t)?;
        if self.ida.counter(Counter::Steps) == 0 && t == self.t0 && derivative <= 1 {
            if let Some(linearized) = &self.functions().sensitivities {
                out.copy_from_slice(&linearized.starts[j][derivative]);
            }
            return Ok(());
        }
        let order = self.ida.last_order().min(self.ida.current_order());
        let k = self.order_within_reach(t, derivative, order)?;
        self.call(|ida| ida.sensitivity(j, t, k).map(|values| out.copy_from_slice(values)))
    }

    /// Returns the counters of the sensitivities; all are zero without sensitivities.
    pub fn sensitivity_statistics(&self) -> SensitivityStatistics {
        let Some(of) = &self.functions().sensitivities else {
            return SensitivityStatistics::default();
        };
        // IDAS provides separate counters for the sensitivity solves only with the staggered method.
        let staggered = |counter| match of.options.method {
            SensitivityMethod::Staggered => self.ida.counter(counter),
            SensitivityMethod::Simultaneous => 0,
        };
        SensitivityStatistics {
            residual_evaluations: self.ida.counter(Counter::SensitivityEvaluations),
            error_test_failures: staggered(Counter::SensitivityErrorTestFailures),
            newton_iterations: staggered(Counter::SensitivityNewtonIterations),
            linear_setups: staggered(Counter::SensitivityLinearSetups),
        }
    }
}
