//! Inf–sup constants on refined meshes: bounded for P2–P1, decreasing for P1–P1.

use std::sync::Arc;

use myovib_fem::{DofMap, Law, Solid, Space, generate};
use myovib_model::inf_sup::{Pair, constants, levels};
use myovib_structure::Index;

/// Three refinements of a coarse spindle.
#[test]
fn the_spindle_under_three_refinements() {
    let mesh = generate::spindle([10, 2]).unwrap();
    let stable = levels(Pair::TaylorHood, &mesh, &["fixed"], 4, |_, _| ()).unwrap();
    assert!(stable.iter().all(|level| level.nullity == 0 && level.constant > 0.57), "{stable:?}");
    // The constant has converged, so the bound holds for all h: 0.5809, 0.5715, 0.5706, 0.5705.
    assert!((stable[3].constant / stable[2].constant - 1.0).abs() < 1e-3, "{stable:?}");

    // Two pressures are undetermined on every level. The constants of the others decrease (0.0267,
    // 0.0230, 0.0171 after the first refinement), and are below a twentieth of the constant of
    // P2-P1.
    let unstable = levels(Pair::EqualOrder, &mesh, &["fixed"], 4, |_, _| ()).unwrap();
    assert!(unstable.iter().all(|level| level.nullity == 2), "{unstable:?}");
    for pair in unstable[1..].windows(2) {
        assert!(pair[1].constant < 0.9 * pair[0].constant, "{pair:?}");
    }
    assert!(unstable[3].constant < 0.05 * stable[3].constant, "{unstable:?}");

    // Without scaling, both decay: σ_min does not distinguish them.
    for family in [&stable, &unstable] {
        for pair in family[1..].windows(2) {
            assert!(pair[1].sigma_min < 0.6 * pair[0].sigma_min, "{pair:?}");
        }
    }
}

/// Checks that pressures that jump between two halves, where laws change, have nearly the same constant on all meshes.
#[test]
fn pressures_of_two_regions_under_three_refinements() {
    let constants: Vec<f64> = [2, 4, 8]
        .into_iter()
        .map(|n| {
            let mesh = generate::rectangle([0.0, 0.0], [1.0, 1.0], [n, n]).unwrap();
            let x = |vertex: &usize| mesh.coordinates()[2 * vertex];
            let half = |element: &[usize]| usize::from(element.iter().map(x).sum::<f64>() > 1.5);
            let regions: Vec<usize> = mesh.elements().map(half).collect();
            let space = Arc::new(Space::taylor_hood(&mesh).with_regions(&regions).unwrap());
            let nodes: Vec<usize> = ["left", "right"]
                .into_iter()
                .flat_map(|group| space.nodes_of(group).unwrap())
                .collect();
            let dofs = DofMap::clamped(&space, &nodes).unwrap();
            let law = Law::MooneyRivlin { c10: 0.5, c01: 0.0 };
            let solid = Solid::uniform(space, dofs, law, 1.0).unwrap();
            let found = constants(&solid).unwrap();
            assert_eq!(found.nullity(), 0);
            found.smallest().unwrap()
        })
        .collect();
    // The constant has converged, from above or below, as with one region (0.57 on the spindle).
    assert!(constants.iter().all(|constant| *constant > 0.3), "{constants:?}");
    assert!((constants[2] / constants[1] - 1.0).abs() < 0.1, "{constants:?}");
}

/// Undetermined pressures: three on a square of right diagonals clamped at two sides, so the index
/// of (28) with κ = ∞ is undefined. P2–P1 on the same mesh has index 3.
#[test]
fn pressures_without_hold_leave_no_index() {
    let mesh = generate::rectangle([0.0, 0.0], [1.0, 1.0], [4, 4]).unwrap();
    let fixed = ["left", "right"];
    let unstable = &levels(Pair::EqualOrder, &mesh, &fixed, 1, |_, _| ()).unwrap()[0];
    assert_eq!(unstable.nullity, 3);
    let found = unstable.index.as_ref().unwrap();
    assert_eq!(found.index, Index::Singular { nullity: 3 });
    assert!(found.blocks.is_empty());

    let coarse = generate::rectangle([0.0, 0.0], [1.0, 1.0], [3, 3]).unwrap();
    let stable = &levels(Pair::TaylorHood, &coarse, &fixed, 1, |_, _| ()).unwrap()[0];
    assert_eq!(stable.nullity, 0);
    assert_eq!(stable.index.as_ref().unwrap().decided(), Some(3));
}
