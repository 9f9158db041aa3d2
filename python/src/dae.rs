//! Integration of equations whose functions are Python functions.

use std::sync::{Arc, PoisonError};

use myovib_dae::{
    ConsistencyMode, Direction, Integrator, Linearization, Outcome, Statistics, Suppressed,
    Tolerances, Unsatisfied, VariableKind, check_between, check_jacobian, check_pattern,
};
use myovib_radau::{RadauOptions, RadauSolver};
use myovib_sparse::resources;
use nalgebra_sparse::pattern::SparsityPattern;
use pyo3::exceptions::{PyException, PyMemoryError, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sundials_wrap::{IdaOptions, IdaSolver};

use crate::error::of_argument;
use crate::problem::{PythonDae, Raised, array, events};

/// Arguments of an integration, checked by the Python half. Its functions exchange arrays as bytes:
/// the stable ABI of Python 3.10 does not include numerical arrays.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Request {
    residual: Py<PyAny>,
    /// Returns the values of ∂F/∂y and ∂F/∂ẏ, in the order of the pattern.
    jacobian: Option<Py<PyAny>>,
    /// Column offsets, and row indices.
    pattern: Option<(Vec<usize>, Vec<usize>)>,
    /// Returns the values of all events.
    events: Option<Py<PyAny>>,
    /// Direction of each event: −1, 0 or 1.
    directions: Vec<i8>,
    /// Occurrence of each event that ends the integration; 0 for events that do not end it.
    terminal: Vec<usize>,
    algebraic: Option<Vec<bool>>,
    index: Option<Vec<u8>>,
    suppress: Option<Vec<bool>>,
    method: String,
    t_span: (f64, f64),
    y0: Vec<f64>,
    yp0: Vec<f64>,
    rtol: f64,
    atol: Vec<f64>,
    /// Output times, in the direction of integration; `None` for every step.
    t_eval: Option<Vec<f64>>,
    /// Size of the first step; its direction is the direction of the span.
    first_step: Option<f64>,
    max_step: Option<f64>,
    max_order: usize,
    max_steps: Option<usize>,
    /// Whether `max_steps` has its default value.
    has_default_limit: bool,
    /// `given`, `algebraic` or `states`.
    initial: String,
    /// Whether to store the polynomials of the steps.
    dense: bool,
}

/// Result of an integration.
#[derive(Default)]
struct Record {
    t: Vec<f64>,
    y: Vec<f64>,
    y_dot: Vec<f64>,
    /// Index of the event, time and solution of each crossing.
    events: Vec<(usize, f64, Vec<f64>)>,
    /// Step ends and nodal values of y for each step; empty unless stored.
    segments: Vec<f64>,
    samples: Vec<f64>,
    /// 0 at the end of the span, 1 after an event, −1 if the integrator failed.
    status: i8,
    message: String,
    /// Equation violated between the ends of a step.
    unsatisfied: Option<Unsatisfied>,
    /// Warnings about the Jacobian and about inputs faster than the steps.
    warnings: Vec<String>,
    statistics: Statistics,
}

impl Record {
    fn push(&mut self, t: f64, y: &[f64], y_dot: &[f64]) {
        self.t.push(t);
        self.y.extend_from_slice(y);
        self.y_dot.extend_from_slice(y_dot);
    }
}

/// Reason why an integration has no result.
enum Failure {
    /// Exception raised by a signal's handler between two steps.
    Raised(PyErr),
    /// Invalid argument.
    Argument(String),
    /// Error of the integrator.
    Integrator(String),
    /// Full matrices exceed the memory.
    Memory(String),
}

impl Failure {
    fn of(error: impl std::error::Error) -> Self {
        Self::Integrator(in_python(&error.to_string()))
    }
}

/// Returns the nodes of the polynomial of degree `degree` on [−1, 1]: Chebyshev nodes with both
/// ends.
fn nodes(degree: usize) -> Vec<f64> {
    let angle = |k: usize| std::f64::consts::PI * k as f64 / degree as f64;
    (0..=degree).map(|k| -angle(k).cos()).collect()
}

/// Clears an exception raised near the start, where functions are only evaluated on trial. Ctrl-C
/// and similar exceptions are kept.
fn forget_raised(problem: &PythonDae) -> Result<(), Failure> {
    let raised = problem.raised.lock();
    match raised.unwrap_or_else(PoisonError::into_inner).take() {
        Some(error) if !Python::attach(|py| error.is_instance_of::<PyException>(py)) => {
            Err(Failure::Raised(error))
        }
        _ => Ok(()),
    }
}

/// Rejects a sparsity pattern for finite differences that lacks entries. Returns a warning if a
/// given Jacobian seems wrong.
fn check_matrices(
    problem: &mut PythonDae,
    request: &Request,
    tolerances: &Tolerances,
) -> Result<Option<String>, Failure> {
    if problem.pattern.is_none() && problem.jacobian.is_none() {
        return Ok(None);
    }
    let mut weights = vec![0.0; problem.n];
    tolerances.write_weights(&request.y0, &mut weights);
    let at = Linearization {
        t: request.t_span.0,
        y: &request.y0,
        y_dot: &request.yp0,
        // With a very short step the perturbations of the variables equal their tolerances.
        step: f64::MIN_POSITIVE.copysign(request.t_span.1 - request.t_span.0),
        weights: &weights,
    };
    if problem.jacobian.is_some() {
        let wrong = check_jacobian(problem, &at).err();
        forget_raised(problem)?;
        return Ok(wrong.map(|wrong| wrong.to_string()));
    }
    let checked = check_pattern(problem, &at);
    forget_raised(problem)?;
    match checked {
        Ok(()) => Ok(None),
        Err(missing) => Err(Failure::Argument(format!("sparsity: {missing}"))),
    }
}

/// Corrects the initial values.
///
/// The first step is the time scale of the search for the derivatives. If it is estimated from the
/// span, which may be much longer than the time scale at the start, shorter steps are also tried.
fn correct<I: Integrator<PythonDae>>(
    solver: &mut I,
    mode: ConsistencyMode,
    request: &Request,
) -> Result<(), Failure> {
    let (t0, t_end) = request.t_span;
    let guesses: Vec<f64> = match request.first_step {
        Some(size) => vec![size.copysign(t_end - t0)],
        None => [3, 6, 9, 12].map(|k| (t_end - t0) * 0.1_f64.powi(k)).into(),
    };
    let mut failed = None;
    for first in guesses {
        forget_raised(solver.problem())?;
        match solver.correct_initial_values(mode, t0 + first) {
            Ok(()) => return Ok(()),
            Err(error) => failed = failed.or(Some(Failure::of(error))),
        }
        let raised = solver.problem().raised.lock();
        if raised.unwrap_or_else(PoisonError::into_inner).is_some() {
            break;
        }
    }
    failed.map_or(Ok(()), Err)
}

/// Fractions of a step at which the equations are checked, one in each step.
const FRACTIONS: [f64; 3] = [0.31, 0.62, 0.87];

/// Number of checked first steps, followed by steps whose number is a power of two.
const FIRST_STEPS: usize = 12;

/// Checks the equations within the last step, which is step number `n_steps`. Returns a violated
/// equation.
fn check_last_step<I: Integrator<PythonDae>>(
    solver: &mut I,
    tolerances: &Tolerances,
    n_steps: usize,
) -> Result<Option<Unsatisfied>, Failure> {
    let [from, to] = solver.last_step_interval();
    let n = solver.y().len();
    let [mut y, mut y_dot, mut weights] = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
    let t = from + FRACTIONS[n_steps % FRACTIONS.len()] * (to - from);
    for (derivative, out) in [&mut y, &mut y_dot].into_iter().enumerate() {
        solver
            .dense_output(t, derivative, out)
            .map_err(Failure::of)?;
    }
    tolerances.write_weights(&y, &mut weights);
    match check_between(solver.problem_mut(), (t, &y, &y_dot), to - from, &weights) {
        Ok(found) => Ok(found),
        // F need not have a value there.
        Err(_) => {
            forget_raised(solver.problem())?;
            Ok(None)
        }
    }
}

/// Integrates over the span. With `tolerances`, equations are checked between the ends of steps.
fn integrate<I: Integrator<PythonDae>>(
    solver: &mut I,
    request: &Request,
    tolerances: Option<&Tolerances>,
    degree: usize,
) -> Result<Record, Failure> {
    let (t0, t_end) = request.t_span;
    let forward = if t_end >= t0 { 1.0 } else { -1.0 };
    let mut record = Record::default();
    let mut out = [vec![0.0; request.y0.len()], vec![0.0; request.y0.len()]];
    let mode = match request.initial.as_str() {
        "algebraic" => Some(ConsistencyMode::AlgebraicAndDerivatives),
        "states" => Some(ConsistencyMode::States),
        _ => None,
    };
    if let Some(mode) = mode {
        correct(solver, mode, request)?;
    }
    forget_raised(solver.problem())?;
    let mut due = request.t_eval.as_deref().unwrap_or(&[]);
    if request.t_eval.is_none() {
        record.push(t0, solver.y(), solver.y_dot());
    }
    while let [t, rest @ ..] = due
        && *t == t0
    {
        record.push(t0, solver.y(), solver.y_dot());
        due = rest;
    }
    solver.set_stop_time(t_end).map_err(Failure::of)?;
    let nodes = nodes(degree);
    let mut occurrences = vec![0; request.terminal.len()];
    let mut n_steps = 0;
    let mut t_halfway = t0;
    loop {
        Python::attach(|py| py.check_signals()).map_err(Failure::Raised)?;
        let outcome = match solver.step(t_end) {
            Ok(outcome) => outcome,
            // The result up to this time is kept.
            Err(error) if n_steps > 0 && !has_raised(solver.problem()) => {
                (record.status, record.message) = (-1, in_python(&error.to_string()));
                record.statistics = solver.statistics();
                return Ok(record);
            }
            Err(error) => return Err(Failure::of(error)),
        };
        let t = outcome.t();
        let ended = match &outcome {
            Outcome::StepTaken { .. } => {
                n_steps += 1;
                if request.max_steps.is_some_and(|most| n_steps == most / 2) {
                    t_halfway = t;
                }
                (request.max_steps == Some(n_steps))
                    .then(|| (-1, limit_reached(request, n_steps, [t_halfway, t])))
            }
            Outcome::Root { crossings, .. } => {
                let crossed = (0..crossings.len()).filter(|&k| crossings[k] != 0);
                let mut last = None;
                for k in crossed {
                    occurrences[k] += 1;
                    record.events.push((k, t, solver.y().to_vec()));
                    if occurrences[k] == request.terminal[k] {
                        last = Some((1, format!("event {k} ended the integration at t = {t}")));
                    }
                }
                last
            }
            Outcome::Stopped(stop) => Some((-1, stop.to_string())),
            _ => Some((0, "the end of the span was reached".to_owned())),
        };
        let at_a_step = !matches!(outcome, Outcome::Root { .. });
        let gave_up = matches!(outcome, Outcome::Stopped(_));
        let is_checked = n_steps <= FIRST_STEPS || n_steps.is_power_of_two();
        if let Some(tolerances) = tolerances
            && is_checked
            && at_a_step
            && !gave_up
            && record.unsatisfied.is_none()
        {
            record.unsatisfied = check_last_step(solver, tolerances, n_steps)?;
        }
        while let [next, rest @ ..] = due
            && forward * (t - *next) >= 0.0
            && !gave_up
        {
            for (derivative, out) in out.iter_mut().enumerate() {
                solver
                    .dense_output(*next, derivative, out)
                    .map_err(Failure::of)?;
            }
            record.push(*next, &out[0], &out[1]);
            due = rest;
        }
        if (at_a_step || ended.is_some()) && !gave_up {
            if request.t_eval.is_none() {
                record.push(t, solver.y(), solver.y_dot());
            }
            if request.dense {
                let [from, _] = solver.last_step_interval();
                record.segments.extend([from, t]);
                for node in &nodes {
                    let at = 0.5 * ((1.0 - node) * from + (1.0 + node) * t);
                    solver
                        .dense_output(at, 0, &mut out[0])
                        .map_err(Failure::of)?;
                    record.samples.extend_from_slice(&out[0]);
                }
            }
        }
        if let Some((status, message)) = ended {
            (record.status, record.message) = (status, message);
            record.statistics = solver.statistics();
            return Ok(record);
        }
    }
}

/// Rejects full matrices that exceed the memory.
fn expect_room(n: usize, method: &str) -> Result<(), Failure> {
    // Values of 8 bytes for each entry. BDF: two copies of the pattern during construction, the
    // matrix, its factors and the user's two parts. Radau IIA: the pattern, its analysis and both
    // parts; the real matrix has entries, factors and workspace, and so has each of the (s - 1)/2
    // complex matrices, with two values per entry.
    let per_entry: f64 = match method {
        "bdf" => 6.0,
        "radau5" => 18.0,
        "radau9" => 25.0,
        _ => 32.0,
    };
    let needed = per_entry * 8.0 * (n as f64).powi(2);
    match resources::available() {
        Some(available) if needed > available as f64 => Err(Failure::Memory(format!(
            "full matrices of {n} unknowns need about {:.1} GiB, and {:.1} GiB are free: give the \
             pattern of the Jacobian by `sparsity`",
            needed / GIB,
            available as f64 / GIB,
        ))),
        _ => Ok(()),
    }
}

const GIB: f64 = (1_u64 << 30) as f64;

/// Returns whether a function has raised an exception, which is passed on.
fn has_raised(problem: &PythonDae) -> bool {
    let raised = problem.raised.lock();
    raised.unwrap_or_else(PoisonError::into_inner).is_some()
}

/// Explains that the step limit was reached at `t`; half of the steps were done at `t_halfway`.
fn limit_reached(request: &Request, n_steps: usize, [t_halfway, t]: [f64; 2]) -> String {
    let (t0, _) = request.t_span;
    let limit = match request.has_default_limit {
        true => "the default of max_steps",
        false => "max_steps",
    };
    let mut message = format!("the limit of {n_steps} steps ({limit}) was reached at t = {t}");
    // The steps have become much shorter.
    if n_steps > 1 && (t - t_halfway).abs() < 0.1 * (t_halfway - t0).abs() {
        message += ": the last half of them covers less than a tenth of the time of the first. F may \
                    switch back and forth at every step (chattering), for instance as dry friction or a \
                    relay without hysteresis does: make the switch smooth, or end at an event and start \
                    again behind it";
    }
    message
}

/// Builds the integrator and integrates. The second result is the degree of a step's polynomial.
fn compute(request: &Request, mut problem: PythonDae) -> Result<(Record, usize), Failure> {
    let tolerances = match request.atol[..] {
        [absolute] => Tolerances::scalar(request.rtol, absolute),
        _ => Tolerances::vector(request.rtol, request.atol.clone()),
    };
    if problem.pattern.is_none() {
        expect_room(problem.n, &request.method)?;
    }
    let warning = check_matrices(&mut problem, request, &tolerances)?;
    let (mut record, degree) =
        solve_with(request, problem, tolerances).map_err(|failure| match (failure, &warning) {
            (Failure::Integrator(message), Some(warning)) => {
                Failure::Integrator(format!("{message}; {warning}"))
            }
            (failure, _) => failure,
        })?;
    record.warnings.extend(warning);
    if let Some(Unsatisfied { equation, t, .. }) = record.unsatisfied {
        record.warnings.push(format!(
            "equation {equation} is violated at t = {t}, between the ends of a step: an input \
             may act or oscillate within steps. Limit `max_step` to a fraction of its duration or \
             period"
        ));
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
    // Excluded variables have errors of any size.
    let known = request.suppress.is_none().then(|| tolerances.clone());
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
            let options = IdaOptions {
                tolerances,
                suppressed,
                max_order: request.max_order,
                initial_step: request
                    .first_step
                    .map(|size| size.copysign(request.t_span.1 - t0)),
                max_step: request.max_step,
                max_steps: None,
                ..IdaOptions::default()
            };
            let mut builder = IdaSolver::builder(problem).options(options);
            if !directions.is_empty() {
                builder = builder.roots(directions, events);
            }
            let mut solver = builder.build(t0, y0, y_dot0).map_err(Failure::of)?;
            let degree = request.max_order;
            let record = integrate(&mut solver, request, known.as_ref(), degree)?;
            return Ok((record, degree));
        }
        "radau5" => 3,
        "radau9" => 5,
        _ => 7,
    };
    // Without dense output, the solution between the ends of steps is less accurate.
    let dense_output = request.dense || request.t_eval.is_some() || !directions.is_empty();
    let known = known.filter(|_| dense_output);
    let options = RadauOptions {
        stages,
        tolerances,
        dense_output,
        suppressed,
        initial_step: request.first_step,
        max_step: request.max_step,
        ..RadauOptions::default()
    };
    let mut builder = RadauSolver::builder(problem).options(options);
    if !directions.is_empty() {
        builder = builder.roots(directions, events);
    }
    let mut solver = builder.build(t0, y0, y_dot0).map_err(Failure::of)?;
    // The degree is the number of stages plus 1 for the slope at the start.
    let degree = stages + 1;
    let record = integrate(&mut solver, request, known.as_ref(), degree)?;
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
        jacobian: request
            .jacobian
            .as_ref()
            .map(|function| function.clone_ref(py)),
        events: request
            .events
            .as_ref()
            .map(|function| function.clone_ref(py)),
        pattern,
        kinds: request
            .algebraic
            .as_ref()
            .map(|all| all.iter().map(kind).collect()),
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

/// Replaces names of the library in a message by arguments of `solve_dae`.
fn in_python(message: &str) -> String {
    let names = [
        (
            "call correct_initial_values",
            "ask for initial=\"algebraic\"",
        ),
        ("correct_initial_values", "initial=\"algebraic\""),
        (" (reinit)", ""),
        ("(initial_step)", "(first_step)"),
        ("(suppressed)", "(suppress)"),
        ("Problem::indices", "index="),
        // Constraints are available only in Rust.
        (
            "; or stating the constraints (Problem::constraints) and correcting the initial values by them",
            "",
        ),
    ];
    let rename = |message: String, (ours, python): (&str, &str)| message.replace(ours, python);
    names.into_iter().fold(message.to_owned(), rename)
}

/// Converts the record to arrays, in row-major order.
fn result(py: Python<'_>, record: Record, degree: usize) -> PyResult<Bound<'_, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("t", array(py, &record.t))?;
    result.set_item("y", array(py, &record.y))?;
    result.set_item("yp", array(py, &record.y_dot))?;
    result.set_item("segments", array(py, &record.segments))?;
    result.set_item("samples", array(py, &record.samples))?;
    result.set_item("warnings", record.warnings)?;
    result.set_item("nodes", array(py, &nodes(degree)))?;
    let crossings = record.events.iter();
    let events: Vec<_> = crossings.map(|(k, t, y)| (*k, *t, array(py, y))).collect();
    result.set_item("events", events)?;
    result.set_item("status", record.status)?;
    result.set_item("message", in_python(&record.message))?;
    let s = &record.statistics;
    for (name, count) in [
        ("nfev", s.residual_evaluations + s.difference_evaluations),
        ("njev", s.jacobian_evaluations),
        ("nlu", s.linear_setups),
        ("nsteps", s.steps),
        ("nni", s.newton_iterations),
        ("netf", s.error_test_failures),
        ("ncfn", s.step_solve_failures),
        ("ngev", s.root_evaluations),
    ] {
        result.set_item(name, count)?;
    }
    Ok(result)
}
