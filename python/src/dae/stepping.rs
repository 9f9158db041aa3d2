//! Correction of the initial values, and the loop over all steps.

use std::sync::PoisonError;

use myovib_dae::{ConsistencyMode, Integrator, Outcome, Problem, Remedy, Statistics, Tolerances};
use pyo3::prelude::*;

use super::checks::{FIRST_STEPS, check_last_step, forget_raised};
use super::result::{Record, nodes};
use super::sensitivities::Sensitivities;
use super::{Failure, Request};
use crate::problem::{PythonDae, events};

/// Corrects the initial values.
///
/// The size of the first step is the time scale in the search for the derivatives. If this size is not given, it is
/// estimated from the span. The span may be much longer than the time scale at the start, so shorter steps are also
/// tried.
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

/// Corrects the initial values as requested. With Radau IIA, sensitivities must be started after this correction.
pub(super) fn correct_start<I: Integrator<PythonDae>>(
    solver: &mut I,
    request: &Request,
) -> Result<(), Failure> {
    let mode = match request.initial.as_str() {
        "algebraic" => Some(ConsistencyMode::AlgebraicAndDerivatives),
        "states" => Some(ConsistencyMode::States),
        _ => None,
    };
    mode.map_or(Ok(()), |mode| correct(solver, mode, request))
}

/// Records the initial values if the initial time is an output time. Returns the output times after the start.
fn start<'a, I: Integrator<PythonDae>>(
    solver: &mut I,
    request: &'a Request,
    record: &mut Record,
) -> Result<&'a [f64], Failure> {
    let (t0, t_end) = request.t_span;
    forget_raised(solver.problem())?;
    solver.set_stop_time(t_end).map_err(Failure::of)?;
    let (n, times) = match &request.t_eval {
        Some(times) => (times.iter().take_while(|t| **t == t0).count(), &times[..]),
        None => (1, &[][..]),
    };
    for _ in 0..n {
        record.push(t0, solver.y(), solver.y_dot());
        request.dy0_dp.iter().for_each(|[s, _]| record.dy_dp.extend_from_slice(s));
    }
    Ok(times.get(n..).unwrap_or_default())
}

/// Records the solution at the interpolation nodes of the last step, up to `t`. `out` is a workspace.
fn record_segment<I: Integrator<PythonDae>>(
    solver: &mut I,
    t: f64,
    nodes: &[f64],
    out: &mut [f64],
    record: &mut Record,
) -> Result<(), Failure> {
    let [from, _] = solver.last_step_interval();
    record.segments.extend([from, t]);
    for node in nodes {
        let at = 0.5 * ((1.0 - node) * from + (1.0 + node) * t);
        solver.dense_output(at, 0, out).map_err(Failure::of)?;
        record.samples.extend_from_slice(out);
    }
    Ok(())
}

/// Records the sensitivities at a time within the last step. `out` is a workspace.
fn record_sensitivities<I>(
    (sensitivities, solver): (&impl Sensitivities<I>, &mut I),
    t: f64,
    out: &mut [f64],
    record: &mut Record,
) -> Result<(), Failure> {
    for j in 0..sensitivities.n_parameters() {
        sensitivities.write(solver, j, t, out)?;
        record.dy_dp.extend_from_slice(out);
    }
    Ok(())
}

/// Returns the counters of the integrator, including evaluations for sensitivities.
fn statistics<I: Integrator<PythonDae>>(
    solver: &I,
    sensitivities: &impl Sensitivities<I>,
) -> Statistics {
    let mut statistics = solver.statistics();
    statistics.difference_evaluations += sensitivities.difference_evaluations();
    statistics
}

/// Integrates over the span. If `tolerances` are given, also checks the equations within steps.
pub(super) fn integrate<I: Integrator<PythonDae>>(
    solver: &mut I,
    request: &Request,
    tolerances: Option<&Tolerances>,
    degree: usize,
    sensitivities: &mut impl Sensitivities<I>,
) -> Result<Record, Failure> {
    let (t0, t_end) = request.t_span;
    let forward = if t_end >= t0 { 1.0 } else { -1.0 };
    let mut record = Record::default();
    let mut out = [vec![0.0; request.y0.len()], vec![0.0; request.y0.len()]];
    let mut due = start(solver, request, &mut record)?;
    let nodes = nodes(degree);
    let mut occurrences = vec![0; request.terminal.len()];
    if let Some((status, message)) = count(
        events_at_break(solver, request)?,
        (t0, solver.y()),
        request,
        (&mut occurrences[..], &mut record),
    ) {
        (record.status, record.message) = (status, message);
        record.statistics = statistics(solver, sensitivities);
        return Ok(record);
    }
    let mut n_steps = 0;
    let mut t_halfway = t0;
    loop {
        Python::attach(|py| py.check_signals()).map_err(Failure::Raised)?;
        let stepped = solver.step(t_end).map_err(Failure::of);
        let followed = stepped.and_then(|outcome| sensitivities.follow(solver).map(|()| outcome));
        let outcome = match followed {
            Ok(outcome) => outcome,
            // The results up to this time are kept.
            Err(Failure::Integrator(message)) if n_steps > 0 && !has_raised(solver.problem()) => {
                (record.status, record.message) = (-1, message);
                record.statistics = statistics(solver, sensitivities);
                return Ok(record);
            }
            Err(failure) => return Err(failure),
        };
        let t = outcome.t();
        let ended = match &outcome {
            Outcome::StepTaken { .. } => {
                n_steps += 1;
                if request.max_steps.is_some_and(|most| n_steps == most / 2) {
                    t_halfway = t;
                }
                (request.max_steps == Some(n_steps)).then(|| {
                    let reason = match sensitivities.are_in_error_test() {
                        true => SENSITIVITIES,
                        false => CHATTERING,
                    };
                    (-1, limit_reached(request, n_steps, [t_halfway, t], reason))
                })
            }
            Outcome::Root { crossings, .. } => {
                let crossed = (0..crossings.len()).filter(|&k| crossings[k] != 0);
                let counts = (&mut occurrences[..], &mut record);
                count(crossed.collect(), (t, solver.y()), request, counts)
            }
            Outcome::Stopped(stop) => {
                let mut stop = stop.clone();
                let is_autonomous = is_autonomous(solver, request)?;
                stop.remedies.retain(|remedy| match remedy {
                    Remedy::RestartAtBreak => !is_autonomous,
                    Remedy::StateIndices => request.may_have_higher_index,
                    Remedy::LooserMultipliers => request.rtol < LOOSE,
                    _ => true,
                });
                for remedy in &mut stop.remedies {
                    if *remedy == Remedy::LooserTolerances && request.rtol >= LOOSE {
                        *remedy = Remedy::TighterTolerances;
                    }
                }
                Some((-1, stop.to_string()))
            }
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
                solver.dense_output(*next, derivative, out).map_err(Failure::of)?;
            }
            record.push(*next, &out[0], &out[1]);
            record_sensitivities((&*sensitivities, solver), *next, &mut out[0], &mut record)?;
            due = rest;
        }
        if (at_a_step || ended.is_some()) && !gave_up {
            if request.t_eval.is_none() {
                record.push(t, solver.y(), solver.y_dot());
                record_sensitivities((&*sensitivities, solver), t, &mut out[0], &mut record)?;
            }
            if request.dense {
                record_segment(solver, t, &nodes, &mut out[0], &mut record)?;
            }
        }
        if let Some((status, message)) = ended {
            (record.status, record.message) = (status, message);
            record.statistics = statistics(solver, sensitivities);
            return Ok(record);
        }
    }
}

/// Relative tolerance above which a stop is attributed to an inaccurate state and not to rounding errors. In this case,
/// tighter tolerances are suggested.
const LOOSE: f64 = 1e-5;

/// Number of times in each direction at which F is compared with its value at the current time. Their distances from
/// the current time decrease by factors of 2 from the whole span to about the rounding error.
const DISTANCES: i32 = 48;

/// Returns whether F has the same value at other times. F then has no inputs that may need a break.
fn is_autonomous<I: Integrator<PythonDae>>(
    solver: &mut I,
    request: &Request,
) -> Result<bool, Failure> {
    if has_raised(solver.problem()) {
        return Ok(true);
    }
    let (t, y, y_dot) = (solver.t(), solver.y().to_vec(), solver.y_dot().to_vec());
    let (t0, t_end) = request.t_span;
    let mut at = |t: f64| {
        let mut residual = vec![0.0; y.len()];
        let evaluated = solver.problem_mut().residual(t, &y, &y_dot, &mut residual);
        evaluated.is_ok().then_some(residual)
    };
    let here = at(t);
    let distances = (0..DISTANCES).flat_map(|k| [1.0, -1.0].map(|sign| sign * 0.5_f64.powi(k)));
    let mut times = distances.map(|c| (t + c * (t_end - t0)).clamp(t0.min(t_end), t0.max(t_end)));
    let is_autonomous = here.is_some() && times.all(|t| at(t) == here);
    forget_raised(solver.problem())?;
    Ok(is_autonomous)
}

/// Returns the events that change sign at the start of the span, if the span starts at a break.
fn events_at_break<I: Integrator<PythonDae>>(
    solver: &mut I,
    request: &Request,
) -> Result<Vec<usize>, Failure> {
    let Some(before) = &request.events_before else {
        return Ok(Vec::new());
    };
    let (t, y, y_dot) = (solver.t(), solver.y().to_vec(), solver.y_dot().to_vec());
    let mut after = vec![0.0; before.len()];
    events(solver.problem_mut(), t, &y, &y_dot, &mut after)
        .map_err(|e| Failure::Integrator(e.to_string()))?;
    let crosses = |&k: &usize| {
        let is_wanted = f64::from(request.directions[k]) * before[k] <= 0.0;
        before[k] * after[k] < 0.0 && is_wanted
    };
    Ok((0..before.len()).filter(crosses).collect())
}

/// Records the events at (t, y). Returns the status and the message if one of these events ends the integration.
fn count(
    crossed: Vec<usize>,
    (t, y): (f64, &[f64]),
    request: &Request,
    (occurrences, record): (&mut [usize], &mut Record),
) -> Option<(i8, String)> {
    let mut last = None;
    for k in crossed {
        occurrences[k] += 1;
        record.events.push((k, t, y.to_vec()));
        if occurrences[k] == request.terminal[k] {
            last = Some((1, format!("event {k} ended the integration at t = {t}")));
        }
    }
    last
}

/// Returns whether a function of the problem has raised an exception, which [`solve`](super::solve) re-raises.
fn has_raised(problem: &PythonDae) -> bool {
    let raised = problem.raised.lock();
    raised.unwrap_or_else(PoisonError::into_inner).is_some()
}

/// Possible reason why steps become much shorter.
const CHATTERING: &str = "F may switch back and forth at every step (chattering), for instance as dry friction or a relay \
     without hysteresis does: make the switch smooth, or end at an event and restart after it. An input with kinks, or \
     with rounding errors near them, has the same effect: list their times in `breaks`, and compute it without \
     cancellation";
/// Possible reason why steps become much shorter if BDF tests the errors of sensitivities.
const SENSITIVITIES: &str = "BDF also tests the errors of the sensitivities, which need short steps if large ones almost \
     cancel: compute without `parameters` to see whether the solution alone needs them, and compare sensitivities by \
     other methods with differences of solutions";

/// Returns the message for a step limit that was reached at `t`. The first half of the steps reached `t_halfway`. If the
/// steps have become much shorter in the second half, the message names a possible `reason`.
fn limit_reached(
    request: &Request,
    n_steps: usize,
    [t_halfway, t]: [f64; 2],
    reason: &str,
) -> String {
    let (t0, _) = request.t_span;
    let limit = match request.has_default_limit {
        true => "the default of max_steps",
        false => "max_steps",
    };
    let mut message = format!("the limit of {n_steps} steps ({limit}) was reached at t = {t}");
    if n_steps > 1 && (t - t_halfway).abs() < 0.1 * (t_halfway - t0).abs() {
        message += &format!(
            ": the last half of them covers less than a tenth of the time covered by the first half. {reason}"
        );
    }
    message
}
