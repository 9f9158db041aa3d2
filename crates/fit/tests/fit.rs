//! Tests of bounds, profiles, losses, starts and identifiability, with problems that were solved by hand.
#![allow(clippy::unwrap_used)] // a test may panic

use std::ops::ControlFlow;

use myovib_fit::{
    Ended, Failed, FitError, Loss, Model, Options, Parameter, best_fit, fit, fit_observed, profile,
    refine,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Model whose residuals are computed by a function.
struct Of<F>(usize, F);

impl<F: FnMut(&[f64], &mut [f64]) -> Result<(), Failed>> Model for Of<F> {
    fn n_residuals(&self) -> usize {
        self.0
    }

    fn residuals(&mut self, p: &[f64], out: &mut [f64]) -> Result<(), Failed> {
        (self.1)(p, out)
    }
}

/// Returns the model of a curve y = f(p, x) through the given points.
fn curve(points: &[(f64, f64)], f: impl Fn(&[f64], f64) -> f64) -> impl Model {
    Of(points.len(), move |p: &[f64], out: &mut [f64]| {
        for (out, (x, y)) in out.iter_mut().zip(points) {
            *out = f(p, *x) - y;
        }
        Ok(())
    })
}

/// Returns the model of the straight line a + b x through the given points.
fn line(points: &[(f64, f64)]) -> impl Model {
    curve(points, |p, x| p[0] + p[1] * x)
}

fn parameters<const N: usize>(starts: [f64; N]) -> [Parameter; N] {
    let mut k = 0;
    starts.map(|start| {
        k += 1;
        Parameter::new(format!("p{k}"), start)
    })
}

/// Points near a straight line. The expected results are computed by hand with the formulas of Draper and Smith, where
/// the mean of x is 1.5 and Sxx = 5.
const POINTS: [(f64, f64); 4] = [(0.0, 1.1), (1.0, 2.9), (2.0, 5.2), (3.0, 6.8)];

#[test]
fn a_straight_line_has_the_textbook_values_errors_and_correlation() {
    let fitted = fit(&mut line(&POINTS), &parameters([0.0, 0.0]), &Options::default()).unwrap();
    let mean_y = 4.0;
    let sxy: f64 = POINTS.iter().map(|(x, y)| (x - 1.5) * (y - mean_y)).sum();
    let b = sxy / 5.0;
    let a = mean_y - 1.5 * b;
    let square: f64 = POINTS.iter().map(|(x, y)| (a + b * x - y).powi(2)).sum();
    let s2 = square / 2.0;
    // For a linear model, difference quotients have only rounding errors, about 1e-11.
    for (found, exact) in fitted.values.iter().zip([a, b]) {
        assert!((found - exact).abs() < 1e-9, "{found} {exact}");
    }
    let u = fitted.uncertainty().unwrap();
    let exact = [(s2 * (0.25 + 2.25 / 5.0)).sqrt(), (s2 / 5.0).sqrt()];
    for (found, exact) in u.standard_errors.iter().zip(exact) {
        assert!((found / exact - 1.0).abs() < 1e-8, "{found} {exact}");
    }
    // −x̄/√(Σx²/n)
    assert!((u.correlation[(0, 1)] + 1.5 / 3.5_f64.sqrt()).abs() < 1e-8);
    // t(0.975, 2) = 4.30265273 (tables).
    let [low, high] = u.intervals(0.95)[1];
    assert!((high - low - 2.0 * 4.302_652_73 * exact[1]).abs() < 1e-7);
}

#[test]
fn the_profile_of_a_linear_model_is_its_linear_interval() {
    let start = parameters([0.0, 0.0]);
    let fitted = fit(&mut line(&POINTS), &start, &Options::default()).unwrap();
    let linear = fitted.uncertainty().unwrap().intervals(0.95);
    for (which, linear) in linear.iter().enumerate() {
        let options = Options::default();
        let profile = profile(&mut line(&POINTS), &start, &fitted, which, 0.95, &options).unwrap();
        for (found, exact) in profile.interval.iter().zip(linear) {
            // The crossing is interpolated linearly in a bracket whose width is a thousandth of the interval.
            let width = linear[1] - linear[0];
            assert!((found.unwrap() - exact).abs() < 1e-3 * width, "{found:?} {exact}");
        }
    }
}

#[test]
fn a_bound_holds_a_parameter_and_the_others_adapt() {
    let [a, b] = parameters([0.0, 0.0]);
    let fitted = fit(&mut line(&POINTS), &[a, b.within(0.0, 1.0)], &Options::default()).unwrap();
    assert_eq!(fitted.values[1], 1.0);
    assert_eq!(fitted.at_bound, [false, true]);
    // For b = 1, the best a is the mean of y − x.
    assert!((fitted.values[0] - 2.5).abs() < 1e-9);
    assert!(fitted.is_converged());
}

#[test]
fn outliers_move_a_robust_fit_less() {
    let mut points: Vec<_> = (0..20).map(|k| (f64::from(k), 1.0 + 2.0 * f64::from(k))).collect();
    points[7].1 += 100.0;
    let slope = |loss| {
        let options = Options { loss, ..Options::default() };
        fit(&mut line(&points), &parameters([0.0, 0.0]), &options).unwrap().values[1]
    };
    let off = |loss| (slope(loss) - 2.0).abs();
    assert!(off(Loss::Huber(0.1)) < 0.05 * off(Loss::Squares));
    assert!(off(Loss::Cauchy(0.1)) < 1e-4 * off(Loss::Squares));
}

/// Checks a model in which only the sum of the parameters has an effect.
#[test]
fn undetermined_directions_are_returned() {
    let points = [0.0, 1.0, 2.0, 3.0, 4.0].map(|x| (x, 3.0 * x));
    let mut model = curve(&points, |p, x| (p[0] + p[1]) * x);
    let fitted = fit(&mut model, &parameters([1.0, 1.0]), &Options::default()).unwrap();
    assert!((fitted.values[0] + fitted.values[1] - 3.0).abs() < 1e-7);
    let identifiability = fitted.identifiability();
    let unknown: Vec<_> = identifiability.unknown(1e-3).collect();
    assert_eq!(unknown.len(), 1);
    let [a, b] = unknown[0].shares[..] else { panic!("two parameters") };
    // The sum of the parameters is constant along the direction, whose components are relative changes.
    assert!((a * fitted.values[0] + b * fitted.values[1]).abs() < 1e-6);
}

/// Checks that the second of three parameters, which has no effect, does not change the results of the others.
#[test]
fn a_parameter_without_effect_does_not_change_the_others() {
    let mut model = curve(&POINTS, |p, x| p[0] + p[2] * x);
    let options = Options::default();
    let fitted = fit(&mut model, &parameters([0.0, 5.0, 0.0]), &options).unwrap();
    let without = fit(&mut line(&POINTS), &parameters([0.0, 0.0]), &options).unwrap();
    assert_eq!([0, 1, 2].map(|j| fitted.acts(j)), [true, false, true]);
    assert_eq!(fitted.values[1], 5.0);
    assert_eq!(fitted.degrees_of_freedom(), 2);
    let [found, exact] = [&fitted, &without].map(|fit| fit.uncertainty().unwrap());
    assert_eq!(found.standard_errors[1], f64::INFINITY);
    assert_eq!(found.intervals(0.95)[1], [f64::NEG_INFINITY, f64::INFINITY]);
    let row = [0, 1, 2].map(|j| found.correlation[(1, j)]);
    assert!(row[0].is_nan() && row[1] == 1.0 && row[2].is_nan(), "{row:?}");
    // The results are equal up to the rounding errors of difference quotients, 1e-11 for derivatives of size one.
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-8 * b.abs(), "{a} {b}");
    for (j, k) in [(0, 0), (2, 1)] {
        near(found.standard_errors[j], exact.standard_errors[k]);
    }
    near(found.correlation[(0, 2)], exact.correlation[(0, 1)]);
    let directions = fitted.identifiability().directions;
    assert_eq!(directions.len(), 2);
    assert!(directions.iter().all(|direction| direction.shares[1] == 0.0));
    for (found, exact) in directions.iter().zip(without.identifiability().directions) {
        near(found.sensitivity, exact.sensitivity);
    }
}

#[test]
fn a_fit_without_any_dependence_fails() {
    let mut nothing = Of(3, |_: &[f64], out: &mut [f64]| {
        out.copy_from_slice(&[1.0, -1.0, 2.0]);
        Ok(())
    });
    let fitted = fit(&mut nothing, &parameters([1.0]), &Options::default()).unwrap();
    assert!(matches!(fitted.ended, Ended::Failed(_)), "{:?}", fitted.ended);
    let uncertainty = fitted.uncertainty().unwrap();
    // The expected value is the mean square of 1, −1 and 2, which is computed without rounding error.
    assert_eq!((fitted.values[0], uncertainty.variance), (1.0, 2.0));
    assert_eq!(uncertainty.standard_errors, [f64::INFINITY]);
    assert!(fitted.identifiability().directions.is_empty());
}

#[test]
fn several_starts_find_the_deeper_valley() {
    // The function p⁴/4 − p²/2 + 0.1 p has a shallow minimum near 0.95 and a deeper one near −1.05.
    let mut model = Of(1, |p: &[f64], out: &mut [f64]| {
        out[0] = (p[0].powi(4) / 4.0 - p[0] * p[0] / 2.0 + 0.1 * p[0] + 1.0).sqrt();
        Ok(())
    });
    let start = [Parameter::new("p", 1.5)];
    let options = Options::default();
    let one = fit(&mut model, &start, &options).unwrap();
    let starts = [start.to_vec(), vec![Parameter::new("p", -1.5)]];
    let best = best_fit(&starts, &mut |start| fit(&mut model, start, &options)).unwrap();
    assert!(one.values[0] > 0.0 && best.values[0] < 0.0);
    assert!(best.cost < one.cost);
}

#[test]
fn a_failed_trial_is_a_step_back() {
    // The model is undefined beyond p = 1, and the Gauss–Newton step from 0.01 exceeds this value.
    let mut model = Of(1, |p: &[f64], out: &mut [f64]| {
        if p[0] > 1.0 {
            return Err(Failed("p > 1".into()));
        }
        out[0] = p[0].sqrt() - 0.9;
        Ok(())
    });
    let start = [Parameter { scale: 0.01, ..Parameter::new("p", 0.01) }];
    let fitted = fit(&mut model, &start, &Options::default()).unwrap();
    assert!((fitted.values[0] - 0.81).abs() < 1e-6, "{:?}", fitted.values);
}

/// Returns the model of the decay a exp(−k t) through noisy points. Its relative error is `off`.
fn noisy_decay(off: f64) -> impl Model {
    const POINTS: [(f64, f64); 5] =
        [(0.0, 1.0), (1.0, 0.63), (2.0, 0.35), (3.0, 0.24), (4.0, 0.11)];
    curve(&POINTS, move |p, t| (1.0 + off) * p[0] * (-p[1] * t).exp())
}

/// Checks that a fit of exp(−k t) to noisy points stops earlier if the offset is larger, and that the offset bounds the
/// distance from the minimum. If the linearized residuals change by √n s times the offset, no parameter changes by more
/// than √n times the offset in units of its standard error.
#[test]
fn a_fit_stops_when_further_steps_are_within_the_noise() {
    let mut decay = noisy_decay(0.0);
    let start = parameters([3.0, 2.0]);
    let least = fit(&mut decay, &start, &Options::default()).unwrap();
    let errors = least.uncertainty().unwrap().standard_errors;
    let mut evaluations = vec![least.evaluations];
    for offset in [1e-3, 1e-1] {
        let options = Options { offset, ..Options::default() };
        let near = fit(&mut decay, &start, &options).unwrap();
        assert!(near.is_converged());
        evaluations.push(near.evaluations);
        for ((near, least), error) in near.values.iter().zip(&least.values).zip(&errors) {
            // A margin of 10 % is added because the linearization is approximate.
            assert!((near - least).abs() < 1.1 * 2_f64.sqrt() * offset * error);
        }
    }
    assert!(evaluations.is_sorted_by(|a, b| a > b), "{evaluations:?}");
}

/// Checks that the fit of a model with an error of a thousandth can be refined with the exact model. The refined values
/// agree with a direct fit. One evaluation of the derivatives is sufficient, because the first step already converges.
#[test]
fn a_rough_fit_is_refined() {
    let start = parameters([3.0, 2.0]);
    let options = Options { offset: 1e-2, ..Options::default() };
    let rough = fit(&mut noisy_decay(1e-3), &start, &options).unwrap();
    let mut go_on = |_: &_| ControlFlow::Continue(());
    let refined = refine(&mut noisy_decay(0.0), &start, &rough, &options, &mut go_on).unwrap();
    let direct = fit(&mut noisy_decay(0.0), &start, &Options::default()).unwrap();
    assert!(refined.is_converged());
    assert_eq!((refined.evaluations, refined.history.len()), (2, 1));
    let errors = direct.uncertainty().unwrap().standard_errors;
    for ((refined, direct), error) in refined.values.iter().zip(&direct.values).zip(&errors) {
        assert!((refined - direct).abs() < 1.1 * 2_f64.sqrt() * options.offset * error);
    }
}

#[test]
fn an_observer_may_end_the_fit_and_the_history_is_kept() {
    let mut seen = 0;
    let fitted = fit_observed(
        &mut Of(1, |p: &[f64], out: &mut [f64]| {
            out[0] = p[0].exp() - 1e-3;
            Ok(())
        }),
        &[Parameter::new("p", 2.0)],
        &Options::default(),
        &mut |_| {
            seen += 1;
            if seen == 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        },
    )
    .unwrap();
    assert_eq!((fitted.ended, fitted.history.len()), (Ended::Interrupted, 3));
}

/// Checks that 95 % intervals contain the true values in about 95 % of the experiments with random noise. The standard
/// deviation of this share for 1000 draws is 0.7 %; a deviation of three times this value is allowed.
#[test]
fn intervals_cover_the_truth_as_often_as_they_say() {
    let mut random = ChaCha8Rng::seed_from_u64(20_261_122);
    let mut covered = 0;
    for _ in 0..1000 {
        let points: Vec<_> = (0..8)
            .map(|k| {
                // The sum of twelve uniform random numbers has variance one and is nearly normally distributed.
                let noise: f64 = (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
                (f64::from(k), 1.0 + 0.5 * f64::from(k) + 0.3 * noise)
            })
            .collect();
        let fitted = fit(&mut line(&points), &parameters([0.0, 0.0]), &Options::default()).unwrap();
        let [low, high] = fitted.uncertainty().unwrap().intervals(0.95)[1];
        covered += usize::from(low < 0.5 && 0.5 < high);
    }
    assert!((929..=971).contains(&covered), "{covered} of 1000");
}

#[test]
fn invalid_input_is_rejected() {
    let start = parameters([0.0, 0.0]);
    let few = fit(&mut line(&POINTS[..1]), &start, &Options::default()).unwrap_err();
    let expected = FitError::TooFewMeasurements { n_residuals: 1, n_parameters: 2 };
    assert_eq!(few, expected);
    let [a, b] = start;
    let outside = [a, b.within(1.0, 2.0)];
    let error = fit(&mut line(&POINTS), &outside, &Options::default()).unwrap_err();
    assert!(
        matches!(&error, FitError::Parameter { name, value: 0.0, .. } if name == "p2"),
        "{error:?}"
    );
    let exact = fit(&mut line(&POINTS[..2]), &parameters([0.0, 0.0]), &Options::default()).unwrap();
    assert_eq!(exact.uncertainty().unwrap_err(), FitError::NoFreedom(2));
}

/// Returns the model y = exp(-k t) with k = 2 at eight times. The model is defined only for k > 0.
fn decay() -> impl Model {
    Of(8, |p: &[f64], out: &mut [f64]| {
        if p[0] <= 0.0 {
            return Err(Failed(format!("k = {} is not positive", p[0])));
        }
        for (k, out) in (0_u8..).zip(out) {
            let t = 0.2 * f64::from(k);
            *out = ((-p[0] * t).exp() - (-2.0 * t).exp()) / 1e-3;
        }
        Ok(())
    })
}

/// Checks that positive parameters are found even if the start has the wrong order of magnitude.
#[test]
fn positive_parameters_are_found_from_starts_of_another_scale() {
    for start in [1e-9, 1e-4, 1.0, 30.0] {
        let start = [Parameter::new("k", start).positive()];
        let fitted = fit(&mut decay(), &start, &Options::default()).unwrap();
        assert!(fitted.is_converged(), "{start:?}: {:?}", fitted.ended);
        // The residuals vanish at the true values.
        assert!((fitted.values[0] - 2.0).abs() < 1e-8, "{start:?}: {fitted:?}");
    }
}

/// Regression: a search was reported as converged although it had ended because each longer step failed.
#[test]
fn the_edge_of_the_domain_is_not_a_minimum() {
    // The minimum of the cost is at -1, but the model is undefined below 0.5.
    let mut half = Of(2, |p: &[f64], out: &mut [f64]| {
        if p[0] < 0.5 {
            return Err(Failed("below 0.5".into()));
        }
        out[0] = p[0] + 1.0;
        out[1] = 0.1;
        Ok(())
    });
    let fitted = fit(&mut half, &parameters([3.0]), &Options::default()).unwrap();
    assert!(matches!(fitted.ended, Ended::Failed(_)), "{:?}", fitted.ended);
    assert!((fitted.values[0] - 0.5).abs() < 1e-3, "{:?}", fitted.values);
}
