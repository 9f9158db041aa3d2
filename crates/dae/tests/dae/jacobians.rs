//! Detection of wrong entries in Jacobians.

use myovib_conformance::samples::{
    Akzo, Altered, MechanicalForm, Pendulum, Robertson, Sample, VanDerPol,
};
use myovib_dae::{Linearization, Problem, StepError, Tolerances, check_jacobian};

/// Checks the Jacobian of a sample near its start (y changed by 10 %), first unchanged and then with each entry doubled
/// or negated. Returns the number of detected changes and the number of all changes.
fn found<S: Sample + Clone>(sample: &S) -> (usize, usize) {
    let start = sample.start();
    let y: Vec<f64> = start.y.iter().map(|y| 1.1 * y + 0.1).collect();
    let weights = vec![1e4; y.len()];
    let at =
        Linearization { t: start.t, y: &y, y_dot: &start.y_dot, step: 1e-3, weights: &weights };
    let checked = |place, factor| {
        let sample = sample.clone();
        check_jacobian(&mut Altered { sample, place, factor }, &at)
    };
    assert_eq!(checked(0, 1.0), Ok(()));
    let pattern = sample.jacobian_pattern();
    let places: Vec<(usize, usize)> = pattern.entries().collect();
    let mut count = 0;
    for (place, (column, row)) in places.iter().enumerate() {
        for factor in [2.0, -1.0] {
            if let Err(wrong) = checked(place, factor) {
                assert_eq!((wrong.row, wrong.column), (*row, *column));
                count += 1;
            }
        }
    }
    (count, 2 * places.len())
}

/// Checks that neither entries of a correct Jacobian nor correct entries of a wrong Jacobian are reported.
#[test]
fn wrong_entries_are_named() {
    // Some entries of Robertson's full pattern are zero, so doubling them has no effect.
    assert!(found(&Robertson).0 >= 12, "{:?}", found(&Robertson));
    assert!(found(&VanDerPol { vdp_mu: 10.0 }).0 >= 4);
    assert!(found(&Akzo).0 >= 20, "{:?}", found(&Akzo));
}

/// Checks that every nonzero entry of the form of Gear, Gupta and Leimkuhler is reported if its sign is wrong.
/// Regression test: wrong entries of the multiplier μ were not found, because μ is zero and its tolerance is therefore
/// small relative to the tolerances of velocities.
#[test]
fn entries_of_a_variable_with_a_small_tolerance_are_found() {
    let mut sample = Pendulum::new(MechanicalForm::Stabilized);
    let tension = 1.0 + 0.6 * 9.81;
    let y = [0.8, -0.6, 0.6, 0.8, tension, 0.0];
    let y_dot = [0.6, 0.8, -tension * 0.8, tension * 0.6 - 9.81, 0.0, 0.0];
    let mut weights = [0.0; 6];
    Tolerances::scalar(1e-6, 1e-8).write_weights(&y, &mut weights);
    let at = Linearization { t: 0.0, y: &y, y_dot: &y_dot, step: 1e-3, weights: &weights };
    let [mut df_dy, mut df_dyp] = [[0.0; 36]; 2];
    sample.jacobian_parts(0.0, &y, &y_dot, [&mut df_dy, &mut df_dyp]).unwrap();
    for place in 0..36 {
        let wrong = check_jacobian(&mut Altered { sample, place, factor: -1.0 }, &at).err();
        let entry = wrong.map(|wrong| (wrong.row, wrong.column));
        let is_changed = df_dy[place] != 0.0 || df_dyp[place] != 0.0;
        assert_eq!(entry, is_changed.then_some((place % 6, place / 6)));
    }
}

/// Checks that entries with an error of at least 2 % are reported, as documented, and that half of this error is
/// accepted.
#[test]
fn small_relative_errors_are_found() {
    let at = Linearization { t: 0.0, y: &[0.0], y_dot: &[0.0], step: 1e-3, weights: &[1e4] };
    for (derivative, is_correct) in
        [(1.0, true), (1.01, true), (0.99, true), (1.03, false), (0.9, false)]
    {
        let checked = check_jacobian(&mut Stated(|y| y + y.powi(3), derivative), &at);
        assert_eq!(checked.is_ok(), is_correct, "{derivative}");
    }
}

/// A function of y, and the stated derivative at 0.
struct Stated(fn(f64) -> f64, f64);

impl Problem for Stated {
    fn n_unknowns(&self) -> usize {
        1
    }

    fn residual(&mut self, _: f64, y: &[f64], _: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        r[0] = self.0(y[0]);
        Ok(())
    }

    fn jacobian(
        &mut self,
        _: f64,
        _: &[f64],
        _: &[f64],
        a: f64,
        _: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        values[0] = a * self.1;
        Ok(())
    }
}

/// Checks that the slopes on both sides of a kink, and slopes between them, are accepted, and that other values are
/// rejected.
#[test]
fn one_sided_derivatives_at_a_kink_are_correct() {
    let at = Linearization { t: 0.0, y: &[0.0], y_dot: &[0.0], step: 1e-3, weights: &[1e4] };
    for (derivative, is_correct) in
        [(0.0, true), (0.5, true), (1.0, true), (2.0, false), (-1.0, false)]
    {
        let checked = check_jacobian(&mut Stated(|y| y.max(0.0), derivative), &at);
        assert_eq!(checked.is_ok(), is_correct, "{derivative}");
    }
}

/// Displacements by the tolerance of 1e-20 have no effect on F, because F adds them to 1.
#[test]
fn an_entry_that_rounding_hides_is_correct() {
    let at = Linearization { t: 0.0, y: &[0.0], y_dot: &[0.0], step: 1e-3, weights: &[1e20] };
    let square = |y: f64| (1.0 + y) * (1.0 + y) - 1.0;
    assert_eq!(check_jacobian(&mut Stated(square, 2.0), &at), Ok(()));
    assert!(check_jacobian(&mut Stated(square, -2.0), &at).is_err());
}

/// Checks that the exact slope of a kink smoothed over a hundredth of the tolerance is accepted.
#[test]
fn the_slope_of_a_rounded_kink_is_correct() {
    let at = Linearization { t: 0.0, y: &[5e-7], y_dot: &[0.0], step: 1e-3, weights: &[1e4] };
    let rounded = |y: f64| (y * y + 1e-12).sqrt();
    let slope = 5e-7 / rounded(5e-7);
    assert_eq!(check_jacobian(&mut Stated(rounded, slope), &at), Ok(()));
}

/// Checks that every nonzero slope of y² at 0 is rejected, even if it equals a one-sided difference quotient for some
/// displacement. Unlike the slopes at a kink, these quotients approach each other at 0.
#[test]
fn one_sided_slopes_of_a_smooth_function_are_wrong() {
    let at = Linearization { t: 0.0, y: &[0.0], y_dot: &[0.0], step: 1e-3, weights: &[1e4] };
    // Slopes of both signs from 1e-6 upward, in steps of 5 %. The range extends by a factor of at least 100 to both
    // sides of the tolerance, 1e-4.
    for slope in (0..200).map(|k| 1e-6 * 1.05_f64.powi(k)).flat_map(|slope| [slope, -slope]) {
        let checked = check_jacobian(&mut Stated(|y| y * y, slope), &at);
        assert!(checked.is_err(), "{slope}");
    }
}
