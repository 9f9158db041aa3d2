//! Products with the tangents of internal stresses, by passes over the elements.

use std::ops::Range;
use std::slice;

use crate::field::Field;
use crate::muscle_dae::MuscleDae;

/// What internal stresses Q add to ∂F/∂y X + ∂F/∂ẏ Ẋ, beside the matrices of the displacement:
///
/// ```text
/// momentum: −∂/∂q ∫F δQ:∇φ,        their own rows: δQ̇ − (g δS − δQ)/τ
/// ```
#[derive(Debug)]
pub(super) struct RelaxationProduct {
    internal: Range<usize>,
    momentum: Range<usize>,
    displacement: Range<usize>,
    /// δS, and Σ δQ.
    slots: [Vec<f64>; 2],
    nodal: Vec<f64>,
    free: Vec<f64>,
}

impl RelaxationProduct {
    /// That of a muscle with internal stresses.
    pub(super) fn new(dae: &MuscleDae) -> Option<Self> {
        let range = |field| dae.layout().range(field);
        let solid = &dae.muscle().solid;
        Some(Self {
            internal: range(Field::InternalStress)?,
            momentum: range(Field::Velocity)?,
            displacement: range(Field::Displacement)?,
            slots: [(); 2].map(|()| vec![0.0; solid.n_slots()]),
            nodal: vec![0.0; solid.dofs().n_full()],
            free: vec![0.0; solid.dofs().n_free()],
        })
    }

    /// Subtracts it from `out`, all of `n_columns` side by side, with `dae` having the matrices of the
    /// state.
    pub(super) fn subtract(
        &mut self,
        dae: &MuscleDae,
        [x, x_dot]: [&[f64]; 2],
        out: &mut [f64],
        n_columns: usize,
    ) {
        let (solid, at) = (&dae.muscle().solid, dae.relaxing_at());
        let [stresses, sums] = &mut self.slots;
        for column in 0..n_columns {
            let place = |unknown: usize| unknown * n_columns + column;
            for (free, i) in self.free.iter_mut().zip(self.displacement.clone()) {
                *free = x[place(i)];
            }
            self.nodal.fill(0.0);
            solid.dofs().expand(&self.free, &mut self.nodal);
            let moved = slice::from_ref(&self.nodal);
            solid.relaxing_stress_rates(at, moved, slice::from_mut(stresses));
            sums.fill(0.0);
            for part in solid.relaxing_parts() {
                let mut i = self.internal.start + part.states.start;
                for term in part.prony.terms() {
                    for slot in part.slots.clone() {
                        let change = x[place(i)];
                        sums[slot] += change;
                        out[place(i)] -= x_dot[place(i)] - term.rate(stresses[slot], change);
                        i += 1;
                    }
                }
            }
            self.nodal.fill(0.0);
            solid.force_of_tensors(at, sums, &mut self.nodal);
            solid.dofs().restrict(&self.nodal, &mut self.free);
            for (free, i) in self.free.iter().zip(self.momentum.clone()) {
                out[place(i)] += free;
            }
        }
    }
}
