//! Internal stresses of Prony terms, eliminated point by point.
//!
//! They occur in the balance of momentum and in their own rows alone, one beside the other:
//!
//! ```text
//! (c + 1/τ) δQ − g/τ δS = b_Q,        momentum: … − ∂/∂q ∫F δQ:∇φ = b.
//! ```
//!
//! So δQ = (g δS + τ b_Q)/(1 + cτ): the material part of the stiffness is multiplied by
//! φ(c) − 1 ([`Series`]), ∫F τ b_Q/(1 + cτ):∇φ goes to the right-hand side, and once δq is known δS
//! gives δQ. There is nothing more to factorise or solve; a solve takes two passes over the elements
//! (three for complex c).

use std::ops::Range;

use myovib_fem::RelaxingPart;
use myovib_fem::material::Prony;
use num_complex::Complex64;

use super::Number;
use crate::field::Field;
use crate::matrix::Matrix;
use crate::muscle_dae::MuscleDae;

/// The Prony terms of the relaxing parts of a body.
#[derive(Debug, Clone)]
pub(super) struct Series(Vec<Prony>);

impl Series {
    pub(super) fn of(dae: &MuscleDae) -> Self {
        let parts = dae.muscle().solid.relaxing_parts().iter();
        Self(parts.map(|part| part.prony.clone()).collect())
    }

    /// What a matrix is multiplied by when internal stresses are eliminated: φ(c) − 1 for the
    /// stiffness of a stress that relaxes, one for all others.
    pub(super) fn factor<T: Number>(&self, matrix: Matrix, c: T) -> T {
        match matrix {
            Matrix::RelaxingStiffness(k) => self.0[k].tangent_factor(c) - T::one(),
            _ => T::one(),
        }
    }
}

/// A number by its real parts, as the element passes take it.
pub(super) trait Parts: Number {
    /// How many there are.
    const COUNT: usize;

    fn part(self, k: usize) -> f64;

    /// The number with `x` in the place of part `k`, the others being zero.
    fn of_part(k: usize, x: f64) -> Self;
}

impl Parts for f64 {
    const COUNT: usize = 1;

    fn part(self, _: usize) -> f64 {
        self
    }

    fn of_part(_: usize, x: f64) -> Self {
        x
    }
}

impl Parts for Complex64 {
    const COUNT: usize = 2;

    fn part(self, k: usize) -> f64 {
        if k == 0 { self.re } else { self.im }
    }

    fn of_part(k: usize, x: f64) -> Self {
        if k == 0 { x.into() } else { Self::new(0.0, x) }
    }
}

/// Where the internal stresses lie, and room for the passes.
#[derive(Debug)]
pub(super) struct Relaxation {
    internal: Range<usize>,
    momentum: Range<usize>,
    displacement: Range<usize>,
    /// For the parts of a complex number.
    slots: [Vec<f64>; 2],
    nodal: [Vec<f64>; 2],
    free: Vec<f64>,
}

impl Relaxation {
    /// The elimination for `dae`, if it has internal stresses.
    pub(super) fn new(dae: &MuscleDae) -> Option<Self> {
        let internal = dae.layout().range(Field::InternalStress)?;
        let range = |field| {
            let range = dae.layout().range(field);
            range.expect("all formulations have q and v")
        };
        let solid = &dae.muscle().solid;
        Some(Self {
            internal,
            momentum: range(Field::Velocity),
            displacement: range(Field::Displacement),
            slots: [(); 2].map(|()| vec![0.0; solid.n_slots()]),
            nodal: [(); 2].map(|()| vec![0.0; solid.dofs().n_full()]),
            free: vec![0.0; solid.dofs().n_free()],
        })
    }

    /// Takes what the right-hand sides of the internal stresses do to the balance of momentum.
    pub(super) fn condense<T: Parts>(&mut self, dae: &mut MuscleDae, c: T, rhs: &mut [T]) {
        dae.counters_mut().relaxing_solve_passes += T::COUNT as u64;
        let solid = &dae.muscle().solid;
        let own = &rhs[self.internal.clone()];
        let slots = &mut self.slots[..T::COUNT];
        slots.iter_mut().for_each(|slots| slots.fill(0.0));
        for part in solid.relaxing_parts() {
            for (term, b) in part.prony.terms().iter().zip(terms(part, own)) {
                let scale = term.lagging(c, T::one());
                for (k, slots) in slots.iter_mut().enumerate() {
                    for (slot, &b) in slots[part.slots.clone()].iter_mut().zip(b) {
                        *slot += (scale * b).part(k);
                    }
                }
            }
        }
        for (k, (slots, nodal)) in slots.iter().zip(&mut self.nodal).enumerate() {
            nodal.fill(0.0);
            solid.force_of_tensors(dae.relaxing_at(), slots, nodal);
            solid.dofs().restrict(nodal, &mut self.free);
            for (row, &force) in rhs[self.momentum.clone()].iter_mut().zip(&self.free) {
                *row += T::of_part(k, force);
            }
        }
    }

    /// Replaces the right-hand sides of the internal stresses by the solution, that of the
    /// displacements being known.
    pub(super) fn recover<T: Parts>(&mut self, dae: &mut MuscleDae, c: T, rhs: &mut [T]) {
        dae.counters_mut().relaxing_solve_passes += 1;
        let solid = &dae.muscle().solid;
        let (before, own) = rhs.split_at_mut(self.internal.start);
        let own = &mut own[..self.internal.len()];
        let (slots, nodal) = (&mut self.slots[..T::COUNT], &mut self.nodal[..T::COUNT]);
        for (k, nodal) in nodal.iter_mut().enumerate() {
            let moved = &before[self.displacement.clone()];
            for (free, moved) in self.free.iter_mut().zip(moved) {
                *free = moved.part(k);
            }
            nodal.fill(0.0);
            solid.dofs().expand(&self.free, nodal);
        }
        solid.relaxing_stress_rates(dae.relaxing_at(), nodal, slots);
        for part in solid.relaxing_parts() {
            for (term, states) in part.prony.terms().iter().zip(terms_mut(part, own)) {
                let lagging = term.lagging(c, T::one());
                let driven = term.update(c, T::one(), T::zero());
                for (state, slot) in states.iter_mut().zip(part.slots.clone()) {
                    let mut stress = T::zero();
                    for (k, slots) in slots.iter().enumerate() {
                        stress += T::of_part(k, slots[slot]);
                    }
                    *state = lagging * *state + driven * stress;
                }
            }
        }
    }
}

/// What a part has in `own`, term by term.
fn terms<'s, T>(part: &RelaxingPart, own: &'s [T]) -> impl Iterator<Item = &'s [T]> + use<'s, T> {
    own[part.states.clone()].chunks(part.slots.len())
}

fn terms_mut<'s, T>(
    part: &RelaxingPart,
    own: &'s mut [T],
) -> impl Iterator<Item = &'s mut [T]> + use<'s, T> {
    own[part.states.clone()].chunks_mut(part.slots.len())
}
