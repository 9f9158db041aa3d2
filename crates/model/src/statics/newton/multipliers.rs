//! Augmented Lagrange multipliers of contacts.

use std::ops::ControlFlow;

use super::Newton;
use crate::error::ModelError;
use crate::muscle::load::set_multipliers;

/// Maximum number of updates of multipliers. If the contact is stiffer than the body, each update divides the penetration
/// by about the ratio of both stiffnesses.
const MAX_AUGMENTATIONS: usize = 50;
/// Maximum number of halvings of an update after which the equilibrium is not found.
const HALVINGS: usize = 6;
/// Smallest penetration of an unloaded body, as a fraction of the size of facets, that can prevent convergence.
const OVERLAP: f64 = 0.01;

impl Newton<'_> {
    /// Updates the multipliers of contacts and solves for the equilibrium `x` again, in turn, until no contact penetrates
    /// (method of Uzawa). Updates after which the equilibrium is not found are halved. Returns whether this converges; if
    /// not, `x` and the multipliers belong to the last equilibrium.
    pub(in crate::statics) fn augment(
        &mut self,
        x: &mut Vec<f64>,
        factor: f64,
        watch: &mut dyn FnMut([usize; 2]) -> ControlFlow<()>,
    ) -> Result<bool, ModelError> {
        let rest = vec![0.0; x.len()];
        'updates: for _ in 0..MAX_AUGMENTATIONS {
            self.place(&x[..self.n_free()], factor);
            let (t, u) = (self.t, &self.displacement);
            let last = self.multipliers();
            let mut is_changed = false;
            for i in 0..self.contacts.len() {
                is_changed |= !self.contacts[i].depths().is_empty()
                    && self.contacts.to_mut()[i].update_multipliers(t, factor, u);
            }
            if !is_changed {
                return Ok(true);
            }
            for _ in 0..=HALVINGS {
                if let Some(next) = self.solve(&rest, x, factor, false, &mut *watch)? {
                    *x = next;
                    continue 'updates;
                }
                let mut halved = self.multipliers();
                for (depth, last) in halved.iter_mut().flatten().zip(last.iter().flatten()) {
                    *depth = 0.5 * (*depth + last);
                }
                set_multipliers(self.contacts.to_mut(), halved);
            }
            set_multipliers(self.contacts.to_mut(), last);
            break;
        }
        Ok(false)
    }

    /// Returns the group of an obstacle that enters the unloaded body, and its penetration (m).
    pub(in crate::statics) fn overlap_at_rest(&self) -> Option<(&str, f64)> {
        let rest = vec![0.0; self.displacement.len()];
        let contacts = self.contacts.iter().filter(|contact| !contact.is_driven());
        let overlaps = contacts.filter_map(|contact| {
            let depth = contact.sums(self.t, 0.0, &rest).penetration;
            (depth > OVERLAP * contact.facet_size()).then(|| (contact.group(), depth))
        });
        overlaps.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Returns whether a contact has multipliers.
    pub(in crate::statics) fn has_multipliers(&self) -> bool {
        self.contacts.iter().any(|own| !own.depths().is_empty())
    }

    pub(in crate::statics) fn multipliers(&self) -> Vec<Vec<f64>> {
        let contacts = self.contacts.iter();
        contacts.map(|own| own.depths().to_vec()).collect()
    }
}
