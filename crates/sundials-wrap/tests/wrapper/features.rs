//! What the integrator offers beyond stepping: events, dense output, weights, initial values,
//! constraints, structured solvers.

use myovib_dae::samples::{Akzo, Heat2d, LinearIndex1, Robertson, Sample};
use myovib_dae::{
    Complex64, Direction, Jacobian, LinearSolver, Linearization, Outcome, Problem, StepError,
    Suppressed, Tolerances, VariableKind,
};
use myovib_sparse::klu::{KluOptions, Scaling};
use nalgebra_sparse::pattern::SparsityPattern;

use crate::common::HAS_KLU;
use sundials_wrap::{
    ConsistencyMode, IdaOptions, IdaSolver, InitialValueOptions, VectorArithmetic, Versions,
};

fn build<S: Sample>(sample: S, options: IdaOptions) -> IdaSolver<S> {
    let start = sample.start();
    IdaSolver::builder(sample)
        .options(options)
        .build(start.t, &start.y, &start.y_dot)
        .unwrap()
}

fn tolerance(tolerance: f64) -> IdaOptions {
    let tolerances = Tolerances::scalar(tolerance, tolerance);
    IdaOptions {
        tolerances,
        max_steps: None,
        ..IdaOptions::default()
    }
}

/// With three unknowns even the sums of norms are taken in SUNDIALS' order.
#[test]
fn our_arithmetic_of_vectors_is_that_of_sundials() {
    let run = |vectors| {
        let mut solver = build(
            Robertson,
            IdaOptions {
                vectors,
                ..tolerance(1e-7)
            },
        );
        assert_eq!(
            solver.integrate_to(40.0).unwrap(),
            Outcome::Reached { t: 40.0 }
        );
        (solver.y().to_vec(), solver.statistics().steps)
    };
    assert_eq!(run(VectorArithmetic::Simd), run(VectorArithmetic::Serial));
}

/// y2 = sin t crosses zero at multiples of π, rising at even ones.
#[test]
fn roots_are_found_in_the_direction_asked_for() {
    let start = LinearIndex1.start();
    let mut solver = IdaSolver::builder(LinearIndex1)
        .options(tolerance(1e-9))
        .roots([Direction::Falling, Direction::Rising], |_, _, y, _, g| {
            g.fill(y[1]);
            Ok(())
        })
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    for k in 1..4 {
        let Outcome::Root { t, crossings } = solver.integrate_to(10.0).unwrap() else {
            panic!("no root near {k} π")
        };
        // y2 is solved to the tolerance, and its slope there is 1.
        assert!(
            (t - f64::from(k) * std::f64::consts::PI).abs() < 1e-8,
            "{t}"
        );
        assert_eq!(crossings, if k % 2 == 1 { [-1, 0] } else { [0, 1] });
        assert_eq!(solver.t(), t);
    }
    assert_eq!(
        solver.integrate_to(10.0).unwrap(),
        Outcome::Reached { t: 10.0 }
    );
}

/// One-step mode with a stop time: the steps end there, and dense output between them agrees with
/// the exact solution and its derivatives, without changing the steps.
#[test]
fn dense_output_gives_the_solution_and_its_derivatives() {
    let tol = 1e-10;
    let options = IdaOptions {
        stop_time: Some(10.0),
        ..tolerance(tol)
    };
    let mut plain = build(LinearIndex1, options.clone());
    while !matches!(plain.step(10.0).unwrap(), Outcome::StopTime { .. }) {}

    let mut solver = build(LinearIndex1, options);
    let mut out = [0.0; 2];
    loop {
        let outcome = solver.step(10.0).unwrap();
        let stats = solver.statistics();
        if stats.last_order >= 4 {
            let t = solver.t() - 0.5 * stats.last_step;
            let exact = |k: i32| [t.sin(), t.cos(), -t.sin()][k as usize];
            // Each derivative of the interpolant loses a power of h.
            for k in 0..3 {
                solver.dense_output(t, k as usize, &mut out).unwrap();
                let bound = 1e3 * tol / stats.last_step.powi(k);
                assert!(
                    (out[1] - exact(k)).abs() < bound,
                    "t = {t}, k = {k}: {out:?}"
                );
            }
        }
        if outcome == (Outcome::StopTime { t: 10.0 }) {
            break;
        }
        assert_eq!(outcome, Outcome::StepTaken { t: solver.t() });
    }
    assert_eq!(solver.statistics(), plain.statistics());
    assert_eq!(solver.y(), plain.y());
}

#[test]
fn a_weight_function_that_repeats_the_tolerances_changes_nothing() {
    let tol = 1e-6;
    let mut plain = build(Akzo, tolerance(tol));
    plain.integrate_to(180.0).unwrap();
    let start = Akzo.start();
    let mut weighted = IdaSolver::builder(Akzo)
        .options(tolerance(1.0))
        .error_weights(move |_, y, weights| {
            for (w, y) in weights.iter_mut().zip(y) {
                *w = 1.0 / (tol * y.abs() + tol);
            }
            Ok(())
        })
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    weighted.integrate_to(180.0).unwrap();
    assert_eq!(weighted.statistics(), plain.statistics());
    assert_eq!(weighted.y(), plain.y());

    let (mut weights, mut errors) = ([0.0; 6], [0.0; 6]);
    weighted.error_weights(&mut weights).unwrap();
    weighted.estimated_local_errors(&mut errors).unwrap();
    let squares = errors
        .iter()
        .zip(&weights)
        .map(|(e, w)| (e * w).powi(2))
        .sum::<f64>();
    let norm = (squares / 6.0).sqrt();
    assert!(
        norm > 0.0 && norm <= 1.0,
        "an accepted step passed its error test: {norm}"
    );
}

/// SUNDIALS' example repairs a boundary value of 0.1: the corrected one must be 0, and the
/// derivatives inside must follow it.
#[test]
fn wrong_algebraic_values_are_repaired() {
    let sample = Heat2d::new(10);
    let start = sample.start();
    let mut wrong = start.y.clone();
    for (value, kind) in wrong.iter_mut().zip(sample.kinds().unwrap()) {
        if kind == VariableKind::Algebraic {
            *value = 0.1;
        }
    }
    // The error test leaves out other components than those that are algebraic.
    let mut left_out = vec![false; 100];
    left_out[55] = true;
    let options = IdaOptions {
        suppressed: Suppressed::Components(left_out),
        ..tolerance(1e-8)
    };
    let mut solver = IdaSolver::builder(sample)
        .options(options)
        .build(0.0, &wrong, &[0.0; 100])
        .unwrap();
    let mode = ConsistencyMode::AlgebraicAndDerivatives;
    solver.correct_initial_values(mode, 0.01).unwrap();
    for (ours, exact) in solver.y().iter().zip(&start.y) {
        assert!((ours - exact).abs() < 1e-8, "{ours} ≠ {exact}");
    }
    for ((ours, exact), kind) in solver
        .y_dot()
        .iter()
        .zip(&start.y_dot)
        .zip(sample.kinds().unwrap())
    {
        // Newton's tolerance on y, times 4/Δx² = 324.
        let wanted = kind == VariableKind::Differential;
        assert!(
            !wanted || (ours - exact).abs() < 324.0 * 1e-8,
            "{ours} ≠ {exact}"
        );
    }
    assert_eq!(
        solver.integrate_to(0.01).unwrap(),
        Outcome::Reached { t: 0.01 }
    );
}

#[test]
fn consistent_values_of_robertson_are_found() {
    let start = Robertson.start();
    let builder = IdaSolver::builder(Robertson).options(tolerance(1e-8));
    let mut solver = builder.build(0.0, &[1.0, 0.0, 0.3], &[0.0; 3]).unwrap();
    let mode = ConsistencyMode::AlgebraicAndDerivatives;
    solver.correct_initial_values(mode, 0.4).unwrap();
    for (ours, exact) in solver.y().iter().zip(&start.y) {
        assert!((ours - exact).abs() < 1e-8, "{ours} ≠ {exact}");
    }
    for (ours, exact) in solver.y_dot()[..2].iter().zip(&start.y_dot) {
        assert!((ours - exact).abs() < 1e-8, "{ours} ≠ {exact}");
    }
}

/// A temperature from its rate of change: the discrete Poisson equation.
#[test]
fn states_are_found_from_derivatives() {
    let start = Heat2d::new(10).start();
    let builder = IdaSolver::builder(Heat2d::new(10)).options(tolerance(1e-10));
    let mut solver = builder.build(0.0, &[0.0; 100], &start.y_dot).unwrap();
    solver
        .correct_initial_values(ConsistencyMode::States, 0.01)
        .unwrap();
    for (ours, exact) in solver.y().iter().zip(&start.y) {
        assert!((ours - exact).abs() < 1e-10, "{ours} ≠ {exact}");
    }
    assert_eq!(solver.y_dot(), start.y_dot);
}

#[test]
fn settings_reach_idas() {
    let run = |options: IdaOptions| {
        let mut solver = build(Akzo, options);
        let mut highest = 0;
        while solver.t() < 180.0 {
            solver.step(180.0).unwrap();
            highest = highest.max(solver.statistics().last_order);
        }
        (highest, solver.statistics())
    };
    let (order, plain) = run(tolerance(1e-6));
    assert!(order > 2);
    let (order, low) = run(IdaOptions {
        max_order: 2,
        ..tolerance(1e-6)
    });
    assert!(order == 2 && low.steps > plain.steps);
    let (_, small) = run(IdaOptions {
        max_step: Some(0.5),
        ..tolerance(1e-6)
    });
    assert!(small.steps >= 360 && small.last_step <= 0.5);
    let (_, first) = run(IdaOptions {
        initial_step: Some(1e-7),
        ..tolerance(1e-6)
    });
    assert_eq!(first.initial_step, 1e-7);
    let (_, eager) = run(IdaOptions {
        delta_cj: 0.01,
        ..tolerance(1e-6)
    });
    assert!(eager.linear_setups > plain.linear_setups);
    let (_, unscaled) = run(IdaOptions {
        linear_solution_scaling: false,
        ..tolerance(1e-6)
    });
    assert!(unscaled.newton_iterations != plain.newton_iterations);
    let (_, strict) = run(IdaOptions {
        nonlinear_coefficient: 1e-3,
        ..tolerance(1e-6)
    });
    assert!(strict.newton_iterations > plain.newton_iterations);
    let klu = KluOptions {
        scaling: Scaling::None,
        ..KluOptions::default()
    };
    let (_, unscaled_rows) = run(IdaOptions {
        klu,
        ..tolerance(1e-6)
    });
    assert!((unscaled_rows.steps as f64 / plain.steps as f64 - 1.0).abs() < 0.05);
    assert_eq!(
        unscaled_rows.smallest_rcond != plain.smallest_rcond,
        HAS_KLU,
        "unscaled pivots, another estimate"
    );
    let suppressed = Suppressed::Components(vec![true, false, false, false, false, true]);
    let (_, fewer) = run(IdaOptions {
        suppressed,
        ..tolerance(1e-6)
    });
    assert_ne!(fewer.steps, plain.steps);
}

/// LU with partial pivoting of the full matrix, as a linear solver.
#[derive(Default)]
struct DenseLu {
    parts: [Vec<f64>; 2],
    n: usize,
    lu: Vec<f64>,
    pivots: Vec<usize>,
}

impl<P: Problem> LinearSolver<P> for DenseLu {
    fn evaluate(&mut self, problem: &mut P, at: &Linearization<'_>) -> Result<(), StepError> {
        let mut jacobian = Jacobian::of(problem);
        let nnz = jacobian.pattern().nnz();
        self.parts = [vec![0.0; nnz], vec![0.0; nnz]];
        let [of_value, of_rate] = &mut self.parts;
        jacobian.parts(problem, at, [of_value, of_rate])
    }

    fn set_up(&mut self, problem: &mut P, c_j: f64, _: &[Complex64]) -> Result<(), StepError> {
        let pattern: SparsityPattern = problem.jacobian_pattern();
        let parts = self.parts[0].iter().zip(&self.parts[1]);
        let values: Vec<f64> = parts.map(|(j, m)| j + c_j * m).collect();
        let n = problem.n_unknowns();
        self.n = n;
        self.lu = vec![0.0; n * n];
        for ((column, row), value) in pattern.entries().zip(values) {
            self.lu[row * n + column] = value;
        }
        self.pivots.clear();
        for k in 0..n {
            let size = |i: &usize| self.lu[i * n + k].abs();
            let pivot = (k..n).max_by(|i, j| size(i).total_cmp(&size(j))).unwrap();
            if size(&pivot) == 0.0 {
                return Err(StepError::Recoverable(format!("no pivot in column {k}")));
            }
            self.pivots.push(pivot);
            for j in 0..n {
                self.lu.swap(k * n + j, pivot * n + j);
            }
            for i in k + 1..n {
                let factor = self.lu[i * n + k] / self.lu[k * n + k];
                self.lu[i * n + k] = factor;
                for j in k + 1..n {
                    self.lu[i * n + j] -= factor * self.lu[k * n + j];
                }
            }
        }
        Ok(())
    }

    fn solve_real(&mut self, _problem: &mut P, rhs: &mut [f64]) -> Result<(), StepError> {
        let n = self.n;
        for (k, &pivot) in self.pivots.iter().enumerate() {
            rhs.swap(k, pivot);
        }
        for i in 0..n {
            rhs[i] -= (0..i).map(|j| self.lu[i * n + j] * rhs[j]).sum::<f64>();
        }
        for i in (0..n).rev() {
            let known = (i + 1..n).map(|j| self.lu[i * n + j] * rhs[j]).sum::<f64>();
            rhs[i] = (rhs[i] - known) / self.lu[i * n + i];
        }
        Ok(())
    }

    fn solve_complex(&mut self, _: &mut P, _: usize, _: &mut [Complex64]) -> Result<(), StepError> {
        unreachable!("BDF has real shifts only")
    }
}

/// Same matrices, same Newton iterations, same scaling for an old c_j: same counters as with KLU.
#[test]
fn a_linear_solver_of_ones_own_counts_as_klu_does() {
    let start = Robertson.start();
    let options = IdaOptions {
        tolerances: Tolerances::vector(1e-4, [1e-8, 1e-6, 1e-6]),
        max_steps: None,
        ..IdaOptions::default()
    };
    let mut klu = build(Robertson, options.clone());
    let mut dense = IdaSolver::builder(Robertson)
        .options(options)
        .linear_solver(DenseLu::default())
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    // Until rounding tells them apart.
    for t in [0.4, 40.0, 400.0] {
        klu.integrate_to(t).unwrap();
        dense.integrate_to(t).unwrap();
        let (ours, reference) = (dense.statistics(), klu.statistics());
        assert_eq!(ours.steps, reference.steps, "t = {t}");
        assert_eq!(
            ours.newton_iterations, reference.newton_iterations,
            "t = {t}"
        );
        assert_eq!(ours.linear_setups, reference.linear_setups, "t = {t}");
        assert_eq!(
            ours.error_test_failures, reference.error_test_failures,
            "t = {t}"
        );
        assert!((dense.y()[0] / klu.y()[0] - 1.0).abs() < 1e-9, "t = {t}");
    }
    assert_eq!(dense.statistics().smallest_rcond, None);
    assert_eq!(klu.statistics().smallest_rcond.is_some(), HAS_KLU);
}

/// A linear solver that cannot set up or solve is asked again, the matrix being fresh or the
/// step smaller.
#[test]
fn a_linear_solver_of_ones_own_may_fail_recoverably() {
    struct Moody {
        lu: DenseLu,
        /// Calls until a set-up, and until a solve, fails.
        setups: u32,
        solves: u32,
    }
    fn countdown(calls: &mut u32) -> Result<(), StepError> {
        *calls = calls.wrapping_sub(1);
        match *calls {
            0 => Err(StepError::Recoverable("moody".into())),
            _ => Ok(()),
        }
    }
    impl LinearSolver<Robertson> for Moody {
        fn evaluate(
            &mut self,
            problem: &mut Robertson,
            at: &Linearization<'_>,
        ) -> Result<(), StepError> {
            self.lu.evaluate(problem, at)
        }
        fn set_up(
            &mut self,
            problem: &mut Robertson,
            c_j: f64,
            complex: &[Complex64],
        ) -> Result<(), StepError> {
            countdown(&mut self.setups)?;
            self.lu.set_up(problem, c_j, complex)
        }
        fn solve_real(
            &mut self,
            problem: &mut Robertson,
            rhs: &mut [f64],
        ) -> Result<(), StepError> {
            countdown(&mut self.solves)?;
            self.lu.solve_real(problem, rhs)
        }
        fn solve_complex(
            &mut self,
            _: &mut Robertson,
            _: usize,
            _: &mut [Complex64],
        ) -> Result<(), StepError> {
            unreachable!("BDF has real shifts only")
        }
    }
    let run = |setups, solves| {
        let start = Robertson.start();
        let lu = DenseLu::default();
        let mut solver = IdaSolver::builder(Robertson)
            .linear_solver(Moody { lu, setups, solves })
            .build(start.t, &start.y, &start.y_dot)
            .unwrap();
        let outcome = solver.integrate_to(4.0).unwrap();
        assert_eq!(outcome, Outcome::Reached { t: 4.0 });
        solver.statistics()
    };
    let never = u32::MAX;
    let well = run(never, never);
    assert_eq!((well.newton_failures, well.step_solve_failures), (0, 0));
    assert_eq!(run(5, never).step_solve_failures, 1);
    assert_eq!(run(never, 5).newton_failures, 1);
}

#[test]
fn the_linked_libraries_are_those_of_the_headers() {
    let versions = Versions::linked();
    assert_eq!(versions.sundials, versions.sundials_headers);
    assert_eq!(versions.index_bits, 64);
    let major = if cfg!(feature = "vendored") {
        "7."
    } else {
        "6."
    };
    assert!(versions.sundials.starts_with(major), "{versions:?}");
    assert_eq!(versions.sparse.is_some(), HAS_KLU);
    if let Some(sparse) = &versions.sparse {
        let is_known = |major| sparse.klu.starts_with(major);
        assert!(is_known("1.") || is_known("2."), "{versions:?}");
    }
}

/// regression: a derivative of the order to come, one above that of the last step, aborted the
/// process, and times far outside of the last step were extrapolated to.
#[test]
fn quadratures_have_the_derivatives_of_the_last_step_only() {
    let start = Akzo.start();
    let mut solver = IdaSolver::builder(Akzo)
        .options(tolerance(1e-8))
        .quadrature([0.0], None, |_, _, y, _, rate| {
            rate[0] = y[0];
            Ok(())
        })
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    let mut out = [f64::NAN];
    solver.quadrature_dense_output(0.0, 0, &mut out).unwrap();
    assert_eq!(out, [0.0]);
    let mut orders_to_come = 0;
    while solver.t() < 10.0 {
        solver.step(180.0).unwrap();
        let statistics = solver.statistics();
        let [from, to] = solver.last_step_interval();
        for derivative in 0..=statistics.last_order.min(statistics.current_order) {
            solver
                .quadrature_dense_output(to, derivative, &mut out)
                .unwrap();
        }
        orders_to_come += u32::from(statistics.current_order > statistics.last_order);
        for (t, derivative) in [
            (to, statistics.last_order + 1),
            (from - 0.1 * (to - from), 0),
            (to + 0.1 * (to - from), 0),
            (to + 100.0, 1),
        ] {
            let error = solver.quadrature_dense_output(t, derivative, &mut out);
            assert!(
                matches!(error, Err(sundials_wrap::Error::NoDenseOutput { .. })),
                "{t}"
            );
        }
    }
    assert!(orders_to_come > 0, "the case that aborted");
}

/// regression: where the tolerance is relative only, a solution that becomes zero was a refused
/// call without statistics.
#[test]
fn a_tolerance_that_becomes_zero_is_an_outcome_with_statistics() {
    struct Ramp;
    impl Problem for Ramp {
        fn n_unknowns(&self) -> usize {
            1
        }
        fn residual(
            &mut self,
            _: f64,
            _: &[f64],
            y_dot: &[f64],
            residual: &mut [f64],
        ) -> Result<(), StepError> {
            // y = 1 − t, without rounding over steps of an eighth.
            residual[0] = y_dot[0] + 1.0;
            Ok(())
        }
    }
    let options = IdaOptions {
        tolerances: Tolerances::scalar(1e-4, 0.0),
        max_step: Some(0.125),
        initial_step: Some(0.125),
        ..IdaOptions::default()
    };
    let mut solver = IdaSolver::builder(Ramp)
        .options(options)
        .build(0.0, &[1.0], &[-1.0])
        .unwrap();
    let Outcome::Stopped(stop) = solver.integrate_to(4.0).unwrap() else {
        panic!("it must stop");
    };
    assert_eq!(
        stop.reason,
        myovib_dae::StopReason::ErrorWeightsFailed,
        "{stop}"
    );
    assert!(
        stop.message.contains("it needs an absolute tolerance"),
        "{stop}"
    );
    assert!(stop.statistics.steps >= 8, "{stop}");
}

/// regression: the smallest condition estimate of before a restart survived it.
#[test]
fn condition_estimates_begin_anew() {
    let start = Robertson.start();
    let mut solver = build(Robertson, tolerance(1e-4));
    solver.integrate_to(40.0).unwrap();
    assert_eq!(solver.statistics().smallest_rcond.is_some(), HAS_KLU);
    solver.reinit(start.t, &start.y, &start.y_dot, &[]).unwrap();
    assert_eq!(solver.statistics().smallest_rcond, None);
}

/// From far away Newton needs several iterations: with too few the search fails, with a loose
/// tolerance it ends early.
#[test]
fn controls_of_the_search_for_initial_values_reach_idas() {
    struct Root;
    impl Problem for Root {
        fn n_unknowns(&self) -> usize {
            2
        }
        fn residual(
            &mut self,
            _: f64,
            y: &[f64],
            y_dot: &[f64],
            residual: &mut [f64],
        ) -> Result<(), StepError> {
            residual[0] = y_dot[0] + y[0];
            residual[1] = y[1].atan() - 0.5 * y[0];
            Ok(())
        }
    }
    let search = |initial_values: InitialValueOptions| {
        let options = IdaOptions {
            initial_values,
            ..tolerance(1e-6)
        };
        let mut solver =
            IdaSolver::builder(Root)
                .options(options)
                .build(0.0, &[1.0, 1.5], &[-1.0, 0.0])?;
        let mode = ConsistencyMode::AlgebraicAndDerivatives;
        let found = solver.correct_initial_values(mode, 1.0);
        found.map(|()| solver.y()[1])
    };
    let all = InitialValueOptions::default();
    let found = search(all).unwrap();
    // Newton's tolerance is 0.0033 of 1e-6.
    assert!((found - 0.5f64.tan()).abs() < 1e-7, "{found}");
    let poor = InitialValueOptions {
        max_iterations: 1,
        max_jacobians: 1,
        max_scales: 1,
        ..all
    };
    assert!(search(poor).is_err());
    let loose = InitialValueOptions {
        nonlinear_coefficient: 1e3,
        ..all
    };
    assert!((search(loose).unwrap() - found).abs() > 1e-9);
    let none = InitialValueOptions {
        max_scales: 0,
        ..all
    };
    let message = search(none).unwrap_err().to_string();
    assert_eq!(
        message,
        "initial_values.max_scales = 0: must be a positive count"
    );
}
