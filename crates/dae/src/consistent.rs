//! Consistent initial values of systems of index 1.

use crate::inconsistent::{CONVERGED, Inconsistent, norm};
use crate::integrator::ConsistencyMode;
use crate::linear_solver::LinearSolver;
use crate::linearization::Linearization;
use crate::problem::{Problem, StepError, VariableKind};
use crate::projection::project_onto_constraints;

/// Limits as in IDACalcIC: Newton iterations per matrix, matrices per scale, and number of scales.
const ITERATIONS: usize = 10;
const MATRICES: usize = 4;
const SCALES: i32 = 5;
/// Maximum number of times a correction is halved.
const HALVINGS: usize = 20;
/// Required reduction as a fraction of the reduction predicted by the linearization.
const DESCENT: f64 = 1e-4;

/// A state to be corrected.
struct State<'a> {
    t: f64,
    y: &'a mut [f64],
    y_dot: &'a mut [f64],
}

/// Corrects `y` and `y_dot` so that F(t, y, ẏ) = 0, by Newton's method with a line search (Brown, Hindmarsh, Petzold
/// 1998).
///
/// Newton's method stops when the correction is at most 0.0033 times the tolerance. For the comparison with tolerances
/// of y, a correction of ẏ is multiplied by the time to the first output, `t_first` − t. If the search fails with this
/// factor, it is repeated with the factor h.
///
/// For [`ConsistencyMode::AlgebraicAndDerivatives`] the matrix is ∂F/∂y + c ∂F/∂ẏ with c = 1/h. A correction δ changes
/// algebraic components of y by δ and derivatives of differential components by c δ. The change of differential
/// components of y is neglected, because it is small if h is small; h starts at a thousandth of `t_first` − t. For
/// [`ConsistencyMode::States`] c is 0, and a correction changes all components of y. [`ConsistencyMode::Constraints`]
/// calls [`project_onto_constraints`](crate::project_onto_constraints).
///
/// # Shapes
/// `kinds`, `y`, `y_dot`, `weights`, `distance`: the number of unknowns.
///
/// # Errors
/// Returns [`Inconsistent`] and restores the input values of y and ẏ.
#[allow(clippy::too_many_arguments)]
pub fn correct_initial_values<P: Problem, S: LinearSolver<P>>(
    problem: &mut P,
    solver: &mut S,
    mode: ConsistencyMode,
    kinds: &[VariableKind],
    (t, t_first): (f64, f64),
    y: &mut [f64],
    y_dot: &mut [f64],
    weights: &[f64],
    distance: &[f64],
) -> Result<(), Inconsistent> {
    if mode == ConsistencyMode::Constraints {
        let times = (t, t_first);
        return project_onto_constraints(problem, kinds, times, y, y_dot, weights, distance);
    }
    expect_index(problem, mode)?;
    let given = (y.to_vec(), y_dot.to_vec());
    let motion = norm(y_dot, weights);
    let time = (t_first - t).abs();
    let mut h = 1e-3 * time;
    if motion * h > 0.5 {
        h = 0.5 / motion;
    }
    let mut last = Inconsistent::NotFound { norm: f64::NAN };
    let searches = match mode {
        // A correction δ changes ẏ by δ/h. For the convergence test, this change is multiplied by the time to the first
        // output. This time or a longer time is also used for difference quotients, which perturb ẏ by the tolerance
        // divided by a time. With the short time h, the perturbation could leave the range in which F is linear.
        ConsistencyMode::AlgebraicAndDerivatives => {
            [1e3, 1.0].map(|factor| (0, CONVERGED * h / time, factor * time)).to_vec()
        }
        _ => Vec::new(),
    };
    let usual = (0..SCALES).map(|scale| (scale, CONVERGED, h * 0.1_f64.powi(scale)));
    for (scale, wanted, time) in searches.into_iter().chain(usual) {
        let step = h * 0.1_f64.powi(scale);
        let c = if mode == ConsistencyMode::AlgebraicAndDerivatives { 1.0 / step } else { 0.0 };
        let mut state = State { t, y, y_dot };
        let scales = (c, wanted);
        match newton(problem, solver, mode, kinds, &mut state, weights, (time, scales)) {
            Ok(()) => return Ok(()),
            Err(failed @ Inconsistent::Failed(StepError::Fatal(_))) => return Err(failed),
            Err(failed) => last = failed,
        }
        y.copy_from_slice(&given.0);
        y_dot.copy_from_slice(&given.1);
        if mode == ConsistencyMode::States {
            break;
        }
    }
    Err(last)
}

/// Checks that all stated indices are at most 1 if algebraic components and derivatives are corrected.
///
/// # Errors
/// Returns [`Inconsistent::IndexTooHigh`] if an index is higher.
pub fn expect_index<P: Problem>(problem: &P, mode: ConsistencyMode) -> Result<(), Inconsistent> {
    let indices = problem.indices().unwrap_or_default();
    match indices.iter().enumerate().max_by_key(|(_, index)| **index) {
        Some((i, &index)) if index > 1 && mode == ConsistencyMode::AlgebraicAndDerivatives => {
            Err(Inconsistent::IndexTooHigh { component: problem.component_name(i), index })
        }
        _ => Ok(()),
    }
}

#[allow(clippy::too_many_arguments)]
fn newton<P: Problem, S: LinearSolver<P>>(
    problem: &mut P,
    solver: &mut S,
    mode: ConsistencyMode,
    kinds: &[VariableKind],
    state: &mut State<'_>,
    weights: &[f64],
    (time, (c, wanted)): (f64, (f64, f64)),
) -> Result<(), Inconsistent> {
    let n = weights.len();
    let (mut correction, mut trial) = (vec![0.0; n], vec![0.0; n]);
    let mut size = f64::NAN;
    for _ in 0..MATRICES {
        let at = Linearization { t: state.t, y: state.y, y_dot: state.y_dot, step: time, weights };
        solver.evaluate(problem, &at)?;
        solver.set_up(problem, c, &[])?;
        size = solve_for(problem, solver, state, weights, &mut correction)?;
        for _ in 0..ITERATIONS {
            if size <= wanted {
                return Ok(());
            }
            let (mut length, before) = (1.0, size);
            for _ in 0..HALVINGS {
                shift(state, mode, kinds, c, -length, &correction);
                let tried = solve_for(problem, solver, state, weights, &mut trial);
                match tried {
                    Ok(now) if now <= (1.0 - DESCENT * length) * before => {
                        size = now;
                        break;
                    }
                    Err(StepError::Fatal(error)) => return Err(StepError::Fatal(error).into()),
                    _ => shift(state, mode, kinds, c, length, &correction),
                }
                length *= 0.5;
            }
            // If the residual decreases only slightly or not at all, the matrix is evaluated again.
            if size >= before {
                break;
            }
            correction.copy_from_slice(&trial);
            if size > 0.9 * before {
                break;
            }
        }
        if size <= wanted {
            return Ok(());
        }
    }
    Err(Inconsistent::NotFound { norm: size })
}

/// Adds `length` times the correction to the components that the mode corrects.
fn shift(
    state: &mut State<'_>,
    mode: ConsistencyMode,
    kinds: &[VariableKind],
    c: f64,
    length: f64,
    correction: &[f64],
) {
    for (i, delta) in correction.iter().enumerate() {
        match (mode, kinds[i]) {
            (ConsistencyMode::AlgebraicAndDerivatives, VariableKind::Differential) => {
                state.y_dot[i] += length * c * delta;
            }
            _ => state.y[i] += length * delta,
        }
    }
}

/// Writes J⁻¹ F to `out` and returns its weighted norm.
fn solve_for<P: Problem, S: LinearSolver<P>>(
    problem: &mut P,
    solver: &mut S,
    state: &State<'_>,
    weights: &[f64],
    out: &mut [f64],
) -> Result<f64, StepError> {
    problem.residual(state.t, state.y, state.y_dot, out)?;
    solver.solve_real(problem, out)?;
    let size = norm(out, weights);
    match size.is_finite() {
        true => Ok(size),
        false => Err(StepError::Recoverable("the correction is not finite".to_owned())),
    }
}
