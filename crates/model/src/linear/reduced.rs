//! A muscle's Newton matrix for one value of c, reduced as far as its formulation allows.

use std::ops::Add;
use std::sync::Arc;

use myovib_dae::columns;
use myovib_sparse::SparseOptions;
use myovib_sparse::{Prediction, SparseError};
use num_complex::Complex64;

use super::tension::{TensionBlock, Tensions};
use super::{
    Condensation, Condensed, Elimination, LinearWork, Scalar, SparseSystem, Split, Splitting,
};
use crate::field::Field;
use crate::matrix::{Matrix, Term};
use crate::muscle_dae::MuscleDae;

/// Reduction of the Newton matrices of a formulation. It is set up and analyzed once for all real and complex
/// matrices.
#[derive(Debug, Clone)]
pub struct Reduction {
    body: ReductionOfBody,
    tensions: Option<Arc<TensionBlock>>,
}

/// Reduction of the body's part.
#[derive(Debug, Clone)]
enum ReductionOfBody {
    /// Velocities and pressure rates are eliminated.
    Condensed(Arc<Condensation>, Arc<Elimination>),
    /// The stabilized equations are split into two systems.
    Split(Arc<Splitting>, [Arc<Elimination>; 2]),
}

impl Reduction {
    /// Sets up the reduction for `dae`. Every formulation has a reduction.
    ///
    /// # Panics
    /// Panics if the equations have a term that no part of the reduction includes.
    pub fn new(dae: &MuscleDae, options: SparseOptions) -> Result<Self, SparseError> {
        let mut included;
        let body = match Splitting::new(dae) {
            Some(plan) => {
                included = plan.included.clone();
                let eliminations = plan.eliminations(options)?;
                ReductionOfBody::Split(Arc::new(plan), eliminations.map(Arc::new))
            }
            None => {
                let plan = Condensation::new(dae);
                included = plan.included.clone();
                let elimination = plan.elimination(options)?;
                ReductionOfBody::Condensed(Arc::new(plan), Arc::new(elimination))
            }
        };
        let tensions = TensionBlock::new(dae);
        if tensions.is_some() {
            included.extend(TensionBlock::included());
        }
        expect_each_taken(dae.terms(), &included);
        Ok(Self { body, tensions: tensions.map(Arc::new) })
    }

    /// Predicts the size of one matrix with values of type `T` and of its factors. Returns `None` for an external
    /// solver.
    pub fn prediction<T: Scalar>(&self) -> Option<Prediction> {
        match &self.body {
            ReductionOfBody::Condensed(_, elimination) => elimination.prediction::<T>(),
            ReductionOfBody::Split(_, eliminations) => {
                let [motion, velocity] = eliminations.each_ref().map(|e| e.prediction::<T>());
                Some(motion? + velocity?)
            }
        }
    }

    /// Predicts the total size of a real matrix and `n_complex` complex matrices.
    pub fn needs(&self, n_complex: usize) -> Option<Prediction> {
        let complex = self.prediction::<Complex64>()?;
        let complex = std::iter::repeat_n(complex, n_complex);
        Some(complex.fold(self.prediction::<f64>()?, Add::add))
    }

    /// Allocates a matrix and its factors.
    pub fn matrix<T: Scalar>(&self) -> Reduced<T> {
        let body = match &self.body {
            ReductionOfBody::Condensed(plan, elimination) => {
                let matrix = Condensed::new(plan.clone(), elimination.clone());
                ReducedBody::Condensed(Box::new(matrix))
            }
            ReductionOfBody::Split(plan, eliminations) => {
                let matrix = Split::new(plan.clone(), eliminations.clone());
                ReducedBody::Split(Box::new(matrix))
            }
        };
        Reduced { body, tensions: self.tensions.clone().map(Tensions::new) }
    }
}

/// Asserts that the reduction includes each term of the equations exactly once and unchanged.
fn expect_each_taken(terms: Vec<(Field, Term)>, included: &[(Field, Term)]) {
    let mut left = terms;
    for term in included {
        let place = left.iter().position(|other| other == term);
        let place = place.unwrap_or_else(|| {
            panic!("the reduction includes {term:?}, which is not (or no longer) in the equations")
        });
        left.swap_remove(place);
    }
    assert!(left.is_empty(), "terms missing from the reduction: {left:?}");
}

/// The Newton matrix ∂F/∂y + c ∂F/∂ẏ in the form of a [`Reduction`].
#[derive(Debug)]
pub struct Reduced<T: Scalar> {
    body: ReducedBody<T>,
    tensions: Option<Tensions<T>>,
}

/// The body's part of the matrix.
#[derive(Debug)]
enum ReducedBody<T: Scalar> {
    /// The velocities are eliminated.
    Condensed(Box<Condensed<T>>),
    /// The system is split into two systems.
    Split(Box<Split<T>>),
}

impl<T: Scalar> Reduced<T> {
    pub(super) fn systems(&self) -> Vec<&SparseSystem<T>> {
        match &self.body {
            ReducedBody::Condensed(matrix) => vec![matrix.system()],
            ReducedBody::Split(matrix) => matrix.systems().into(),
        }
    }

    /// Returns the number of pivot choices that later matrices reuse.
    pub(super) fn pivot_choices(&self) -> u64 {
        match &self.body {
            ReducedBody::Condensed(matrix) => matrix.system().pivot_choices(),
            ReducedBody::Split(matrix) => {
                let [motion, velocity] = matrix.systems();
                motion.pivot_choices() + velocity.pivot_choices()
            }
        }
    }

    /// Returns the linear systems, so that their pivoting history can be restored.
    pub(super) fn systems_mut(&mut self) -> Vec<&mut SparseSystem<T>> {
        match &mut self.body {
            ReducedBody::Condensed(matrix) => vec![matrix.system_mut()],
            ReducedBody::Split(matrix) => matrix.systems_mut().into(),
        }
    }

    /// Assembles and factorizes the matrix for `c` from the `values` of the muscle's matrices.
    ///
    /// # Errors
    /// Returns [`SparseError::Singular`] or other errors of the factorization.
    pub fn set_up<'m>(
        &mut self,
        c: T,
        values: impl Fn(Matrix) -> &'m [f64],
        work: &mut LinearWork,
    ) -> Result<(), SparseError> {
        if let Some(tensions) = &mut self.tensions {
            tensions.set_up(c, &values);
        }
        match &mut self.body {
            ReducedBody::Condensed(matrix) => matrix.set_up(c, values, work),
            ReducedBody::Split(matrix) => matrix.set_up(c, values, work),
        }
    }

    /// Solves the full system in place.
    ///
    /// # Shapes
    /// `rhs`: one entry per unknown of the full system.
    pub fn solve(&mut self, rhs: &mut [T], work: &mut LinearWork) -> Result<(), SparseError> {
        if let Some(tensions) = &mut self.tensions {
            tensions.solve(rhs);
        }
        match &mut self.body {
            ReducedBody::Condensed(matrix) => matrix.solve(rhs, work),
            ReducedBody::Split(matrix) => matrix.solve(rhs, work),
        }
    }

    /// Solves the full system in place for several right-hand sides, stored row by row. If only velocities are
    /// eliminated, all right-hand sides are solved in one pass over the factors.
    ///
    /// # Shapes
    /// `rhs`: `n_columns` entries per unknown of the full system.
    pub fn solve_columns(
        &mut self,
        rhs: &mut [T],
        n_columns: usize,
        work: &mut LinearWork,
    ) -> Result<(), SparseError> {
        match (&mut self.body, &self.tensions) {
            (ReducedBody::Condensed(matrix), None) => matrix.solve_columns(rhs, n_columns, work),
            _ if n_columns == 1 => self.solve(rhs, work),
            _ => columns::one_by_one(rhs, n_columns, |column| self.solve(column, work)),
        }
    }

    /// Solves with the transpose of the full system (not conjugated) in place.
    ///
    /// # Shapes
    /// `rhs`: one entry per unknown of the full system.
    pub fn solve_transposed(
        &mut self,
        rhs: &mut [T],
        work: &mut LinearWork,
    ) -> Result<(), SparseError> {
        match &mut self.body {
            ReducedBody::Condensed(matrix) => matrix.solve_transposed(rhs, work)?,
            ReducedBody::Split(matrix) => matrix.solve_transposed(rhs, work)?,
        }
        if let Some(tensions) = &self.tensions {
            tensions.solve_transposed(rhs);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use myovib_fem::generate;
    use myovib_sparse::Precision;

    use super::*;
    use crate::formulation::Formulation::{Position, Stabilized};
    use crate::paper;

    /// Regression: for a periodic state, each integration over a period repeated the analysis.
    #[test]
    fn clones_of_a_system_share_one_analysis() {
        let mesh = generate::beam(0.1, 0.02, [2, 1]).unwrap();
        let dae = MuscleDae::new(paper::muscle(&mesh, 1e5, 0.0).unwrap(), Position).unwrap();
        let mut clone = dae.clone();
        let analyzed = |dae: &MuscleDae, options| match dae.reduction(options).unwrap().body {
            ReductionOfBody::Condensed(plan, elimination) => (plan, elimination),
            ReductionOfBody::Split(..) => panic!("only the stabilized equations are split"),
        };
        let options = SparseOptions::default();
        let (first, second) = (analyzed(&dae, options), analyzed(&clone, options));
        assert!(Arc::ptr_eq(&first.1, &second.1));
        // Matrices with the effect of eliminated oscillators have other terms.
        clone.coherence_matrices();
        assert!(!Arc::ptr_eq(&first.0, &analyzed(&clone, options).0));
        assert!(Arc::ptr_eq(&first.0, &analyzed(&dae, options).0));
        let other = SparseOptions { precision: Precision::Mixed, ..options };
        assert!(!Arc::ptr_eq(&first.1, &analyzed(&dae, other).1));
    }

    /// Without this check, the only effect of a term missing from the reduction would be slow convergence.
    #[test]
    fn a_term_that_no_part_of_a_reduction_takes_is_an_error() {
        let mesh = generate::beam(0.1, 0.02, [2, 1]).unwrap();
        let muscle = paper::muscle(&mesh, f64::INFINITY, 0.0).unwrap();
        for formulation in [Position, Stabilized] {
            let dae = MuscleDae::new(muscle.clone(), formulation).unwrap();
            let included = match Splitting::new(&dae) {
                Some(plan) => plan.included,
                None => Condensation::new(&dae).included,
            };
            expect_each_taken(dae.terms(), &included);
            let message = |terms: Vec<(Field, Term)>| {
                let result = std::panic::catch_unwind(|| expect_each_taken(terms, &included));
                *result.unwrap_err().downcast::<String>().unwrap()
            };
            for foreign in [
                Term::value(Field::Displacement, Matrix::FoundationStiffness, 1.0),
                Term::rate(Field::Displacement, Matrix::Mass, 1.0),
            ] {
                let mut terms = dae.terms();
                terms.push((Field::Velocity, foreign));
                assert!(message(terms).contains("terms missing from the reduction"));
            }
            // A term of ∂F/∂ẏ in addition to an included term of ∂F/∂y.
            let mut terms = dae.terms();
            terms[0].1.df_dyp += 1.0;
            assert!(message(terms).contains("not (or no longer) in the equations"));
        }
    }
}
