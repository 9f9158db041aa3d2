//! The condensed Newton matrix for one value of c: setup and solution of the full system.

use std::ops::Range;
use std::sync::Arc;

use myovib_sparse::SparseError;

use super::{Condensation, Elimination, LinearWork, Scalar, SparseSystem};
use crate::matrix::Matrix;
use myovib_sparse::Product;

/// The condensed Newton matrix ∂F/∂y + c ∂F/∂ẏ with its factors and workspace.
///
/// Several real and complex matrices share one [`Condensation`] and one [`Elimination`]. After the first setup,
/// neither setups nor solves for one right-hand side allocate memory.
#[derive(Debug)]
pub struct Condensed<T: Scalar> {
    plan: Arc<Condensation>,
    system: SparseSystem<T>,
    coupling: Vec<T>,
    product: Product,
    c: T,
    /// Right-hand sides of the kinematic equations.
    kinematic: Vec<T>,
    unknowns: Vec<T>,
}

impl<T: Scalar> Condensed<T> {
    /// Allocates the matrix of a `plan` and its factors; `elimination` comes from
    /// [`Condensation::elimination`].
    pub fn new(plan: Arc<Condensation>, elimination: Arc<Elimination>) -> Self {
        let coupling = plan.coupling.pattern();
        Self {
            system: SparseSystem::new(elimination),
            coupling: vec![T::zero(); coupling.nnz()],
            product: Product::new(coupling),
            c: T::zero(),
            kinematic: vec![T::zero(); coupling.major_dim()],
            unknowns: vec![T::zero(); plan.condensed.pattern().major_dim()],
            plan,
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
        self.c = c;
        let plan = &self.plan;
        plan.coupling.combine(|_, p| p.at(c), &values, &mut self.coupling);
        plan.condensed.combine(
            |m, p| p.at(c) * plan.series.factor(m, c),
            &values,
            self.system.values_mut(),
        );
        self.system.renew(work)
    }

    pub(super) fn system(&self) -> &SparseSystem<T> {
        &self.system
    }

    /// Returns the linear system, so that its pivoting history can be restored.
    pub(super) fn system_mut(&mut self) -> &mut SparseSystem<T> {
        &mut self.system
    }

    /// Forgets earlier pivots, so that the next setup does not depend on earlier matrices.
    pub(crate) fn forget_history(&mut self) -> Result<(), SparseError> {
        self.system.forget_pivots();
        self.system.set_history([false, true, false])
    }

    /// Returns the condensed matrix of the last setup, in the order of [`Condensation::pattern`].
    pub fn values(&self) -> &[T] {
        self.system.values()
    }

    /// Solves the full system in place.
    ///
    /// # Shapes
    /// `rhs`: one entry per unknown of the full system.
    pub fn solve(&mut self, rhs: &mut [T], work: &mut LinearWork) -> Result<(), SparseError> {
        self.solve_columns(rhs, 1, work)
    }

    /// Solves the full system in place for several right-hand sides, stored row by row.
    ///
    /// # Shapes
    /// `rhs`: `n_columns` entries per unknown of the full system.
    pub fn solve_columns(
        &mut self,
        rhs: &mut [T],
        n_columns: usize,
        work: &mut LinearWork,
    ) -> Result<(), SparseError> {
        let plan = &self.plan;
        let side_by_side = |rows: &Range<usize>| rows.start * n_columns..rows.end * n_columns;
        let size = |rows: usize| rows * n_columns;
        let (n, n_kinematic) = (plan.n_condensed(), plan.coupling.pattern().major_dim());
        self.unknowns.resize(size(n), T::zero());
        self.kinematic.resize(size(n_kinematic), T::zero());
        for block in &plan.recovered {
            self.kinematic[side_by_side(&block.position)]
                .copy_from_slice(&rhs[side_by_side(&block.rows)]);
        }
        for block in &plan.retained {
            let unknowns = &mut self.unknowns[side_by_side(&block.condensed)];
            for (x, &b) in unknowns.iter_mut().zip(&rhs[side_by_side(&block.rows)]) {
                *x = b * block.sign;
            }
        }
        let (kinematic, unknowns) = (&self.kinematic, &mut self.unknowns);
        self.product.subtract_columns(&self.coupling, kinematic, unknowns, n_columns);
        for block in &plan.retained {
            block.scale_rows(self.c, &mut unknowns[side_by_side(&block.condensed)]);
        }
        match n_columns {
            1 => self.system.solve(unknowns, work)?,
            _ => self.system.solve_columns(unknowns, n_columns, work)?,
        }
        for block in &plan.retained {
            rhs[side_by_side(&block.unknowns)]
                .copy_from_slice(&self.unknowns[side_by_side(&block.condensed)]);
        }
        for block in &plan.recovered {
            let (rate, inverse) = (self.c * block.rate, 1.0 / block.value);
            let bases = &self.unknowns[side_by_side(&block.base)];
            let kinematic = &self.kinematic[side_by_side(&block.position)];
            for ((x, &base), &b) in
                rhs[side_by_side(&block.unknowns)].iter_mut().zip(bases).zip(kinematic)
            {
                *x = (b - rate * base) * inverse;
            }
        }
        Ok(())
    }

    /// Solves with the transpose of the full system (not conjugated) in place. The steps are the transposed steps of
    /// [`solve`](Self::solve) in reverse order.
    ///
    /// # Shapes
    /// `rhs`: one entry per unknown of the full system.
    pub fn solve_transposed(
        &mut self,
        rhs: &mut [T],
        work: &mut LinearWork,
    ) -> Result<(), SparseError> {
        let plan = &self.plan;
        self.unknowns.resize(plan.n_condensed(), T::zero());
        let n_kinematic = plan.coupling.pattern().major_dim();
        self.kinematic.resize(n_kinematic, T::zero());
        for block in &plan.retained {
            self.unknowns[block.condensed.clone()].copy_from_slice(&rhs[block.unknowns.clone()]);
        }
        for block in &plan.recovered {
            let (rate, inverse) = (self.c * block.rate, 1.0 / block.value);
            let bases = &mut self.unknowns[block.base.clone()];
            let kinematic = &mut self.kinematic[block.position.clone()];
            let own = &rhs[block.unknowns.clone()];
            for ((base, k), &b) in bases.iter_mut().zip(kinematic).zip(own) {
                *k = b * inverse;
                *base -= rate * *k;
            }
        }
        self.system.solve_transposed(&mut self.unknowns, work)?;
        for block in &plan.retained {
            block.scale_rows(self.c, &mut self.unknowns[block.condensed.clone()]);
        }
        self.product.subtract_transposed(&self.coupling, &self.unknowns, &mut self.kinematic);
        for block in &plan.retained {
            let unknowns = &self.unknowns[block.condensed.clone()];
            for (x, &u) in rhs[block.rows.clone()].iter_mut().zip(unknowns) {
                *x = u * block.sign;
            }
        }
        for block in &plan.recovered {
            rhs[block.rows.clone()].copy_from_slice(&self.kinematic[block.position.clone()]);
        }
        Ok(())
    }
}
