//! Modes of beams compared with the slender limit, and under refinement.

use std::sync::Arc;

use myovib_fem::{DofMap, Law, Mesh, Solid, Space, generate};
use myovib_model::statics::Equilibrium;
use myovib_model::{Formulation, Muscle, Parameters, Signal, paper, spectrum, statics};
use myovib_structure::Mode;

const SHEAR: f64 = 2.04e4;
const LAW: Law = Law::SmallStrain { shear_modulus: SHEAR };

fn cantilever(slenderness: f64, cells: [usize; 2], kappa: f64) -> Muscle {
    let mesh = generate::beam(1.0, 1.0 / slenderness, cells).unwrap();
    paper::muscle_with_load(&mesh, LAW, kappa, 0.0, Signal::constant(0.0)).unwrap()
}

fn modes(muscle: &Muscle, count: usize) -> Vec<Mode> {
    spectrum::lowest(muscle, &Equilibrium::unloaded(muscle), count).unwrap()
}

/// Returns ω of the n-th bending mode of a slender cantilever of length 1 with this modulus.
fn bending(n: usize, slenderness: f64, modulus: f64) -> f64 {
    // Roots of 1 + cos x cosh x.
    let root: f64 = [1.875_104_068_711_961, 4.694_091_132_974_175, 7.854_757_438_237_613][n];
    root * root * (modulus / (12.0 * paper::DENSITY)).sqrt() / slenderness
}

/// Returns the slender limit in plane strain, where E/(1 - ν²) = 4 G (3κ + G)/(3κ + 4G), which is 4 G for κ = ∞.
fn slender(n: usize, slenderness: f64, kappa: f64) -> f64 {
    let modulus = if kappa.is_infinite() {
        4.0 * SHEAR
    } else {
        4.0 * SHEAR * (3.0 * kappa + SHEAR) / (3.0 * kappa + 4.0 * SHEAR)
    };
    bending(n, slenderness, modulus)
}

/// Returns ω relative to the slender limit, for the first three modes.
fn ratios(slenderness: f64, cells: [usize; 2], kappa: f64) -> [f64; 3] {
    let found = modes(&cantilever(slenderness, cells, kappa), 3);
    [0, 1, 2].map(|n| found[n].angular_frequency().unwrap() / slender(n, slenderness, kappa))
}

/// A beam that is 40 times as long as high is within half a percent of the slender limit with one row of cells, and
/// closer with two. The remaining difference of the third mode is shear, which increases for a thicker beam.
#[test]
fn slender_beams() {
    for kappa in [1e5, f64::INFINITY] {
        let coarse = ratios(40.0, [40, 1], kappa);
        let fine = ratios(40.0, [80, 2], kappa);
        assert!((fine[0] - 1.0).abs() < 5e-3, "{fine:?}");
        assert!((fine[0] - 1.0).abs() < 0.5 * (coarse[0] - 1.0).abs(), "{coarse:?} {fine:?}");
        assert!((fine[1] - 1.0).abs() < 2e-3, "{fine:?}");
        let stout = ratios(10.0, [20, 2], kappa);
        assert!(stout[2] < stout[1] && stout[1] < stout[0] && stout[2] < 0.9, "{stout:?}");
    }
}

/// A beam of square section in 3D bends in both directions with the same frequency: the frequency
/// of the plane beam with Young's modulus 9 κ G/(3κ + G) for E/(1 - ν²). It is half as slender as
/// the plane beam.
#[test]
fn a_slender_beam_in_space_bends_both_ways() {
    let slenderness = 20.0;
    for kappa in [1e5, f64::INFINITY] {
        let young = match kappa.is_infinite() {
            true => 3.0 * SHEAR,
            false => 9.0 * kappa * SHEAR / (3.0 * kappa + SHEAR),
        };
        let ratios = |cells| {
            let side = 1.0 / slenderness;
            let mesh = generate::block([0.0; 3], [1.0, side, side], cells).unwrap();
            let space = Arc::new(Space::taylor_hood(&mesh));
            let dofs = DofMap::clamped(&space, &space.nodes_of("left").unwrap()).unwrap();
            let solid = Solid::uniform(space, dofs, LAW, paper::DENSITY).unwrap();
            let muscle = Muscle::unloaded(solid, Parameters::new(0.0, 0.0, kappa).unwrap());
            let found = modes(&muscle, 2);
            [0, 1].map(|n| found[n].angular_frequency().unwrap() / bending(0, slenderness, young))
        };
        let [coarse, fine] = [ratios([20, 1, 1]), ratios([40, 2, 2])];
        for (coarse, fine) in coarse.iter().zip(&fine) {
            // Twice the deviation of the plane beam, because the clamped end is twice as large a
            // part of the length.
            assert!((fine - 1.0).abs() < 1e-2, "{kappa}: {fine}");
            assert!((fine - 1.0).abs() < 0.5 * (coarse - 1.0).abs(), "{kappa}: {coarse} {fine}");
        }
        // The diagonals of the cells distinguish the two directions, by less than the change under
        // refinement.
        assert!(
            (fine[0] - fine[1]).abs() < 0.2 * (coarse[0] - fine[0]).abs(),
            "{kappa}: {coarse:?} {fine:?}"
        );
    }
}

/// Under refinement every frequency decreases, by less each time: the decrease is at least halved,
/// which is the order that remains because of the singular corners of the clamped end.
#[test]
fn refinement_converges_from_above() {
    for kappa in [1e5, f64::INFINITY] {
        let levels: Vec<Vec<f64>> = [2, 4, 8]
            .into_iter()
            .map(|n| modes(&cantilever(5.0, [2 * n, n / 2], kappa), 3))
            .map(|found| found.iter().map(|m| m.frequency().unwrap()).collect())
            .collect();
        for (n, coarse) in levels[0].iter().enumerate() {
            let (first, second) = (coarse - levels[1][n], levels[1][n] - levels[2][n]);
            assert!(first > 2.0 * second && second > 0.0, "{levels:?}");
        }
    }
}

/// Checks uᵀ M u' = 0 for different modes, uᵀ M u = 1 for each mode, and B u + M_p p/κ = 0.
#[test]
fn shapes_are_orthonormal_in_the_mass() {
    let muscle = cantilever(5.0, [8, 2], f64::INFINITY);
    let solid = &muscle.solid;
    let found = modes(&muscle, 6);
    let nodal = |shape: &[f64]| {
        let mut full = vec![0.0; solid.dofs().n_full()];
        solid.dofs().expand(shape, &mut full);
        full
    };
    for (i, a) in found.iter().enumerate() {
        let mut image = vec![0.0; solid.dofs().n_full()];
        solid.apply_mass(&nodal(&a.shape), &mut image);
        for (j, b) in found.iter().enumerate() {
            let product: f64 = nodal(&b.shape).iter().zip(&image).map(|(b, m)| b * m).sum();
            // Rounding, amplified by the orthogonalization of a Krylov space.
            assert!((product - f64::from(u8::from(i == j))).abs() < 1e-9, "{i} {j} {product}");
        }
    }
}

/// The lowest frequencies of the muscle are below and above the 8 Hz of the load; the frequencies of the incompressible
/// muscle are higher.
#[test]
fn the_muscle_beside_its_load() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/meshes/muscle.msh");
    let mesh = Mesh::read_msh(path).unwrap();
    let frequencies = |kappa| -> Vec<f64> {
        let muscle = paper::muscle(&mesh, kappa, 0.0).unwrap();
        modes(&muscle, 10).iter().map(|m| m.frequency().unwrap()).collect()
    };
    let (soft, stiff) = (frequencies(1e5), frequencies(f64::INFINITY));
    assert!(soft[0] < 8.0 && 8.0 < soft[1], "{soft:?}");
    for (soft, stiff) in soft.iter().zip(&stiff) {
        assert!(soft < stiff, "{soft} {stiff}");
    }
}

/// Compares the power method with all modes of a small body.
#[test]
fn the_fastest_mode() {
    for kappa in [1e5, f64::INFINITY] {
        let muscle = cantilever(2.0, [4, 2], kappa);
        // Each pressure of an incompressible body removes one degree of freedom.
        let held = u8::from(kappa.is_infinite()) as usize * muscle.solid.space().n_pressures();
        let all = modes(&muscle, muscle.solid.dofs().n_free() - held);
        let fastest = all.last().unwrap().angular_frequency().unwrap();
        let found = spectrum::fastest(&muscle).unwrap();
        assert!(found <= fastest * (1.0 + 1e-9) && found > 0.95 * fastest, "{found} of {fastest}");
    }
}

/// The frequencies about a state under load differ, because tension stiffens the beam.
#[test]
fn a_stretched_beam_is_stiffer() {
    let mesh = generate::beam(1.0, 0.1, [10, 1]).unwrap();
    let pulled = |size: f64| {
        let mut muscle =
            paper::muscle_with_load(&mesh, paper::LAW, f64::INFINITY, 0.0, Signal::constant(0.0))
                .unwrap();
        let traction =
            myovib_fem::load::traction(muscle.solid.space(), "load", [size, 0.0]).unwrap();
        muscle.loads = vec![myovib_model::Load::new(&traction, Signal::constant(1.0))];
        let at = statics::equilibrium(&muscle, Formulation::Position, 0.0).unwrap();
        let found = spectrum::lowest(&muscle, &at, 1).unwrap();
        found[0].frequency().unwrap()
    };
    assert!(pulled(2e3) > 1.1 * pulled(0.0));
}

fn damping_ratios(muscle: &Muscle, count: usize) -> Vec<[f64; 2]> {
    let at = Equilibrium::unloaded(muscle);
    let found = modes(muscle, count).into_iter();
    let of = |mode: Mode| {
        let ratio = spectrum::damping_ratio(muscle, &at, &mode).unwrap();
        [mode.angular_frequency().unwrap(), ratio.unwrap()]
    };
    found.map(of).collect()
}

/// Rayleigh damping with one α and one β gives (α/ω + βω)/2, whether it is defined for the body or
/// for all its materials.
#[test]
fn damping_ratios_of_modes() {
    let mesh = generate::beam(1.0, 0.1, [20, 4]).unwrap();
    let load = || Signal::constant(0.0);
    for (kappa, beta) in [(1e5, 1e-4), (f64::INFINITY, 1e-4), (1e5, 0.0)] {
        let muscle = paper::muscle_with_load(&mesh, LAW, kappa, beta, load()).unwrap();
        let alpha = muscle.parameters.alpha;
        for [omega, ratio] in damping_ratios(&muscle, 3) {
            let expected = (alpha / omega + beta * omega) / 2.0;
            // ω² is accurate to 1e-10, and so is the part of the damping that the constraint adds with β.
            assert!((ratio / expected - 1.0).abs() < 1e-8, "{ratio} {expected}");
        }
        let parameters = Parameters::new(3.0 * alpha, beta, kappa).unwrap();
        let all = vec![parameters; mesh.n_elements()];
        let graded = Muscle::graded(muscle.solid.clone(), &all).unwrap();
        for [omega, ratio] in damping_ratios(&graded, 3) {
            let expected = (3.0 * alpha / omega + beta * omega) / 2.0;
            assert!((ratio / expected - 1.0).abs() < 1e-8, "{ratio} {expected}");
        }
    }
}
