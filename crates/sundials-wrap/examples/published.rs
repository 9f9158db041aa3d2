//! Steps and digits on published problems compared with IDA 7.9, as Markdown.
//!
//! ```text
//! cargo run -p sundials-wrap --example published
//! ```
//! scd is −log10 of the largest error relative to the reference, mescd relative to 1 + |reference|,
//! both over the compared components (positions and velocities; all except multipliers).
//! Multipliers are excluded from the error test. In Newton's convergence test they have an absolute
//! tolerance of 1e10, as in the published runs, or all variables are weighted by the step (see the
//! row).

use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use myovib_dae::samples::{
    Akzo, CarAxis, Heat2d, JayIndex2, LinearIndex1, MechanicalForm, Pendulum, Robertson, Sample,
    VanDerPol,
};
use myovib_dae::{Outcome, Suppressed, Tolerances};
use serde_json::Value;

use sundials_wrap::{IdaOptions, IdaSolver};

const TOLERANCES: [f64; 3] = [1e-4, 1e-6, 1e-8];
/// √g, the pendulum's angular frequency at small angles, 1/s.
const PENDULUM: f64 = 3.13;
/// That of the road under the car axis, 1/s.
const ROAD: f64 = 10.0;
/// Steps after which a run is said to creep.
const MAX_STEPS: usize = 100_000;

/// Weights of variables of index 2 and higher in the error test.
#[derive(Clone, Copy)]
enum Weights {
    /// Multipliers count for nothing, by an absolute tolerance.
    MultipliersLeftOut,
    /// A variable of index i, including velocities, is weighted by (Ωh)^(i−1), with this Ω, 1/s;
    /// multipliers are excluded from the error test, but not from Newton's convergence test.
    StepScaled(f64),
}

/// A sample with its reference and tolerances.
struct Problem<'a, S> {
    name: &'a str,
    sample: S,
    t_end: f64,
    /// Absolute tolerances for a relative tolerance of 1; 1 for all if empty.
    absolute: &'a [f64],
    /// Components judged, and their values at the end.
    judged: std::ops::Range<usize>,
    reference: &'a [f64],
    weights: Weights,
    /// Steps of IDA 7.9 at the three tolerances.
    published: Option<[f64; 3]>,
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("| problem | tolerance | steps | IDA 7.9 | ratio | scd | mescd |");
    println!("|---|---|---|---|---|---|---|");
    let akzo = numbers(&reference("s1_akzo")?["ref"])?;
    rows(&Problem {
        published: Some([58.0, 141.0, 266.0]),
        ..plain("s1 Akzo Nobel, index 1", Akzo, 180.0, 0..6, &akzo)
    })?;
    car_axis()?;
    let accurate = &reference("s3_robertson")?["accurate"];
    let last = |key| -> Result<f64, Box<dyn Error>> {
        Ok(*numbers(&accurate[key])?.last().ok_or("no values")?)
    };
    let robertson = [last("y1")?, last("y2")?];
    rows(&Problem {
        absolute: &[1e-4, 1e-8, 1e-2],
        ..plain("s3 Robertson, index 1", Robertson, 1e11, 0..2, &robertson)
    })?;
    let left_out = Weights::MultipliersLeftOut;
    exact("s4 linear, index 1", LinearIndex1, 10.0, 0..2, left_out)?;
    exact("s4 Jay, index 2", JayIndex2, 1.0, 0..2, left_out)?;
    let scaled = Weights::StepScaled(PENDULUM);
    for (name, form, weights) in [
        ("index 3", MechanicalForm::Index3, left_out),
        ("index 3, step-scaled", MechanicalForm::Index3, scaled),
        ("index 2", MechanicalForm::Index2, left_out),
        ("stabilized", MechanicalForm::Stabilized, left_out),
    ] {
        let name = format!("s4 pendulum, {name}");
        exact(&name, Pendulum::new(form), 2.0, 0..4, weights)?;
    }
    let heat = reference("s5_heat2d")?;
    let mut exact_rows = heat["exact"].as_array().into_iter().flatten();
    let heat = exact_rows.find(|row| row["t"] == 0.32);
    let heat = heat.ok_or("no values of the heat equation")?;
    let value = |key: &str| heat[key].as_f64().ok_or("no number");
    let (t, corner) = (value("t")?, [value("u_1_1")?]);
    rows(&plain(
        "s5 heat 10 × 10, index 1",
        Heat2d::new(10),
        t,
        11..12,
        &corner,
    ))?;
    let published = reference("s9_oscillators")?["vdpolm"].clone();
    let number = |key: &str| published[key].as_f64().ok_or("no number");
    let (vdp_mu, t) = (number("vdp_mu")?, number("t")?);
    let end = numbers(&published["y"])?;
    rows(&plain(
        "s9 van der Pol, μ = 1000",
        VanDerPol { vdp_mu },
        t,
        0..2,
        &end,
    ))
}

fn car_axis() -> Result<(), Box<dyn Error>> {
    let end = numbers(&reference("s2_caraxis")?["ref"])?;
    for (name, form, published) in [
        ("s2 car axis, index 3", MechanicalForm::Index3, None),
        (
            "s2 car axis, index 2",
            MechanicalForm::Index2,
            Some([846.0, 1876.0, 3630.0]),
        ),
        (
            "s2 car axis, stabilized",
            MechanicalForm::Stabilized,
            Some([866.0, 1780.0, 3636.0]),
        ),
    ] {
        rows(&Problem {
            published,
            ..plain(name, CarAxis::new(form), 3.0, 0..8, &end)
        })?;
    }
    rows(&Problem {
        weights: Weights::StepScaled(ROAD),
        ..plain(
            "s2 car axis, index 3, step-scaled",
            CarAxis::new(MechanicalForm::Index3),
            3.0,
            0..8,
            &end,
        )
    })
}

fn plain<'a, S>(
    name: &'a str,
    sample: S,
    t_end: f64,
    judged: std::ops::Range<usize>,
    reference: &'a [f64],
) -> Problem<'a, S> {
    Problem {
        name,
        sample,
        t_end,
        absolute: &[],
        judged,
        reference,
        weights: Weights::MultipliersLeftOut,
        published: None,
    }
}

fn exact<S: Sample + Clone>(
    name: &str,
    sample: S,
    t_end: f64,
    judged: std::ops::Range<usize>,
    weights: Weights,
) -> Result<(), Box<dyn Error>> {
    let reference = sample.exact(t_end).ok_or("no exact solution")?;
    rows(&Problem {
        weights,
        ..plain(name, sample, t_end, judged, &reference)
    })
}

fn rows<S: Sample + Clone>(problem: &Problem<'_, S>) -> Result<(), Box<dyn Error>> {
    for (i, tolerance) in TOLERANCES.into_iter().enumerate() {
        let (outcome, steps, y) = integrate(problem, tolerance)?;
        let (theirs, ratio) = match problem.published {
            Some(published) => (
                published[i].to_string(),
                format!("{:.2}", steps as f64 / published[i]),
            ),
            None => ("–".to_owned(), "–".to_owned()),
        };
        let digits = match outcome {
            Outcome::Stopped(stop) => format!("{} at t = {:.3} | –", stop.reason, stop.t),
            _ => {
                let ours = &y[problem.judged.clone()];
                let of = |scale: fn(f64) -> f64| {
                    let pairs = ours.iter().zip(problem.reference);
                    let errors = pairs.map(|(y, r)| (y - r).abs() / scale(*r));
                    -errors.fold(0.0, f64::max).log10()
                };
                format!("{:.1} | {:.1}", of(f64::abs), of(|r| 1.0 + r.abs()))
            }
        };
        println!(
            "| {} | {tolerance:.0e} | {steps} | {theirs} | {ratio} | {digits} |",
            problem.name
        );
    }
    Ok(())
}

fn integrate<S: Sample + Clone>(
    problem: &Problem<'_, S>,
    tolerance: f64,
) -> Result<(Outcome, u64, Vec<f64>), Box<dyn Error>> {
    let start = problem.sample.start();
    let indices = problem
        .sample
        .indices()
        .expect("samples state their indices");
    let mut absolute: Vec<f64> = (0..start.y.len())
        .map(|i| tolerance * problem.absolute.get(i).unwrap_or(&1.0))
        .collect();
    let mut options = IdaOptions {
        max_steps: Some(MAX_STEPS),
        ..IdaOptions::default()
    };
    let builder = IdaSolver::builder(problem.sample.clone());
    let (outcome, solver) = match problem.weights {
        Weights::MultipliersLeftOut => {
            // Multipliers follow the compared components.
            for i in problem.judged.end..absolute.len() {
                if indices[i] > 1 {
                    absolute[i] = 1e10;
                }
            }
            options.tolerances = Tolerances::vector(tolerance, absolute);
            let builder = builder.options(options);
            let mut solver = builder.build(start.t, &start.y, &start.y_dot)?;
            (solver.integrate_to(problem.t_end)?, solver)
        }
        Weights::StepScaled(omega) => {
            options.stop_time = Some(problem.t_end);
            options.suppressed = Suppressed::Algebraic;
            let h = Arc::new(AtomicU64::new(0));
            let size = Arc::clone(&h);
            let weigh = move |_: &mut S, y: &[f64], weights: &mut [f64]| {
                let h = f64::from_bits(size.load(Ordering::Relaxed));
                // The first step is not chosen yet.
                let scale = if h == 0.0 { 1.0 } else { (omega * h).min(1.0) };
                for (i, weight) in weights.iter_mut().enumerate() {
                    let factor = scale.powi(i32::from(indices[i]) - 1);
                    *weight = factor / (tolerance * y[i].abs() + absolute[i]);
                }
                Ok(())
            };
            let builder = builder.options(options).error_weights(weigh);
            let mut solver = builder.build(start.t, &start.y, &start.y_dot)?;
            let outcome = loop {
                h.store(solver.current_step().to_bits(), Ordering::Relaxed);
                let outcome = solver.step(problem.t_end)?;
                if !matches!(outcome, Outcome::StepTaken { .. }) {
                    break outcome;
                }
            };
            (outcome, solver)
        }
    };
    Ok((outcome, solver.statistics().steps, solver.y().to_vec()))
}

fn reference(name: &str) -> Result<Value, Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/references");
    let text = std::fs::read_to_string(folder.join(format!("{name}.json")))?;
    Ok(serde_json::from_str(&text)?)
}

fn numbers(value: &Value) -> Result<Vec<f64>, Box<dyn Error>> {
    let values = value.as_array().ok_or("no array")?;
    let number = |v: &Value| v.as_f64().ok_or_else(|| "no number".into());
    values.iter().map(number).collect()
}
