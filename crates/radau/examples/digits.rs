//! Digits and steps of every class of variables, on problems with exact or converged solutions, by
//! IDAS and Radau IIA of orders 5, 9 and 13, as Markdown.
//!
//! ```text
//! cargo run --release -p myovib-radau --example digits [-- FILTER [plain]]
//! ```
//! An entry is "digits (steps)": digits of the variables of index 1, 2 and 3, −log10 of the largest
//! error relative to 1 + |reference|; relative and absolute tolerance are equal. `FILTER` chooses
//! problems by a part of their name; `plain` runs Radau IIA with errors scaled by RADAU5's rule, which
//! tests none of its own. A mark `!` is a success with two digits less than the tolerance asks for, or
//! worse.

use myovib_dae::samples::{
    Akzo, Amplifier, CapacitorLoop, CarAxis, Constrained, Differentiated, Doubler, Equations,
    FourBar, JayIndex2, LinearIndex1, MechanicalForm, Mechanism, Pendulum, Pipes, Press, Pulses,
    Sample, Skate, SliderCrank, SphericalPendulums, TimeScales,
};
use myovib_dae::{Integrator, Outcome, Suppressed, Tolerances, VariableKind};
use myovib_radau::{IndexScaling, RadauOptions, RadauSolver};
use sundials_wrap::{IdaOptions, IdaSolver};

const STAGES: [usize; 3] = [3, 5, 7];
const TOLERANCES: [f64; 3] = [1e-4, 1e-6, 1e-8];
const MAX_STEPS: usize = 100_000;
/// Of references by order 13.
const REFERENCE: f64 = 1e-12;

type Failure = Box<dyn std::error::Error>;

struct Table {
    filter: String,
    plain: bool,
}

/// A problem with its end, what is known there, and the times not to step over.
struct Case<'a, S> {
    name: &'a str,
    sample: S,
    t_end: f64,
    reference: Vec<f64>,
    breaks: &'a [f64],
}

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let table = Table {
        filter: arguments.first().cloned().unwrap_or_default(),
        plain: arguments.iter().any(|a| a == "plain"),
    };
    println!("| problem | tol | Radau IIA 5 | 9 | 13 | IDAS |\n|---|---|---|---|---|---|");
    let forms = [
        ("index 3", MechanicalForm::Index3),
        ("index 2", MechanicalForm::Index2),
        ("stabilized", MechanicalForm::Stabilized),
    ];
    table.exact("Akzo-free linear, index 1", LinearIndex1, 10.0)?;
    table.converged("Akzo Nobel, index 1", Akzo, 180.0)?;
    table.exact("Jay, index 2", JayIndex2, 1.0)?;
    for (name, form) in forms {
        table.exact(&format!("pendulum, {name}"), Pendulum::new(form), 2.0)?;
    }
    for (name, form) in forms {
        table.car_axis(&format!("car axis, {name}"), form)?;
    }
    for (name, form) in forms
        .into_iter()
        .chain([("index 1", MechanicalForm::Index1)])
    {
        table.mechanism(&format!("slider-crank, {name}"), SliderCrank, form, 1.0)?;
        table.mechanism(&format!("four-bar, {name}"), FourBar, form, 1.0)?;
        table.mechanism(&format!("press, {name}"), Press, form, 0.03)?;
        let name = format!("spherical pendulums, {name}");
        table.mechanism(&name, SphericalPendulums, form, 2.0)?;
    }
    table.exact("skate, index 2", Differentiated::new(Skate), 3.0)?;
    table.exact(
        "capacitor loop, index 2",
        Differentiated::new(CapacitorLoop),
        2e-6,
    )?;
    table.converged("doubler, index 1", Differentiated::new(Doubler), 0.05)?;
    table.converged("amplifier, index 1", Differentiated::new(Amplifier), 0.02)?;
    table.converged(
        "pipes, index 1",
        Differentiated::new(Pipes::new(false)),
        20.0,
    )?;
    table.converged(
        "pipes, index 2",
        Differentiated::new(Pipes::new(true)),
        20.0,
    )?;
    table.exact("time scales, index 1", Differentiated::new(TimeScales), 2.0)?;
    let breaks = Pulses.breakpoints();
    let sample = Differentiated::new(Pulses);
    let reference = sample.exact(0.3).ok_or("no exact solution")?;
    table.rows(&Case {
        name: "pulses, index 1",
        sample,
        t_end: 0.3,
        reference,
        breaks: &breaks,
    })
}

impl Table {
    fn exact<S: Sample + Clone>(&self, name: &str, sample: S, t_end: f64) -> Result<(), Failure> {
        let reference = sample.exact(t_end).ok_or("no exact solution")?;
        self.rows(&Case {
            name,
            sample,
            t_end,
            reference,
            breaks: &[],
        })
    }

    /// A problem whose reference is that of order 13 at a tight tolerance.
    fn converged<S: Sample + Clone>(
        &self,
        name: &str,
        sample: S,
        t_end: f64,
    ) -> Result<(), Failure> {
        if !name.contains(&self.filter) {
            return Ok(());
        }
        let reference = reference(sample.clone(), t_end)?;
        self.rows(&Case {
            name,
            sample,
            t_end,
            reference,
            breaks: &[],
        })
    }

    fn car_axis(&self, name: &str, form: MechanicalForm) -> Result<(), Failure> {
        if !name.contains(&self.filter) {
            return Ok(());
        }
        let mut reference = reference(CarAxis::new(MechanicalForm::Stabilized), 3.0)?;
        let sample = CarAxis::new(form);
        reference.truncate(sample.start().y.len());
        self.rows(&Case {
            name,
            sample,
            t_end: 3.0,
            reference,
            breaks: &[],
        })
    }

    /// A mechanism, whose reference is that of its equations of index 1.
    fn mechanism<M: Mechanism + Copy>(
        &self,
        name: &str,
        mechanism: M,
        form: MechanicalForm,
        t_end: f64,
    ) -> Result<(), Failure> {
        if !name.contains(&self.filter) {
            return Ok(());
        }
        let of = |form| Differentiated::new(Constrained::new(mechanism, form));
        let mut reference = reference(of(MechanicalForm::Index1), t_end)?;
        reference.resize(Constrained::new(mechanism, form).n_unknowns(), 0.0);
        self.rows(&Case {
            name,
            sample: of(form),
            t_end,
            reference,
            breaks: &[],
        })
    }

    fn rows<S: Sample + Clone>(&self, case: &Case<'_, S>) -> Result<(), Failure> {
        if !case.name.contains(&self.filter) {
            return Ok(());
        }
        for tol in TOLERANCES {
            print!("| {} | {tol:.0e} |", case.name);
            for stages in STAGES {
                print!(" {} |", self.radau(case, stages, tol)?);
            }
            println!(" {} |", idas(case, tol)?);
        }
        Ok(())
    }

    fn radau<S: Sample + Clone>(
        &self,
        case: &Case<'_, S>,
        stages: usize,
        tol: f64,
    ) -> Result<String, Failure> {
        let start = case.sample.start();
        let options = RadauOptions {
            stages,
            tolerances: Tolerances::scalar(tol, tol),
            max_steps: Some(MAX_STEPS),
            index_scaling: match self.plain {
                true => IndexScaling::All,
                false => IndexScaling::default(),
            },
            ..RadauOptions::default()
        };
        let mut solver = RadauSolver::builder(case.sample.clone())
            .options(options)
            .build(start.t, &start.y, &start.y_dot)?;
        entry(&mut solver, case, tol)
    }
}

fn reference<S: Sample>(sample: S, t_end: f64) -> Result<Vec<f64>, Failure> {
    let start = sample.start();
    let options = RadauOptions {
        stages: 7,
        tolerances: Tolerances::scalar(REFERENCE, REFERENCE),
        ..RadauOptions::default()
    };
    let mut solver =
        RadauSolver::builder(sample)
            .options(options)
            .build(start.t, &start.y, &start.y_dot)?;
    match solver.integrate_to(t_end)? {
        Outcome::Reached { .. } => Ok(solver.y().to_vec()),
        other => Err(format!("no reference: {other:?}").into()),
    }
}

fn idas<S: Sample + Clone>(case: &Case<'_, S>, tol: f64) -> Result<String, Failure> {
    let (sample, start) = (&case.sample, case.sample.start());
    // As one uses BDF: without the multipliers in the error test, where there are some.
    let kinds = sample.kinds().unwrap_or_default();
    let indices = sample.indices().unwrap_or_default();
    let higher = kinds.contains(&VariableKind::Algebraic) && indices.iter().any(|&i| i > 1);
    let options = IdaOptions {
        tolerances: Tolerances::scalar(tol, tol),
        suppressed: match higher {
            true => Suppressed::Algebraic,
            false => Suppressed::Nothing,
        },
        max_steps: Some(MAX_STEPS),
        ..IdaOptions::default()
    };
    let mut solver = IdaSolver::builder(sample.clone()).options(options).build(
        start.t,
        &start.y,
        &start.y_dot,
    )?;
    entry(&mut solver, case, tol)
}

/// Runs to the end by way of the breaks.
fn entry<S: Sample, I: Integrator<S>>(
    solver: &mut I,
    case: &Case<'_, S>,
    tol: f64,
) -> Result<String, Failure> {
    let breaks = case.breaks.iter().copied();
    for t in breaks
        .filter(|t| *t > 0.0 && *t < case.t_end)
        .chain([case.t_end])
    {
        if let Outcome::Stopped(stop) = solver.integrate_to(t)? {
            return Ok(format!("– {:?} at {:.2e}", stop.reason, stop.t));
        }
    }
    let indices = case.sample.indices().unwrap_or_default();
    let errors = solver.y().iter().zip(&case.reference);
    let errors = errors.map(|(y, r)| (y - r).abs() / (1.0 + r.abs()));
    let mut worst = [0.0_f64; 3];
    for (error, &index) in errors.zip(&indices) {
        let of_index = &mut worst[usize::from(index.clamp(1, 3)) - 1];
        *of_index = if error.is_nan() {
            f64::INFINITY
        } else {
            of_index.max(error)
        };
    }
    let present = (0..3).filter(|k| indices.iter().any(|&i| usize::from(i.clamp(1, 3)) == k + 1));
    let digits: Vec<String> = present
        .map(|k| format!("{:.1}", -worst[k].log10()))
        .collect();
    let largest = worst.into_iter().fold(0.0, f64::max);
    let mark = if largest > 100.0 * tol { "!" } else { "" };
    let statistics = solver.statistics();
    let failed = statistics.error_test_failures + statistics.step_solve_failures;
    Ok(format!(
        "{}{mark} ({} + {failed})",
        digits.join(" "),
        statistics.steps
    ))
}
