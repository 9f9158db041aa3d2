//! Tests of the initial values of an integration.

use super::problems::Circle;
use super::{AnyProblem, Method, Request, roots, stopped};
use crate::samples::{MechanicalForm, Pendulum};
use myovib_dae::{
    ConsistencyMode, Direction, Integrator, Outcome, Problem, StepError, Suppressed, Tolerances,
};

#[track_caller]
fn refused(solver: &mut impl Integrator<AnyProblem>) -> String {
    let [step, run] = [solver.step(1.0).unwrap_err(), solver.integrate_to(1.0).unwrap_err()]
        .map(|error| error.to_string());
    assert_eq!(step, run);
    assert_eq!((solver.t(), solver.statistics().steps), (0.0, 0));
    run
}

/// Checks that values that contradict an equation are rejected, whether or not they are in the error test. The message
/// contains the equation, its residual and a remedy, and this remedy works.
pub fn rejects_initial_values_that_contradict_the_equations<M: Method>(method: &M) {
    let (y, y_dot) = Circle::start();
    let wrong = [y[0], y[1], 7.0];
    let goes_on = |mut solver: M::Integrator| {
        let outcome = solver.integrate_to(1.0).unwrap();
        assert_eq!(outcome, Outcome::Reached { t: 1.0 });
        // The error is 1e-6 per step in several dozen steps.
        assert!((solver.y()[0] - 1f64.sin()).abs() < 1e-4);
    };
    for suppressed in [Suppressed::Nothing, Suppressed::Algebraic] {
        for problem in [Circle::new, Circle::without_jacobian] {
            let start = |y: &[f64]| {
                method.build(Request {
                    suppressed: suppressed.clone(),
                    ..Request::new(problem(), 0.0, y, &y_dot)
                })
            };
            let mut solver = start(&wrong);
            let printed = refused(&mut solver);
            for part in ["equation 2", "has residual 6.00e0", "correct_initial_values"] {
                assert!(printed.contains(part), "{printed}");
            }
            assert_eq!((solver.y(), solver.y_dot()), (&wrong[..], &y_dot[..]));
            let mode = ConsistencyMode::AlgebraicAndDerivatives;
            solver.correct_initial_values(mode, 1.0).unwrap();
            goes_on(solver);

            let mut solver = start(&wrong);
            solver.reinit(0.0, &y, &y_dot, &[]).unwrap();
            solver.reinit(0.0, &wrong, &y_dot, &[]).unwrap();
            refused(&mut solver);
            solver.reinit(0.0, &y, &y_dot, &[]).unwrap();
            goes_on(solver);
        }
    }
}

/// Checks that initial values with an error below the tolerance are accepted unchanged, and that initial values with an
/// error a hundred times as large are rejected. A wrong ẏ does not cause a wrong solution: the integration either is
/// correct, or stops and suggests a remedy.
pub fn accepts_errors_of_initial_values_below_the_tolerances<M: Method>(method: &M) {
    let (y, y_dot) = Circle::start();
    // The tolerance is the relative plus the absolute tolerance at a = 1.
    let tolerance = 1e-6 + 1e-9;
    for sign in [-1.0, 1.0] {
        let started = |off: f64| {
            let y = [y[0], y[1], y[2] + sign * off * tolerance];
            method.build(Request::new(Circle::new(), 0.0, &y, &y_dot))
        };
        let outcome = started(1.0).integrate_to(1.0).unwrap();
        assert_eq!(outcome, Outcome::Reached { t: 1.0 });
        refused(&mut started(100.0));
    }
    let mut solver = method.build(Request::new(Circle::new(), 0.0, &y, &[0.0; 3]));
    match solver.integrate_to(1.0).unwrap() {
        // The same bound as above applies.
        Outcome::Reached { .. } => assert!((solver.y()[0] - 1f64.sin()).abs() < 1e-4),
        outcome => {
            let printed = stopped(outcome).to_string();
            assert!(printed.contains("correct_initial_values"), "{printed}");
        }
    }
}

/// Checks that the correction of ẏ takes the time to the first output into account. For ẏ³ + ẏ = 2y, the error of ẏ has
/// a small effect on y over a first step of 1e-6, but not over the time to the first output, so the correction must
/// continue.
pub fn corrects_derivatives_for_the_time_to_the_first_output<M: Method>(method: &M) {
    struct Cubic;
    impl Problem for Cubic {
        fn n_unknowns(&self) -> usize {
            1
        }

        fn residual(
            &mut self,
            _: f64,
            y: &[f64],
            v: &[f64],
            r: &mut [f64],
        ) -> Result<(), StepError> {
            r[0] = v[0].powi(3) + v[0] - 2.0 * y[0];
            Ok(())
        }
    }
    for tolerance in [1e-3, 1e-6] {
        let mut solver = method.build(Request {
            tolerances: Tolerances::scalar(tolerance, tolerance),
            ..Request::new(Cubic, 0.0, &[1.0], &[0.0])
        });
        let mode = ConsistencyMode::AlgebraicAndDerivatives;
        solver.correct_initial_values(mode, 1e-3).unwrap();
        assert_eq!(solver.y(), [1.0]);
        // The product of ẏ and the time to the output, 1e-3, is accurate to 0.0033 of the tolerance of y = 1, which is
        // twice `tolerance`.
        let allowed = 0.0033 * 2.0 * tolerance / 1e-3;
        assert!((solver.y_dot()[0] - 1.0).abs() < allowed, "{:?}", solver.y_dot());
    }
}

/// Checks a pendulum whose problem states its constraints: a position off the circle and a velocity that is not
/// tangential to the circle are rejected, and the error contains the index of the violated constraint.
pub fn rejects_initial_values_that_violate_stated_constraints<M: Method>(method: &M) {
    for (q, v, part) in
        [([1.0, 0.0], [0.5, 0.0], "constraint 1"), ([1.1, 0.0], [0.0, 0.5], "constraint 0")]
    {
        let y = [q[0], q[1], v[0], v[1], v[0] * v[0] + v[1] * v[1]];
        let y_dot = [v[0], v[1], -y[4] * q[0], -9.81, 0.0];
        let request = Request {
            suppressed: Suppressed::FromIndex(2),
            ..Request::new(Pendulum::new(MechanicalForm::Index3), 0.0, &y, &y_dot)
        };
        let mut solver = method.build(request);
        let printed = refused(&mut solver);
        assert!(printed.contains(part), "{printed}");
        let mode = ConsistencyMode::Constraints;
        solver.correct_initial_values(mode, 1.0).unwrap();
        let outcome = solver.step(1e-2).unwrap();
        assert!(matches!(outcome, Outcome::StepTaken { .. }), "{outcome:?}");
    }
}

/// Checks that the values at a root are accepted as initial values, although dense output is less accurate than the
/// values at the ends of steps.
pub fn accepts_the_values_at_an_event_as_initial_values<M: Method>(method: &M) {
    let tolerances = [1e-2, 1e-4, 1e-6, 1e-9];
    let levels = [-0.9, -0.3, 0.2, 0.6];
    for (tolerance, level) in tolerances.iter().flat_map(|t| levels.map(|l| (*t, l))) {
        let mut solver = method.build(Request {
            tolerances: Tolerances::scalar(tolerance, tolerance),
            roots: roots(&[Direction::Both], move |_, y, g| {
                g[0] = y[0] - level;
                Ok(())
            }),
            ..Circle::new().request()
        });
        for _ in 0..3 {
            let outcome = solver.integrate_to(30.0).unwrap();
            let Outcome::Root { .. } = outcome else {
                break;
            };
            let (y, y_dot) = (solver.y().to_vec(), solver.y_dot().to_vec());
            solver.reinit(solver.t(), &y, &y_dot, &[]).unwrap();
        }
        solver.step(30.0).unwrap();
    }
}
