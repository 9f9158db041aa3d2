//! Conditions of a scene that end the run.

use myovib_model::{ModelError, Probe, Snapshot};
use myovib_oscillators::Coherence;

use crate::scene::Scene;
use crate::scene_file::output::Stop;
use crate::system::{System, muscle_of, network_of};

pub(super) enum Condition {
    /// |Ψ| of a chain exceeds a bound.
    Coherence { chain: String, network: usize, above: f64 },
    /// |u| at a point exceeds a bound (m).
    Displacement { probe: Probe, above: f64 },
    /// det F falls below a bound at a quadrature point.
    Volume { below: f64 },
}

impl Condition {
    pub(super) fn new(stop: &Stop, scene: &Scene) -> Result<Self, ModelError> {
        Ok(match stop {
            Stop::Displacement { at, above } => Self::Displacement {
                probe: Probe::near(scene.expect_body()?.muscle.solid.space(), at)?.0,
                above: *above,
            },
            Stop::Volume { below } => {
                scene.expect_body()?;
                Self::Volume { below: *below }
            }
            Stop::Coherence { chain, above } => Self::Coherence {
                chain: chain.clone(),
                network: scene.chain(chain)?.0,
                above: *above,
            },
        })
    }

    /// Returns whether the condition depends on a chain.
    pub(super) fn reads_chain(&self) -> bool {
        matches!(self, Self::Coherence { .. })
    }

    /// Returns a positive value if the condition is met at time `t` in state `y`.
    pub(super) fn excess<P: System>(
        &self,
        system: &mut P,
        t: f64,
        y: &[f64],
    ) -> Result<f64, ModelError> {
        match self {
            Self::Displacement { .. } | Self::Volume { .. } => {
                let (dae, range) = muscle_of(system, y)?;
                Ok(self.excess_of_body(&dae.snapshot(t, &y[range], &[])))
            }
            Self::Coherence { network, above, .. } => {
                let (network, range) = network_of(system, *network)?;
                let (position, velocity) = y[range].split_at(network.n_oscillators());
                let found = Coherence::new(network.omega(), position, velocity);
                Ok(found.centroid.norm() - above)
            }
        }
    }

    /// Returns a positive value if the body meets the condition. A condition on a chain is never met.
    pub(super) fn excess_of_body(&self, snapshot: &Snapshot<'_>) -> f64 {
        match self {
            Self::Displacement { probe, above } => {
                let [x, y, z] = probe.vector(snapshot.displacement);
                x.hypot(y).hypot(z) - above
            }
            Self::Volume { below } => {
                below - snapshot.solid.volume_ratios(snapshot.displacement).smallest
            }
            Self::Coherence { .. } => f64::NEG_INFINITY,
        }
    }

    pub(super) fn describe(&self) -> String {
        match self {
            Self::Displacement { probe, above } => {
                let point = probe.point().iter().map(f64::to_string);
                let point = point.collect::<Vec<_>>().join(", ");
                format!("|u| at ({point}) exceeds {above} m")
            }
            Self::Volume { below } => format!("det F is below {below}"),
            Self::Coherence { chain, above, .. } => {
                format!("|Ψ| of chain `{chain}` exceeds {above}")
            }
        }
    }
}
