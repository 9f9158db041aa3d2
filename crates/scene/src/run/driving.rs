//! Errors of separately integrated chains that are due to the error of the body.

use myovib_model::Field;
use serde::Serialize;

use crate::Scene;
use crate::system::System;

/// Error of a chain that is due to the error of the driving displacement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct DrivingError {
    chain: String,
    /// Error δu of the driving displacement (m). For BDF, it is the sum of the local errors; for Radau IIA, the
    /// tolerance.
    displacement: f64,
    /// Upper bound on the resulting change of the oscillator positions, γ δu (1/ω² + T/(2ω)).
    position: f64,
    /// Upper bound relative to the largest position.
    relative: f64,
}

impl DrivingError {
    /// Returns the error of each separately integrated chain.
    pub(super) fn all(scene: &Scene, system: &impl System) -> Vec<Self> {
        let wanted = &scene.file.integrator.oscillators;
        let [relative, absolute] = match &scene.body {
            Some(body) => {
                let settings = &body.settings;
                let absolute = settings.absolute_tolerances.of(Field::Displacement);
                [settings.relative_tolerance, absolute]
            }
            None => [wanted.rtol, wanted.atol],
        };
        let chains = scene.chains.iter().enumerate();
        let effects = chains.filter_map(|(k, chain)| {
            let driving = system.driving(k)?;
            let tolerance = relative * driving.displacement + absolute;
            let displacement = driving.error.unwrap_or(tolerance);
            let position = driving.response * displacement;
            Some(Self {
                chain: chain.name.clone(),
                displacement,
                position,
                relative: position / driving.position,
            })
        });
        effects.collect()
    }

    /// Returns a note if the error exceeds ten times the relative tolerance of the body, because the chain is then less
    /// accurate than the body. For a rod, no note is returned because the rod and its chains have equal tolerances.
    pub(super) fn note(&self, scene: &Scene) -> Option<String> {
        let body = scene.body.as_ref()?;
        let is_inaccurate = self.relative > 10.0 * body.settings.relative_tolerance;
        // A chain at a fixed point may not move at all. The relative error is then not finite.
        (self.relative.is_finite() && is_inaccurate).then(|| {
            format!(
                "chain `{}`: the error of the driving displacement, about {:.1e} m, changes the positions of the \
                 oscillators by at most {:.1e}, relative to the largest position; decrease integrator.rtol, or use integrator.chains = \"together\"",
                self.chain, self.displacement, self.relative
            )
        })
    }
}
