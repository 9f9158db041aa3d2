//! Periodic states of forced oscillators. The references, from Fourier collocation, have 10 correct digits for orbits
//! and folds, and 9 for multipliers.

use std::f64::consts::TAU;
use std::sync::atomic::AtomicBool;

use myovib_dae::{Problem, StepError, Tolerances, VariableKind};
use myovib_model::periodic::{
    Continuation, Interval, Multipliers, PeriodMap, PeriodicState, Point, Shooting, balance,
    follow, multipliers, shoot,
};
use myovib_model::start::Consistent;
use myovib_model::{Integrator, ModelError, RadauIntegrator, run};
use myovib_radau::{RadauOptions, SparseDirectSolver, StepSize};
use myovib_sparse::SparseOptions;
use num_complex::Complex64;
use serde_json::Value;

/// Relative tolerance of the integrator. The errors of the map are then about 1e-11, and the errors of differences 1e-7.
const RTOL: f64 = 1e-13;
/// Six digits of values of order 1.
const SIX_DIGITS: f64 = 1e-6;

/// The oscillator ẍ + (δ − μ (1 − x²)) ẋ + x + b x³ = F cos Ωt.
#[derive(Clone, Copy)]
struct Oscillator {
    damping: f64,
    van_der_pol: f64,
    cubic: f64,
    force: f64,
    omega: f64,
    form: Form,
}

#[derive(Clone, Copy)]
enum Form {
    /// Unknowns (x, v).
    Explicit,
    /// Unknowns (x, s, v, w, λ) of index 3: 0.5 v̇ + λ = F cos Ωt, 0.5 ẇ + d(s) w + s + b s³ − λ = 0, x − s = 0.
    Constrained,
}

fn duffing(form: Form) -> Oscillator {
    Oscillator { damping: 0.1, van_der_pol: 0.0, cubic: 1.0, force: 0.2, omega: 0.0, form }
}

fn van_der_pol(force: f64) -> Oscillator {
    Oscillator {
        damping: 0.0,
        van_der_pol: 0.2,
        cubic: 0.0,
        force,
        omega: 0.0,
        form: Form::Explicit,
    }
}

impl Oscillator {
    fn drive(&self, t: f64) -> f64 {
        self.force * (self.omega * t).cos()
    }

    fn resistance(&self, x: f64, v: f64) -> f64 {
        (self.damping - self.van_der_pol * (1.0 - x * x)) * v + x + self.cubic * x.powi(3)
    }
}

impl Problem for Oscillator {
    fn n_unknowns(&self) -> usize {
        match self.form {
            Form::Explicit => 2,
            Form::Constrained => 5,
        }
    }

    fn residual(&mut self, t: f64, y: &[f64], yp: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        match self.form {
            Form::Explicit => {
                r[0] = yp[0] - y[1];
                r[1] = yp[1] + self.resistance(y[0], y[1]) - self.drive(t);
            }
            Form::Constrained => {
                r[0] = yp[0] - y[2];
                r[1] = yp[1] - y[3];
                r[2] = 0.5 * yp[2] + y[4] - self.drive(t);
                r[3] = 0.5 * yp[3] + self.resistance(y[1], y[3]) - y[4];
                r[4] = y[0] - y[1];
            }
        }
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        let mut kinds = vec![VariableKind::Differential; self.n_unknowns()];
        if let Form::Constrained = self.form {
            kinds[4] = VariableKind::Algebraic;
        }
        Some(kinds)
    }

    fn indices(&self) -> Option<Vec<u8>> {
        match self.form {
            Form::Explicit => None,
            Form::Constrained => Some(vec![1, 1, 2, 2, 3]),
        }
    }
}

impl Consistent for Oscillator {
    fn consistent(&mut self, t: f64, y: &[f64]) -> Result<[Vec<f64>; 2], ModelError> {
        let acceleration = |x: f64, v: f64| self.drive(t) - self.resistance(x, v);
        Ok(match self.form {
            Form::Explicit => [y.to_vec(), vec![y[1], acceleration(y[0], y[1])]],
            Form::Constrained => {
                let (x, v) = (0.5 * (y[0] + y[1]), 0.5 * (y[2] + y[3]));
                let a = acceleration(x, v);
                let lambda = self.drive(t) - 0.5 * a;
                [vec![x, x, v, v, lambda], vec![v, v, a, a, 0.0]]
            }
        })
    }
}

fn start(
    dae: Oscillator,
    interval: Interval,
    y: &[f64],
    y_dot: &[f64],
) -> Result<Box<dyn Integrator<Oscillator>>, ModelError> {
    let options = RadauOptions {
        stages: 7,
        tolerances: Tolerances::scalar(RTOL, RTOL),
        step_size: interval.fixed_step.map_or(StepSize::Adaptive, StepSize::Fixed),
        ..RadauOptions::default()
    };
    let matrices = SparseDirectSolver::new(&dae.jacobian_pattern(), options.sparse)?;
    let times = interval.times.into();
    let integrator = RadauIntegrator::new(dae, matrices, options, times, y, y_dot)?;
    Ok(Box::new(integrator))
}

/// Returns the state after one period.
fn map(mut dae: Oscillator, state: &[f64], omega: f64) -> Result<Vec<f64>, ModelError> {
    dae.omega = omega;
    let rest = vec![0.0; dae.n_unknowns()];
    PeriodMap::new(dae, start, [0.0, TAU / omega], &rest)?.map(state)
}

fn shooting(dae: Oscillator) -> Shooting {
    let n = match dae.form {
        Form::Explicit => 2,
        Form::Constrained => 4,
    };
    Shooting { tolerance: 1e-9, map_error: 1e-11, ..Shooting::new(vec![1.0; n]) }
}

/// Returns the state (x, v) of the differential variables.
fn xv(dae: Oscillator, state: &[f64]) -> [f64; 2] {
    match dae.form {
        Form::Explicit => [state[0], state[1]],
        Form::Constrained => [state[0], state[2]],
    }
}

fn guess(dae: Oscillator, [x, v]: [f64; 2]) -> Vec<f64> {
    match dae.form {
        Form::Explicit => vec![x, v],
        Form::Constrained => vec![x, x, v, v],
    }
}

fn found(dae: Oscillator, omega: f64, near: [f64; 2]) -> (PeriodicState, Multipliers) {
    let shooting = shooting(dae);
    let mut map = |state: &[f64]| map(dae, state, omega);
    let found = shoot(&mut map, &guess(dae, near), &shooting).unwrap();
    let leading = multipliers(&mut map, &found.state, &shooting, 2).unwrap();
    (found, leading)
}

/// Returns the points of a curve and the reason why it ends inside the range.
fn curve(
    dae: Oscillator,
    from: (f64, [f64; 2]),
    is_descending: bool,
    range: [f64; 2],
) -> (Vec<Point>, Option<ModelError>) {
    let (state, _) = found(dae, from.0, from.1);
    let continuation = Continuation {
        shooting: shooting(dae),
        parameter_scale: 1.0,
        range,
        is_descending,
        max_step: 0.5,
        max_points: 100,
    };
    let mut family = |state: &[f64], omega: f64| map(dae, state, omega);
    let mut points = Vec::new();
    let mut visit = |point| {
        points.push(point);
        Ok(())
    };
    let start = (&state.state[..], from.0);
    let end = follow(&mut family, start, &continuation, &mut visit);
    (points, end.err())
}

fn assert_close(found: f64, expected: f64) {
    assert!((found - expected).abs() < SIX_DIGITS, "{found} {expected}");
}

/// Returns the rows of a table of the references.
fn rows(table: &str) -> Vec<Value> {
    let text = include_str!("../../../../data/references/s13_10_periodic_orbits.json");
    let case: Value = serde_json::from_str(text).unwrap();
    case.pointer(table).unwrap().as_array().unwrap().clone()
}

fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap()
}

/// Finds a state near the first two digits of a row, and checks it with its multipliers and stability. Returns Ω and the state.
fn expect_row(dae: Oscillator, row: &Value) -> (f64, Vec<f64>) {
    let omega = number(row, "Omega");
    let expected = ["x0", "v0"].map(|key| number(row, key));
    let (state, leading) = found(dae, omega, expected.map(|value| (100.0 * value).round() / 100.0));
    let own = xv(dae, &state.state);
    (0..2).for_each(|i| assert_close(own[i], expected[i]));
    for value in row["multipliers"].as_array().unwrap() {
        let expected = Complex64::new(value[0].as_f64().unwrap(), value[1].as_f64().unwrap());
        let is_found = leading.values.iter().any(|own| (own - expected).norm() < SIX_DIGITS);
        assert!(is_found, "{omega}: {expected} {leading:?}");
    }
    // Limits of stability are neither stable nor unstable.
    assert_eq!(leading.is_stable(), row["stable"].as_bool(), "{omega}: {leading:?}");
    (omega, state.state)
}

/// Returns λ at the end of a period of the oscillator of index 3.
fn multiplier_at_end(mut dae: Oscillator, omega: f64, state: &[f64]) -> f64 {
    dae.omega = omega;
    let end = TAU / omega;
    let [mut y, y_dot] = dae.consistent(0.0, state).unwrap();
    let interval = Interval { times: [0.0, end], fixed_step: None, tolerance_factor: 1.0 };
    let mut integrator = start(dae, interval, &y, &y_dot).unwrap();
    run(&mut *integrator, &mut []).unwrap();
    integrator.dense_output(end, 0, &mut y).unwrap();
    y[4]
}

/// Between the folds, three states exist.
#[test]
fn states_of_a_duffing_oscillator_of_index_0_and_3_have_their_multipliers() {
    for form in [Form::Explicit, Form::Constrained] {
        let dae = duffing(form);
        for row in rows("/A_duffing/rows") {
            let (omega, state) = expect_row(dae, &row);
            if let Form::Constrained = form {
                assert_close(multiplier_at_end(dae, omega, &state), number(&row, "dae_lambda_0"));
            }
        }
    }
}

/// Checks the locked states of weak forcing, the small unstable states that no continuation of locked states meets, and the states
/// of strong forcing, with the two where a pair of multipliers is on the unit circle: beyond them, motions are quasi-periodic.
#[test]
fn states_of_a_forced_van_der_pol_oscillator_have_their_multipliers() {
    for (force, table) in [
        (0.15, "/C_van_der_pol_forced_weak/rows"),
        (0.15, "/C_van_der_pol_forced_weak/rows_of_the_other_branch"),
        (0.8, "/D_van_der_pol_forced_strong/rows"),
        (0.8, "/D_van_der_pol_forced_strong/torus_points"),
    ] {
        for row in rows(table) {
            expect_row(van_der_pol(force), &row);
        }
    }
}

/// Checks limit cycles without a load. Their period T is an unknown: the state (x, v, T) repeats if x and v do, and v = 0, at
/// the maximum of x. One multiplier is 1.
#[test]
fn free_van_der_pol_oscillators_have_their_periods() {
    for row in rows("/B_van_der_pol_free") {
        let [mu, cubic, period, largest] =
            ["mu", "a", "period", "max_abs_x"].map(|key| number(&row, key));
        let dae = Oscillator { van_der_pol: mu, cubic, ..van_der_pol(0.0) };
        let mut repeated = |y: &[f64]| {
            let end = map(dae, &y[..2], TAU / y[2])?;
            Ok(vec![end[0], end[1], y[2] + y[1]])
        };
        let shooting = Shooting { scales: vec![1.0; 3], ..shooting(dae) };
        let near = [2.0, 0.0, (10.0 * period).round() / 10.0];
        let found = shoot(&mut repeated, &near, &shooting).unwrap().state;
        assert_close(found[0], largest);
        assert_close(found[2], period);
        let shooting = Shooting { scales: vec![1.0; 2], ..shooting };
        let mut map = |state: &[f64]| map(dae, state, TAU / found[2]);
        let leading = multipliers(&mut map, &found[..2], &shooting, 2).unwrap();
        for (own, expected) in leading.values.iter().zip(row["multipliers"].as_array().unwrap()) {
            assert_close(own.re, expected.as_f64().unwrap());
            assert_eq!(own.im, 0.0);
        }
        assert_eq!(leading.is_stable(), None);
    }
}

/// Ω and (x(0), x'(0)) of a state of small amplitude, a row of the references.
const SMALL: (f64, [f64; 2]) = (1.4, [-0.21134045523, 0.04500057368]);

/// Checks the state of small amplitude at Ω = 1.4, where the linear oscillator is a good approximation, and the resonance at
/// Ω = 0.9, where the balance fails.
#[test]
fn harmonic_balance_finds_motions_that_are_nearly_linear() {
    let balanced = |mut dae: Oscillator, is_interrupted: bool| {
        let pattern = dae.jacobian_pattern();
        let mut matrices = SparseDirectSolver::new(&pattern, SparseOptions::default()).unwrap();
        let times = [0.0, TAU / dae.omega];
        let flag = AtomicBool::new(is_interrupted);
        balance(&mut dae, &mut matrices, times, &[0.0; 2], &[0..1, 1..2], 1e-9, Some(&flag))
    };
    let at = |omega: f64| balanced(Oscillator { omega, ..duffing(Form::Explicit) }, false).unwrap();
    let (omega, expected) = SMALL;
    let found = at(omega).unwrap();
    (0..2).for_each(|i| assert_close(found[i], expected[i]));
    assert_eq!(at(0.9), None);
    // Regression: NaN counted as converged.
    let undefined = Oscillator { omega, cubic: f64::NAN, ..duffing(Form::Explicit) };
    assert!(!matches!(balanced(undefined, false), Ok(Some(_))));
    let interrupted = Oscillator { omega, ..duffing(Form::Explicit) };
    assert_eq!(balanced(interrupted, true).unwrap(), None);
}

/// Regression: the largest difference of states with NaN was the largest of the other differences.
#[test]
fn a_state_that_becomes_nan_is_not_periodic() {
    let shooting = Shooting::new(vec![1.0; 2]);
    assert!(shooting.residual(&[0.0; 2], &[f64::NAN, 0.0]).is_nan());
    let mut map = |y: &[f64]| Ok(vec![f64::NAN, y[1]]);
    let found = shoot(&mut map, &[0.0; 2], &shooting);
    assert!(matches!(found, Err(ModelError::NoPeriodicState { .. })), "{found:?}");
}

/// Adaptive steps resolve a deviation, fixed steps do not.
#[test]
fn a_deviation_costs_no_more_fixed_steps() {
    let dae = Oscillator { omega: 1.4, ..duffing(Form::Constrained) };
    let mut map = PeriodMap::new(dae, start, [0.0, TAU / 1.4], &[0.0; 5]).unwrap();
    let small = guess(dae, SMALL.1);
    let expected = map.map(&small).unwrap();
    let adaptive = map.counts().steps;
    map.set_steps(Some(2 * adaptive));
    let found = map.map(&small).unwrap();
    // Twice as many steps are at least as accurate: errors of RTOL, with room for their growth over a period.
    (0..4).for_each(|i| assert!((found[i] - expected[i]).abs() < 100.0 * RTOL));
    map.map(&guess(dae, [1.5, 0.0])).unwrap();
    assert_eq!(map.counts().steps, 5 * adaptive);
}

/// Ω, x(0), x'(0), and the second multiplier at a fold.
type Fold = (f64, [f64; 2], f64);

fn expect_folds(dae: Oscillator, folds: &[&Point], expected: &[Fold]) {
    assert_eq!(folds.len(), expected.len());
    for (fold, (omega, state, other)) in folds.iter().zip(expected) {
        assert_close(fold.parameter, *omega);
        let own = xv(dae, &fold.state);
        (0..2).for_each(|i| assert_close(own[i], state[i]));
        let mut map = |state: &[f64]| map(dae, state, fold.parameter);
        let found = multipliers(&mut map, &fold.state, &shooting(dae), 2).unwrap();
        assert_close(found.values[0].re, 1.0);
        assert_close(found.values[1].re, *other);
    }
}

#[test]
fn the_resonance_curve_of_a_duffing_oscillator_turns_at_its_folds() {
    let folds = [
        (1.52244802905, [-0.0714315460, 1.8429002596], 0.6618589727),
        (1.25201495911, [-0.4919152667, 0.2197168734], 0.6054121184),
    ];
    let near = (1.3, [0.75, 0.99]);
    for form in [Form::Explicit, Form::Constrained] {
        let dae = duffing(form);
        let (curve, failure) = curve(dae, near, false, [1.2, 1.6]);
        assert!(failure.is_none(), "{failure:?}");
        let own: Vec<&Point> = curve.iter().filter(|point| point.is_fold).collect();
        expect_folds(dae, &own, &folds);
        assert_eq!(curve.last().unwrap().parameter, 1.6);
    }
}

/// The locked states form a closed curve, separate from the states that continue from low frequencies.
#[test]
fn locking_of_a_van_der_pol_oscillator_ends_at_its_folds() {
    let dae = van_der_pol(0.15);
    let upper = (1.03551168973, [-1.8659824710, -0.3937224032], 0.3746665642);
    let lower = (0.95867687219, [1.8748825708, -0.4211918823], 0.3223478714);
    let near = (1.0, [-0.38, 2.2]);
    for (is_descending, fold) in [(false, upper), (true, lower)] {
        let (curve, failure) = curve(dae, near, is_descending, [0.9, 1.1]);
        assert!(matches!(failure, Some(ModelError::CurveTooLong { .. })));
        let own = curve.iter().find(|point| point.is_fold).unwrap();
        expect_folds(dae, &[own], &[fold]);
    }
}

/// Regression: the errors of multipliers that Arnoldi's method had not resolved were ignored.
#[test]
fn stability_is_unknown_within_the_error_of_the_multiplier() {
    let of = |radius: f64, left: f64| {
        let values = vec![Complex64::new(radius, 0.0)];
        Multipliers { values, residuals: vec![left], resolution: 1e-6 }.is_stable()
    };
    let found = [of(0.9, 0.01), of(1.1, 0.01), of(0.999, 0.01), of(1.001, 0.01), of(1.001, 0.0)];
    assert_eq!(found, [Some(true), Some(false), None, None, Some(false)]);
}
