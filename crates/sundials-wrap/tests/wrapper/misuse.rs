//! Invalid arguments, and calls in the wrong order.

use myovib_conformance::samples::{Robertson, Sample};
use myovib_dae::IntegratorError::{
    AfterTheStart, NoDenseOutput, NoQuadrature, TimeBehind, WrongLength,
};
use myovib_dae::{Outcome, Problem, StepError, Suppressed, Tolerances, VariableKind};
use myovib_sparse::SparseOptions;
use nalgebra_sparse::pattern::SparsityPattern;

use sundials_wrap::{ConsistencyMode, Constraint, Error, IdaOptions, IdaSolver};

use crate::decay::Decay;

/// Returns the error for a solver of Robertson's problem with the given options.
fn refusal(options: IdaOptions) -> String {
    let start = Robertson.start();
    let builder = IdaSolver::builder(Robertson).options(options);
    let built = builder.build(start.t, &start.y, &start.y_dot);
    built.unwrap_err().to_string()
}

#[test]
fn initial_values_of_a_wrong_length_or_not_finite_are_refused() {
    let build = |y: &[f64], y_dot: &[f64]| {
        let built = IdaSolver::builder(Robertson).build(0.0, y, y_dot);
        built.unwrap_err().to_string()
    };
    assert_eq!(build(&[1.0], &[0.0; 3]), "initial values y0: expected length 3, got 1");
    assert_eq!(build(&[1.0; 3], &[]), "initial derivatives y_dot0: expected length 3, got 0");
    assert_eq!(build(&[1.0, f64::NAN, 0.0], &[0.0; 3]), "y0[1] = NaN is not finite");
}

#[test]
fn invalid_tolerances_are_rejected() {
    for (tolerances, expected) in [
        (Tolerances::scalar(-1e-3, 1.0), "relative tolerance = -0.001: must be finite and ≥ 0"),
        (Tolerances::scalar(f64::NAN, 1.0), "relative tolerance = NaN: must be finite and ≥ 0"),
        (
            Tolerances::scalar(0.0, 0.0),
            "absolute tolerance = 0: must be > 0 if the relative tolerance is 0",
        ),
        (Tolerances::vector(1e-3, [1e-3, 1e-3]), "absolute tolerances: expected length 3, got 2"),
        (
            Tolerances::vector(0.0, [1.0, 0.0, 1.0]),
            "absolute tolerance = 0: must be > 0 if the relative tolerance is 0",
        ),
    ] {
        let options = IdaOptions { tolerances, ..IdaOptions::default() };
        assert_eq!(refusal(options), expected);
    }
}

#[test]
fn settings_out_of_range_are_refused_by_name_and_value() {
    type Change = fn(&mut IdaOptions);
    let refused: [(Change, &str); 17] = [
        (|o| o.max_order = 6, "max_order = 6"),
        (|o| o.max_order = 0, "max_order = 0"),
        (|o| o.max_step = Some(0.0), "max_step = 0"),
        (
            |o| {
                o.min_step = 1.0;
                o.max_step = Some(0.5);
            },
            "at least min_step",
        ),
        (|o| o.min_step = -1e-9, "min_step = -0.000000001"),
        (|o| o.initial_step = Some(f64::NAN), "initial_step = NaN"),
        (|o| o.stop_time = Some(f64::INFINITY), "stop_time = inf"),
        (|o| o.max_steps = Some(0), "max_steps = 0"),
        (|o| o.max_error_test_failures = 0, "max_error_test_failures = 0"),
        (|o| o.max_convergence_failures = 1 << 31, "max_convergence_failures = 2147483648"),
        (|o| o.nonlinear_coefficient = 0.0, "nonlinear_coefficient = 0"),
        (|o| o.sparse.pivot_tolerance = 1.5, "sparse.pivot_tolerance = 1.5"),
        (|o| o.delta_cj = 0.0, "delta_cj = 0:"),
        (|o| o.delta_cj = 1.0, "delta_cj = 1:"),
        (|o| o.max_newton_iterations = 0, "max_newton_iterations = 0"),
        (|o| o.constraints = vec![Constraint::None], "constraints"),
        (|o| o.suppressed = Suppressed::Components(vec![true]), "suppressed components"),
    ];
    for (change, word) in refused {
        let mut options = IdaOptions::default();
        change(&mut options);
        let error = refusal(options);
        assert!(error.contains(word), "{error}");
    }
}

#[test]
fn the_ends_of_the_ranges_are_in_them() {
    let at_the_ends = IdaOptions {
        max_order: 1,
        min_step: 0.5,
        max_step: Some(0.5),
        max_steps: Some(1),
        max_error_test_failures: 1,
        max_convergence_failures: i32::MAX as usize,
        max_newton_iterations: 1,
        tolerances: Tolerances::scalar(0.0, 1e-6),
        constraints: vec![Constraint::None; 3],
        sparse: SparseOptions { pivot_tolerance: 1.0, ..SparseOptions::default() },
        ..IdaOptions::default()
    };
    let start = Robertson.start();
    let builder = IdaSolver::builder(Robertson).options(at_the_ends);
    builder.build(0.0, &start.y, &start.y_dot).unwrap();
}

/// IDAS detects the violation in the first step, not at the start.
#[test]
fn initial_values_outside_of_the_constraints_are_refused() {
    let violated =
        IdaOptions { constraints: vec![Constraint::Negative; 3], ..IdaOptions::default() };
    let start = Robertson.start();
    let builder = IdaSolver::builder(Robertson).options(violated);
    let mut solver = builder.build(0.0, &start.y, &start.y_dot).unwrap();
    let error = solver.integrate_to(1.0).unwrap_err();
    assert!(matches!(error, Error::Call { call: "IDASolve", code: -22, .. }), "{error}");
}

/// A problem whose numbers of unknowns, kinds, rows and columns may contradict each other.
struct Crooked {
    n: usize,
    kinds: usize,
    pattern: SparsityPattern,
}

impl Problem for Crooked {
    fn n_unknowns(&self) -> usize {
        self.n
    }
    fn residual(&mut self, _: f64, _: &[f64], _: &[f64], _: &mut [f64]) -> Result<(), StepError> {
        unreachable!("it is refused")
    }
    fn jacobian_pattern(&self) -> SparsityPattern {
        self.pattern.clone()
    }
    fn jacobian(
        &mut self,
        _: f64,
        _: &[f64],
        _: &[f64],
        _: f64,
        _: f64,
        _: &mut [f64],
    ) -> Result<(), StepError> {
        unreachable!("it is refused")
    }
    fn kinds(&self) -> Option<Vec<VariableKind>> {
        Some(vec![VariableKind::Differential; self.kinds])
    }
    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![0; self.n])
    }
}

#[test]
fn a_problem_that_contradicts_itself_is_refused() {
    let full = |rows, columns| {
        let offsets = (0..=columns).map(|c| c * rows).collect();
        let indices = (0..columns).flat_map(|_| 0..rows).collect();
        SparsityPattern::try_from_offsets_and_indices(columns, rows, offsets, indices).unwrap()
    };
    for (n, kinds, pattern, expected) in [
        (2, 3, full(2, 2), "kinds: expected length 2, got 3"),
        (2, 2, full(3, 2), "rows of the Jacobian: expected length 2, got 3"),
        (2, 2, full(2, 1), "columns of the Jacobian: expected length 2, got 1"),
        (
            2,
            2,
            SparsityPattern::zeros(2, 2),
            "nothing to integrate: 2 unknowns, 0 entries in the Jacobian",
        ),
        (
            0,
            0,
            SparsityPattern::zeros(0, 0),
            "nothing to integrate: 0 unknowns, 0 entries in the Jacobian",
        ),
    ] {
        let problem = Crooked { n, kinds, pattern };
        let start = vec![0.0; n];
        let error = IdaSolver::builder(problem).build(0.0, &start, &start).unwrap_err();
        assert_eq!(error.to_string(), expected);
    }
}

#[test]
fn non_finite_quadratures_and_times_are_rejected() {
    let build = |t0: f64, start: &[f64], tolerances| {
        IdaSolver::builder(Decay::new())
            .quadrature(start, tolerances, |_, _, y, _, rate| {
                rate.copy_from_slice(y);
                Ok(())
            })
            .build(t0, &[1.0], &[-1.0])
    };
    for (t0, start, tolerances, expected) in [
        (f64::INFINITY, 0.0, None, "t0 = inf: must be finite"),
        (0.0, f64::NAN, None, "initial values of the quadratures[0] = NaN is not finite"),
        (
            0.0,
            0.0,
            Some((-1.0, 1.0)),
            "relative tolerance of the quadratures = -1: must be finite and ≥ 0",
        ),
        (
            0.0,
            0.0,
            Some((1.0, f64::NAN)),
            "absolute tolerance of the quadratures = NaN: must be finite and ≥ 0",
        ),
        (
            0.0,
            0.0,
            Some((0.0, 0.0)),
            "relative and absolute tolerance of the quadratures = 0: must be not both zero",
        ),
    ] {
        let error = build(t0, &[start], tolerances).unwrap_err();
        assert_eq!(error.to_string(), expected);
    }
    let mut solver = build(0.0, &[0.0], None).unwrap();
    for (y, q, expected) in [
        (vec![1.0], vec![], "initial values of the quadratures: expected length 1, got 0"),
        (vec![], vec![0.0], "initial values y0: expected length 1, got 0"),
        (vec![f64::NAN], vec![0.0], "y0[0] = NaN is not finite"),
    ] {
        let error = solver.reinit(0.0, &y, &[-1.0], &q).unwrap_err();
        assert_eq!(error.to_string(), expected);
    }
    solver.integrate_to(1.0).unwrap();
    let mut q = [0.0];
    assert!(solver.quadrature(&mut []).is_err());
    assert!(solver.quadrature_dense_output(f64::NAN, 0, &mut q).is_err());
    let error = solver.quadrature_dense_output(1.0, 9, &mut q).unwrap_err();
    assert!(matches!(error, Error::Common(NoDenseOutput { derivative: 9, .. })), "{error}");
    // Within the last step, the integral and its derivative y are available.
    let t = 1.0;
    solver.quadrature_dense_output(t, 0, &mut q).unwrap();
    // The tolerance for y is 1e-4 per step, for about thirty steps.
    assert!((q[0] - (1.0 - (-t).exp())).abs() < 3e-3, "{q:?}");
    solver.quadrature_dense_output(t, 1, &mut q).unwrap();
    assert!((q[0] - (-t).exp()).abs() < 1e-2, "{q:?}");
}

#[test]
fn an_output_time_behind_t_is_misuse() {
    let mut solver = Decay::new().solver();
    solver.integrate_to(0.5).unwrap();
    let error = solver.integrate_to(0.4).unwrap_err();
    assert!(matches!(error, Error::Common(TimeBehind { t_out: 0.4, t: 0.5 })), "{error}");
    assert!(solver.step(f64::NAN).is_err());
    assert_eq!(solver.integrate_to(0.6).unwrap(), Outcome::Reached { t: 0.6 });
    let mut out = [0.0];
    let error = solver.dense_output(-1.0, 0, &mut out).unwrap_err();
    assert!(matches!(error, Error::Common(NoDenseOutput { derivative: 0, .. })), "{error}");
    let error = solver.dense_output(0.6, 9, &mut out).unwrap_err();
    assert!(matches!(error, Error::Common(NoDenseOutput { derivative: 9, .. })), "{error}");
    assert!(matches!(solver.quadrature(&mut out), Err(Error::Common(NoQuadrature))));
    assert!(matches!(solver.dense_output(0.6, 0, &mut []), Err(Error::Common(WrongLength { .. }))));
}

/// Before the first step, IDAS has allocated its vectors but not written to them. In a new process, they may happen to
/// contain zeros, so only valgrind can reliably detect reads of uninitialized memory.
#[test]
fn before_the_first_step_weights_and_errors_are_zeros() {
    let mut solver = Decay::new().solver();
    let mut out = [f64::NAN];
    solver.error_weights(&mut out).unwrap();
    assert_eq!(out, [0.0]);
    out = [f64::NAN];
    solver.estimated_local_errors(&mut out).unwrap();
    assert_eq!(out, [0.0]);
}

#[test]
fn integrates_backwards_too() {
    let mut solver = IdaSolver::builder(Decay::new()).build(1.0, &[1.0], &[-1.0]).unwrap();
    assert_eq!(solver.integrate_to(0.0).unwrap(), Outcome::Reached { t: 0.0 });
    // The default tolerance is 1e-4 per step, for about thirty steps. Errors grow by a factor of e during these steps.
    assert!((solver.y()[0] - 1.0_f64.exp()).abs() < 1e-2, "{}", solver.y()[0]);
    assert!(matches!(solver.integrate_to(0.5), Err(Error::Common(TimeBehind { .. }))));
}

/// Regression test, found by random sequences of calls: a correction after the first step changed the stored
/// differences of past steps, and the next step returned NaN.
#[test]
fn initial_values_are_corrected_before_the_first_step_only() {
    let mut solver = Decay::new().solver();
    let mode = ConsistencyMode::AlgebraicAndDerivatives;
    solver.correct_initial_values(mode, 1.0).unwrap();
    solver.integrate_to(0.5).unwrap();
    let error = solver.correct_initial_values(mode, 1.0).unwrap_err();
    assert!(matches!(error, Error::Common(AfterTheStart { t: 0.5 })), "{error}");
    solver.reinit(0.5, &[1.0], &[-1.0], &[]).unwrap();
    solver.correct_initial_values(mode, 1.0).unwrap();
    assert_eq!(solver.integrate_to(1.0).unwrap(), Outcome::Reached { t: 1.0 });
}
