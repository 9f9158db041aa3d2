//! Solvers for the comparison.

use std::sync::Arc;

use anyhow::Result;
use myovib_sparse::{
    Elimination, Kind, LinearWork, Precision, Scalar, SparseOptions, SparseSystem, Structure,
};

use crate::solid::Solid;

/// Solver for one matrix.
pub trait Solver<T> {
    fn factor(&mut self) -> Result<()>;
    fn solve(&mut self, x: &mut [T]) -> Result<()>;
    /// Returns the memory in bytes that the solver reports.
    fn n_bytes(&mut self) -> usize;
    /// Returns the number of entries of the factors.
    fn n_entries(&mut self) -> usize;
}

/// Solver of this project.
pub struct Ours<T: Scalar> {
    system: SparseSystem<T>,
    work: LinearWork,
    n_bytes: usize,
}

impl<T: Scalar> Ours<T> {
    /// Analyzes the pattern. Factorizations use `threads` threads.
    pub fn new(
        solid: &Solid,
        values: &[T],
        kind: Kind,
        (precision, threads): (Precision, usize),
    ) -> Result<Self> {
        let structure = Structure { kind, ..Structure::default() };
        let options = SparseOptions { precision, ..SparseOptions::default() };
        let elimination = Elimination::new(&solid.pattern, structure, options)?;
        let elimination = Arc::new(elimination.in_threads(threads)?);
        let prediction = elimination.prediction::<T>();
        let mut system = SparseSystem::new(elimination);
        system.values_mut().copy_from_slice(values);
        Ok(Self {
            system,
            work: LinearWork::default(),
            n_bytes: prediction.map_or(0, |needs| needs.bytes),
        })
    }
}

impl<T: Scalar> Solver<T> for Ours<T> {
    fn factor(&mut self) -> Result<()> {
        Ok(self.system.renew(&mut self.work)?)
    }

    fn solve(&mut self, x: &mut [T]) -> Result<()> {
        Ok(self.system.solve(x, &mut self.work)?)
    }

    fn n_bytes(&mut self) -> usize {
        self.n_bytes
    }

    fn n_entries(&mut self) -> usize {
        self.work.factor_entries as usize
    }
}
