//! Features of scenes for which sensitivities are not available.

use super::influence::first_jump;
use crate::InputError;
use crate::scene::{Scene, Start};
use crate::scene_file::Analysis;
use crate::scene_file::active::Tension;
use crate::scene_file::contact::{Contact, Method};
use crate::scene_file::loading::PathMethod;
use crate::scene_file::material::Material;

/// A feature for which sensitivities are not available.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Unsupported {
    #[error("sensitivities require a dynamic, quasi-static or static analysis")]
    Analysis,
    #[error("stiffness maps require a dynamic analysis")]
    MapAnalysis,
    #[error("sensitivities require given load factors, which an arc-length path does not have")]
    ArcLength,
    #[error("sensitivities require a body")]
    NoBody,
    #[error("sensitivities do not support chains that act on the body")]
    Feedback,
    #[error("sensitivities do not support stop conditions, whose time depends on the parameters")]
    Stop,
    #[error("sensitivities do not support loads that jump")]
    Jump,
    #[error(
        "sensitivities require an explicit contact stiffness, because the default depends on the parameters"
    )]
    ContactStiffness,
    #[error("sensitivities do not support augmented Lagrange multipliers")]
    AugmentedLagrange,
    #[error("sensitivities do not support friction")]
    Friction,
    #[error(
        "sensitivities of dynamic and quasi-static analyses do not support obstacles driven by a force"
    )]
    ObstacleForce,
    #[error("stiffness maps do not support Prony terms")]
    Prony,
    #[error("stiffness maps do not support a start from equilibrium")]
    Equilibrium,
}

impl Unsupported {
    fn remedy(self) -> &'static str {
        match self {
            Self::Analysis => "set analysis = \"dynamic\", \"quasi-static\" or \"static\"",
            Self::MapAnalysis => "set analysis = \"dynamic\"",
            Self::ArcLength => "set static.method = \"load\"",
            Self::NoBody => "add a [mesh] with [solid]",
            Self::Feedback => "remove [[feedback]] and tensions of type = \"coherence\"",
            Self::Stop => "remove [[stop]]",
            Self::Jump => "give the step a `rise` above 0",
            Self::ContactStiffness => "give `stiffness`; `myovib check` prints the default",
            Self::AugmentedLagrange => "use method = \"penalty\" and raise `stiffness`",
            Self::Friction => "remove `friction`",
            Self::ObstacleForce => "give the displacement of the obstacle instead of its force",
            Self::Prony => "remove `prony`",
            Self::Equilibrium => "start from rest, or from the folder of another run",
        }
    }

    /// Returns the error for this feature, located at `path` in the scene.
    pub(super) fn at(self, scene: &Scene, path: &str) -> InputError {
        scene.wrong(path, InputError::new(self).next(self.remedy()))
    }
}

/// Returns the first feature of a scene that sensitivities do not support, and its key.
pub fn unsupported(scene: &Scene) -> Option<(Unsupported, String)> {
    let file = &scene.file;
    let is_by_chain = |material: &Material| {
        let active = material.active.as_ref();
        active.is_some_and(|active| matches!(active.tension, Tension::Coherence { .. }))
    };
    let tension = file.material.iter().position(is_by_chain);
    let path = file.loading_path.as_ref();
    let is_by_arc = path.is_some_and(|path| path.method == PathMethod::ArcLength);
    let is_static = file.analysis == Analysis::Static;
    let key = |is_unsupported: bool, key: &str| is_unsupported.then(|| key.to_owned());
    let contact = |is_unsupported: fn(&Contact) -> bool, key: &str| {
        file.contact.iter().position(is_unsupported).map(|i| format!("contact[{i}]{key}"))
    };
    let is_augmented = |own: &Contact| own.method == Method::AugmentedLagrange;
    let general = [
        (Unsupported::Analysis, key(!is_static && !file.analysis.is_in_time(), "analysis")),
        (Unsupported::ArcLength, key(is_static && is_by_arc, "static.method")),
        (Unsupported::NoBody, key(scene.body.is_none(), "")),
        (Unsupported::Feedback, key(!file.feedback.is_empty(), "feedback")),
        (Unsupported::Feedback, tension.map(|i| format!("material[{i}].active"))),
        (Unsupported::Stop, key(!file.stop.is_empty(), "stop")),
        (Unsupported::AugmentedLagrange, contact(is_augmented, ".method")),
    ];
    // A static analysis uses the loads at only one time, so jumps have no effect. Contacts are supported in static
    // analyses because bodies at neighboring values recompute their default contact stiffness.
    let values = serde_json::to_value(file).unwrap_or_default();
    let of_motions = [
        (Unsupported::ObstacleForce, contact(|own| own.force.is_some(), ".force")),
        (Unsupported::Friction, contact(|own| own.friction > 0.0, ".friction")),
        (Unsupported::ContactStiffness, contact(|own| own.stiffness.is_none(), "")),
        (Unsupported::Jump, first_jump(&values, "", scene.t_end)),
    ];
    let of_motions = of_motions.into_iter().filter(|_| !is_static);
    general.into_iter().chain(of_motions).find_map(|(feature, path)| Some((feature, path?)))
}

/// Returns the first feature of a scene that fits do not support, and its key.
pub(super) fn unsupported_in_fit(scene: &Scene) -> Option<(Unsupported, String)> {
    match (scene.is_response(), &scene.body) {
        (false, _) => unsupported(scene),
        (true, Some(_)) => None,
        (true, None) => Some((Unsupported::NoBody, String::new())),
    }
}

/// Returns the first feature of a scene that stiffness maps do not support, and its key.
pub fn unsupported_in_map(scene: &Scene) -> Option<(Unsupported, String)> {
    if scene.file.analysis != Analysis::Dynamic {
        return Some((Unsupported::MapAnalysis, "analysis".to_owned()));
    }
    unsupported(scene).or_else(|| {
        let body = scene.body.as_ref()?;
        let (feature, path) = match body.start {
            _ if body.muscle.solid.n_internal() > 0 => (Unsupported::Prony, "material"),
            Start::Equilibrium => (Unsupported::Equilibrium, "initial_state"),
            Start::Rest | Start::State(_) => return None,
        };
        Some((feature, path.to_owned()))
    })
}
