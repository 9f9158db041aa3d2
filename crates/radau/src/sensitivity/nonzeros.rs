//! Products with the nonzero entries of a matrix.

use myovib_sparse::Product;
use nalgebra_sparse::CscMatrix;
use nalgebra_sparse::pattern::SparsityPattern;

/// Entries of a pattern that have been nonzero so far.
///
/// ∂F/∂y and ∂F/∂ẏ share a pattern, and each matrix has nonzero entries only in a part of it. In products with the full
/// pattern, most entries would be zero.
#[derive(Debug)]
pub(super) struct Nonzeros {
    is_kept: Vec<bool>,
    /// Positions of these entries in ascending order.
    places: Vec<usize>,
    product: Product,
}

impl Nonzeros {
    /// Creates an empty set.
    pub(super) fn new(pattern: &SparsityPattern) -> Self {
        let is_kept = vec![false; pattern.nnz()];
        Self { product: product(pattern, &is_kept), places: Vec::new(), is_kept }
    }

    /// Adds the nonzero entries of matrices with the given `values`, in the order of the pattern.
    pub(super) fn learn<'v>(
        &mut self,
        pattern: &SparsityPattern,
        matrices: impl Iterator<Item = &'v [f64]>,
    ) {
        let mut is_new = false;
        for values in matrices {
            for (is_kept, value) in self.is_kept.iter_mut().zip(values) {
                let is_other = *value != 0.0 && !*is_kept;
                *is_kept |= is_other;
                is_new |= is_other;
            }
        }
        if is_new {
            let kept = self.is_kept.iter().enumerate().filter(|(_, is_kept)| **is_kept);
            self.places = kept.map(|(place, _)| place).collect();
            self.product = product(pattern, &self.is_kept);
        }
    }

    /// Moves these entries to the front of `values`.
    pub(super) fn compress(&self, values: &mut [f64]) {
        for (k, &place) in self.places.iter().enumerate() {
            values[k] = values[place];
        }
    }

    /// Subtracts the product of the matrix with the given compressed `values` and the columns of `x` from `out`.
    /// Columns are stored row by row.
    pub(super) fn subtract(&self, values: &[f64], x: &[f64], out: &mut [f64], n_columns: usize) {
        let values = &values[..self.places.len()];
        self.product.subtract_columns(values, x, out, n_columns);
    }

    /// Subtracts the product of the transposed matrix with the given compressed `values` and `x` from `out`.
    pub(super) fn subtract_transposed(&self, values: &[f64], x: &[f64], out: &mut [f64]) {
        let values = &values[..self.places.len()];
        self.product.subtract_transposed(values, x, out);
    }
}

/// Returns the product restricted to these entries.
fn product(pattern: &SparsityPattern, is_kept: &[bool]) -> Product {
    let kept = CscMatrix::try_from_pattern_and_values(pattern.clone(), is_kept.to_vec());
    let kept = kept.expect("one value for each entry").filter(|_, _, is_kept| *is_kept);
    Product::new(kept.pattern())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computes products with the matrix ((1, 3), (2, 4)), stored as 1, 2, 3, 4: first with the diagonal only, then
    /// with all entries.
    #[test]
    fn products_are_those_of_all_entries_seen() {
        let pattern =
            SparsityPattern::try_from_offsets_and_indices(2, 2, vec![0, 2, 4], vec![0, 1, 0, 1])
                .unwrap();
        let mut nonzeros = Nonzeros::new(&pattern);
        for (mut values, expected) in [
            ([1.0, 0.0, 0.0, 4.0], [-5.0, -28.0]),
            ([1.0, 2.0, 3.0, 4.0], [-26.0, -38.0]),
            // Entries that have been nonzero once remain in the set.
            ([1.0, 0.0, 0.0, 4.0], [-5.0, -28.0]),
        ] {
            nonzeros.learn(&pattern, std::iter::once(&values[..]));
            nonzeros.compress(&mut values);
            let mut out = [0.0; 2];
            nonzeros.subtract(&values, &[5.0, 7.0], &mut out, 1);
            assert_eq!(out, expected);
        }
    }
}
