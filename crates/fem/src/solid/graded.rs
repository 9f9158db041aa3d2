//! Bulk modulus and damping that differ between elements.

use crate::error::FemError;
use crate::operators::mass::Symmetric;
use crate::solid::kind::Ratios;

use super::{Solid, check_count};

/// The matrices that ratios other than one change.
#[derive(Debug, Clone)]
pub(super) struct Graded {
    /// ∫ ψ_k ψ_l κ_body/κ.
    compliance: Symmetric,
    /// ∫ ρ α/α_body φ_i φ_j.
    damping_mass: Symmetric,
    /// β/β_body of each pressure.
    pressure_damping: Vec<f64>,
}

impl Solid {
    /// The solid with κ, α and β by element, as ratios to those of the body.
    ///
    /// # Errors
    /// [`FemError::Count`] unless there is one for each element; [`FemError::Parameter`] for ratios
    /// out of range; [`FemError::SharedPressure`] where elements of different κ or β have a pressure
    /// in common, which is continuous while what it is made of jumps.
    pub fn with_ratios(mut self, ratios: &[Ratios]) -> Result<Self, FemError> {
        check_count(
            "ratios, one per element",
            ratios.len(),
            self.space.n_elements(),
        )?;
        let mut of_pressure: Vec<Option<Ratios>> = vec![None; self.space.n_pressures()];
        for (element, own) in ratios.iter().enumerate() {
            own.check()?;
            for &pressure in self.space.element_pressures(element) {
                let known = of_pressure[pressure].get_or_insert(*own);
                if (known.kappa, known.beta) != (own.kappa, own.beta) {
                    let vertex = self.space.pressure_vertices()[pressure];
                    return Err(FemError::SharedPressure { vertex });
                }
            }
        }
        for (kind, ratios) in self.kinds.iter_mut().zip(ratios) {
            kind.ratios = *ratios;
        }
        let weighted = self.densities.iter().zip(ratios);
        let weighted: Vec<f64> = weighted.map(|(rho, own)| rho * own.alpha).collect();
        self.graded = Some(Graded {
            compliance: Symmetric::pressure_mass(&self.space, |e| 1.0 / ratios[e].kappa),
            damping_mass: Symmetric::node_mass(&self.space, &weighted),
            pressure_damping: of_pressure
                .into_iter()
                .map(|own| own.map_or(1.0, |own| own.beta))
                .collect(),
        });
        Ok(self.regrouped())
    }

    /// κ, α and β of an element by those of the body.
    pub fn ratios(&self, element: usize) -> Ratios {
        self.kinds[element].ratios
    }

    /// Whether κ, α or β differ between elements.
    pub fn is_graded(&self) -> bool {
        self.graded.is_some()
    }

    fn compliance(&self) -> &Symmetric {
        self.graded
            .as_ref()
            .map_or(&self.pressure_mass, |graded| &graded.compliance)
    }

    /// ∫ ψ_k ψ_l κ_body/κ in the pressure pattern: the mass matrix of the pressures for one κ.
    pub fn compliance_values(&self) -> &[f64] {
        &self.compliance().values
    }

    /// out = ∫ ψ_k p κ_body/κ.
    ///
    /// # Panics
    /// If a length is not `n_pressures`.
    pub fn apply_compliance(&self, p: &[f64], out: &mut [f64]) {
        self.compliance().apply(p, out);
    }

    fn damping_mass(&self) -> &Symmetric {
        self.graded
            .as_ref()
            .map_or(&self.mass, |graded| &graded.damping_mass)
    }

    /// ∫ ρ α/α_body φ_i φ_j between free components, in the displacement pattern: the mass matrix for
    /// one α.
    pub fn damping_mass_values(&self) -> Vec<f64> {
        self.on_free_components(self.damping_mass())
    }

    /// out = ∫ ρ α/α_body a·φ over all nodes.
    ///
    /// # Panics
    /// If a length is not `n_components`.
    pub fn apply_damping_mass(&self, a: &[f64], out: &mut [f64]) {
        self.damping_mass()
            .apply_interleaved(self.space.dimension(), a, out);
    }

    /// β/β_body of each pressure, if elements differ.
    pub fn pressure_damping(&self) -> Option<&[f64]> {
        self.graded
            .as_ref()
            .map(|graded| &graded.pressure_damping[..])
    }
}
