//! Two-way coupling of a scene: the effect of chains on the stiffness or contraction of parts of the body.

use std::collections::BTreeSet;

use myovib_fem::Mesh;
use myovib_model::ModelError;
use myovib_model::coupling::{Effect, Feedback};
use myovib_oscillators::SmoothCoherence;

use super::builder::Builder;
use super::distribution::point;
use super::{Body, DrivenChain};
use crate::InputError;
use crate::scene_file::active::Tension;
use crate::scene_file::chain::Place;

impl Builder<'_> {
    /// Returns the feedback of the chains on the body: first the stiffness feedbacks in the same order as in the scene,
    /// then the tensions.
    pub(super) fn feedbacks(
        &self,
        body: Option<&Body>,
        chains: &[DrivenChain],
    ) -> Result<Vec<Feedback>, InputError> {
        let places = self.shared_places(chains)?;
        let mut shared = 0..;
        let mut feedbacks = Vec::new();
        for (i, wanted) in self.file.feedback.iter().enumerate() {
            let path = format!("feedback[{i}]");
            let Some(body) = body else {
                let error = InputError::new("a feedback requires a body")
                    .next("add a [mesh] with [solid], or remove [[feedback]]");
                return Err(self.wrong(&path, error));
            };
            let network = self.acting_chain(&wanted.chain, chains, &path)?;
            let mesh = body.muscle.solid.space().mesh();
            let weights = match (chains[network].elements(), &wanted.group) {
                (Some(elements), None) => {
                    let n = mesh.shape().n_vertices();
                    let corners = |element: &usize| n * element..n * (element + 1);
                    let own = |element| corners(element).map(|i| (i, 1.0)).collect();
                    elements.iter().map(own).collect()
                }
                (Some(_), Some(_)) => {
                    let error =
                        InputError::new("a chain inside an element acts only on this element")
                            .next("remove `group`, or name a chain at a point");
                    return Err(self.wrong(&format!("{path}.group"), error));
                }
                (None, Some(group)) => Feedback::of_one_place(&self.indicator(mesh, group, &path)?),
                (None, None) => {
                    let place = shared.next().unwrap_or_default();
                    Feedback::of_one_place(&shares(mesh, &places, place))
                }
            };
            self.nothing_relaxes(body, &weights, &path)?;
            feedbacks.push(Feedback {
                network,
                coherence: self.coherence(wanted.rest_amplitude, &path)?,
                effect: Effect::Stiffness,
                unsynchronized: wanted.at_zero_coherence,
                coherent: wanted.at_full_coherence,
                weights,
            });
        }
        if let Some(body) = body {
            self.add_tensions(body, chains, &mut feedbacks)?;
        }
        Ok(feedbacks)
    }

    /// Rejects a variable stiffness of elements with stress relaxation. The equation Ḣ + H/τ = g Ṡ requires a law with
    /// constant coefficients. It does not define H if the stiffness changes at rest.
    fn nothing_relaxes(
        &self,
        body: &Body,
        weights: &[Vec<(usize, f64)>],
        path: &str,
    ) -> Result<(), InputError> {
        let n_vertices = body.muscle.solid.space().mesh().shape().n_vertices();
        let corners = weights.iter().flatten().map(|(corner, _)| corner);
        let mut regions = corners.map(|corner| body.regions[corner / n_vertices]);
        let relaxes = |region: &usize| {
            let prony = self.file.material.get(*region).and_then(|own| own.prony.as_ref());
            prony.is_some_and(|terms| !terms.is_empty())
        };
        let Some(region) = regions.find(relaxes) else {
            return Ok(());
        };
        let error = InputError::new(format!(
            "the stiffness cannot follow oscillators where stress relaxes (material[{region}].prony): the \
             terms `Ḣ + H/τ = g Ṡ` require a law with constant coefficients"
        ))
        .next(
            "remove `prony` there, or let the feedback act on a `group` without `prony`. With \
             `prony`, chains can still control the tension of `active`. Feedback can be combined with `viscosity` and \
             `rayleigh_stiffness`",
        );
        Err(self.wrong(path, error))
    }

    fn add_tensions(
        &self,
        body: &Body,
        chains: &[DrivenChain],
        feedbacks: &mut Vec<Feedback>,
    ) -> Result<(), InputError> {
        let solid = &body.muscle.solid;
        let materials = self.file.material.iter().enumerate();
        let active = materials.filter_map(|(i, material)| Some((i, material.active.as_ref()?)));
        // Each active material has an activation, and both lists have the same order.
        for ((i, active), (number, _)) in active.zip(&body.muscle.activations) {
            let Tension::Coherence { chain, at_zero_coherence, at_full_coherence, rest_amplitude } =
                &active.tension
            else {
                continue;
            };
            let path = format!("material[{i}].active");
            let network = self.acting_chain(chain, chains, &path)?;
            let driven = &chains[network];
            if driven.initial != 0.0 && at_zero_coherence != at_full_coherence {
                let error = InputError::new(format!(
                    "the oscillators of `{chain}` start with equal phases, so the tension would jump at the start"
                ))
                .found(format!("initial = {}", driven.initial))
                .next("remove `initial` of the chain: its oscillators start at rest");
                return Err(self.wrong(&path, error));
            }
            let is_member = |element: &usize| solid.added_number(*element) == Some(*number);
            let members: Vec<usize> = (0..solid.n_tensions()).filter(is_member).collect();
            let weights = match &driven.elements() {
                None => vec![members.iter().map(|element| (*element, 1.0)).collect()],
                Some(elements) => {
                    let driven: BTreeSet<&usize> = elements.iter().collect();
                    let has_chain = |element: &&usize| driven.contains(element);
                    let without = members.len() - members.iter().filter(has_chain).count();
                    if without > 0 {
                        let error = InputError::new(format!(
                            "{without} elements of the material have no chain `{chain}` to follow"
                        ))
                        .next("place the chain in all elements of the material's group");
                        return Err(self.wrong(&format!("{path}.chain"), error));
                    }
                    let own = |element: &usize| is_member(element).then_some((*element, 1.0));
                    let places = elements.iter().map(own);
                    places.map(|own| own.into_iter().collect()).collect()
                }
            };
            feedbacks.push(Feedback {
                network,
                coherence: self.coherence(*rest_amplitude, &path)?,
                effect: Effect::Tension,
                unsynchronized: *at_zero_coherence,
                coherent: *at_full_coherence,
                weights,
            });
        }
        Ok(())
    }

    fn coherence(&self, radius: f64, path: &str) -> Result<SmoothCoherence, InputError> {
        let coherence = SmoothCoherence::new(radius).map_err(ModelError::from);
        self.at(&format!("{path}.rest_amplitude"), coherence)
    }

    /// Returns the positions of the chains whose feedbacks act jointly on the whole body.
    fn shared_places(&self, chains: &[DrivenChain]) -> Result<Vec<Vec<f64>>, InputError> {
        let everywhere = self.file.feedback.iter().enumerate();
        let mut places = Vec::new();
        for (i, feedback) in everywhere.filter(|(_, feedback)| feedback.group.is_none()) {
            let path = format!("feedback[{i}]");
            match &chains[self.acting_chain(&feedback.chain, chains, &path)?].at {
                Some(Place::Point(point)) => places.push(point.clone()),
                Some(Place::Elements { .. }) => {}
                _ => {
                    let error = InputError::new("the chain has no place on the body")
                        .next("set `at` of the chain to a point, or `group` of the feedback");
                    return Err(self.wrong(&path, error));
                }
            }
        }
        Ok(places)
    }

    /// Returns the zero-based index of a chain that acts on the body.
    fn acting_chain(
        &self,
        name: &str,
        chains: &[DrivenChain],
        path: &str,
    ) -> Result<usize, InputError> {
        let wrong = |error| Err(self.wrong(&format!("{path}.chain"), error));
        let Some(number) = chains.iter().position(|chain| chain.name == name) else {
            let names: Vec<&str> = chains.iter().map(|chain| chain.name.as_str()).collect();
            let error = InputError::new(format!("unknown chain `{name}`"));
            return wrong(error.allowed(names.join(", ")));
        };
        let chain = &chains[number];
        if chain.is_at_many_points() {
            let error = InputError::new(format!(
                "the chains `{name}` at several points have no part of the body to act on"
            ));
            return wrong(error.next(
                "place one in each element, `at = { elements = \"group\" }`, or use one chain at a point",
            ));
        }
        Ok(number)
    }

    /// Returns weights of 1 in the elements of a group and 0 elsewhere.
    fn indicator(&self, mesh: &Mesh, group: &str, path: &str) -> Result<Vec<f64>, InputError> {
        let members = self.elements(Some(group), mesh, path)?;
        let n_vertices = mesh.shape().n_vertices();
        let mut weights = vec![0.0; n_vertices * mesh.n_elements()];
        for element in members {
            weights[n_vertices * element..][..n_vertices].fill(1.0);
        }
        Ok(weights)
    }
}

/// Returns the weights of the position with the index `k` at the corners of all elements. They are normalized inverse
/// squared distances.
fn shares(mesh: &Mesh, places: &[Vec<f64>], k: usize) -> Vec<f64> {
    let share = |vertex: &usize| {
        let corner = point(mesh, *vertex);
        let squared = |place: &Vec<f64>| -> f64 {
            let both = corner.iter().zip(place);
            both.map(|(x, y)| (x - y).powi(2)).sum()
        };
        // Distances are divided by the smallest one, so that a corner at one of the positions does not lead to infinite
        // terms.
        let nearest = places.iter().map(squared).fold(f64::INFINITY, f64::min);
        let inverse = |place: &Vec<f64>| match squared(place) {
            distance if distance > 0.0 => nearest / distance,
            _ => 1.0,
        };
        inverse(&places[k]) / places.iter().map(inverse).sum::<f64>()
    };
    mesh.elements().flatten().map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_sum_to_one_and_belong_to_the_chain_at_its_place() {
        let mesh = myovib_fem::generate::rectangle([0.0, 0.0], [2.0, 1.0], [2, 1]).unwrap();
        let places = [[0.0, 0.0], [2.0, 1.0], [1.3, 0.4]].map(Vec::from);
        let all: Vec<_> = (0..3).map(|k| shares(&mesh, &places, k)).collect();
        for triangle in 0..mesh.n_elements() {
            for corner in 0..3 {
                let sum: f64 = all.iter().map(|shares| shares[3 * triangle + corner]).sum();
                assert!((sum - 1.0).abs() < 4.0 * f64::EPSILON);
                if mesh.corners::<2, 3>(triangle)[corner] == places[0][..] {
                    assert_eq!(all[0][3 * triangle + corner], 1.0);
                }
            }
        }
    }
}
