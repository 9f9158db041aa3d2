//! Moving supports: allowed prescribed motions, and the power of supports and damping.

use std::sync::Arc;

use myovib_dae::Problem;
use myovib_fem::{DofMap, Solid, Space, generate};
use myovib_model::{
    AbsoluteTolerances, Energies, Field, Formulation, IntegratorKind, ModelError, Muscle,
    MuscleDae, Outcome, Parameters, Powers, Prescribed, SampleTimes, Sampler, Settings, Signal,
    formula, paper, run, start_at_rest,
};

const ALPHA: f64 = 3.0;
const BETA: f64 = 2e-3;
const KAPPA: f64 = 1e5;

/// Returns a block whose left edge is moved in y by `signal`.
fn shaken(signal: &Signal) -> Muscle {
    let mesh = generate::rectangle([0.0; 2], [0.06, 0.03], [3, 2]).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let left = space.nodes_of("left").unwrap();
    let dofs = DofMap::clamped(&space, &left).unwrap();
    let solid = Solid::uniform(space, dofs, paper::LAW, paper::DENSITY).unwrap();
    let prescribed =
        left.iter().map(|node| Prescribed { component: 2 * node + 1, signal: signal.clone() });
    Muscle {
        prescribed: prescribed.collect(),
        ..Muscle::unloaded(solid, Parameters::new(ALPHA, BETA, KAPPA).unwrap())
    }
}

/// Returns u = 0.1 t², for which u, u̇ and ü differ from zero and from each other.
fn accelerated() -> Signal {
    let table = myovib_model::Spline::new(vec![0.0, 1.0], vec![0.0, 1.0]).unwrap();
    let t = Signal::from(table);
    Signal::product(vec![Signal::constant(0.1), t.clone(), t])
}

/// Returns the state at `t` whose free components have the displacement, velocity and acceleration given by a function
/// of position and direction.
fn state(dae: &MuscleDae, at: impl Fn([f64; 2], usize) -> [f64; 3]) -> [Vec<f64>; 2] {
    let space = dae.muscle().solid.space();
    let free = dae.muscle().solid.dofs().free_to_full();
    let (mut y, mut y_dot) = (vec![0.0; dae.n_unknowns()], vec![0.0; dae.n_unknowns()]);
    for (derivative, field) in [Field::Displacement, Field::Velocity].into_iter().enumerate() {
        let range = dae.layout().range(field).unwrap();
        for (k, i) in range.zip(free) {
            let motion = at(space.node_points()[i / 2], i % 2);
            (y[k], y_dot[k]) = (motion[derivative], motion[derivative + 1]);
        }
    }
    [y, y_dot]
}

/// For a body that moves rigidly with velocity V and acceleration A, the power of the supports is m (A + α V) V, and α
/// dissipates α m V².
#[test]
fn a_body_that_moves_as_a_whole_takes_its_inertia_and_alpha_from_the_supports() {
    let signal = accelerated();
    let (t, motion) = (0.7, signal.at(0.7));
    let mut dae = MuscleDae::new(shaken(&signal), Formulation::Displacement).unwrap();
    let [y, y_dot] = state(&dae, |_, axis| match axis {
        0 => [0.0; 3],
        _ => [motion.value, motion.d1, motion.d2],
    });
    let Energies { kinetic, elastic } = dae.energies(t, &y, &y_dot);
    let Powers { load, support, active, dissipation } = dae.powers(t, &y, &y_dot).unwrap();
    let mass = paper::DENSITY * 0.06 * 0.03;
    let (v, a) = (motion.d1, motion.d2);
    let expected = [
        (kinetic, 0.5 * mass * v * v),
        (support, mass * (a + ALPHA * v) * v),
        (dissipation, ALPHA * mass * v * v),
    ];
    for (found, expected) in expected {
        // Rounding of sums of several hundred terms.
        assert!((found / expected - 1.0).abs() < 1e-11, "{found} {expected}");
    }
    assert!(elastic.abs() < 1e-12, "{elastic}");
    assert_eq!([load, active], [0.0; 2]);
}

/// For a body sheared by u = s(t) x e_y with s̈ = 0, the dissipation by β is β ∫Ṗ:∇v = β d²W/dt².
#[test]
fn beta_takes_the_second_derivative_of_the_energy() {
    let mut muscle = shaken(&Signal::constant(0.0));
    muscle.parameters = Parameters::new(0.0, BETA, KAPPA).unwrap();
    let mut dae = MuscleDae::new(muscle, Formulation::Displacement).unwrap();
    let rate = 2.0;
    let mut at = |t: f64| {
        let [y, y_dot] = state(&dae, |[x, y], axis| match axis {
            // The body is also stretched transversely, so that its volume changes.
            0 => [0.1 * rate * t * x, 0.1 * rate * x, 0.0],
            _ => [rate * t * x * (1.0 + y), rate * x * (1.0 + y), 0.0],
        });
        (dae.energies(t, &y, &y_dot).elastic, dae.powers(t, &y, &y_dot).unwrap().dissipation)
    };
    let (h, t) = (1e-3, 0.1);
    let [before, here, after] = [at(t - h), at(t), at(t + h)];
    let bend = (before.0 - 2.0 * here.0 + after.0) / (h * h);
    // Differences: h² and rounding over h², 1e-16/1e-6; the energy is a polynomial of low degree.
    let found = here.1 / (BETA * bend);
    assert!((found - 1.0).abs() < 1e-4, "{found}");
}

/// Checks the energy balance over a run with both kinds of damping and a moving support, by Simpson's rule over 1 ms.
#[test]
fn work_of_a_moving_support_is_stored_or_dissipated() {
    let shake = Signal::product(vec![
        Signal::from(formula::StepFunction { value: 1.0, start: 0.0, rise: 0.1 }),
        Signal::from(formula::Sine { amplitude: 2e-3, frequency: 8.0, phase: 0.0 }),
    ]);
    let dae = MuscleDae::new(shaken(&shake), Formulation::ImplicitRate).unwrap();
    let rtol = 1e-7;
    let settings = Settings {
        integrator: IntegratorKind::Radau9,
        t_end: 0.5,
        relative_tolerance: rtol,
        absolute_tolerances: AbsoluteTolerances {
            displacement: 1e-3 * rtol,
            velocity: 1e-1 * rtol,
            pressure: 1e2 * rtol,
            multiplier: 1e3 * rtol,
        },
        suppressed: Vec::new(),
        ..Settings::paper(Formulation::ImplicitRate)
    };
    let n = dae.n_unknowns();
    let mut integrator = start_at_rest(dae, &settings).unwrap();
    let (mut stored, mut states) = (Energies::default(), Vec::new());
    let times = SampleTimes::new(1e-3, 0.5);
    let mut sampler = Sampler::new(times, n, |dae: &mut MuscleDae, t, y: &[f64]| {
        // The derivatives at this state, rather than of an interpolating polynomial.
        let start = myovib_model::InitialValues::of(dae, t, y)?;
        stored = dae.energies(t, &start.y, &start.y_dot);
        states.push(dae.powers(t, &start.y, &start.y_dot)?);
        Ok(())
    });
    let statistics = run(integrator.as_mut(), &mut [&mut sampler]).unwrap();
    assert_eq!(statistics.outcome, Outcome::Finished);
    drop(sampler);
    let total = |power: fn(&Powers) -> f64| -> f64 {
        let pairs = states.windows(3).step_by(2);
        pairs.map(|e| 2e-3 / 6.0 * (power(&e[0]) + 4.0 * power(&e[1]) + power(&e[2]))).sum()
    };
    let (work, lost) = (total(|e| e.support), total(|e| e.dissipation));
    let stored = stored.kinetic + stored.elastic;
    assert!(lost > 0.3 * work, "{lost} {work}: damping is to count");
    let imbalance = (stored + lost - work).abs() / work;
    assert!(imbalance < 1e-4, "{imbalance:e}: {stored} + {lost} against {work}");
}

/// Regression: a prescribed motion of a free component was accepted and caused an inconsistent system.
#[test]
fn only_constrained_components_that_move_smoothly_are_prescribed() {
    let smooth = accelerated();
    let kinked = Signal::from(formula::Ramp { value: 1.0, start: 0.1, end: 0.2 });
    let refused = |change: fn(&mut Muscle, &Signal), signal: &Signal| {
        let mut muscle = shaken(&smooth);
        change(&mut muscle, signal);
        let composed = MuscleDae::new(muscle.clone(), Formulation::Displacement).map(|_| ());
        let at_rest = myovib_model::statics::equilibrium(&muscle, Formulation::Displacement, 0.0);
        for result in [composed, at_rest.map(|_| ())] {
            assert!(matches!(result, Err(ModelError::Prescribed { .. })), "{result:?}");
        }
    };
    let prescribe = |muscle: &mut Muscle, signal: &Signal| {
        let free = muscle.solid.dofs().free_to_full()[0];
        muscle.prescribed[0].component = free;
        muscle.prescribed[0].signal = signal.clone();
    };
    refused(prescribe, &smooth);
    refused(|muscle, _| muscle.prescribed[0].component = 1_000_000, &smooth);
    refused(|muscle, _| muscle.prescribed[1].component = muscle.prescribed[0].component, &smooth);
    // An equilibrium uses the value at a single time.
    let mut muscle = shaken(&smooth);
    muscle.prescribed[0].signal = kinked;
    let composed = MuscleDae::new(muscle, Formulation::Displacement).map(|_| ());
    assert!(matches!(composed, Err(ModelError::Prescribed { .. })));
}
