//! Detection of wrong entries in Jacobians.

use myovib_conformance::samples::{Akzo, Robertson, Sample, VanDerPol};
use myovib_dae::{Linearization, Problem, SparsityPattern, StepError, check_jacobian};

/// A sample with one entry of its Jacobian changed.
struct Changed<S> {
    sample: S,
    place: usize,
    factor: f64,
}

impl<S: Problem> Problem for Changed<S> {
    fn n_unknowns(&self) -> usize {
        self.sample.n_unknowns()
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        self.sample.residual(t, y, v, r)
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        self.sample.jacobian_pattern()
    }

    fn jacobian(
        &mut self,
        t: f64,
        y: &[f64],
        v: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        self.sample.jacobian(t, y, v, a, b, values)?;
        values[self.place] *= self.factor;
        Ok(())
    }
}

/// Checks a sample near its start (y moved by 10 %): first unchanged, then with each entry doubled or negated. Returns
/// the number of changes that were found, and the number of changes.
fn found<S: Sample + Clone>(sample: &S) -> (usize, usize) {
    let start = sample.start();
    let y: Vec<f64> = start.y.iter().map(|y| 1.1 * y + 0.1).collect();
    let weights = vec![1e4; y.len()];
    let at =
        Linearization { t: start.t, y: &y, y_dot: &start.y_dot, step: 1e-3, weights: &weights };
    let checked = |place, factor| {
        let sample = sample.clone();
        check_jacobian(&mut Changed { sample, place, factor }, &at)
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

/// Entries with an error of at least 2 % are reported, as the documentation states. Half of this error is accepted.
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

/// Checks that the slopes on both sides of a kink are accepted, and that other values are rejected.
#[test]
fn one_sided_derivatives_at_a_kink_are_correct() {
    let at = Linearization { t: 0.0, y: &[0.0], y_dot: &[0.0], step: 1e-3, weights: &[1e4] };
    for (derivative, is_correct) in [(0.0, true), (1.0, true), (2.0, false), (-1.0, false)] {
        let checked = check_jacobian(&mut Stated(|y| y.max(0.0), derivative), &at);
        assert_eq!(checked.is_ok(), is_correct, "{derivative}");
    }
}

/// Checks that every nonzero slope of y² at 0 is rejected, even if it equals a one-sided difference quotient for some
/// displacement. Unlike the slopes at a kink, these quotients approach each other at 0.
#[test]
fn one_sided_slopes_of_a_smooth_function_are_wrong() {
    let at = Linearization { t: 0.0, y: &[0.0], y_dot: &[0.0], step: 1e-3, weights: &[1e4] };
    // Slopes from 1e-6 upward in steps of 5 %, with either sign. The range extends beyond the displacements on both
    // sides by a factor of up to 100.
    for slope in (0..200).map(|k| 1e-6 * 1.05_f64.powi(k)).flat_map(|slope| [slope, -slope]) {
        let checked = check_jacobian(&mut Stated(|y| y * y, slope), &at);
        assert!(checked.is_err(), "{slope}");
    }
}
