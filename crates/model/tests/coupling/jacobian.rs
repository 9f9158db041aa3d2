//! The Jacobian of each coupled system compared with central differences of its residual.

use crate::common::{chain_alone, rod_and_chain};
use myovib_conformance::jacobian_error;
use myovib_dae::Problem;
use myovib_fem::Mesh;
use myovib_model::coupling::{CoupledDae, Effect, Feedback, FeedbackDae, Oscillators, Source};
use myovib_model::{Formulation, MuscleDae, Probe, Signal, paper};
use myovib_oscillators::{Array, Chain, Coefficients, Drive, Ends, Reach, SmoothCoherence};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

/// Returns max_i |J δ - dF/dε|_i divided by the sum of |J_ij δ_j| in row i, along a random direction δ.
///
/// States are drawn from ±`size` by component, their derivatives from ten times that.
fn discrepancy<P: Problem>(dae: &mut P, size: impl Fn(usize) -> f64, rng: &mut StdRng) -> f64 {
    let n = dae.n_unknowns();
    let mut draw = |factor: f64| -> Vec<f64> {
        (0..n).map(|i| factor * size(i) * rng.random_range(-1.0..1.0)).collect()
    };
    let (y, y_dot, direction) = (draw(1.0), draw(10.0), draw(1.0));
    let (a, b) = (rng.random_range(0.5..2.0), rng.random_range(1.0..1e3));
    jacobian_error(dae, 0.9, [&y, &y_dot, &direction], [a, b])
}

/// The truncation error, ε²/6 times the cubic terms, is below 1e-9 of a row. The rounding error is 1e-16/ε = 1e-11
/// times the ratio of the terms within a row, which is at most 1e4 for b up to 1e3 and ω² = 2500.
const CLOSE: f64 = 1e-6;

fn chain(reach: Reach) -> Chain {
    Chain {
        reach,
        coefficients: Coefficients { duffing: 0.7, ..Coefficients::default() },
        ..paper::chain(4, 0.5).unwrap()
    }
}

#[test]
fn the_rod_with_a_chain() {
    let mut rng = StdRng::seed_from_u64(36);
    for reach in [Reach::All, Reach::Boundary] {
        let mut dae = rod_and_chain(&chain(reach), 4e3);
        let n_body = dae.body_range().len();
        let size = |i| if i < n_body / 2 { 0.05 } else { 2.0 };
        for _ in 0..5 {
            let error = discrepancy(&mut dae, size, &mut rng);
            assert!(error < CLOSE, "{reach:?}: {error:e}");
        }
    }
}

#[test]
fn a_chain_without_a_body() {
    let mut rng = StdRng::seed_from_u64(22);
    let given = Source::Given(Signal::paper(0.05));
    for source in [Source::Rest, given] {
        let mut dae = chain_alone(&chain(Reach::All), 10.0, source);
        assert_eq!(dae.n_unknowns(), 8);
        let error = discrepancy(&mut dae, |_| 2.0, &mut rng);
        assert!(error < CLOSE, "{error:e}");
    }
}

fn small_muscle(formulation: Formulation) -> MuscleDae {
    let mesh =
        Mesh::parse_msh(include_str!("../../../../data/meshes/block.msh"), "small.msh").unwrap();
    let muscle = paper::muscle(&mesh, 1e5, 1e-2).unwrap();
    MuscleDae::for_analysis(muscle, formulation)
}

#[test]
fn muscle_with_a_chain_and_an_array_at_any_point() {
    let mut rng = StdRng::seed_from_u64(29);
    for formulation in [Formulation::Rate, Formulation::ImplicitRate] {
        let muscle = small_muscle(formulation);
        // A point inside an element that has free and fixed nodes.
        let probe = Probe::at(muscle.muscle().solid.space(), [0.3, 0.2]).unwrap();
        let at = |axis| Source::Body(muscle.displacement_at(&probe, axis));
        let gain = 1e3;
        let drive = |reach| Drive { gain, reach };
        let array = Array {
            columns: 2,
            rows: 3,
            omega: paper::chain(6, 0.5).unwrap().omega,
            coefficients: Coefficients::default(),
            ends: Ends::Open,
            reach: Reach::Boundary,
        };
        let in_a_line =
            Oscillators::new(chain(Reach::All).network().unwrap(), drive(Reach::All), vec![at(1)]);
        let in_the_plane =
            Oscillators::new(array.network().unwrap(), drive(Reach::Boundary), vec![at(0), at(1)]);
        let layout = muscle.layout().clone();
        let parts = vec![in_a_line.unwrap(), in_the_plane.unwrap()];
        let mut dae = CoupledDae::new(muscle, parts);
        assert_eq!(dae.n_unknowns(), layout.n_unknowns() + 8 + 24);
        let sizes = layout.fill(|field| match field.name() {
            "u" => 0.05,
            "v" => 1.0,
            "p" => 1e3,
            _ => 1e4,
        });
        let size = |i: usize| sizes.get(i).copied().unwrap_or(2.0);
        for _ in 0..3 {
            let error = discrepancy(&mut dae, size, &mut rng);
            assert!(error < CLOSE, "{formulation}: {error:e}");
        }
    }
}

/// Returns a small muscle with two chains that act on it with interpolated weights.
fn with_feedback(formulation: Formulation) -> FeedbackDae {
    let muscle = small_muscle(formulation);
    let n_elements = muscle.muscle().solid.space().n_elements();
    let probe = Probe::at(muscle.muscle().solid.space(), [0.3, 0.2]).unwrap();
    let driven = |reach| {
        let source = Source::Body(muscle.displacement_at(&probe, 1));
        let drive = Drive { gain: 1e3, reach };
        Oscillators::new(chain(reach).network().unwrap(), drive, vec![source]).unwrap()
    };
    let parts = vec![driven(Reach::All), driven(Reach::Boundary)];
    let feedback = |network, share: [f64; 3]| Feedback {
        network,
        coherence: SmoothCoherence::new(0.5).unwrap(),
        unsynchronized: 3.0,
        coherent: 0.8,
        effect: Effect::Stiffness,
        weights: Feedback::of_one_place(&vec![share; n_elements].into_flattened()),
    };
    let shares = [[0.2, 0.5, 1.0], [0.8, 0.5, 0.0]];
    let feedbacks = vec![feedback(0, shares[0]), feedback(1, shares[1])];
    FeedbackDae::new(CoupledDae::new(muscle, parts), feedbacks)
}

#[test]
fn a_muscle_whose_stiffness_follows_two_chains() {
    let mut rng = StdRng::seed_from_u64(1);
    for formulation in [Formulation::Rate, Formulation::ImplicitRate] {
        let mut dae = with_feedback(formulation);
        let layout = dae.one_way().body().layout().clone();
        let sizes = layout.fill(|field| match field.name() {
            "u" => 0.05,
            "v" => 1.0,
            "p" => 1e3,
            _ => 1e4,
        });
        // Oscillators near their smoothing radius, where the coherence has the largest curvature, and at 1e-4 times
        // that radius: near rest, where |χ| without smoothing is not differentiable.
        for at_rest in [1.0, 1e-4] {
            let size = |i: usize| sizes.get(i).copied().unwrap_or(at_rest);
            for _ in 0..3 {
                let error = discrepancy(&mut dae, size, &mut rng);
                assert!(error < CLOSE, "{formulation}: {error:e}");
            }
        }
    }
}

#[test]
fn chains_at_rest_are_out_of_step_and_stiffen_by_their_shares() {
    let dae = with_feedback(Formulation::Rate);
    let mut y = vec![0.0; dae.n_unknowns()];
    assert_eq!(dae.factors(&y), [3.0, 3.0]);
    // All oscillators of the first chain are displaced far in the same direction, so the coherence is 1 up to ε²/r².
    let positions = dae.one_way().range(0).start..;
    y[positions][..4].fill(1e3);
    let factors = dae.factors(&y);
    assert!((factors[0] - 0.8).abs() < 2.2 * 0.5_f64.powi(2) / 1e6 * 1.01);
    assert_eq!(factors[1], 3.0);
}

#[test]
fn without_oscillators_nothing_is_added() {
    let muscle = small_muscle(Formulation::Rate);
    let (n, pattern) = (muscle.n_unknowns(), muscle.jacobian_pattern());
    let dae = CoupledDae::new(muscle, Vec::new());
    assert_eq!(dae.n_unknowns(), n);
    assert_eq!(dae.jacobian_pattern(), pattern);
}

#[test]
fn the_pattern_holds_one_coupling_entry_per_forced_row_and_unknown() {
    let dae = rod_and_chain(&chain(Reach::Boundary), 1.0);
    let pattern = dae.jacobian_pattern();
    let n_body = dae.body_range().len();
    let coupling: Vec<(usize, usize)> =
        pattern.entries().filter(|(column, row)| *column < n_body && *row >= n_body).collect();
    // L/2 is node 5, the unknown q_5 = y[4]; oscillators 1 and 4 are forced.
    assert_eq!(coupling, [(4, n_body + 4), (4, n_body + 7)]);
}
