//! Products with sparse matrices that consist of small blocks, and products with the magnitudes of their entries.

use std::marker::PhantomData;
use std::ops::Range;

use nalgebra_sparse::pattern::SparsityPattern;
use pulp::{Arch, Simd, WithSimd};

use crate::Scalar;
use crate::row::Row;

/// Plan for products with a compressed-column matrix. Two adjacent columns with the same rows are processed together,
/// and two adjacent rows share one index. Most parts of a muscle's matrices have this structure because of the two
/// components of each displacement, so one index describes four entries.
#[derive(Debug, Clone)]
pub struct Product {
    groups: Vec<Group>,
    rows: Vec<u32>,
    arch: Arch,
}

/// One column, or two adjacent columns with the same rows.
#[derive(Debug, Clone)]
struct Group {
    column: usize,
    is_double: bool,
    /// Range of the entries of the first column; the entries of the second column follow.
    entries: Range<usize>,
    /// Range in `Product::rows` that contains the first row of each pair of adjacent rows.
    pairs: Range<usize>,
    /// Range in `Product::rows` that contains the remaining single rows.
    single: Range<usize>,
}

impl Product {
    /// Finds the blocks in `pattern`.
    ///
    /// # Panics
    /// Panics if the pattern has 2³² rows or more.
    pub fn new(pattern: &SparsityPattern) -> Self {
        let offsets = pattern.major_offsets();
        let (mut groups, mut rows) = (Vec::new(), Vec::new());
        let mut column = 0;
        while column < pattern.major_dim() {
            let own = pattern.lane(column);
            let is_double = pattern.get_lane(column + 1) == Some(own);
            let pairs = own.chunks_exact(2).take_while(|pair| pair[1] == pair[0] + 1);
            let index = |&row: &usize| u32::try_from(row).expect("fewer than 2^32 rows");
            let start = rows.len();
            rows.extend(pairs.map(|pair| index(&pair[0])));
            let end_of_pairs = rows.len();
            let n_paired = 2 * (end_of_pairs - start);
            rows.extend(own[n_paired..].iter().map(index));
            groups.push(Group {
                column,
                is_double,
                entries: offsets[column]..offsets[column + 1],
                pairs: start..end_of_pairs,
                single: end_of_pairs..rows.len(),
            });
            column += 1 + usize::from(is_double);
        }
        Self { groups, rows, arch: Arch::new() }
    }

    /// Calls `visit` with the index, the row and the column of each entry.
    pub(crate) fn for_each_entry(&self, mut visit: impl FnMut(usize, usize, usize)) {
        for group in &self.groups {
            let pairs = self.rows[group.pairs.clone()].iter();
            let pairs = pairs.flat_map(|&row| [row as usize, row as usize + 1]);
            let single = self.rows[group.single.clone()].iter().map(|&row| row as usize);
            let rows = pairs.chain(single).enumerate();
            for column in 0..=usize::from(group.is_double) {
                let first = group.entries.start + column * group.entries.len();
                for (k, row) in rows.clone() {
                    visit(first + k, row, group.column + column);
                }
            }
        }
    }

    /// Returns the heap size in bytes.
    pub(crate) fn n_bytes(&self) -> usize {
        size_of_val(&self.groups[..]) + size_of_val(&self.rows[..])
    }

    /// Subtracts A x: `y` -= A `x`.
    pub(crate) fn accumulate<T: Scalar>(&self, values: &[T], x: &[T], y: &mut [T]) {
        self.arch.dispatch(Accumulate {
            product: self,
            values,
            x,
            y,
            add: |y: T, a, x: T| y.plus_product(a, -x),
        });
    }

    /// Subtracts A X or Aᵀ X from Y, up to eight columns at a time.
    pub(crate) fn by_columns<T: Scalar, const TRANSPOSED: bool>(
        &self,
        values: &[T],
        x: &[T],
        y: &mut [T],
        n_columns: usize,
    ) {
        let mut first = 0;
        while first < n_columns {
            let block = ColumnBlock { product: self, values, x, y: &mut *y, n_columns, first };
            first += match n_columns - first {
                1 => self.arch.dispatch(block.of::<T, TRANSPOSED>()),
                2 | 3 => self.arch.dispatch(block.of::<T::Columns<2>, TRANSPOSED>()),
                4..8 => self.arch.dispatch(block.of::<T::Columns<4>, TRANSPOSED>()),
                _ => self.arch.dispatch(block.of::<T::Columns<8>, TRANSPOSED>()),
            };
        }
    }

    /// Subtracts Aᵀ x (transposed, not conjugated): `y` -= Aᵀ `x`.
    pub(crate) fn transposed<T: Scalar>(&self, values: &[T], x: &[T], y: &mut [T]) {
        self.arch.dispatch(Transposed { product: self, values, x, y });
    }

    /// Adds |A| |x| to `y`, where |z| = |Re z| + |Im z|.
    pub(crate) fn magnitudes<T: Scalar>(&self, values: &[T], x: &[T], y: &mut [f64]) {
        self.arch.dispatch(Accumulate {
            product: self,
            values,
            x,
            y,
            add: |y: f64, a: T, x: T| y + (a * x).l1_norm(),
        });
    }
}

/// Computes `y_i` ← add(`y_i`, a_ij, `x_j`) for all entries, with vector instructions.
struct Accumulate<'a, T, Y, F> {
    product: &'a Product,
    values: &'a [T],
    x: &'a [T],
    y: &'a mut [Y],
    add: F,
}

impl<T: Scalar, Y: Copy, F: Fn(Y, T, T) -> Y> WithSimd for Accumulate<'_, T, Y, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { product, values, x, y, add } = self;
        for group in &product.groups {
            let n = group.entries.len();
            let first = &values[group.entries.clone()];
            let pairs = &product.rows[group.pairs.clone()];
            let single = &product.rows[group.single.clone()];
            let x0 = x[group.column];
            let (pairs0, single0) = first.split_at(2 * pairs.len());
            if group.is_double {
                let x1 = x[group.column + 1];
                let second = &values[group.entries.end..][..n];
                let (pairs1, single1) = second.split_at(2 * pairs.len());
                let entries = pairs0.chunks_exact(2).zip(pairs1.chunks_exact(2));
                for (&row, (a, b)) in pairs.iter().zip(entries) {
                    let y = &mut y[row as usize..][..2];
                    y[0] = add(add(y[0], a[0], x0), b[0], x1);
                    y[1] = add(add(y[1], a[1], x0), b[1], x1);
                }
                for (&row, (&a, &b)) in single.iter().zip(single0.iter().zip(single1)) {
                    let y = &mut y[row as usize];
                    *y = add(add(*y, a, x0), b, x1);
                }
            } else {
                for (&row, a) in pairs.iter().zip(pairs0.chunks_exact(2)) {
                    let y = &mut y[row as usize..][..2];
                    y[0] = add(y[0], a[0], x0);
                    y[1] = add(y[1], a[1], x0);
                }
                for (&row, &a) in single.iter().zip(single0) {
                    let y = &mut y[row as usize];
                    *y = add(*y, a, x0);
                }
            }
        }
    }
}

/// Block of columns of Y ← Y − A X that starts at column `first`.
struct ColumnBlock<'a, T> {
    product: &'a Product,
    values: &'a [T],
    x: &'a [T],
    y: &'a mut [T],
    n_columns: usize,
    first: usize,
}

/// Kernel that processes all columns of a row of type R together.
struct ColumnKernel<'a, T, R, const TRANSPOSED: bool> {
    block: ColumnBlock<'a, T>,
    row: PhantomData<R>,
}

impl<'a, T> ColumnBlock<'a, T> {
    fn of<R, const TRANSPOSED: bool>(self) -> ColumnKernel<'a, T, R, TRANSPOSED> {
        ColumnKernel { block: self, row: PhantomData }
    }
}

impl<T: Scalar, R: Row<T>, const TRANSPOSED: bool> WithSimd for ColumnKernel<'_, T, R, TRANSPOSED> {
    /// Number of columns processed.
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> usize {
        let ColumnBlock { product, values, x, y, n_columns, first } = self.block;
        let place = |row: usize| row * n_columns + first..(row + 1) * n_columns;
        for group in &product.groups {
            let n = group.entries.len();
            let pairs = &product.rows[group.pairs.clone()];
            let single = &product.rows[group.single.clone()];
            let own = &values[group.entries.clone()];
            let (pairs0, single0) = own.split_at(2 * pairs.len());
            // Do not use closures below: they would be compiled without vector instructions.
            if !group.is_double {
                let x0 = match TRANSPOSED {
                    true => R::zeros(),
                    false => R::load(&x[place(group.column)]),
                };
                let (mut even, mut odd) = (R::zeros(), R::zeros());
                for (&row, a) in pairs.iter().zip(pairs0.chunks_exact(2)) {
                    let row = row as usize;
                    if TRANSPOSED {
                        even = even.minus_product(a[0], R::load(&x[place(row)]));
                        odd = odd.minus_product(a[1], R::load(&x[place(row + 1)]));
                    } else {
                        update(&mut y[place(row)], [(a[0], x0)]);
                        update(&mut y[place(row + 1)], [(a[1], x0)]);
                    }
                }
                for (&row, &a) in single.iter().zip(single0) {
                    let row = row as usize;
                    if TRANSPOSED {
                        even = even.minus_product(a, R::load(&x[place(row)]));
                    } else {
                        update(&mut y[place(row)], [(a, x0)]);
                    }
                }
                if TRANSPOSED {
                    let y = &mut y[place(group.column)];
                    R::load(y).plus(even.plus(odd)).store(y);
                }
                continue;
            }
            let second = &values[group.entries.end..][..n];
            let (pairs1, single1) = second.split_at(2 * pairs.len());
            let entries = pairs0.chunks_exact(2).zip(pairs1.chunks_exact(2));
            let singles = single0.iter().zip(single1);
            if TRANSPOSED {
                let mut sums = [R::zeros(); 4];
                for (&row, (a, b)) in pairs.iter().zip(entries) {
                    let row = row as usize;
                    let (x0, x1) = (R::load(&x[place(row)]), R::load(&x[place(row + 1)]));
                    sums[0] = sums[0].minus_product(a[0], x0);
                    sums[1] = sums[1].minus_product(a[1], x1);
                    sums[2] = sums[2].minus_product(b[0], x0);
                    sums[3] = sums[3].minus_product(b[1], x1);
                }
                for (&row, (&a, &b)) in single.iter().zip(singles) {
                    let x0 = R::load(&x[place(row as usize)]);
                    sums[0] = sums[0].minus_product(a, x0);
                    sums[2] = sums[2].minus_product(b, x0);
                }
                for column in 0..2 {
                    let y = &mut y[place(group.column + column)];
                    let sum = sums[2 * column].plus(sums[2 * column + 1]);
                    R::load(y).plus(sum).store(y);
                }
            } else {
                let x0 = R::load(&x[place(group.column)]);
                let x1 = R::load(&x[place(group.column + 1)]);
                for (&row, (a, b)) in pairs.iter().zip(entries) {
                    let row = row as usize;
                    update(&mut y[place(row)], [(a[0], x0), (b[0], x1)]);
                    update(&mut y[place(row + 1)], [(a[1], x0), (b[1], x1)]);
                }
                for (&row, (&a, &b)) in single.iter().zip(singles) {
                    update(&mut y[place(row as usize)], [(a, x0), (b, x1)]);
                }
            }
        }
        size_of::<R>() / size_of::<T>()
    }
}

/// Computes y ← y − Σ a x.
#[inline(always)]
fn update<T: Scalar, R: Row<T>, const N: usize>(y: &mut [T], products: [(T, R); N]) {
    let mut sum = R::load(y);
    for (a, x) in products {
        sum = sum.minus_product(a, x);
    }
    sum.store(y);
}

/// Computes `y` ← `y` − Aᵀ `x`, with vector instructions.
struct Transposed<'a, T> {
    product: &'a Product,
    values: &'a [T],
    x: &'a [T],
    y: &'a mut [T],
}

impl<T: Scalar> WithSimd for Transposed<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { product, values, x, y } = self;
        for group in &product.groups {
            let pairs = &product.rows[group.pairs.clone()];
            let single = &product.rows[group.single.clone()];
            let n = group.entries.len();
            for column in 0..1 + usize::from(group.is_double) {
                let own = &values[group.entries.start + column * n..][..n];
                let (of_pairs, of_single) = own.split_at(2 * pairs.len());
                let mut sums = [T::zero(); 2];
                for (&row, a) in pairs.iter().zip(of_pairs.chunks_exact(2)) {
                    let x = &x[row as usize..][..2];
                    sums[0] = sums[0].plus_product(a[0], x[0]);
                    sums[1] = sums[1].plus_product(a[1], x[1]);
                }
                for (&row, &a) in single.iter().zip(of_single) {
                    sums[0] = sums[0].plus_product(a, x[row as usize]);
                }
                y[group.column + column] -= sums[0] + sums[1];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_of_all_kinds_are_multiplied() {
        // Columns 0 and 1 have the same rows: an adjacent pair and a single row. Column 2 has an adjacent pair, column
        // 3 has a single row, and column 4 is empty.
        let lanes: [&[usize]; 5] = [&[0, 1, 3], &[0, 1, 3], &[2, 3], &[0], &[]];
        let mut offsets = vec![0];
        offsets.extend(lanes.iter().scan(0, |end, lane| {
            *end += lane.len();
            Some(*end)
        }));
        let rows = lanes.concat();
        let pattern = SparsityPattern::try_from_offsets_and_indices(5, 4, offsets, rows).unwrap();
        let values: Vec<f64> = (1..=pattern.nnz()).map(|k| k as f64).collect();
        let x = [1.0, 10.0, 100.0, 1000.0, 1e4];
        let mut expected = [0.5; 4];
        for ((column, row), a) in pattern.entries().zip(&values) {
            expected[row] -= a * x[column];
        }
        let mut y = [0.5; 4];
        let product = Product::new(&pattern);
        product.subtract(&values, &x, &mut y);
        assert_eq!(y, expected);
        let mut transposed = [0.5; 5];
        for ((column, row), a) in pattern.entries().zip(&values) {
            transposed[column] -= a * x[row];
        }
        let mut by_columns = [0.5; 5];
        product.subtract_transposed(&values, &x, &mut by_columns);
        assert_eq!(by_columns, transposed);
        // There are several columns, which are multiples of the first column.
        for n_columns in [3, 8, 15] {
            let side_by_side = |of: &[f64], start: f64| -> Vec<f64> {
                let row = |x: &f64| {
                    let x = *x - start;
                    (1..=n_columns).map(move |c| start + c as f64 * x)
                };
                of.iter().flat_map(row).collect()
            };
            let mut y = vec![0.5; 4 * n_columns];
            product.subtract_columns(&values, &side_by_side(&x, 0.0), &mut y, n_columns);
            assert_eq!(y, side_by_side(&expected, 0.5));
            let mut y = vec![0.5; 5 * n_columns];
            let x = side_by_side(&x[..4], 0.0);
            product.subtract_transposed_columns(&values, &x, &mut y, n_columns);
            assert_eq!(y, side_by_side(&transposed, 0.5));
        }
        // All entries are positive, so adding the magnitudes restores the initial values.
        product.add_magnitudes(&values, &x, &mut y);
        assert_eq!(y, [0.5; 4]);
        let doubles: Vec<bool> = product.groups.iter().map(|group| group.is_double).collect();
        assert_eq!(doubles, [true, false, false, false]);
    }
}
