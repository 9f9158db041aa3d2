//! Starting values from several steps before.

use std::collections::VecDeque;

use nalgebra::{SMatrix, SVector};
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
    room: Room,
}

/// A step: the polynomials of all columns, and the state it began with.
#[derive(Debug)]
struct Past {
    curves: Collocation,
    state: [Vec<f64>; 2],
}

/// Workspace, so that a guess allocates nothing.
#[derive(Debug, Default)]
struct Room {
    lanes: Vec<f64>,
    scaled: Vec<f64>,
    of_columns: Vec<Products>,
    of_state: Vec<Products>,
    coefficients: Vec<SVector<f64, STEPS>>,
    shares: Vec<f64>,
    basis: Vec<f64>,
}

/// The mean weighed products of vectors at the beginnings of the steps before and of the next.
type Products = SMatrix<f64, PLACES, PLACES>;

/// Values and derivatives of vectors, and the weights of their components: the inverses of tolerances.
pub(super) struct Vectors<'a> {
    pub(super) values: [&'a [f64]; 2],
    pub(super) weights: &'a [f64],
}

/// Where the step begins that is guessed.
pub(super) struct Beginning<'a> {
    pub(super) h: f64,
    pub(super) columns: Vectors<'a>,
    pub(super) state: Vectors<'a>,
    /// What is smaller than this, in the mean, is noise.
    pub(super) tolerance: f64,
}

/// Steps that are kept: three or four frequencies with what they grow by.
const STEPS: usize = 8;

/// Beginnings of those steps, and of the next.
const PLACES: usize = STEPS + 1;

/// With fewer there is no guess.
const FEWEST: usize = 3;

/// A step may be longer by this than one it is guessed from: over more a polynomial magnifies its errors.
const LONGER: f64 = 1.25;

/// Most numbers that are kept, of 8 bytes.
const MOST_NUMBERS: usize = 1 << 26;

/// How much the state counts beside a column, both measured by their sizes. It says how the loads of a column
/// go on; its own beginning says more.
const SHARE_OF_STATE: f64 = 0.1;

/// Of vectors with more rows than this only a part is compared, some rows here and there: eight coefficients
/// need no more.
const ENOUGH_ROWS: usize = 512;

/// Sums of products are not known better.
const DIGITS: f64 = 100.0 * f64::EPSILON;

impl History {
    /// Of steps with so many `stages`, of `n_columns` of `n` unknowns.
    pub(super) fn new(n: usize, n_columns: usize, stages: usize) -> Self {
        let numbers = n * (n_columns * (stages + 2) + 2);
        let most = (MOST_NUMBERS / numbers.max(1)).min(STEPS);
        Self {
            most: if most < FEWEST { 0 } else { most },
            steps: VecDeque::new(),
            room: Room::default(),
        }
    }

    /// Steps whose polynomials can be continued to one of size `h`.
    fn usable(&self, h: f64) -> impl Iterator<Item = &Past> {
        let steps = self.steps.iter();
        steps.filter(move |past| h <= LONGER * past.curves.h)
    }

    /// Takes in a step of the columns and of the state.
    pub(super) fn push(&mut self, curves: &Collocation, state: &Collocation) {
        if self.steps.len() < self.most {
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

    /// Forgets all steps: what comes does not go on as they did.
    pub(super) fn clear(&mut self) {
        self.steps.clear();
    }

    /// Writes the stage increments that the steps before let expect. `false`, and nothing is written, where there are
    /// too few of them, or where products cannot tell as many digits as are wanted.
    pub(super) fn guess(&mut self, method: &Method, now: &Beginning<'_>, z: &mut [f64]) -> bool {
        let count = self.usable(now.h).count();
        if count < FEWEST {
            return false;
        }
        let mut room = std::mem::take(&mut self.room);
        let is_known = self.combine(now, count, &mut room);
        if is_known {
            z.fill(0.0);
            for (k, past) in self.usable(now.h).enumerate() {
                room.shares.clear();
                for _ in 0..ROWS {
                    let of_step = room.coefficients.iter().map(|a| a[k]);
                    room.shares.extend(of_step);
                }
                // The polynomials over a step of now's length; with equal steps, their own stages.
                method.write_bases(now.h / past.curves.h, &mut room.basis);
                Arch::new().dispatch(AddPolynomials {
                    z,
                    numbers: now.columns.weights.len(),
                    shares: &room.shares,
                    increments: &past.curves.increments,
                    basis: &room.basis,
                });
            }
        }
        self.room = room;
        is_known
    }

    /// Finds the coefficients of each column, of the `count` usable steps.
    fn combine(&self, now: &Beginning<'_>, count: usize, room: &mut Room) -> bool {
        let Beginning {
            h, columns, state, ..
        } = now;
        let mut places = [columns.values; PLACES];
        for (place, past) in places.iter_mut().zip(self.usable(*h)) {
            *place = [&past.curves.y0, &past.curves.y_dot0];
        }
        let n_columns = columns.weights.len() / state.weights.len();
        let mut of_columns = std::mem::take(&mut room.of_columns);
        room.sum(
            &places[..=count],
            *h,
            (columns.weights, n_columns),
            &mut of_columns,
        );
        let mut places = [state.values; PLACES];
        for (place, past) in places.iter_mut().zip(self.usable(*h)) {
            *place = past.state.each_ref().map(|values| &values[..]);
        }
        let mut of_state = std::mem::take(&mut room.of_state);
        room.sum(&places[..=count], *h, (state.weights, 1), &mut of_state);
        let largest = of_columns.iter().map(|products| products[(count, count)]);
        let is_known = DIGITS * largest.fold(0.0, f64::max) < now.tolerance.powi(2);
        room.coefficients.clear();
        room.coefficients.extend(
            of_columns
                .iter()
                .map(|column| combination(column, &of_state[0], count, now.tolerance)),
        );
        (room.of_columns, room.of_state) = (of_columns, of_state);
        is_known
    }
}

impl Room {
    /// For each column the mean weighed products of all pairs of vectors: of their values, and of their
    /// derivatives times h.
    fn sum(
        &mut self,
        vectors: &[[&[f64]; 2]],
        h: f64,
        (weights, n_columns): (&[f64], usize),
        sums: &mut Vec<Products>,
    ) {
        let (count, width) = (vectors.len(), ROWS * n_columns);
        let every = (weights.len() / n_columns / ENOUGH_ROWS).max(1);
        let taken: usize = weights.chunks(width).step_by(every).map(<[f64]>::len).sum();
        sums.clear();
        sums.resize(n_columns, Products::zeros());
        self.scaled.resize(PLACES * width, 0.0);
        for (part, factor) in [1.0, h * h].into_iter().enumerate() {
            self.lanes.clear();
            self.lanes.resize(count * (count + 1) / 2 * width, 0.0);
            Arch::new().dispatch(AddProducts {
                lanes: &mut self.lanes,
                scaled: &mut self.scaled,
                width,
                every,
                vectors,
                part,
                weights,
            });
            let pairs = (0..count).flat_map(|k| (0..=k).map(move |l| (k, l)));
            for (pair, lanes) in pairs.zip(self.lanes.chunks_exact(width)) {
                for (j, sum) in sums.iter_mut().enumerate() {
                    sum[pair] += factor * mean_of_column(lanes, (j, n_columns), taken);
                    sum[(pair.1, pair.0)] = sum[pair];
                }
            }
        }
    }
}

/// The coefficients that combine the first `count` vectors to the one after them, from the products of a column's and
/// of the state's; larger ones than the tolerance warrants are avoided.
fn combination(
    column: &Products,
    state: &Products,
    count: usize,
    tolerance: f64,
) -> SVector<f64, STEPS> {
    let mut both = *column;
    let sizes = [column, state].map(|of| of.trace());
    if sizes[1] > 0.0 {
        both += state * (SHARE_OF_STATE.powi(2) * sizes[0] / sizes[1]);
    }
    // Of steps that are not there the coefficients are 0.
    let mut matrix = SMatrix::<f64, STEPS, STEPS>::identity();
    let mut rhs = SVector::zeros();
    for k in 0..count {
        for l in 0..count {
            matrix[(k, l)] = both[(k, l)];
        }
        // Each vector is known to the tolerance, and to what products leave of its digits.
        matrix[(k, k)] += tolerance.powi(2) + DIGITS * both[(k, k)];
        rhs[k] = both[(k, count)];
    }
    let factors = matrix.cholesky();
    factors.map_or(SVector::zeros(), |factors| factors.solve(&rhs))
}

/// Sums of w² a b in lanes, for all pairs of vectors.
struct AddProducts<'a> {
    lanes: &'a mut [f64],
    /// Room for `width` numbers of each vector.
    scaled: &'a mut [f64],
    width: usize,
    /// Of so many parts of this width one is taken.
    every: usize,
    vectors: &'a [[&'a [f64]; 2]],
    /// Of each vector the values (0) or the derivatives.
    part: usize,
    weights: &'a [f64],
}

impl WithSimd for AddProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let width = self.width;
        let parts = self.weights.chunks(width).enumerate();
        for (number, weights) in parts.step_by(self.every) {
            let (start, n) = (number * width, weights.len());
            for (k, vector) in self.vectors.iter().enumerate() {
                let vector = &vector[self.part][start..][..n];
                let scaled = &mut self.scaled[k * width..][..n];
                for i in 0..n {
                    scaled[i] = weights[i] * vector[i];
                }
            }
            let mut pair = 0;
            for k in 0..self.vectors.len() {
                let a = &self.scaled[k * width..][..n];
                for l in 0..=k {
                    let b = &self.scaled[l * width..][..n];
                    let lanes = &mut self.lanes[pair * width..][..n];
                    for i in 0..n {
                        lanes[i] += a[i] * b[i];
                    }
                    pair += 1;
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

    /// Where a step begins, weights of the state being 1.
    fn beginning<'a>(
        columns: &'a Collocation,
        state: &'a Collocation,
        weights: &'a [f64],
        tolerance: f64,
    ) -> Beginning<'a> {
        Beginning {
            h: columns.h,
            columns: Vectors {
                values: [&columns.y0, &columns.y_dot0],
                weights,
            },
            state: Vectors {
                values: [&state.y0, &state.y_dot0],
                weights: &[1.0; 6],
            },
            tolerance,
        }
    }

    /// The largest error of what is guessed after steps of size 1 and one of `last`.
    fn error(last: f64) -> f64 {
        let method = Method::radau_iia(7).expect("there is one");
        let (columns, state) = (0..2, 2..3);
        let mut history = History::new(6, 2, 7);
        let mut t = 0.0;
        // More than are kept.
        for h in [1.0; 10] {
            let [of_columns, of_state] =
                [&columns, &state].map(|of| step(&method, of.clone(), t, h));
            history.push(&of_columns, &of_state);
            t += h;
        }
        assert_eq!(history.steps.len(), STEPS);
        let [expected, of_state] = [columns, state].map(|of| step(&method, of, t, last));
        let mut z = vec![0.0; 7 * 12];
        assert!(history.guess(
            &method,
            &beginning(&expected, &of_state, &[1.0; 12], 1e-6),
            &mut z
        ));
        let errors = z.iter().zip(&expected.increments);
        errors.map(|(z, e)| (z - e).abs()).fold(0.0, f64::max)
    }

    /// Four curves in all are combinations of eight steps, to the tolerance of 1e-6 times a few. Over shorter
    /// steps a polynomial of degree 7 errs besides by 2.7⁸/8! × 2 × 4⁻⁸, 2e-6, times a few.
    #[test]
    fn vibrations_of_two_frequencies_are_guessed_over_long_steps() {
        for last in [1.0, 0.6] {
            let error = error(last);
            assert!(error < 1e-5, "{last}: {error:e}");
        }
    }

    /// One column that is its own state, after steps of these sizes.
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
    fn no_step_is_guessed_from_much_shorter_ones_nor_from_forgotten_ones_nor_to_more_digits_than_products_have()
     {
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
    fn no_more_is_kept_than_there_is_room_for() {
        // Of each unknown 7 numbers of a column and 2 of the state.
        for (steps, most) in [(2, 0), (4, 4), (100, STEPS)] {
            let n = MOST_NUMBERS / 9 / steps;
            assert_eq!(History::new(n, 1, 5).most, most);
        }
        let mut history = History::new(MOST_NUMBERS, 1, 3);
        let own = step(&Method::radau_iia(3).expect("there is one"), 0..1, 0.0, 1.0);
        (0..5).for_each(|_| history.push(&own, &own));
        assert!(history.steps.is_empty());
    }

    /// Of 1100 rows every second eight are taken: in rows that are not there may be what will. The mean is that of
    /// the others, weighed.
    #[test]
    fn long_vectors_are_compared_in_a_part_of_their_rows() {
        let number = |row: usize, taken: f64| match row / ROWS % 2 {
            0 => taken,
            _ => f64::NAN,
        };
        let rows = 0..1100;
        let weights: Vec<f64> = rows.clone().flat_map(|_| [2.0, 3.0]).collect();
        let vector: Vec<f64> = rows
            .flat_map(|row| [number(row, 1.0), number(row, 5.0)])
            .collect();
        let mut sums = Vec::new();
        let vectors = [[&vector[..], &vector]; 2];
        Room::default().sum(&vectors, 0.5, (&weights, 2), &mut sums);
        // (w x)² (1 + h²)
        let expected = [4.0 * 1.25, 9.0 * 25.0 * 1.25];
        for (sum, expected) in sums.iter().zip(expected) {
            for pair in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                assert!((sum[pair] - expected).abs() < 1e-13 * expected);
            }
        }
    }
}
