//! Integration of DAEs defined by Python functions.

mod checks;
mod result;
mod sensitivities;
mod stepping;

use std::sync::{Arc, PoisonError};

use myovib_dae::{Direction, Suppressed, Tolerances, Unsatisfied, VariableKind};
use myovib_radau::{ForwardSensitivities, RadauOptions, RadauSolver};
use nalgebra_sparse::pattern::SparsityPattern;
use pyo3::exceptions::{PyMemoryError, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sundials_wrap::{IdaOptions, IdaSolver, SensitivityOptions};

use crate::error::of_argument;
use crate::problem::{PythonDae, Raised, events};
use checks::{check_matrices, expect_room};
use result::{Record, in_python, result};
use sensitivities::{IdaSensitivities, NoSensitivities, PythonParameters};
use stepping::{correct_start, integrate};

/// Arguments of an integration, already validated in Python. The callbacks exchange arrays as bytes, because the stable
/// ABI of Python 3.10 lacks the buffer protocol.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Request {
    residual: Py<PyAny>,
    /// Function that returns the values of ∂F/∂y and ∂F/∂ẏ in the order of the pattern.
    jacobian: Option<Py<PyAny>>,
    /// Column offsets and row indices of the pattern.
    pattern: Option<(Vec<usize>, Vec<usize>)>,
    /// Function that returns the values of all events.
    events: Option<Py<PyAny>>,
    /// Direction of each event: −1, 0 or 1.
    directions: Vec<i8>,
    /// For each event, the occurrence that ends the integration, counted from 1; 0 if no occurrence does.
    terminal: Vec<usize>,
    /// Values of the events just before the start of the span; given if the span starts at a break.
    events_before: Option<Vec<f64>>,
    algebraic: Option<Vec<bool>>,
    index: Option<Vec<u8>>,
    suppress: Option<Vec<bool>>,
    method: String,
    t_span: (f64, f64),
    y0: Vec<f64>,
    yp0: Vec<f64>,
    rtol: f64,
    atol: Vec<f64>,
    /// Output times in the direction of integration; `None` for an output after every step.
    t_eval: Option<Vec<f64>>,
    /// Size of the first step, which has the direction of the span.
    first_step: Option<f64>,
    max_step: Option<f64>,
    /// Time scale for measuring the errors of multipliers.
    time_scale: f64,
    max_order: usize,
    max_steps: Option<usize>,
    /// Whether `max_steps` has its default value.
    has_default_limit: bool,
    /// One of `given`, `algebraic` and `states`.
    initial: String,
    /// Whether the multipliers and derivatives at the start still have their values from before a break.
    after_break: bool,
    /// Whether a variable may have an index above 1 that was not stated.
    may_have_higher_index: bool,
    /// Whether to store the interpolation polynomials of the steps.
    dense: bool,
    /// Value and typical size of each parameter for which sensitivities are computed; empty without sensitivities.
    parameters: Vec<(f64, f64)>,
    /// Function that returns ∂F/∂p, row by row.
    df_dp: Option<Py<PyAny>>,
    /// For each parameter, ∂y/∂p at the start of the span and its derivative with respect to time.
    dy0_dp: Vec<[Vec<f64>; 2]>,
    /// Function that receives a warning before the first step.
    on_warning: Py<PyAny>,
}

/// Reason why an integration returns no result.
enum Failure {
    /// Python exception for the caller, raised by a signal handler, by `on_warning`, or by Ctrl-C in a function of the
    /// problem.
    Raised(PyErr),
    /// An argument is invalid.
    Argument(String),
    /// The integrator returned an error.
    Integrator(String),
    /// Full matrices do not fit into memory.
    Memory(String),
}

impl Failure {
    fn of(error: impl std::error::Error) -> Self {
        Self::Integrator(in_python(&error.to_string()))
    }
}

/// Builds the integrator and integrates. Returns the record and the degree of the polynomials that represent the steps.
fn compute(request: &Request, mut problem: PythonDae) -> Result<(Record, usize), Failure> {
    let tolerances = match request.atol[..] {
        [absolute] => Tolerances::scalar(request.rtol, absolute),
        _ => Tolerances::vector(request.rtol, request.atol.clone()),
    };
    if problem.pattern.is_none() {
        expect_room(problem.n, &request.method)?;
    }
    let warning = check_matrices(&mut problem, request, &tolerances)?;
    if let Some(text) = &warning {
        Python::attach(|py| request.on_warning.call1(py, (text,))).map_err(Failure::Raised)?;
    }
    let (mut record, degree) =
        solve_with(request, problem, tolerances).map_err(|failure| match (failure, &warning) {
            (Failure::Integrator(message), Some(warning)) => {
                Failure::Integrator(format!("{message}; {warning}"))
            }
            (failure, _) => failure,
        })?;
    record.warnings.extend(warning.map(|text| ("jacobian", text)));
    if let Some(Unsatisfied { equation, t, .. }) = record.unsatisfied {
        let text = format!(
            "equation {equation} is violated at t = {t}, within a step: an input, or a force that changes quickly \
             (friction, contact), may act or oscillate within steps. Limit `max_step` to a fraction of its duration \
             or period"
        );
        record.warnings.push(("input", text));
    }
    Ok((record, degree))
}

/// Integrates with the requested method.
fn solve_with(
    request: &Request,
    problem: PythonDae,
    tolerances: Tolerances,
) -> Result<(Record, usize), Failure> {
    let (t0, y0, y_dot0) = (request.t_span.0, &request.y0, &request.yp0);
    // Excluded variables may have arbitrarily large errors, because the error test ignores them. At index 3, rounding
    // errors of velocities are divided by the step size, and the derivatives of velocities are even less accurate.
    let highest = request.index.iter().flatten().max();
    let is_checked = request.suppress.is_none() && highest.is_none_or(|&index| index < 3);
    let known = is_checked.then(|| tolerances.clone());
    let suppressed = match &request.suppress {
        Some(components) => Suppressed::Components(components.clone()),
        None => Suppressed::Nothing,
    };
    let directions: Vec<Direction> = request
        .directions
        .iter()
        .map(|&direction| match direction {
            1 => Direction::Rising,
            -1 => Direction::Falling,
            _ => Direction::Both,
        })
        .collect();
    let stages = match request.method.as_str() {
        "bdf" => {
            let span = request.t_span.1 - t0;
            let mut options = IdaOptions {
                tolerances,
                suppressed,
                max_order: request.max_order,
                initial_step: request.first_step.map(|size| size.copysign(span)),
                max_step: request.max_step,
                max_steps: None,
                strict_newton: true,
                // `solve_dae` compares `jacobian` with difference quotients at several states.
                check_jacobian_at_stop: false,
                // If `max_step` is given, the steps are assumed to resolve the inputs.
                check_within_steps: known.is_some() && request.max_step.is_none(),
                ..IdaOptions::default()
            };
            if let (None, Some(excluded)) = (request.first_step, &request.suppress) {
                let step = options.first_step_of_index_2(y0, y_dot0, excluded, span);
                options.initial_step = step;
            }
            let mut builder = IdaSolver::builder(problem).options(options);
            if !directions.is_empty() {
                builder = builder.roots(directions, events);
            }
            let n_parameters = request.parameters.len();
            if n_parameters > 0 {
                let (parameters, starts) =
                    (PythonParameters::new(&request.parameters), request.dy0_dp.clone());
                builder = builder.sensitivities(parameters, SensitivityOptions::default(), starts);
            }
            let mut solver = builder.build(t0, y0, y_dot0).map_err(Failure::of)?;
            let degree = request.max_order;
            correct_start(&mut solver, request)?;
            let mut sensitivities = IdaSensitivities { n_parameters };
            let record =
                integrate(&mut solver, request, known.as_ref(), degree, &mut sensitivities)?;
            return Ok((record, degree));
        }
        "radau5" => 3,
        "radau9" => 5,
        _ => 7,
    };
    // Without dense output, solutions within steps are less accurate.
    let dense_output = request.dense || request.t_eval.is_some() || !directions.is_empty();
    let known = known.filter(|_| dense_output);
    let options = RadauOptions {
        stages,
        tolerances,
        dense_output,
        detect_kinks: true,
        suppressed,
        time_scale: request.time_scale,
        initial_step: request.first_step,
        max_step: request.max_step,
        check_jacobian_at_stop: false,
        ..RadauOptions::default()
    };
    let mut builder = RadauSolver::builder(problem).options(options);
    if !directions.is_empty() {
        builder = builder.roots(directions, events);
    }
    let mut solver = builder.build(t0, y0, y_dot0).map_err(Failure::of)?;
    if request.after_break {
        solver.restart();
    }
    correct_start(&mut solver, request)?;
    // The degree is the number of stages plus 1, because the slope at the start is also interpolated.
    let degree = stages + 1;
    let known = known.as_ref();
    let record = match request.parameters.is_empty() {
        true => integrate(&mut solver, request, known, degree, &mut NoSensitivities)?,
        false => {
            let starts = request.dy0_dp.iter().map(|[s, _]| s.clone()).collect();
            let parameters = PythonParameters::new(&request.parameters);
            let mut sensitivities =
                ForwardSensitivities::new(&solver, parameters, starts).map_err(Failure::of)?;
            integrate(&mut solver, request, known, degree, &mut sensitivities)?
        }
    };
    Ok((record, degree))
}

/// Integrates F(t, y, ẏ) = 0; see `myovib.solve_dae`.
#[pyfunction]
pub(crate) fn solve(py: Python<'_>, request: Request) -> PyResult<Bound<'_, PyDict>> {
    let n = request.y0.len();
    let pattern = match &request.pattern {
        Some((offsets, rows)) => Some(
            SparsityPattern::try_from_offsets_and_indices(n, n, offsets.clone(), rows.clone())
                .map_err(|error| of_argument(format!("sparsity: {error}")))?,
        ),
        None => None,
    };
    let kind = |&algebraic: &bool| match algebraic {
        true => VariableKind::Algebraic,
        false => VariableKind::Differential,
    };
    let raised = Raised::default();
    let problem = PythonDae {
        n,
        residual: request.residual.clone_ref(py),
        jacobian: request.jacobian.as_ref().map(|function| function.clone_ref(py)),
        events: request.events.as_ref().map(|function| function.clone_ref(py)),
        df_dp: request.df_dp.as_ref().map(|function| function.clone_ref(py)),
        pattern,
        kinds: request.algebraic.as_ref().map(|all| all.iter().map(kind).collect()),
        indices: request.index.clone(),
        parts: Default::default(),
        raised: Arc::clone(&raised),
    };
    let computed = py.detach(|| compute(&request, problem));
    if let Some(exception) = raised.lock().unwrap_or_else(PoisonError::into_inner).take() {
        return Err(exception);
    }
    let (record, degree) = computed.map_err(|failure| match failure {
        Failure::Raised(exception) => exception,
        Failure::Argument(message) => of_argument(message),
        Failure::Integrator(message) => PyRuntimeError::new_err(message),
        Failure::Memory(message) => PyMemoryError::new_err(message),
    })?;
    result(py, record, degree)
}
