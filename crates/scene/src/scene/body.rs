//! The elastic body of a scene: regions, supports, loads.

use std::collections::BTreeMap;
use std::sync::Arc;

use myovib_fem::{DofMap, Group, Law, Mesh, Solid, Space, load};
use myovib_model::{
    Formulation, LinearSolver, Load, Muscle, Parameters, Prescribed, PressureLoad, Signal,
};

use super::Body;
use super::builder::Builder;
use crate::InputError;
use crate::scene_file::function::Function;
use crate::scene_file::solid::{self, Axis, FormulationName};
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
        let materials = self.materials(file, &mesh)?;
        self.check_complete(&materials, formulation)?;
        let space = Arc::new(Space::taylor_hood(&mesh));
        let constrained = self.supports(file, &space)?;
        let components: Vec<(usize, usize)> = constrained.keys().copied().collect();
        let dofs = self.at("fixed", DofMap::new(&space, &components))?;
        let loads = self.loads(file, &space, &materials)?;
        let (laws, densities): (Vec<Law>, Vec<f64>) = materials.into_iter().unzip();
        let solid = self.at(
            "material",
            Solid::with_densities(space, dofs, laws, &densities),
        )?;
        let pressures = self.pressures(file, &solid)?;
        let prescribed = constrained
            .into_iter()
            .filter_map(|((node, axis), signal)| {
                Some(Prescribed {
                    component: 2 * node + axis,
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
        })
    }

    /// A law whose energy holds the volume's part has no pressure.
    fn check_complete(
        &self,
        materials: &[(Law, f64)],
        formulation: Formulation,
    ) -> Result<(), InputError> {
        let mut descriptions = materials.iter().map(|(law, _)| law.description());
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

    /// Law and density of each triangle.
    fn materials(&self, file: &SceneFile, mesh: &Mesh) -> Result<Vec<(Law, f64)>, InputError> {
        let mut given: Vec<Option<(Law, f64)>> = vec![None; mesh.n_elements()];
        for (i, material) in file.material.iter().enumerate() {
            let path = format!("material[{i}]");
            for triangle in self.triangles(material.group.as_deref(), mesh, &path)? {
                if given[triangle].is_some() {
                    let error = InputError::new(format!(
                        "triangle {triangle} has two materials: this one and one before it"
                    ))
                    .next("give each triangle one material, by groups that do not overlap");
                    return Err(self.wrong(&path, error));
                }
                given[triangle] = Some((law(&material.law), material.density));
            }
        }
        let without = given.iter().filter(|one| one.is_none()).count();
        given
            .into_iter()
            .collect::<Option<Vec<_>>>()
            .ok_or_else(|| {
                let error = InputError::new(format!("{without} triangles have no material"))
                    .next("add a [[material]] for their group, or one without `group` for all");
                self.wrong("material", error)
            })
    }

    /// The triangles of a group, or all.
    fn triangles(
        &self,
        group: Option<&str>,
        mesh: &Mesh,
        path: &str,
    ) -> Result<Vec<usize>, InputError> {
        let Some(name) = group else {
            return Ok((0..mesh.n_elements()).collect());
        };
        let place = format!("{path}.group");
        match self.at(&place, mesh.group(name))? {
            Group::Elements(members) => Ok(members.clone()),
            _ => {
                let error = InputError::new(format!("the group `{name}` holds no triangles"));
                Err(self.wrong(&place, error))
            }
        }
    }

    /// The constrained components (node, axis); those that move have their function of time.
    fn supports(
        &self,
        file: &SceneFile,
        space: &Space,
    ) -> Result<BTreeMap<(usize, usize), Option<Signal>>, InputError> {
        let mut constrained = BTreeMap::new();
        for (i, fixed) in file.fixed.iter().enumerate() {
            let nodes = self.at(&format!("fixed[{i}].group"), space.nodes_of(&fixed.group))?;
            for (&node, axis) in nodes
                .iter()
                .flat_map(|n| fixed.components.iter().map(move |a| (n, a)))
            {
                constrained.insert((node, index(*axis)), None);
            }
        }
        for (i, moving) in file.displacement.iter().enumerate() {
            let path = format!("displacement[{i}]");
            let nodes = self.at(&format!("{path}.group"), space.nodes_of(&moving.group))?;
            for (axis, key, function) in components(&moving.x, &moving.y) {
                let path = format!("{path}.{key}");
                let signal = self.motion(function, &path)?;
                for &node in &nodes {
                    if constrained
                        .insert((node, axis), Some(signal.clone()))
                        .is_some()
                    {
                        let [x, y] = space.node_points()[node];
                        let error = InputError::new(format!(
                            "the {key} component at ({x:.6}, {y:.6}) is held or moved twice"
                        ))
                        .next("take one of the two groups, or give them other nodes");
                        return Err(self.wrong(&path, error));
                    }
                }
            }
        }
        if constrained.is_empty() {
            let error = InputError::new("nothing holds the body")
                .next("add a [[fixed]] with the group of the nodes that do not move");
            return Err(self.wrong("", error));
        }
        Ok(constrained)
    }

    /// A function of time that a displacement can follow from rest.
    fn motion(&self, function: &Function, path: &str) -> Result<Signal, InputError> {
        let signal = self.signal(function, path)?;
        if signal.smoothness() < 1 {
            let error = InputError::new("a displacement needs a velocity without jumps")
                .next("take `step`, whose rise is smooth, in place of `ramp`");
            return Err(self.wrong(path, error));
        }
        Ok(signal)
    }

    /// The dead loads: tractions and body forces.
    fn loads(
        &self,
        file: &SceneFile,
        space: &Space,
        materials: &[(Law, f64)],
    ) -> Result<Vec<Load>, InputError> {
        let mut loads = Vec::new();
        for (i, traction) in file.traction.iter().enumerate() {
            let path = format!("traction[{i}]");
            for (axis, key, function) in components(&traction.x, &traction.y) {
                let unit = load::traction(space, &traction.group, direction(axis));
                let unit = self.at(&format!("{path}.group"), unit)?;
                loads.push(Load::new(
                    &unit,
                    self.signal(function, &format!("{path}.{key}"))?,
                ));
            }
        }
        for (i, force) in file.body_force.iter().enumerate() {
            let path = format!("body_force[{i}]");
            let members = self.triangles(force.group.as_deref(), space.mesh(), &path)?;
            let mut density = vec![0.0; materials.len()];
            for triangle in members {
                density[triangle] = materials[triangle].1;
            }
            for (axis, key, function) in components(&force.x, &force.y) {
                let unit = load::weight(space, &density, direction(axis));
                loads.push(Load::new(
                    &unit,
                    self.signal(function, &format!("{path}.{key}"))?,
                ));
            }
        }
        Ok(loads)
    }

    /// The pressures on the deformed boundary.
    fn pressures(&self, file: &SceneFile, solid: &Solid) -> Result<Vec<PressureLoad>, InputError> {
        let given = file.pressure.iter().enumerate();
        given
            .map(|(i, pressure)| {
                let path = format!("pressure[{i}]");
                let signal = self.signal(&pressure.value, &format!("{path}.value"))?;
                let load = PressureLoad::new(solid, &pressure.group, signal);
                self.at(&format!("{path}.group"), load)
            })
            .collect()
    }
}

/// The components that are given, with their index and key.
fn components<'f>(
    x: &'f Option<Function>,
    y: &'f Option<Function>,
) -> impl Iterator<Item = (usize, &'static str, &'f Function)> {
    let given = |axis, key, function: &'f Option<Function>| {
        function.as_ref().map(|function| (axis, key, function))
    };
    given(0, "x", x).into_iter().chain(given(1, "y", y))
}

pub(super) fn index(axis: Axis) -> usize {
    match axis {
        Axis::X => 0,
        Axis::Y => 1,
    }
}

fn direction(axis: usize) -> [f64; 2] {
    [[1.0, 0.0], [0.0, 1.0]][axis]
}

fn law(law: &solid::Law) -> Law {
    match *law {
        solid::Law::MooneyRivlin { c10, c01 } => Law::MooneyRivlin { c10, c01 },
        // (20) with c01 = 0 has the shear modulus 2 c10.
        solid::Law::NeoHooke { shear_modulus } => Law::MooneyRivlin {
            c10: 0.5 * shear_modulus,
            c01: 0.0,
        },
        solid::Law::DeviatoricStVenantKirchhoff { shear_modulus } => {
            Law::DeviatoricStVenantKirchhoff { shear_modulus }
        }
        solid::Law::StVenantKirchhoff {
            lambda,
            shear_modulus,
        } => Law::StVenantKirchhoff {
            lambda,
            shear_modulus,
        },
        solid::Law::SmallStrain { shear_modulus } => Law::SmallStrain { shear_modulus },
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
