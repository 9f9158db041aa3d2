//! Check of initial values against the equations.

use crate::draw::draw;
use crate::kinds::RateDependence;
use crate::problem::{Problem, StepError};

/// An equation that the initial values do not satisfy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InconsistentStart {
    /// The initial time.
    pub t: f64,
    /// Zero-based index of the equation. For a constraint: the number of equations plus the index of the constraint.
    pub equation: usize,
    /// Number of equations.
    pub n_equations: usize,
    /// Residual of the equation.
    pub residual: f64,
    /// Change of the residual caused by changes of y within the tolerances.
    pub change: f64,
}

impl std::error::Error for InconsistentStart {}

impl std::fmt::Display for InconsistentStart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { t, residual, change, .. } = self;
        let (what, remedy) = match self.equation.checked_sub(self.n_equations) {
            None => (
                format!("equation {}, which contains no derivatives,", self.equation),
                "give a y0 that satisfies it or, for index 1, call correct_initial_values",
            ),
            Some(k) => (
                format!("constraint {k} of the problem"),
                "call correct_initial_values with ConsistencyMode::Constraints",
            ),
        };
        write!(
            f,
            "the initial values are not consistent at t = {t}: {what} has residual {residual:.2e} (equations are \
             counted from 0), but changing y within the tolerances changes it only by {change:.2e}: {remedy}"
        )
    }
}

/// Jump of algebraic variables, in tolerances, that the first step of BDF accepts. The error estimate of this step is
/// half the difference between the solution and the prediction.
const FIRST_JUMP: f64 = 2.0;

/// Number of trial changes of y. The terms of an equation may cancel for one change but are unlikely to cancel for all
/// changes.
const TRIALS: u64 = 4;

/// Relative change of y whose effect on an equation is an estimate of the rounding error of the equation.
const ROUNDING: f64 = 1e3 * f64::EPSILON;

/// Rejects initial values if y violates the equations without derivatives or the [constraints](Problem::constraints)
/// stated by the problem.
///
/// Each residual is divided by its largest change when y changes within the tolerances 1/w_j:
///
/// ```text
/// e_i = |F_i| / max_k |F_i(y + d_k) − F_i(y)|,    |d_kj| between 0.5/w_j and 1/w_j
/// ```
///
/// The initial values are rejected if √(Σ e_i²/n) exceeds 2. Error tests use the same norm for variables.
///
/// Equations that depend on ẏ, as determined by the rule of [`kinds_at`](crate::kinds_at), are excluded, because a
/// wrong ẏ does not make y wrong. With a wrong ẏ, Radau IIA only chooses another size of the first step, and IDAS
/// begins with short steps or stops with a message. Failed evaluations are ignored here, because the first step reports
/// them.
///
/// # Shapes
/// `y`, `y_dot`, `weights`: the number of unknowns.
///
/// # Errors
/// Returns the equation with the largest e_i.
pub fn check_start<P: Problem + ?Sized>(
    problem: &mut P,
    (t, y, y_dot): (f64, &[f64], &[f64]),
    weights: &[f64],
) -> Result<(), InconsistentStart> {
    let weighed = weigh(problem, (t, y, y_dot), weights);
    let Ok(mut equations) = weighed else {
        return Ok(());
    };
    let are_satisfied = |equations: &[Equation]| {
        let squares: f64 = equations.iter().map(|e| e.size().powi(2)).sum();
        (squares / y.len() as f64).sqrt() <= FIRST_JUMP
    };
    if are_satisfied(&equations) {
        return Ok(());
    }
    // `weigh` has perturbed ẏ only once, by 1 + |ẏ|. The complete rule is expensive, so it is applied only if the
    // values would otherwise be rejected.
    let Ok(rates) = RateDependence::at(problem, (t, y, y_dot)) else {
        return Ok(());
    };
    equations.retain(|e| e.number >= y.len() || !rates.equations[e.number]);
    if are_satisfied(&equations) {
        return Ok(());
    }
    let worst = equations
        .into_iter()
        .max_by(|a, b| a.size().total_cmp(&b.size()))
        .expect("their sum is positive");
    Err(InconsistentStart {
        t,
        equation: worst.number,
        n_equations: y.len(),
        residual: worst.residual,
        change: worst.change,
    })
}

/// Equation that is not satisfied.
struct Equation {
    number: usize,
    residual: f64,
    change: f64,
}

impl Equation {
    fn size(&self) -> f64 {
        self.residual.abs() / self.change
    }
}

fn weigh<P: Problem + ?Sized>(
    problem: &mut P,
    (t, y, y_dot): (f64, &[f64], &[f64]),
    weights: &[f64],
) -> Result<Vec<Equation>, StepError> {
    let n = y.len();
    let evaluate = |problem: &mut P, y: &[f64], y_dot: &[f64], out: &mut [f64]| {
        let (of_equations, of_constraints) = out.split_at_mut(n);
        problem.residual(t, y, y_dot, of_equations)?;
        problem.constraints(t, y, of_constraints)
    };
    let mut given = vec![0.0; n + problem.n_constraints()];
    let mut changed = given.clone();
    evaluate(problem, y, y_dot, &mut given)?;
    let other = y_dot.iter().enumerate();
    let other: Vec<f64> = other.map(|(j, v)| v + (1.0 + v.abs()) * draw(0, j)).collect();
    evaluate(problem, y, &other, &mut changed)?;
    let mut equations: Vec<Equation> = (0..given.len())
        .filter(|&i| given[i] != 0.0 && given[i] == changed[i])
        .map(|i| Equation { number: i, residual: given[i], change: 0.0 })
        .collect();
    let trials = if equations.is_empty() { 0 } else { TRIALS };
    for trial in 1..=trials {
        let changes = y.iter().zip(weights).enumerate();
        let change = |(j, (y, w)): (usize, (&f64, &f64))| {
            y + (1.0 / w + ROUNDING * y.abs()) * draw(trial, j)
        };
        let perturbed: Vec<f64> = changes.map(change).collect();
        evaluate(problem, &perturbed, y_dot, &mut changed)?;
        for equation in &mut equations {
            let change = (changed[equation.number] - equation.residual).abs();
            if !change.is_finite() {
                return Ok(Vec::new());
            }
            equation.change = equation.change.max(change);
        }
    }
    Ok(equations)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two residuals: ẋ − x, and a function of x and z.
    struct Two(fn(f64, f64) -> f64);

    impl Problem for Two {
        fn n_unknowns(&self) -> usize {
            2
        }

        fn residual(
            &mut self,
            _: f64,
            y: &[f64],
            v: &[f64],
            r: &mut [f64],
        ) -> Result<(), StepError> {
            r.copy_from_slice(&[v[0] - y[0], (self.0)(y[0], y[1])]);
            Ok(())
        }
    }

    fn check(of: fn(f64, f64) -> f64, y: [f64; 2]) -> Result<(), InconsistentStart> {
        // A wrong ẏ is not checked.
        check_start(&mut Two(of), (0.0, &y, &[5.0, 0.0]), &[1e6, 1e6])
    }

    #[test]
    fn canceling_terms_do_not_hide_errors_above_the_tolerances() {
        let of: fn(f64, f64) -> f64 = |x, z| 1e9 * (x - z);
        for off in [-1e-6, 1e-6] {
            assert_eq!(check(of, [1.0, 1.0 + off]), Ok(()));
        }
        let error = check(of, [1.0, 1.1]).unwrap_err();
        assert_eq!((error.equation, error.t), (1, 0.0));
        // 1e9 (|d_x| + |d_z|), where |d_x| and |d_z| are between 0.5e-6 and 1e-6.
        assert!(error.change > 0.5e3 && error.change < 2e3, "{error}");
    }

    #[test]
    fn an_equation_that_no_y_satisfies_is_refused() {
        let error = check(|_, _| 1.0, [0.0; 2]).unwrap_err();
        assert_eq!((error.residual, error.change), (1.0, 0.0));
    }

    #[test]
    fn starts_without_nearby_evaluations_are_not_judged() {
        assert_eq!(check(|_, z| z.sqrt() - 1.0, [0.0; 2]), Ok(()));
    }

    #[test]
    fn rounding_errors_are_accepted_with_zero_tolerances() {
        let of: fn(f64, f64) -> f64 = |x, z| x * x - z;
        let y = [0.1, 0.1 * 0.1 * (1.0 + f64::EPSILON)];
        assert_ne!(of(y[0], y[1]), 0.0);
        let weights = [f64::INFINITY; 2];
        let checked = check_start(&mut Two(of), (0.0, &y, &[0.0; 2]), &weights);
        assert_eq!(checked, Ok(()));
    }
}
