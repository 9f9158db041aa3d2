//! Initial guesses computed from several previous steps.

use std::collections::VecDeque;

use nalgebra::SVector;
use pulp::{Arch, Simd};
use pulp_macro::with_simd;

use super::block::ROWS;
use super::combination::{DIGITS, PLACES, Products, STEPS, Sums, combination};
use crate::dense::Collocation;
use crate::method::Method;

/// Last steps of several columns, from which the next step is predicted.
///
/// The current values of a column and of the state y are approximated by a linear combination of their values at the
/// starts of these steps,
///
/// ```text
/// S_n ≈ Σ_k a_k S_k,   y_n ≈ Σ_k a_k y_k,   and the same for their derivatives,
/// ```
///
/// by least squares, with separate coefficients for each column. S satisfies linear equations that depend on the state.
/// Therefore, the curve of S over the next step is nearly the same combination of the curves over the previous steps.
/// Vibrations and decaying terms are combinations of a few such curves, even over steps too long for polynomial
/// extrapolation.
#[derive(Debug)]
pub(super) struct History {
    /// Maximum number of stored steps.
    max_steps: usize,
    steps: VecDeque<Past>,
    workspace: Workspace,
}

/// A step: the polynomials of all columns, and the state at the start of the step.
#[derive(Debug)]
struct Past {
    curves: Collocation,
    state: [Vec<f64>; 2],
}

/// Workspace, stored to avoid an allocation for each guess.
#[derive(Debug, Default)]
struct Workspace {
    sums: Sums,
    of_columns: Vec<Products>,
    of_state: Vec<Products>,
    coefficients: Vec<SVector<f64, STEPS>>,
    shares: Vec<f64>,
    basis: Vec<f64>,
}

/// Values and derivatives of vectors, and the weights of their components, which are the reciprocals of the tolerances.
pub(super) struct Vectors<'a> {
    pub(super) values: [&'a [f64]; 2],
    pub(super) weights: &'a [f64],
}

/// Start of the predicted step.
pub(super) struct Beginning<'a> {
    pub(super) h: f64,
    pub(super) columns: Vectors<'a>,
    pub(super) state: Vectors<'a>,
    /// Root mean square below which values are considered noise.
    pub(super) tolerance: f64,
}

/// Minimum number of steps required for a guess.
const FEWEST: usize = 3;

/// Maximum ratio of the size of the predicted step to the size of a stored step. A larger ratio would amplify the
/// errors of the polynomial.
const LONGER: f64 = 1.25;

/// Maximum number of stored values (8 bytes each).
const MAX_VALUES: usize = 1 << 26;

impl History {
    /// Creates a history for steps of `stages` stages, with `n_columns` columns of `n` unknowns.
    pub(super) fn new(n: usize, n_columns: usize, stages: usize) -> Self {
        let numbers = n * (n_columns * (stages + 2) + 2);
        let max_steps = (MAX_VALUES / numbers.max(1)).min(STEPS);
        Self {
            max_steps: if max_steps < FEWEST { 0 } else { max_steps },
            steps: VecDeque::new(),
            workspace: Workspace::default(),
        }
    }

    /// Returns the steps whose polynomials can be evaluated over a step of size `h`.
    fn usable(&self, h: f64) -> impl Iterator<Item = &Past> {
        let steps = self.steps.iter();
        steps.filter(move |past| h <= LONGER * past.curves.h)
    }

    /// Adds a step of the columns and of the state.
    pub(super) fn push(&mut self, curves: &Collocation, state: &Collocation) {
        if self.steps.len() < self.max_steps {
            return self.steps.push_back(Past {
                curves: curves.clone(),
                state: [state.y0.clone(), state.y_dot0.clone()],
            });
        }
        if let Some(mut oldest) = self.steps.pop_front() {
            oldest.curves.copy_from(curves);
            oldest.state[0].copy_from_slice(&state.y0);
            oldest.state[1].copy_from_slice(&state.y_dot0);
            self.steps.push_back(oldest);
        }
    }

    /// Discards all steps. This is necessary if the solution does not continue smoothly.
    pub(super) fn clear(&mut self) {
        self.steps.clear();
    }

    /// Writes the predicted stage increments. Returns `false` and writes nothing if there are too few steps or if the
    /// products are not accurate enough.
    pub(super) fn guess(&mut self, method: &Method, now: &Beginning<'_>, z: &mut [f64]) -> bool {
        let count = self.usable(now.h).count();
        if count < FEWEST {
            return false;
        }
        let mut workspace = std::mem::take(&mut self.workspace);
        let is_known = self.combine(now, count, &mut workspace);
        if is_known {
            z.fill(0.0);
            for (k, past) in self.usable(now.h).enumerate() {
                workspace.shares.clear();
                for _ in 0..ROWS {
                    let of_step = workspace.coefficients.iter().map(|a| a[k]);
                    workspace.shares.extend(of_step);
                }
                // Evaluate the polynomials over a step of the current length. If the step sizes are equal, the results
                // are the stages of the polynomials.
                method.write_bases(now.h / past.curves.h, &mut workspace.basis);
                let numbers = now.columns.weights.len();
                let increments = &past.curves.increments;
                add_polynomials(z, numbers, &workspace.shares, increments, &workspace.basis);
            }
        }
        self.workspace = workspace;
        is_known
    }

    /// Computes the coefficients for each column from the `count` usable steps.
    fn combine(&self, now: &Beginning<'_>, count: usize, workspace: &mut Workspace) -> bool {
        let Beginning { h, columns, state, .. } = now;
        let mut places = [columns.values; PLACES];
        for (place, past) in places.iter_mut().zip(self.usable(*h)) {
            *place = [&past.curves.y0, &past.curves.y_dot0];
        }
        let n_columns = columns.weights.len() / state.weights.len();
        let mut of_columns = std::mem::take(&mut workspace.of_columns);
        workspace.sums.of(&places[..=count], *h, (columns.weights, n_columns), &mut of_columns);
        let mut places = [state.values; PLACES];
        for (place, past) in places.iter_mut().zip(self.usable(*h)) {
            *place = past.state.each_ref().map(|values| &values[..]);
        }
        let mut of_state = std::mem::take(&mut workspace.of_state);
        workspace.sums.of(&places[..=count], *h, (state.weights, 1), &mut of_state);
        let largest = of_columns.iter().map(|products| products[(count, count)]);
        let is_known = DIGITS * largest.fold(0.0, f64::max) < now.tolerance.powi(2);
        workspace.coefficients.clear();
        workspace.coefficients.extend(
            of_columns.iter().map(|column| combination(column, &of_state[0], count, now.tolerance)),
        );
        (workspace.of_columns, workspace.of_state) = (of_columns, of_state);
        is_known
    }
}

/// Adds Σ_j b_ij z_j of a stored step, with each column multiplied by its share, to stage i of the initial guess. A
/// stage has `numbers` values, the `shares` are repeated periodically, and `basis` contains b_ij stage by stage.
#[with_simd(add_polynomials = Arch::new())]
#[inline(always)]
fn add_polynomials_with<S: Simd>(
    _: S,
    z: &mut [f64],
    numbers: usize,
    shares: &[f64],
    increments: &[f64],
    basis: &[f64],
) {
    let width = shares.len();
    let stages = z.len() / numbers;
    let mut start = 0;
    while start < numbers {
        let n = width.min(numbers - start);
        for i in 0..stages {
            let z = &mut z[i * numbers + start..][..n];
            for j in 0..stages {
                let b = basis[i * stages + j];
                if b == 0.0 {
                    continue;
                }
                let (x, shares) = (&increments[j * numbers + start..][..n], &shares[..n]);
                for k in 0..n {
                    z[k] += b * shares[k] * x[k];
                }
            }
        }
        start += n;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FREQUENCIES: [f64; 2] = [1.0, 2.7];

    /// Returns component i of column j, a vibration with two frequencies, or its derivative.
    fn curve(i: usize, j: usize, t: f64, derivative: bool) -> f64 {
        let of = |(k, omega): (usize, &f64)| {
            let size = ((1 + i + 3 * j + 5 * k) as f64).sin();
            let phase = (i * (j + 2) * (k + 1)) as f64;
            match derivative {
                false => size * (omega * t + phase).cos(),
                true => -size * omega * (omega * t + phase).sin(),
            }
        };
        FREQUENCIES.iter().enumerate().map(of).sum()
    }

    /// Returns all components of the given columns, stored row by row.
    fn block(n_columns: std::ops::Range<usize>, t: f64, derivative: bool) -> Vec<f64> {
        let columns = |i: usize| n_columns.clone().map(move |j| curve(i, j, t, derivative));
        (0..6).flat_map(columns).collect()
    }

    fn step(method: &Method, columns: std::ops::Range<usize>, t0: f64, h: f64) -> Collocation {
        let y0 = block(columns.clone(), t0, false);
        let stage = |c: &f64| {
            let y = block(columns.clone(), t0 + c * h, false);
            let increments = y.iter().zip(&y0).map(|(y, y0)| y - y0);
            increments.collect::<Vec<_>>()
        };
        Collocation {
            t0,
            h,
            increments: method.nodes().iter().flat_map(stage).collect(),
            y_dot0: block(columns.clone(), t0, true),
            y0,
        }
    }

    /// Returns the start of a step. The state has unit weights.
    fn beginning<'a>(
        columns: &'a Collocation,
        state: &'a Collocation,
        weights: &'a [f64],
        tolerance: f64,
    ) -> Beginning<'a> {
        Beginning {
            h: columns.h,
            columns: Vectors { values: [&columns.y0, &columns.y_dot0], weights },
            state: Vectors { values: [&state.y0, &state.y_dot0], weights: &[1.0; 6] },
            tolerance,
        }
    }

    /// Returns the largest error of the guess after steps of size 1 and a last step of size `last`.
    fn error(last: f64) -> f64 {
        let method = Method::radau_iia(7).expect("there is one");
        let (columns, state) = (0..2, 2..3);
        let mut history = History::new(6, 2, 7);
        let mut t = 0.0;
        // Take more steps than can be stored.
        for h in [1.0; 10] {
            let [of_columns, of_state] =
                [&columns, &state].map(|of| step(&method, of.clone(), t, h));
            history.push(&of_columns, &of_state);
            t += h;
        }
        assert_eq!(history.steps.len(), STEPS);
        let [expected, of_state] = [columns, state].map(|of| step(&method, of, t, last));
        let mut z = vec![0.0; 7 * 12];
        assert!(history.guess(&method, &beginning(&expected, &of_state, &[1.0; 12], 1e-6), &mut z));
        let errors = z.iter().zip(&expected.increments);
        errors.map(|(z, e)| (z - e).abs()).fold(0.0, f64::max)
    }

    /// Four curves in total are approximated by combinations of eight steps, with an error of a few times the tolerance
    /// of 1e-6. For the shorter last step, the polynomial of degree 7 adds a few times 2.7⁸/8! × 2 × 4⁻⁸ = 2e-6.
    #[test]
    fn vibrations_of_two_frequencies_are_guessed_over_long_steps() {
        for last in [1.0, 0.6] {
            let error = error(last);
            assert!(error < 1e-5, "{last}: {error:e}");
        }
    }

    /// Returns a history after steps of the given sizes, in which the only column equals the state.
    fn after(steps: &[f64]) -> (Method, History, f64) {
        let method = Method::radau_iia(3).expect("there is one");
        let (mut history, mut t) = (History::new(6, 1, 3), 0.0);
        for &h in steps {
            let own = step(&method, 0..1, t, h);
            history.push(&own, &own);
            t += h;
        }
        (method, history, t)
    }

    #[test]
    fn initial_guesses_of_steps_are_limited() {
        let (method, mut history, t) = after(&[0.1, 0.1, 0.2]);
        let mut guesses = |h: f64, tolerance: f64, is_known: bool| {
            if !is_known {
                history.clear();
            }
            let own = step(&method, 0..1, t, h);
            let now = beginning(&own, &own, &[1.0; 6], tolerance);
            history.guess(&method, &now, &mut [0.0; 18])
        };
        assert!(guesses(0.1, 1e-3, true));
        assert!(!guesses(0.2, 1e-3, true));
        assert!(!guesses(0.1, 1e-8, true));
        assert!(!guesses(0.1, 1e-3, false));
    }

    #[test]
    fn stored_history_is_limited() {
        // Each unknown has 7 values of a column and 2 values of the state.
        for (steps, max_steps) in [(2, 0), (4, 4), (100, STEPS)] {
            let n = MAX_VALUES / 9 / steps;
            assert_eq!(History::new(n, 1, 5).max_steps, max_steps);
        }
        let mut history = History::new(MAX_VALUES, 1, 3);
        let own = step(&Method::radau_iia(3).expect("there is one"), 0..1, 0.0, 1.0);
        (0..5).for_each(|_| history.push(&own, &own));
        assert!(history.steps.is_empty());
    }
}
