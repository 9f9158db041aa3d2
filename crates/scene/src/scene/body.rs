//! The elastic body of a scene, from its mesh, materials, supports and loads.

use std::sync::Arc;

use myovib_fem::{DofMap, Law, Solid, Space};
use myovib_model::{Formulation, LinearSolver, Muscle, Parameters, Prescribed};

use super::Body;
use super::builder::Builder;
use super::materials::Materials;
use crate::InputError;
use crate::scene_file::solid::{self, FormulationName};
use crate::scene_file::{SceneFile, mesh};

impl Builder<'_> {
    /// The body of a scene with its loads, formulation and settings.
    pub(super) fn body(
        &self,
        file: &SceneFile,
        mesh: &mesh::Mesh,
        solid: &solid::Solid,
    ) -> Result<Body, InputError> {
        let mesh = self.mesh(mesh, &file.region)?;
        let parameters = self.at(
            "solid",
            Parameters::new(solid.alpha, solid.beta, solid.kappa.0),
        )?;
        let formulation = solid
            .formulation
            .map_or_else(|| suited(&parameters), formulation);
        self.at("solid.formulation", formulation.check(&parameters))?;
        let Materials {
            laws,
            densities,
            fibres,
            regions,
        } = self.materials(file, &mesh)?;
        self.check_complete(&laws, formulation)?;
        let space = Arc::new(Space::taylor_hood(&mesh));
        let constrained = self.supports(file, &space)?;
        let components: Vec<(usize, usize)> = constrained.keys().copied().collect();
        let dofs = self.at("fixed", DofMap::new(&space, &components))?;
        let dimension = space.dimension();
        let loads = self.loads(file, &space, &densities)?;
        let mut solid = self.at(
            "material",
            Solid::with_densities(space, dofs, laws, &densities),
        )?;
        let (mut opposed_fibres, has_fibres) = (0, fibres.is_some());
        if let Some(fibres) = fibres {
            opposed_fibres = fibres.opposed(&mesh, solid.rule()).len();
            solid = solid.with_fibres(fibres);
        }
        let pressures = self.pressures(file, &solid)?;
        let prescribed = constrained
            .into_iter()
            .filter_map(|((node, axis), signal)| {
                Some(Prescribed {
                    component: dimension * node + axis,
                    signal: signal?,
                })
            })
            .collect();
        let linear_solver = match file.feedback.is_empty() {
            true => LinearSolver::Condensed,
            // The oscillators act on the body: the Newton matrix is no longer block triangular.
            false => LinearSolver::Full,
        };
        let muscle = Muscle {
            loads,
            pressures,
            prescribed,
            ..Muscle::unloaded(solid, parameters)
        };
        Ok(Body {
            settings: self.settings(&file.integrator, &muscle, formulation, linear_solver),
            muscle,
            formulation,
            regions,
            has_fibres,
            opposed_fibres,
        })
    }

    /// A law whose energy holds the volume's part has no pressure.
    fn check_complete(&self, laws: &[Law], formulation: Formulation) -> Result<(), InputError> {
        let mut descriptions = laws.iter().map(|law| law.description());
        match descriptions.find(|law| law.complete) {
            Some(law) if formulation != Formulation::Displacement => {
                let error = InputError::new(format!(
                    "the law {} has its own volume part, which is no -κ (J-1)",
                    law.name
                ))
                .next("take the formulation `displacement`, or deviatoric-st-venant-kirchhoff");
                Err(self.wrong("solid.formulation", error))
            }
            _ => Ok(()),
        }
    }
}

fn formulation(name: FormulationName) -> Formulation {
    match name {
        FormulationName::Displacement => Formulation::Displacement,
        FormulationName::Position => Formulation::Position,
        FormulationName::Rate => Formulation::Rate,
        FormulationName::Velocity => Formulation::Velocity,
        FormulationName::Stabilized => Formulation::Stabilized,
        FormulationName::ImplicitRate => Formulation::ImplicitRate,
    }
}

/// The formulation of lowest index that goes with κ and β and keeps the pressure a field.
fn suited(parameters: &Parameters) -> Formulation {
    match (parameters.is_damped(), parameters.is_incompressible()) {
        (true, _) => Formulation::ImplicitRate,
        (false, true) => Formulation::Velocity,
        (false, false) => Formulation::Position,
    }
}
