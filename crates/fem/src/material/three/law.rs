//! What a law of three dimensions gives.

use super::super::Real;
use super::strain::Strain3;
use super::tensor::{Symmetric3, Tensor3Of};

/// A material law in three dimensions: energy, stress and tangent without the pressure's part.
///
/// The functions are called on batches: they must not branch on values, and be
/// `#[inline(always)]`, as everything they call here is.
///
/// # Units
/// Energies, stresses and tangents in Pa.
pub trait Law3 {
    /// Whether strains are finite (d = J − 1) or small (d = div u).
    const FINITE: bool = true;

    /// Whether W holds the volume's part too, so that no κ is added.
    const COMPLETE: bool = false;

    /// Whether the law depends on the axes of the fibres.
    const FIBRES: bool = false;

    /// W.
    fn energy<R: Real>(&self, strain: &Strain3<R>) -> R;

    /// ∂W/∂F.
    fn stress<R: Real>(&self, strain: &Strain3<R>) -> Tensor3Of<R>;

    /// ∂²W/∂F².
    fn tangent<R: Real>(&self, strain: &Strain3<R>) -> Symmetric3<R>;
}
