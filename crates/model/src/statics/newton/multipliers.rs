//! Augmented Lagrange multipliers of contacts.

use std::ops::ControlFlow;

use super::Newton;
use crate::error::ModelError;

/// Maximum number of updates of multipliers. Each one divides the penetration by about the ratio of the contact stiffness
/// to the stiffness of the body.
const MAX_AUGMENTATIONS: usize = 50;

impl Newton<'_> {
    /// Updates the multipliers of contacts at the equilibrium `x`, and repeats Newton's iteration, until the penetration
    /// vanishes (Uzawa). Returns `None` as [`solve`](Self::solve) does, or if this does not converge.
    pub(in crate::statics) fn augment(
        &mut self,
        mut x: Vec<f64>,
        factor: f64,
        watch: &mut dyn FnMut([usize; 2]) -> ControlFlow<()>,
    ) -> Result<Option<Vec<f64>>, ModelError> {
        let rest = vec![0.0; x.len()];
        for _ in 0..MAX_AUGMENTATIONS {
            self.place(&x[..self.n_free()], factor);
            let (t, u) = (self.t, &self.displacement);
            let mut is_changed = false;
            for i in 0..self.contacts.len() {
                is_changed |= !self.contacts[i].depths().is_empty()
                    && self.contacts.to_mut()[i].update_multipliers(t, factor, u);
            }
            if !is_changed {
                return Ok(Some(x));
            }
            match self.solve(&rest, &x, factor, false, &mut *watch)? {
                Some(next) => x = next,
                None => return Ok(None),
            }
        }
        Ok(None)
    }

    /// Returns the multipliers of all contacts.
    pub(in crate::statics) fn multipliers(&self) -> Vec<Vec<f64>> {
        let contacts = self.contacts.iter();
        contacts.map(|own| own.depths().to_vec()).collect()
    }
}
