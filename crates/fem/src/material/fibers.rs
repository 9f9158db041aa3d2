//! Fiber and sheet directions of a body.

use crate::element::quadrature::Rule;
use crate::error::FemError;
use crate::material::three::Axes;
use crate::material::{axes_at, check_direction, unit_vector};
use crate::mesh::Mesh;
use crate::space::ElementPoint;

/// Fiber and sheet directions at the vertices of each element, interpolated as signed vectors.
///
/// By default, fibers are along x, and sheets are along y.
///
/// # Examples
/// ```
/// use myovib_fem::{Fibers, generate};
/// let mesh = generate::block([0.0; 3], [1.0; 3], [1, 1, 1])?;
/// let mut fibers = Fibers::new(&mesh);
/// fibers.set_constant(&mesh, &[0, 1, 2], [0.0, 3.0, 4.0], None)?;
/// assert_eq!(fibers.axes(2, &[0.25; 4]).fiber, [0.0, 0.6, 0.8]);
/// # Ok::<(), myovib_fem::FemError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Fibers {
    elements: Vec<AtVertices>,
}

/// Unit vectors at the vertices of an element.
#[derive(Debug, Clone, Copy)]
struct AtVertices {
    fiber: [[f64; 3]; 4],
    sheet: Option<[[f64; 3]; 4]>,
}

impl Fibers {
    /// Creates a field with fibers along x in all elements.
    pub fn new(mesh: &Mesh) -> Self {
        let along = AtVertices { fiber: [[1.0, 0.0, 0.0]; 4], sheet: Some([[0.0, 1.0, 0.0]; 4]) };
        Self { elements: vec![along; mesh.n_elements()] }
    }

    /// Sets the same fiber direction and the same sheet direction in the given elements. If no sheet direction is
    /// given, the sheets have an arbitrary direction orthogonal to the fibers.
    ///
    /// # Errors
    /// Returns [`FemError::Direction`] if a vector is zero, not finite, or (in 2D) not in the plane.
    pub fn set_constant(
        &mut self,
        mesh: &Mesh,
        elements: &[usize],
        fiber: [f64; 3],
        sheet: Option<[f64; 3]>,
    ) -> Result<(), FemError> {
        check_direction("fiber", 0, fiber, mesh.dimension())?;
        if let Some(sheet) = sheet {
            check_direction("sheet", 0, sheet, mesh.dimension())?;
        }
        for &element in elements {
            self.elements[element] = AtVertices {
                fiber: [unit_vector(fiber); 4],
                sheet: sheet.map(|sheet| [unit_vector(sheet); 4]),
            };
        }
        Ok(())
    }

    /// Sets the directions of the given elements from nodal fields of the mesh.
    ///
    /// # Errors
    /// Returns [`FemError::UnknownField`] if a field does not exist, [`FemError::Count`] if a field does not have
    /// three components, or [`FemError::Direction`] if a vector is missing at a vertex, zero, not finite, or (in 2D)
    /// not in the plane.
    pub fn set_nodal(
        &mut self,
        mesh: &Mesh,
        elements: &[usize],
        fiber: &str,
        sheet: Option<&str>,
    ) -> Result<(), FemError> {
        for &element in elements {
            self.elements[element] = AtVertices {
                fiber: at_vertices(mesh, element, fiber)?,
                sheet: sheet.map(|sheet| at_vertices(mesh, element, sheet)).transpose()?,
            };
        }
        Ok(())
    }

    /// Returns the axes at a point of an element.
    pub fn axes(&self, element: usize, lambda: &[f64]) -> Axes<f64> {
        self.directed(element, lambda).axes
    }

    fn directed(&self, element: usize, lambda: &[f64]) -> crate::material::Directed {
        let AtVertices { fiber, sheet } = &self.elements[element];
        let n = lambda.len();
        axes_at(&fiber[..n], sheet.as_ref().map(|sheet| &sheet[..n]), lambda)
    }

    /// Returns the number of elements with two vertices at which the fibers differ by more than 120°. The mesh
    /// does not resolve the fiber field in these elements.
    pub fn unresolved(&self, mesh: &Mesh) -> usize {
        let n = mesh.shape().n_vertices();
        let far = |a: &[f64; 3], b: &[f64; 3]| {
            let dot = |x: &[f64; 3], y: &[f64; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
            dot(a, b) < -0.5 * (dot(a, a) * dot(b, b)).sqrt()
        };
        let is_unresolved = |at: &&AtVertices| {
            let fibers = &at.fiber[..n];
            fibers.iter().any(|a| fibers.iter().any(|b| far(a, b)))
        };
        self.elements.iter().filter(is_unresolved).count()
    }

    /// Returns the quadrature points at which the interpolated vector almost vanishes. At these points, the
    /// direction of the nearest vertex is used.
    pub fn opposed(&self, mesh: &Mesh, rule: Rule) -> Vec<ElementPoint> {
        let points = rule.points(mesh.shape());
        let places = (0..self.elements.len()).flat_map(|element| {
            points.iter().map(move |q| ElementPoint { element, barycentric: q.barycentric })
        });
        let opposed = |at: &ElementPoint| self.directed(at.element, &at.barycentric).nearest;
        places.filter(opposed).collect()
    }
}

/// Returns the vectors of a nodal field at the vertices of an element.
fn at_vertices(mesh: &Mesh, element: usize, name: &str) -> Result<[[f64; 3]; 4], FemError> {
    let field = mesh.field(name)?;
    if field.components != 3 {
        return Err(FemError::Count {
            what: "components of a direction field",
            found: field.components,
            needed: 3,
        });
    }
    let mut vectors = [[0.0; 3]; 4];
    for (vector, &vertex) in vectors.iter_mut().zip(mesh.element(element)) {
        vector.copy_from_slice(field.at(vertex));
        check_direction(name, vertex as u64, *vector, mesh.dimension())?;
        *vector = unit_vector(*vector);
    }
    Ok(vectors)
}

#[cfg(test)]
mod tests {
    use super::Fibers;
    use crate::generate;

    /// Regression: directions shorter than 1e-6 were replaced by the x axis.
    #[test]
    fn a_direction_may_have_any_length() {
        let mesh = generate::block([0.0; 3], [1.0; 3], [1, 1, 1]).unwrap();
        let axes = |length: f64| {
            let mut fibers = Fibers::new(&mesh);
            let scaled = |v: [f64; 3]| v.map(|x| length * x);
            let sheet = Some(scaled([1.0, 0.0, 1.0]));
            let set = fibers.set_constant(&mesh, &[0], scaled([0.0, 3.0, 4.0]), sheet);
            set.unwrap();
            fibers.axes(0, &[0.25; 4])
        };
        let unit = axes(1.0);
        for length in [1e-200, 1e-9, 1.1e-6, 1e200] {
            let found = axes(length);
            let pairs = [(found.fiber, unit.fiber), (found.sheet, unit.sheet)];
            for (found, expected) in pairs {
                for (a, b) in found.iter().zip(expected) {
                    // The error is a few roundings of the scaled components.
                    assert!((a - b).abs() < 8.0 * f64::EPSILON, "{length:e}");
                }
            }
        }
    }
}
