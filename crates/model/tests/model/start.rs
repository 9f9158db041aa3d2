//! Consistent starts from a bent and moving state.

use std::ops::ControlFlow;
use std::sync::Arc;

use myovib_dae::Problem;
use myovib_fem::solid::{Fields, Pressure, Vectors};
use myovib_fem::{DofMap, Solid, Space, generate, load};
use myovib_model::start::residuals;
use myovib_model::{
    Advance, Field, Formulation, IdaIntegrator, InitialValues, Integrator, Load, Muscle, MuscleDae,
    Parameters, Prescribed, Settings, Signal, formula, ida, paper,
};

/// Returns displacements and velocities of the free components of a moving cantilever, bent by a fifth of its
/// length.
fn bent(dae: &MuscleDae) -> (Vec<f64>, Vec<f64>) {
    let space = dae.muscle().solid.space();
    let dimension = space.dimension();
    let shape = |i: usize, size: f64| {
        let point = space.node_point(i / dimension);
        let (x, y, z) = (point[0], point[1], point.get(2).unwrap_or(&0.0));
        let s = x / LENGTH;
        // A beam that bends and shortens, with rotating cross sections; in 3D, it also twists.
        [-2.0 * size * s * y / LENGTH, size * s * s - size * s * z / LENGTH, size * s * y / LENGTH]
            [i % dimension]
    };
    let free = dae.muscle().solid.dofs().free_to_full();
    (
        free.iter().map(|&i| shape(i, 0.2 * LENGTH)).collect(),
        free.iter().map(|&i| shape(i, 0.5)).collect(),
    )
}

const LENGTH: f64 = 0.1;
const INFINITE: f64 = f64::INFINITY;

fn sine(amplitude: f64) -> Signal {
    Signal::from(formula::Sine { amplitude, frequency: 8.0, phase: 0.5 })
}

fn dae(formulation: Formulation, kappa: f64, beta: f64) -> MuscleDae {
    let mesh = generate::beam(LENGTH, 0.02, [8, 2]).unwrap();
    let muscle = paper::muscle_with_load(&mesh, paper::LAW, kappa, beta, sine(200.0)).unwrap();
    MuscleDae::new(muscle, formulation).unwrap()
}

/// Returns the corresponding body in 3D, with equal thickness and height.
fn in_space(formulation: Formulation, kappa: f64, beta: f64) -> MuscleDae {
    let (lower, upper) = ([0.0, -0.01, -0.01], [LENGTH, 0.01, 0.01]);
    let space = Arc::new(Space::taylor_hood(&generate::block(lower, upper, [4, 1, 1]).unwrap()));
    let load = load::traction(&space, "right", [0.0, 1.0, 0.0]).unwrap();
    let dofs = DofMap::clamped(&space, &space.nodes_of("left").unwrap()).unwrap();
    let solid = Solid::uniform(space, dofs, paper::LAW, paper::DENSITY).unwrap();
    let parameters = Parameters::new(paper::ALPHA, beta, kappa).unwrap();
    let muscle = Muscle {
        loads: vec![Load::new(&load, sine(200.0))],
        ..Muscle::unloaded(solid, parameters)
    };
    MuscleDae::new(muscle, formulation).unwrap()
}

/// Returns a muscle with a support that moves transversely by a millimeter.
fn shaken(dae: &MuscleDae) -> MuscleDae {
    let mut muscle = dae.muscle().clone();
    let space = muscle.solid.space();
    let left = |node: &usize| space.node_point(*node)[0] == 0.0;
    let held: Vec<usize> = (0..space.n_nodes()).filter(left).collect();
    let prescribed = held
        .iter()
        .map(|node| Prescribed { component: space.dimension() * node + 1, signal: sine(1e-3) });
    muscle.prescribed = prescribed.collect();
    MuscleDae::new(muscle, dae.formulation()).unwrap()
}

const RUNS: [(Formulation, f64, f64); 11] = [
    (Formulation::Displacement, 1e5, 0.0),
    (Formulation::Displacement, 1e5, 1e-4),
    (Formulation::Position, 1e5, 0.0),
    (Formulation::Position, INFINITE, 0.0),
    (Formulation::Velocity, 1e5, 0.0),
    (Formulation::Velocity, INFINITE, 0.0),
    (Formulation::Stabilized, INFINITE, 0.0),
    (Formulation::Rate, 1e5, 1e-4),
    (Formulation::Rate, INFINITE, 1e-4),
    (Formulation::ImplicitRate, 1e5, 1e-4),
    (Formulation::ImplicitRate, INFINITE, 1e-4),
];

fn start(dae: &mut MuscleDae) -> InitialValues {
    let (q, v) = bent(dae);
    InitialValues::new(dae, 0.0, &q, &v).unwrap()
}

/// Rounding of sums of several hundred terms.
const ROUNDING: f64 = 1e-13;

#[test]
fn the_residual_is_at_rounding_level() {
    let bodies = RUNS.iter().flat_map(|&(formulation, kappa, beta)| {
        let bodies = [dae, in_space].map(|dae| dae(formulation, kappa, beta));
        let moved = bodies.each_ref().map(shaken);
        let all = bodies.into_iter().chain(moved);
        all.map(move |dae| (dae, formulation, kappa, beta))
    });
    for (mut dae, formulation, kappa, beta) in bodies {
        let start = start(&mut dae);
        for block in residuals(&mut dae, 0.0, &start.y, &start.y_dot).unwrap() {
            let name = format!("{formulation} kappa={kappa} beta={beta} {block}");
            assert!(block.relative < ROUNDING, "{name}");
        }
        // Only an incompressible body is changed by the projection, and only slightly: the given values are 0.02 m and
        // 0.5 m/s.
        let moved = kappa.is_infinite();
        assert_eq!(start.displacement_moved > 0.0, moved);
        assert!(start.displacement_moved < 5e-3 && start.velocity_moved < 0.1, "{formulation}");
        assert_eq!(start.on_slow_manifold, moved && beta > 0.0);
    }
}

/// Returns ∫ψ(J − 1) for the motion q + t v + ½ t² v̇ from a start, including its supports, after the time t.
fn volume_residual(dae: &MuscleDae, start: &InitialValues, t: f64) -> Vec<f64> {
    let solid = &dae.muscle().solid;
    let block = |of: &[f64], field| of[dae.layout().range(field).unwrap()].to_vec();
    let (q, v) = (block(&start.y, Field::Displacement), block(&start.y, Field::Velocity));
    let acceleration = block(&start.y_dot, Field::Velocity);
    let path = |i: usize| q[i] + t * (v[i] + 0.5 * t * acceleration[i]);
    let free: Vec<f64> = (0..q.len()).map(path).collect();
    let mut u = vec![0.0; solid.dofs().n_full()];
    solid.dofs().expand(&free, &mut u);
    for prescribed in &dae.muscle().prescribed {
        u[prescribed.component] = prescribed.signal.at(t).value;
    }
    let n_pressures = solid.space().n_pressures();
    let (pressure, mut volume_residual) = (vec![0.0; n_pressures], vec![0.0; n_pressures]);
    let mut out = Vectors { volume_residual: Some(&mut volume_residual), ..Vectors::default() };
    let fields = Fields::new(&u, Pressure::Nodal(&pressure));
    solid.evaluate(&fields, &mut out).unwrap();
    volume_residual
}

/// For an incompressible body the first and second derivatives of the volume vanish, although
/// equations of lower index do not contain this: in 2D, where the constraint's gradient is linear
/// in the displacement, and in 3D.
#[test]
fn velocities_and_accelerations_keep_the_volume() {
    // Differences at -3 h to 3 h: exact for polynomials of degree 6. The volume along a path of
    // degree 2 has degree 4 in 2D and 6 in 3D.
    const FIRST: [f64; 3] = [3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0];
    const SECOND: [f64; 3] = [3.0 / 2.0, -3.0 / 20.0, 1.0 / 90.0];
    const H: f64 = 2e-4;
    let incompressible = RUNS.iter().filter(|(_, kappa, _)| kappa.is_infinite());
    for &(formulation, kappa, beta) in incompressible {
        let bodies = [dae, in_space].map(|dae| dae(formulation, kappa, beta));
        let moved = bodies.each_ref().map(shaken);
        for mut dae in bodies.into_iter().chain(moved) {
            let start = start(&mut dae);
            let at = |k: i32| volume_residual(&dae, &start, H * f64::from(k));
            let (middle, sides) = (at(0), [1, 2, 3].map(|k| [at(-k), at(k)]));
            let solid = &dae.muscle().solid;
            // Magnitude of both derivatives: a fraction of the body times its strain rate, and the square of the strain
            // rate.
            let rate: f64 = 0.5 / LENGTH;
            for (i, weight) in solid.pressure_weights().iter().enumerate() {
                let (mut first, mut second) = (0.0, -49.0 / 18.0 * middle[i]);
                for (k, [before, after]) in sides.iter().enumerate() {
                    first += FIRST[k] * (after[i] - before[i]);
                    second += SECOND[k] * (after[i] + before[i]);
                }
                let found =
                    [first / H / (weight * rate), second / H.powi(2) / (weight * rate.powi(2))];
                // Rounding of J, 1e-16, divided by h times the rate, 1e-3, and by its square, for
                // sums of about ten terms; and the truncation of the sine, (2 ω h)⁶ / 140 = 5e-13
                // with ω = 50 per second, times about ten.
                assert!(
                    found[0].abs() < 1e-10 && found[1].abs() < 1e-8,
                    "{formulation} beta={beta} in {}: {found:?}",
                    solid.space().dimension()
                );
            }
        }
    }
}

/// Checks that an error is reported with its location: one row of one block, with the name of its
/// node.
#[test]
fn a_wrong_start_is_located() {
    let mut dae = dae(Formulation::Position, INFINITE, 0.0);
    let mut start = start(&mut dae);
    let row = dae.layout().range(Field::Velocity).unwrap().start + 7;
    start.y_dot[row] += 1.0;
    let blocks = residuals(&mut dae, 0.0, &start.y, &start.y_dot).unwrap();
    let wrong: Vec<_> = blocks.iter().filter(|b| b.relative > ROUNDING).collect();
    assert_eq!(wrong.len(), 1, "{wrong:?}");
    assert_eq!((wrong[0].field, &wrong[0].worst), (Field::Velocity, &dae.component_name(row)));
    let reported = wrong[0].to_string();
    assert!(reported.starts_with("momentum: "), "{reported}");
}

/// Creates an integrator for a start, which is advanced step by step.
fn integrator(
    dae: MuscleDae,
    start: &InitialValues,
    rtol: f64,
    t_end: f64,
) -> IdaIntegrator<MuscleDae> {
    let settings = Settings { relative_tolerance: rtol, ..Settings::paper(dae.formulation()) };
    let options = ida::options(&dae, &settings);
    IdaIntegrator::new(dae, options, t_end, &start.y, &start.y_dot).unwrap()
}

/// Returns max |y - y(0) - t ẏ(0)| of a block over the first nine steps, relative to max |y(0)|.
fn departure(dae: MuscleDae, start: &InitialValues, field: Field) -> f64 {
    let range = dae.layout().range(field).unwrap();
    let size = range.clone().map(|i| start.y[i].abs()).fold(0.0, f64::max);
    let mut integrator = integrator(dae, start, 1e-5, 0.1);
    let mut y = vec![0.0; start.y.len()];
    let mut largest = 0.0_f64;
    for _ in 0..9 {
        assert_eq!(integrator.advance().unwrap(), Advance::Stepped);
        let t = integrator.time();
        integrator.dense_output(t, 0, &mut y).unwrap();
        for i in range.clone() {
            largest = largest.max((y[i] - start.y[i] - t * start.y_dot[i]).abs());
        }
    }
    largest / size
}

/// Checks that λ and μ continue smoothly from their initial values. The remaining error is due to the method: in the
/// first steps of BDF, variables of index 3 only have first-order accuracy (a thousandth for λ of (28), a tenth for μ
/// of (29)).
#[test]
fn the_first_steps_show_no_transient() {
    for (formulation, kappa, beta) in RUNS {
        for (field, bound) in [(Field::Pressure, 2e-3), (Field::PressureRate, 0.1)] {
            if formulation.has(field) {
                let mut dae = dae(formulation, kappa, beta);
                let start = start(&mut dae);
                let found = departure(dae, &start, field);
                assert!(found < bound, "{field} of {formulation} kappa={kappa}: {found:.1e}");
            }
        }
    }
}

/// With κ = ∞ and β > 0 any λ(0) is consistent. On the slow manifold μ keeps its size. If λ is off
/// by a tenth, the residual is equally small, but μ starts at many times that size and decays as
/// e^(-t/β).
#[test]
fn off_the_slow_manifold_there_is_a_transient() {
    let beta = 1e-4;
    let sizes = |shift: f64| -> [f64; 2] {
        let mut dae = dae(Formulation::Rate, INFINITE, beta);
        let mut start = start(&mut dae);
        let range = |field| dae.layout().range(field).unwrap();
        let (lambda, mu) = (range(Field::Pressure), range(Field::PressureRate));
        // The rows of Bᵀ(λ + β μ) + β Ḃᵀλ, the latter being of the order of β |∇v| of the former.
        for (i, j) in lambda.zip(mu.clone()) {
            let shift = shift * start.y[i];
            start.y[i] += shift;
            start.y[j] -= shift / beta;
            start.y_dot[i] = start.y[j];
        }
        for block in residuals(&mut dae, 0.0, &start.y, &start.y_dot).unwrap() {
            assert!(block.relative < 10.0 * beta, "{block}");
        }
        let mut integrator = integrator(dae, &start, 1e-6, 5.0 * beta);
        while integrator.advance().unwrap() != Advance::Finished {}
        let mut y = vec![0.0; start.y.len()];
        integrator.dense_output(5.0 * beta, 0, &mut y).unwrap();
        [&start.y, &y].map(|y| y[mu.clone()].iter().fold(0.0, |m: f64, mu| m.max(mu.abs())))
    };
    let [before, after] = sizes(0.0);
    assert!((0.5..2.0).contains(&(after / before)), "{before:.1e} {after:.1e}");
    let [off, later] = sizes(0.1);
    assert!(off > 5.0 * before, "{off:.1e} against {before:.1e}");
    assert!(later < 0.3 * off, "{off:.1e} {later:.1e}");
}

/// The multiplier of (33) remains zero up to rounding and the error of steps, relative to its unit ρ v L.
#[test]
fn the_stabilizing_multiplier_stays_zero() {
    let mut dae = dae(Formulation::Stabilized, INFINITE, 0.0);
    let start = start(&mut dae);
    let range = dae.layout().range(Field::GglMultiplier).unwrap();
    assert!(start.y[range.clone()].iter().all(|mu| *mu == 0.0));
    let mut integrator = integrator(dae, &start, 1e-5, 0.1);
    let mut y = vec![0.0; start.y.len()];
    for _ in 0..9 {
        integrator.advance().unwrap();
        integrator.dense_output(integrator.time(), 0, &mut y).unwrap();
        let largest = y[range.clone()].iter().fold(0.0_f64, |m, mu| m.max(mu.abs()));
        assert!(largest < 1e-6 * paper::DENSITY * 0.5 * LENGTH, "{largest:.1e}");
    }
}

/// Compares λ(t) at 2 ms for all formulations of the same physics.
#[test]
fn formulations_agree_after_the_start() {
    const T: f64 = 2e-3;
    let pressure_at = |formulation, kappa, beta| -> Vec<f64> {
        let mut dae = dae(formulation, kappa, beta);
        let start = start(&mut dae);
        let range = dae.layout().range(Field::Pressure).unwrap();
        let mut integrator = integrator(dae, &start, 1e-6, T);
        while integrator.advance().unwrap() != Advance::Finished {}
        let mut y = vec![0.0; start.y.len()];
        integrator.dense_output(T, 0, &mut y).unwrap();
        y[range].to_vec()
    };
    use Formulation::{ImplicitRate, Position, Rate, Stabilized, Velocity};
    for (kappa, beta, formulations) in [
        (INFINITE, 0.0, &[Position, Velocity, Stabilized][..]),
        (1e5, 0.0, &[Position, Velocity]),
        (INFINITE, 1e-4, &[Rate, ImplicitRate]),
        (1e5, 1e-4, &[Rate, ImplicitRate]),
    ] {
        let reference = pressure_at(formulations[0], kappa, beta);
        let size = reference.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
        for formulation in &formulations[1..] {
            let other = pressure_at(*formulation, kappa, beta);
            let apart =
                reference.iter().zip(&other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // The error of hundreds of steps with a tolerance of 1e-6, in a variable of index up to 3.
            assert!(
                apart < 5e-3 * size,
                "{formulation} kappa={kappa} beta={beta}: {:.1e}",
                apart / size
            );
        }
    }
}

/// Checks that a static equilibrium is a start at rest.
#[test]
fn equilibrium_is_a_start_at_rest() {
    for (formulation, kappa, beta) in RUNS {
        let mut dae = dae(formulation, kappa, beta);
        let start =
            InitialValues::equilibrium(&mut dae, 0.0, &mut |_| ControlFlow::Continue(())).unwrap();
        let v = dae.layout().range(Field::Velocity).unwrap();
        assert!(start.y[v.clone()].iter().all(|v| v.abs() < 1e-15), "{formulation}");
        // The load over the mass of an element's patch would be 200 Pa / (1.1e3 kg/m³ 5e-3 m).
        let largest = start.y_dot[v].iter().fold(0.0_f64, |m, a| m.max(a.abs()));
        assert!(largest < 1e-8 * 200.0 / (1.1e3 * 5e-3), "{formulation}: {largest:.1e}");
        for block in residuals(&mut dae, 0.0, &start.y, &start.y_dot).unwrap() {
            assert!(block.relative < ROUNDING, "{formulation} {block}");
        }
    }
}
