//! A linear solver provided by the user.

use myovib_conformance::samples::{Robertson, Sample};
use myovib_dae::{
    Complex64, Jacobian, LinearSolver, Linearization, Outcome, Problem, StepError, Tolerances,
};
use nalgebra_sparse::pattern::SparsityPattern;
use sundials_wrap::{IdaOptions, IdaSolver};

use crate::common::{HAS_KLU, build};

/// A linear solver that uses LU with partial pivoting of the full matrix.
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
        let [df_dy, df_dyp] = &mut self.parts;
        jacobian.parts(problem, at, [df_dy, df_dyp])
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

/// Compares the counters with the counters of a run with KLU. Both solvers use the same matrices, and scale solutions
/// for an earlier c_j in the same way.
#[test]
fn a_custom_linear_solver_has_the_counters_of_klu() {
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
    // The results agree until the effects of rounding become visible.
    for t in [0.4, 40.0, 400.0] {
        klu.integrate_to(t).unwrap();
        dense.integrate_to(t).unwrap();
        let (ours, reference) = (dense.statistics(), klu.statistics());
        assert_eq!(ours.steps, reference.steps, "t = {t}");
        assert_eq!(ours.newton_iterations, reference.newton_iterations, "t = {t}");
        assert_eq!(ours.linear_setups, reference.linear_setups, "t = {t}");
        assert_eq!(ours.error_test_failures, reference.error_test_failures, "t = {t}");
        assert!((dense.y()[0] / klu.y()[0] - 1.0).abs() < 1e-9, "t = {t}");
    }
    assert_eq!(dense.statistics().smallest_rcond, None);
    assert_eq!(klu.statistics().smallest_rcond.is_some(), HAS_KLU);
}

/// If the setup or the solve of a user's linear solver fails, the solver is called again with a new matrix or a smaller
/// step.
#[test]
fn a_custom_linear_solver_may_fail_recoverably() {
    struct Moody {
        lu: DenseLu,
        /// Number of calls until a setup fails, and until a solve fails.
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
