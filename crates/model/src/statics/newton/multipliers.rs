//! Augmented Lagrange multipliers of contacts.

use std::ops::ControlFlow;

use super::Newton;
use crate::error::ModelError;
use crate::muscle::load::{Contact, set_multipliers};

/// Maximum number of updates of multipliers. If the contact is stiffer than the body, each update divides the
/// penetration by about the ratio of the two stiffnesses.
const MAX_AUGMENTATIONS: usize = 50;
/// Maximum number of halvings of an update if no equilibrium is found after the update.
const HALVINGS: usize = 6;
/// A contact becomes stiffer before the next update if its distance from the obstacle exceeds this fraction of the last
/// distance. Quadratic facets cannot follow a curved obstacle, so some pressures converge slowly.
const SLOW: f64 = 0.5;
/// Factor by which the stiffness of such a contact is multiplied. It is a power of two, so that the given stiffness is
/// restored without rounding errors.
const STIFFENING: f64 = 4.0;
/// Largest stiffness of such a contact, relative to the given stiffness.
const STIFFEST: f64 = 64.0;
/// Smallest penetration of an unloaded body, as a fraction of the facet size, that can prevent convergence.
const OVERLAP: f64 = 0.01;

impl Newton<'_> {
    /// Alternately updates the multipliers of contacts and solves for the equilibrium `x` until no contact penetrates
    /// (Uzawa's method). An update is halved if no equilibrium is found after it. Contacts that converge slowly are
    /// stiffened during the updates. Returns whether the updates converge; if not, `x` and the multipliers belong to
    /// the last equilibrium.
    pub(in crate::statics) fn augment(
        &mut self,
        x: &mut Vec<f64>,
        factor: f64,
        watch: &mut dyn FnMut([usize; 2]) -> ControlFlow<()>,
    ) -> Result<bool, ModelError> {
        let given: Vec<f64> = self.contacts.iter().map(Contact::stiffness).collect();
        let converged = self.update_multipliers(x, factor, &given, watch);
        self.place(&x[..self.n_free()], factor);
        for (i, given) in given.into_iter().enumerate() {
            let stiffness = self.contacts[i].stiffness();
            if stiffness != given {
                let (t, u) = (self.t, &self.displacement);
                self.contacts.to_mut()[i].scale_stiffness(given / stiffness, t, factor, u);
            }
        }
        converged
    }

    fn update_multipliers(
        &mut self,
        x: &mut Vec<f64>,
        factor: f64,
        given: &[f64],
        watch: &mut dyn FnMut([usize; 2]) -> ControlFlow<()>,
    ) -> Result<bool, ModelError> {
        let rest = vec![0.0; x.len()];
        let mut distances = vec![f64::INFINITY; given.len()];
        'updates: for _ in 0..MAX_AUGMENTATIONS {
            self.place(&x[..self.n_free()], factor);
            let (t, u) = (self.t, &self.displacement);
            let mut distant = Vec::new();
            for (i, last) in distances.iter_mut().enumerate() {
                let contact = &self.contacts[i];
                let distance = contact.mean_distance(t, factor, u);
                if contact.depths().is_empty() || distance <= 1.0 {
                    continue;
                }
                if distance > SLOW * *last && contact.stiffness() < STIFFEST * given[i] {
                    self.contacts.to_mut()[i].scale_stiffness(STIFFENING, t, factor, u);
                }
                *last = distance;
                distant.push(i);
            }
            if distant.is_empty() {
                return Ok(true);
            }
            let last = self.multipliers();
            for i in distant {
                self.contacts.to_mut()[i].update_multipliers(t, factor, u);
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

    /// Returns the boundary group of an obstacle that penetrates the unloaded body, and the penetration (m).
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
