//! Factorizations by MUMPS, at rank 0.

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

/// MUMPS on all ranks, given matrices by rank 0.
#[derive(Debug)]
pub(crate) struct Mumps {
    leader: Arc<Leader>,
    /// Matrices so far.
    count: AtomicU64,
}

impl Mumps {
    pub(crate) fn new(leader: Arc<Leader>) -> Self {
        Self {
            leader,
            count: AtomicU64::new(0),
        }
    }

    fn factors<T: MumpsScalar>(
        &self,
        pattern: &Arc<SparsityPattern>,
        kind: Kind,
    ) -> Box<dyn Factorization<T>> {
        let number = self.count.fetch_add(1, Ordering::Relaxed) as f64;
        let is_symmetric = kind == Kind::Symmetric;
        let command = if T::IS_COMPLEX {
            Command::Complex
        } else {
            Command::Real
        };
        let symmetric = f64::from(u8::from(is_symmetric));
        self.leader.tell(command, [number, symmetric, 0.0, 0.0]);
        Box::new(Factors {
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

/// How far a matrix is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    New,
    Analyzed,
    Factorized,
}

/// A matrix that all ranks hold a part of.
struct Factors<T: MumpsScalar> {
    leader: Arc<Leader>,
    /// By which the others know it.
    number: f64,
    pattern: Arc<SparsityPattern>,
    is_symmetric: bool,
    /// Rank 0's part, until it is dropped.
    matrix: Option<Matrix<T>>,
    state: State,
}

impl<T: MumpsScalar> Factors<T> {
    /// Has all ranks do their part of `job`.
    fn together(
        &mut self,
        command: Command,
        job: impl FnOnce(&mut Matrix<T>),
    ) -> Result<(), SparseError> {
        let Some(matrix) = &mut self.matrix else {
            return Err(SparseError::NoFactors);
        };
        self.leader.tell(command, [self.number, 0.0, 0.0, 0.0]);
        job(matrix);
        match matrix.status() {
            [status, _] if status >= 0 => Ok(()),
            [-6 | -10, _] => Err(SparseError::Singular {
                n: self.pattern.major_dim(),
                column: None,
            }),
            [status, detail] => Err(SparseError::Engine {
                engine: "MUMPS",
                reason: format!(
                    "{} (INFOG(1) = {status}, INFOG(2) = {detail})",
                    meaning(status)
                ),
            }),
        }
    }

    /// Whether an entry is given to MUMPS: of a symmetric matrix those of the lower triangle.
    fn is_given(is_symmetric: bool, (column, row): (usize, usize)) -> bool {
        !is_symmetric || row >= column
    }
}

fn meaning(status: i32) -> &'static str {
    match status {
        -7 | -13 | -19 => "not enough memory: take more machines, or fewer ranks on each",
        -8 | -9 | -11 | -14 | -15 | -17 | -20 => "many pivots put off need too much room",
        -51 | -52 => "the matrix is too large for its 32-bit integers",
        _ => "see its manual",
    }
}

impl<T: MumpsScalar> Factorization<T> for Factors<T> {
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
            let given = pattern
                .entries()
                .filter(|&at| Self::is_given(is_symmetric, at));
            let places = given.map(|(column, row)| (row, column));
            self.together(Command::Analyze, |matrix| matrix.analyze(n, places))?;
        }
        self.state = State::Analyzed;
        let entries = pattern.entries().zip(values);
        let given = entries.filter(|(at, _)| Self::is_given(is_symmetric, *at));
        self.together(Command::Factor, |matrix| {
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
        self.together(Command::Solve, |matrix| matrix.solve(x))
    }

    fn solve_transposed(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        if self.is_symmetric {
            return self.solve(x);
        }
        let (engine, reason) = (
            "MUMPS",
            "transposed systems are left to one process".to_owned(),
        );
        Err(SparseError::Engine { engine, reason })
    }

    fn n_entries(&self) -> Option<usize> {
        // Entries of the factors over all ranks; negative: millions.
        match self.matrix.as_ref()?.info(29) {
            count @ 0.. => usize::try_from(count).ok(),
            millions => Some(millions.unsigned_abs() as usize * 1_000_000),
        }
    }
}

impl<T: MumpsScalar> Drop for Factors<T> {
    fn drop(&mut self) {
        if thread::panicking() || !self.leader.has_world() {
            std::mem::forget(self.matrix.take()); // MPI has ended, or is about to.
        } else {
            self.leader
                .tell(Command::Forget, [self.number, 0.0, 0.0, 0.0]);
        }
    }
}

impl<T: MumpsScalar> fmt::Debug for Factors<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Factors")
            .field("number", &self.number)
            .field("n", &self.pattern.major_dim())
            .field("state", &self.state)
            .finish_non_exhaustive()
    }
}
