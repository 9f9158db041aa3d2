//! Where solves work.

use super::analysis::Analysis;
use crate::Scalar;
use crate::row::Row;

/// Workspace for rows of one width.
#[derive(Debug)]
pub(super) struct Room<R> {
    /// Right-hand sides, then solutions, in the order of elimination.
    pub(super) x: Vec<R>,
    /// Those of a front.
    pub(super) gathered: Vec<R>,
}

impl<R> Default for Room<R> {
    fn default() -> Self {
        Self {
            x: Vec::new(),
            gathered: Vec::new(),
        }
    }
}

impl<R: Copy> Room<R> {
    pub(super) fn fit<T: Scalar>(&mut self, analysis: &Analysis)
    where
        R: Row<T>,
    {
        if self.x.len() != analysis.n() {
            self.x.resize(analysis.n(), R::zeros());
            self.gathered.resize(analysis.largest_front(), R::zeros());
        }
    }
}

/// Workspace for one right-hand side, and for several once there are any.
#[derive(Debug)]
pub(super) struct Rooms<T: Scalar> {
    pub(super) one: Room<T>,
    pub(super) two: Room<T::Columns<2>>,
    pub(super) four: Room<T::Columns<4>>,
    pub(super) eight: Room<T::Columns<8>>,
}

impl<T: Scalar> Rooms<T> {
    /// Room for one.
    pub(super) fn new(analysis: &Analysis) -> Self {
        let mut one = Room::default();
        one.fit::<T>(analysis);
        Self {
            one,
            two: Room::default(),
            four: Room::default(),
            eight: Room::default(),
        }
    }
}
