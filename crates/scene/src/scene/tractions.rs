//! Tractions and how they vary along their group.

use std::cell::Cell;

use exmex::Express;
use myovib_fem::mesh::{Mesh, NodalField};
use myovib_fem::{Space, load};

use super::builder::Builder;
use super::loads::unit;
use super::supports::NAMES;
use crate::InputError;
use crate::expression::Expression;
use crate::scene_file::solid::{Distribution, Traction};

impl Builder<'_> {
    /// The load of 1 Pa along an axis times the traction's distribution.
    pub(super) fn unit_traction<const D: usize>(
        &self,
        traction: &Traction,
        space: &Space,
        axis: usize,
        path: &str,
    ) -> Result<Vec<f64>, InputError> {
        let along = |size: f64| unit::<D>(axis).map(|direction| size * direction);
        let (group, key) = (&traction.group, format!("{path}.distribution"));
        let load = match &traction.distribution {
            None => load::traction(space, group, along(1.0)),
            Some(Distribution::Expression(text)) => {
                let expression = self.expression_of_place::<D>(text, &key)?;
                let undefined = Cell::new(None);
                let load = load::traction_field(space, group, |place| {
                    let factor = expression(place);
                    if !factor.is_finite() {
                        undefined.set(Some((place, factor)));
                    }
                    along(factor)
                });
                if let Some((place, factor)) = undefined.get() {
                    let error = InputError::new(format!(
                        "the distribution `{text}` has no finite value at {place:?}"
                    ))
                    .found(factor)
                    .next("give an expression that is finite all over the group");
                    return Err(self.wrong(&key, error));
                }
                load
            }
            Some(Distribution::Nodal(nodal)) => {
                let mesh = space.mesh();
                let field = self.nodal_factors::<D>(mesh, &nodal.field, traction, path)?;
                let component = if field.components == 1 { 0 } else { axis };
                load::nodal_traction(space, group, |v| along(field.at(v)[component]))
            }
        };
        self.at(&format!("{path}.group"), load)
    }

    /// The function of place that the text at `key` says.
    fn expression_of_place<const D: usize>(
        &self,
        text: &str,
        key: &str,
    ) -> Result<impl Fn([f64; D]) -> f64 + use<D>, InputError> {
        let wrong = |message: String| {
            let error = InputError::new(message).found(format!("\"{text}\""));
            let coordinates = NAMES[..D].join(", ");
            self.wrong(
                key,
                error.allowed(format!(
                    "an expression of {coordinates}, as \"1 - (y/0.02)^2\""
                )),
            )
        };
        let expression = Expression::parse(text)
            .map_err(|error| wrong(format!("the distribution is no expression: {error}")))?;
        let axis = |name: &String| NAMES[..D].iter().position(|known| known == name);
        let variables = expression.var_names().iter();
        let axes = variables
            .map(|name| axis(name).ok_or_else(|| wrong(format!("`{name}` is no coordinate"))))
            .collect::<Result<Vec<usize>, _>>()?;
        Ok(move |place: [f64; D]| {
            let values: Vec<f64> = axes.iter().map(|&axis| place[axis]).collect();
            expression.eval(&values).unwrap_or(f64::NAN)
        })
    }

    /// The nodal field `name`, with one or three finite values at each vertex of the group.
    fn nodal_factors<'m, const D: usize>(
        &self,
        mesh: &'m Mesh,
        name: &str,
        traction: &Traction,
        path: &str,
    ) -> Result<&'m NodalField, InputError> {
        let key = format!("{path}.distribution.field");
        let field = self.at(&key, mesh.field(name))?;
        if ![1, 3].contains(&field.components) {
            let error = InputError::new(format!("the nodal field `{name}` is no factor"))
                .found(format!("{} values at each node", field.components))
                .allowed("one for all components, or three, one for each");
            return Err(self.wrong(&key, error));
        }
        let facets = self.at(&format!("{path}.group"), mesh.facets(&traction.group))?;
        let is_missing = |vertex: &usize| !field.at(*vertex).iter().all(|v| v.is_finite());
        match facets.into_iter().flatten().copied().find(is_missing) {
            None => Ok(field),
            Some(vertex) => {
                let place = mesh.points::<D>()[vertex];
                let error = InputError::new(format!(
                    "the nodal field `{name}` has no value at vertex {vertex} at {place:?}"
                ))
                .next("give it a finite value at each vertex of the group");
                Err(self.wrong(&key, error))
            }
        }
    }
}
