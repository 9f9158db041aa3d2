//! Chains that act back on their elements: results and linear solver.

use std::sync::Arc;

use crate::common::backward_error;
use myovib_conformance::jacobian_error;
use myovib_dae::{LinearSolver as _, Linearization, Problem};
use myovib_fem::material::{ActiveStress, ForceLength, ForceVelocity, Prony, PronyTerm, Tension};
use myovib_fem::{AddedStress, DofMap, Fibers, Mesh, Solid, Space, generate};
use myovib_model::coupling::{
    CoupledDae, CoupledOptions, Effect, ErrorTest, Feedback, FeedbackDae, FeedbackSolver,
    Oscillators, Source, StateTolerances, start_with_feedback,
};
use myovib_model::{
    Activation, Advance, Field, Formulation, IntegratorKind, LinearSolverKind, Load, Muscle,
    MuscleDae, Parameters, Probe, Settings, Signal, formula, paper,
};
use myovib_oscillators::{Chain, Coefficients, Drive, Ends, Reach, SmoothCoherence};
use myovib_sparse::SparseOptions;
use num_complex::Complex64;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

/// Oscillators at a place.
const N: usize = 3;

/// Tension of incoherent and of coherent oscillators, Pa.
const REST: f64 = 5e3;
const COHERENT: f64 = 2e4;

const STRESS: AddedStress = AddedStress {
    active: Some(ActiveStress {
        tension: Tension::Nominal,
        force_length: ForceLength::Parabola { optimal: 1.1 },
        force_velocity: Some(ForceVelocity { v_max: 10.0, a: 0.25, plateau: 1.4 }),
    }),
    viscosity: 40.0,
};

fn block(dimension: usize) -> Mesh {
    match dimension {
        2 => generate::rectangle([0.0; 2], [1.0, 0.8], [2, 2]).unwrap(),
        _ => generate::block([0.0; 3], [1.0, 0.8, 0.6], [2, 1, 1]).unwrap(),
    }
}

/// Returns a block fixed on its left; the first half of its elements can contract.
pub(crate) fn body(dimension: usize, kappa: f64, beta: f64) -> (Muscle, Vec<usize>) {
    let mesh = block(dimension);
    let active: Vec<usize> = (0..mesh.n_elements() / 2).collect();
    let mut fibers = Fibers::new(&mesh);
    let askew = match dimension {
        2 => [0.8, 0.6, 0.0],
        _ => [2.0, 1.0, -1.0],
    };
    fibers.set_constant(&mesh, &active, askew, None).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::clamped(&space, &space.nodes_of("left").unwrap()).unwrap();
    let solid = Solid::uniform(space, dofs, paper::LAW, paper::DENSITY)
        .unwrap()
        .with_added_stresses(&[(active.clone(), STRESS)])
        .unwrap()
        .with_fibers(fibers);
    let coherence = Activation::Coherence { unsynchronized: REST };
    let parameters = Parameters::new(1.0, beta, kappa).unwrap();
    let muscle =
        Muscle { activations: vec![(0, coherence)], ..Muscle::unloaded(solid, parameters) };
    (muscle, active)
}

/// Creates chains in elements, without the frequencies of the first `skipped` places.
pub(crate) fn chains(dae: &MuscleDae, elements: &[usize], skipped: usize) -> Oscillators {
    let places = elements.len();
    let omega = paper::chain(N * (skipped + places), 0.5).unwrap().omega;
    let chain = Chain {
        omega: omega[N * skipped..].to_vec(),
        coefficients: Coefficients::default(),
        ends: Ends::Periodic,
        reach: Reach::All,
    };
    let space = dae.muscle().solid.space();
    let at =
        |&element: &usize| Source::Body(dae.displacement_at(&Probe::in_element(space, element), 1));
    let drive = Drive {
        // Large enough for limit cycles within the run below.
        gain: 4e5,
        reach: Reach::All,
    };
    let network = chain.network_at(places).unwrap();
    Oscillators::new(network, drive, elements.iter().map(at).collect()).unwrap()
}

/// Creates the feedback of a network whose chains stiffen or contract their own elements.
pub(crate) fn feedback(
    dae: &MuscleDae,
    network: usize,
    effect: Effect,
    elements: &[usize],
) -> Feedback {
    let corners = dae.muscle().solid.space().dimension() + 1;
    let (count, [unsynchronized, coherent]) = match effect {
        Effect::Stiffness => (corners, [3.0, 0.8]),
        Effect::Tension => (1, [REST, COHERENT]),
    };
    let own = |element: &usize| (element * count..(element + 1) * count).map(|i| (i, 1.0));
    Feedback {
        network,
        coherence: SmoothCoherence::new(0.5).unwrap(),
        effect,
        unsynchronized,
        coherent,
        weights: elements.iter().map(|element| own(element).collect()).collect(),
    }
}

/// Creates a body with chains in all elements that stiffen it, and with others that contract its
/// active part: two networks of many places, or one network for each place.
fn two_way(
    (muscle, active): (Muscle, Vec<usize>),
    formulation: Formulation,
    apart: bool,
) -> FeedbackDae {
    let dae = MuscleDae::new(muscle, formulation).unwrap();
    let all: Vec<usize> = (0..dae.muscle().solid.space().n_elements()).collect();
    let (mut parts, mut feedbacks) = (Vec::new(), Vec::new());
    for (effect, elements) in [(Effect::Stiffness, all), (Effect::Tension, active)] {
        let size = if apart { 1 } else { elements.len() };
        for (k, own) in elements.chunks(size).enumerate() {
            feedbacks.push(feedback(&dae, parts.len(), effect, own));
            parts.push(chains(&dae, own, k * size));
        }
    }
    FeedbackDae::new(CoupledDae::new(dae, parts), feedbacks)
}

/// Every formulation with compatible κ and β.
pub(crate) fn cases() -> Vec<(Formulation, f64, f64)> {
    let mut cases = Vec::new();
    for formulation in Formulation::ALL {
        for (kappa, beta) in [(1e5, 1e-2), (1e5, 0.0), (f64::INFINITY, 0.0)] {
            let parameters = Parameters::new(1.0, beta, kappa).unwrap();
            if formulation.check(&parameters).is_ok() {
                cases.push((formulation, kappa, beta));
            }
        }
    }
    cases
}

/// Returns typical magnitudes of the unknowns: strains of several percent, and oscillators near their smoothing radius.
fn sizes(dae: &FeedbackDae) -> Vec<f64> {
    let mut size = dae.one_way().body().layout().fill(|field| match field {
        Field::Displacement => 0.02,
        Field::Velocity => 1.0,
        Field::Pressure => 1e3,
        Field::PressureRate => 1e4,
        Field::GglMultiplier => 1.0,
        Field::Tension | Field::InternalStress => 1e3,
    });
    size.resize(dae.n_unknowns(), 1.0);
    size
}

fn draw(size: &[f64], factor: f64, rng: &mut StdRng) -> Vec<f64> {
    let one = |size: &f64| factor * size * rng.random_range(-1.0..1.0);
    size.iter().map(one).collect()
}

#[test]
fn jacobians_agree_with_differences_and_solutions_solve_the_full_system() {
    let mut rng = StdRng::seed_from_u64(31);
    for dimension in [2, 3] {
        for (formulation, kappa, beta) in cases() {
            let case = format!("{dimension} {formulation} {kappa} {beta}");
            let dae = two_way(body(dimension, kappa, beta), formulation, false);
            assert_solved(dae, &case, &mut rng);
        }
    }
}

/// Tension that follows the chains, with stress relaxation. The internal stresses are unknowns that
/// are eliminated point by point, so only differences can check the full matrix.
#[test]
fn tension_follows_chains_where_stress_relaxes() {
    let mut rng = StdRng::seed_from_u64(32);
    for dimension in [2, 3] {
        for (formulation, kappa, beta) in cases() {
            let case = format!("{dimension} {formulation} {kappa} {beta}");
            let (muscle, active) = relaxing_body(dimension, kappa, beta);
            let dae = MuscleDae::new(muscle, formulation).unwrap();
            let feedback = feedback(&dae, 0, Effect::Tension, &active);
            let chains = chains(&dae, &active, 0);
            let dae = FeedbackDae::new(CoupledDae::new(dae, vec![chains]), vec![feedback]);
            assert_solved_by_differences(dae, &case, &mut rng);
        }
    }
}

/// Returns the body with viscoelastic stress in half of its active elements.
pub(crate) fn relaxing_body(dimension: usize, kappa: f64, beta: f64) -> (Muscle, Vec<usize>) {
    let (mut muscle, active) = body(dimension, kappa, beta);
    let terms = [[0.4, 0.02], [0.3, 0.2]];
    let terms = terms.map(|[weight, time]| PronyTerm { weight, time });
    let prony = Prony::new(terms.to_vec()).unwrap();
    let half = active[active.len() / 2..].to_vec();
    muscle.solid = muscle.solid.with_relaxation(&[(half, prony)]).unwrap();
    (muscle, active)
}

/// Checks that differences of the residual along a solution reproduce the right-hand side.
pub(crate) fn assert_solved_by_differences(mut dae: FeedbackDae, case: &str, rng: &mut StdRng) {
    let layout = dae.one_way().body().layout();
    assert!(layout.range(Field::InternalStress).is_some());
    let size = sizes(&dae);
    let [y, wanted] = [(); 2].map(|()| draw(&size, 1.0, rng));
    let y_dot = draw(&size, 10.0, rng);
    let c = 3e2;
    let right = along(&mut dae, [&y, &y_dot], &wanted, c);
    let mut solver = FeedbackSolver::new(&mut dae, SparseOptions::default()).unwrap();
    let weights = vec![1.0; size.len()];
    let at = Linearization { t: 0.1, y: &y, y_dot: &y_dot, step: 1e-3, weights: &weights };
    solver.evaluate(&mut dae, &at).unwrap();
    solver.set_up(&mut dae, c, &[]).unwrap();
    let mut x = right.clone();
    solver.solve_real(&mut dae, &mut x).unwrap();
    let found = along(&mut dae, [&y, &y_dot], &x, c);
    let one_way = dae.one_way();
    let networks = (0..one_way.n_networks()).map(|k| one_way.range(k));
    let blocks = one_way.body().layout().blocks().iter();
    let blocks = blocks.map(|(_, range)| range.clone()).chain(networks);
    for range in blocks {
        let largest = right[range.clone()].iter().fold(0.0_f64, |m, r| m.max(r.abs()));
        for row in range {
            let error = (found[row] - right[row]).abs() / largest;
            // Truncation and rounding errors of the differences; a missing term results in an error of 1e-2 or more.
            assert!(error < 1e-4, "{case}, row {row}: {error:e}");
        }
    }
}

/// Returns (F(y + ε x, ẏ + ε c x) − F(y − ε x, ẏ − ε c x))/2ε.
fn along(dae: &mut FeedbackDae, [y, y_dot]: [&[f64]; 2], x: &[f64], c: f64) -> Vec<f64> {
    let step = 1e-6;
    let mut at = |step: f64| {
        let moved = |from: &[f64], step: f64| -> Vec<f64> {
            from.iter().zip(x).map(|(from, x)| from + step * x).collect()
        };
        let mut residual = vec![0.0; y.len()];
        let (y, y_dot) = (moved(y, step), moved(y_dot, c * step));
        dae.residual(0.1, &y, &y_dot, &mut residual).unwrap();
        residual
    };
    let (after, before) = (at(step), at(-step));
    let pairs = after.iter().zip(before);
    pairs.map(|(a, b)| (a - b) / (2.0 * step)).collect()
}

/// Checks that the Jacobian equals differences, and that solutions with eliminated oscillators
/// solve it.
pub(crate) fn assert_solved(mut dae: FeedbackDae, case: &str, rng: &mut StdRng) {
    let size = sizes(&dae);
    let [y, direction] = [(); 2].map(|()| draw(&size, 1.0, rng));
    let y_dot = draw(&size, 10.0, rng);
    let error = jacobian_error(&mut dae, 0.1, [&y, &y_dot, &direction], [1.3, 70.0]);
    // Truncation and rounding errors of the differences, as for other coupled systems.
    assert!(error < 1e-6, "{case}: {error:e}");

    let klu = SparseOptions::default();
    let mut solver = FeedbackSolver::new(&mut dae, klu).unwrap();
    let weights = vec![1.0; size.len()];
    let at = Linearization { t: 0.1, y: &y, y_dot: &y_dot, step: 1e-3, weights: &weights };
    solver.evaluate(&mut dae, &at).unwrap();
    let (c, shift) = (3e2, Complex64::new(3e2, 2e2));
    solver.set_up(&mut dae, c, &[shift]).unwrap();
    let ones = vec![1.0; size.len()];
    let b = draw(&ones, 1.0, rng);
    let mut x = b.clone();
    solver.solve_real(&mut dae, &mut x).unwrap();
    // A row contains about a hundred products, each rounded a few times during the elimination.
    let rounding = 1e4 * f64::EPSILON;
    let real = backward_error(&mut dae, 0.1, [&y, &y_dot], c, &b, &x);
    assert!(real < rounding, "{case}: {real:e}");
    let pairs = b.iter().zip(draw(&ones, 1.0, rng));
    let b: Vec<Complex64> = pairs.map(|(&re, im)| Complex64::new(re, im)).collect();
    let mut x = b.clone();
    solver.solve_complex(&mut dae, 0, &mut x).unwrap();
    let complex = backward_error(&mut dae, 0.1, [&y, &y_dot], shift, &b, &x);
    assert!(complex < rounding, "{case}: {complex:e}");
}

/// Returns the state of networks of many places, from the state of one network for each place.
fn joined(many: &FeedbackDae, apart: &FeedbackDae, states: &[f64]) -> Vec<f64> {
    let mut joined = states[many.one_way().body_range()].to_vec();
    let mut next = 0;
    for k in 0..many.one_way().n_networks() {
        let places = many.one_way().range(k).len() / (2 * N);
        let own = next..next + places;
        next += places;
        let parts = || own.clone().map(|k| &states[apart.one_way().range(k)]);
        joined.extend(parts().flat_map(|s| &s[..N]));
        joined.extend(parts().flat_map(|s| &s[N..]));
    }
    joined
}

#[test]
fn many_places_are_as_many_networks_of_one_place() {
    let mut rng = StdRng::seed_from_u64(7);
    for dimension in [2, 3] {
        let make = |apart| two_way(body(dimension, 1e5, 1e-2), Formulation::ImplicitRate, apart);
        let (mut many, mut apart) = (make(false), make(true));
        let n = many.n_unknowns();
        assert_eq!(n, apart.n_unknowns());
        assert!(many.one_way().n_networks() == 2 && apart.one_way().n_networks() > 10);
        let size = sizes(&apart);
        let (y, y_dot) = (draw(&size, 1.0, &mut rng), draw(&size, 10.0, &mut rng));
        let mut of_apart = vec![0.0; n];
        apart.residual(0.1, &y, &y_dot, &mut of_apart).unwrap();
        let expected = joined(&many, &apart, &of_apart);
        let [y, y_dot] = [&y, &y_dot].map(|v| joined(&many, &apart, v));
        let mut of_many = vec![0.0; n];
        many.residual(0.1, &y, &y_dot, &mut of_many).unwrap();
        assert!(of_many == expected, "{dimension}");
    }
}

#[test]
fn tensions_are_those_of_the_coherence() {
    let (muscle, active) = body(2, 1e5, 0.0);
    let mut dae = two_way((muscle.clone(), active.clone()), Formulation::Position, false);
    let mut y = vec![0.0; dae.n_unknowns()];
    // All oscillators of one place are displaced far in the same direction, so the coherence is 1 up to ε²/r².
    let network = dae.one_way().range(1);
    y[network.start + N..][..N].fill(1e6);
    let snapshot = dae.muscle_at(&y).snapshot(0.0, &y, &[]);
    let expected = |element: &usize| match active.iter().position(|own| own == element) {
        Some(1) => COHERENT,
        Some(_) => REST,
        None => 0.0,
    };
    for (element, tension) in snapshot.stress_context.tensions.iter().enumerate() {
        // (ε/r)² = 2.5e-13 of the difference.
        assert!((tension - expected(&element)).abs() < 1e-8, "{element}: {tension}");
    }
    let means = dae.factors(&y);
    let mean = REST + (COHERENT - REST) / active.len() as f64;
    assert!((means[1] - mean).abs() < 1e-8 && (means[0] - 3.0).abs() < 1e-8);
    // Without oscillators, the body equals a body with incoherent oscillators.
    let given = Muscle {
        activations: vec![(0, Activation::Given(Signal::constant(REST)))],
        ..muscle.clone()
    };
    let [coherent, given] = [muscle, given].map(|muscle| {
        let mut dae = MuscleDae::new(muscle, Formulation::Position).unwrap();
        let rest = vec![0.0; dae.n_unknowns()];
        dae.unbalanced_force(0.0, &rest, &rest).unwrap()
    });
    assert!(coherent == given && given.iter().any(|force| *force != 0.0));
    // The coupling changes no index.
    let (kinds, indices) = (dae.kinds(), dae.indices());
    assert_eq!(kinds, dae.one_way().kinds());
    assert_eq!(indices, dae.one_way().indices());
}

/// Integrates a motion of the block under its load, starting at rest without tension. Returns the state at the end, the
/// number of steps, and the system.
fn run(
    integrator: IntegratorKind,
    linear_solver: LinearSolverKind,
) -> (Vec<f64>, f64, FeedbackDae) {
    let (mut muscle, active) = body(2, 1e5, 1e-4);
    let n = muscle.solid.space().n_components();
    let down: Vec<f64> = (0..n).map(|i| if i % 2 == 1 { -2.0 } else { 0.0 }).collect();
    let signal = Signal::from(formula::StepFunction { value: 1.0, start: 0.0, rise: 0.05 });
    muscle.loads.push(Load::new(&down, signal));
    let mut dae = two_way((muscle, active), Formulation::ImplicitRate, false);
    // From rest, without tension.
    let without_tension = |feedback: &Feedback| Feedback {
        unsynchronized: match feedback.effect {
            Effect::Stiffness => feedback.unsynchronized,
            Effect::Tension => 0.0,
        },
        ..feedback.clone()
    };
    let feedbacks = dae.feedbacks().iter().map(without_tension).collect();
    dae = FeedbackDae::new(dae.one_way().clone(), feedbacks);
    let t_end = 0.3;
    let settings = Settings {
        t_end,
        linear_solver,
        ..Settings::paper(Formulation::ImplicitRate).with_integrator(integrator)
    };
    let options = CoupledOptions::of_muscle(dae.one_way().body(), &settings);
    let test = ErrorTest::of_muscle(dae.one_way().body(), &settings)
        .with_oscillators(dae.one_way(), StateTolerances::default());
    let rest = vec![0.0; dae.n_unknowns()];
    let (y_dot, _) = dae.derivatives_at(0.0, &rest).unwrap();
    let mut integrator =
        start_with_feedback(dae, test, options, [0.0, t_end], &rest, &y_dot).unwrap();
    while !matches!(integrator.advance().unwrap(), Advance::Finished) {}
    let mut y = rest;
    integrator.dense_output(t_end, 0, &mut y).unwrap();
    let steps = integrator.counts().steps as f64;
    (y, steps, integrator.problem().clone())
}

#[test]
fn eliminated_and_full_runs_agree() {
    for integrator in [IntegratorKind::Bdf, IntegratorKind::Radau5] {
        let (y, steps, dae) = run(integrator, LinearSolverKind::Condensed);
        let (y_full, steps_full, full) = run(integrator, LinearSolverKind::Full);
        // Only the matrix of the body is factorized.
        let work = |dae: &FeedbackDae| *dae.one_way().body().counters();
        assert!(work(&dae).linear.solves > 0 && work(&full).linear.solves == 0);
        assert!(work(&dae).coherence_passes > 0);
        // Rounding changes single Newton iterations and rejections.
        assert!((steps / steps_full - 1.0).abs() <= 0.02, "{steps} {steps_full}");
        // The oscillators have acted.
        let factors = dae.factors(&y);
        assert!(factors[0] < 2.9 && factors[1] > 1e3, "{factors:?}");
        for range in [dae.one_way().body_range(), dae.one_way().range(0), dae.one_way().range(1)] {
            let largest = y[range.clone()].iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            let pairs = y[range.clone()].iter().zip(&y_full[range]);
            let error = pairs.fold(0.0, |m: f64, (a, b)| m.max((a - b).abs())) / largest;
            // The tolerance, which is larger than the errors of both runs.
            assert!(error < 1e-3, "{integrator:?}: {error:e}");
        }
    }
}
