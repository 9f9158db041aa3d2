//! Settings and problems that make no sense.

use myovib_dae::{Problem, StepError, Suppressed, Tolerances, VariableKind};
use myovib_radau::{RadauError, RadauOptions, RadauSolver, SparseDirectSolver, StepSize};
use myovib_sparse::SparseOptions;
use nalgebra_sparse::pattern::SparsityPattern;

use crate::failures::well_behaved;

#[test]
fn wrong_input_is_named() {
    let build = |options: RadauOptions, y0: &[f64], y_dot0: &[f64]| {
        let builder = RadauSolver::builder(well_behaved()).options(options);
        builder
            .build(0.0, y0, y_dot0)
            .map(|_| ())
            .unwrap_err()
            .to_string()
    };
    let default = RadauOptions::default;
    assert_eq!(
        build(default(), &[0.0, 1.0], &[0.0]),
        "initial values y0: expected length 1, got 2"
    );
    assert_eq!(
        build(default(), &[0.0], &[f64::NAN]),
        "y_dot0[0] = NaN is not finite"
    );
    let wrong = [
        (
            RadauOptions {
                stages: 4,
                ..default()
            },
            "Radau IIA with 4 stages is not offered: use 1, 3, 5 or 7",
        ),
        (
            RadauOptions {
                tolerances: Tolerances::scalar(-1.0, 0.0),
                ..default()
            },
            "relative tolerance = -1: must be in [0, 1)",
        ),
        (
            RadauOptions {
                tolerances: Tolerances::scalar(0.0, 0.0),
                ..default()
            },
            "absolute tolerance = 0: must be > 0 where the relative one is 0",
        ),
        (
            RadauOptions {
                tolerances: Tolerances::vector(1e-3, [1.0, 1.0]),
                ..default()
            },
            "absolute tolerances: expected length 1, got 2",
        ),
        (
            RadauOptions {
                suppressed: Suppressed::Components(vec![]),
                ..default()
            },
            "suppressed components: expected length 1, got 0",
        ),
        (
            RadauOptions {
                step_size: StepSize::Fixed(0.0),
                ..default()
            },
            "step_size = 0: must be finite and > 0",
        ),
        (
            RadauOptions {
                min_step: 1.0,
                max_step: Some(0.5),
                ..default()
            },
            "max_step = 0.5: must be above min_step",
        ),
        (
            RadauOptions {
                step_size: StepSize::Fixed(1.0),
                max_step: Some(0.5),
                ..default()
            },
            "step_size = 1: must be between min_step and max_step",
        ),
        (
            RadauOptions {
                stop_time: Some(f64::NAN),
                ..default()
            },
            "stop_time = NaN: must be finite",
        ),
        (
            RadauOptions {
                stop_time: Some(-1.0),
                ..default()
            },
            "the time -1 lies behind t = 0, the time reached",
        ),
        (
            RadauOptions {
                max_newton_iterations: Some(1 << 31),
                ..default()
            },
            "max_newton_iterations = 2147483648: must be a positive count",
        ),
        (
            RadauOptions {
                sparse: SparseOptions {
                    pivot_tolerance: f64::NAN,
                    ..SparseOptions::default()
                },
                ..default()
            },
            "sparse.pivot_tolerance = NaN: must be in [0, 1]",
        ),
        (
            RadauOptions {
                safety: 1.0,
                ..default()
            },
            "safety = 1: must be in (0, 1)",
        ),
    ];
    for (options, message) in wrong {
        assert_eq!(build(options, &[0.0], &[1.0]), message);
    }
}

/// A problem of `n` unknowns with a pattern that may be another one's.
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
        RadauSolver::builder(Crooked { n, pattern })
    };
    for (rows, columns, expected) in [
        (3, 2, "rows of the Jacobian: expected length 2, got 3"),
        (2, 3, "columns of the Jacobian: expected length 2, got 3"),
    ] {
        let built = builder(2, rows, columns).build(0.0, &[0.0; 2], &[0.0; 2]);
        assert_eq!(built.unwrap_err().to_string(), expected);
    }
    let pattern = well_behaved().jacobian_pattern();
    let of_another = SparseDirectSolver::new(&pattern, SparseOptions::default()).unwrap();
    let built = builder(0, 0, 0).build_with(of_another, 0.0, &[], &[]);
    assert!(matches!(built.map(|_| ()), Err(RadauError::Empty)));
}
