//! Linear systems of chains at single points that act on large parts of the body.

use myovib_fem::Solid;
use myovib_model::coupling::{CoupledDae, Effect, Feedback, FeedbackDae};
use myovib_model::{Formulation, Muscle, MuscleDae};
use rand::SeedableRng;
use rand::rngs::StdRng;

use crate::two_way::{
    assert_solved, assert_solved_by_differences, body, cases, chains, feedback, relaxing_body,
};

/// Returns the feedback of a chain in one element that acts, with different weights, on all elements on which it can
/// act.
fn everywhere(dae: &MuscleDae, network: usize, effect: Effect, active: &[usize]) -> Feedback {
    let solid: &Solid = &dae.muscle().solid;
    let weights: Vec<f64> = match effect {
        Effect::Stiffness => {
            let corners = solid.space().dimension() + 1;
            let count = corners * solid.space().n_elements();
            (0..count).map(|i| 0.2 + 0.1 * (i % 5) as f64).collect()
        }
        Effect::Tension => (0..solid.n_tensions())
            .map(|element| f64::from(u8::from(active.contains(&element))))
            .collect(),
    };
    Feedback {
        weights: Feedback::of_one_place(&weights),
        ..feedback(dae, network, effect, &active[..1])
    }
}

/// Returns a system with two chains at points. One acts on the tension and, optionally, on the stiffness; the other
/// optionally acts on the stiffness. Further chains in elements contract these elements.
fn coupled(
    (muscle, active): (Muscle, Vec<usize>),
    formulation: Formulation,
    effects: &[(usize, Effect)],
) -> FeedbackDae {
    let dae = MuscleDae::new(muscle, formulation).unwrap();
    let last = dae.muscle().solid.space().n_elements() - 1;
    let parts = vec![chains(&dae, &[last], 0), chains(&dae, &[0], 1), chains(&dae, &active, 2)];
    let acting = effects.iter();
    let mut feedbacks: Vec<Feedback> =
        acting.map(|&(network, effect)| everywhere(&dae, network, effect, &active)).collect();
    feedbacks.push(feedback(&dae, 2, Effect::Tension, &active));
    FeedbackDae::new(CoupledDae::new(dae, parts), feedbacks)
}

#[test]
fn places_that_act_elsewhere_solve_the_full_system() {
    let mut rng = StdRng::seed_from_u64(33);
    let effects = [(0, Effect::Tension), (0, Effect::Stiffness), (1, Effect::Stiffness)];
    for dimension in [2, 3] {
        for (formulation, kappa, beta) in cases() {
            let case = format!("{dimension} {formulation} {kappa} {beta}");
            let dae = coupled(body(dimension, kappa, beta), formulation, &effects);
            assert_solved(dae, &case, &mut rng);
        }
    }
}

#[test]
fn tension_follows_chains_elsewhere_where_stress_relaxes() {
    let mut rng = StdRng::seed_from_u64(34);
    let effects = [(0, Effect::Tension), (1, Effect::Tension)];
    for dimension in [2, 3] {
        for (formulation, kappa, beta) in cases() {
            let case = format!("{dimension} {formulation} {kappa} {beta}");
            let dae = coupled(relaxing_body(dimension, kappa, beta), formulation, &effects);
            assert_solved_by_differences(dae, &case, &mut rng);
        }
    }
}
