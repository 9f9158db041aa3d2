//! Compares runs with internal variables that the integrator eliminates and runs with these variables as unknowns.

use std::ops::{Div, Mul};

use myovib_dae::{Direction, LinearSolver, Linearization, Outcome, Problem, StepError};
use myovib_radau::{
    InternalVariableGroup, InternalVariableProblem, InternalVariables, RadauError, RadauSolver,
    Recording, RelaxationTerm,
};
use num_complex::Complex64;

use crate::common::tolerance;

/// Weights g and relaxation times τ.
const TERMS: [(f64, f64); 3] = [(0.5, 0.02), (0.3, 0.2), (0.8, 1.5)];

/// Returns the driving quantity of the internal variables, and its derivative.
fn driving(u: f64) -> [f64; 2] {
    [20.0 * (u + u.powi(3)), 20.0 * (1.0 + 3.0 * u * u)]
}

/// Oscillator u̇ = v, v̇ + s(u) + Σ (g s(u) − q) = 30 sin 4t with internal variables q. These variables are either
/// unknowns, stored after u and v, or eliminated, in which case the sum is the response.
struct Oscillator {
    response: Option<[f64; 1]>,
    u: f64,
}

impl Problem for Oscillator {
    fn n_unknowns(&self) -> usize {
        2 + if self.response.is_some() { 0 } else { TERMS.len() }
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        let [s, _] = driving(y[0]);
        let mut total = self.response.map_or(0.0, |[given]| given);
        for (k, (weight, time)) in TERMS.iter().enumerate().take(y.len() - 2) {
            total += weight * s - y[2 + k];
            r[2 + k] = time * v[2 + k] + y[2 + k] - weight * s;
        }
        r[0] = v[0] - y[1];
        r[1] = v[1] + s + total - 30.0 * (4.0 * t).sin();
        Ok(())
    }
}

impl InternalVariableProblem for Oscillator {
    fn driving_quantity(&mut self, _: f64, y: &[f64], out: &mut [f64]) -> Result<(), StepError> {
        out[0] = driving(y[0])[0];
        Ok(())
    }

    fn driving_change(&mut self, change: &[f64], out: &mut [f64]) {
        out[0] = driving(self.u)[1] * change[0];
    }

    fn response(&mut self) -> &mut [f64] {
        self.response.as_mut().map_or(&mut [], |own| own)
    }
}

/// Newton matrices for u and v after elimination of the states.
#[derive(Default)]
struct Eliminated {
    real: f64,
    complex: Vec<Complex64>,
}

/// Solves c u − v = a, (1 + Σ g cτ/(1 + cτ)) s' u + c v = b for u and v.
fn solve<T>(c: T, one: T, slope: f64, rhs: &mut [T])
where
    T: Copy
        + std::ops::Add<Output = T>
        + std::ops::Sub<Output = T>
        + Mul<Output = T>
        + Mul<f64, Output = T>
        + Div<Output = T>,
{
    let terms = TERMS.iter();
    let stiffness = terms
        .fold(one, |sum, &(weight, time)| sum + c * (weight * time) / (one + c * time))
        * slope;
    let u = (rhs[1] + c * rhs[0]) / (stiffness + c * c);
    (rhs[0], rhs[1]) = (u, c * u - rhs[0]);
}

impl LinearSolver<Oscillator> for Eliminated {
    fn evaluate(
        &mut self,
        problem: &mut Oscillator,
        at: &Linearization<'_>,
    ) -> Result<(), StepError> {
        problem.u = at.y[0];
        Ok(())
    }

    fn set_up(
        &mut self,
        _: &mut Oscillator,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError> {
        (self.real, self.complex) = (real, complex.to_vec());
        Ok(())
    }

    fn solve_real(&mut self, problem: &mut Oscillator, rhs: &mut [f64]) -> Result<(), StepError> {
        solve(self.real, 1.0, driving(problem.u)[1], rhs);
        Ok(())
    }

    fn solve_complex(
        &mut self,
        problem: &mut Oscillator,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError> {
        solve(self.complex[k], Complex64::ONE, driving(problem.u)[1], rhs);
        Ok(())
    }
}

fn eliminated(stages: usize, tol: f64) -> RadauSolver<Oscillator, Eliminated> {
    let internal = InternalVariables {
        parts: vec![InternalVariableGroup {
            slots: 0..1,
            terms: TERMS.map(|(weight, time)| RelaxationTerm { weight, time }).to_vec(),
        }],
        start: vec![0.3, 0.0, -0.2],
        absolute: tol,
    };
    let problem = Oscillator { response: Some([0.0]), u: 0.0 };
    let options = myovib_radau::RadauOptions { stages, ..tolerance(tol) };
    RadauSolver::builder(problem)
        .options(options)
        .roots([Direction::Both], |_, _, y, _, out| {
            out[0] = y[0] - 0.2;
            Ok(())
        })
        .internal_variables(internal)
        .build_with(Eliminated::default(), 0.0, &[0.1, 0.0], &[0.0, 0.0])
        .unwrap()
}

/// Returns y and q at `t`, and the number of roots. The solver restarts at each crossing of u = 0.2.
fn end(mut solver: RadauSolver<Oscillator, Eliminated>, t: f64) -> (Vec<f64>, usize) {
    let mut roots = 0;
    loop {
        match solver.integrate_to(t).unwrap() {
            Outcome::Reached { t } => {
                let mut state = vec![0.0; 2 + TERMS.len()];
                let (y, q) = state.split_at_mut(2);
                solver.dense_output(t, 0, y).unwrap();
                solver.internal_variables_dense_output(t, 0, q).unwrap();
                return (state, roots);
            }
            Outcome::Root { .. } => {
                roots += 1;
                solver.restart();
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn eliminated_states_are_those_among_the_unknowns_over_restarts() {
    let y0 = [0.1, 0.0, 0.3, 0.0, -0.2];
    let mut full = RadauSolver::builder(Oscillator { response: None, u: 0.0 })
        .options(tolerance(1e-11))
        .build(0.0, &y0, &[0.0; 5])
        .unwrap();
    full.integrate_to(3.0).unwrap();
    for stages in [1, 3, 5, 7] {
        let tol = if stages == 1 { 1e-5 } else { 1e-8 };
        let (state, roots) = end(eliminated(stages, tol), 3.0);
        assert!(roots > 2, "{roots}");
        for (i, (found, exact)) in state.iter().zip(full.y()).enumerate() {
            // Errors accumulate over several hundred steps. If a step were truncated at a wrong time, the error of a
            // state would be 1e-3.
            let error = (found - exact).abs() / tol;
            assert!(error < 1e3, "s = {stages}, {i}: {found} {exact}, {error:e} tolerances");
        }
    }
}

#[test]
fn sensitivities_with_internal_variables_are_rejected() {
    let solver = eliminated(3, 1e-6);
    assert!(matches!(Recording::of_stages(&solver), Err(RadauError::InternalVariables)));
}
