//! The two parts of a stabilized Newton system for one value of c: setup and successive solution.

use std::sync::Arc;

use myovib_sparse::SparseError;

use super::splitting::Source;
use super::{Elimination, LinearWork, Scalar, SparseSystem, Splitting};
use crate::matrix::Matrix;
use myovib_sparse::Product;

/// The Newton matrix ∂F/∂y + c ∂F/∂ẏ of (33) as two saddle-point problems with factors and
/// workspace.
///
/// Several real and complex matrices can share one [`Splitting`]. After the first setup, neither setups nor solves
/// allocate memory.
#[derive(Debug)]
pub struct Split<T: Scalar> {
    plan: Arc<Splitting>,
    motion: SparseSystem<T>,
    velocity: SparseSystem<T>,
    transferred: Vec<T>,
    product: Product,
    /// c + α.
    s: T,
    source: Source,
    /// (δq, λ').
    first: Vec<T>,
    /// s δv and s δμ or δλ.
    second: Vec<T>,
}

impl<T: Scalar> Split<T> {
    /// Allocates both matrices of a `plan` and their factors; `eliminations` come from
    /// `Splitting::eliminations`.
    pub fn new(plan: Arc<Splitting>, eliminations: [Arc<Elimination>; 2]) -> Self {
        let n = plan.motion.pattern().major_dim();
        let transferred = plan.transferred.pattern();
        let [motion, velocity] = eliminations.map(SparseSystem::new);
        Self {
            motion,
            velocity,
            transferred: vec![T::zero(); transferred.nnz()],
            product: Product::new(transferred),
            s: T::zero(),
            source: Source::Momentum,
            first: vec![T::zero(); n],
            second: vec![T::zero(); n],
            plan,
        }
    }

    pub(super) fn systems(&self) -> [&SparseSystem<T>; 2] {
        [&self.motion, &self.velocity]
    }

    /// Returns the linear systems, so that their pivoting history can be restored.
    pub(super) fn systems_mut(&mut self) -> [&mut SparseSystem<T>; 2] {
        [&mut self.motion, &mut self.velocity]
    }

    /// Assembles and factorizes both matrices for `c` from the `values` of the muscle's matrices.
    ///
    /// # Errors
    /// Returns [`SparseError::Singular`] or other errors of the factorization.
    pub fn set_up<'m>(
        &mut self,
        c: T,
        values: impl Fn(Matrix) -> &'m [f64],
        work: &mut LinearWork,
    ) -> Result<(), SparseError> {
        let plan = &self.plan;
        self.s = c + T::one() * plan.alpha;
        let largest = |matrix| {
            let entries = values(matrix).iter();
            entries.fold(0.0, |max, entry| f64::max(max, entry.abs()))
        };
        let inertia = (self.s * c).abs() * largest(Matrix::Mass);
        self.source = match inertia > largest(Matrix::Stiffness) {
            true => Source::Momentum,
            false => Source::Kinematic,
        };
        let to = self.motion.values_mut();
        plan.motion.combine(|m, p| p.at(c) * plan.series.factor(m, c), &values, to);
        let to = self.velocity.values_mut();
        plan.velocity.combine(|_, p| p.at(c), &values, to);
        let to = &mut self.transferred;
        let source = self.source;
        plan.transferred.combine(|m, p| p.at(c, source) * plan.series.factor(m, c), &values, to);
        self.motion.renew(work)?;
        self.velocity.renew(work)
    }

    /// Solves the full system in place.
    ///
    /// # Shapes
    /// `rhs`: one entry per unknown of the full system.
    pub fn solve(&mut self, rhs: &mut [T], work: &mut LinearWork) -> Result<(), SparseError> {
        let (plan, s) = (&self.plan, self.s);
        let ranges = &plan.ranges;
        let n_q = ranges.q.len();

        let (b_q, b_v) = (&rhs[ranges.q.clone()], &rhs[ranges.v.clone()]);
        for ((x, &b_v), &b_q) in self.first.iter_mut().zip(b_v).zip(b_q) {
            *x = b_v + s * b_q;
        }
        for (x, &b_mu) in self.first[n_q..].iter_mut().zip(&rhs[ranges.mu.clone()]) {
            *x = -b_mu;
        }
        self.motion.solve(&mut self.first, work)?;

        match self.source {
            Source::Momentum => self.second[..n_q].copy_from_slice(b_v),
            Source::Kinematic => {
                for (x, &b_q) in self.second.iter_mut().zip(b_q) {
                    *x = T::zero() - s * b_q;
                }
            }
        }
        self.second[n_q..].copy_from_slice(&rhs[ranges.lambda.clone()]);
        let (q, difference) = self.first.split_at(n_q);
        self.product.subtract(&self.transferred, q, &mut self.second);
        for x in &mut self.second[n_q..] {
            *x = -(s * *x);
        }
        self.velocity.solve(&mut self.second, work)?;

        let inverse = T::one() / s;
        let (v, multiplier) = self.second.split_at(n_q);
        rhs[ranges.q.clone()].copy_from_slice(q);
        for (x, &v) in rhs[ranges.v.clone()].iter_mut().zip(v) {
            *x = v * inverse;
        }
        for (i, (&found, &difference)) in multiplier.iter().zip(difference).enumerate() {
            let (lambda, mu) = match self.source {
                Source::Momentum => (found, found - difference),
                Source::Kinematic => (found + difference, found),
            };
            rhs[ranges.lambda.start + i] = lambda;
            rhs[ranges.mu.start + i] = mu * inverse;
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
        let (plan, s) = (&self.plan, self.s);
        let (ranges, inverse) = (&plan.ranges, T::one() / s);
        let n_q = ranges.q.len();
        self.first[..n_q].copy_from_slice(&rhs[ranges.q.clone()]);
        for (x, &v) in self.second.iter_mut().zip(&rhs[ranges.v.clone()]) {
            *x = v * inverse;
        }
        for i in 0..ranges.mu.len() {
            let (of_lambda, of_mu) =
                (rhs[ranges.lambda.start + i], rhs[ranges.mu.start + i] * inverse);
            self.second[n_q + i] = of_lambda + of_mu;
            self.first[n_q + i] = match self.source {
                Source::Momentum => -of_mu,
                Source::Kinematic => of_lambda,
            };
        }
        self.velocity.solve_transposed(&mut self.second, work)?;
        for x in &mut self.second[n_q..] {
            *x = -(s * *x);
        }
        let (to_q, _) = self.first.split_at_mut(n_q);
        self.product.subtract_transposed(&self.transferred, &self.second, to_q);
        self.motion.solve_transposed(&mut self.first, work)?;

        rhs[ranges.lambda.clone()].copy_from_slice(&self.second[n_q..]);
        for (x, &mu) in rhs[ranges.mu.clone()].iter_mut().zip(&self.first[n_q..]) {
            *x = -mu;
        }
        for i in 0..n_q {
            let (motion, velocity) = (self.first[i], self.second[i]);
            let (of_v, of_q) = match self.source {
                Source::Momentum => (motion + velocity, s * motion),
                Source::Kinematic => (motion, s * motion - s * velocity),
            };
            rhs[ranges.v.start + i] = of_v;
            rhs[ranges.q.start + i] = of_q;
        }
        Ok(())
    }
}
