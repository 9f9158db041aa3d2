//! Energies of the body and their sources.

use crate::error::ModelError;
use crate::muscle_dae::MuscleDae;

/// Energies and powers at one time, in 2D per meter of depth.
///
/// The equations of motion satisfy `d/dt (kinetic + elastic) = load + support + active -
/// dissipation` as long as the constraint holds.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Energies {
    /// ½ vᵀMv, J/m.
    pub kinetic: f64,
    /// Stored energy ∫W + κ/2 (J−1)² and the energies of elastic foundations and of contacts, J/m.
    pub elastic: f64,
    /// Power of the loads and of moving obstacles, W/m.
    pub load: f64,
    /// Power of moving supports, W/m.
    pub support: f64,
    /// Power of the active stresses, W/m.
    pub active: f64,
    /// α vᵀMv + β ∫Ṗ:∇v + ∫η Ė:Ė, viscous foundations, friction, and ∫H:Ė of viscoelastic stress, W/m. The
    /// last term is negative while Prony terms release stored energy.
    pub dissipation: f64,
}

impl MuscleDae {
    /// Computes energies and powers at a state and its derivative.
    pub fn energies(&mut self, t: f64, y: &[f64], y_dot: &[f64]) -> Result<Energies, ModelError> {
        let supports = self.unbalanced_force(t, y, y_dot)?;
        let parameters = self.muscle().parameters;
        let pressure = self.pressure(y);
        let (load, force_rate) = self.nodal_forces();
        let (load, force_rate) = (load.to_vec(), force_rate.to_vec());
        let added = self.added_energies(t, y);
        let snapshot = self.snapshot(t, y, y_dot);
        let velocity = snapshot.velocity;
        let solid = snapshot.solid;
        // With p = -κ g(J) the mixed energy is the stored energy plus pᵀM_p p/(2κ).
        let doubled = pressure.map_or(0.0, |p| {
            let mut product = vec![0.0; p.len()];
            solid.apply_compliance(p, &mut product);
            0.5 * parameters.inv_kappa * dot(p, &product)
        });
        let kinetic = solid.kinetic_energy(velocity);
        let mut momentum = vec![0.0; velocity.len()];
        solid.apply_damping_mass(velocity, &mut momentum);
        let viscous =
            if parameters.is_damped() { parameters.beta * dot(&force_rate, velocity) } else { 0.0 };
        Ok(Energies {
            kinetic,
            elastic: solid.strain_energy(&snapshot.fields()) - doubled + added.elastic,
            load: dot(&load, velocity) + added.load,
            support: dot(&supports, velocity),
            active: added.active,
            dissipation: parameters.alpha * dot(&momentum, velocity) + viscous + added.dissipation,
        })
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
