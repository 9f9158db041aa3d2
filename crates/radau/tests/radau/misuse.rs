//! Invalid settings and problems.

use myovib_conformance::samples::{MechanicalForm, Pendulum};
use myovib_dae::IntegratorError::{InvalidOption, WrongLength};
use myovib_dae::{Problem, StepError, Suppressed, Tolerances, VariableKind};
use myovib_radau::{
    InternalVariableGroup, InternalVariableProblem, InternalVariables, RadauError, RadauOptions,
    RadauSolver, RadauState, RelaxationTerm, SparseDirectSolver, StepSize,
};
use myovib_sparse::SparseOptions;
use nalgebra_sparse::pattern::SparsityPattern;

use serde_json::Value;

use crate::common::{radau, solver};
use crate::failures::well_behaved;

#[test]
fn wrong_input_is_named() {
    let build = |options: RadauOptions, y0: &[f64], y_dot0: &[f64]| {
        let builder = radau(well_behaved()).options(options);
        builder.build(0.0, y0, y_dot0).map(|_| ()).unwrap_err().to_string()
    };
    let default = RadauOptions::default;
    assert_eq!(
        build(default(), &[0.0, 1.0], &[0.0]),
        "initial values y0: expected length 1, got 2"
    );
    assert_eq!(build(default(), &[0.0], &[f64::NAN]), "y_dot0[0] = NaN is not finite");
    let wrong = [
        (
            RadauOptions { stages: 4, ..default() },
            "Radau IIA with 4 stages is not supported: use 1, 3, 5 or 7",
        ),
        (
            RadauOptions { tolerances: Tolerances::scalar(-1.0, 0.0), ..default() },
            "relative tolerance = -1: must be in [0, 1)",
        ),
        (
            RadauOptions { tolerances: Tolerances::scalar(0.0, 0.0), ..default() },
            "absolute tolerance = 0: must be > 0 if the relative tolerance is 0",
        ),
        (
            RadauOptions { tolerances: Tolerances::vector(1e-3, [1.0, 1.0]), ..default() },
            "absolute tolerances: expected length 1, got 2",
        ),
        (
            RadauOptions { suppressed: Suppressed::Components(vec![]), ..default() },
            "suppressed components: expected length 1, got 0",
        ),
        (
            RadauOptions { step_size: StepSize::Fixed(0.0), ..default() },
            "step_size = 0: must be finite and > 0",
        ),
        (
            RadauOptions { min_step: 1.0, max_step: Some(0.5), ..default() },
            "max_step = 0.5: must be above min_step",
        ),
        (
            RadauOptions { step_size: StepSize::Fixed(1.0), max_step: Some(0.5), ..default() },
            "step_size = 1: must be between min_step and max_step",
        ),
        (
            RadauOptions { stop_time: Some(f64::NAN), ..default() },
            "stop_time = NaN: must be finite",
        ),
        (
            RadauOptions { stop_time: Some(-1.0), ..default() },
            "time -1 is behind the current time t = 0 in the direction of integration",
        ),
        (
            RadauOptions { max_newton_iterations: Some(1 << 31), ..default() },
            "max_newton_iterations = 2147483648: must be a positive count",
        ),
        (
            RadauOptions {
                sparse: SparseOptions { pivot_tolerance: f64::NAN, ..SparseOptions::default() },
                ..default()
            },
            "sparse.pivot_tolerance = NaN: must be in [0, 1]",
        ),
        (RadauOptions { safety: 1.0, ..default() }, "safety = 1: must be in (0, 1)"),
    ];
    for (options, message) in wrong {
        assert_eq!(build(options, &[0.0], &[1.0]), message);
    }
}

/// A problem with `n` unknowns whose pattern may have another size.
#[derive(Debug)]
struct Crooked {
    n: usize,
    pattern: SparsityPattern,
}

impl Problem for Crooked {
    fn n_unknowns(&self) -> usize {
        self.n
    }

    fn residual(&mut self, _: f64, _: &[f64], _: &[f64], _: &mut [f64]) -> Result<(), StepError> {
        unreachable!("it is refused")
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        self.pattern.clone()
    }

    fn jacobian(
        &mut self,
        _: f64,
        _: &[f64],
        _: &[f64],
        _: f64,
        _: f64,
        _: &mut [f64],
    ) -> Result<(), StepError> {
        unreachable!("it is refused")
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        Some(vec![VariableKind::Differential; self.n])
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![0; self.n])
    }
}

#[test]
fn a_problem_that_contradicts_itself_or_has_no_unknowns_is_refused() {
    let builder = |n, rows, columns| {
        let pattern = SparsityPattern::zeros(columns, rows);
        radau(Crooked { n, pattern })
    };
    for (rows, columns, expected) in [
        (3, 2, "rows of the Jacobian: expected length 2, got 3"),
        (2, 3, "columns of the Jacobian: expected length 2, got 3"),
    ] {
        let built = builder(2, rows, columns).build(0.0, &[0.0; 2], &[0.0; 2]);
        assert_eq!(built.map(|_| ()).unwrap_err().to_string(), expected);
    }
    let pattern = well_behaved().jacobian_pattern();
    let of_another = SparseDirectSolver::new(&pattern, SparseOptions::default()).unwrap();
    let built = builder(0, 0, 0).build_with(of_another, 0.0, &[], &[]);
    assert!(matches!(built.map(|_| ()), Err(RadauError::Empty)));
}

/// The equation ẏ + y + x = 0 with a response x.
struct Slot {
    response: Vec<f64>,
}

impl Problem for Slot {
    fn n_unknowns(&self) -> usize {
        1
    }

    fn residual(&mut self, _: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        r[0] = v[0] + y[0] + self.response[0];
        Ok(())
    }
}

impl InternalVariableProblem for Slot {
    fn driving_quantity(&mut self, _: f64, y: &[f64], out: &mut [f64]) -> Result<(), StepError> {
        out[0] = y[0];
        Ok(())
    }

    fn driving_change(&mut self, change: &[f64], out: &mut [f64]) {
        out[0] = change[0];
    }

    fn response(&mut self) -> &mut [f64] {
        &mut self.response
    }
}

/// Regression test: inconsistent slots and invalid relaxation times caused a panic, and a negative relaxation time
/// caused a growing solution.
#[test]
fn invalid_internal_variables_are_rejected() {
    let build = |slots: &[(usize, usize)], time: f64, weight: f64, absolute: f64| {
        let part = |&(start, end): &(usize, usize)| InternalVariableGroup {
            slots: start..end,
            terms: vec![RelaxationTerm { weight, time }],
        };
        let internal = InternalVariables {
            parts: slots.iter().map(part).collect(),
            start: vec![0.0; slots.iter().map(|(start, end)| end - start).sum()],
            absolute,
        };
        RadauSolver::builder(Slot { response: vec![0.0] })
            .internal_variables(internal)
            .build(0.0, &[1.0], &[-1.0])
            .map(|_| ())
    };
    build(&[(0, 1)], 0.1, 0.5, 1e-6).unwrap();
    for time in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        let refused = build(&[(0, 1)], time, 0.5, 1e-6);
        assert!(
            matches!(refused, Err(RadauError::Common(InvalidOption { .. }))),
            "{time}: {refused:?}"
        );
    }
    for (weight, absolute) in [(f64::NAN, 1e-6), (0.5, f64::NAN), (0.5, -1.0)] {
        let refused = build(&[(0, 1)], 0.1, weight, absolute);
        assert!(matches!(refused, Err(RadauError::Common(InvalidOption { .. }))), "{refused:?}");
    }
    for slots in [&[(1, 2)][..], &[(0, 1), (2, 3)], &[(0, 1), (0, 1)]] {
        let refused = build(slots, 0.1, 0.5, 1e-6);
        assert!(matches!(refused, Err(RadauError::Common(InvalidOption { .. }))), "{refused:?}");
    }
    for slots in [&[(0, 2)][..], &[(0, 1), (1, 2)], &[]] {
        let refused = build(slots, 0.1, 0.5, 1e-6);
        assert!(matches!(refused, Err(RadauError::Common(WrongLength { .. }))), "{refused:?}");
    }
}

/// Damages each array and each number of a JSON value, one at a time, and calls `check` with the path of the damage and
/// the damaged value.
fn damaged(value: &Value, check: &mut dyn FnMut(&str, &Value)) {
    fn paths(value: &Value, at: &str, found: &mut Vec<String>) {
        match value {
            Value::Array(all) => {
                found.push(at.to_owned());
                for (i, one) in all.iter().enumerate().take(2) {
                    paths(one, &format!("{at}/{i}"), found);
                }
            }
            Value::Object(all) => {
                for (name, one) in all {
                    paths(one, &format!("{at}/{name}"), found);
                }
            }
            Value::Number(number) if number.is_f64() => found.push(at.to_owned()),
            _ => {}
        }
    }
    let mut found = Vec::new();
    paths(value, "", &mut found);
    for path in found {
        let part = value.pointer(&path).unwrap();
        let others = match part {
            Value::Array(all) => {
                let mut shorter = all.clone();
                shorter.pop();
                let mut longer = all.clone();
                longer.extend(all.last().cloned());
                vec![Value::Array(shorter), Value::Array(longer)]
            }
            _ => [0.0, -1.0, 5e-324, 1.7e308].map(Value::from).to_vec(),
        };
        for other in others {
            let mut damaged = value.clone();
            *damaged.pointer_mut(&path).unwrap() = other;
            check(&path, &damaged);
        }
    }
}

/// Regression test: a saved vector that was too short by one number caused a panic or was accepted.
#[test]
fn a_damaged_state_never_ends_in_a_panic() {
    let sample = Pendulum::new(MechanicalForm::Index2);
    let begin = || solver(sample, RadauOptions::default());
    let mut first = begin();
    for _ in 0..5 {
        first.step(1.0).unwrap();
    }
    let state = serde_json::to_value(first.save()).unwrap();
    let (mut checked, mut refused_lengths) = (0, 0);
    damaged(&state, &mut |path, damaged| {
        let Ok(state) = serde_json::from_value::<RadauState>(damaged.clone()) else {
            return;
        };
        checked += 1;
        let mut solver = begin();
        let before = solver.save();
        match solver.restore(&state) {
            Ok(()) => {
                let mut out = vec![0.0; solver.y().len()];
                let t = solver.t();
                let _ = solver.dense_output(t, 0, &mut out);
                let _ = solver.step(t + 1.0);
            }
            Err(RadauError::Fatal { .. }) => {}
            Err(error) => {
                if matches!(error, RadauError::Common(WrongLength { .. })) {
                    refused_lengths += 1;
                }
                assert_eq!(solver.save(), before, "{path}: {error}");
            }
        }
    });
    // Nine vectors are each shortened and lengthened: y, ẏ, three vectors of the last step, the multipliers, and three
    // vectors of a Jacobian.
    assert!(refused_lengths >= 2 * 9, "{refused_lengths} of {checked}");
}
