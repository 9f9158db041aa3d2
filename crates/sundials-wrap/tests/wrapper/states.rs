//! Tests of the API as a state machine: calls in any order, sensible or not, result in a value or an error, and the
//! queries of the solver remain consistent.

use myovib_conformance::samples::{Robertson, Sample};
use myovib_dae::{Outcome, Tolerances};
use proptest::prelude::*;

use sundials_wrap::{ConsistencyMode, IdaSolver};

/// A call and its arguments, as fractions of sensible values.
#[derive(Debug, Clone)]
enum Call {
    Step(f64),
    IntegrateTo(f64),
    DenseOutput { back: f64, derivative: usize },
    DenseOutputInto(usize),
    Reinit(f64),
    ReinitWith(usize),
    Correct(f64),
    Weights(usize),
}

/// Generates times from far before to far after the current time, and non-finite times.
fn time() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -1.0..10.0,
        1 => Just(1e12),
        1 => Just(f64::MAX),
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => Just(f64::NEG_INFINITY),
        1 => Just(0.0),
    ]
}

fn call() -> impl Strategy<Value = Call> {
    prop_oneof![
        4 => time().prop_map(Call::Step),
        3 => time().prop_map(Call::IntegrateTo),
        3 => (time(), 0_usize..8).prop_map(|(back, derivative)| Call::DenseOutput { back, derivative }),
        1 => (0_usize..6).prop_map(Call::DenseOutputInto),
        2 => time().prop_map(Call::Reinit),
        1 => (0_usize..6).prop_map(Call::ReinitWith),
        1 => time().prop_map(Call::Correct),
        1 => (0_usize..6).prop_map(Call::Weights),
    ]
}

/// Checks the properties that hold after any sequence of calls.
fn check(solver: &IdaSolver<Robertson>) {
    assert!(solver.t().is_finite());
    assert_eq!((solver.y().len(), solver.y_dot().len()), (3, 3));
    let stats = solver.statistics();
    // Near f64::MAX, the step doubles until the time overflows, and the solution overflows with it.
    let values = solver.y().iter().chain(solver.y_dot());
    assert!(values.copied().all(f64::is_finite) || stats.t_reached.is_infinite());
    assert!(stats.last_order <= 5 && stats.newton_iterations >= stats.steps);
}

/// Returns the bits of time and solution. Unlike the values, the bits of equal NaNs are equal.
fn bits(solver: &IdaSolver<Robertson>) -> Vec<u64> {
    let numbers = std::iter::once(solver.t()).chain(solver.y().iter().copied());
    numbers.map(f64::to_bits).collect()
}

fn apply(solver: &mut IdaSolver<Robertson>, call: &Call) {
    let before = bits(solver);
    let start = Robertson.start();
    let refused = match *call {
        Call::Step(t) => solver.step(t).map(reached(solver.t())).is_err(),
        Call::IntegrateTo(t) => solver.integrate_to(t).map(reached(t)).is_err(),
        Call::DenseOutput { back, derivative } => {
            let mut out = [0.0; 3];
            let t = solver.t() - back * solver.statistics().last_step;
            let result = solver.dense_output(t, derivative, &mut out);
            let overflown = solver.statistics().t_reached.is_infinite();
            assert!(result.is_err() || overflown || out.iter().all(|v| v.is_finite()));
            true
        }
        Call::DenseOutputInto(length) => {
            let result = solver.dense_output(solver.t(), 0, &mut vec![0.0; length]);
            assert!(length == 3 || result.is_err());
            true
        }
        Call::Reinit(t) => solver.reinit(t, &start.y, &start.y_dot, &[]).is_err(),
        Call::ReinitWith(length) => {
            let result = solver.reinit(0.0, &vec![0.5; length], &start.y_dot, &[]);
            assert_eq!(result.is_ok(), length == 3);
            result.is_err()
        }
        Call::Correct(t) => {
            let started = solver.statistics().steps > 0;
            let mode = ConsistencyMode::AlgebraicAndDerivatives;
            let refused = solver.correct_initial_values(mode, t).is_err();
            assert!(refused || !started, "{call:?}");
            refused
        }
        Call::Weights(length) => {
            let result = solver.error_weights(&mut vec![0.0; length]);
            assert!(length == 3 || result.is_err());
            true
        }
    };
    let asks_only =
        matches!(call, Call::DenseOutput { .. } | Call::DenseOutputInto(_) | Call::Weights(_));
    if refused && asks_only {
        assert_eq!(before, bits(solver), "{call:?}");
    }
}

/// Checks that outcomes report a time at or before the requested time.
fn reached(t_out: f64) -> impl Fn(Outcome) {
    move |outcome| match outcome {
        Outcome::Reached { t } => assert_eq!(t, t_out),
        other => assert!(other.t().is_finite()),
    }
}

proptest! {
    // 64 sequences of at most 24 calls take a second; failures are stored next to this file.
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn any_order_of_calls_ends_in_a_value_or_an_error(calls in proptest::collection::vec(call(), 1..24)) {
        let start = Robertson.start();
        let mut solver = IdaSolver::builder(Robertson)
            .tolerances(Tolerances::vector(1e-4, [1e-8, 1e-10, 1e-8]))
            .build(start.t, &start.y, &start.y_dot)
            .unwrap();
        for call in &calls {
            apply(&mut solver, call);
            check(&solver);
        }
    }
}
