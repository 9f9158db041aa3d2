//! The lowest eigenfrequencies and modes of bodies, as documents have them.

use myovib_model::statics::{self, Equilibrium};
use myovib_model::{Formulation, ModelError, Muscle, spectrum, support};
use serde::Serialize;

use crate::watch::{Watcher, search};
use crate::{Body, InputError, Scene, json};

/// Modes where nothing says how many.
pub const DEFAULT_COUNT: usize = 10;

/// The modes of bodies that differ in κ alone, and about which state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Modes {
    /// Constant traction of the state linearised about, Pa.
    pub load: f64,
    /// The time of the loads of the equilibrium that they are about, s; null about rest, without loads.
    pub loads_at: Option<f64>,
    /// Mass-proportional damping α, 1/s.
    pub alpha: f64,
    /// Stiffness-proportional damping β, s.
    pub beta: f64,
    /// The frequency of the load, Hz; null for loads without one.
    pub drive: Option<f64>,
    /// The bodies.
    pub muscles: Vec<BodyModes>,
}

/// The modes of one body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BodyModes {
    /// Bulk modulus, Pa.
    #[serde(serialize_with = "json::kappa")]
    pub kappa: f64,
    /// The modes, the lowest first.
    pub modes: Vec<Mode>,
    /// What to say of supports and stability.
    #[serde(skip)]
    pub notes: Vec<String>,
}

/// A mode with its damping.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mode {
    /// ω², 1/s²; negative where the state is unstable.
    pub omega_squared: f64,
    /// Hz; null where the state is unstable.
    pub frequency: Option<f64>,
    /// By α, β, Kelvin–Voigt damping and beds, not by Prony terms; 1 is critical, null where the motion is no
    /// oscillation.
    pub damping_ratio: Option<f64>,
    /// What is missed of K u - Bᵀp = ω² M u, in parts of its terms.
    pub residual: f64,
    /// The displacements of the free components, of any size.
    #[serde(skip)]
    pub shape: Vec<f64>,
}

impl BodyModes {
    /// The `count` lowest about an equilibrium of a formulation with pressures.
    ///
    /// # Errors
    /// Those of [`spectrum::lowest`].
    pub fn about(muscle: &Muscle, at: &Equilibrium, count: usize) -> Result<Self, ModelError> {
        let found = spectrum::lowest(muscle, at, count)?.into_iter();
        let modes = found.map(|mode| {
            Ok(Mode {
                omega_squared: mode.omega_squared,
                frequency: mode.frequency(),
                damping_ratio: spectrum::damping_ratio(muscle, at, &mode)?,
                residual: mode.residual,
                shape: mode.shape,
            })
        });
        Ok(Self {
            kappa: muscle.parameters.kappa(),
            modes: modes.collect::<Result<_, ModelError>>()?,
            notes: not_held(muscle)
                .into_iter()
                .chain(instability(at))
                .collect(),
        })
    }
}

impl Modes {
    /// Those of the scene's body: `count`, else as many as the scene says, about rest or the equilibrium that it says;
    /// the `watcher` hears of the search for that.
    ///
    /// # Errors
    /// A scene without a body; an equilibrium under tensions that follow a model, which start from zero; those of
    /// [`equilibrium`](statics::equilibrium) and of [`BodyModes::about`].
    pub fn of_scene(
        scene: &Scene,
        count: Option<usize>,
        watcher: Watcher<'_>,
    ) -> Result<Self, crate::Error> {
        let muscle = body_of(scene).map(|body| &body.muscle)?;
        let asked = scene.file.modes.as_ref();
        let loads_at = asked.and_then(|modes| modes.loads_at);
        let at = match loads_at {
            None => Equilibrium::unloaded(muscle),
            Some(_) if muscle.models().next().is_some() => {
                let error = InputError::new("Bestel's tension is that of a motion: it starts at 0");
                let error = error.next("give a tension, type = \"given\"");
                return Err(scene.wrong("modes.loads_at", error).into());
            }
            Some(t) => {
                let watch = &mut search(watcher);
                statics::equilibrium_watched(muscle, Formulation::Position, t, watch)?
            }
        };
        let count = count.or(asked.map(|modes| modes.count));
        let count = count.unwrap_or(DEFAULT_COUNT);
        Ok(Self {
            load: 0.0,
            loads_at,
            alpha: muscle.parameters.alpha,
            beta: muscle.parameters.beta,
            drive: muscle.drive(),
            muscles: vec![BodyModes::about(muscle, &at, count)?],
        })
    }
}

/// The body whose modes are asked for.
///
/// # Errors
/// A scene without one.
pub fn body_of(scene: &Scene) -> Result<&Body, InputError> {
    scene.body.as_ref().ok_or_else(|| {
        InputError::new("the scene has no body whose modes could be found")
            .allowed("a scene with a [mesh] and [solid]")
    })
}

/// What to say of a body that is not held, if it is not.
fn not_held(muscle: &Muscle) -> Option<String> {
    let free = support::free_parts(muscle)?;
    let s = if free.count == 1 { "" } else { "s" };
    Some(format!(
        "{} motion{s} without strain, at 0 Hz: {free}",
        free.count
    ))
}

/// What to say of an equilibrium that the smallest disturbance ends: Newton's method finds straight columns beyond the
/// load that buckles them.
pub(crate) fn instability(at: &Equilibrium) -> Option<String> {
    let motions = match at.instabilities? {
        0 => return None,
        1 => "a small motion away from it grows".to_owned(),
        n => format!("{n} independent small motions away from it grow"),
    };
    Some(format!(
        "the equilibrium is not stable: {motions}; a damped motion leads to a stable one"
    ))
}
