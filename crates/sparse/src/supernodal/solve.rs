//! Solves with supernodal factors, for one or several right-hand sides.

use pulp::{Arch, Simd, WithSimd};

use super::analysis::Analysis;
use super::factors::Supernodal;
use super::large_solve::{LargeFront, is_large};
use super::narrow::NarrowFront;
use super::small::{
    copy_few, minus_dot, solve_lower, solve_transposed, solve_upper, subtract_products,
};
use super::workspace::Workspace;
use crate::Kind;
use crate::Number;
use crate::row::Row;

impl<T: Number> Supernodal<T> {
    /// Returns the last pivots in the order of the unknowns.
    pub(crate) fn pivots_by_unknown(&self) -> Vec<T> {
        let mut pivots = vec![T::zero(); self.analysis.n()];
        for node in &self.analysis.supernodes {
            for (p, column) in node.shape.columns.clone().enumerate() {
                let inverse = self.factors[node.start + p * node.size() + p];
                pivots[self.analysis.order[column] as usize] = T::one() / inverse;
            }
        }
        pivots
    }

    pub(crate) fn n_factors(&self) -> usize {
        self.factors.len()
    }

    /// Solves for one right-hand side.
    pub(crate) fn run_one(&mut self, rhs: &mut [T], is_transposed: bool) {
        self.in_pool(|this, in_threads| {
            let task = Task {
                analysis: &this.analysis,
                factors: &this.factors,
                is_transposed,
                in_threads,
                arch: this.arch,
            };
            let block = ColumnBlock { n_columns: 1, first: 0 };
            let one = &mut this.workspaces.one;
            this.arch.dispatch(Solve::new(task, one, rhs, block));
        });
    }

    /// Solves for up to eight right-hand sides at a time, with vector instructions.
    pub(crate) fn run(&mut self, rhs: &mut [T], n_columns: usize, is_transposed: bool) {
        self.in_pool(|this, in_threads| this.run_here(rhs, n_columns, is_transposed, in_threads));
    }

    /// Calls `solve`. Uses the thread pool if there is one and if some fronts are large enough to be shared. The
    /// argument of `solve` states whether the pool is used.
    fn in_pool(&mut self, solve: impl FnOnce(&mut Self, bool) + Send) {
        let sizes = || self.analysis.supernodes();
        let has_large = || sizes().any(|(k, r)| is_large(k + r, k));
        match self.threads.as_ref().filter(|_| has_large()).cloned() {
            Some(pool) => pool.install(|| solve(self, true)),
            None => solve(self, false),
        }
    }

    /// Solves in this thread, or in the threads of the pool.
    fn run_here(&mut self, rhs: &mut [T], n_columns: usize, is_transposed: bool, in_threads: bool) {
        let Self { analysis, factors, workspaces, arch, .. } = self;
        // One solve with eight real columns takes longer than two solves with four.
        let most = match T::IS_REAL {
            true => 4,
            false => 8,
        };
        let mut first = 0;
        while first < n_columns {
            let block = ColumnBlock { n_columns, first };
            let task = Task { analysis, factors, is_transposed, in_threads, arch: *arch };
            first += match most.min(n_columns - first) {
                1 => arch.dispatch(Solve::new(task, &mut workspaces.one, rhs, block)),
                2 | 3 => arch.dispatch(Solve::new(task, &mut workspaces.two, rhs, block)),
                4..8 => arch.dispatch(Solve::new(task, &mut workspaces.four, rhs, block)),
                _ => arch.dispatch(Solve::new(task, &mut workspaces.eight, rhs, block)),
            };
        }
    }
}

/// Range of right-hand sides in a solve.
#[derive(Debug, Clone, Copy)]
struct ColumnBlock {
    n_columns: usize,
    first: usize,
}

#[derive(Debug, Clone, Copy)]
struct Task<'a, T> {
    analysis: &'a Analysis,
    factors: &'a [T],
    is_transposed: bool,
    in_threads: bool,
    arch: Arch,
}

impl<'a, T> Task<'a, T> {
    /// Returns the front with the columns in `panel`, for the kernels of large fronts.
    #[inline(always)]
    fn shared(&self, panel: &'a [T], m: usize) -> LargeFront<'a, T> {
        LargeFront { panel, m, in_threads: self.in_threads, arch: self.arch }
    }
}

/// Solve for one block of right-hand sides. The block has as many columns as fit in a row.
struct Solve<'a, T, R> {
    task: Task<'a, T>,
    x: &'a mut [R],
    gathered: &'a mut [R],
    rhs: &'a mut [T],
    block: ColumnBlock,
}

impl<'a, T: Number, R: Row<T>> Solve<'a, T, R> {
    fn new(
        task: Task<'a, T>,
        workspace: &'a mut Workspace<R>,
        rhs: &'a mut [T],
        block: ColumnBlock,
    ) -> Self {
        workspace.fit::<T>(task.analysis);
        Self { task, x: &mut workspace.x, gathered: &mut workspace.gathered, rhs, block }
    }
}

impl<T: Number, R: Row<T>> WithSimd for Solve<'_, T, R> {
    /// Number of columns solved.
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> usize {
        let ColumnBlock { n_columns, first } = self.block;
        let Task { analysis, is_transposed, .. } = self.task;
        let row = |original: u32| {
            let start = original as usize * n_columns;
            start + first..start + n_columns
        };
        for (x, &original) in self.x.iter_mut().zip(&analysis.order) {
            *x = R::load(&self.rhs[row(original)]);
        }
        match (analysis.kind, is_transposed) {
            (Kind::Symmetric, _) => {
                self.forward();
                self.backward_transposed::<true>();
            }
            (Kind::General, false) => {
                self.forward();
                self.backward();
            }
            (Kind::General, true) => {
                self.forward_transposed();
                self.backward_transposed::<false>();
            }
        }
        for (x, &original) in self.x.iter().zip(&analysis.order) {
            x.store(&mut self.rhs[row(original)]);
        }
        size_of::<R>() / size_of::<T>()
    }
}

impl<T: Number, R: Row<T>> Solve<'_, T, R> {
    /// Computes x ← L⁻¹ x.
    #[inline(always)]
    fn forward(&mut self) {
        let Self { task, x, gathered, .. } = self;
        let Task { analysis, factors, .. } = *task;
        for node in &analysis.supernodes {
            let (m, k) = (node.size(), node.n_columns());
            if let Some(narrow) = NarrowFront::of::<R>(node, factors) {
                narrow.lower(x);
                continue;
            }
            let y = &mut gathered[..m];
            copy_few(&mut y[..k], &x[node.shape.columns.clone()]);
            y[k..].fill(R::zeros());
            let panel = &factors[node.start..][..m * k];
            match is_large(m, k) {
                true => task.shared(panel, m).lower(y),
                false => solve_lower(y, panel, m, 0),
            }
            copy_few(&mut x[node.shape.columns.clone()], &y[..k]);
            for (&row, &update) in node.shape.rows.iter().zip(&y[k..]) {
                let x = &mut x[row as usize];
                *x = x.plus(update);
            }
        }
    }

    /// Computes x ← U⁻¹ x.
    #[inline(always)]
    fn backward(&mut self) {
        let Self { task, x, gathered, .. } = self;
        let Task { analysis, factors, .. } = *task;
        for node in analysis.supernodes.iter().rev() {
            let (m, k, r) = (node.size(), node.n_columns(), node.n_rows());
            let (panel, upper) = factors[node.start..][..k * (m + r)].split_at(m * k);
            if let Some(narrow) = NarrowFront::of::<R>(node, factors) {
                narrow.upper(x, upper);
                continue;
            }
            let right = &mut gathered[..r];
            for (value, &row) in right.iter_mut().zip(&node.shape.rows) {
                *value = x[row as usize];
            }
            let pivots = &mut x[node.shape.columns.clone()];
            if is_large(m, k) {
                task.shared(panel, m).upper(pivots, upper, right);
                continue;
            }
            if r > 0 {
                for (pivot, row) in pivots.iter_mut().zip(upper.chunks_exact(r)) {
                    *pivot = pivot.plus(minus_dot(row, right));
                }
            }
            solve_upper::<T, R, false>(pivots, panel, m);
        }
    }

    /// Computes x ← (Uᵀ)⁻¹ x.
    #[inline(always)]
    fn forward_transposed(&mut self) {
        let Self { task, x, .. } = self;
        let Task { analysis, factors, .. } = *task;
        for node in &analysis.supernodes {
            let (m, k, r) = (node.size(), node.n_columns(), node.n_rows());
            let (panel, upper) = factors[node.start..][..k * (m + r)].split_at(m * k);
            let first = node.shape.columns.start;
            for p in 0..k {
                let (done, rest) = x[first..].split_at_mut(p);
                let column = &panel[p * m..];
                rest[0] = rest[0].plus(minus_dot(&column[..p], done)).times(column[p]);
                let pivot = rest[0];
                for (&row, &entry) in node.shape.rows.iter().zip(&upper[p * r..]) {
                    let x = &mut x[row as usize];
                    *x = x.minus_product(entry, pivot);
                }
            }
        }
    }

    /// Computes x ← (Lᵀ)⁻¹ x, or x ← (D Lᵀ)⁻¹ x.
    #[inline(always)]
    fn backward_transposed<const WITH_PIVOTS: bool>(&mut self) {
        let Self { task, x, gathered, .. } = self;
        let Task { analysis, factors, .. } = *task;
        for node in analysis.supernodes.iter().rev() {
            let (m, k) = (node.size(), node.n_columns());
            if let Some(narrow) = NarrowFront::of::<R>(node, factors).filter(|_| WITH_PIVOTS) {
                narrow.scaled_upper(x);
                continue;
            }
            let panel = &factors[node.start..][..m * k];
            let (own, right) = gathered[..m].split_at_mut(k);
            for (value, &row) in right.iter_mut().zip(&node.shape.rows) {
                *value = x[row as usize];
            }
            let pivots = &mut x[node.shape.columns.clone()];
            if WITH_PIVOTS {
                for (p, pivot) in pivots.iter_mut().enumerate() {
                    *pivot = pivot.times(panel[p * m + p]);
                }
            }
            if is_large(m, k) {
                own.copy_from_slice(pivots);
                task.shared(panel, m).lower_transposed(&mut gathered[..m]);
                pivots.copy_from_slice(&gathered[..k]);
                continue;
            }
            // The known rows are first subtracted from all pivots, independently of each other.
            subtract_products(pivots, panel, m, right);
            match WITH_PIVOTS {
                true => solve_upper::<T, R, true>(pivots, panel, m),
                false => solve_transposed(pivots, panel, m),
            }
        }
    }
}
