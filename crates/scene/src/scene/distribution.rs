//! Spatial variation of loads and motions.

use std::cell::OnceCell;

use exmex::Express;
use myovib_fem::mesh::{Mesh, NodalField};

use super::builder::Builder;
use super::supports::NAMES;
use crate::InputError;
use crate::expression;
use crate::scene_file::solid::SpatialFactor;

/// Spatial factor of one component of a load or motion.
pub(super) struct Factor<'m> {
    values: Values<'m>,
    mesh: &'m Mesh,
    /// Key and error of the first non-finite value.
    undefined: OnceCell<(String, InputError)>,
    path: String,
}

/// Function of a position.
type OfPlace = dyn Fn(&[f64]) -> f64;

enum Values<'m> {
    One,
    Expression { text: &'m str, of: Box<OfPlace> },
    Nodal { name: &'m str, field: &'m NodalField, component: usize },
}

impl Factor<'_> {
    /// Returns the factor at `place`, a position between `vertices` with the given interpolation `weights`.
    pub(super) fn at(&self, vertices: &[usize], weights: &[f64], place: &[f64]) -> f64 {
        match &self.values {
            Values::One => 1.0,
            Values::Expression { text, of } => {
                let factor = of(place);
                if !factor.is_finite() {
                    self.undefined.get_or_init(|| {
                        let error = InputError::new(format!(
                            "the spatial factor `{text}` has no finite value at {place:?}"
                        ));
                        let error = error
                            .found(factor)
                            .next("use an expression that is finite on the whole group");
                        (self.path.clone(), error)
                    });
                }
                factor
            }
            Values::Nodal { name, field, component } => {
                let given = |vertex: usize| field.at(vertex)[*component];
                let missing = vertices.iter().find(|&&vertex| !given(vertex).is_finite());
                if let Some(&vertex) = missing {
                    self.undefined.get_or_init(|| {
                        let place = point(self.mesh, vertex);
                        let error = InputError::new(format!(
                            "the nodal field `{name}` has no value at vertex {vertex} at {place:?}"
                        ));
                        let error = error.next("add a finite value at each vertex of the group");
                        (format!("{}.field", self.path), error)
                    });
                }
                let parts = weights.iter().zip(vertices);
                parts.fold(0.0, |sum, (weight, &vertex)| sum + weight * given(vertex))
            }
        }
    }
}

pub(super) fn point(mesh: &Mesh, vertex: usize) -> &[f64] {
    let dimension = mesh.dimension();
    &mesh.coordinates()[dimension * vertex..][..dimension]
}

impl Builder<'_> {
    /// Returns the factor of the component `axis` that the distribution in the table at `path` defines.
    pub(super) fn factor<'m>(
        &self,
        distribution: Option<&'m SpatialFactor>,
        mesh: &'m Mesh,
        axis: usize,
        path: &str,
    ) -> Result<Factor<'m>, InputError> {
        let path = format!("{path}.spatial_factor");
        let values = match distribution {
            None => Values::One,
            Some(SpatialFactor::Expression(text)) => Values::Expression {
                text,
                of: Box::new(self.expression_of_place(text, mesh.dimension(), &path)?),
            },
            Some(SpatialFactor::Nodal(nodal)) => {
                let field = self.nodal_factors(mesh, &nodal.field, &format!("{path}.field"))?;
                Values::Nodal {
                    name: &nodal.field,
                    field,
                    component: if field.components == 1 { 0 } else { axis },
                }
            }
        };
        let undefined = OnceCell::new();
        Ok(Factor { values, mesh, undefined, path })
    }

    /// Rejects a factor with a non-finite value.
    pub(super) fn finite(&self, factor: Factor<'_>) -> Result<(), InputError> {
        match factor.undefined.into_inner() {
            Some((key, error)) => Err(self.wrong(&key, error)),
            None => Ok(()),
        }
    }

    /// Parses the text at `key` as a function of position.
    fn expression_of_place(
        &self,
        text: &str,
        dimension: usize,
        key: &str,
    ) -> Result<impl Fn(&[f64]) -> f64 + use<>, InputError> {
        let wrong = |message: String| {
            let error = InputError::new(message).found(format!("\"{text}\""));
            let coordinates = NAMES[..dimension].join(", ");
            self.wrong(
                key,
                error
                    .allowed(format!("an expression in {coordinates}, such as \"1 - (y/0.02)^2\"")),
            )
        };
        let expression = expression::parse(text)
            .map_err(|error| wrong(format!("the spatial factor is not an expression: {error}")))?;
        let axis = |name: &String| NAMES[..dimension].iter().position(|known| known == name);
        let variables = expression.var_names().iter();
        let axes = variables
            .map(|name| axis(name).ok_or_else(|| wrong(format!("`{name}` is not a coordinate"))))
            .collect::<Result<Vec<usize>, _>>()?;
        Ok(move |place: &[f64]| {
            let values: Vec<f64> = axes.iter().map(|&axis| place[axis]).collect();
            expression.eval(&values).unwrap_or(f64::NAN)
        })
    }

    /// Returns the nodal field `name`, which has one or three values per vertex.
    fn nodal_factors<'m>(
        &self,
        mesh: &'m Mesh,
        name: &str,
        key: &str,
    ) -> Result<&'m NodalField, InputError> {
        let field = self.at(key, mesh.field(name))?;
        if [1, 3].contains(&field.components) {
            return Ok(field);
        }
        let error = InputError::new(format!("the nodal field `{name}` cannot be a factor"))
            .found(format!("{} values at each node", field.components))
            .allowed("one for all components, or one for each of three");
        Err(self.wrong(key, error))
    }
}
