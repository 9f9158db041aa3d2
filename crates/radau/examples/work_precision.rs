//! Digits against steps on published problems, Radau IIA beside IDAS.
//!
//! ```text
//! cargo run --release -p myovib-radau --example work_precision
//! ```
//! Digits are −log10 of the largest error relative to 1 + |reference| over the components named;
//! relative and absolute tolerance are equal. "–" where the integration stopped early.

use myovib_radau::{RadauOptions, RadauSolver};
use sundials_wrap::samples::{
    Akzo, CarAxis, Heat2d, JayIndex2, LinearIndex1, MechanicalForm, Pendulum, Sample, VanDerPol,
};
use sundials_wrap::{IdaOptions, IdaSolver, Outcome, Suppressed, Tolerances, VariableKind};

/// Test Set for IVP Solvers, chemakzo at t = 180.
const AKZO: [f64; 6] = [
    0.115_079_492_066_170_2,
    0.001_203_831_471_567_715,
    0.161_156_288_740_797_4,
    0.000_365_615_642_124_928_3,
    0.017_080_108_852_644_04,
    0.004_873_531_310_307_455,
];

/// Test Set for IVP Solvers, positions and velocities of caraxis at t = 3.
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

/// Test Set for IVP Solvers, vdpolm at t = 2000.
const VAN_DER_POL: [f64; 2] = [1.706_167_732_170_469, -0.000_892_809_701_024_812_5];

/// The heat equation at t = 0.32: the corner of the interior, by the matrix exponential.
const HEAT_CORNER: f64 = 0.000_239_855_762_019_495_92;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!(
        "{:<42}{:>6}{:>14}{:>10}{:>10}{:>8}{:>14}{:>10}{:>8}",
        "problem",
        "tol",
        "Radau: steps",
        "residuals",
        "set-ups",
        "digits",
        "IDAS: steps",
        "residuals",
        "digits"
    );
    let digits = |reference: &'static [f64], first: usize| {
        move |y: &[f64]| {
            let errors = reference
                .iter()
                .zip(&y[first..])
                .map(|(r, y)| (y - r).abs() / (1.0 + r.abs()));
            -errors.fold(0.0, f64::max).log10()
        }
    };
    rows("Akzo Nobel (index 1)", Akzo, 180.0, digits(&AKZO, 0))?;
    rows(
        "heat 10 × 10 (index 1), corner",
        Heat2d::new(10),
        0.32,
        |y| -(y[11] - HEAT_CORNER).abs().log10(),
    )?;
    rows(
        "van der Pol, μ = 1000",
        VanDerPol { vdp_mu: 1000.0 },
        2000.0,
        digits(&VAN_DER_POL, 0),
    )?;
    for (name, form) in [
        ("index 3", MechanicalForm::Index3),
        ("index 2", MechanicalForm::Index2),
        ("stabilized", MechanicalForm::Stabilized),
    ] {
        rows(
            &format!("car axis ({name}), p and v"),
            CarAxis::new(form),
            3.0,
            digits(&CAR_AXIS, 0),
        )?;
    }
    exact("linear (index 1)", LinearIndex1, 10.0, 0)?;
    exact("Jay (index 2), y", JayIndex2, 1.0, 0)?;
    let pendulum = Pendulum::new(MechanicalForm::Index3);
    for (name, component) in [("x", 0), ("ẋ", 2), ("λ", 4)] {
        exact(
            &format!("pendulum (index 3), {name}"),
            pendulum,
            2.0,
            component,
        )?;
    }
    Ok(())
}

/// Rows for one component of a problem with an exact solution.
fn exact<S: Sample + Copy>(
    name: &str,
    sample: S,
    t_end: f64,
    component: usize,
) -> Result<(), Box<dyn std::error::Error>> {
    let exact = sample.exact(t_end).ok_or("no exact solution")?[component];
    rows(name, sample, t_end, |y| {
        -((y[component] - exact).abs() / (1.0 + exact.abs())).log10()
    })
}

fn rows<S: Sample + Clone>(
    name: &str,
    sample: S,
    t_end: f64,
    digits: impl Fn(&[f64]) -> f64,
) -> Result<(), Box<dyn std::error::Error>> {
    let start = sample.start();
    for tol in [1e-4, 1e-6, 1e-8] {
        let tolerances = Tolerances::scalar(tol, tol);
        let options = RadauOptions {
            tolerances: tolerances.clone(),
            ..RadauOptions::default()
        };
        let mut radau = RadauSolver::builder(sample.clone())
            .options(options)
            .build(start.t, &start.y, &start.y_dot)?;
        let arrived = radau.integrate_to(t_end)? == Outcome::Reached { t: t_end };
        let stats = radau.stats();
        print!(
            "{name:<42}{tol:>6.0e}{:>14}{:>10}{:>10}{:>8}",
            stats.steps,
            stats.residual_evaluations,
            stats.linear_setups,
            shown(arrived.then(|| digits(radau.y())))
        );
        // As one uses BDF: without the multipliers in the error test, where there are some.
        let algebraic = sample.kinds().contains(&VariableKind::Algebraic);
        let higher_index = sample.indices().iter().any(|&index| index > 1);
        let suppressed = if algebraic && higher_index {
            Suppressed::Algebraic
        } else {
            Suppressed::Nothing
        };
        let options = IdaOptions {
            tolerances,
            suppressed,
            max_steps: Some(100_000),
            ..IdaOptions::default()
        };
        let mut ida = IdaSolver::builder(sample.clone()).options(options).build(
            start.t,
            &start.y,
            &start.y_dot,
        )?;
        let arrived = ida.integrate_to(t_end)? == Outcome::Reached { t: t_end };
        let stats = ida.stats();
        println!(
            "{:>14}{:>10}{:>8}",
            stats.steps,
            stats.residual_evaluations,
            shown(arrived.then(|| digits(ida.y())))
        );
    }
    Ok(())
}

fn shown(digits: Option<f64>) -> String {
    digits.map_or("–".to_owned(), |digits| format!("{digits:.1}"))
}
