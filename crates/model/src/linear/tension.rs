//! Elimination of the tensions of activation models before the factorization.
//!
//! Ṫ depends only on t and T, so the Newton matrix is block-triangular:
//!
//! ```text
//! (c + |a|) δT = b_T,        body's rows: … + ∂f/∂T δT = b.
//! ```

use std::ops::Range;
use std::sync::Arc;

use nalgebra_sparse::pattern::SparsityPattern;

use super::Scalar;
use crate::field::Field;
use crate::matrix::{Matrix, Term};
use crate::muscle_dae::MuscleDae;

/// Ranges of the tensions and of their forces.
#[derive(Debug)]
pub(super) struct TensionBlock {
    unknowns: Range<usize>,
    momentum: Range<usize>,
    /// Pattern of ∂f/∂T.
    force: SparsityPattern,
}

impl TensionBlock {
    /// Returns the block of `dae`, if it has one.
    pub(super) fn new(dae: &MuscleDae) -> Option<Self> {
        let momentum = dae.layout().range(Field::Velocity);
        Some(Self {
            unknowns: dae.layout().range(Field::Tension)?,
            momentum: momentum.expect("the balance of momentum is in the rows of v"),
            force: dae.pattern_of(Matrix::TensionForce).0.clone(),
        })
    }

    /// Returns the included terms of the equations, each with the block of its rows.
    pub(super) fn included() -> [(Field, Term); 3] {
        let on_tensions = |matrix| Term::value(Field::Tension, matrix, 1.0);
        let rate = Term::rate(Field::Tension, Matrix::TensionIdentity, 1.0);
        [
            (Field::Tension, rate),
            (Field::Tension, on_tensions(Matrix::TensionDecay)),
            (Field::Velocity, on_tensions(Matrix::TensionForce)),
        ]
    }
}

/// The block for one value of c.
#[derive(Debug)]
pub(super) struct Tensions<T> {
    plan: Arc<TensionBlock>,
    /// 1/(c + |a|).
    inverse: Vec<T>,
    force: Vec<f64>,
}

impl<T: Scalar> Tensions<T> {
    pub(super) fn new(plan: Arc<TensionBlock>) -> Self {
        Self {
            inverse: vec![T::zero(); plan.unknowns.len()],
            force: vec![0.0; plan.force.nnz()],
            plan,
        }
    }

    pub(super) fn set_up<'m>(&mut self, c: T, values: impl Fn(Matrix) -> &'m [f64]) {
        for (inverse, &decay) in self.inverse.iter_mut().zip(values(Matrix::TensionDecay)) {
            *inverse = T::one() / (c + T::one() * decay);
        }
        self.force.copy_from_slice(values(Matrix::TensionForce));
    }

    /// Solves for the tensions and subtracts their forces from the right-hand side of the body.
    pub(super) fn solve(&self, rhs: &mut [T]) {
        let plan = &*self.plan;
        for (k, &inverse) in self.inverse.iter().enumerate() {
            let place = plan.unknowns.start + k;
            let tension = rhs[place] * inverse;
            rhs[place] = tension;
            let offsets = plan.force.major_offsets();
            let own = offsets[k]..offsets[k + 1];
            let rows = &plan.force.minor_indices()[own.clone()];
            for (&row, &force) in rows.iter().zip(&self.force[own]) {
                rhs[plan.momentum.start + row] -= tension * force;
            }
        }
    }

    /// Solves for the tensions of the transposed system. The solution for the body must already be known.
    pub(super) fn solve_transposed(&self, rhs: &mut [T]) {
        let plan = &*self.plan;
        for (k, &inverse) in self.inverse.iter().enumerate() {
            let offsets = plan.force.major_offsets();
            let own = offsets[k]..offsets[k + 1];
            let rows = &plan.force.minor_indices()[own.clone()];
            let mut sum = rhs[plan.unknowns.start + k];
            for (&row, &force) in rows.iter().zip(&self.force[own]) {
                sum -= rhs[plan.momentum.start + row] * force;
            }
            rhs[plan.unknowns.start + k] = sum * inverse;
        }
    }
}
