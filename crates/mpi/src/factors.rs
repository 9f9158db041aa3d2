//! Factorizations by MUMPS, which rank 0 controls.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use myovib_sparse::engine::Engine;
use myovib_sparse::{Factorization, Kind, SparseError};
use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::{Complex64, ComplexFloat};

use crate::call::Command;
use crate::ffi::{Matrix, MumpsScalar};
use crate::leader::Leader;

/// MUMPS running on all ranks. Rank 0 provides the matrices.
#[derive(Debug)]
pub(crate) struct Mumps {
    leader: Arc<Leader>,
    /// Number of matrices created so far.
    count: AtomicU64,
}

impl Mumps {
    pub(crate) fn new(leader: Arc<Leader>) -> Self {
        Self { leader, count: AtomicU64::new(0) }
    }

    fn factors<T: MumpsScalar>(
        &self,
        pattern: &Arc<SparsityPattern>,
        kind: Kind,
    ) -> Box<dyn Factorization<T>> {
        let number = self.count.fetch_add(1, Ordering::Relaxed) as f64;
        let is_symmetric = kind == Kind::Symmetric;
        let command = if T::IS_COMPLEX { Command::Complex } else { Command::Real };
        let symmetric = f64::from(u8::from(is_symmetric));
        self.leader.send(command, [number, symmetric, 0.0, 0.0]);
        Box::new(MumpsFactors {
            matrix: Some(Matrix::<T>::new(is_symmetric)),
            leader: self.leader.clone(),
            number,
            pattern: pattern.clone(),
            is_symmetric,
            state: State::New,
        })
    }
}

impl Engine for Mumps {
    fn real(&self, pattern: &Arc<SparsityPattern>, kind: Kind) -> Box<dyn Factorization<f64>> {
        self.factors(pattern, kind)
    }

    fn complex(
        &self,
        pattern: &Arc<SparsityPattern>,
        kind: Kind,
    ) -> Box<dyn Factorization<Complex64>> {
        self.factors(pattern, kind)
    }
}

/// State of a matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    New,
    Analyzed,
    Factorized,
}

/// Matrix distributed over all ranks.
struct MumpsFactors<T: MumpsScalar> {
    leader: Arc<Leader>,
    /// Number by which the other ranks identify this matrix.
    number: f64,
    pattern: Arc<SparsityPattern>,
    is_symmetric: bool,
    /// Part of the matrix stored at rank 0; `None` after the matrix is dropped.
    matrix: Option<Matrix<T>>,
    state: State,
}

impl<T: MumpsScalar> MumpsFactors<T> {
    /// Runs `job` on all ranks.
    fn run_on_all_ranks(
        &mut self,
        command: Command,
        job: impl FnOnce(&mut Matrix<T>),
    ) -> Result<(), SparseError> {
        let Some(matrix) = &mut self.matrix else {
            return Err(SparseError::NoFactors);
        };
        self.leader.send(command, [self.number, 0.0, 0.0, 0.0]);
        job(matrix);
        match matrix.status() {
            [status, _] if status >= 0 => Ok(()),
            [-6 | -10, _] => {
                Err(SparseError::Singular { n: self.pattern.major_dim(), column: None })
            }
            [status, detail] => Err(SparseError::Engine {
                engine: "MUMPS",
                reason: format!("{} (INFOG(1) = {status}, INFOG(2) = {detail})", meaning(status)),
            }),
        }
    }

    /// Returns whether an entry is passed to MUMPS. For a symmetric matrix, only entries of the lower triangle are
    /// passed.
    fn is_given(is_symmetric: bool, (column, row): (usize, usize)) -> bool {
        !is_symmetric || row >= column
    }
}

fn meaning(status: i32) -> &'static str {
    match status {
        -7 | -13 | -19 => "not enough memory: use more machines, or fewer ranks on each",
        -8 | -9 | -11 | -14 | -15 | -17 | -20 => "delayed pivots need too much workspace",
        -51 | -52 => "the matrix is too large for 32-bit integers",
        _ => "see the MUMPS users' guide",
    }
}

impl<T: MumpsScalar> Factorization<T> for MumpsFactors<T> {
    fn renew(&mut self, values: &[T]) -> Result<(), SparseError> {
        let (pattern, is_symmetric) = (self.pattern.clone(), self.is_symmetric);
        let expected = pattern.nnz();
        if values.len() != expected {
            return Err(SparseError::WrongLength {
                what: "values of the matrix",
                expected,
                got: values.len(),
            });
        }
        if let Some(position) = values.iter().position(|&x| !ComplexFloat::is_finite(x)) {
            let of = "matrix";
            return Err(SparseError::NotFinite { of, position });
        }
        if self.state == State::New {
            let n = pattern.major_dim();
            let given = pattern.entries().filter(|&at| Self::is_given(is_symmetric, at));
            let places = given.map(|(column, row)| (row, column));
            self.run_on_all_ranks(Command::Analyze, |matrix| matrix.analyze(n, places))?;
        }
        self.state = State::Analyzed;
        let entries = pattern.entries().zip(values);
        let given = entries.filter(|(at, _)| Self::is_given(is_symmetric, *at));
        self.run_on_all_ranks(Command::Factor, |matrix| {
            for (own, (_, &value)) in matrix.values_mut().iter_mut().zip(given) {
                *own = value;
            }
            matrix.factor();
        })?;
        self.state = State::Factorized;
        Ok(())
    }

    fn solve(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        if self.state != State::Factorized {
            return Err(SparseError::NoFactors);
        }
        self.run_on_all_ranks(Command::Solve, |matrix| matrix.solve(x))
    }

    fn solve_transposed(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        if self.is_symmetric {
            return self.solve(x);
        }
        let (engine, reason) =
            ("MUMPS", "transposed systems are not supported with several processes".to_owned());
        Err(SparseError::Engine { engine, reason })
    }

    fn n_entries(&self) -> Option<usize> {
        // INFOG(29) is the number of entries of the factors on all ranks. The absolute value of a negative number
        // counts millions of entries.
        match self.matrix.as_ref()?.info(29) {
            count @ 0.. => usize::try_from(count).ok(),
            millions => Some(millions.unsigned_abs() as usize * 1_000_000),
        }
    }
}

impl<T: MumpsScalar> Drop for MumpsFactors<T> {
    fn drop(&mut self) {
        if thread::panicking() || !self.leader.has_world() {
            std::mem::forget(self.matrix.take()); // MPI has ended or is about to end.
        } else {
            self.leader.send(Command::Forget, [self.number, 0.0, 0.0, 0.0]);
        }
    }
}

impl<T: MumpsScalar> fmt::Debug for MumpsFactors<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MumpsFactors")
            .field("number", &self.number)
            .field("n", &self.pattern.major_dim())
            .field("state", &self.state)
            .finish_non_exhaustive()
    }
}
