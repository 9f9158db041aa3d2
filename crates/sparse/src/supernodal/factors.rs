//! Numerical supernodal factorization.

use std::sync::Arc;

use pulp::{Arch, Simd, WithSimd};
use rayon::ThreadPool;
use rayon::iter::{ParallelBridge, ParallelIterator};

use super::analysis::{Analysis, Supernode};
use super::child::Child;
use super::large::Front;
use super::large_solve::is_large;
use super::schedule::Schedule;
use super::small::{Block, eliminate_rows, factor_panel, minus_outer, mirror, scale_rows};
use super::workspace::Workspaces;
use crate::Number;
use crate::ffi::pages;
use crate::{Kind, SparseError};

/// Fronts with at least this many rows and pivots are processed in blocks. Measurements show that smaller fronts are
/// faster without blocks.
const LARGE: [usize; 2] = [160, 32];

/// Arrays of at least this size in bytes (a few large pages) are stored in large pages.
const MIN_LARGE_PAGE_BYTES: usize = 1 << 23;

/// LU or LDLᵀ factors in dense blocks. With one thread, only the packing of large fronts allocates memory after
/// construction.
///
/// The factors of a supernode with k columns and r rows below them consist of a (k + r) × k block with L and U of these
/// columns and, unless the matrix is symmetric, an r × k block with the transpose of the rows of U. The blocks are
/// column-major and stored one supernode after the other. The inverse pivots are stored on the diagonal. If the matrix
/// is symmetric, the elimination replaces U of the pivots by Lᵀ, except in fronts that several threads solve together.
#[derive(Debug)]
pub struct Supernodal<T: Number> {
    pub(super) analysis: Arc<Analysis>,
    schedule: Schedule,
    pub(super) threads: Option<Arc<ThreadPool>>,
    pub(super) factors: Vec<T>,
    /// Stacks of updates that wait for their parents, as assigned by the schedule.
    stacks: Vec<Stacks<T>>,
    pub(super) workspaces: Workspaces<T>,
    pub(super) arch: Arch,
}

/// Stacks of updates at even and odd depth, and workspace for the rows of U of one supernode of a symmetric matrix.
#[derive(Debug)]
struct Stacks<T> {
    sides: [Vec<T>; 2],
    upper: Vec<T>,
}

impl<T: Number> Supernodal<T> {
    /// Allocates factors for one thread.
    pub fn new(analysis: Arc<Analysis>) -> Self {
        Self::in_threads(analysis, None)
    }

    /// Allocates factors that use the given `threads`. The factors do not depend on the number of threads.
    pub fn in_threads(analysis: Arc<Analysis>, threads: Option<Arc<ThreadPool>>) -> Self {
        let n_threads = threads.as_ref().map_or(1, |pool| pool.current_num_threads());
        let schedule = Schedule::new(&analysis, n_threads);
        let stacks = schedule
            .stacks
            .iter()
            .map(|size| Stacks { sides: size.heights.map(zeros), upper: zeros(size.upper) });
        Self {
            factors: zeros(analysis.n_entries()),
            stacks: stacks.collect(),
            workspaces: Workspaces::new(&analysis),
            arch: Arch::new(),
            threads,
            schedule,
            analysis,
        }
    }

    /// Implements [`factor`](Self::factor).
    pub(crate) fn factor_by_blocks(&mut self, values: &[T]) -> Result<(), SparseError> {
        match self.threads.clone() {
            None => self.factor_rest(values, false),
            Some(pool) => pool.install(|| {
                self.factor_subtrees(values)?;
                self.factor_rest(values, true)
            }),
        }
    }

    fn factor_subtrees(&mut self, values: &[T]) -> Result<(), SparseError> {
        let Self { analysis, schedule, factors, stacks, arch, .. } = self;
        let (mut rest, mut done) = (&mut factors[..], 0);
        let mut tasks = Vec::with_capacity(schedule.subtrees.len());
        for (subtree, stacks) in schedule.subtrees.iter().zip(stacks) {
            let nodes = &analysis.supernodes[subtree.nodes.clone()];
            let start = nodes[0].start;
            let end = nodes.last().map_or(start, |last| last.start + last.n_entries(analysis.kind));
            let (_, from_start) = rest.split_at_mut(start - done);
            let (own, beyond) = from_start.split_at_mut(end - start);
            (rest, done) = (beyond, end);
            tasks.push((subtree, start, own, stacks));
        }
        // Start with the largest subtrees, so that all threads finish at nearly the same time.
        tasks.sort_by(|(a, ..), (b, ..)| b.work.total_cmp(&a.work));
        tasks.into_iter().par_bridge().try_for_each(|(subtree, start, factors, stacks)| {
            arch.dispatch(Eliminate {
                analysis,
                schedule,
                nodes: &mut subtree.nodes.clone(),
                values,
                factors,
                start,
                stacks,
                subtrees: &[],
                in_threads: false,
                arch: *arch,
            })
        })
    }

    fn factor_rest(&mut self, values: &[T], in_threads: bool) -> Result<(), SparseError> {
        let Some((stacks, subtrees)) = self.stacks.split_last_mut() else {
            return Ok(());
        };
        self.arch.dispatch(Eliminate {
            analysis: &self.analysis,
            schedule: &self.schedule,
            nodes: &mut self.schedule.rest.iter().map(|&k| k as usize),
            values,
            factors: &mut self.factors,
            start: 0,
            stacks,
            subtrees,
            in_threads,
            arch: self.arch,
        })
    }

    /// Returns the number of scalars stored for factors, updates and vectors if `n_threads` threads are used.
    pub(crate) fn n_kept(analysis: &Analysis, n_threads: usize) -> usize {
        let schedule = Schedule::new(analysis, n_threads);
        let vectors = analysis.n() + analysis.largest_front();
        analysis.n_entries() + schedule.n_entries() + vectors
    }
}

/// Elimination of some supernodes with vector instructions. This is a type instead of a closure, because the call of a
/// closure is not inlined into the function compiled with vector instructions.
struct Eliminate<'a, T: Number> {
    analysis: &'a Analysis,
    schedule: &'a Schedule,
    /// A trait object, so that the loop for the subtrees and for the rest is compiled only once.
    nodes: &'a mut dyn Iterator<Item = usize>,
    values: &'a [T],
    /// Factors from position `start` onward.
    factors: &'a mut [T],
    start: usize,
    /// Stacks of these supernodes.
    stacks: &'a mut Stacks<T>,
    /// Stacks of the completed subtrees.
    subtrees: &'a [Stacks<T>],
    in_threads: bool,
    arch: Arch,
}

impl<T: Number> WithSimd for Eliminate<'_, T> {
    type Output = Result<(), SparseError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let Self { analysis, schedule, values, factors, start, subtrees, .. } = self;
        let (kind, places) = (analysis.kind, &schedule.places);
        let Stacks { sides: [even, odd], upper: scaled } = self.stacks;
        for k in self.nodes {
            let node = &analysis.supernodes[k];
            let (own, others) = match node.is_odd {
                false => (&mut *even, &*odd),
                true => (&mut *odd, &*even),
            };
            let (side, place) = (usize::from(!node.is_odd), places[k]);
            let of_child = |child: &Child| {
                let at = places[child.node as usize];
                let stack = match at.stacks == place.stacks {
                    true => others,
                    false => &subtrees[at.stacks].sides[side],
                };
                &stack[at.offset..][..child.layout(kind).n_entries()]
            };
            let work = FrontTask {
                node,
                kind,
                block: &mut factors[node.start - start..][..node.n_entries(kind)],
                update: &mut own[place.offset..][..node.layout(kind).n_entries()],
                scaled,
                in_threads: self.in_threads,
                arch: self.arch,
            };
            if !work.eliminate(values, of_child) {
                return Err(SparseError::ZeroPivot);
            }
            let (m, k) = (node.size(), node.n_columns());
            if kind == Kind::Symmetric && !is_large(m, k) {
                mirror(&mut factors[node.start - start..][..m * k], m, 0);
            }
        }
        Ok(())
    }
}

fn zeros<T: Number>(n: usize) -> Vec<T> {
    let mut workspace = Vec::with_capacity(n);
    if n * size_of::<T>() >= MIN_LARGE_PAGE_BYTES {
        pages::prefer_large(workspace.spare_capacity_mut());
    }
    workspace.resize(n, T::zero());
    workspace
}

/// A supernode and its storage.
struct FrontTask<'a, T> {
    node: &'a Supernode,
    kind: Kind,
    block: &'a mut [T],
    update: &'a mut [T],
    /// Workspace for rows of U.
    scaled: &'a mut [T],
    in_threads: bool,
    arch: Arch,
}

impl<T: Number> FrontTask<'_, T> {
    /// Assembles and eliminates the front. `of_child` returns the updates of the children. Returns `false` if a pivot
    /// is zero or not finite.
    #[inline(always)]
    fn eliminate<'c>(self, values: &[T], of_child: impl Fn(&Child) -> &'c [T] + Sync) -> bool {
        let Self { node, kind, block, update, scaled, .. } = self;
        let (m, k, r) = (node.size(), node.n_columns(), node.n_rows());
        let is_symmetric = kind == Kind::Symmetric;
        let layout = node.layout(kind);
        if m >= LARGE[0] && k >= LARGE[1] {
            let (in_threads, arch) = (self.in_threads, self.arch);
            let front = Front { m, k, kind, in_threads, arch };
            let (panel, upper) = front.assemble(node, block, values, &of_child);
            let upper = if is_symmetric { &mut scaled[..r * k] } else { upper };
            return front.eliminate_all(panel, upper, update, &|start, chunk: &mut [T]| {
                for child in &node.children {
                    child.add_to_update(of_child(child), chunk, start, layout, k);
                }
            });
        }
        block.fill(T::zero());
        for &(index, position) in &node.entries {
            block[position as usize] = values[index as usize];
        }
        let (panel, upper) = block.split_at_mut(m * k);
        for child in &node.children {
            let of_child = of_child(child);
            child.add_to_columns(of_child, panel, 0, [m, k], kind);
            if !upper.is_empty() {
                child.add_to_rows(of_child, upper, 0, [r, k]);
            }
        }
        let upper = if is_symmetric { &mut scaled[..r * k] } else { upper };
        if is_symmetric {
            mirror(panel, m, 0);
        }
        if !factor_panel(panel, m, 0) {
            return false;
        }
        if r > 0 {
            match kind {
                Kind::General => eliminate_rows(upper, r, panel, m),
                Kind::Symmetric => scale_rows(upper, r, panel, m, [0, k]),
            }
            for (first, chunk) in layout.chunks(update) {
                let row = layout.first_row(first);
                let rows = r - row;
                let block = Block {
                    rows,
                    columns: chunk.len() / rows,
                    stride_a: m,
                    stride_b: r,
                    is_symmetric,
                };
                minus_outer(chunk, block, &panel[k + row..], &upper[first..], k);
                // Do not use a closure here: its call would not use vector instructions.
                for child in &node.children {
                    child.add_to_update(of_child(child), chunk, first, layout, k);
                }
            }
        }
        true
    }
}
