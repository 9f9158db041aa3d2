//! Solves with large fronts, in blocks of columns whose products are shared among threads. The partition of a front
//! does not depend on the number of threads, and each value is computed by one thread. Therefore, results are bitwise
//! reproducible.

use pulp::{Arch, Simd, WithSimd};
use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

use super::small::{solve_lower, solve_transposed, solve_upper, subtract_products, subtract_rows};
use crate::Number;
use crate::row::Row;

/// Minimum number of entries of L for a shared solve. Reading a smaller front takes less time than waking a thread.
const LARGE: usize = 1 << 16;
/// Number of columns of a block. One thread solves the triangle of a block.
const BLOCK: usize = 64;
/// Number of rows below or above a block that one thread processes at once.
const ROWS: usize = 256;
/// Number of columns whose scalar products one thread computes.
const COLUMNS: usize = 8;

/// Returns whether a front of `m` rows and `k` pivots is large enough for a shared solve.
#[inline(always)]
pub(super) fn is_large(m: usize, k: usize) -> bool {
    m * k >= LARGE
}

/// Large front, stored as columns of `m` rows each. The pivot rows come first.
#[derive(Debug, Clone, Copy)]
pub(super) struct LargeFront<'a, T> {
    pub(super) panel: &'a [T],
    pub(super) m: usize,
    /// Whether the threads of the pool are used.
    pub(super) in_threads: bool,
    pub(super) arch: Arch,
}

impl<T: Number> LargeFront<'_, T> {
    /// Computes y ← L⁻¹ y for the pivots, and subtracts L y from the rows of `y` below them.
    #[inline(never)]
    pub(super) fn lower<R: Row<T>>(&self, y: &mut [R]) {
        let k = self.panel.len() / self.m;
        for start in (0..k).step_by(BLOCK) {
            let (own, below) = y[start..].split_at_mut(BLOCK.min(k - start));
            let columns = &self.panel[start * self.m..][..own.len() * self.m];
            self.run(BlockOperation::Lower, own, columns, start, &[]);
            let first = start + own.len();
            self.share(below, ROWS, |above, y| {
                self.run(BlockOperation::Rows, y, columns, first + above, own);
            });
        }
    }

    /// Computes y ← (Lᵀ)⁻¹ y for the pivots. The rest of `y` contains the known values below the pivots.
    #[inline(never)]
    pub(super) fn lower_transposed<R: Row<T>>(&self, y: &mut [R]) {
        let k = self.panel.len() / self.m;
        for start in (0..k).step_by(BLOCK).rev() {
            let (own, below) = y[start..].split_at_mut(BLOCK.min(k - start));
            let columns = &self.panel[start * self.m..];
            self.share(own, COLUMNS, |before, y| {
                self.run(BlockOperation::Columns, y, &columns[before * self.m..], 0, below);
            });
            self.run(BlockOperation::Transposed, own, &columns[start..], 0, &[]);
        }
    }

    /// Computes y ← U⁻¹ (y − U x). `upper` contains the rows of U to the right of the pivots, with x.len() entries
    /// each.
    #[inline(never)]
    pub(super) fn upper<R: Row<T>>(&self, y: &mut [R], upper: &[T], x: &[R]) {
        if !x.is_empty() {
            let right = Self { m: x.len(), ..*self };
            self.share(y, COLUMNS, |before, y| {
                right.run(BlockOperation::Columns, y, &upper[before * x.len()..], 0, x);
            });
        }
        let k = y.len();
        for start in (0..k).step_by(BLOCK).rev() {
            let (above, own) = y[..k.min(start + BLOCK)].split_at_mut(start);
            let columns = &self.panel[start * self.m..];
            self.run(BlockOperation::Upper, own, &columns[start..], 0, &[]);
            self.share(above, ROWS, |first, y| {
                self.run(BlockOperation::Rows, y, columns, first, own);
            });
        }
    }

    /// Splits `y` into pieces of the given `length` and calls `work` with each piece and its first index.
    fn share<R: Send>(&self, y: &mut [R], length: usize, work: impl Fn(usize, &mut [R]) + Sync) {
        match self.in_threads && y.len() > length {
            true => {
                let pieces = y.par_chunks_mut(length).enumerate();
                pieces.for_each(|(piece, y)| work(piece * length, y));
            }
            false => work(0, y),
        }
    }

    fn run<R: Row<T>>(
        &self,
        operation: BlockOperation,
        y: &mut [R],
        panel: &[T],
        first: usize,
        x: &[R],
    ) {
        let m = self.m;
        self.arch.dispatch(Run { operation, y, panel, m, first, x });
    }
}

#[derive(Debug, Clone, Copy)]
enum BlockOperation {
    /// See [`solve_lower`].
    Lower,
    /// See [`solve_transposed`].
    Transposed,
    /// See [`solve_upper`].
    Upper,
    /// See [`subtract_rows`].
    Rows,
    /// See [`subtract_products`].
    Columns,
}

/// One operation on a block, with vector instructions.
struct Run<'a, T, R> {
    operation: BlockOperation,
    y: &'a mut [R],
    panel: &'a [T],
    m: usize,
    first: usize,
    x: &'a [R],
}

impl<T: Number, R: Row<T>> WithSimd for Run<'_, T, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { operation, y, panel, m, first, x } = self;
        match operation {
            BlockOperation::Lower => solve_lower(y, panel, m, first),
            BlockOperation::Transposed => solve_transposed(y, panel, m),
            BlockOperation::Upper => solve_upper::<T, R, false>(y, panel, m),
            BlockOperation::Rows => subtract_rows(y, panel, m, first, x),
            BlockOperation::Columns => subtract_products(y, panel, m, x),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::resources::pool_of;
    use crate::row::Reals;

    const M: usize = 611;
    const K: usize = 157;

    /// Returns a diagonally dominant front, and right-hand sides.
    fn front() -> (Vec<f64>, Vec<f64>) {
        let mut state = 1_u64;
        let mut draw = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let panel = (0..M * K).map(|_| draw() / K as f64).collect();
        (panel, (0..M).map(|_| draw()).collect())
    }

    /// Returns the results of the three solves with a front, first in blocks and then with the kernels for small
    /// fronts.
    fn solve<R: Row<f64>>(y: &[R], in_threads: bool) -> [[Vec<R>; 3]; 2] {
        let (panel, upper) = (front().0, front().0);
        let shared = LargeFront { panel: &panel, m: M, in_threads, arch: Arch::new() };
        let [mut lower, mut transposed, mut pivots] = [y.to_vec(), y.to_vec(), y[..K].to_vec()];
        shared.lower(&mut lower);
        shared.lower_transposed(&mut transposed);
        shared.upper(&mut pivots, &upper[..K * (M - K)], &y[K..]);
        let by_blocks = [lower, transposed, pivots];

        let [mut lower, mut transposed, mut pivots] = [y.to_vec(), y.to_vec(), y[..K].to_vec()];
        solve_lower(&mut lower, &panel, M, 0);
        let (own, below) = transposed.split_at_mut(K);
        subtract_products(own, &panel, M, below);
        solve_transposed(own, &panel, M);
        subtract_products(&mut pivots, &upper, M - K, &y[K..]);
        solve_upper::<f64, R, false>(&mut pivots, &panel, M);
        [by_blocks, [lower, transposed, pivots]]
    }

    #[test]
    fn solves_of_large_fronts_agree_with_the_small_kernels() {
        assert!(is_large(M, K));
        let (_, one) = front();
        let two: Vec<_> = one.iter().map(|&y| Reals::load(&[y, 1.0 - y])).collect();
        let pool = pool_of(3).unwrap();
        let both = |rows: &[Reals<f64, 2>]| -> Vec<[f64; 2]> {
            let take = |row: &Reals<f64, 2>| {
                let mut numbers = [0.0; 2];
                row.store(&mut numbers);
                numbers
            };
            rows.iter().map(take).collect()
        };
        let [by_blocks, small] = solve(&one, false);
        let [in_threads, _] = pool.install(|| solve(&one, true));
        assert_eq!(in_threads, by_blocks);
        let wide = solve(&two, false)[0].each_ref().map(|rows| both(rows));
        let [in_threads, _] = pool.install(|| solve(&two, true));
        assert_eq!(in_threads.each_ref().map(|rows| both(rows)), wide);
        // The solve with L uses the same order of operations. The other two sum M products in a different order.
        assert_eq!(by_blocks[0], small[0]);
        for (step, (blocks, small)) in by_blocks.iter().zip(&small).enumerate() {
            for (a, b) in blocks.iter().zip(small) {
                assert!((a - b).abs() < M as f64 * f64::EPSILON, "{step}: {a} {b}");
            }
        }
    }
}
