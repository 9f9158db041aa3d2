//! Elimination of the internal stresses of Prony terms at each quadrature point.
//!
//! The internal stresses occur only in the balance of momentum and in their own rows, which are decoupled from each
//! other:
//!
//! ```text
//! (c + 1/τ) δQ − g/τ δS = b_Q,        momentum: … − ∫F δQ:∇φ = b.
//! ```
//!
//! Therefore δQ = (g δS + τ b_Q)/(1 + cτ). The material part of the stiffness is multiplied by φ(c) − 1 ([`Series`]),
//! and ∫F τ b_Q/(1 + cτ):∇φ is added to the right-hand side. Once δq is known, δQ follows from δS. The factorized
//! matrix keeps its size. A solve needs two additional element passes, regardless of the number of right-hand sides.

use std::ops::Range;

use myovib_fem::material::Prony;
use num_complex::Complex64;

use super::Scalar;
use crate::field::Field;
use crate::matrix::Matrix;
use crate::muscle_dae::MuscleDae;

/// Number of stress components at quadrature points processed together for several right-hand sides, so that
/// they stay in cache. A single right-hand side is processed without strides, which allows vector instructions.
const BLOCK: usize = 64;

/// Prony series of the viscoelastic parts of a body.
#[derive(Debug, Clone)]
pub(super) struct Series(Vec<Prony>);

impl Series {
    pub(super) fn of(dae: &MuscleDae) -> Self {
        let parts = dae.muscle().solid.relaxation_regions().iter();
        Self(parts.map(|part| part.prony.clone()).collect())
    }

    /// Returns the factor of a matrix after the internal stresses are eliminated: φ(c) − 1 for the stiffness of a
    /// viscoelastic stress, and 1 for all other matrices.
    pub(super) fn factor<T: Scalar>(&self, matrix: Matrix, c: T) -> T {
        match matrix {
            Matrix::RelaxingStiffness(k) => self.0[k].tangent_factor(c) - T::one(),
            _ => T::one(),
        }
    }
}

/// A real or complex value as a list of real numbers (Re, Im) for the element passes.
pub(super) trait Parts: Scalar {
    /// Number of real numbers.
    const COUNT: usize;

    fn part(self, k: usize) -> f64;

    /// Assembles the value from entry `i` of each vector of parts.
    fn of_parts(parts: &[Vec<f64>], i: usize) -> Self;
}

impl Parts for f64 {
    const COUNT: usize = 1;

    fn part(self, _: usize) -> f64 {
        self
    }

    fn of_parts(parts: &[Vec<f64>], i: usize) -> Self {
        parts[0][i]
    }
}

impl Parts for Complex64 {
    const COUNT: usize = 2;

    fn part(self, k: usize) -> f64 {
        if k == 0 { self.re } else { self.im }
    }

    fn of_parts(parts: &[Vec<f64>], i: usize) -> Self {
        Self::new(parts[0][i], parts[1][i])
    }
}

/// Range of the internal stresses and workspace of the element passes.
#[derive(Debug)]
pub(super) struct Relaxation {
    internal: Range<usize>,
    momentum: Range<usize>,
    displacement: Range<usize>,
    /// One array for each real number of each right-hand side.
    slots: Vec<Vec<f64>>,
    nodal: Vec<Vec<f64>>,
}

impl Relaxation {
    /// Sets up the elimination for `dae`, if it has internal stresses.
    pub(super) fn new(dae: &MuscleDae) -> Option<Self> {
        let internal = dae.layout().range(Field::InternalStress)?;
        let range = |field| {
            let range = dae.layout().range(field);
            range.expect("all formulations have q and v")
        };
        Some(Self {
            internal,
            momentum: range(Field::Velocity),
            displacement: range(Field::Displacement),
            slots: Vec::new(),
            nodal: Vec::new(),
        })
    }

    /// Provides `count` vectors at the quadrature points and `count` zero vectors at the nodes.
    fn workspace(&mut self, dae: &MuscleDae, count: usize) -> [&mut [Vec<f64>]; 2] {
        let solid = &dae.muscle().solid;
        for (vectors, length) in
            [(&mut self.slots, solid.n_slots()), (&mut self.nodal, solid.dofs().n_full())]
        {
            vectors.resize_with(count.max(vectors.len()), || vec![0.0; length]);
        }
        let [slots, nodal] = [&mut self.slots[..count], &mut self.nodal[..count]];
        nodal.iter_mut().for_each(|nodal| nodal.fill(0.0));
        [slots, nodal]
    }

    /// Adds the effect of the internal stresses' right-hand sides to the balance of momentum for
    /// all `n_columns` columns.
    pub(super) fn condense<T: Parts>(
        &mut self,
        dae: &mut MuscleDae,
        c: T,
        rhs: &mut [T],
        n_columns: usize,
    ) {
        dae.counters_mut().relaxing_solve_passes += 1;
        let [internal, momentum] = [&self.internal, &self.momentum].map(|rows| rows.start);
        let [slots, nodal] = self.workspace(dae, n_columns * T::COUNT);
        let solid = &dae.muscle().solid;
        let own = &rhs[internal * n_columns..];
        slots.iter_mut().for_each(|slots| slots.fill(0.0));
        for part in solid.relaxation_regions() {
            let terms = own[part.states.start * n_columns..].chunks(part.slots.len() * n_columns);
            for (term, b) in part.prony.terms().iter().zip(terms) {
                let scale = term.residual_stress(c, T::one());
                let first = part.slots.clone().step_by(BLOCK);
                for (first, b) in first.zip(b.chunks(BLOCK * n_columns)) {
                    for (j, slots) in slots.chunks_mut(T::COUNT).enumerate() {
                        for (k, slots) in slots.iter_mut().enumerate() {
                            let slots = slots[first..].iter_mut();
                            let add = |(slot, &b): (&mut f64, &T)| *slot += (scale * b).part(k);
                            match n_columns {
                                1 => slots.zip(b).for_each(add),
                                _ => slots.zip(b[j..].iter().step_by(n_columns)).for_each(add),
                            }
                        }
                    }
                }
            }
        }
        solid.tensor_forces(dae.relaxing_at(), slots, nodal);
        let rows = rhs[momentum * n_columns..].chunks_mut(n_columns);
        for (row, &i) in rows.zip(solid.dofs().free_to_full()) {
            for (row, nodal) in row.iter_mut().zip(nodal.chunks(T::COUNT)) {
                *row += T::of_parts(nodal, i);
            }
        }
    }

    /// Replaces the right-hand sides of the internal stresses by the solution, using the displacements already in
    /// `rhs`.
    pub(super) fn recover<T: Parts>(
        &mut self,
        dae: &mut MuscleDae,
        c: T,
        rhs: &mut [T],
        n_columns: usize,
    ) {
        dae.counters_mut().relaxing_solve_passes += 1;
        let [internal, displacement] = [&self.internal, &self.displacement].map(|rows| rows.start);
        let [slots, nodal] = self.workspace(dae, n_columns * T::COUNT);
        let solid = &dae.muscle().solid;
        let (before, own) = rhs.split_at_mut(internal * n_columns);
        let moved = before[displacement * n_columns..].chunks(n_columns);
        for (moved, &i) in moved.zip(solid.dofs().free_to_full()) {
            for (nodal, moved) in nodal.chunks_mut(T::COUNT).zip(moved) {
                for (k, nodal) in nodal.iter_mut().enumerate() {
                    nodal[i] = moved.part(k);
                }
            }
        }
        solid.driving_stress_rates(dae.relaxing_at(), nodal, slots);
        for part in solid.relaxation_regions() {
            let terms =
                own[part.states.start * n_columns..].chunks_mut(part.slots.len() * n_columns);
            for (term, states) in part.prony.terms().iter().zip(terms) {
                let residual_stress = term.residual_stress(c, T::one());
                let driven = term.update(c, T::one(), T::zero());
                let first = part.slots.clone().step_by(BLOCK);
                for (first, states) in first.zip(states.chunks_mut(BLOCK * n_columns)) {
                    for (j, slots) in slots.chunks(T::COUNT).enumerate() {
                        let renew = |(slot, state): (usize, &mut T)| {
                            *state = residual_stress * *state + driven * T::of_parts(slots, slot);
                        };
                        let slots = first..;
                        match n_columns {
                            1 => slots.zip(states.iter_mut()).for_each(renew),
                            _ => {
                                slots.zip(states[j..].iter_mut().step_by(n_columns)).for_each(renew)
                            }
                        }
                    }
                }
            }
        }
    }
}
