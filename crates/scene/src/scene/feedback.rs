//! Two-way coupling of a scene: which chain stiffens which part of the body, and how much.

use myovib_fem::Mesh;
use myovib_model::ModelError;
use myovib_model::coupling::Feedback;
use myovib_oscillators::SmoothCoherence;

use super::builder::Builder;
use super::{Body, DrivenChain};
use crate::InputError;
use crate::scene_file::SceneFile;
use crate::scene_file::chain::Place;

impl Builder<'_> {
    /// The feedbacks of the scene's chains on its body.
    pub(super) fn feedbacks(
        &self,
        file: &SceneFile,
        body: Option<&Body>,
        chains: &[DrivenChain],
    ) -> Result<Vec<Feedback>, InputError> {
        let places = self.shared_places(file, chains)?;
        let mut shared = 0..;
        let mut feedbacks = Vec::new();
        for (i, wanted) in file.feedback.iter().enumerate() {
            let path = format!("feedback[{i}]");
            let Some(body) = body else {
                let error = InputError::new("a feedback needs a body to stiffen")
                    .next("add a [mesh] with [solid], or remove [[feedback]]");
                return Err(self.wrong(&path, error));
            };
            let network = self.chain_number(&wanted.chain, chains, &path)?;
            if chains[network].elements.is_some() {
                let error = InputError::new("chains in many elements do not act back on the body")
                    .next("name a chain at a point, or leave out [[feedback]]");
                return Err(self.wrong(&format!("{path}.chain"), error));
            }
            let mesh = body.muscle.solid.space().mesh();
            let weights = match &wanted.group {
                Some(group) => self.indicator(mesh, group, &path)?,
                None => shares(mesh, &places, shared.next().unwrap_or_default()),
            };
            let coherence = SmoothCoherence::new(wanted.radius).map_err(ModelError::from);
            feedbacks.push(Feedback {
                network,
                coherence: self.at(&format!("{path}.radius"), coherence)?,
                unsynchronised: wanted.unsynchronised,
                coherent: wanted.coherent,
                weights,
            });
        }
        Ok(feedbacks)
    }

    /// The places of the chains whose feedbacks share the whole body.
    fn shared_places(
        &self,
        file: &SceneFile,
        chains: &[DrivenChain],
    ) -> Result<Vec<Vec<f64>>, InputError> {
        let everywhere = file.feedback.iter().enumerate();
        everywhere
            .filter(|(_, feedback)| feedback.group.is_none())
            .map(|(i, feedback)| {
                let path = format!("feedback[{i}]");
                match &chains[self.chain_number(&feedback.chain, chains, &path)?].at {
                    Some(Place::Point(point)) => Ok(point.clone()),
                    _ => {
                        let error = InputError::new("the chain has no place on the body")
                            .next("give the chain a point `at`, or the feedback a `group`");
                        Err(self.wrong(&path, error))
                    }
                }
            })
            .collect()
    }

    fn chain_number(
        &self,
        name: &str,
        chains: &[DrivenChain],
        path: &str,
    ) -> Result<usize, InputError> {
        let found = chains.iter().position(|chain| chain.name == name);
        found.ok_or_else(|| {
            let names: Vec<&str> = chains.iter().map(|chain| chain.name.as_str()).collect();
            let error =
                InputError::new(format!("there is no chain `{name}`")).allowed(names.join(", "));
            self.wrong(&format!("{path}.chain"), error)
        })
    }

    /// 1 in the elements of a group, 0 elsewhere.
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

/// The share of place number `k` at each corner: inverse squares of distances, over their sum.
fn shares(mesh: &Mesh, places: &[Vec<f64>], k: usize) -> Vec<f64> {
    let dimension = mesh.dimension();
    let share = |vertex: &usize| {
        let corner = &mesh.coordinates()[dimension * vertex..][..dimension];
        let squared = |place: &Vec<f64>| -> f64 {
            let both = corner.iter().zip(place);
            both.map(|(x, y)| (x - y).powi(2)).sum()
        };
        // Multiplied by the smallest distance, so that a corner at a place has no infinite terms.
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
