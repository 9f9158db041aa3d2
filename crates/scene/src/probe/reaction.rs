//! Force of the supports at a group.

use std::iter::Sum;

use myovib_fem::{Group, Solid};
use myovib_model::ModelError;
use num_complex::Complex64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::column::ColumnKind;
use super::kind::{HarmonicMotion, InvalidPlace, Kind, Reading, StateAt, Wrong, at};
use super::moment::{self, Arms, MOMENT};
use crate::system::{System, muscle_of};
use crate::{InputError, Scene};

/// Force of a support on the body, N (in 2D, N/m); with `about`, also its moment, N·m (in 2D, N).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Reaction {
    /// Fixed or moved group.
    pub group: String,
    /// Point at rest about which the moment on the deformed body is computed, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 2, max = 3))]
    pub about: Option<Vec<f64>>,
}

/// Support force.
const FORCE: ColumnKind = ColumnKind::new("R", ["N/m", "N"]);

impl Kind for Reaction {
    fn columns() -> &'static [ColumnKind] {
        &[FORCE, MOMENT]
    }

    fn check_place(&self, solid: &Solid) -> Result<(), Wrong<InvalidPlace>> {
        moment::check(self.about.as_deref(), solid)?;
        let space = solid.space();
        let members = at(".group", space.mesh().group(&self.group))?;
        let dimension = space.dimension();
        let free = solid.dofs().free_to_full();
        let is_held = |node: usize| {
            (0..dimension).any(|axis| free.binary_search(&(dimension * node + axis)).is_err())
        };
        let whole = |facet: &[usize]| space.facet_nodes(facet).into_iter().all(is_held);
        // A group adjacent to a fixed group shares nodes with it, but no facets.
        let has_reaction = match members {
            Group::Edges(edges) => edges.iter().any(|edge| whole(edge)),
            Group::Faces(faces) => faces.iter().any(|face| whole(face)),
            Group::Points(_) | Group::Elements(_) => {
                space.nodes_on(members).into_iter().any(is_held)
            }
        };
        if has_reaction {
            return Ok(());
        }
        let group = &self.group;
        let error = InputError::new(format!(
            "no component of the group `{group}` is fixed, so it has no reaction"
        ));
        let error = error.next("name the group of a [[fixed]] or [[prescribed_displacement]]");
        Err((".group", InvalidPlace::Input(error)))
    }

    fn reading(&self, of: &Scene) -> Result<Box<dyn Reading>, ModelError> {
        let space = of.expect_body()?.muscle.solid.space();
        Ok(Box::new(Forces {
            nodes: space.nodes_of(&self.group)?,
            dimension: space.dimension(),
            arms: self.about.as_ref().map(|point| Arms::about(point, space)),
        }))
    }
}

/// Nodes whose support forces are summed, and the dimension of the body.
struct Forces {
    nodes: Vec<usize>,
    dimension: usize,
    arms: Option<Arms>,
}

impl Forces {
    /// Returns, for each axis, the sum of the nodal `force` over the nodes.
    fn sums<T: Copy + Sum>(&self, force: &[T]) -> Vec<T> {
        let of_node = |node: &usize, axis| force[self.dimension * node + axis];
        let sum = |axis| self.nodes.iter().map(|node| of_node(node, axis)).sum();
        (0..self.dimension).map(sum).collect()
    }
}

impl Reading for Forces {
    fn names(&self) -> Vec<String> {
        let moments = self.arms.iter().flat_map(Arms::names);
        FORCE.components(self.dimension).chain(moments).collect()
    }

    fn values(&self, system: &mut dyn System, at: StateAt<'_>) -> Result<Vec<f64>, ModelError> {
        let StateAt { t, y, y_dot } = at;
        let (dae, range) = muscle_of(system, y)?;
        let force = dae.unbalanced_force(t, &y[range.clone()], &y_dot[range.clone()])?;
        let mut values = self.sums(&force);
        if let Some(arms) = &self.arms {
            let (u, _) = dae.nodal_motion(t, &y[range]);
            values.extend(arms.moment(self.nodes.iter().copied(), u, &force));
        }
        Ok(values)
    }

    fn needs_rates(&self, _: &mut dyn System, _: &[f64]) -> bool {
        true
    }

    fn is_harmonic(&self) -> bool {
        true
    }

    fn amplitudes(&self, of: &HarmonicMotion<'_>) -> Result<Vec<Complex64>, ModelError> {
        let (stiffness, amplitude) = of.body()?;
        let reactions = stiffness.reactions(amplitude)?;
        let mut values = self.sums(&reactions);
        if let Some(arms) = &self.arms {
            let nodes = self.nodes.iter().copied();
            let (u, preload) = stiffness.preload();
            let moment = arms.moment(nodes.clone(), u, &reactions);
            // û × F₀ = −F₀ × û.
            let turned = arms.cross(nodes, |i| preload[i], &amplitude.displacement);
            values.extend(moment.into_iter().zip(turned).map(|(m, turned)| m - turned));
        }
        Ok(values)
    }
}
