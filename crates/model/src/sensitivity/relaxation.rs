//! Products with the tangents of internal stresses, computed by element passes.

use std::ops::Range;

use crate::field::Field;
use crate::muscle_dae::MuscleDae;

/// Contribution of the internal stresses Q to ∂F/∂y X + ∂F/∂ẏ Ẋ, in addition to the contribution of the displacement
/// matrices:
///
/// ```text
/// momentum: −∫F δQ:∇φ,        their own rows: δQ̇ − (g δS − δQ)/τ
/// ```
#[derive(Debug)]
pub(super) struct RelaxationProduct {
    internal: Range<usize>,
    momentum: Range<usize>,
    displacement: Range<usize>,
    /// δS for each column, and Σ δQ.
    slots: [Vec<Vec<f64>>; 2],
    nodal: Vec<Vec<f64>>,
}

impl RelaxationProduct {
    /// Creates the product for a muscle with internal stresses; `None` for other muscles.
    pub(super) fn new(dae: &MuscleDae) -> Option<Self> {
        let range = |field| dae.layout().range(field);
        Some(Self {
            internal: range(Field::InternalStress)?,
            momentum: range(Field::Velocity)?,
            displacement: range(Field::Displacement)?,
            slots: Default::default(),
            nodal: Vec::new(),
        })
    }

    /// Subtracts the product from `out` for `n_columns` columns, which are stored row by row. `dae` must contain the
    /// matrices of the state.
    pub(super) fn subtract(
        &mut self,
        dae: &MuscleDae,
        [x, x_dot]: [&[f64]; 2],
        out: &mut [f64],
        n_columns: usize,
    ) {
        let (solid, at) = (&dae.muscle().solid, dae.relaxing_at());
        let [stresses, sums] = &mut self.slots;
        for slots in [&mut *stresses, sums] {
            slots.resize_with(n_columns, || vec![0.0; solid.n_slots()]);
        }
        let nodal = || vec![0.0; solid.dofs().n_full()];
        self.nodal.resize_with(n_columns, nodal);
        let free = solid.dofs().free_to_full();
        let moved = x[self.displacement.start * n_columns..].chunks(n_columns);
        for (&i, moved) in free.iter().zip(moved) {
            for (nodal, moved) in self.nodal.iter_mut().zip(moved) {
                nodal[i] = *moved;
            }
        }
        solid.driving_stress_rates(at, &self.nodal, stresses);
        sums.iter_mut().for_each(|sums| sums.fill(0.0));
        for part in solid.relaxation_regions() {
            let mut row = (self.internal.start + part.states.start) * n_columns;
            for term in part.prony.terms() {
                for slot in part.slots.clone() {
                    let own = row..row + n_columns;
                    let changes = x[own.clone()].iter().zip(&x_dot[own.clone()]);
                    let sums = stresses.iter().zip(&mut *sums);
                    for ((out, (change, rate)), (stresses, sums)) in
                        out[own].iter_mut().zip(changes).zip(sums)
                    {
                        sums[slot] += change;
                        *out -= rate - term.rate(stresses[slot], *change);
                    }
                    row += n_columns;
                }
            }
        }
        self.nodal.iter_mut().for_each(|nodal| nodal.fill(0.0));
        solid.tensor_forces(at, sums, &mut self.nodal);
        let forces = out[self.momentum.start * n_columns..].chunks_mut(n_columns);
        for (&i, out) in free.iter().zip(forces) {
            for (out, nodal) in out.iter_mut().zip(&self.nodal) {
                *out += nodal[i];
            }
        }
        // Fixed nodes do not move.
        self.nodal.iter_mut().for_each(|nodal| nodal.fill(0.0));
    }
}
