//! Pressure on the deformed boundary of a model: exact equilibrium, exact tangent, no cost without pressure.

use std::sync::Arc;

use myovib_dae::Problem;
use myovib_fem::{DofMap, Law, Solid, Space, generate};
use myovib_model::equation::{Added, Context, PressureRateSource};
use myovib_model::statics::equilibrium;
use myovib_model::{
    Equation, Formulation, LinearSolverKind, Matrix, Muscle, MuscleDae, Parameters, Settings,
    Signal, SurfaceLoad, Term, paper, run, start_at_rest,
};

use crate::common::loaded_block;

/// Returns a quarter of a block of 2 m by 1 m, supported on its planes of symmetry, under pressure on all sides.
fn squeezed(c10: f64, c01: f64, kappa: f64, pressure: f64) -> Muscle {
    let mesh = generate::rectangle([0.0; 2], [1.0, 0.5], [3, 2]).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let held = |group: &str, axis: usize| {
        let nodes = space.nodes_of(group).unwrap();
        nodes.into_iter().map(move |node| (node, axis))
    };
    let held: Vec<_> = held("left", 0).chain(held("bottom", 1)).collect();
    let dofs = DofMap::new(&space, &held).unwrap();
    let solid = Solid::uniform(space, dofs, Law::MooneyRivlin { c10, c01 }, 1e3).unwrap();
    let pressures = ["right", "top"]
        .map(|group| SurfaceLoad::pressure(&solid, group, Signal::constant(pressure)).unwrap());
    Muscle {
        surface_loads: pressures.into(),
        ..Muscle::unloaded(solid, Parameters::new(0.0, 0.0, kappa).unwrap())
    }
}

/// For F = diag(a, a, 1), the energy W(a) and the work p a² per area balance: W' + 2 p a = 0.
#[test]
fn a_block_under_pressure_all_round_shrinks_evenly_to_the_exact_size() {
    let (c10, c01, kappa, p) = (1e4, 2e2, 1e5, 4e4);
    let muscle = squeezed(c10, c01, kappa, p);
    let solution = equilibrium(&muscle, Formulation::Position, 0.0).unwrap();
    let space = muscle.solid.space();
    let mut u = vec![0.0; space.n_components()];
    muscle.solid.dofs().expand(&solution.displacement, &mut u);
    let corner = space.node_points().iter().position(|x| *x == [1.0, 0.5]).unwrap();
    let a = 1.0 + u[2 * corner];
    assert!(a < 0.95, "{a}");
    for (node, x) in space.node_points::<2>().iter().enumerate() {
        for axis in 0..2 {
            // Newton ends at rounding.
            let apart = u[2 * node + axis] - (a - 1.0) * x[axis];
            assert!(apart.abs() < 1e-12, "{apart:e}");
        }
    }
    let (i1, i2) = (2.0 * a * a + 1.0, a.powi(4) + 2.0 * a * a);
    let i1_slope = 4.0 * a * a.powf(-4.0 / 3.0) - 4.0 / 3.0 * i1 * a.powf(-7.0 / 3.0);
    let i2_slope =
        (4.0 * a.powi(3) + 4.0 * a) * a.powf(-8.0 / 3.0) - 8.0 / 3.0 * i2 * a.powf(-11.0 / 3.0);
    let slope = c10 * i1_slope + c01 * i2_slope + 2.0 * kappa * (a * a - 1.0) * a;
    // The error of a is 1e-12, as above; W'' is about 6 κ.
    assert!((slope + 2.0 * p * a).abs() < 1e-12 * 6.0 * kappa, "{:e}", slope + 2.0 * p * a);
}

/// Returns the loaded block with an additional pressure on the loaded edge.
fn pressed(law: Law, beta: f64, signal: Signal) -> Muscle {
    let mut muscle = loaded_block(0, law, 1e5, beta, Signal::paper(1e3));
    let pressure = SurfaceLoad::pressure(&muscle.solid, "load", signal).unwrap();
    muscle.surface_loads.push(pressure);
    muscle
}

/// The pressure load is linear in u, so the difference of the Jacobians with and without pressure must be the exact
/// derivative of the difference of the residuals.
#[test]
fn the_jacobian_of_every_formulation_has_its_exact_derivative() {
    let small = Law::SmallStrain { shear_modulus: 2.04e4 };
    for (law, beta) in [(paper::LAW, 1e-2), (small, 0.0), (paper::LAW, 0.0)] {
        for formulation in Formulation::ALL {
            let with = pressed(law, beta, Signal::paper(1e4));
            let mut without = with.clone();
            without.surface_loads.clear();
            let mut with = MuscleDae::for_analysis(with, formulation);
            let mut without = MuscleDae::for_analysis(without, formulation);
            let n = with.n_unknowns();
            let wave = |k: f64| (0..n).map(|i| 0.02 * (k * i as f64).sin()).collect::<Vec<_>>();
            let (y, d, y_dot) = (wave(1.0), wave(2.0), vec![0.0; n]);
            let moved: Vec<f64> = y.iter().zip(&d).map(|(y, d)| y + d).collect();
            // Evaluated twice, because a linear law keeps its matrices after the first evaluation.
            for t in [0.3, 0.97] {
                let mut load = |y: &[f64]| {
                    let (mut a, mut b) = (vec![0.0; n], vec![0.0; n]);
                    with.residual(t, y, &y_dot, &mut a).unwrap();
                    without.residual(t, y, &y_dot, &mut b).unwrap();
                    a.iter().zip(&b).map(|(a, b)| a - b).collect::<Vec<_>>()
                };
                let (before, after) = (load(&y), load(&moved));
                let product = |dae: &mut MuscleDae| {
                    let pattern = dae.jacobian_pattern();
                    let mut values = vec![0.0; pattern.nnz()];
                    dae.jacobian(t, &y, &y_dot, 1.0, 0.0, &mut values).unwrap();
                    let mut product = vec![0.0; n];
                    for ((column, row), value) in pattern.entries().zip(&values) {
                        product[row] += value * d[column];
                    }
                    product
                };
                let (a, b) = (product(&mut with), product(&mut without));
                let mut largest = 0.0_f64;
                for i in 0..n {
                    let expected = after[i] - before[i];
                    largest = largest.max(expected.abs());
                    // Differences of nodal forces of up to 1e4.
                    let error = (a[i] - b[i] - expected).abs();
                    assert!(error < 1e-9, "{formulation} {law:?} t={t}, row {i}: {error:e}");
                }
                assert!(largest > 1e-2, "{formulation}: the pressure does nothing");
            }
        }
    }
}

/// The condensed and the full Newton matrix result in equal steps.
#[test]
fn a_pulse_of_pressure_is_followed_with_either_linear_solver() {
    let steps = [LinearSolverKind::Condensed, LinearSolverKind::Full].map(|linear_solver| {
        let pulse = Signal::paper(2e3);
        let dae = MuscleDae::new(pressed(paper::LAW, 0.0, pulse), Formulation::Position).unwrap();
        let settings =
            Settings { t_end: 1.0, linear_solver, ..Settings::paper(Formulation::Position) };
        let mut integrator = start_at_rest(dae, &settings).unwrap();
        let statistics = run(integrator.as_mut(), &mut []).unwrap();
        assert_eq!(statistics.t_reached, 1.0, "{:?}", statistics.outcome);
        // With exact tangents, Newton's method does not fail in any step.
        assert_eq!(statistics.counts.step_solve_failures, 0);
        statistics.counts.steps
    });
    assert!(steps[0].abs_diff(steps[1]) * 50 <= steps[0], "{steps:?}");
}

#[test]
fn without_pressure_the_pressure_matrices_are_missing() {
    let terms = |pressed: bool| {
        Equation::Momentum.terms(&Context {
            alpha: 1.0,
            beta: 1e-4,
            inv_kappa: 0.0,
            has_pressure: true,
            pressure_rate: PressureRateSource::Derivative,
            pressed,
            added: Added::default(),
            graded: false,
            coherence: false,
        })
    };
    let of_load = |term: &Term| term.matrix == Matrix::PressureStiffness;
    assert!(!terms(false).iter().any(of_load));
    assert_eq!(terms(true).iter().filter(|term| of_load(term)).count(), 1);
}
