//! A muscle's Newton matrix for one c, reduced as its formulation allows.

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

/// What can be done to the Newton matrices of a formulation, laid out and analysed once for all of
/// them, real and complex.
#[derive(Debug, Clone)]
pub struct Reduction {
    body: ReductionOfBody,
    /// Tensions that are unknowns.
    tensions: Option<Arc<TensionBlock>>,
}

/// What can be done to the body's part.
#[derive(Debug, Clone)]
enum ReductionOfBody {
    /// Velocities and rates of pressures are eliminated.
    Condensed(Arc<Condensation>, Arc<Elimination>),
    /// The stabilized equations fall into two halves.
    Split(Arc<Splitting>, [Arc<Elimination>; 2]),
}

impl Reduction {
    /// Lays out the reduction for `dae`: every formulation has one.
    ///
    /// # Errors
    /// Those of the analysis.
    ///
    /// # Panics
    /// If the equations have a term that no part of the reduction takes.
    pub fn new(dae: &MuscleDae, options: SparseOptions) -> Result<Self, SparseError> {
        let mut taken;
        let body = match Splitting::new(dae) {
            Some(plan) => {
                taken = plan.taken();
                let eliminations = plan.eliminations(options)?;
                ReductionOfBody::Split(Arc::new(plan), eliminations.map(Arc::new))
            }
            None => {
                let plan = Condensation::new(dae);
                taken = plan.taken();
                let elimination = plan.elimination(options)?;
                ReductionOfBody::Condensed(Arc::new(plan), Arc::new(elimination))
            }
        };
        let tensions = TensionBlock::new(dae);
        if tensions.is_some() {
            taken.extend(TensionBlock::taken());
        }
        expect_each_taken(dae.terms(), &taken);
        Ok(Self {
            body,
            tensions: tensions.map(Arc::new),
        })
    }

    /// What one matrix of numbers `T` and its factors will need; unknown if an engine factorises.
    pub fn prediction<T: Scalar>(&self) -> Option<Prediction> {
        match &self.body {
            ReductionOfBody::Condensed(_, elimination) => elimination.prediction::<T>(),
            ReductionOfBody::Split(_, eliminations) => {
                let [motion, velocity] = eliminations.each_ref().map(|e| e.prediction::<T>());
                Some(motion? + velocity?)
            }
        }
    }

    /// What a real matrix and `n_complex` complex ones will need together.
    pub fn needs(&self, n_complex: usize) -> Option<Prediction> {
        let complex = self.prediction::<Complex64>()?;
        let complex = std::iter::repeat_n(complex, n_complex);
        Some(complex.fold(self.prediction::<f64>()?, Add::add))
    }

    /// A matrix with room for its factors.
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
        Reduced {
            body,
            tensions: self.tensions.clone().map(Tensions::new),
        }
    }
}

/// Asserts that each term of the equations is in the reduction, once and as it is.
fn expect_each_taken(terms: Vec<(Field, Term)>, taken: &[(Field, Term)]) {
    let mut left = terms;
    for term in taken {
        let place = left.iter().position(|other| other == term);
        let place = place.unwrap_or_else(|| {
            panic!("the reduction takes {term:?}, which is not (again) in the equations")
        });
        left.swap_remove(place);
    }
    assert!(
        left.is_empty(),
        "terms that no part of the reduction takes: {left:?}"
    );
}

/// The Newton matrix ∂F/∂y + c ∂F/∂ẏ, by way of a [`Reduction`].
#[derive(Debug)]
pub struct Reduced<T: Scalar> {
    body: ReducedBody<T>,
    tensions: Option<Tensions<T>>,
}

/// The body's part of it.
#[derive(Debug)]
enum ReducedBody<T: Scalar> {
    /// By elimination of velocities.
    Condensed(Box<Condensed<T>>),
    /// In two halves.
    Split(Box<Split<T>>),
}

impl<T: Scalar> Reduced<T> {
    /// The linear systems that are solved.
    pub(super) fn systems(&self) -> Vec<&SparseSystem<T>> {
        match &self.body {
            ReducedBody::Condensed(matrix) => vec![matrix.system()],
            ReducedBody::Split(matrix) => matrix.systems().into(),
        }
    }

    /// How often pivots were chosen that later matrices keep.
    pub(super) fn pivot_choices(&self) -> u64 {
        match &self.body {
            ReducedBody::Condensed(matrix) => matrix.system().pivot_choices(),
            ReducedBody::Split(matrix) => {
                let [motion, velocity] = matrix.systems();
                motion.pivot_choices() + velocity.pivot_choices()
            }
        }
    }

    /// The same, to be told of their past.
    pub(super) fn systems_mut(&mut self) -> Vec<&mut SparseSystem<T>> {
        match &mut self.body {
            ReducedBody::Condensed(matrix) => vec![matrix.system_mut()],
            ReducedBody::Split(matrix) => matrix.systems_mut().into(),
        }
    }

    /// Forms and factorises the matrix for `c` from the `values` of the muscle's matrices.
    ///
    /// # Errors
    /// [`SparseError::Singular`] and others of the factorisation.
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
    /// `rhs`: the unknowns of the full system.
    ///
    /// # Errors
    /// Those of the solve.
    pub fn solve(&mut self, rhs: &mut [T], work: &mut LinearWork) -> Result<(), SparseError> {
        if let Some(tensions) = &mut self.tensions {
            tensions.solve(rhs);
        }
        match &mut self.body {
            ReducedBody::Condensed(matrix) => matrix.solve(rhs, work),
            ReducedBody::Split(matrix) => matrix.solve(rhs, work),
        }
    }

    /// Solves the full system in place for several right-hand sides, the numbers of a row side by side;
    /// in one pass over the factors where velocities are eliminated and nothing else is.
    ///
    /// # Shapes
    /// `rhs`: the unknowns of the full system times `n_columns`.
    ///
    /// # Errors
    /// Those of the solve.
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
    /// `rhs`: the unknowns of the full system.
    ///
    /// # Errors
    /// Those of the solve.
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

    use super::*;
    use crate::formulation::Formulation::{Position, Stabilized};
    use crate::paper;

    /// What Newton's matrix has and its reduction has not would go unseen but for slow convergence.
    #[test]
    fn a_term_that_no_part_of_a_reduction_takes_is_an_error() {
        let mesh = generate::beam(0.1, 0.02, [2, 1]).unwrap();
        let muscle = paper::muscle(&mesh, f64::INFINITY, 0.0).unwrap();
        for formulation in [Position, Stabilized] {
            let dae = MuscleDae::new(muscle.clone(), formulation).unwrap();
            let taken = match Splitting::new(&dae) {
                Some(plan) => plan.taken(),
                None => Condensation::new(&dae).taken(),
            };
            expect_each_taken(dae.terms(), &taken);
            let message = |terms: Vec<(Field, Term)>| {
                let result = std::panic::catch_unwind(|| expect_each_taken(terms, &taken));
                *result.unwrap_err().downcast::<String>().unwrap()
            };
            for foreign in [
                Term::value(Field::Displacement, Matrix::BedStiffness, 1.0),
                Term::rate(Field::Displacement, Matrix::Mass, 1.0),
            ] {
                let mut terms = dae.terms();
                terms.push((Field::Velocity, foreign));
                assert!(message(terms).contains("no part of the reduction takes"));
            }
            // A rate beside a value that is taken.
            let mut terms = dae.terms();
            terms[0].1.of_rate += 1.0;
            assert!(message(terms).contains("not (again) in the equations"));
        }
    }
}
