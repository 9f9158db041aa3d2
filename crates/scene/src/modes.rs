//! The lowest eigenfrequencies and modes of bodies, as documents have them.

use myovib_model::{ModelError, Muscle, spectrum, support};
use serde::Serialize;

use crate::{Body, InputError, Scene, json};

/// Modes where nothing says how many.
pub const DEFAULT_COUNT: usize = 10;

/// The modes of bodies that differ in κ alone, and about which state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Modes {
    /// Constant traction of the state linearised about, Pa.
    pub load: f64,
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
    /// The `count` lowest about the displacement `q` (free components) with the pressures `pressure`.
    ///
    /// # Errors
    /// Those of [`spectrum::lowest`].
    pub fn about(
        muscle: &Muscle,
        q: &[f64],
        pressure: &[f64],
        count: usize,
    ) -> Result<Self, ModelError> {
        let found = spectrum::lowest(muscle, q, pressure, count)?.into_iter();
        let modes = found.map(|mode| {
            Ok(Mode {
                omega_squared: mode.omega_squared,
                frequency: mode.frequency(),
                damping_ratio: spectrum::damping_ratio(muscle, q, pressure, &mode)?,
                residual: mode.residual,
                shape: mode.shape,
            })
        });
        Ok(Self {
            kappa: muscle.parameters.kappa(),
            modes: modes.collect::<Result<_, ModelError>>()?,
        })
    }
}

impl Modes {
    /// Those of the scene's body about its unloaded state: `count`, else as many as the scene says.
    ///
    /// # Errors
    /// A scene without a body, and those of [`BodyModes::about`].
    pub fn of_scene(scene: &Scene, count: Option<usize>) -> Result<Self, crate::Error> {
        let muscle = body_of(scene).map(|body| &body.muscle)?;
        let asked = scene.file.modes.as_ref().map(|modes| modes.count);
        let rest = vec![0.0; muscle.solid.dofs().n_free()];
        let pressure = vec![0.0; muscle.solid.space().n_pressures()];
        let count = count.or(asked).unwrap_or(DEFAULT_COUNT);
        Ok(Self {
            load: 0.0,
            alpha: muscle.parameters.alpha,
            beta: muscle.parameters.beta,
            drive: muscle.drive(),
            muscles: vec![BodyModes::about(muscle, &rest, &pressure, count)?],
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
pub fn note(muscle: &Muscle) -> Option<String> {
    let free = support::free_parts(muscle)?;
    let s = if free.count == 1 { "" } else { "s" };
    Some(format!(
        "{} motion{s} without strain, at 0 Hz: {free}",
        free.count
    ))
}
