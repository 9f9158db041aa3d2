//! Creates the elastic body of a scene from its mesh, materials, supports and loads.

use std::sync::Arc;

use myovib_fem::material::VolumeFunction;
use myovib_fem::{AddedStress, DofMap, FemError, Law, Mesh, Solid, Space};
use myovib_model::harmonic::Excitation;
use myovib_model::{
    Field, Formulation, LinearSolverKind, Muscle, Parameters, Prescribed, dependent_pressures,
};
use num_complex::Complex64;

use super::Body;
use super::builder::Builder;
use super::contraction::{Added, act_on_own_elements};
use super::materials::Materials;
use super::places::written;
use super::supports::Supports;
use crate::InputError;
use crate::scene_file::solid::{self, VolumetricEnergy};
use crate::scene_file::{Analysis, SceneFile, mesh};

/// Maximum number of passes in which undetermined pressures are tied.
const MAX_TIES: usize = 5;

/// Returns the end of a message that names only the first of `n` vertices.
fn and_more(n: usize) -> String {
    match n {
        1 => String::new(),
        n => format!(", and at {} more vertices", n - 1),
    }
}

impl Builder<'_> {
    /// Creates the body of a scene, if it has one. Rejects a scene with nothing to compute and a scene with both a body
    /// and a rod.
    pub(super) fn body_of(&self) -> Result<Option<Body>, InputError> {
        let body = match (&self.file.mesh, &self.file.solid) {
            (Some(mesh), Some(solid)) => Some(self.body(mesh, solid)?),
            (None, None) => None,
            (Some(_), None) => {
                let error = InputError::new("a scene with a mesh needs a [solid] table")
                    .next("add a [solid] table with `bulk_modulus` in Pa");
                return Err(self.wrong("mesh", error));
            }
            (None, Some(_)) => {
                let error = InputError::new("a body needs a mesh")
                    .next("add a [mesh] table, for example with type = \"muscle\"");
                return Err(self.wrong("solid", error));
            }
        };
        if body.is_none() && self.file.rod.is_none() && self.file.chain.is_empty() {
            return Err(self.wrong(
                "",
                InputError::new("the scene has nothing to compute")
                    .allowed("a [mesh] with [solid], a [rod], or a [[chain]]"),
            ));
        }
        if let (Some(_), Some(_)) = (&body, &self.file.rod) {
            let error = InputError::new("a scene has either a muscle or a rod, not both")
                .next("remove [rod], or [mesh] with [solid]");
            return Err(self.wrong("rod", error));
        }
        Ok(body)
    }

    /// Creates the body of a scene with its loads, formulation and settings.
    fn body(&self, mesh: &mesh::Mesh, solid: &solid::Solid) -> Result<Body, InputError> {
        let mesh = self.mesh(mesh)?;
        let parameters = self.parameters(solid)?;
        let formulation = self.formulation(solid, &parameters)?;
        let materials = self.materials(&mesh)?;
        self.check_complete(&materials.laws, formulation)?;
        let regions = materials.regions.clone();
        let own: Vec<Parameters> = regions.iter().map(|region| parameters[*region]).collect();
        let (space, supports, dofs) = self.space(&mesh, &materials, &parameters[0])?;
        let dimension = space.dimension();
        let (loads, force) = self.loads(&space, &materials.densities)?;
        let (mut load_keys, loads): (Vec<String>, _) = loads.into_iter().unzip();
        let fibers = materials.fibers.as_ref();
        let unresolved_fibers = fibers.map_or(0, |fibers| fibers.unresolved(&mesh));
        let has_fibers = fibers.is_some();
        let Added { stresses, activations, tension_factors } = self.added(&mesh, &regions)?;
        let function = self.volume_function(solid, &parameters[0])?;
        let (solid, opposed_fibers) = self.solid((space, dofs), &stresses, materials)?;
        let solid = self.at("solid.volumetric_energy", solid.with_volume_function(function))?;
        let relaxes = !solid.relaxation_regions().is_empty();
        let body = self.at("material", Muscle::graded(solid, &own))?;
        let (surface_loads, harmonic) = self.surface_loads(&body.solid)?;
        let (keys, surface_loads): (Vec<String>, _) = surface_loads.into_iter().unzip();
        load_keys.extend(keys);
        let forces = self.file.contact.iter().enumerate();
        let forces = forces.filter(|(_, contact)| contact.force.is_some());
        load_keys.extend(forces.clone().map(|(i, _)| format!("contact[{i}].force")));
        let follows_force = forces.count() > 0;
        let component = |(node, axis): (usize, usize)| dimension * node + axis;
        let displacement = supports.iter().map(|(at, own)| (component(*at), own.amplitude));
        let displacement = displacement.filter(|(_, own)| *own != Complex64::ZERO).collect();
        let excitation = Excitation { force, surface_loads: harmonic, displacement };
        let prescribed = supports.into_iter().filter_map(|(place, support)| {
            Some(Prescribed { component: component(place), signal: support.signal? })
        });
        let linear_solver = match act_on_own_elements(self.file) || relaxes || follows_force {
            true => LinearSolverKind::Condensed,
            // Otherwise, oscillators act on elements that do not drive them.
            false => LinearSolverKind::Full,
        };
        let mut muscle = Muscle {
            loads,
            surface_loads,
            contacts: self.contacts(&body.solid)?,
            prescribed: prescribed.collect(),
            foundations: self.foundations(&body.solid)?,
            activations,
            tension_factors,
            ..body
        };
        let start = self.start(Some(&muscle))?;
        let mut settings = self.settings(&muscle, &start, formulation, linear_solver);
        if self.file.analysis == Analysis::QuasiStatic {
            self.expect_no_jump(&muscle)?;
            muscle.solid = muscle.solid.without_inertia();
            if self.file.integrator.error_test.exclude.is_none() {
                // The velocity jumps where the slope of a load jumps.
                settings.suppressed = vec![Field::Velocity];
            }
        }
        Ok(Body {
            settings,
            muscle,
            excitation,
            formulation,
            load_keys,
            start,
            regions,
            has_fibers,
            opposed_fibers,
            unresolved_fibers,
        })
    }

    /// Returns the given formulation, or the default one, and checks that it is compatible with the parameters and the
    /// analysis.
    fn formulation(
        &self,
        solid: &solid::Solid,
        parameters: &[Parameters],
    ) -> Result<Formulation, InputError> {
        // All materials have the same kind of parameters as the first.
        let is_quasi_static = self.file.analysis == Analysis::QuasiStatic;
        let formulation = solid.formulation.unwrap_or_else(|| match is_quasi_static {
            true => Formulation::Position,
            false => suited(&parameters[0]),
        });
        if is_quasi_static {
            self.without_inertia(formulation, parameters)?;
        }
        self.at("solid.formulation", formulation.check(&parameters[0]))?;
        Ok(formulation)
    }

    /// Creates the finite element space of the body, its supports and its degrees of freedom.
    fn space(
        &self,
        mesh: &Mesh,
        materials: &Materials,
        parameters: &Parameters,
    ) -> Result<(Arc<Space>, Supports, DofMap), InputError> {
        let space = self.at("material", taylor_hood(mesh, &materials.regions))?;
        let supports = self.supports(&space)?;
        let components: Vec<(usize, usize)> = supports.keys().copied().collect();
        let dofs = self.at("fixed", DofMap::new(&space, &components))?;
        if !parameters.is_incompressible() {
            return Ok((Arc::new(space), supports, dofs));
        }
        if dofs.n_free() == 0 {
            let error =
                InputError::new("all nodes are fixed: no displacement can balance the pressures")
                    .next("fix or move fewer groups, or use a finite bulk_modulus");
            return Err(self.wrong("fixed", error));
        }
        let space = self.with_pressures_held(space, &dofs)?;
        let space = self.with_independent_pressures(space, &dofs)?;
        Ok((space, supports, dofs))
    }

    /// Creates the elements, including the stresses of their materials. Also returns the number of quadrature points at
    /// which the fiber directions of the vertices oppose each other.
    fn solid(
        &self,
        (space, dofs): (Arc<Space>, DofMap),
        stresses: &[(Vec<usize>, AddedStress)],
        materials: Materials,
    ) -> Result<(Solid, usize), InputError> {
        let Materials { laws, densities, fibers, factors, regions } = materials;
        let at = |result| self.at("material", result);
        let mut solid = at(Solid::with_densities(space, dofs, laws, &densities))?;
        let mut opposed_fibers = 0;
        if let Some(fibers) = fibers {
            opposed_fibers = fibers.opposed(solid.space().mesh(), solid.rule()).len();
            solid = solid.with_fibers(fibers);
        }
        if let Some(factors) = factors {
            solid = at(solid.with_factors(factors))?;
        }
        if !stresses.is_empty() {
            solid = at(solid.with_added_stresses(stresses))?;
        }
        let relaxing = self.relaxation(&regions)?;
        if !relaxing.is_empty() {
            solid = at(solid.with_relaxation(&relaxing))?;
        }
        Ok((solid, opposed_fibers))
    }

    /// Ties undetermined pressures to neighboring pressures and adds a note. A pressure is undetermined if no
    /// displacement affects it.
    fn with_pressures_held(&self, space: Space, dofs: &DofMap) -> Result<Space, InputError> {
        let (space, held) = space.with_held_pressures_tied(dofs);
        let place = |vertex: usize| written(space.node_point(vertex));
        if let Some(&vertex) = held.undetermined.first() {
            let error = InputError::new(format!(
                "bulk_modulus = inf, but all nodes of the part around vertex {vertex} at ({}) are fixed or moved: no equation determines its pressure",
                place(vertex)
            ))
            .next("remove that part from the mesh, and fix or move its boundary instead")
            .next("or use a finite bulk_modulus");
            return Err(self.wrong(&support_of(self.file, &space, vertex), error));
        }
        if let Some(&vertex) = held.tied.first() {
            let more = and_more(held.tied.len());
            self.notes.borrow_mut().push(format!(
                "all nodes of the elements at vertex {vertex} at ({}){more} are fixed: for bulk_modulus = inf the pressure there equals the pressure at another vertex of the element",
                place(vertex)
            ));
        }
        Ok(space)
    }

    /// If the volume conditions of pressures follow from other conditions, ties these pressures to neighboring ones and
    /// adds a note.
    fn with_independent_pressures(
        &self,
        space: Space,
        dofs: &DofMap,
    ) -> Result<Arc<Space>, InputError> {
        let mut space = Arc::new(space);
        // Conditions of several elements may depend on each other, so one pass may not suffice.
        for _ in 0..MAX_TIES {
            let dependent = self.at("mesh", dependent_pressures(&space, dofs))?;
            let Some(&first) = dependent.first() else {
                return Ok(space);
            };
            let vertex = space.pressure_vertices()[first];
            let more = and_more(dependent.len());
            self.notes.borrow_mut().push(format!(
                "too few nodes are free to determine the pressure at vertex {vertex} at ({}){more}: for bulk_modulus = inf it equals the pressure at another vertex of the element",
                written(space.node_point(vertex))
            ));
            space = Arc::new(space.as_ref().clone().with_pressures_tied(&dependent));
        }
        let error = InputError::new(
            "bulk_modulus = inf, but too few nodes are free to determine the pressures",
        )
        .next("fix or move fewer nodes, or refine the mesh")
        .next("or use a finite bulk_modulus");
        Err(self.wrong("solid.bulk_modulus", error))
    }

    fn volume_function(
        &self,
        solid: &solid::Solid,
        parameters: &Parameters,
    ) -> Result<VolumeFunction, InputError> {
        match solid.volumetric_energy {
            VolumetricEnergy::Quadratic => Ok(VolumeFunction::Quadratic),
            VolumetricEnergy::Logarithmic if parameters.is_incompressible() => {
                let error = InputError::new("an incompressible body has no volumetric energy")
                    .next("remove `volumetric_energy`, or use a finite bulk_modulus");
                Err(self.wrong("solid.volumetric_energy", error))
            }
            VolumetricEnergy::Logarithmic => Ok(VolumeFunction::Logarithmic),
        }
    }

    /// Returns κ, α and β of each material, or of the body if there are no materials. κ must be infinite for all
    /// materials or for none, and β must be zero for all materials or for none.
    fn parameters(&self, solid: &solid::Solid) -> Result<Vec<Parameters>, InputError> {
        let whole =
            Parameters::new(solid.rayleigh_mass, solid.rayleigh_stiffness, solid.bulk_modulus.0);
        let mut parameters = Vec::new();
        for (i, own) in self.file.material.iter().enumerate() {
            let one = Parameters::new(
                own.rayleigh_mass.unwrap_or(solid.rayleigh_mass),
                own.rayleigh_stiffness.unwrap_or(solid.rayleigh_stiffness),
                own.bulk_modulus.unwrap_or(solid.bulk_modulus).0,
            );
            let one = self.at(&format!("material[{i}]"), one)?;
            let first = *parameters.first().unwrap_or(&one);
            let differs = |which: fn(&Parameters) -> bool| which(&one) != which(&first);
            let (key, problem, value) = match () {
                () if differs(Parameters::is_incompressible) => (
                    "bulk_modulus",
                    "bulk_modulus = inf combined with a finite value",
                    "`bulk_modulus` = inf",
                ),
                () if differs(Parameters::is_damped) => (
                    "rayleigh_stiffness",
                    "rayleigh_stiffness > 0 combined with 0",
                    "`rayleigh_stiffness` > 0",
                ),
                () => {
                    parameters.push(one);
                    continue;
                }
            };
            let error = InputError::new(format!(
                "{problem}: the equations of the materials would have different indices"
            ))
            .next(format!("set {value} in all materials, or in none"));
            return Err(self.wrong(&format!("material[{i}].{key}"), error));
        }
        match parameters.is_empty() {
            true => Ok(vec![self.at("solid", whole)?]),
            false => Ok(parameters),
        }
    }

    /// Rejects a formulation with pressure if the energy of a law already contains the volumetric part.
    fn check_complete(&self, laws: &[Law], formulation: Formulation) -> Result<(), InputError> {
        let mut descriptions = laws.iter().map(|law| law.description());
        match descriptions.find(|law| law.complete) {
            Some(law) if formulation != Formulation::Displacement => {
                let error = InputError::new(format!(
                    "the law {} has a volumetric part other than -κ (J-1)",
                    law.name
                ))
                .next("use the formulation `displacement`, or deviatoric-st-venant-kirchhoff");
                Err(self.wrong("solid.formulation", error))
            }
            _ => Ok(()),
        }
    }
}

/// Creates Taylor–Hood elements whose pressure may jump between materials. `regions` contains the index of each
/// element's material. If any constant differs between materials, the stress jumps, and so must the pressure.
fn taylor_hood(mesh: &Mesh, regions: &[usize]) -> Result<Space, FemError> {
    let space = Space::taylor_hood(mesh);
    match regions.iter().all(|region| *region == regions[0]) {
        true => Ok(space),
        false => space.with_regions(regions),
    }
}

/// Returns the formulation with the lowest index among all formulations that have a pressure field and are compatible
/// with κ and β.
fn suited(parameters: &Parameters) -> Formulation {
    match (parameters.is_damped(), parameters.is_incompressible()) {
        (true, _) => Formulation::ImplicitRate,
        (false, true) => Formulation::Velocity,
        (false, false) => Formulation::Position,
    }
}

/// Returns the key of the group that fixes or moves a node.
fn support_of(file: &SceneFile, space: &Space, node: usize) -> String {
    let fixed = file.fixed.iter().map(|own| ("fixed", &own.group));
    let moved = file.prescribed_displacement.iter();
    let moved = moved.map(|own| ("prescribed_displacement", &own.group));
    let holds = |(_, (_, group)): &(usize, (_, &String))| {
        space.nodes_of(group).is_ok_and(|nodes| nodes.contains(&node))
    };
    let all = fixed.enumerate().chain(moved.enumerate());
    let support = all.into_iter().find(holds);
    support.map_or("fixed".to_owned(), |(i, (kind, _))| format!("{kind}[{i}].group"))
}
