//! (34) with a richer space for the extra multiplier, compared with (33).

use myovib_fem::generate;
use myovib_model::counterexample::{MultiplierSpace, solve};
use myovib_structure::Index;

/// With the space of the pressures, μ is comparable to rounding and the index is 2. With the richer space, three rows
/// of B̃ are dependent on this beam, so the index is undefined and μ is not unique. The remaining constraints remove
/// most of v, and the displacement is wrong by a third.
#[test]
fn the_extra_multiplier_needs_the_pressures_space() {
    let mesh = generate::beam(0.1, 0.04, [4, 2]).unwrap();
    let right = solve(&mesh, MultiplierSpace::Linear).unwrap();
    assert_eq!((right.index, right.dependent), (Index::Decided(2), 0));
    // A thousand steps of rounding.
    assert!(right.multiplier < 1e-11, "{}", right.multiplier);

    let wrong = solve(&mesh, MultiplierSpace::Quadratic).unwrap();
    assert_eq!(wrong.index, Index::Singular { nullity: wrong.dependent });
    assert_eq!((wrong.multipliers, wrong.dependent), (45, 3));
    assert!(wrong.multiplier > 0.9, "{}", wrong.multiplier);
    assert!(wrong.error(&right) > 0.3, "{}", wrong.error(&right));
}
