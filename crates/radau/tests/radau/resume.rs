//! Checks that a solver continuing from a saved state takes the same steps as the original solver.

use myovib_conformance::samples::{
    CapacitorLoop, CarAxis, Differentiated, Heat2d, JayIndex2, LinearIndex1, MechanicalForm,
    Pendulum, Sample,
};
use myovib_dae::IntegratorError::WrongLength;
use myovib_dae::{Direction, Outcome};
use myovib_radau::{RadauError, RadauOptions, RadauState};

use crate::common::{WithoutJacobian, solver, tolerance};

/// Returns the numbers of the steps at which the state is saved, multiples of a large integer modulo the number of
/// steps.
fn places(steps: u64) -> Vec<u64> {
    (1..=5).map(|i| (i * 2_654_435_761) % steps).collect()
}

/// Saves the states of a run at several steps as JSON, and continues from each with a new solver.
#[track_caller]
fn assert_goes_on<S: Sample + Clone + 'static>(sample: &S, t_end: f64, options: &RadauOptions) {
    let begin = || {
        let mut solver = solver(sample.clone(), options.clone());
        solver.set_stop_time(t_end).unwrap();
        solver
    };
    let mut whole = begin();
    while whole.t() < t_end {
        assert!(!matches!(whole.step(t_end).unwrap(), Outcome::Stopped(_)));
    }
    for place in places(whole.statistics().steps) {
        let mut first = begin();
        for _ in 0..place {
            first.step(t_end).unwrap();
        }
        let text = serde_json::to_string(&first.save()).unwrap();
        let state: RadauState = serde_json::from_str(&text).unwrap();
        assert_eq!(state, first.save(), "JSON");
        let mut second = solver(sample.clone(), options.clone());
        second.restore(&state).unwrap();
        let mut out = [vec![0.0; first.y().len()], vec![0.0; first.y().len()]];
        while second.t() < t_end {
            first.step(t_end).unwrap();
            second.step(t_end).unwrap();
            assert_eq!(second.save(), first.save(), "{place}");
            let [from, to] = first.last_step_interval();
            let t = 0.3 * from + 0.7 * to;
            first.dense_output(t, 0, &mut out[0]).unwrap();
            second.dense_output(t, 0, &mut out[1]).unwrap();
            assert_eq!(out[0], out[1]);
        }
        // Saving does not change the original solver.
        assert_eq!(first.save(), whole.save());
    }
}

#[test]
fn a_restored_run_is_the_uninterrupted_one_bit_by_bit() {
    for stages in [1, 3, 5, 7] {
        for tol in [1e-3, 1e-6] {
            let options = RadauOptions {
                stages,
                // Old Jacobians and factors are used in most steps.
                jacobian_reuse: 0.1,
                step_window: (1.0, 2.0),
                ..tolerance(if stages == 1 { 1e-3 } else { tol })
            };
            assert_goes_on(&LinearIndex1, 10.0, &options);
            assert_goes_on(&Heat2d::new(8), 0.3, &options);
            assert_goes_on(&Differentiated::new(CapacitorLoop), 2e-6, &options);
            if stages > 1 {
                assert_goes_on(&JayIndex2, 1.0, &options);
                assert_goes_on(&CarAxis::new(MechanicalForm::Stabilized), 1.0, &options);
                assert_goes_on(&Pendulum::new(MechanicalForm::Index3), 1.0, &options);
            }
        }
    }
}

#[test]
fn a_restored_run_takes_the_same_differences() {
    let sample = WithoutJacobian(CarAxis::new(MechanicalForm::Index2));
    let options = RadauOptions { jacobian_reuse: 0.1, ..tolerance(1e-4) };
    assert_goes_on(&sample, 0.5, &options);
}

#[test]
fn a_run_saved_in_a_pause_finds_the_same_roots() {
    let begin = || {
        let sample = Pendulum::new(MechanicalForm::Index2);
        let start = sample.start();
        myovib_radau::RadauSolver::builder(sample)
            .options(tolerance(1e-6))
            .roots([Direction::Both], |_, _, y, _, g| {
                g[0] = y[0] - 0.5;
                Ok(())
            })
            .build(start.t, &start.y, &start.y_dot)
            .unwrap()
    };
    let mut first = begin();
    let found = first.integrate_to(4.0).unwrap();
    assert!(matches!(found, Outcome::Root { .. }), "{found:?}");
    let mut second = begin();
    second.restore(&first.save()).unwrap();
    assert_eq!((second.t(), second.y()), (first.t(), first.y()));
    let mut pauses = 0;
    while first.t() < 4.0 {
        let next = first.integrate_to(4.0).unwrap();
        pauses += u32::from(matches!(next, Outcome::Root { .. }));
        assert_eq!(second.integrate_to(4.0).unwrap(), next);
        assert_eq!(second.save(), first.save());
    }
    assert!(pauses > 0);
}

#[test]
fn the_state_of_another_problem_or_method_is_refused() {
    let state = solver(JayIndex2, tolerance(1e-4)).save();
    let of_problem = solver(LinearIndex1, tolerance(1e-4)).restore(&state);
    let five = RadauOptions { stages: 5, ..tolerance(1e-4) };
    let of_method = solver(JayIndex2, five).restore(&state);
    for (refused, printed) in [(of_problem, "unknowns"), (of_method, "stages")] {
        let error = refused.unwrap_err();
        assert!(matches!(error, RadauError::Common(WrongLength { .. })), "{error}");
        assert!(error.to_string().contains(printed), "{error}");
    }
}
