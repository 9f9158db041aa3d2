//! Vectors as combinations of others, by least squares.

use nalgebra::{SMatrix, SVector};
use pulp::{Arch, Simd, WithSimd};

use super::block::{ROWS, mean_of_column};

/// Steps that are kept: three or four frequencies with what they grow by.
pub(super) const STEPS: usize = 8;

/// Beginnings of those steps, and of the next.
pub(super) const PLACES: usize = STEPS + 1;

/// How much the state counts beside a column, both measured by their sizes. It says how the loads of a column
/// go on; its own beginning says more.
const SHARE_OF_STATE: f64 = 0.1;

/// Of vectors with more rows than this only a part is compared, some rows here and there: eight coefficients
/// need no more.
const ENOUGH_ROWS: usize = 512;

/// Sums of products are not known better.
pub(super) const DIGITS: f64 = 100.0 * f64::EPSILON;

/// The mean weighed products of vectors at the beginnings of the steps before and of the next.
pub(super) type Products = SMatrix<f64, PLACES, PLACES>;

/// Room for the products of many columns.
#[derive(Debug, Default)]
pub(super) struct Sums {
    lanes: Vec<f64>,
    scaled: Vec<f64>,
}

impl Sums {
    /// For each column the mean weighed products of all pairs of vectors: of their values, and of their
    /// derivatives times h.
    pub(super) fn of(
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
pub(super) fn combination(
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

#[cfg(test)]
mod tests {
    use super::*;

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
        Sums::default().of(&vectors, 0.5, (&weights, 2), &mut sums);
        // (w x)² (1 + h²)
        let expected = [4.0 * 1.25, 9.0 * 25.0 * 1.25];
        for (sum, expected) in sums.iter().zip(expected) {
            for pair in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                assert!((sum[pair] - expected).abs() < 1e-13 * expected);
            }
        }
    }
}
