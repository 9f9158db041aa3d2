//! What is likely wrong with a scene, each with what to change.

use crate::advice::{Advice, Finding, Remedy};
use crate::analysis::free_parts::FreeParts;
use crate::analysis::spectrum;
use crate::analysis::support::{extent, free_parts};
use crate::error::ModelError;
use crate::field::Field;
use crate::formulation::Formulation;
use crate::integration::settings::Settings;
use crate::muscle::Muscle;
use crate::operators::{divergence, rest};
use crate::start::BlockResidual;
use crate::statics::Equilibrium;

/// Modes looked at beside the drive.
const SLOW_MODES: usize = 3;
/// A drive this near to an eigenfrequency, as a fraction of it, is a resonance.
const RESONANCE: f64 = 0.1;
/// A load this many times faster than the slowest mode is felt next to where it acts only, in a body
/// many wavelengths long: far beyond what tissue is tried with, and what a mesh in mm looks like.
const FAR_ABOVE_MODES: f64 = 200.0;
/// A load this many times slower than the slowest mode moves nothing that a static analysis would
/// not: what moduli in a thousandth of their unit and a mesh in km look like.
const FAR_BELOW_MODES: f64 = 1e-5;
/// The frequency of a stretch is above the slowest mode's by this factor at most: slender bodies bend.
const ABOVE_SLOWEST: f64 = 100.0;
/// Periods of the load beyond which a run is taken for an error of typing: days at 1 ms each, which is less than
/// one takes.
const MOST_PERIODS: f64 = 1e8;
/// Lengths of the body that a load moves it by in a linear calculation, beyond which it is taken for one in other
/// units than the moduli: kPa and Pa differ by a thousand.
const FAR: f64 = 100.0;
/// A residual beyond this fraction of its terms is not rounding.
pub const INCONSISTENT: f64 = 1e-9;

/// The lowest eigenfrequencies at rest, Hz.
pub(super) fn slow_modes(muscle: &Muscle) -> Result<Vec<f64>, ModelError> {
    let lowest = spectrum::lowest(muscle, &Equilibrium::unloaded(muscle), SLOW_MODES)?;
    let frequencies = lowest.iter().filter_map(myovib_structure::Mode::frequency);
    Ok(frequencies.collect())
}

pub(super) fn not_held(free: FreeParts) -> Finding {
    Finding {
        fields: vec![Field::Displacement],
        problem: match free.count {
            1 => format!("1 motion without strain is left: {free}"),
            n => format!("{n} motions without strain are left: {free}"),
        },
        remedies: vec![Remedy::Scene(
            "hold more components or nodes, unless the body is meant to float",
        )],
    }
}

/// Pressures that no displacement holds, `nullity` of them where that is known.
pub(super) fn unheld(nullity: Option<usize>, muscle: &Muscle) -> Vec<Finding> {
    if !muscle.parameters.is_incompressible() {
        return Vec::new();
    }
    let level = has_no_level(muscle);
    let others = nullity.unwrap_or(0).saturating_sub(usize::from(level));
    let finding = |problem, remedy| Finding {
        fields: vec![Field::Pressure],
        problem,
        remedies: vec![Remedy::Scene(remedy)],
    };
    let of_level = level.then(|| {
        finding(
            "all of the boundary is held, so that no displacement changes the volume: with kappa = inf the \
             pressure is known but for a constant, and the one computed is as good as any other"
                .to_owned(),
            "take a finite kappa, or leave a part of the boundary free",
        )
    });
    let of_others = (others > 0).then(|| {
        let are = match (others, level) {
            (1, false) => "1 independent pressure is".to_owned(),
            (1, true) => "1 other independent pressure is".to_owned(),
            (_, false) => format!("{others} independent pressures are"),
            (_, true) => format!("{others} other independent pressures are"),
        };
        finding(
            format!("{are} held by no displacement: with kappa = inf the pencil is singular and there is no index"),
            "take a finite kappa, or a mesh without elements that have all nodes fixed",
        )
    });
    of_level.into_iter().chain(of_others).collect()
}

/// Whether a constant pressure does no work on any free displacement: ∫ div φ = 0.
fn has_no_level(muscle: &Muscle) -> bool {
    let solid = &muscle.solid;
    let Ok(divergence) = divergence(solid, &rest(solid)) else {
        return false;
    };
    let columns = divergence.col_iter();
    let columns = columns.map(|column| {
        column
            .values()
            .iter()
            .fold((0.0, 0.0_f64), |(sum, largest), b| {
                (sum + b, largest.max(b.abs()))
            })
    });
    let (net, largest) = columns.fold((0.0_f64, 0.0_f64), |(net, most), (sum, largest)| {
        (net.max(sum.abs()), most.max(largest))
    });
    net <= INCONSISTENT * largest
}

pub(super) fn inconsistent(residuals: &[BlockResidual]) -> Option<Finding> {
    let worst = residuals
        .iter()
        .find(|block| block.relative > INCONSISTENT)?;
    Some(Finding {
        fields: vec![worst.field],
        problem: format!("the start does not satisfy the equations at t = 0 ({worst})"),
        remedies: vec![Remedy::Scene(
            "let loads and prescribed motions start from zero, or start in equilibrium with them",
        )],
    })
}

pub(super) fn resonance(slow_modes: &[f64], drive: Option<f64>) -> Option<Finding> {
    let drive = drive?;
    let mode = slow_modes
        .iter()
        .find(|mode| (drive / **mode - 1.0).abs() < RESONANCE)?;
    Some(Finding {
        fields: Vec::new(),
        problem: format!("the load at {drive:.3} Hz is next to the eigenfrequency {mode:.3} Hz"),
        remedies: vec![Remedy::Scene(
            "expect large motions, bounded by damping alone, or change the frequency",
        )],
    })
}

/// What [`check`](super::check::check) warns of, as far as it can be told without work that counts beside a run's.
pub fn warnings(muscle: &Muscle, formulation: Formulation, settings: &Settings) -> Vec<Finding> {
    let mut findings = Advice::new(muscle, formulation, settings).findings();
    findings.extend(free_parts(muscle).map(not_held));
    findings.extend(unheld(None, muscle));
    findings.extend(strange_units(muscle, settings.t_end));
    findings
}

/// A [`misfit`] of a body whose modes are not known. They cost factorisations: they are looked for where
/// units seem not to go together. A body whose modes cannot be found says so when it is run.
pub(super) fn strange_units(muscle: &Muscle, t_end: f64) -> Option<Finding> {
    let stretching = spectrum::stretching_frequency(muscle).unwrap_or(f64::NAN);
    let ratio = asked(muscle, t_end).0 / stretching;
    let fits = (FAR_BELOW_MODES..FAR_ABOVE_MODES / ABOVE_SLOWEST).contains(&ratio);
    let slow_modes = (!fits).then(|| slow_modes(muscle).unwrap_or_default())?;
    misfit(muscle, &slow_modes, t_end)
}

/// What [`check_static`](super::check::check_static) warns of, as far as that is cheap and does not end the search.
pub fn static_warnings(muscle: &Muscle, formulation: Formulation) -> Vec<Finding> {
    match formulation.has(Field::Pressure) {
        true => unheld(None, muscle),
        false => Vec::new(),
    }
}

/// The frequency that a scene is about, Hz, and what it is.
fn asked(muscle: &Muscle, t_end: f64) -> (f64, &'static str) {
    match muscle.drive() {
        Some(drive) => (drive, "frequency of the load"),
        None => (1.0 / t_end, "inverse of the end time"),
    }
}

/// Units that do not go together show as a time of the scene far from the body's own.
pub(super) fn misfit(muscle: &Muscle, slow_modes: &[f64], t_end: f64) -> Option<Finding> {
    let slowest = slow_modes.iter().copied().find(|mode| *mode > 0.0)?;
    let (asked, what) = asked(muscle, t_end);
    let ratio = asked / slowest;
    (!(FAR_BELOW_MODES..FAR_ABOVE_MODES).contains(&ratio)).then(|| {
        let size = extent(muscle);
        Finding {
            fields: Vec::new(),
            problem: format!(
                "the {what}, {} Hz, is {ratio:.1e} times the lowest eigenfrequency of the body, {} Hz: it is \
                 {} m long, and waves cross it at about {} m/s",
                readable(asked),
                readable(slowest),
                readable(size),
                readable(2.0 * size * slowest)
            ),
            remedies: vec![Remedy::Scene(
                "take SI units throughout: coordinates in m (a mesh in mm times 1e-3), moduli in \
                 Pa, density in kg/m³, times in s",
            )],
        }
    })
}

/// Loads that do not go with the moduli, of a body `size` m long that they move by `displacement` m as by linear
/// elasticity.
pub(super) fn too_far(displacement: f64, size: f64) -> Option<Finding> {
    (displacement > FAR * size).then(|| Finding {
        fields: Vec::new(),
        problem: format!(
            "by linear elasticity the load moves the body by {} m, which is {} m long",
            readable(displacement),
            readable(size)
        ),
        remedies: vec![Remedy::Scene(
            "take SI units throughout: loads and moduli in Pa, coordinates in m; a body as slender as that needs \
             many load steps",
        )],
    })
}

/// As many digits as a person reads.
pub fn readable(value: f64) -> String {
    match value {
        1e-2..1e6 => format!("{value:.3}"),
        _ => format!("{value:.3e}"),
    }
}

pub(super) fn endless(drive: Option<f64>, t_end: f64) -> Option<Finding> {
    let periods = drive? * t_end;
    (periods > MOST_PERIODS).then(|| Finding {
        fields: Vec::new(),
        problem: format!("the load goes through {periods:.0e} periods, of several steps each"),
        remedies: vec![Remedy::Scene(
            "look at the end time and the frequencies, which are in s and Hz",
        )],
    })
}
