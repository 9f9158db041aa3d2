//! Lowest eigenfrequencies and modes of bodies, to be written as a JSON document.

use myovib_model::statics::Equilibrium;
use myovib_model::{Contact, Formulation, ModelError, Muscle, spectrum, support};
use num_complex::Complex64;
use serde::Serialize;

use crate::response::equilibrium;
use crate::response::notes::displacement_and_strain;
use crate::scene_file::{Analysis, DEFAULT_MODES};
use crate::watch::Watcher;
use crate::{Body, InputError, Scene, json};

/// Modes of bodies that differ only in κ, and the state about which the modes are computed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Modes {
    /// Constant traction (Pa) in the state about which the equations are linearized.
    pub load: f64,
    /// Time (s) at which the loads of the equilibrium are evaluated; null for the unloaded body.
    pub preload_time: Option<f64>,
    /// Mass-proportional damping α (1/s).
    pub alpha: f64,
    /// Stiffness-proportional damping β (s).
    pub beta: f64,
    /// Frequency of the load (Hz); null if the loads have no frequency.
    pub drive: Option<f64>,
    pub muscles: Vec<BodyModes>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BodyModes {
    /// Bulk modulus (Pa).
    #[serde(serialize_with = "json::kappa")]
    pub kappa: f64,
    /// Mass (kg; kg/m in 2D).
    pub mass: f64,
    /// Modes in ascending order of ω².
    pub modes: Vec<Mode>,
    /// Notes on supports and stability.
    #[serde(skip)]
    pub notes: Vec<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mode {
    /// ω² (1/s²); negative if the state is unstable.
    pub omega_squared: f64,
    /// Frequency (Hz); null if ω² is negative.
    pub frequency: Option<f64>,
    /// Damping ratio due to α, β, Kelvin–Voigt damping and foundations, excluding Prony terms. The value 1 means
    /// critical damping; null means that the mode does not oscillate.
    pub damping_ratio: Option<f64>,
    /// Residual of K u - Bᵀp = ω² M u, relative to the terms of this equation.
    pub residual: f64,
    /// Participation factors φᵀ M r for unit translations r along the axes (√kg; √(kg/m) in 2D).
    pub participation: Vec<f64>,
    /// Squares of the participation factors (kg; kg/m in 2D).
    pub effective_mass: Vec<f64>,
    /// Displacements φ of all nodes, normalized so that φᵀ M φ = 1. The components of each node are adjacent.
    #[serde(skip)]
    pub shape: Vec<f64>,
}

impl BodyModes {
    /// Computes the `count` lowest modes about an equilibrium. The formulation must contain pressures.
    ///
    /// # Errors
    /// Returns the errors of [`spectrum::lowest`].
    pub fn about(muscle: &Muscle, at: &Equilibrium, count: usize) -> Result<Self, ModelError> {
        Self::new(muscle, at, spectrum::lowest(muscle, at, count)?)
    }

    /// Adds damping ratios, participation factors and notes to modes about an equilibrium.
    ///
    /// # Errors
    /// Returns [`ModelError::Inverted`] if an element is inverted, because its stress is undefined.
    pub(crate) fn new(
        muscle: &Muscle,
        at: &Equilibrium,
        found: Vec<spectrum::Mode>,
    ) -> Result<Self, ModelError> {
        let solid = &muscle.solid;
        let modes = found.into_iter().map(|mode| {
            let participation = spectrum::participation(muscle, &mode);
            let mut shape = vec![0.0; solid.dofs().n_full()];
            solid.dofs().expand(&mode.shape, &mut shape);
            Ok(Mode {
                omega_squared: mode.omega_squared,
                frequency: mode.frequency(),
                damping_ratio: spectrum::damping_ratio(muscle, at, &mode)?,
                residual: mode.residual,
                effective_mass: participation.iter().map(|factor| factor * factor).collect(),
                participation,
                shape,
            })
        });
        let modes: Vec<Mode> = modes.collect::<Result<_, ModelError>>()?;
        Ok(Self {
            kappa: muscle.parameters.kappa(),
            mass: spectrum::mass(muscle),
            notes: not_held(muscle)
                .into_iter()
                .chain(at.instabilities.and_then(instability))
                .chain(one_sided(muscle, at))
                .chain(negative_damping(&modes))
                .chain(inaccurate(&modes))
                .collect(),
            modes,
        })
    }
}

impl Modes {
    pub fn all(&self) -> impl Iterator<Item = &Mode> {
        self.muscles.iter().flat_map(|body| &body.modes)
    }

    /// Computes the modes of the body of a scene, about the state of rest or about the equilibrium given in the scene.
    /// If `count` is `None`, the number of modes is taken from the scene. The `watcher` observes the search for the
    /// equilibrium.
    ///
    /// # Errors
    /// Fails if the scene has no body or is quasi-static. Also fails if an equilibrium is requested but an activation
    /// model determines the tensions (which start from zero), a force drives an obstacle, or elements are inverted.
    /// Also returns the errors of the search for the equilibrium and of [`BodyModes::about`].
    pub fn of_scene(
        scene: &Scene,
        count: Option<usize>,
        watcher: Watcher<'_>,
    ) -> Result<Self, crate::Error> {
        let muscle = body_of(scene).map(|body| &body.muscle)?;
        if scene.file.analysis == Analysis::QuasiStatic {
            let error =
                InputError::new("a quasi-static analysis has no inertia and therefore no modes");
            let error = error.next("use analysis = \"modes\"");
            return Err(scene.wrong("analysis", error).into());
        }
        let requested = scene.file.modes.as_ref();
        let preload_time = requested.and_then(|modes| modes.preload_time);
        let key = "modes.preload_time";
        if preload_time.is_some() && muscle.contacts.iter().any(Contact::is_driven) {
            let error = InputError::new(
                "modes about a preloaded equilibrium do not support obstacles driven by a force",
            );
            let error = error.next("give the displacement of the obstacle instead of its force");
            return Err(scene.wrong(key, error).into());
        }
        let (at, volume_note) =
            equilibrium(scene, muscle, Formulation::Position, (key, preload_time), watcher)?;
        let count = count.or(requested.map(|modes| modes.count));
        let count = count.unwrap_or(DEFAULT_MODES);
        let mut modes = BodyModes::about(muscle, &at, count)?;
        modes.notes.extend(volume_note);
        modes.notes.extend(oscillating_preload(muscle, preload_time));
        let is_active = scene.file.material.iter().any(|own| own.active.is_some());
        if preload_time.is_none() && is_active && muscle.models().next().is_none() {
            let note = "the modes apply to the body at rest, without active tension; \
                        `modes.preload_time` selects an equilibrium under tension";
            modes.notes.push(note.to_owned());
        }
        if let Some(chain) = scene.chain_that_acts() {
            modes
                .notes
                .push(format!("the modes exclude the chain `{chain}`, which acts on the body"));
        }
        Ok(Self {
            load: 0.0,
            preload_time,
            alpha: muscle.parameters.alpha,
            beta: muscle.parameters.beta,
            drive: muscle.forcing_frequency(),
            muscles: vec![modes],
        })
    }
}

pub fn body_of(scene: &Scene) -> Result<&Body, InputError> {
    scene.body.as_ref().ok_or_else(|| {
        InputError::new("the scene has no body, so there are no modes to compute")
            .allowed("a scene with a [mesh] and [solid]")
    })
}

/// Returns a note if the supports allow rigid motions of the body.
fn not_held(muscle: &Muscle) -> Option<String> {
    let free = support::free_parts(muscle)?;
    let s = if free.count == 1 { "" } else { "s" };
    Some(format!("{} rigid motion{s} at 0 Hz: {free}", free.count))
}

/// Returns a note if a material law has a one-sided tangent at rest and the strain of the body is at most as large as
/// in a vibration.
pub(crate) fn one_sided(muscle: &Muscle, at: &Equilibrium) -> Option<String> {
    let law = muscle.solid.laws().iter().find(|law| law.is_one_sided_at_rest())?;
    let mut u = vec![0.0; muscle.solid.dofs().n_full()];
    muscle.solid.dofs().expand(&at.displacement, &mut u);
    let u: Vec<Complex64> = u.into_iter().map(Complex64::from).collect();
    let [_, strain] = displacement_and_strain(muscle.solid.space(), &u);
    (strain < VIBRATION).then(|| {
        format!(
            "the fibers of `{}` only resist tension. These modes treat all fibers as stretched, but in a real motion \
             each fiber is slack part of the time, so the real frequencies are different: stretch the fibers by a \
             preload (`preload_time`), or compute the motion (`myovib run`)",
            law.description().name
        )
    })
}

/// Strain below which a body counts as being at rest. Vibrations in practice have larger strains.
const VIBRATION: f64 = 1e-4;

/// Returns a note if the preload includes an oscillating load.
pub(crate) fn oscillating_preload(muscle: &Muscle, preload_time: Option<f64>) -> Option<String> {
    let (t, frequency) = (preload_time?, muscle.forcing_frequency()?);
    Some(format!(
        "the preload includes oscillating loads, such as one at {frequency} Hz, at their values at t = {t} s"
    ))
}

/// Reason why damping may increase the energy, and a remedy.
pub(crate) const ENERGY_GAIN: &str = "`rayleigh_stiffness` multiplies the rate of all stresses, which does not always dissipate \
    energy in a stressed body; use `viscosity` instead";

/// Negative damping ratios above this value are attributed to rounding errors.
const NEGATIVE: f64 = -1e-9;

/// Returns a note if damping makes some of the modes grow.
pub(crate) fn negative_damping(modes: &[Mode]) -> Option<String> {
    let ratios = modes.iter().map(|mode| mode.damping_ratio.unwrap_or(0.0));
    let (k, ratio) = ratios.enumerate().min_by(|(_, left), (_, right)| left.total_cmp(right))?;
    (ratio < NEGATIVE).then(|| {
        format!("mode {} has damping ratio {ratio:.1e}: its vibrations grow; {ENERGY_GAIN}", k + 1)
    })
}

/// Maximum residual for which no note is returned. It corresponds to the last digit of a frequency with five digits.
/// Modes of the built-in scenes have residuals of at most 2e-8.
const MOST_RESIDUAL: f64 = 1e-5;

/// Returns a note if the residual of a mode is large.
fn inaccurate(modes: &[Mode]) -> Option<String> {
    let residuals = modes.iter().map(|mode| mode.residual).enumerate();
    let (k, residual) = residuals.max_by(|(_, left), (_, right)| left.total_cmp(right))?;
    (residual.is_nan() || residual > MOST_RESIDUAL).then(|| {
        format!(
            "mode {} has relative residual {residual:.1e}: its frequency may be inaccurate; check units and mesh for \
             very different stiffnesses or very small elements",
            k + 1
        )
    })
}

/// Returns a note if the equilibrium is unstable in some directions. Newton's method may converge to such a state; an
/// example is a straight column above its buckling load.
pub(crate) fn instability(directions: usize) -> Option<String> {
    let motions = match directions {
        0 => return None,
        1 => "small perturbations grow in 1 direction".to_owned(),
        n => format!("small perturbations grow in {n} independent directions"),
    };
    Some(format!(
        "the equilibrium is not stable: {motions}; compute a damped motion to reach a stable equilibrium"
    ))
}

#[cfg(test)]
mod tests {
    use super::{MOST_RESIDUAL, Mode, inaccurate};

    #[test]
    fn a_mode_with_a_large_residual_is_noted() {
        let mode = |residual: f64| Mode {
            omega_squared: 1.0,
            frequency: None,
            damping_ratio: None,
            residual,
            participation: Vec::new(),
            effective_mass: Vec::new(),
            shape: Vec::new(),
        };
        for (residual, is_noted) in
            [(0.5 * MOST_RESIDUAL, false), (2.0 * MOST_RESIDUAL, true), (f64::NAN, true)]
        {
            let note = inaccurate(&[mode(1e-9), mode(residual), mode(1e-8)]);
            assert_eq!(note.is_some(), is_noted, "{residual:e}");
        }
    }
}
