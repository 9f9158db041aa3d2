//! Energies of a body, and the powers that change them.

use crate::error::ModelError;
use crate::muscle_dae::MuscleDae;

/// Energies at one point in time; in 2D, per meter of depth.
///
/// As long as the constraint holds, the solution of the equations of motion satisfies
/// `d/dt (kinetic + elastic) = load + support + active - dissipation` with the [`Powers`].
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Energies {
    /// ½ vᵀMv, J (J/m in 2D).
    pub kinetic: f64,
    /// Stored energy ∫W + κ/2 g(J)² plus the energies of elastic foundations and contacts, J (J/m in 2D).
    pub elastic: f64,
}

/// Powers at one point in time; in 2D, per meter of depth.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Powers {
    /// Power of the loads and of moving obstacles, W (W/m in 2D).
    pub load: f64,
    /// Power of moving supports, W (W/m in 2D).
    pub support: f64,
    /// Power of the active stresses, W (W/m in 2D).
    pub active: f64,
    /// Dissipated power, W (W/m in 2D): α vᵀMv + β ∫Ṗ:∇v + ∫η Ė:Ė, viscous foundations, friction, and ∫H:Ė of
    /// viscoelastic stress. The last term is negative while Prony terms release stored energy.
    pub dissipation: f64,
}

impl MuscleDae {
    /// Computes the energies for a state and its derivative without evaluating the residual.
    pub fn energies(&mut self, t: f64, y: &[f64], y_dot: &[f64]) -> Energies {
        let snapshot = self.snapshot(t, y, y_dot);
        let (solid, velocity) = (snapshot.solid, snapshot.velocity);
        let (kinetic, strain) =
            (solid.kinetic_energy(velocity), solid.strain_energy(&snapshot.fields()));
        // With p = -κ g(J), the mixed energy is the stored energy plus pᵀM_p p/(2κ).
        let doubled = self.pressure(y).map_or(0.0, |p| {
            let mut product = vec![0.0; p.len()];
            self.muscle().solid.apply_compliance(p, &mut product);
            0.5 * self.muscle().parameters.inv_kappa * dot(p, &product)
        });
        Energies { kinetic, elastic: strain - doubled + self.boundary_energy(t) }
    }

    /// Computes the powers for a state and its derivative.
    ///
    /// # Errors
    /// Errors of the residual.
    pub fn powers(&mut self, t: f64, y: &[f64], y_dot: &[f64]) -> Result<Powers, ModelError> {
        let supports = self.unbalanced_force(t, y, y_dot)?;
        let parameters = self.muscle().parameters;
        let (load, force_rate) = self.nodal_forces();
        let (velocity, added) = (self.nodal_velocity(), self.added_powers(t, y));
        let mut momentum = vec![0.0; velocity.len()];
        self.muscle().solid.apply_damping_mass(velocity, &mut momentum);
        let viscous =
            if parameters.is_damped() { parameters.beta * dot(force_rate, velocity) } else { 0.0 };
        Ok(Powers {
            load: dot(load, velocity) + added.load,
            support: dot(&supports, velocity),
            active: added.active,
            dissipation: parameters.alpha * dot(&momentum, velocity) + viscous + added.dissipation,
        })
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
