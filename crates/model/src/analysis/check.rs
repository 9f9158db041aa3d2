//! What can be said of a run before it is tried: sizes, index, stability, modes, cost.

use std::f64::consts::TAU;
use std::time::Duration;

use myovib_dae::Problem;
use myovib_sparse::{Prediction, resources};

use crate::advice::{Advice, Finding};
use crate::analysis::index::{IndexReport, LARGEST_SYSTEM};
use crate::analysis::inf_sup;
pub use crate::analysis::objections::{INCONSISTENT, static_warnings, warnings};
use crate::analysis::objections::{
    endless, inconsistent, misfit, not_held, resonance, slow_modes, unheld,
};
use crate::analysis::spectrum;
use crate::analysis::support::free_parts;
use crate::analysis::table1::{Case, coarse_beam, coarse_block};
use crate::cpu::CpuClock;
use crate::error::ModelError;
use crate::field::Field;
use crate::formulation::Formulation;
use crate::integration::integrator::Advance;
use crate::integration::launch::start_from;
use crate::integration::settings::{LinearSolver, Settings};
use crate::linear::Reduction;
use crate::muscle::Muscle;
use crate::muscle_dae::MuscleDae;
use crate::start::{BlockResidual, residuals};
use crate::statics;

/// Error of a step of order k: this times (ω h)^(k+1), from the steps of the runs of Table 2.
const ERROR_CONSTANT: f64 = 1.0 / 5.8;
/// Pressures beyond which the inf–sup constant would take longer than the rest of the check.
const MOST_PRESSURES: usize = 2000;
/// Steps in which the step size grows to that of the run, each with a factorisation of its own.
const START_STEPS: usize = 15;
/// Steps after these whose time is taken.
const TIMED_STEPS: usize = 15;
/// How long each may take; a large body is timed by fewer steps.
const START_PATIENCE: Duration = Duration::from_secs(1);
const PATIENCE: Duration = Duration::from_millis(300);

/// Where the computed index comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Computed {
    /// The scene's own matrices.
    Here,
    /// The same formulation, law and parameters on a coarse beam.
    OnCoarseBeam,
}

/// The expected cost of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Steps, to about a factor of two for a run that follows its drive.
    pub steps: f64,
    /// CPU time of a step, measured on the first steps of the run, s; NaN if it does not get that
    /// far.
    pub seconds_per_step: f64,
}

/// What the factors of the Newton matrices will take, known before there are any.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factors {
    /// Matrices that are kept side by side: one for BDF and for an equilibrium, one and complex ones for
    /// Radau IIA.
    pub matrices: usize,
    /// Their entries, the work of one set-up, and the memory for all of it.
    pub needs: Prediction,
    /// Memory in use before they are computed, B, where the system tells.
    pub in_use: Option<usize>,
}

/// How well displacements hold the pressures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// The smallest inf–sup constant.
    pub inf_sup: f64,
    /// Pressures that no displacement holds.
    pub nullity: usize,
}

/// What is found before a run.
#[derive(Debug, Clone)]
pub struct Report {
    /// The blocks of unknowns with their sizes.
    pub unknowns: Vec<(Field, usize)>,
    /// Index and indices by the rule of the formulation, and what to say of the settings.
    pub advice: Advice,
    /// The index by computation.
    pub computed: IndexReport,
    /// On what it was computed.
    pub computed_on: Computed,
    /// How well the pressures are held; nothing where there are too many to tell in seconds.
    pub held: Option<Held>,
    /// The residual of the start.
    pub residuals: Vec<BlockResidual>,
    /// The lowest eigenfrequencies at rest, Hz.
    pub slow_modes: Vec<f64>,
    /// The highest, Hz.
    pub fastest_mode: f64,
    /// The frequency of the load, Hz.
    pub drive: Option<f64>,
    /// What the factors will take; unknown where the full matrix, or an engine, is factorised.
    pub factors: Option<Factors>,
    /// The expected cost.
    pub cost: Cost,
    /// What is expected to fail, and what to change.
    pub findings: Vec<Finding>,
}

/// Looks at the run of a muscle that starts at t = 0 with y and ẏ in `start` (at rest without it).
///
/// # Errors
/// [`ModelError::NotAllowed`] for a formulation that cannot be run; those of the single questions.
pub fn check(
    muscle: &Muscle,
    formulation: Formulation,
    settings: &Settings,
    start: Option<[Vec<f64>; 2]>,
) -> Result<Report, ModelError> {
    let dae = MuscleDae::new(muscle.clone(), formulation)?;
    let factors = factors(&dae, settings)?;
    let advice = Advice::new(muscle, formulation, settings);
    let [y, y_dot] = start.unwrap_or_else(|| [(); 2].map(|()| vec![0.0; dae.n_unknowns()]));
    // Prony terms change neither the index nor what a body at rest misses. Their internal stresses
    // are the last unknowns.
    let mut relaxed = MuscleDae::new(muscle.relaxed(), formulation)?;
    let n = relaxed.n_unknowns();
    let residuals = residuals(&mut relaxed, 0.0, &y[..n], &y_dot[..n])?;
    let (computed, computed_on) = index(&mut relaxed)?;
    let held = held(muscle)?;
    let nullity = held.map_or(0, |held| held.nullity);
    let (slow_modes, fastest_mode) = if nullity == 0 {
        modes(muscle)?
    } else {
        (Vec::new(), f64::NAN)
    };
    let drive = muscle.drive();
    let mut findings = advice.findings();
    findings.extend(free_parts(muscle).map(not_held));
    findings.extend(unheld(held.map(|held| held.nullity), muscle));
    findings.extend(inconsistent(&residuals));
    findings.extend(resonance(&slow_modes, drive));
    findings.extend(misfit(muscle, &slow_modes, settings.t_end));
    let blocks = dae.layout().blocks().iter();
    let unknowns = blocks.map(|(f, r)| (*f, r.len())).collect();
    let cost = cost(
        dae,
        &advice,
        settings,
        drive.or(slow_modes.first().copied()),
        [&y, &y_dot],
    )?;
    findings.extend(endless(cost.steps));
    Ok(Report {
        unknowns,
        factors,
        cost,
        held,
        advice,
        computed,
        computed_on,
        residuals,
        slow_modes,
        fastest_mode,
        drive,
        findings,
    })
}

/// What is found before an equilibrium is looked for.
#[derive(Debug, Clone)]
pub struct StaticReport {
    /// The blocks of unknowns with their sizes.
    pub unknowns: Vec<(Field, usize)>,
    /// How well the pressures are held; nothing where there are none, or too many to tell in seconds.
    pub held: Option<Held>,
    /// What the factors of Newton's matrix will take, where that is known.
    pub factors: Option<Factors>,
    /// What is expected to fail, and what to change.
    pub findings: Vec<Finding>,
}

/// Looks at the equilibrium of a muscle.
///
/// # Errors
/// Those of [`equilibrium`](crate::statics::equilibrium) that do not depend on the loads.
pub fn check_static(muscle: &Muscle, formulation: Formulation) -> Result<StaticReport, ModelError> {
    let in_use = resources::in_use();
    let (layout, needs) = statics::size(muscle, formulation)?;
    let blocks = layout.blocks().iter();
    let held = match formulation.has(Field::Pressure) {
        true => held(muscle)?,
        false => None,
    };
    let mut findings: Vec<Finding> = free_parts(muscle).map(not_held).into_iter().collect();
    if formulation.has(Field::Pressure) {
        findings.extend(unheld(held.map(|held| held.nullity), muscle));
    }
    Ok(StaticReport {
        unknowns: blocks.map(|(f, range)| (*f, range.len())).collect(),
        held,
        factors: needs.map(|needs| Factors {
            matrices: 1,
            needs,
            in_use,
        }),
        findings,
    })
}

/// What the condensed matrices will take.
fn factors(dae: &MuscleDae, settings: &Settings) -> Result<Option<Factors>, ModelError> {
    if settings.linear_solver != LinearSolver::Condensed {
        return Ok(None);
    }
    // Stages in pairs have a complex matrix for each pair beside the real one of the odd stage.
    let complex = settings.integrator.stages().unwrap_or(1) / 2;
    let in_use = resources::in_use();
    let needs = Reduction::new(dae, settings.klu())?.needs(complex);
    if let Some(needs) = needs {
        resources::expect_room(needs.bytes, complex)?;
    }
    Ok(needs.map(|needs| Factors {
        matrices: 1 + complex,
        needs,
        in_use,
    }))
}

/// The inf–sup constant, where the mesh is not too fine.
fn held(muscle: &Muscle) -> Result<Option<Held>, ModelError> {
    if muscle.solid.space().n_pressures() > MOST_PRESSURES {
        return Ok(None);
    }
    let found = inf_sup::constants(&muscle.solid)?;
    Ok(Some(Held {
        inf_sup: found.smallest().unwrap_or(0.0),
        nullity: found.nullity(),
    }))
}

/// The index of the scene itself where it is small enough, else on a coarse beam: the index does
/// not depend on the mesh as long as B has full rank.
fn index(dae: &mut MuscleDae) -> Result<(IndexReport, Computed), ModelError> {
    if dae.n_unknowns() <= LARGEST_SYSTEM {
        let rest = vec![0.0; dae.n_unknowns()];
        return Ok((IndexReport::at(dae, 0.0, &rest, &rest)?, Computed::Here));
    }
    let muscle = dae.muscle();
    let case = Case {
        equation: None,
        law: muscle.solid.laws()[0],
        formulation: dae.formulation(),
        kappa: muscle.parameters.kappa(),
        beta: muscle.parameters.beta,
        printed: None,
    };
    let mesh = match muscle.solid.space().dimension() {
        2 => coarse_beam(3)?,
        _ => coarse_block()?,
    };
    Ok((case.at_random_state(&mesh, 1)?, Computed::OnCoarseBeam))
}

fn modes(muscle: &Muscle) -> Result<(Vec<f64>, f64), ModelError> {
    Ok((slow_modes(muscle)?, spectrum::fastest(muscle)? / TAU))
}

/// Steps that follow a sine of frequency `f` to the tolerance, times the measured time of a step.
fn cost(
    dae: MuscleDae,
    advice: &Advice,
    settings: &Settings,
    f: Option<f64>,
    start: [&[f64]; 2],
) -> Result<Cost, ModelError> {
    let bdf = || settings.max_order.min(advice.max_order());
    let order = settings.integrator.order().unwrap_or_else(bdf);
    let angle = (settings.relative_tolerance / ERROR_CONSTANT).powf(1.0 / f64::from(order + 1));
    Ok(Cost {
        steps: f.map_or(f64::NAN, |f| settings.t_end * f * TAU / angle),
        seconds_per_step: seconds_per_step(dae, settings, start)?,
    })
}

/// CPU time of a step of the run, s; NaN if it does not get beyond its start.
fn seconds_per_step(
    dae: MuscleDae,
    settings: &Settings,
    [y, y_dot]: [&[f64]; 2],
) -> Result<f64, ModelError> {
    let mut integrator = start_from(dae, settings, 0.0, y, y_dot)?;
    let started = CpuClock::start();
    let mut after = |steps: usize, patience: Duration| -> Result<(f64, f64), ModelError> {
        let begun = started.elapsed();
        for _ in 0..steps {
            if integrator.advance()? != Advance::Stepped || started.elapsed() > begun + patience {
                break;
            }
        }
        Ok((
            started.elapsed().as_secs_f64(),
            integrator.counts().steps as f64,
        ))
    };
    let (start_seconds, start_steps) = after(START_STEPS, START_PATIENCE)?;
    let (seconds, steps) = after(TIMED_STEPS, PATIENCE)?;
    Ok(if steps > start_steps {
        (seconds - start_seconds) / (steps - start_steps)
    } else if steps > 0.0 {
        seconds / steps
    } else {
        f64::NAN
    })
}
