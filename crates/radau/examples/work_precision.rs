//! Prints the correct digits versus the steps of Radau IIA of all orders and of IDAS on published problems, as
//! Markdown.
//!
//! ```text
//! cargo run --release -p myovib-radau --example work_precision
//! ```
//!
//! The number of digits is −log10 of the largest error relative to 1 + |reference| over the specified components.
//! Relative and absolute tolerances are equal, except for Robertson's problem, whose absolute tolerances are (1e-4,
//! 1e-8, 1e-2) times the relative tolerance. Each entry has the form "digits (steps)", or "–" if 100 000 steps were not
//! sufficient.

use myovib_conformance::samples::{
    Akzo, CarAxis, Heat2d, JayIndex2, LinearIndex1, MechanicalForm, Pendulum, Robertson, Sample,
    VanDerPol,
};
use myovib_dae::{Outcome, Suppressed, Tolerances, VariableKind};
use myovib_radau::{RadauOptions, RadauSolver};

use sundials_wrap::{IdaOptions, IdaSolver};

/// Reference values from the Test Set for IVP Solvers: problem chemakzo at t = 180.
const AKZO: [f64; 6] = [
    0.115_079_492_066_170_2,
    0.001_203_831_471_567_715,
    0.161_156_288_740_797_4,
    0.000_365_615_642_124_928_3,
    0.017_080_108_852_644_04,
    0.004_873_531_310_307_455,
];

/// Reference values from the Test Set for IVP Solvers: positions and velocities of problem caraxis at t = 3.
const CAR_AXIS: [f64; 8] = [
    0.049_345_578_427_540_28,
    0.496_989_460_230_171_15,
    1.041_742_524_885_421_5,
    0.373_911_027_265_361_24,
    -0.077_058_368_404_097_23,
    0.007_446_866_587_237_785,
    0.017_556_815_753_723_223,
    0.770_341_043_779_251_9,
];

/// Reference values from the Test Set for IVP Solvers: problem vdpolm at t = 2000.
const VAN_DER_POL: [f64; 2] = [1.706_167_732_170_469, -0.000_892_809_701_024_812_5];

/// y1 of Robertson's problem at t = 1e11, from data/references/s3_robertson.json.
const ROBERTSON: f64 = 2.083_340_149_699_905e-8;

/// Solution of the heat equation at t = 0.32 at the corner of the interior, computed by the matrix exponential.
const HEAT_CORNER: f64 = 0.000_239_855_762_019_495_92;

/// Numbers of stages of the compared methods.
const STAGES: [usize; 4] = [1, 3, 5, 7];
const TOLERANCES: [f64; 3] = [1e-4, 1e-6, 1e-8];
const MAX_STEPS: usize = 100_000;

/// A sample, the scaling of its tolerances, and a function that compares its components with the reference.
struct Problem<'a, S> {
    name: &'a str,
    sample: S,
    t_end: f64,
    /// Absolute tolerances by component, for a relative tolerance of 1. If empty, all are 1.
    absolute: &'a [f64],
    digits: &'a dyn Fn(&[f64]) -> f64,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("| problem | tol | Radau IIA 1 | 5 | 9 | 13 | IDAS |");
    println!("|---|---|---|---|---|---|---|");
    row("s1 Akzo Nobel (index 1)", Akzo, 180.0, &mixed(&AKZO))?;
    for (name, form) in [
        ("index 3", MechanicalForm::Index3),
        ("index 2", MechanicalForm::Index2),
        ("stabilized", MechanicalForm::Stabilized),
    ] {
        let name = format!("s2 car axis ({name}), p and v");
        row(&name, CarAxis::new(form), 3.0, &mixed(&CAR_AXIS))?;
    }
    rows(&Problem {
        name: "s3 Robertson, y1 at 1e11",
        sample: Robertson,
        t_end: 1e11,
        absolute: &[1e-4, 1e-8, 1e-2],
        digits: &|y| -((y[0] - ROBERTSON) / ROBERTSON).abs().log10(),
    })?;
    exact("s4 linear (index 1)", LinearIndex1, 10.0, 0)?;
    exact("s4 Jay (index 2), y", JayIndex2, 1.0, 0)?;
    let pendulum = Pendulum::new(MechanicalForm::Index3);
    for (name, component) in [("x", 0), ("ẋ", 2), ("λ", 4)] {
        let name = format!("s4 pendulum (index 3), {name}");
        exact(&name, pendulum, 2.0, component)?;
    }
    row("s5 heat 10 × 10 (index 1), corner", Heat2d::new(10), 0.32, &|y| {
        -(y[11] - HEAT_CORNER).abs().log10()
    })?;
    let van_der_pol = VanDerPol { vdp_mu: 1000.0 };
    row("s9 van der Pol, μ = 1000", van_der_pol, 2000.0, &mixed(&VAN_DER_POL))?;
    Ok(())
}

/// Returns a function that computes the number of correct digits of the first components.
fn mixed(reference: &'static [f64]) -> impl Fn(&[f64]) -> f64 {
    move |y| {
        let errors = reference.iter().zip(y).map(|(r, y)| (y - r).abs() / (1.0 + r.abs()));
        -errors.fold(0.0, f64::max).log10()
    }
}

/// Prints the rows for one component of a problem with an exact solution.
fn exact<S: Sample + Copy>(
    name: &str,
    sample: S,
    t_end: f64,
    component: usize,
) -> Result<(), Box<dyn std::error::Error>> {
    let exact = sample.exact(t_end).ok_or("no exact solution")?[component];
    row(name, sample, t_end, &|y| -((y[component] - exact).abs() / (1.0 + exact.abs())).log10())
}

fn row<S: Sample + Clone>(
    name: &str,
    sample: S,
    t_end: f64,
    digits: &dyn Fn(&[f64]) -> f64,
) -> Result<(), Box<dyn std::error::Error>> {
    rows(&Problem { name, sample, t_end, absolute: &[], digits })
}

fn rows<S: Sample + Clone>(problem: &Problem<'_, S>) -> Result<(), Box<dyn std::error::Error>> {
    for tol in TOLERANCES {
        print!("| {} | {tol:.0e} |", problem.name);
        for stages in STAGES {
            print!(" {} |", radau(problem, stages, tol)?);
        }
        println!(" {} |", idas(problem, tol)?);
    }
    Ok(())
}

fn tolerances<S>(problem: &Problem<'_, S>, tol: f64) -> Tolerances {
    match problem.absolute {
        [] => Tolerances::scalar(tol, tol),
        absolute => Tolerances::vector(tol, absolute.iter().map(|a| tol * a).collect::<Vec<_>>()),
    }
}

fn radau<S: Sample + Clone>(
    problem: &Problem<'_, S>,
    stages: usize,
    tol: f64,
) -> Result<String, Box<dyn std::error::Error>> {
    let start = problem.sample.start();
    let options = RadauOptions {
        stages,
        tolerances: tolerances(problem, tol),
        max_steps: Some(MAX_STEPS),
        ..RadauOptions::default()
    };
    let mut solver = RadauSolver::builder(problem.sample.clone()).options(options).build(
        start.t,
        &start.y,
        &start.y_dot,
    )?;
    let t = problem.t_end;
    let arrived = solver.integrate_to(t)? == Outcome::Reached { t };
    let digits = arrived.then(|| (problem.digits)(solver.y()));
    Ok(shown(digits, solver.statistics().steps))
}

fn idas<S: Sample + Clone>(
    problem: &Problem<'_, S>,
    tol: f64,
) -> Result<String, Box<dyn std::error::Error>> {
    let (sample, start) = (&problem.sample, problem.sample.start());
    // IDAS uses typical settings, with multipliers (if any) excluded from the error test.
    let kinds = sample.kinds().unwrap_or_default();
    let algebraic = kinds.contains(&VariableKind::Algebraic);
    let higher_index = sample.indices().unwrap_or_default().iter().any(|&index| index > 1);
    let suppressed = match algebraic && higher_index {
        true => Suppressed::Algebraic,
        false => Suppressed::Nothing,
    };
    let options = IdaOptions {
        tolerances: tolerances(problem, tol),
        suppressed,
        max_steps: Some(MAX_STEPS),
        ..IdaOptions::default()
    };
    let mut solver = IdaSolver::builder(sample.clone()).options(options).build(
        start.t,
        &start.y,
        &start.y_dot,
    )?;
    let t = problem.t_end;
    let arrived = solver.integrate_to(t)? == Outcome::Reached { t };
    let digits = arrived.then(|| (problem.digits)(solver.y()));
    Ok(shown(digits, solver.statistics().steps))
}

fn shown(digits: Option<f64>, steps: u64) -> String {
    digits.map_or("–".to_owned(), |digits| format!("{digits:.1} ({steps})"))
}
