//! Starting values from several steps before.

use std::collections::VecDeque;

use nalgebra::{DMatrix, DVector};
use pulp::{Arch, Simd, WithSimd};

use super::block::{ROWS, mean_of_column};
use crate::dense::Collocation;
use crate::method::Method;

/// The last steps of several columns side by side, to guess the next step from.
///
/// What the columns and the state y were at the beginning of these steps is combined to what they are now,
///
/// ```text
/// S_n ≈ Σ_k a_k S_k,   y_n ≈ Σ_k a_k y_k,   and their derivatives likewise,
/// ```
///
/// by least squares, with coefficients of each column's own. As S obeys linear equations that depend on the
/// state, it goes on as nearly the same combination of what followed then. Vibrations and what fades
/// are combinations of a few such curves, over steps too long for a polynomial to be continued.
#[derive(Debug)]
pub(super) struct History {
    /// Most steps that are kept.
    most: usize,
    steps: VecDeque<Past>,
}

/// A step: the polynomials of all columns, and the state it began with.
#[derive(Debug)]
struct Past {
    curves: Collocation,
    state: [Vec<f64>; 2],
}

/// The beginning of the step that is guessed: for the columns and the state their values and derivatives.
pub(super) struct Beginning<'a> {
    pub(super) h: f64,
    pub(super) columns: [&'a [f64]; 2],
    pub(super) state: [&'a [f64]; 2],
}

/// Weights of components in tolerances, of the columns and of the state.
pub(super) struct Weights<'a> {
    pub(super) columns: &'a [f64],
    pub(super) state: &'a [f64],
}

/// Steps that are kept: three or four frequencies with what they grow by.
const STEPS: usize = 8;

/// With fewer there is no guess.
const FEWEST: usize = 3;

/// A step may be longer by this than one it is guessed from: over more a polynomial magnifies its errors.
const LONGER: f64 = 1.25;

/// Most numbers that are kept, of 8 bytes.
const ROOM: usize = 1 << 26;

/// How much the state counts beside a column, both measured by their sizes. It says how the loads of a column
/// go on; its own beginning says more.
const SHARE_OF_STATE: f64 = 0.1;

/// Of vectors with more rows than this only a part is compared, some rows here and there: eight coefficients
/// need no more.
const ENOUGH_ROWS: usize = 512;

/// Sums of products are not known better.
const DIGITS: f64 = 100.0 * f64::EPSILON;

impl History {
    /// Of steps whose columns have `numbers` at each of so many `stages`.
    pub(super) fn new(numbers: usize, stages: usize) -> Self {
        let most = (ROOM / (numbers * (stages + 2)).max(1)).min(STEPS);
        Self {
            most: if most < FEWEST { 0 } else { most },
            steps: VecDeque::new(),
        }
    }

    /// Steps whose polynomials can be continued to one of size `h`.
    fn usable(&self, h: f64) -> impl Iterator<Item = &Past> {
        let steps = self.steps.iter();
        steps.filter(move |past| h <= LONGER * past.curves.h)
    }

    /// Whether there are enough steps to guess one of size `h`.
    pub(super) fn is_enough(&self, h: f64) -> bool {
        self.usable(h).count() >= FEWEST
    }

    /// Takes in a step of the columns and of the state.
    pub(super) fn push(&mut self, curves: &Collocation, state: &Collocation) {
        if self.most == 0 {
            return;
        }
        let oldest = match self.steps.len() == self.most {
            true => self.steps.pop_front(),
            false => None,
        };
        let mut past = oldest.unwrap_or_else(|| Past {
            curves: curves.clone(),
            state: [state.y0.clone(), state.y_dot0.clone()],
        });
        past.curves.copy_from(curves);
        past.state[0].copy_from_slice(&state.y0);
        past.state[1].copy_from_slice(&state.y_dot0);
        self.steps.push_back(past);
    }

    /// Writes the stage increments that the steps before let expect. What is smaller than `tolerance`, in the
    /// mean, is no part of the columns.
    pub(super) fn guess(
        &self,
        method: &Method,
        now: &Beginning<'_>,
        weights: &Weights<'_>,
        tolerance: f64,
        z: &mut [f64],
    ) {
        let n_columns = weights.columns.len() / weights.state.len();
        let steps: Vec<&Past> = self.usable(now.h).collect();
        let count = steps.len();
        let columns = |k: usize| match steps.get(k) {
            Some(past) => [&past.curves.y0[..], &past.curves.y_dot0],
            None => now.columns,
        };
        let state = |k: usize| match steps.get(k) {
            Some(past) => [&past.state[0][..], &past.state[1]],
            None => now.state,
        };
        let of_columns = products(count, now.h, columns, weights.columns, n_columns);
        let of_state = products(count, now.h, state, weights.state, 1);
        let shares: Vec<DVector<f64>> = (0..n_columns)
            .map(|j| combination(&of_columns[j], &of_state[0], tolerance))
            .collect();
        z.fill(0.0);
        let numbers = weights.columns.len();
        for (k, Past { curves, .. }) in steps.into_iter().enumerate() {
            let of_column: Vec<f64> = shares.iter().map(|a| a[k]).collect();
            Arch::new().dispatch(AddPolynomials {
                z,
                numbers,
                shares: &of_column.repeat(ROWS),
                increments: &curves.increments,
                // The polynomials over a step of now's length; with equal steps, their own stages.
                basis: &method.bases(now.h / curves.h),
            });
        }
    }
}

/// The coefficients that combine the first vectors to the last, from the mean products of a column's and of the
/// state's; larger ones than the tolerance warrants are avoided.
fn combination(column: &DMatrix<f64>, state: &DMatrix<f64>, tolerance: f64) -> DVector<f64> {
    let count = column.nrows() - 1;
    let sizes = [column, state].map(|of| of[(count, count)]);
    let share = match sizes[1] > 0.0 {
        true => SHARE_OF_STATE.powi(2) * sizes[0] / sizes[1],
        false => 0.0,
    };
    let both = column + state * share;
    let mut matrix = both.view((0, 0), (count, count)).into_owned();
    // Each vector is known to the tolerance, and to what products leave of its digits.
    for k in 0..count {
        let square = matrix[(k, k)];
        matrix[(k, k)] = square + tolerance.powi(2) + DIGITS * square;
    }
    let rhs = both.view((0, count), (count, 1)).column(0).into_owned();
    let none = DVector::zeros(count);
    matrix
        .cholesky()
        .map_or(none, |factors| factors.solve(&rhs))
}

/// For each column the mean weighed products of some vectors and one more: of their values, and of
/// their derivatives times h.
fn products<'a>(
    count: usize,
    h: f64,
    vectors: impl Fn(usize) -> [&'a [f64]; 2],
    weights: &[f64],
    n_columns: usize,
) -> Vec<DMatrix<f64>> {
    let width = ROWS * n_columns;
    let pairs = (count + 1) * (count + 2) / 2;
    let rows = weights.len() / n_columns;
    let every = (rows / ENOUGH_ROWS).max(1);
    let taken = weights.len().div_ceil(width).div_ceil(every) * width;
    let mut sums = vec![DMatrix::zeros(count + 1, count + 1); n_columns];
    for (part, factor) in [1.0, h * h].into_iter().enumerate() {
        let vectors: Vec<&[f64]> = (0..=count).map(|k| vectors(k)[part]).collect();
        let mut lanes = vec![0.0; pairs * width];
        Arch::new().dispatch(Products {
            lanes: &mut lanes,
            scaled: &mut vec![0.0; (count + 1) * width],
            width,
            every,
            vectors: &vectors,
            weights,
        });
        let mut lanes = lanes.chunks_exact(width);
        for k in 0..=count {
            for l in 0..=k {
                let lanes = lanes.next().unwrap_or_default();
                for (j, sum) in sums.iter_mut().enumerate() {
                    let product = factor * mean_of_column(lanes, (j, n_columns), taken);
                    sum[(k, l)] += product;
                    if l < k {
                        sum[(l, k)] += product;
                    }
                }
            }
        }
    }
    sums
}

/// Sums of w² a b in lanes, for all pairs of vectors.
struct Products<'a> {
    lanes: &'a mut [f64],
    /// Room for `width` numbers of each vector.
    scaled: &'a mut [f64],
    width: usize,
    /// Of so many parts of this width one is taken.
    every: usize,
    vectors: &'a [&'a [f64]],
    weights: &'a [f64],
}

impl WithSimd for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let width = self.width;
        let parts = self.weights.chunks(width).enumerate();
        for (part, weights) in parts.step_by(self.every) {
            let (start, n) = (part * width, weights.len());
            for (k, vector) in self.vectors.iter().enumerate() {
                let (vector, scaled) = (&vector[start..][..n], &mut self.scaled[k * width..][..n]);
                for i in 0..n {
                    scaled[i] = weights[i] * vector[i];
                }
            }
            let mut lanes = self.lanes.chunks_exact_mut(width);
            for k in 0..self.vectors.len() {
                let a = &self.scaled[k * width..][..n];
                for l in 0..=k {
                    let b = &self.scaled[l * width..][..n];
                    if let Some(lanes) = lanes.next() {
                        let lanes = &mut lanes[..n];
                        for i in 0..n {
                            lanes[i] += a[i] * b[i];
                        }
                    }
                }
            }
        }
    }
}

/// z_i ← z_i + Σ_j b_ij z_j of a step, times the share of each column.
struct AddPolynomials<'a> {
    z: &'a mut [f64],
    /// Of a stage.
    numbers: usize,
    /// They repeat.
    shares: &'a [f64],
    increments: &'a [f64],
    /// b_ij, stage by stage.
    basis: &'a [f64],
}

impl WithSimd for AddPolynomials<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (numbers, width) = (self.numbers, self.shares.len());
        let stages = self.z.len() / numbers;
        let mut start = 0;
        while start < numbers {
            let n = width.min(numbers - start);
            for i in 0..stages {
                let z = &mut self.z[i * numbers + start..][..n];
                for j in 0..stages {
                    let b = self.basis[i * stages + j];
                    if b == 0.0 {
                        continue;
                    }
                    let (x, shares) = (
                        &self.increments[j * numbers + start..][..n],
                        &self.shares[..n],
                    );
                    for k in 0..n {
                        z[k] += b * shares[k] * x[k];
                    }
                }
            }
            start += n;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FREQUENCIES: [f64; 2] = [1.0, 2.7];

    /// Of component i of column j a vibration with two frequencies, or its derivative.
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

    /// All components of some columns side by side.
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

    /// The largest error of what is guessed after steps of size 1 and one of `last`.
    fn error(last: f64) -> f64 {
        let method = Method::radau_iia(7).expect("there is one");
        let (columns, state) = (0..2, 2..3);
        let mut history = History::new(12, 7);
        let mut t = 0.0;
        // More than are kept.
        for h in [1.0; 10] {
            let [of_columns, of_state] =
                [&columns, &state].map(|of| step(&method, of.clone(), t, h));
            history.push(&of_columns, &of_state);
            t += h;
        }
        assert!(history.is_enough(1.0) && history.steps.len() == STEPS);
        let [expected, of_state] = [columns, state].map(|of| step(&method, of, t, last));
        let now = Beginning {
            h: last,
            columns: [&expected.y0, &expected.y_dot0],
            state: [&of_state.y0, &of_state.y_dot0],
        };
        let weights = Weights {
            columns: &[1.0; 12],
            state: &[1.0; 6],
        };
        let mut z = vec![0.0; 7 * 12];
        history.guess(&method, &now, &weights, 1e-10, &mut z);
        let errors = z.iter().zip(&expected.increments);
        errors.map(|(z, e)| (z - e).abs()).fold(0.0, f64::max)
    }

    /// Four curves in all are combinations of eight steps, as far as products of them have digits: to
    /// √DIGITS of their size, 1.5e-7, times a few. Over shorter steps a polynomial of degree 7 errs besides
    /// by 2.7⁸/8! × 2 × 4⁻⁸, 2e-6, times a few.
    #[test]
    fn vibrations_of_two_frequencies_are_guessed_over_long_steps() {
        for (last, bound) in [(1.0, 1e-6), (0.6, 1e-5)] {
            let error = error(last);
            assert!(error < bound, "{last}: {error:e}");
        }
    }

    #[test]
    fn no_step_is_guessed_from_much_shorter_ones() {
        let method = Method::radau_iia(3).expect("there is one");
        let mut history = History::new(6, 3);
        for (t, h) in [(0.0, 0.1), (0.1, 0.1), (0.2, 0.2)] {
            let short = step(&method, 0..1, t, h);
            history.push(&short, &short);
        }
        assert!(history.is_enough(0.1) && !history.is_enough(0.2));
    }

    #[test]
    fn no_more_is_kept_than_there_is_room_for() {
        let mut history = History::new(ROOM / 7 / 2, 5);
        assert_eq!(history.most, 0);
        let method = Method::radau_iia(5).expect("there is one");
        let small = step(&method, 0..1, 0.0, 1.0);
        for _ in 0..5 {
            history.push(&small, &small);
        }
        assert!(!history.is_enough(1.0));
    }
}
