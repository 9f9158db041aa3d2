//! Volume ratios at the vertices of elements. Forces are integrated at points inside the elements, so the equations do
//! not detect inversions at the vertices.

use std::ops::RangeInclusive;

use myovib_fem::Solid;
use myovib_model::{EndReason, Muscle, MuscleDae, Outcome};
use serde::{Deserialize, Serialize};

/// Ratio of bulk to shear modulus above which a body counts as nearly incompressible; Poisson's ratio is then at least
/// 0.495.
const NEARLY_INCOMPRESSIBLE: f64 = 100.0;
/// Plausible range of det F in a nearly incompressible body. The actual volume changes of such a body are a few
/// percent.
const PLAUSIBLE: RangeInclusive<f64> = 0.5..=2.0;

/// Penetration, as a fraction of the facet size, above which the indentation of a body is less accurate than the mesh
/// allows. With the default stiffness, a contact pressure equal to the shear modulus causes a penetration of 0.01.
const LARGE_PENETRATION: f64 = 0.01;
/// Penetration, as a fraction of the facet size, above which an obstacle counts as being inside the body rather than at
/// its surface.
const INSIDE: f64 = 0.5;

/// Range of det F at the vertices of all elements, over all observed times. The equations contain only averages over
/// elements or, in formulations with pressure, weighted averages around vertices. Therefore, they do not detect an
/// inversion at a vertex.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Volumes {
    /// Smallest and largest det F; `None` before the first observation.
    ratios: Option<[f64; 2]>,
    inversion: Option<Inversion>,
    /// Largest penetration of all contacts, as a fraction of the facet size.
    penetration: f64,
}

/// Vertex of an element at which det F ≤ 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Inversion {
    /// Time (s) at which the inversion was first observed.
    t: f64,
    element: usize,
    /// det F at the vertex.
    jacobian: f64,
    /// Position of the vertex in the undeformed body (m).
    at: Vec<f64>,
}

impl Volumes {
    /// Updates the range with the volume ratios of the body at time `t`. `displacement` contains the displacements of
    /// all nodes.
    pub(crate) fn see(&mut self, t: f64, solid: &Solid, displacement: &[f64]) {
        let seen = solid.vertex_volume_ratios(displacement);
        let [smallest, largest] = self.ratios.unwrap_or([f64::INFINITY, f64::NEG_INFINITY]);
        self.ratios = Some([smallest.min(seen.smallest), largest.max(seen.largest)]);
        if self.inversion.is_some() || seen.smallest > 0.0 {
            return;
        }
        let space = solid.space();
        let vertices = space.element_nodes(seen.at.element).iter();
        let mut weighed = vertices.zip(seen.at.barycentric.iter());
        let vertex = weighed.find(|(_, lambda)| **lambda > 0.0);
        self.inversion = Some(Inversion {
            t,
            element: seen.at.element,
            jacobian: seen.smallest,
            at: vertex.map_or_else(Vec::new, |(&node, _)| space.node_point(node).to_vec()),
        });
    }

    /// Updates the largest penetration with the contacts at time `t` in state `y`.
    pub(super) fn see_contacts(&mut self, t: f64, dae: &mut MuscleDae, y: &[f64]) {
        if dae.muscle().contacts.is_empty() {
            return;
        }
        let displacement = dae.nodal_motion(t, y).0.to_vec();
        for contact in &dae.muscle().contacts {
            let depth = contact.sums(t, 1.0, &displacement).penetration;
            self.penetration = self.penetration.max(depth / contact.facet_size());
        }
    }

    pub(super) fn penetration_note(&self) -> Option<String> {
        (self.penetration > LARGE_PENETRATION).then(|| {
            let remedy = match self.penetration > INSIDE {
                true => {
                    "the contact force is not meaningful; leave space for the body between obstacle and supports, or \
                     increase `stiffness` of [[contact]]"
                }
                false => "increase `stiffness` of [[contact]]",
            };
            format!(
                "the body enters an obstacle by {:.1} % of the size of its facets: {remedy}",
                100.0 * self.penetration
            )
        })
    }

    /// Returns the smallest and the largest det F.
    pub(super) fn ratios(&self) -> Option<[f64; 2]> {
        self.ratios
    }

    /// Returns a note if an element is inverted, or if a nearly incompressible `muscle` has implausible volume ratios.
    /// The note contains the time of the inversion only if `is_motion` is true.
    pub(crate) fn note(&self, muscle: &Muscle, is_motion: bool) -> Option<String> {
        if let Some(inversion) = &self.inversion {
            return Some(inversion.note(is_motion));
        }
        let [smallest, largest] = self.ratios?;
        let is_plausible = PLAUSIBLE.contains(&smallest) && PLAUSIBLE.contains(&largest);
        (!is_plausible && is_nearly_incompressible(muscle)).then(|| {
            format!(
                "det F ranges from {smallest:.3} to {largest:.3} at element vertices, although `bulk_modulus` is at least \
                 {NEARLY_INCOMPRESSIBLE} times the shear modulus: the mesh does not resolve the deformation. Refine it \
                 where the volume changes (`J` in [fields]), or reduce the load"
            )
        })
    }

    /// Returns the outcome of a run that ends because of an inverted element, or `None` if no element is inverted. The
    /// outcome contains the time of the inversion only if `is_motion` is true.
    pub(super) fn refusal(&self, is_motion: bool) -> Option<Outcome> {
        let message = self.inversion.as_ref()?.note(is_motion);
        Some(Outcome::ended(
            EndReason::Inverted,
            format!("{message}. `solid.allow_inverted = true` accepts it"),
        ))
    }

    /// Returns the first observed inversion, if any.
    pub(crate) fn inversion(&self) -> Option<&Inversion> {
        self.inversion.as_ref()
    }
}

fn is_nearly_incompressible(muscle: &Muscle) -> bool {
    let (solid, kappa) = (&muscle.solid, muscle.parameters.kappa());
    let mut laws = solid.laws().iter().enumerate();
    laws.all(|(element, law)| {
        let shear_modulus = solid.mean_factor(element) * law.moduli()[1];
        solid.element_scale(element).kappa * kappa >= NEARLY_INCOMPRESSIBLE * shear_modulus
    })
}

impl Inversion {
    /// Returns the note for the user. The note contains the time only if `is_motion` is true.
    pub(crate) fn note(&self, is_motion: bool) -> String {
        let place: Vec<String> = self.at.iter().map(|x| format!("{x:.4}")).collect();
        let (element, jacobian, place) = (self.element, self.jacobian, place.join(", "));
        let when = match is_motion {
            true => format!(", first seen at t = {:.6} s", self.t),
            false => String::new(),
        };
        format!(
            "an element is inverted{when}: det F = {jacobian:.3} at the vertex ({place}) of element {element}. Such a \
             deformation is impossible, but the forces, which are computed at points inside the element, do not \
             prevent it. Refine the mesh there, or reduce the load"
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

    /// Regression: a motion that inverted elements ended without a warning.
    #[test]
    fn an_inverted_vertex_is_reported_with_its_position() {
        let text = "[time]\nend = 1.0\n[mesh]\ntype = \"rectangle\"\nwidth = 1.0\nheight = 1.0\ncells = [4, 3]\n\
                    [solid]\nbulk_modulus = 1e5\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
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
            let mut volumes = Volumes::default();
            let snapshot = dae.snapshot(0.5, &y, &[]);
            volumes.see(0.5, snapshot.solid, snapshot.displacement);
            volumes
        };
        let whole = seen(0.49);
        assert_eq!(whole.inversion(), None);
        let [smallest, largest] = whole.ratios().expect("looked at");
        // The tolerance covers rounding errors.
        assert!((smallest - 0.02).abs() < 1e-12 && (largest - 1.0).abs() < 1e-12);
        let turned = seen(0.502);
        let found = turned.inversion().expect("the right side");
        assert_eq!(found.at[0], 1.0);
        let printed = found.note(true);
        assert!(printed.contains("t = 0.500000 s: det F = -0.004 at"), "{printed}");
    }
}
