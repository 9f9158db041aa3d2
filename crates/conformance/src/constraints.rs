//! Tests of systems of index 2 and 3: consistent values from constraints, and exclusion of components by index.

use super::problems::Circle;
use super::{Method, Request};
use crate::samples::{JayIndex2, MechanicalForm, Pendulum, Sample};
use myovib_dae::{ConsistencyMode, Integrator, Outcome, Problem, StepError, Suppressed};

/// Allowed residual of an equation or constraint. Difference quotients are accurate to about 1e-10.
const SATISFIED: f64 = 1e-8;

/// Returns the largest residual of F and of the constraints.
fn left<P: Problem>(problem: &mut P, t: f64, y: &[f64], y_dot: &[f64]) -> f64 {
    let mut f = vec![0.0; problem.n_unknowns()];
    problem.residual(t, y, y_dot, &mut f).unwrap();
    let mut c = vec![0.0; problem.n_constraints()];
    problem.constraints(t, y, &mut c).unwrap();
    f.iter().chain(&c).fold(0.0, |m: f64, x| m.max(x.abs()))
}

/// Checks that consistent values, including multipliers, are found near values that violate the constraints, and that
/// an integration from the consistent values satisfies the constraints. The problems are the pendulum of index 3 and 2
/// and Jay's problem of index 2.
pub fn projects_initial_values_onto_stated_constraints<M: Method>(method: &M) {
    let length: f64 = 1.0;
    for form in [MechanicalForm::Index3, MechanicalForm::Index2] {
        // The length is 2 % too large, the velocity is not tangential, and the multiplier is zero.
        let wrong = [0.72, -0.72, 0.5, 0.6, 0.0];
        let request = Request {
            suppressed: Suppressed::ExcludeFromIndex(2),
            ..Request::new(Pendulum::new(form), 0.0, &wrong, &[0.0; 5])
        };
        let mut solver = method.build(request);
        let mode = ConsistencyMode::Constraints;
        solver.correct_initial_values(mode, 1.0).unwrap();
        let (y, y_dot) = (solver.y().to_vec(), solver.y_dot().to_vec());
        let off = left(solver.problem_mut(), 0.0, &y, &y_dot);
        assert!(off < SATISFIED, "{form:?}: {off:e} of {y:?} {y_dot:?}");
        for (moved, given) in y.iter().zip(&wrong).take(4) {
            // The values violate the constraints by a few hundredths.
            assert!((moved - given).abs() < 0.1, "{form:?}: {y:?}");
        }
        // The second derivative of the constraint gives λ = (u² + v² − g y)/ℓ².
        let exact = (y[2] * y[2] + y[3] * y[3] - 9.81 * y[1]) / (length * length);
        assert!((y[4] - exact).abs() < SATISFIED * exact, "{form:?}: {} {exact}", y[4]);
        let outcome = solver.integrate_to(1e-2).unwrap();
        assert_eq!(outcome, Outcome::Reached { t: 1e-2 }, "{form:?}");
    }

    let start = JayIndex2.start();
    let request = Request {
        suppressed: Suppressed::ExcludeFromIndex(2),
        ..Request::new(JayIndex2, 0.0, &[1.1, 1.1, 0.3], &[0.0; 3])
    };
    let mut solver = method.build(request);
    solver.correct_initial_values(ConsistencyMode::Constraints, 1.0).unwrap();
    let (y, y_dot) = (solver.y().to_vec(), solver.y_dot().to_vec());
    let off = left(solver.problem_mut(), 0.0, &y, &y_dot);
    assert!(off < SATISFIED, "{off:e} of {y:?}");
    assert_eq!(solver.integrate_to(0.1).unwrap(), Outcome::Reached { t: 0.1 });

    // A given velocity is kept, although its other component, 0, is only a guess: the projection moves the velocity
    // (0.1, 0) only by its normal component, 0.06. If error weights were used, the position or the velocity would
    // change completely.
    let guess = [0.6, -0.8, 0.1, 0.0, 0.0];
    let request = Request::new(Pendulum::new(MechanicalForm::Index3), 0.0, &guess, &[0.0; 5]);
    let mut solver = method.build(request);
    solver.correct_initial_values(ConsistencyMode::Constraints, 1.0).unwrap();
    let moved = solver.y().iter().zip(&guess).take(4).map(|(y, given)| y - given);
    let distance = moved.fold(0.0, f64::hypot);
    assert!(distance < 0.06 * (1.0 + SATISFIED), "{distance}: {:?}", solver.y());

    // Consistent values do not change.
    let request = Request::new(JayIndex2, 0.0, &start.y, &[0.0; 3]);
    let mut solver = method.build(request);
    solver.correct_initial_values(ConsistencyMode::Constraints, 1.0).unwrap();
    for (found, exact) in solver.y().iter().zip(&start.y) {
        assert!((found - exact).abs() < SATISFIED, "{:?}", solver.y());
    }
}

/// Checks that a search for algebraic components and derivatives is rejected if the index is above 1, because it does
/// not determine these values then.
pub fn rejects_a_search_for_index_1_at_a_higher_index<M: Method>(method: &M) {
    let mode = ConsistencyMode::AlgebraicAndDerivatives;
    for form in [MechanicalForm::Index3, MechanicalForm::Index2] {
        let start = [1.0, 0.0, 0.0, 1.0, 0.0];
        let mut solver = method.build(Request {
            suppressed: Suppressed::ExcludeFromIndex(2),
            ..Request::new(Pendulum::new(form), 0.0, &start, &[0.0; 5])
        });
        let printed = solver.correct_initial_values(mode, 1.0).unwrap_err().to_string();
        assert!(printed.contains("ConsistencyMode::Constraints"), "{printed}");
        assert_eq!(solver.y(), start);
        solver.correct_initial_values(ConsistencyMode::Constraints, 1.0).unwrap();
    }
}

/// Checks that missing or wrong constraints are rejected.
pub fn rejects_missing_or_wrong_constraints<M: Method>(method: &M) {
    let mut solver = method.build(Circle::new().request());
    let mode = ConsistencyMode::Constraints;
    let error = solver.correct_initial_values(mode, 1.0).unwrap_err();
    let printed = error.to_string();
    assert!(printed.contains("Problem::constraints"), "{printed}");

    let mut solver = method.build(Request::new(Contradiction, 0.0, &[0.5, 0.0], &[0.0; 2]));
    let error = solver.correct_initial_values(mode, 1.0).unwrap_err();
    let printed = error.to_string();
    assert!(printed.contains("1.00e0") && printed.contains("equation 1"), "{printed}");
    assert_eq!(solver.y(), [0.5, 0.0]);
}

/// The system ẋ = z, 0 = x − 1, with the contradictory constraint x = 2.
struct Contradiction;

impl Problem for Contradiction {
    fn n_unknowns(&self) -> usize {
        2
    }

    fn residual(&mut self, _: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        r.copy_from_slice(&[v[0] - y[1], y[0] - 1.0]);
        Ok(())
    }

    fn n_constraints(&self) -> usize {
        1
    }

    fn constraints(&mut self, _: f64, y: &[f64], out: &mut [f64]) -> Result<(), StepError> {
        out[0] = y[0] - 2.0;
        Ok(())
    }
}

/// Checks that components can be excluded by index if the problem states indices, and that tolerances then do not apply
/// to these components.
pub fn excludes_components_by_their_index<M: Method>(method: &M) {
    let start = JayIndex2.start();
    for suppressed in [Suppressed::FromIndex(2), Suppressed::ExcludeFromIndex(2)] {
        let request = Request {
            suppressed: suppressed.clone(),
            ..Request::new(JayIndex2, 0.0, &start.y, &start.y_dot)
        };
        let mut solver = method.build(request);
        assert_eq!(solver.integrate_to(0.5).unwrap(), Outcome::Reached { t: 0.5 });
        let exact = JayIndex2.exact(0.5).unwrap();
        for (y, exact) in solver.y().iter().zip(exact).take(2) {
            // The error is 1e-6 per step in a few dozen steps.
            assert!((y - exact).abs() < 1e-4, "{suppressed:?}: {:?}", solver.y());
        }
    }
}

/// Oscillator ẋ = v, v̇ = −x, and a component z = sin(30 t), which is 30 times as fast and is integrated from its
/// derivative. The stated index of z, 2, is higher than necessary.
struct FastComponent;

impl Problem for FastComponent {
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
        residual[0] = y_dot[0] - y[1];
        residual[1] = y_dot[1] + y[0];
        residual[2] = y_dot[2] - 30.0 * (30.0 * t).cos();
        Ok(())
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![1, 1, 2])
    }
}

/// Checks that a component does not limit the steps if it is excluded from the error test, either by its position or by
/// its index.
pub fn excludes_components_from_the_error_test<M: Method>(method: &M) {
    let steps = |suppressed| {
        let request = Request {
            suppressed,
            ..Request::new(FastComponent, 0.0, &[0.0, 1.0, 0.0], &[1.0, 0.0, 30.0])
        };
        let mut solver = method.build(request);
        solver.integrate_to(10.0).unwrap();
        solver.statistics().steps
    };
    let of_all = steps(Suppressed::Nothing);
    for suppressed in [
        Suppressed::Components(vec![false, false, true]),
        Suppressed::FromIndex(2),
        Suppressed::ExcludeFromIndex(2),
    ] {
        let without = steps(suppressed.clone());
        assert!(5 * without < of_all, "{suppressed:?}: {without} and {of_all} steps");
    }
}
