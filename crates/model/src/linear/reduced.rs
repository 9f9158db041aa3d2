//! A muscle's Newton matrix for one c, reduced as its formulation allows.

use std::ops::Add;
use std::sync::Arc;

use myovib_dae::columns;
use myovib_sparse::klu::KluOptions;
use myovib_sparse::{Prediction, SparseError};
use num_complex::Complex64;

use super::tension::{TensionBlock, Tensions};
use super::{
    Condensation, Condensed, Elimination, LinearWork, Number, SparseSystem, Split, Splitting,
};
use crate::matrix::Matrix;
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
    pub fn new(dae: &MuscleDae, options: KluOptions) -> Result<Self, SparseError> {
        let body = match Splitting::new(dae) {
            Some(plan) => {
                let eliminations = plan.eliminations(options)?;
                ReductionOfBody::Split(Arc::new(plan), eliminations.map(Arc::new))
            }
            None => {
                let plan = Condensation::new(dae);
                let elimination = plan.elimination(options)?;
                ReductionOfBody::Condensed(Arc::new(plan), Arc::new(elimination))
            }
        };
        Ok(Self {
            body,
            tensions: TensionBlock::new(dae).map(Arc::new),
        })
    }

    /// What one matrix of numbers `T` and its factors will need; unknown if an engine factorises.
    pub fn prediction<T: Number>(&self) -> Option<Prediction> {
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
    pub fn matrix<T: Number>(&self) -> Reduced<T> {
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

/// The Newton matrix ∂F/∂y + c ∂F/∂ẏ, by way of a [`Reduction`].
#[derive(Debug)]
pub struct Reduced<T: Number> {
    body: ReducedBody<T>,
    tensions: Option<Tensions<T>>,
}

/// The body's part of it.
#[derive(Debug)]
enum ReducedBody<T: Number> {
    /// By elimination of velocities.
    Condensed(Box<Condensed<T>>),
    /// In two halves.
    Split(Box<Split<T>>),
}

impl<T: Number> Reduced<T> {
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
