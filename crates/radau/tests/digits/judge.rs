//! Runs of the integrators, and checks of their accuracy.

use std::ops::Range;

use myovib_conformance::samples::Sample;
use myovib_dae::{Integrator, Outcome, Stop, Suppressed, Tolerances, VariableKind};
use myovib_radau::{RadauOptions, RadauSolver};
use sundials_wrap::{IdaOptions, IdaSolver};

const STAGES: [usize; 3] = [3, 5, 7];
const TOLERANCES: [f64; 3] = [1e-4, 1e-6, 1e-8];

/// Allowed error in units of the tolerance, which corresponds to a loss of two digits.
const PROMISED: f64 = 100.0;

/// Factor of the tolerance with which IDAS reaches this accuracy.
const PART_FOR_BDF: f64 = 0.01;

/// Maximum number of steps of IDAS in one call, because IDAS might never finish for index 3.
const MAX_STEPS: usize = 20_000;

/// Stages and tolerances of two runs that must agree in order to provide a reference.
const REFERENCES: [(usize, f64); 2] = [(7, 1e-12), (5, 1e-11)];

/// Required agreement of the two runs: a tenth of the smallest allowed error.
const AGREEMENT: f64 = 0.1 * PROMISED * TOLERANCES[2];

/// Function that creates a problem. With boxed problems, the integrators are compiled only once.
pub(crate) type Make<'a> = &'a dyn Fn() -> Box<dyn Sample>;

/// Returns a function that copies this problem.
pub(crate) fn copies<S: Sample + Clone + 'static>(sample: &S) -> impl Fn() -> Box<dyn Sample> {
    || Box::new(sample.clone())
}

/// A problem, its end time, the known results at the end time, and the times that steps must not pass.
pub(crate) struct Case<'a> {
    pub(crate) name: &'a str,
    pub(crate) sample: Make<'a>,
    pub(crate) t_end: f64,
    pub(crate) reference: Vec<f64>,
    pub(crate) breaks: &'a [f64],
}

/// Compares runs with the exact solution.
pub(crate) fn exact<S>(name: &str, sample: S, t_end: f64, breaks: &[f64])
where
    S: Sample + Clone + 'static,
{
    let reference = sample.exact(t_end).unwrap();
    Case { name, sample: &copies(&sample), t_end, reference, breaks }.judge();
}

/// Compares runs with a converged solution.
pub(crate) fn converged<S>(name: &str, sample: &S, t_end: f64, breaks: &[f64])
where
    S: Sample + Clone + 'static,
{
    let sample = &copies(sample);
    let reference = reference(sample, t_end, breaks);
    Case { name, sample, t_end, reference, breaks }.judge();
}

/// Returns a reference solution on which two methods agree.
pub(crate) fn reference(sample: Make<'_>, t_end: f64, breaks: &[f64]) -> Vec<f64> {
    let [first, second] = REFERENCES.map(|(stages, tolerance)| {
        let mut solver = radau(sample, stages, tolerance);
        run(&mut solver, t_end, breaks).unwrap();
        solver.y().to_vec()
    });
    let apart = largest(&second, &first, 0..first.len());
    assert!(apart < AGREEMENT, "references differ by {apart:e}");
    first
}

/// Returns the largest error of the components in the given range, relative to 1 + |reference|.
fn largest(y: &[f64], reference: &[f64], range: Range<usize>) -> f64 {
    let error = |i: usize| (y[i] - reference[i]).abs() / (1.0 + reference[i].abs());
    let worse = |worst: f64, error: f64| match error.is_nan() {
        true => f64::INFINITY,
        false => worst.max(error),
    };
    range.map(error).fold(0.0, worse)
}

fn radau(sample: Make<'_>, stages: usize, tolerance: f64) -> RadauSolver<Box<dyn Sample>> {
    let sample = sample();
    let start = sample.start();
    let options = RadauOptions {
        stages,
        tolerances: Tolerances::scalar(tolerance, tolerance),
        ..RadauOptions::default()
    };
    let builder = RadauSolver::builder(sample).options(options);
    builder.build(start.t, &start.y, &start.y_dot).unwrap()
}

/// Returns an IDAS solver with typical settings, with multipliers (if any) excluded from the error test.
fn idas(sample: Make<'_>, tolerance: f64) -> IdaSolver<Box<dyn Sample>> {
    let sample = sample();
    let start = sample.start();
    let options = IdaOptions {
        tolerances: Tolerances::scalar(tolerance, tolerance),
        suppressed: match multipliers(&*sample).contains(&true) {
            true => Suppressed::Algebraic,
            false => Suppressed::Nothing,
        },
        max_steps: Some(MAX_STEPS),
        ..IdaOptions::default()
    };
    let builder = IdaSolver::builder(sample).options(options);
    builder.build(start.t, &start.y, &start.y_dot).unwrap()
}

/// Returns whether each variable is algebraic and of index 2 or 3.
fn multipliers(sample: &dyn Sample) -> Vec<bool> {
    let indices = sample.indices().unwrap();
    let differential = || vec![VariableKind::Differential; indices.len()];
    let kinds = sample.kinds().unwrap_or_else(differential);
    let variables = kinds.iter().zip(&indices);
    variables.map(|(&kind, &index)| kind == VariableKind::Algebraic && index > 1).collect()
}

/// Integrates to the end and stops at each break.
fn run<I: Integrator<Box<dyn Sample>>>(
    solver: &mut I,
    t_end: f64,
    breaks: &[f64],
) -> Result<(), Box<Stop>> {
    let on_the_way = breaks.iter().copied().filter(|t| (0.0..t_end).contains(t));
    for t in on_the_way.filter(|t| *t > 0.0).chain([t_end]) {
        solver.set_stop_time(t).unwrap();
        if let Outcome::Stopped(stop) = solver.integrate_to(t).unwrap() {
            return Err(stop);
        }
    }
    Ok(())
}

impl Case<'_> {
    /// Prints the rows of the table, and panics if the allowed error is exceeded.
    pub(crate) fn judge(&self) {
        let mut broken = Vec::new();
        let mut rows = String::new();
        for tolerance in TOLERANCES {
            rows += &format!("| {} | {tolerance:.0e} |", self.name);
            for stages in STAGES {
                let mut solver = radau(self.sample, stages, tolerance);
                let ended = run(&mut solver, self.t_end, self.breaks);
                let entry = self.entry(&solver, &ended, tolerance);
                if ended.is_err() || self.error(solver.y(), false) > PROMISED * tolerance {
                    broken.push(format!("Radau IIA, {stages} stages, {tolerance:e}: {entry}"));
                }
                rows += &entry;
            }
            for part in [1.0, PART_FOR_BDF] {
                let mut solver = idas(self.sample, part * tolerance);
                let ended = run(&mut solver, self.t_end, self.breaks);
                let entry = self.entry(&solver, &ended, tolerance);
                let kept = match &ended {
                    Ok(()) if part < 1.0 => self.error(solver.y(), true) <= PROMISED * tolerance,
                    Ok(()) => true,
                    // The results were printed in the previous columns.
                    Err(stop) => stop.to_string().contains("Radau IIA"),
                };
                if !kept {
                    broken.push(format!("IDAS, {:e}: {entry}", part * tolerance));
                }
                rows += &entry;
            }
            rows += "\n";
        }
        print!("{rows}");
        assert!(broken.is_empty(), "{}: {broken:#?}", self.name);
    }

    /// Returns the largest error of all variables or, if `tested` is true, of all variables except multipliers.
    fn error(&self, y: &[f64], tested: bool) -> f64 {
        let excluded = multipliers(&*(self.sample)());
        let counts = |i: &usize| !(tested && excluded[*i]);
        let errors = (0..y.len()).filter(counts);
        errors.map(|i| largest(y, &self.reference, i..i + 1)).fold(0.0, f64::max)
    }

    fn entry<I: Integrator<Box<dyn Sample>>>(
        &self,
        solver: &I,
        ended: &Result<(), Box<Stop>>,
        tolerance: f64,
    ) -> String {
        if let Err(stop) = ended {
            return format!(" – {} at {:.1e} |", stop.reason, stop.t);
        }
        let indices = (self.sample)().indices().unwrap();
        let of_index = |index: u8| {
            let of_it = (0..indices.len()).filter(|&i| indices[i].clamp(1, 3) == index);
            of_it.map(|i| largest(solver.y(), &self.reference, i..i + 1)).reduce(f64::max)
        };
        let errors: Vec<f64> = (1..=3).filter_map(of_index).collect();
        let digits: Vec<String> =
            errors.iter().map(|error| format!("{:.1}", -error.log10())).collect();
        let less = errors.iter().any(|&error| error > PROMISED * tolerance);
        let statistics = solver.statistics();
        let failed = statistics.error_test_failures + statistics.step_solve_failures;
        format!(
            " {}{} ({} + {failed}) |",
            digits.join(" "),
            if less { "!" } else { "" },
            statistics.steps
        )
    }
}
