//! Solves with large fronts, by blocks of columns whose products are shared among threads. A front is cut the same
//! way for any number of threads, and each number is computed by one: results are equal to the bit.

use pulp::{Arch, Simd, WithSimd};
use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

use super::small::{solve_lower, solve_transposed, solve_upper, subtract_products, subtract_rows};
use crate::Scalar;
use crate::row::Row;

/// Fronts with this many entries of L, or more, are shared: fewer are read in the time that waking a thread takes.
const LARGE: usize = 1 << 16;
/// Columns of a block, whose triangle one thread solves.
const BLOCK: usize = 64;
/// Rows below, or above, that one thread takes at once,
const ROWS: usize = 256;
/// and columns whose scalar products it does.
const COLUMNS: usize = 8;

/// Whether a front of `m` rows and `k` pivots is large enough for this.
#[inline(always)]
pub(super) fn is_large(m: usize, k: usize) -> bool {
    m * k >= LARGE
}

/// A large front: its columns, `m` rows each, the first of them the pivots'.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shared<'a, T> {
    pub(super) panel: &'a [T],
    pub(super) m: usize,
    /// Whether to use the threads of the pool.
    pub(super) in_threads: bool,
    pub(super) arch: Arch,
}

impl<T: Scalar> Shared<'_, T> {
    /// y ← L⁻¹ y for the pivots, and `y` -= L y for the rows below them.
    #[inline(never)]
    pub(super) fn lower<R: Row<T>>(&self, y: &mut [R]) {
        let k = self.panel.len() / self.m;
        for start in (0..k).step_by(BLOCK) {
            let (own, below) = y[start..].split_at_mut(BLOCK.min(k - start));
            let columns = &self.panel[start * self.m..][..own.len() * self.m];
            self.run(Step::Lower, own, columns, start, &[]);
            let first = start + own.len();
            self.share(below, ROWS, |above, y| {
                self.run(Step::Rows, y, columns, first + above, own);
            });
        }
    }

    /// y ← (Lᵀ)⁻¹ y for the pivots, the rest of `y` being what is known below them.
    #[inline(never)]
    pub(super) fn lower_transposed<R: Row<T>>(&self, y: &mut [R]) {
        let k = self.panel.len() / self.m;
        for start in (0..k).step_by(BLOCK).rev() {
            let (own, below) = y[start..].split_at_mut(BLOCK.min(k - start));
            let columns = &self.panel[start * self.m..];
            self.share(own, COLUMNS, |before, y| {
                self.run(Step::Columns, y, &columns[before * self.m..], 0, below);
            });
            self.run(Step::Transposed, own, &columns[start..], 0, &[]);
        }
    }

    /// y ← U⁻¹ (y - U x): `upper` has the rows of U right of the pivots', x.len() entries each.
    #[inline(never)]
    pub(super) fn upper<R: Row<T>>(&self, y: &mut [R], upper: &[T], x: &[R]) {
        if !x.is_empty() {
            let right = Self {
                m: x.len(),
                ..*self
            };
            self.share(y, COLUMNS, |before, y| {
                right.run(Step::Columns, y, &upper[before * x.len()..], 0, x);
            });
        }
        let k = y.len();
        for start in (0..k).step_by(BLOCK).rev() {
            let (above, own) = y[..k.min(start + BLOCK)].split_at_mut(start);
            let columns = &self.panel[start * self.m..];
            self.run(Step::Upper, own, &columns[start..], 0, &[]);
            self.share(above, ROWS, |first, y| {
                self.run(Step::Rows, y, columns, first, own);
            });
        }
    }

    /// Does `work` for pieces of `y`, `length` long: their first index and the piece.
    fn share<R: Send>(&self, y: &mut [R], length: usize, work: impl Fn(usize, &mut [R]) + Sync) {
        match self.in_threads && y.len() > length {
            true => {
                let pieces = y.par_chunks_mut(length).enumerate();
                pieces.for_each(|(piece, y)| work(piece * length, y));
            }
            false => work(0, y),
        }
    }

    fn run<R: Row<T>>(&self, step: Step, y: &mut [R], panel: &[T], first: usize, x: &[R]) {
        let m = self.m;
        self.arch.dispatch(Run {
            step,
            y,
            panel,
            m,
            first,
            x,
        });
    }
}

/// What is done with a block.
#[derive(Debug, Clone, Copy)]
enum Step {
    /// [`solve_lower`].
    Lower,
    /// [`solve_transposed`].
    Transposed,
    /// [`solve_upper`].
    Upper,
    /// [`subtract_rows`].
    Rows,
    /// [`subtract_products`].
    Columns,
}

/// One step, to be run with the processor's vector instructions.
struct Run<'a, T, R> {
    step: Step,
    y: &'a mut [R],
    panel: &'a [T],
    m: usize,
    first: usize,
    x: &'a [R],
}

impl<T: Scalar, R: Row<T>> WithSimd for Run<'_, T, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            step,
            y,
            panel,
            m,
            first,
            x,
        } = self;
        match step {
            Step::Lower => solve_lower(y, panel, m, first),
            Step::Transposed => solve_transposed(y, panel, m),
            Step::Upper => solve_upper::<T, R, false>(y, panel, m),
            Step::Rows => subtract_rows(y, panel, m, first, x),
            Step::Columns => subtract_products(y, panel, m, x),
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

    /// A front whose rows sum up to less than its pivots, and right-hand sides.
    fn front() -> (Vec<f64>, Vec<f64>) {
        let mut state = 1_u64;
        let mut draw = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let panel = (0..M * K).map(|_| draw() / K as f64).collect();
        (panel, (0..M).map(|_| draw()).collect())
    }

    /// The three solves of a front: by blocks, and then as small fronts do them.
    fn solve<R: Row<f64>>(y: &[R], in_threads: bool) -> [[Vec<R>; 3]; 2] {
        let (panel, upper) = (front().0, front().0);
        let shared = Shared {
            panel: &panel,
            m: M,
            in_threads,
            arch: Arch::new(),
        };
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
    fn blocks_in_threads_or_not_solve_as_small_fronts_do() {
        assert!(is_large(M, K));
        let (_, one) = front();
        let two: Vec<_> = one.iter().map(|&y| Reals::load(&[y, 1.0 - y])).collect();
        let pool = pool_of(3).unwrap();
        let both = |rows: &[Reals<2>]| -> Vec<[f64; 2]> {
            let take = |row: &Reals<2>| {
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
        // L is solved for in the same order; the other two sum M products in another.
        assert_eq!(by_blocks[0], small[0]);
        for (step, (blocks, small)) in by_blocks.iter().zip(&small).enumerate() {
            for (a, b) in blocks.iter().zip(small) {
                assert!((a - b).abs() < M as f64 * f64::EPSILON, "{step}: {a} {b}");
            }
        }
    }
}
