//! Elements turned inside out where no force is summed: a run goes on with them, and has to say so.

use myovib_model::Snapshot;
use serde::{Deserialize, Serialize};

/// A vertex of an element with det F ≤ 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Inversion {
    /// When it was seen first, s.
    t: f64,
    element: usize,
    /// det F there.
    jacobian: f64,
    /// The vertex at rest, m.
    at: Vec<f64>,
}

impl Inversion {
    /// The worst of the body at time `t`, if there is one.
    pub(super) fn of(t: f64, snapshot: &Snapshot<'_>) -> Option<Self> {
        let inverted = snapshot.solid.inverted_vertex(snapshot.displacement)?;
        let space = snapshot.solid.space();
        let vertices = space.element_nodes(inverted.element).iter();
        let mut weighed = vertices.zip(inverted.barycentric.iter());
        let vertex = weighed.find(|(_, lambda)| **lambda > 0.0);
        Some(Self {
            t,
            element: inverted.element,
            jacobian: inverted.jacobian,
            at: vertex.map_or_else(Vec::new, |(&node, _)| space.node_point(node).to_vec()),
        })
    }

    /// What to say of it; `is_motion`: whether its time tells something.
    pub(super) fn note(&self, is_motion: bool) -> String {
        let place: Vec<String> = self.at.iter().map(|x| format!("{x:.4}")).collect();
        let (element, jacobian, place) = (self.element, self.jacobian, place.join(", "));
        let when = match is_motion {
            true => format!(", first seen at t = {:.6} s", self.t),
            false => String::new(),
        };
        format!(
            "an element is turned inside out{when}: det F = {jacobian:.3} at the vertex ({place}) of element \
             {element}. Forces are summed between the vertices and do not see it: the result is no \
             deformation of a body there. Refine the mesh there, or let the load rise less far"
        )
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use myovib_dae::Problem;
    use myovib_model::{Field, MuscleDae};

    use super::*;
    use crate::Scene;

    /// Regression: a motion that turned elements inside out ended without a word.
    #[test]
    fn a_vertex_turned_inside_out_is_told_with_its_place() {
        let text = "[time]\nend = 1.0\n[mesh]\ntype = \"rectangle\"\nwidth = 1.0\nheight = 1.0\ncells = [4, 3]\n\
                    [solid]\nkappa = 1e5\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
                    [[fixed]]\ngroup = \"left\"\n";
        let scene = Scene::build("scene.toml", text, &[], Path::new("")).unwrap();
        let body = scene.body.unwrap();
        let mut dae = MuscleDae::new(body.muscle, body.formulation).unwrap();
        let own = dae.layout().range(Field::Displacement).unwrap();
        let mut seen = |factor: f64| {
            let mut y = vec![0.0; dae.n_unknowns()];
            let solid = &dae.muscle().solid;
            // u = (-factor x², 0): det F = 1 - 2 factor x.
            let places = solid.dofs().free_to_full().iter();
            for (y, component) in y[own.clone()].iter_mut().zip(places) {
                let x = solid.space().node_point(component / 2)[0];
                *y = match component % 2 {
                    0 => -factor * x * x,
                    _ => 0.0,
                };
            }
            Inversion::of(0.5, &dae.snapshot(0.5, &y, &[]))
        };
        assert_eq!(seen(0.49), None);
        let found = seen(0.502).expect("the right side");
        assert_eq!(found.at[0], 1.0);
        let said = found.note(true);
        assert!(said.contains("t = 0.500000 s: det F = -0.004 at"), "{said}");
    }
}
