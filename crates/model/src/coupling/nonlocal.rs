//! Low-rank correction for feedback places that also act on elements that do not drive them.
//!
//! Let J be the Newton matrix without these places, and let f_k = ∂F/∂g_k and ∇g_k be the vectors of place k. To solve
//! the system (J + Σ f_k ∇g_kᵀ) x = b, systems with J are solved for b and for each f_k (Sherman, Morrison, Woodbury):
//!
//! ```text
//! J x⁰ = b,    J X_k = f_k,    (I + (∇g_iᵀ X_k)) γ = (∇g_iᵀ x⁰),    x = x⁰ − Σ γ_k X_k.
//! ```
//!
//! Each such place costs one additional solve per matrix setup and one stored vector.

use myovib_dae::{Problem, StepError};
use myovib_sparse::Scalar;
use nalgebra::{ComplexField, DMatrix, DVector, Dyn, LU};

use super::feedback::FeedbackDae;

/// The correction for one value of c.
#[derive(Debug)]
pub(super) struct NonlocalElimination<T: ComplexField> {
    places: Vec<usize>,
    /// X_k.
    responses: Vec<Vec<T>>,
    /// I + (∇g_iᵀ X_k).
    small: Option<LU<T, Dyn, Dyn>>,
}

impl<T: ComplexField> Default for NonlocalElimination<T> {
    fn default() -> Self {
        Self { places: Vec::new(), responses: Vec::new(), small: None }
    }
}

impl<T: Scalar + ComplexField> NonlocalElimination<T> {
    /// Computes the correction at the current linearization for the places with the indices `places`. `solve` solves
    /// systems with J in place.
    pub(super) fn new(
        places: &[usize],
        dae: &mut FeedbackDae,
        mut solve: impl FnMut(&mut FeedbackDae, &mut [T]) -> Result<(), StepError>,
    ) -> Result<Self, StepError> {
        if places.is_empty() {
            return Ok(Self::default());
        }
        let momentum = dae.one_way().body().layout().momentum();
        let mut responses = Vec::new();
        for &number in places {
            let mut x = vec![T::zero(); dae.n_unknowns()];
            let place = &dae.places()[number];
            for (&row, &force) in place.rows.iter().zip(&place.force) {
                x[momentum.start + row] = T::one() * force;
            }
            solve(dae, &mut x)?;
            responses.push(x);
        }
        let n = places.len();
        let mut small = DMatrix::identity(n, n);
        for (k, response) in responses.iter().enumerate() {
            for (i, gain) in gains(places, dae, response).enumerate() {
                small[(i, k)] += gain;
            }
        }
        Ok(Self { places: places.to_vec(), responses, small: Some(small.lu()) })
    }

    /// Replaces the solution of the system with J by the solution of the corrected system.
    pub(super) fn correct(&self, dae: &FeedbackDae, x: &mut [T]) -> Result<(), StepError> {
        let Some(small) = &self.small else {
            return Ok(());
        };
        let alone: Vec<T> = gains(&self.places, dae, x).collect();
        let Some(changes) = small.solve(&DVector::from_vec(alone)) else {
            let message = "the coupled Schur complement of body and oscillators is singular";
            return Err(StepError::Recoverable(message.to_owned()));
        };
        for (response, &change) in self.responses.iter().zip(changes.iter()) {
            for (x, &response) in x.iter_mut().zip(response) {
                *x -= change * response;
            }
        }
        Ok(())
    }
}

/// Returns ∇gᵀ x of each of the `places`.
fn gains<T: Scalar>(places: &[usize], dae: &FeedbackDae, x: &[T]) -> impl Iterator<Item = T> {
    places.iter().map(move |&number| {
        let place = &dae.places()[number];
        let network = dae.feedbacks()[place.feedback].network;
        place.along(&x[dae.one_way().range(network)])
    })
}
