//! Least-squares approximation of a vector by linear combinations of other vectors.

use nalgebra::{SMatrix, SVector};
use pulp::{Arch, Simd};
use pulp_macro::with_simd;

use super::block::{ROWS, mean_of_column};

/// Number of stored steps, which is sufficient for three or four frequencies and their growth rates.
pub(super) const STEPS: usize = 8;

/// Number of vectors: one at the start of each stored step, and one at the start of the next step.
pub(super) const PLACES: usize = STEPS + 1;

/// Weight of the state relative to a column, with both scaled by their norms. The state helps to predict the forcing of
/// the column, but the previous values of the column itself are more reliable.
const SHARE_OF_STATE: f64 = 0.1;

/// Number of rows above which only a sample of the rows is compared, which is sufficient for eight coefficients.
const ENOUGH_ROWS: usize = 512;

/// Relative accuracy of sums of products.
pub(super) const DIGITS: f64 = 100.0 * f64::EPSILON;

/// Matrix of the mean weighted products of all pairs of vectors: the vectors at the starts of the previous steps and at
/// the start of the next step.
pub(super) type Products = SMatrix<f64, PLACES, PLACES>;

/// Workspace for the products of many columns.
#[derive(Debug, Default)]
pub(super) struct Sums {
    lanes: Vec<f64>,
    scaled: Vec<f64>,
}

impl Sums {
    /// Computes the mean weighted products of all pairs of vectors for each column. Each is the sum of the product of
    /// the values and the product of the derivatives times h.
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
            let Self { lanes, scaled } = &mut *self;
            add_products(lanes, scaled, (width, every), vectors, part, weights);
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

/// Returns the coefficients of the linear combination of the first `count` vectors that approximates the next vector,
/// computed from the products of a column and of the state. Large coefficients are damped, depending on the tolerance.
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
    // The coefficients of missing steps are 0.
    let mut matrix = SMatrix::<f64, STEPS, STEPS>::identity();
    let mut rhs = SVector::zeros();
    for k in 0..count {
        for l in 0..count {
            matrix[(k, l)] = both[(k, l)];
        }
        // The accuracy of each vector is limited by the tolerance and by the rounding errors of its products.
        matrix[(k, k)] += tolerance.powi(2) + DIGITS * both[(k, k)];
        rhs[k] = both[(k, count)];
    }
    let factors = matrix.cholesky();
    factors.map_or(SVector::zeros(), |factors| factors.solve(&rhs))
}

/// Accumulates w² a b in SIMD lanes for all pairs of vectors: products of their values (`part` = 0) or of their
/// derivatives (`part` = 1). Uses one of `every` blocks of `width` values. `scaled` is workspace for one block of each
/// vector.
#[with_simd(add_products = Arch::new())]
#[inline(always)]
fn add_products_with<S: Simd>(
    _: S,
    lanes: &mut [f64],
    scaled: &mut [f64],
    (width, every): (usize, usize),
    vectors: &[[&[f64]; 2]],
    part: usize,
    weights: &[f64],
) {
    for (number, weights) in weights.chunks(width).enumerate().step_by(every) {
        let (start, n) = (number * width, weights.len());
        for (k, vector) in vectors.iter().enumerate() {
            let vector = &vector[part][start..][..n];
            let scaled = &mut scaled[k * width..][..n];
            for i in 0..n {
                scaled[i] = weights[i] * vector[i];
            }
        }
        let mut pair = 0;
        for k in 0..vectors.len() {
            let a = &scaled[k * width..][..n];
            for l in 0..=k {
                let b = &scaled[l * width..][..n];
                let lanes = &mut lanes[pair * width..][..n];
                for i in 0..n {
                    lanes[i] += a[i] * b[i];
                }
                pair += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every second block of eight of the 1100 rows is used. The other rows have arbitrary values, which must not
    /// affect the result. The expected result is the weighted mean over the used rows.
    #[test]
    fn long_vectors_are_compared_in_a_part_of_their_rows() {
        let number = |row: usize, taken: f64| match row / ROWS % 2 {
            0 => taken,
            _ => f64::NAN,
        };
        let rows = 0..1100;
        let weights: Vec<f64> = rows.clone().flat_map(|_| [2.0, 3.0]).collect();
        let vector: Vec<f64> = rows.flat_map(|row| [number(row, 1.0), number(row, 5.0)]).collect();
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
