//! The two halves of a stabilized Newton system for one c: set up, and solved one after the other.

use std::sync::Arc;

use myovib_sparse::SparseError;

use super::splitting::Source;
use super::{Elimination, LinearWork, Scalar, SparseSystem, Splitting};
use crate::matrix::Matrix;
use myovib_sparse::Product;

/// The Newton matrix ∂F/∂y + c ∂F/∂ẏ of (33) as two saddle problems, their factors and workspace.
///
/// Several of them, real and complex, can share one [`Splitting`]. After the first set-up neither a
/// set-up nor a solve allocates.
#[derive(Debug)]
pub struct Split<T: Scalar> {
    plan: Arc<Splitting>,
    motion: SparseSystem<T>,
    velocity: SparseSystem<T>,
    passed_on: Vec<T>,
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
    /// Room for both matrices of a `plan` and their factors; `eliminations` are those of
    /// [`Splitting::eliminations`].
    pub fn new(plan: Arc<Splitting>, eliminations: [Arc<Elimination>; 2]) -> Self {
        let n = plan.motion.pattern().major_dim();
        let passed_on = plan.passed_on.pattern();
        let [motion, velocity] = eliminations.map(SparseSystem::new);
        Self {
            motion,
            velocity,
            passed_on: vec![T::zero(); passed_on.nnz()],
            product: Product::new(passed_on),
            s: T::zero(),
            source: Source::Momentum,
            first: vec![T::zero(); n],
            second: vec![T::zero(); n],
            plan,
        }
    }

    /// The linear systems that are solved.
    pub(super) fn systems(&self) -> [&SparseSystem<T>; 2] {
        [&self.motion, &self.velocity]
    }

    /// The same, to be told of their past.
    pub(super) fn systems_mut(&mut self) -> [&mut SparseSystem<T>; 2] {
        [&mut self.motion, &mut self.velocity]
    }

    /// Forms and factorises both matrices for `c` from the `values` of the muscle's matrices.
    ///
    /// # Errors
    /// [`SparseError::Singular`] and others of the factorisation.
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
        plan.motion
            .combine(|m, p| p.at(c) * plan.series.factor(m, c), &values, to);
        let to = self.velocity.values_mut();
        plan.velocity.combine(|_, p| p.at(c), &values, to);
        let to = &mut self.passed_on;
        let source = self.source;
        plan.passed_on.combine(
            |m, p| p.at(c, source) * plan.series.factor(m, c),
            &values,
            to,
        );
        self.motion.renew(work)?;
        self.velocity.renew(work)
    }

    /// Solves the full system in place.
    ///
    /// # Shapes
    /// `rhs`: the unknowns of the full system.
    ///
    /// # Errors
    /// Those of the solves.
    pub fn solve(&mut self, rhs: &mut [T], work: &mut LinearWork) -> Result<(), SparseError> {
        let (plan, s) = (&self.plan, self.s);
        let places = &plan.places;
        let n_q = places.q.len();

        let (b_q, b_v) = (&rhs[places.q.clone()], &rhs[places.v.clone()]);
        for ((x, &b_v), &b_q) in self.first.iter_mut().zip(b_v).zip(b_q) {
            *x = b_v + s * b_q;
        }
        for (x, &b_mu) in self.first[n_q..].iter_mut().zip(&rhs[places.mu.clone()]) {
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
        self.second[n_q..].copy_from_slice(&rhs[places.lambda.clone()]);
        let (q, difference) = self.first.split_at(n_q);
        self.product.subtract(&self.passed_on, q, &mut self.second);
        for x in &mut self.second[n_q..] {
            *x = -(s * *x);
        }
        self.velocity.solve(&mut self.second, work)?;

        let inverse = T::one() / s;
        let (v, multiplier) = self.second.split_at(n_q);
        rhs[places.q.clone()].copy_from_slice(q);
        for (x, &v) in rhs[places.v.clone()].iter_mut().zip(v) {
            *x = v * inverse;
        }
        for (i, (&found, &difference)) in multiplier.iter().zip(difference).enumerate() {
            let (lambda, mu) = match self.source {
                Source::Momentum => (found, found - difference),
                Source::Kinematic => (found + difference, found),
            };
            rhs[places.lambda.start + i] = lambda;
            rhs[places.mu.start + i] = mu * inverse;
        }
        Ok(())
    }

    /// Solves with the transpose of the full system (not conjugated) in place: the steps of
    /// [`solve`](Self::solve), transposed, from the last to the first.
    ///
    /// # Shapes
    /// `rhs`: the unknowns of the full system.
    ///
    /// # Errors
    /// Those of the solves.
    pub fn solve_transposed(
        &mut self,
        rhs: &mut [T],
        work: &mut LinearWork,
    ) -> Result<(), SparseError> {
        let (plan, s) = (&self.plan, self.s);
        let (places, inverse) = (&plan.places, T::one() / s);
        let n_q = places.q.len();
        self.first[..n_q].copy_from_slice(&rhs[places.q.clone()]);
        for (x, &v) in self.second.iter_mut().zip(&rhs[places.v.clone()]) {
            *x = v * inverse;
        }
        for i in 0..places.mu.len() {
            let (of_lambda, of_mu) = (
                rhs[places.lambda.start + i],
                rhs[places.mu.start + i] * inverse,
            );
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
        self.product
            .subtract_transposed(&self.passed_on, &self.second, to_q);
        self.motion.solve_transposed(&mut self.first, work)?;

        rhs[places.lambda.clone()].copy_from_slice(&self.second[n_q..]);
        for (x, &mu) in rhs[places.mu.clone()].iter_mut().zip(&self.first[n_q..]) {
            *x = -mu;
        }
        for i in 0..n_q {
            let (motion, velocity) = (self.first[i], self.second[i]);
            let (of_v, of_q) = match self.source {
                Source::Momentum => (motion + velocity, s * motion),
                Source::Kinematic => (motion, s * motion - s * velocity),
            };
            rhs[places.v.start + i] = of_v;
            rhs[places.q.start + i] = of_q;
        }
        Ok(())
    }
}
