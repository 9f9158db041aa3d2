//! Likely mistakes in a scene, each with a suggested change.

use crate::advice::{Advice, Finding, Remedy};
use crate::analysis::dependent::has_no_level;
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

/// Number of modes compared with the load frequency.
const SLOW_MODES: usize = 3;
/// Relative distance between load frequency and eigenfrequency below which the load counts as resonant.
const RESONANCE: f64 = 0.1;
/// Ratio of the load frequency to the lowest eigenfrequency above which a load moves only the vicinity of the loaded
/// surface, because the body is many wavelengths long. Practical tests of tissue stay below this ratio; larger ratios
/// suggest a mesh in mm.
const FAR_ABOVE_MODES: f64 = 200.0;
/// Ratio of the load frequency to the lowest eigenfrequency below which a scene is unusual, because inertia has no
/// effect. Such ratios suggest moduli wrong by a factor of 1000, or a mesh in km.
const FAR_BELOW_MODES: f64 = 1e-5;
/// Assumed maximum ratio of the frequency of a stretching mode to the lowest eigenfrequency. The ratio is large for
/// slender bodies because they bend.
const ABOVE_SLOWEST: f64 = 100.0;
/// Number of load periods above which the scene is assumed to contain a typing error. Even at only 1 ms per period,
/// which is less than in practice, the run would take more than a day.
const MAX_PERIODS: f64 = 1e8;
/// Ratio of the linear displacement to the length of the body above which the load and the moduli are assumed to be in
/// different units, such as kPa and Pa.
const FAR: f64 = 100.0;
/// Residual, relative to the magnitude of its terms, above which rounding errors cannot be the cause.
pub const INCONSISTENT: f64 = 1e-9;

/// Returns the lowest eigenfrequencies at rest, Hz.
pub(super) fn slow_modes(muscle: &Muscle) -> Result<Vec<f64>, ModelError> {
    let lowest = spectrum::lowest(muscle, &Equilibrium::unloaded(muscle), SLOW_MODES)?;
    let frequencies = lowest.iter().filter_map(myovib_structure::Mode::frequency);
    Ok(frequencies.collect())
}

pub(super) fn not_held(free: FreeParts) -> Finding {
    Finding {
        fields: vec![Field::Displacement],
        problem: match free.count {
            1 => format!("1 rigid motion is not constrained: {free}"),
            n => format!("{n} rigid motions are not constrained: {free}"),
        },
        remedies: vec![Remedy::Scene(
            "fix more components or nodes, unless the body is meant to float",
        )],
    }
}

/// Returns findings for pressure modes of an incompressible body that no displacement controls. `nullity` is the
/// number of these modes, if known.
pub(super) fn unheld(nullity: Option<usize>, muscle: &Muscle) -> Vec<Finding> {
    if !muscle.parameters.is_incompressible() {
        return Vec::new();
    }
    let solid = &muscle.solid;
    let level = divergence(solid, &rest(solid)).is_ok_and(|b| has_no_level(&b));
    let others = nullity.unwrap_or(0).saturating_sub(usize::from(level));
    let finding = |problem, remedy| Finding {
        fields: vec![Field::Pressure],
        problem,
        remedies: vec![Remedy::Scene(remedy)],
    };
    let of_level = level.then(|| {
        finding(
            "the whole boundary is fixed, so no displacement changes the volume: with κ = inf the pressure is determined only up to a constant, and the computed constant is arbitrary"
                .to_owned(),
            "use a finite κ, or do not fix the whole boundary",
        )
    });
    let of_others = (others > 0).then(|| {
        let are = match (others, level) {
            (1, false) => "1 independent pressure mode is".to_owned(),
            (1, true) => "1 other independent pressure mode is".to_owned(),
            (_, false) => format!("{others} independent pressure modes are"),
            (_, true) => format!("{others} other independent pressure modes are"),
        };
        finding(
            format!("{are} not controlled by any displacement: with κ = inf the pencil is singular and the index is undefined"),
            "use a finite κ, or a mesh without elements that have all nodes fixed",
        )
    });
    of_level.into_iter().chain(of_others).collect()
}

pub(super) fn inconsistent(residuals: &[BlockResidual]) -> Option<Finding> {
    let worst = residuals.iter().find(|block| block.relative > INCONSISTENT)?;
    Some(Finding {
        fields: vec![worst.field],
        problem: format!("the initial state does not satisfy the equations at t = 0 ({worst})"),
        remedies: vec![Remedy::Scene(
            "ramp loads and prescribed motions up from zero, or start from an equilibrium",
        )],
    })
}

pub(super) fn resonance(slow_modes: &[f64], drive: Option<f64>) -> Option<Finding> {
    let drive = drive?;
    let mode = slow_modes.iter().find(|mode| (drive / **mode - 1.0).abs() < RESONANCE)?;
    Some(Finding {
        fields: Vec::new(),
        problem: format!(
            "the load at {drive:.3} Hz is close to the eigenfrequency of {mode:.3} Hz"
        ),
        remedies: vec![Remedy::Scene(
            "expect large motions limited only by damping, or change the frequency",
        )],
    })
}

/// Returns those warnings of [`check`](super::check::check) that are cheap to compute compared with a run.
pub fn warnings(muscle: &Muscle, formulation: Formulation, settings: &Settings) -> Vec<Finding> {
    let mut findings = Advice::new(muscle, formulation, settings).findings();
    findings.extend(free_parts(muscle).map(not_held));
    findings.extend(unheld(None, muscle));
    findings.extend(strange_units(muscle, settings.t_end));
    findings
}

/// Returns the [`misfit`] of a body whose modes are unknown. Computing modes requires factorizations, so they are
/// computed only if the units seem inconsistent. If the modes cannot be computed, the run reports the problem.
pub(super) fn strange_units(muscle: &Muscle, t_end: f64) -> Option<Finding> {
    let stretching = spectrum::stretching_frequency(muscle).unwrap_or(f64::NAN);
    let ratio = requested(muscle, t_end).0 / stretching;
    let fits = (FAR_BELOW_MODES..FAR_ABOVE_MODES / ABOVE_SLOWEST).contains(&ratio);
    let slow_modes = (!fits).then(|| slow_modes(muscle).unwrap_or_default())?;
    misfit(muscle, &slow_modes, t_end)
}

/// Returns the cheap warnings of [`check_static`](super::check::check_static) that do not prevent
/// the analysis.
pub fn static_warnings(muscle: &Muscle, formulation: Formulation) -> Vec<Finding> {
    match formulation.has(Field::Pressure) {
        true => unheld(None, muscle),
        false => Vec::new(),
    }
}

/// Returns the characteristic frequency (Hz) of a scene and its description.
fn requested(muscle: &Muscle, t_end: f64) -> (f64, &'static str) {
    match muscle.forcing_frequency() {
        Some(drive) => (drive, "frequency of the load"),
        None => (1.0 / t_end, "inverse of the end time"),
    }
}

/// Detects inconsistent units: the time scale of the scene is far from the time scale of the body.
pub(super) fn misfit(muscle: &Muscle, slow_modes: &[f64], t_end: f64) -> Option<Finding> {
    let slowest = slow_modes.iter().copied().find(|mode| *mode > 0.0)?;
    let (requested, what) = requested(muscle, t_end);
    let ratio = requested / slowest;
    (!(FAR_BELOW_MODES..FAR_ABOVE_MODES).contains(&ratio)).then(|| {
        let size = extent(muscle);
        Finding {
            fields: Vec::new(),
            problem: format!(
                "the {what}, {} Hz, is {ratio:.1e} times the lowest eigenfrequency of the body, {} Hz; the body is {} \
                 m long, and waves cross it at about {} m/s",
                readable(requested),
                readable(slowest),
                readable(size),
                readable(2.0 * size * slowest)
            ),
            remedies: vec![Remedy::Scene(
                "use SI units throughout: coordinates in m (a mesh in mm times 1e-3), moduli in \
                 Pa, density in kg/m³, times in s",
            )],
        }
    })
}

/// Detects loads that are inconsistent with the moduli. `displacement` (m) is the prediction of linear elasticity for
/// a body of length `size` (m).
pub(super) fn too_far(displacement: f64, size: f64) -> Option<Finding> {
    (displacement > FAR * size).then(|| Finding {
        fields: Vec::new(),
        problem: format!(
            "according to linear elasticity, the load moves the body by {} m, but the body is {} m long",
            readable(displacement),
            readable(size)
        ),
        remedies: vec![Remedy::Scene(
            "use SI units throughout: loads and moduli in Pa, coordinates in m; a body this flexible needs many load \
             steps",
        )],
    })
}

/// Formats a value with three decimals. Very small or large values are printed in scientific notation.
pub fn readable(value: f64) -> String {
    match value {
        1e-2..1e6 => format!("{value:.3}"),
        _ => format!("{value:.3e}"),
    }
}

pub(super) fn endless(drive: Option<f64>, t_end: f64) -> Option<Finding> {
    let periods = drive? * t_end;
    (periods > MAX_PERIODS).then(|| Finding {
        fields: Vec::new(),
        problem: format!(
            "the run covers {periods:.0e} periods of the load with several steps each"
        ),
        remedies: vec![Remedy::Scene("check the end time (s) and the frequencies (Hz)")],
    })
}
