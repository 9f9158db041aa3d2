//! Gathering from and scattering to global vectors for the elements of a part.

use pulp::Simd;

use super::Part;
use crate::simd::lanes::Lanes;

impl<S: Simd, const D: usize, const N: usize, const P: usize> Part<'_, S, D, N, P> {
    /// Returns the local node `index` of each element.
    #[inline(always)]
    fn nodes(&self, index: usize) -> &[usize] {
        &self.batch.nodes[index][self.lanes.clone()]
    }

    /// Gathers the nodal values of a displacement-like field. The result is zero for `None`.
    #[inline(always)]
    pub(crate) fn gather_vector(&self, field: Option<&[f64]>) -> [[Lanes<S>; D]; N] {
        let mut values = [[self.zero(); D]; N];
        if let Some(field) = field {
            for (index, values) in values.iter_mut().enumerate() {
                for (lane, &node) in self.nodes(index).iter().enumerate() {
                    let at_node = &field[D * node..][..D];
                    for (value, at_node) in values.iter_mut().zip(at_node) {
                        value.as_mut_slice()[lane] = *at_node;
                    }
                }
            }
        }
        values
    }

    /// Gathers the values of a pressure-like field. The result is zero for `None`.
    #[inline(always)]
    pub(crate) fn gather_scalar(&self, field: Option<&[f64]>) -> [Lanes<S>; P] {
        let mut values = [self.zero(); P];
        if let Some(field) = field {
            for (pressures, value) in self.batch.pressures.iter().zip(&mut values) {
                let pressures = &pressures[self.lanes.clone()];
                for (lane, &pressure) in value.as_mut_slice().iter_mut().zip(pressures) {
                    *lane = field[pressure];
                }
            }
        }
        values
    }

    /// Gathers the values of the energy's factors at the vertices, if there are any.
    #[inline(always)]
    pub(crate) fn gather_factors(&self, factors: Option<&[f64]>) -> Option<[Lanes<S>; P]> {
        let factors = factors?;
        let mut values = [self.zero(); P];
        for (vertex, value) in values.iter_mut().enumerate() {
            for (lane, factor) in value.as_mut_slice().iter_mut().enumerate() {
                *factor = factors[P * self.element(lane) + vertex];
            }
        }
        Some(values)
    }

    /// Gathers one value per element. Returns `None` if all values are zero.
    #[inline(always)]
    pub(crate) fn gather_element(&self, field: &[f64]) -> Option<Lanes<S>> {
        let mut values = self.zero();
        let mut has_nonzero = false;
        for (lane, value) in values.as_mut_slice().iter_mut().enumerate() {
            *value = field[self.element(lane)];
            has_nonzero |= *value != 0.0;
        }
        has_nonzero.then_some(values)
    }

    /// Adds element vectors to a displacement-like array.
    #[inline(always)]
    pub(crate) fn scatter_vector(&self, local: &[[Lanes<S>; D]; N], field: &mut [f64]) {
        for (lane, l) in self.occupied().enumerate() {
            for (a, (nodes, values)) in self.batch.nodes.iter().zip(local).enumerate() {
                // Only large 3D bodies use element-wise storage.
                let node = match D == 3 && self.element_wise {
                    true => l * N + a,
                    false => nodes[l],
                };
                let entries = &mut field[D * node..][..D];
                for (entry, value) in entries.iter_mut().zip(values) {
                    *entry += value.as_slice()[lane];
                }
            }
        }
    }

    /// Adds element vectors to a pressure-like array.
    #[inline(always)]
    pub(crate) fn scatter_scalar(&self, local: &[Lanes<S>; P], field: &mut [f64]) {
        for (lane, l) in self.occupied().enumerate() {
            for (v, (pressures, values)) in self.batch.pressures.iter().zip(local).enumerate() {
                let vertex = match D == 3 && self.element_wise {
                    true => l * P + v,
                    false => pressures[l],
                };
                field[vertex] += values.as_slice()[lane];
            }
        }
    }
}
