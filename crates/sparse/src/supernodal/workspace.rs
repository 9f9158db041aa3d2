//! Workspace for solves.

use super::analysis::Analysis;
use crate::Number;
use crate::row::Row;

/// Workspace for rows of type R.
#[derive(Debug)]
pub(super) struct Workspace<R> {
    /// Right-hand sides, which are replaced by solutions, in the order of elimination.
    pub(super) x: Vec<R>,
    /// Right-hand sides and solutions of one front.
    pub(super) gathered: Vec<R>,
}

impl<R> Default for Workspace<R> {
    fn default() -> Self {
        Self { x: Vec::new(), gathered: Vec::new() }
    }
}

impl<R: Copy> Workspace<R> {
    pub(super) fn fit<T: Number>(&mut self, analysis: &Analysis)
    where
        R: Row<T>,
    {
        if self.x.len() != analysis.n() {
            self.x.resize(analysis.n(), R::zeros());
            self.gathered.resize(analysis.largest_front(), R::zeros());
        }
    }
}

/// Workspace for one right-hand side, and workspace for several right-hand sides once they are used.
#[derive(Debug)]
pub(super) struct Workspaces<T: Number> {
    pub(super) one: Workspace<T>,
    pub(super) two: Workspace<T::Columns<2>>,
    pub(super) four: Workspace<T::Columns<4>>,
    pub(super) eight: Workspace<T::Columns<8>>,
}

impl<T: Number> Workspaces<T> {
    /// Allocates workspace for one right-hand side.
    pub(super) fn new(analysis: &Analysis) -> Self {
        let mut one = Workspace::default();
        one.fit::<T>(analysis);
        Self {
            one,
            two: Workspace::default(),
            four: Workspace::default(),
            eight: Workspace::default(),
        }
    }
}
