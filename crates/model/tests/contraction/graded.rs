//! κ, α and β of halves that differ.

use std::sync::Arc;

use myovib_dae::Problem;
use myovib_fem::{DofMap, FemError, Law, Solid, Space, generate, load};
use myovib_model::statics::equilibrium;
use myovib_model::{
    Formulation, Load, ModelError, Muscle, MuscleDae, Parameters, Probe, Signal, paper,
};

use crate::common::{INF, block, contracting, elastic, halves, neo_hooke};

fn parameters(alpha: f64, beta: f64, kappa: f64) -> Parameters {
    Parameters::new(alpha, beta, kappa).unwrap()
}

/// Returns values for all elements; they differ between the halves of the block.
fn by_half<T: Clone>(dimension: usize, own: [T; 2]) -> Vec<T> {
    let mesh = block(dimension);
    let right = &halves(&mesh)[1];
    let of = |element: usize| own[usize::from(right.contains(&element))].clone();
    (0..mesh.n_elements()).map(of).collect()
}

/// In a bar of two materials between walls, each half shortens as it would alone: for F = diag(a, 1), the stress in each
/// half is dW/da and does not depend on the other material.
#[test]
fn two_materials_in_a_row_shorten_as_each_does_alone() {
    let mesh = generate::rectangle([0.0; 2], [1.0, 0.8], [2, 2]).unwrap();
    let (shear, kappa) = ([2e4, 5e4], [1e5, 3e4]);
    let push = 2e4;
    for formulation in [Formulation::Position, Formulation::Displacement] {
        let regions = by_half(2, [0, 1]);
        let space = Space::taylor_hood(&mesh).with_regions(&regions).unwrap();
        let space = Arc::new(space);
        let points = space.node_points::<2>();
        let slides = |(node, axis): &(usize, usize)| *axis == 1 || points[*node][0] == 0.0;
        let all = (0..space.n_nodes()).flat_map(|node| [(node, 0), (node, 1)]);
        let held: Vec<_> = all.filter(slides).collect();
        let dofs = DofMap::new(&space, &held).unwrap();
        let laws: Vec<Law> = by_half(2, shear.map(neo_hooke));
        let solid = Solid::new(space.clone(), dofs, laws, 1e3).unwrap();
        let elements = by_half(2, kappa.map(|kappa| parameters(0.0, 0.0, kappa)));
        let traction = load::traction(&space, "right", [-push, 0.0]).unwrap();
        let muscle = Muscle {
            loads: vec![Load::new(&traction, Signal::constant(1.0))],
            ..Muscle::graded(solid, &elements).unwrap()
        };
        let state = equilibrium(&muscle, formulation, 0.0).unwrap();
        let mut u = vec![0.0; space.n_components()];
        muscle.solid.dofs().expand(&state.displacement, &mut u);
        let at = |x: f64| Probe::at(&space, [x, 0.4]).unwrap().vector(&u)[0];
        let stretches = [1.0 + 2.0 * at(0.5), 1.0 + 2.0 * (at(1.0) - at(0.5))];
        for ((a, shear), kappa) in stretches.into_iter().zip(shear).zip(kappa) {
            // W = μ/2 ((a² + 2) a^(-2/3) - 3) + κ/2 (a - 1)².
            let isochoric =
                2.0 * a * a.powf(-2.0 / 3.0) - 2.0 / 3.0 * (a * a + 2.0) * a.powf(-5.0 / 3.0);
            let stress = 0.5 * shear * isochoric + kappa * (a - 1.0);
            // Newton ends at rounding.
            assert!((stress + push).abs() < 1e-9 * push, "{formulation} {a}: {stress}");
        }
        assert!(stretches[1] < stretches[0], "{stretches:?}");
    }
}

/// Checks that a uniform body defined element by element moves like the plain body.
#[test]
fn equal_elements_are_the_plain_body() {
    let plain = contracting(2, 1e5, 1e-2, elastic());
    let mut graded = plain.clone();
    let ratio = myovib_fem::ElementScale { kappa: 0.5, alpha: 0.25, beta: 2.0 };
    let ratios = vec![ratio; graded.solid.space().n_elements()];
    graded.solid = graded.solid.with_element_scales(&ratios).unwrap();
    graded.parameters = parameters(4.0, 5e-3, 2e5);
    for formulation in [Formulation::Displacement, Formulation::Rate, Formulation::ImplicitRate] {
        let residual = |muscle: &Muscle| {
            let mut dae = MuscleDae::new(muscle.clone(), formulation).unwrap();
            let n = dae.n_unknowns();
            let wave =
                |size: f64| -> Vec<f64> { (0..n).map(|i| size * (1.3 * i as f64).sin()).collect() };
            let mut residual = vec![0.0; n];
            let (y, y_dot) = (wave(0.01), wave(0.1));
            dae.residual(0.1, &y, &y_dot, &mut residual).unwrap();
            residual
        };
        let (plain, graded) = (residual(&plain), residual(&graded));
        let largest = plain.iter().fold(0.0_f64, |m, r| m.max(r.abs()));
        for (plain, graded) in plain.iter().zip(&graded) {
            // Rounding of sums of several hundred terms.
            assert!((plain - graded).abs() < 1e-13 * largest, "{plain} {graded}");
        }
    }
}

#[test]
fn elements_of_two_sorts_are_refused() {
    let mesh = block(2);
    let build = |regions: bool, own: [Parameters; 2]| {
        let mut space = Space::taylor_hood(&mesh);
        if regions {
            space = space.with_regions(&by_half(2, [0, 1])).unwrap();
        }
        let dofs = DofMap::new(&space, &[]).unwrap();
        let solid = Solid::uniform(Arc::new(space), dofs, paper::LAW, 1e3).unwrap();
        Muscle::graded(solid, &by_half(2, own)).map(|_| ())
    };
    let refusal = |own| build(true, own).unwrap_err().to_string();
    let plain = parameters(0.0, 0.0, 1e5);
    assert!(refusal([plain, parameters(0.0, 0.0, INF)]).contains("κ = inf"));
    assert!(refusal([plain, parameters(0.0, 1e-3, 1e5)]).contains("β > 0"));
    let shared = build(false, [plain, parameters(0.0, 0.0, 2e5)]).unwrap_err();
    assert!(matches!(shared, ModelError::Fem(FemError::SharedPressure { .. })));
    // A different α does not require separate pressures.
    build(false, [plain, parameters(3.0, 0.0, 1e5)]).unwrap();
}
