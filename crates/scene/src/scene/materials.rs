//! Materials of a body: law, density and fiber directions of each element.

use std::collections::BTreeSet;

use myovib_fem::material::three::Axes;
use myovib_fem::material::unit_vector;
use myovib_fem::mesh::NodalField;
use myovib_fem::{FemError, Fibers, Group, Law, Mesh};

use super::builder::Builder;
use super::distribution::point;
use crate::InputError;
use crate::scene_file::material::{Direction, Material};
use crate::scene_file::solid::SpatialFactor;

/// Remedy for missing fibers.
pub(super) const GIVE_FIBER: &str =
    "give `fiber`: a vector such as [1, 0, 0], or the name of a nodal field of the mesh file";

pub(super) struct Materials {
    pub(super) laws: Vec<Law>,
    /// Mass density (kg/m³) of each element.
    pub(super) densities: Vec<f64>,
    pub(super) regions: Vec<usize>,
    /// Fiber directions, if a material defines them.
    pub(super) fibers: Option<Fibers>,
    /// Stress factor at each vertex of each element, if a material defines such factors.
    pub(super) factors: Option<Vec<f64>>,
}

impl Builder<'_> {
    /// Returns the laws, densities and fibers of the elements. A material without a group applies to the elements that
    /// no other material covers.
    pub(super) fn materials(&self, mesh: &Mesh) -> Result<Materials, InputError> {
        let mut given: Vec<Option<usize>> = vec![None; mesh.n_elements()];
        let (mut fibers, mut factors) = (None, None);
        let numbered = || self.file.material.iter().enumerate();
        let of_groups = numbered().filter(|(_, material)| material.group.is_some());
        let of_the_rest = numbered().filter(|(_, material)| material.group.is_none());
        if let Some((i, _)) = of_the_rest.clone().nth(1) {
            let error = InputError::new("a second material has no group")
                .next("select its elements with `group`");
            return Err(self.wrong(&format!("material[{i}]"), error));
        }
        for (i, material) in of_groups.chain(of_the_rest) {
            let path = format!("material[{i}]");
            let members: Vec<usize> = match &material.group {
                Some(_) => self.elements(material.group.as_deref(), mesh, &path)?,
                None => {
                    let free = given.iter().enumerate().filter(|(_, one)| one.is_none());
                    free.map(|(element, _)| element).collect()
                }
            };
            for &element in &members {
                if let Some(other) = given[element] {
                    let error = InputError::new(format!(
                        "{} {element} has two materials",
                        mesh.shape().name
                    ))
                    .found(format!("material[{other}] and material[{i}]"))
                    .next("use groups that do not overlap; a material without `group` covers all other elements");
                    return Err(self.wrong(&path, error));
                }
                given[element] = Some(i);
            }
            self.stiffness(material, &path)?;
            self.directions(material, &path)?;
            if let Some(fiber) = &material.fiber {
                let all = fibers.get_or_insert_with(|| Fibers::new(mesh));
                let sheet = material.sheet.as_ref();
                self.set_fibers(all, mesh, &members, fiber, sheet, &path)?;
            }
            if let Some(factor) = &material.spatial_factor {
                let n = mesh.shape().n_vertices();
                let all = factors.get_or_insert_with(|| vec![1.0; n * mesh.n_elements()]);
                self.set_factors(all, mesh, &members, factor, &path)?;
                if material.prony.as_ref().is_some_and(|terms| !terms.is_empty()) {
                    let error =
                        InputError::new("a material with `prony` cannot have a `spatial_factor`")
                            .next("use `viscosity`, or several materials with different constants");
                    return Err(self.wrong(&format!("{path}.spatial_factor"), error));
                }
            }
        }
        let without = given.iter().filter(|one| one.is_none()).count();
        let regions = given.into_iter().collect::<Option<Vec<usize>>>();
        let regions = regions.ok_or_else(|| {
            let plural = mesh.shape().plural;
            let error = InputError::new(format!("{without} {plural} have no material")).next(
                "add a [[material]] for their group, or one without `group` for all of them; \
                     exclude rigid parts from the mesh, and fix or move their surface instead",
            );
            self.wrong("material", error)
        })?;
        let of = |region: &usize| &self.file.material[*region];
        let laws = (0..self.file.material.len()).map(|i| self.law(i));
        let laws = laws.collect::<Result<Vec<Law>, _>>()?;
        Ok(Materials {
            laws: regions.iter().map(|region| laws[*region]).collect(),
            densities: regions.iter().map(|region| of(region).density).collect(),
            regions,
            fibers,
            factors,
        })
    }

    fn law(&self, i: usize) -> Result<Law, InputError> {
        let material = &self.file.material[i];
        match self.at(&format!("material[{i}].stress_scale"), material.stiffened())? {
            // Viscous stresses require a law for finite strains. At rest, such a law is equivalent to the law for small
            // strains.
            Law::SmallStrain { shear_modulus } if material.is_viscous() => {
                self.expect_rest(&format!("material[{i}]"))?;
                Ok(Law::MooneyRivlin { c10: 0.5 * shear_modulus, c01: 0.0 })
            }
            law => Ok(law),
        }
    }

    /// Sets the stress factors of a material at the vertices of its elements.
    fn set_factors(
        &self,
        factors: &mut [f64],
        mesh: &Mesh,
        members: &[usize],
        given: &SpatialFactor,
        path: &str,
    ) -> Result<(), InputError> {
        let factor = self.factor(Some(given), mesh, 0, path)?;
        let n = mesh.shape().n_vertices();
        let mut smallest = (f64::INFINITY, &[][..]);
        for &element in members {
            for (k, &vertex) in mesh.element(element).iter().enumerate() {
                let place = point(mesh, vertex);
                let value = factor.at(&[vertex], &[1.0], place);
                factors[n * element + k] = value;
                if value < smallest.0 {
                    smallest = (value, place);
                }
            }
        }
        self.finite(factor)?;
        match smallest {
            (value, _) if value > 0.0 => Ok(()),
            (value, place) => {
                let error =
                    InputError::new(format!("the stress factor at {place:?} is not positive"))
                        .found(value)
                        .allowed("positive values at the vertices of the material");
                Err(self.wrong(&format!("{path}.spatial_factor"), error))
            }
        }
    }

    /// Returns the elements of a group, or all elements if no group is given.
    pub(super) fn elements(
        &self,
        group: Option<&str>,
        mesh: &Mesh,
        path: &str,
    ) -> Result<Vec<usize>, InputError> {
        let Some(name) = group else {
            return Ok((0..mesh.n_elements()).collect());
        };
        let place = format!("{path}.group");
        match self.at(&place, mesh.group_of_dimension(name, mesh.dimension()))? {
            Group::Elements(members) => Ok(members.clone()),
            _ => {
                let plural = mesh.shape().plural;
                let with: BTreeSet<&str> = mesh
                    .groups()
                    .iter()
                    .filter(|(_, group)| matches!(group, Group::Elements(_)))
                    .map(|(name, _)| name.as_str())
                    .collect();
                let error = InputError::new(format!("the group `{name}` contains no {plural}"))
                    .allowed(with.into_iter().collect::<Vec<_>>().join(", "));
                Err(self.wrong(&place, error))
            }
        }
    }

    /// Rejects a law whose moduli are all zero. Individual moduli may be zero.
    fn stiffness(&self, material: &Material, path: &str) -> Result<(), InputError> {
        let law = material.law.law;
        let constants = law.description().parameters.iter().zip(law.values());
        let (names, moduli): (Vec<&str>, Vec<f64>) = constants
            .filter(|(constant, _)| constant.unit == "Pa")
            .map(|(constant, modulus)| (constant.name, modulus))
            .unzip();
        if moduli.is_empty() || moduli.iter().any(|modulus| *modulus != 0.0) {
            return Ok(());
        }
        let error = InputError::new("the material has no stiffness: all its moduli are 0")
            .next(format!("set at least one of them above 0: {}", names.join(", ")));
        Err(self.wrong(path, error))
    }

    /// Rejects a fiber law without fibers, a law without the sheets that it needs, and sheets without fibers.
    fn directions(&self, material: &Material, path: &str) -> Result<(), InputError> {
        let law = material.law.law;
        let name = law.description().name;
        if law.has_fibers() && material.fiber.is_none() {
            let error =
                InputError::new(format!("the law {name} needs the direction of its fibers"))
                    .next(GIVE_FIBER);
            return Err(self.wrong(path, error));
        }
        if material.sheet.is_some() && material.fiber.is_none() {
            let error = InputError::new("sheets without fibers").next(GIVE_FIBER);
            return Err(self.wrong(&format!("{path}.sheet"), error));
        }
        if material.sheet.is_none() && has_sheets(law) {
            let error =
                InputError::new(format!("the law {name} needs the direction of its sheets"))
                    .next("set `sheet` in the same form as `fiber`");
            return Err(self.wrong(path, error));
        }
        Ok(())
    }

    /// Assigns the directions of a material to its elements.
    fn set_fibers(
        &self,
        fibers: &mut Fibers,
        mesh: &Mesh,
        members: &[usize],
        fiber: &Direction,
        sheet: Option<&Direction>,
        path: &str,
    ) -> Result<(), InputError> {
        let (of_fiber, of_sheet) = (format!("{path}.fiber"), format!("{path}.sheet"));
        match (fiber, sheet) {
            (Direction::Vector(fiber), None | Some(Direction::Vector(_))) => {
                let fiber = self.vector(fiber, mesh, &of_fiber)?;
                let sheet = match sheet {
                    Some(Direction::Vector(sheet)) => Some(self.vector(sheet, mesh, &of_sheet)?),
                    _ => None,
                };
                if sheet.is_some_and(|sheet| are_parallel(fiber, sheet)) {
                    let error = InputError::new("the sheets are parallel to the fibers")
                        .next("set a direction across the fibers");
                    return Err(self.wrong(&of_sheet, error));
                }
                self.at(&of_fiber, fibers.set_constant(mesh, members, fiber, sheet))
            }
            (Direction::Field(fiber), None | Some(Direction::Field(_))) => {
                let sheet = match sheet {
                    Some(Direction::Field(sheet)) => Some(sheet.as_str()),
                    _ => None,
                };
                let set = fibers.set_nodal(mesh, members, fiber, sheet);
                set.map_err(|error| {
                    let place = match (&error, sheet) {
                        (FemError::UnknownField { name, .. }, Some(sheet)) if name == sheet => {
                            &of_sheet
                        }
                        (FemError::Direction { field, .. }, Some(sheet)) if field == sheet => {
                            &of_sheet
                        }
                        _ => &of_fiber,
                    };
                    self.wrong(place, about_field(error, mesh))
                })?;
                let along = |&element: &usize| runs_along(mesh, element, fiber, sheet?);
                match members.iter().find_map(along) {
                    None => Ok(()),
                    Some(element) => {
                        let error = InputError::new("the sheets are parallel to the fibers")
                            .found(format!("at all vertices of {} {element}", mesh.shape().name))
                            .next("set a direction across the fibers");
                        Err(self.wrong(&of_sheet, error))
                    }
                }
            }
            _ => {
                let error = InputError::new("`fiber` and `sheet` are of different kinds")
                    .next("use two vectors, or the names of two nodal fields");
                Err(self.wrong(&of_sheet, error))
            }
        }
    }

    /// Returns a direction from its components. In 2D, the third component is optional.
    pub(super) fn vector(
        &self,
        given: &[f64],
        mesh: &Mesh,
        path: &str,
    ) -> Result<[f64; 3], InputError> {
        let wrong = |problem: String| Err(self.wrong(path, InputError::new(problem)));
        let vector = match (given, mesh.dimension()) {
            (&[x, y], 2) => [x, y, 0.0],
            (&[x, y, z], _) => [x, y, z],
            _ => return wrong("a direction in space has three components".to_owned()),
        };
        if vector == [0.0; 3] {
            return wrong("a direction cannot be zero".to_owned());
        }
        if mesh.dimension() == 2 && unit_vector(vector)[2].abs() > 1e-10 {
            return wrong(
                "directions of a plane body must lie in its plane: z must be 0".to_owned(),
            );
        }
        Ok(vector)
    }
}

/// Converts the error of a nodal field to an input error that includes the position of the node.
fn about_field(error: FemError, mesh: &Mesh) -> InputError {
    match error {
        FemError::UnknownField { name, known } => {
            let error = InputError::new(format!("the mesh has no nodal field `{name}`"));
            match known.is_empty() {
                true => error
                    .found("a mesh without $NodeData")
                    .next("use a vector, such as [1, 0, 0], or add the field to the mesh file"),
                false => error.allowed(known.join(", ")),
            }
        }
        FemError::Direction { field, node, vector, problem } => {
            let dimension = mesh.dimension();
            let place = usize::try_from(node).ok();
            let place =
                place.and_then(|n| mesh.coordinates().get(dimension * n..dimension * (n + 1)));
            let missing = vector.iter().any(|x| x.is_nan());
            let problem = match missing {
                true => "missing or not a number",
                false => problem,
            };
            InputError::new(format!(
                "the nodal field `{field}` is {problem} at the vertex {place:?}",
                place = place.unwrap_or_default()
            ))
            .found(format!("{vector:?}"))
            .next("add a direction at each vertex of the group")
        }
        error => InputError::new(error),
    }
}

/// Returns `element` if the nodal fields `sheet` and `fiber` are parallel at all its vertices.
fn runs_along(mesh: &Mesh, element: usize, fiber: &str, sheet: &str) -> Option<usize> {
    let (fiber, sheet) = (mesh.field(fiber).ok()?, mesh.field(sheet).ok()?);
    let vector = |field: &NodalField, vertex| <[f64; 3]>::try_from(field.at(vertex)).ok();
    let parallel = |&v: &usize| Some(are_parallel(vector(fiber, v)?, vector(sheet, v)?));
    let vertices = mesh.element(element).iter();
    vertices.map(parallel).all(|parallel| parallel == Some(true)).then_some(element)
}

fn are_parallel(a: [f64; 3], b: [f64; 3]) -> bool {
    let (a, b) = (unit_vector(a), unit_vector(b));
    let across = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    // Interpolation uses the same criterion for parallel vectors.
    length(across) <= 1e-6
}

/// Returns whether a law distinguishes between directions normal to its fibers. The test rotates the sheets about the
/// fiber and compares the energies of a strain without symmetry. The tolerance covers rounding.
fn has_sheets(law: Law) -> bool {
    if !law.has_fibers() {
        return false;
    }
    let strain = [[0.11, 0.05, -0.03], [0.02, 0.07, 0.04], [0.01, -0.06, 0.09]];
    let energy = |sheet| {
        let fiber = [1.0, 0.0, 0.0];
        law.energy3(strain, Axes { fiber, sheet })
    };
    let (along_y, turned) = (energy([0.0, 1.0, 0.0]), energy([0.0, 0.6, 0.8]));
    (along_y - turned).abs() > 1e-10 * along_y.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sheets_are_required_only_by_laws_that_use_them() {
        let guccione =
            Law::named("guccione", &[("c", 2e3), ("b_f", 8.0), ("b_t", 2.0), ("b_fs", 4.0)]);
        assert!(!has_sheets(guccione.unwrap()));
        let heart = |a_s| {
            let constants = [
                ("a", 59.0),
                ("b", 8.023),
                ("a_f", 18472.0),
                ("b_f", 16.026),
                ("a_s", a_s),
                ("b_s", 11.12),
                ("a_fs", 0.0),
                ("b_fs", 11.436),
            ];
            Law::named("holzapfel-ogden", &constants).unwrap()
        };
        assert!(has_sheets(heart(2481.0)));
        assert!(!has_sheets(heart(0.0)));
    }
}
