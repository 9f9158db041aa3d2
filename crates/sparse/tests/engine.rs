//! Systems factorized by an external engine: checks and refinement of its solutions.
#![allow(clippy::unwrap_used)] // a test may panic

use std::sync::Arc;

use myovib_sparse::SparseOptions;
use myovib_sparse::engine::Engine;
use myovib_sparse::pivoting::{Factors, Symbolic};
use myovib_sparse::{
    Elimination, Factorization, Kind, LinearWork, Scalar, SparseError, SparseSystem,
};
use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;

/// An engine that factorizes with pivoting and adds a relative error to its solutions.
#[derive(Debug)]
struct Erring(f64);

#[derive(Debug)]
struct Own<T: Scalar> {
    factors: Factors<T>,
    error: f64,
}

impl<T: Scalar> Factorization<T> for Own<T> {
    fn renew(&mut self, values: &[T]) -> Result<(), SparseError> {
        if self.error.is_nan() {
            let reason = "out of memory".to_owned();
            return Err(SparseError::Engine { engine: "Erring", reason });
        }
        Factorization::renew(&mut self.factors, values)
    }

    fn solve(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        Factorization::solve(&mut self.factors, x)?;
        x.iter_mut().for_each(|x| *x = *x * (1.0 + self.error));
        Ok(())
    }

    fn solve_transposed(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        Factorization::solve_transposed(&mut self.factors, x)
    }

    fn n_entries(&self) -> Option<usize> {
        Some(5)
    }
}

impl Erring {
    fn factors<T: Scalar>(&self, pattern: &SparsityPattern) -> Box<dyn Factorization<T>> {
        let symbolic = Symbolic::analyze(pattern, SparseOptions::default()).unwrap();
        Box::new(Own { factors: Factors::new(symbolic), error: self.0 })
    }
}

impl Engine for Erring {
    fn real(&self, pattern: &Arc<SparsityPattern>, _: Kind) -> Box<dyn Factorization<f64>> {
        self.factors(pattern)
    }

    fn complex(
        &self,
        pattern: &Arc<SparsityPattern>,
        _: Kind,
    ) -> Box<dyn Factorization<Complex64>> {
        self.factors(pattern)
    }
}

/// Solves [2 1; 1 3] x = [3; 4]; the exact solution is [1; 1].
fn solve<T: Scalar>(error: f64) -> (Result<Vec<T>, SparseError>, LinearWork) {
    let dense =
        SparsityPattern::try_from_offsets_and_indices(2, 2, vec![0, 2, 4], vec![0, 1, 0, 1]);
    let elimination =
        Elimination::with_engine(Arc::new(Erring(error)), &dense.unwrap(), Kind::Symmetric);
    assert!(elimination.analysis().is_none() && elimination.prediction::<T>().is_none());
    let mut system = SparseSystem::<T>::new(Arc::new(elimination));
    let number = |x: f64| T::one() * x;
    system.values_mut().copy_from_slice(&[2.0, 1.0, 1.0, 3.0].map(number));
    let mut work = LinearWork::default();
    let mut x = [3.0, 4.0].map(number).to_vec();
    let solved = system.renew(&mut work).and_then(|()| system.solve(&mut x, &mut work));
    (solved.map(|()| x), work)
}

fn is_one<T: Scalar>(x: T, error: f64) -> bool {
    num_complex::ComplexFloat::abs(x - T::one()) <= error
}

#[test]
fn an_engine_solves_real_and_complex_systems() {
    let (real, work) = solve::<f64>(0.0);
    assert!(real.unwrap().into_iter().all(|x| is_one(x, 4.0 * f64::EPSILON)));
    assert_eq!((work.factorizations, work.factor_entries, work.pivoted), (1, 5, 0));
    let (complex, _) = solve::<Complex64>(0.0);
    assert!(complex.unwrap().into_iter().all(|x| is_one(x, 4.0 * f64::EPSILON)));
}

#[test]
fn inaccurate_solutions_of_an_engine_are_refined() {
    let (x, work) = solve::<f64>(1e-8);
    // Each refinement reduces the error by a factor of 1e-8.
    assert!(x.unwrap().into_iter().all(|x| is_one(x, 1e-15)));
    assert_eq!((work.refinements, work.pivoted), (1, 0));
}

#[test]
fn errors_of_an_engine_are_returned_without_a_fallback() {
    let (wrong, work) = solve::<f64>(0.1);
    assert!(matches!(wrong, Err(SparseError::Inaccurate { .. })), "{wrong:?}");
    assert_eq!(work.pivoted, 0);
    let (failed, _) = solve::<f64>(f64::NAN);
    assert!(matches!(failed, Err(SparseError::Engine { engine: "Erring", .. })));
}
