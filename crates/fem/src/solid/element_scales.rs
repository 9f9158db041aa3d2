//! Bulk moduli and damping coefficients that differ between elements.

use crate::error::FemError;
use crate::material::{Law, VolumeFunction};
use crate::operators::mass::SymmetricMatrix;
use crate::solid::element_material::ElementScale;

use super::{Solid, check_count};

/// Matrices that depend on the scales of the elements.
#[derive(Debug, Clone)]
pub(super) struct ScaledMatrices {
    /// Pressure matrix ∫ ψ_k ψ_l κ_body/κ.
    compliance: SymmetricMatrix,
    /// Mass matrix ∫ ρ α/α_body φ_i φ_j.
    damping_mass: SymmetricMatrix,
    /// Ratio β/β_body of each pressure.
    pressure_damping: Vec<f64>,
}

impl Solid {
    pub(crate) fn volume_function(&self, element: usize) -> VolumeFunction {
        self.materials[element].volume_function
    }

    /// Returns the solid with the given volume function g(J) in its volumetric energy κ/2 g².
    ///
    /// # Errors
    /// Returns [`FemError::VolumeFunction`] if `function` is not the default and a law has small strains or an
    /// energy that includes the volumetric part.
    pub fn with_volume_function(mut self, function: VolumeFunction) -> Result<Self, FemError> {
        if self.materials.iter().all(|own| own.volume_function == function) {
            return Ok(self);
        }
        let is_default = function == VolumeFunction::default();
        let is_unfit = |law: &Law| !is_default && (law.is_linear() || law.description().complete);
        if let Some(law) = self.laws.iter().find(|law| is_unfit(law)) {
            let law = law.description().name;
            return Err(FemError::VolumeFunction { law });
        }
        for material in &mut self.materials {
            material.volume_function = function;
        }
        Ok(self.with_rebuilt_batches())
    }

    /// Returns the solid with values of κ, α and β for each element, relative to the body.
    ///
    /// # Errors
    /// Returns [`FemError::Count`] unless there is one scale per element, [`FemError::Parameter`] if a scale is
    /// out of range, or [`FemError::SharedPressure`] if elements with different κ or β share a continuous
    /// pressure.
    pub fn with_element_scales(mut self, scales: &[ElementScale]) -> Result<Self, FemError> {
        check_count("element scales, one per element", scales.len(), self.space.n_elements())?;
        let mut pressure_scales: Vec<Option<ElementScale>> = vec![None; self.space.n_pressures()];
        for (element, scale) in scales.iter().enumerate() {
            scale.check()?;
            for &pressure in self.space.element_pressures(element) {
                let known = pressure_scales[pressure].get_or_insert(*scale);
                if (known.kappa, known.beta) != (scale.kappa, scale.beta) {
                    let vertex = self.space.pressure_vertices()[pressure];
                    return Err(FemError::SharedPressure { vertex });
                }
            }
        }
        for (material, scale) in self.materials.iter_mut().zip(scales) {
            material.scale = *scale;
        }
        let weighted = self.densities.iter().zip(scales);
        let weighted: Vec<f64> = weighted.map(|(rho, scale)| rho * scale.alpha).collect();
        self.scaled_matrices = Some(ScaledMatrices {
            compliance: SymmetricMatrix::pressure_mass(&self.space, |e| 1.0 / scales[e].kappa),
            damping_mass: SymmetricMatrix::node_mass(&self.space, &weighted),
            pressure_damping: pressure_scales
                .into_iter()
                .map(|scale| scale.map_or(1.0, |scale| scale.beta))
                .collect(),
        });
        Ok(self.with_rebuilt_batches())
    }

    /// Returns κ, α and β of an element, relative to the body.
    pub fn element_scale(&self, element: usize) -> ElementScale {
        self.materials[element].scale
    }

    /// Returns whether κ, α or β differ between elements.
    pub fn has_element_scales(&self) -> bool {
        self.scaled_matrices.is_some()
    }

    fn compliance(&self) -> &SymmetricMatrix {
        self.scaled_matrices.as_ref().map_or(&self.pressure_mass, |scaled| &scaled.compliance)
    }

    /// Returns ∫ ψ_k ψ_l κ_body/κ in the pressure pattern. If κ is uniform, this is the pressure mass matrix.
    pub fn compliance_values(&self) -> &[f64] {
        &self.compliance().values
    }

    /// Writes ∫ ψ_k p κ_body/κ to `out`.
    ///
    /// # Panics
    /// Panics unless both lengths are `n_pressures`.
    pub fn apply_compliance(&self, p: &[f64], out: &mut [f64]) {
        self.compliance().apply(p, out);
    }

    fn damping_mass(&self) -> &SymmetricMatrix {
        self.scaled_matrices.as_ref().map_or(&self.mass, |scaled| &scaled.damping_mass)
    }

    /// Returns ∫ ρ α/α_body φ_i φ_j for the free components, in the displacement pattern. If α is uniform, this is
    /// the mass matrix.
    pub fn damping_mass_values(&self) -> Vec<f64> {
        self.on_free_components(self.damping_mass())
    }

    /// Writes ∫ ρ α/α_body a·φ over all nodes to `out`.
    ///
    /// # Panics
    /// Panics unless both lengths are `n_components`.
    pub fn apply_damping_mass(&self, a: &[f64], out: &mut [f64]) {
        self.damping_mass().apply_interleaved(self.space.dimension(), a, out);
    }

    /// Returns the ratio β/β_body for each pressure, or `None` if the ratio is 1 everywhere.
    pub fn pressure_damping(&self) -> Option<&[f64]> {
        self.scaled_matrices.as_ref().map(|scaled| &scaled.pressure_damping[..])
    }
}
