//! Ideal diodes, whose characteristic has a kink. Successful runs must be accurate.

use myovib_conformance::samples::{Differentiable, Differentiated, Equations, Start};
use myovib_dae::{Outcome, Problem, StepError, Tolerances, VariableKind};
use myovib_radau::RadauOptions;

use crate::circuits::PROMISED;
use crate::common::{radau, tolerance};

/// Amplitude (V) and angular frequency (rad/s) of the source, and the rate at which the capacitor discharges (1/s).
const SOURCE: [f64; 2] = [5.0, 1.0];
const DISCHARGE: f64 = 0.2;
const END: f64 = 10.0;

/// A capacitor of 1 F charged by a source through a resistor of 1 Ω and an ideal diode with this conductance
/// (1/Ω):
///
/// ```text
/// u̇ = i − 0.2 u,  i = 5 sin t − v,  i = g max(v − u, 0)
/// ```
#[derive(Clone, Copy)]
struct Rectifier(f64);

impl Rectifier {
    /// Returns u at the end, computed from the equivalent ordinary differential equation.
    fn exact(self) -> f64 {
        let options = RadauOptions { max_step: Some(0.05), ..tolerance(1e-9) };
        let mut solver =
            radau(Explicit(self.0)).options(options).build(0.0, &[0.0], &[0.0]).unwrap();
        assert_eq!(solver.integrate_to(END).unwrap(), Outcome::Reached { t: END });
        solver.y()[0]
    }
}

impl Equations for Rectifier {
    fn n_unknowns(&self) -> usize {
        3
    }

    fn residual<S: Differentiable>(&self, t: f64, y: &[S], y_dot: &[S], residual: &mut [S]) {
        let [amplitude, frequency] = SOURCE;
        let voltage = y[1] - y[0];
        let current = match voltage.value() > 0.0 {
            true => voltage.times(self.0),
            false => S::from(0.0),
        };
        residual[0] = y_dot[0] - y[2] + y[0].times(DISCHARGE);
        residual[1] = y[2] - (S::from(amplitude * (frequency * t).sin()) - y[1]);
        residual[2] = y[2] - current;
    }

    fn n_differential(&self) -> usize {
        1
    }

    fn start(&self) -> Start {
        let (slope, inner) = (SOURCE[0] * SOURCE[1], self.0 / (1.0 + self.0));
        let y_dot = vec![0.0, slope / (1.0 + self.0), slope * inner];
        Start { t: 0.0, y: vec![0.0; 3], y_dot }
    }
}

struct Explicit(f64);

impl Problem for Explicit {
    fn n_unknowns(&self) -> usize {
        1
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        let [amplitude, frequency] = SOURCE;
        let voltage = (amplitude * (frequency * t).sin() - y[0]).max(0.0);
        r[0] = v[0] - self.0 / (1.0 + self.0) * voltage + DISCHARGE * y[0];
        Ok(())
    }
}

/// A rectifier without its Jacobian.
struct Quotients(Differentiated<Rectifier>);

impl Problem for Quotients {
    fn n_unknowns(&self) -> usize {
        self.0.n_unknowns()
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        self.0.residual(t, y, v, r)
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        self.0.kinds()
    }

    fn indices(&self) -> Option<Vec<u8>> {
        self.0.indices()
    }
}

/// Returns u at the end, or `None` if the run stopped.
fn run(rectifier: Rectifier, stages: usize, tol: f64) -> Option<f64> {
    let start = rectifier.start();
    let options = RadauOptions {
        stages,
        tolerances: Tolerances::scalar(tol, 0.002 * tol * SOURCE[0]),
        max_steps: Some(8000),
        ..RadauOptions::default()
    };
    let mut solver = radau(Quotients(Differentiated::new(rectifier)))
        .options(options)
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    let outcome = solver.integrate_to(END).unwrap();
    matches!(outcome, Outcome::Reached { .. }).then(|| solver.y()[0])
}

/// Regression test: with a Jacobian of the other branch, the second correction was tiny, so that convergence seemed to
/// be fast. Errors of successful runs were up to 17 000 tolerances. The bound is ten times the bound for smooth
/// circuits, because at loose tolerances, the error test may miss a kink between the stages.
#[test]
fn successful_runs_with_ideal_diodes_are_accurate() {
    let mut successes = 0;
    for g in [10.0, 100.0, 1e3, 1e4, 1e5] {
        let exact = Rectifier(g).exact();
        for stages in [3, 5, 7] {
            for tol in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
                if let Some(u) = run(Rectifier(g), stages, tol) {
                    let error = (u - exact).abs() / (SOURCE[0] * tol);
                    assert!(
                        error < 10.0 * PROMISED,
                        "{stages} stages, {tol:e}, {g} S: {error:.1e}"
                    );
                    successes += 1;
                }
            }
        }
    }
    // Difference quotients do not resolve all kinks.
    assert!(successes >= 20, "{successes}");
}
