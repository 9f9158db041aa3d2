//! Checks that only the history of a system determines how later matrices are factorized.
#![allow(clippy::unwrap_used)] // a test may panic

use std::sync::Arc;

use myovib_sparse::{Elimination, LinearWork, SparseOptions, SparseSystem, Structure};
use nalgebra_sparse::pattern::SparsityPattern;

const GOOD: [f64; 9] = [4.0, 1.0, 0.5, 1.0, 3.0, 0.2, 0.5, 0.2, 5.0];

fn system() -> SparseSystem<f64> {
    let rows = vec![0, 1, 2, 0, 1, 2, 0, 1, 2];
    let pattern =
        SparsityPattern::try_from_offsets_and_indices(3, 3, vec![0, 3, 6, 9], rows).unwrap();
    let elimination = Elimination::new(&pattern, Structure::default(), SparseOptions::default());
    SparseSystem::new(Arc::new(elimination.unwrap()))
}

/// Factorizes the matrix with the given values, and returns the solution.
fn solve(system: &mut SparseSystem<f64>, values: &[f64; 9], work: &mut LinearWork) -> [f64; 3] {
    system.values_mut().copy_from_slice(values);
    system.renew(work).unwrap();
    let mut x = [1.0, 2.0, 3.0];
    system.solve(&mut x, work).unwrap();
    x
}

/// Regression test: after one matrix with zeros on the diagonal, all later matrices were factorized with pivoting, even
/// if an earlier history was restored.
#[test]
fn a_history_without_pivoting_is_restored() {
    let (mut system, mut work) = (system(), LinearWork::default());
    let first = solve(&mut system, &GOOD, &mut work);
    let saved = system.history();
    assert_eq!((saved, work.pivoted), ([false, false, false], 0));

    let zeros = [0.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 0.0];
    let exchanged = solve(&mut system, &zeros, &mut work);
    assert_eq!((system.history()[0], work.pivoted), (true, 1));

    system.set_history(saved).unwrap();
    assert_eq!(system.history(), saved);
    // The current factors remain in use until the next matrix is factorized.
    let mut x = [1.0, 2.0, 3.0];
    system.solve(&mut x, &mut work).unwrap();
    assert_eq!(x, exchanged);
    for _ in 0..3 {
        assert_eq!(solve(&mut system, &GOOD, &mut work), first);
    }
    assert_eq!((system.history(), work.pivoted), (saved, 1));

    system.set_history([true, false, false]).unwrap();
    solve(&mut system, &GOOD, &mut work);
    assert_eq!((system.history()[0], work.pivoted), (true, 2));
}

/// Regression test: after a rejected state with a non-finite matrix, all later matrices were expensive and their pivots
/// were not available.
#[test]
fn a_matrix_that_is_not_finite_leaves_no_factors_and_no_history() {
    for history in [[false; 3], [true, false, false]] {
        let (mut system, mut work) = (system(), LinearWork::default());
        system.set_history(history).unwrap();
        for position in [0, 4, 8] {
            solve(&mut system, &GOOD, &mut work);
            system.values_mut()[position] = f64::NAN;
            assert!(system.renew(&mut work).is_err());
            assert!(system.solve(&mut [1.0, 2.0, 3.0], &mut work).is_err());
            assert_eq!(system.history()[0], history[0]);
        }
    }
}

/// Zeros on the diagonal require pivoting. The matrix factorized after the retry does not require it.
#[test]
fn fixed_pivots_can_be_tried_again() {
    let (mut system, mut work) = (system(), LinearWork::default());
    let first = solve(&mut system, &GOOD, &mut work);
    let zeros = [0.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 0.0];
    let exchanged = solve(&mut system, &zeros, &mut work);
    for pivoted in 2..5 {
        system.retry_fixed_pivots();
        assert_eq!(solve(&mut system, &GOOD, &mut work), first);
        assert!(system.pivots().is_some());
        assert_eq!(solve(&mut system, &zeros, &mut work), exchanged);
        assert_eq!(work.pivoted, pivoted);
    }
}
