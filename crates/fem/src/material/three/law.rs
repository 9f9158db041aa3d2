//! Interface of three-dimensional laws.

use super::super::Real;
use super::strain::Strain3;
use super::tensor::{Symmetric3, Tensor3Of};

/// Material law in 3D: energy, stress and tangent without the pressure term.
///
/// The functions are evaluated with vector registers. Therefore these functions and all functions that they call
/// must be `#[inline(always)]` and must not branch on values.
///
/// # Units
/// Energies, stresses and tangents are in Pa.
pub trait Law3 {
    /// Whether strains are finite (d = J − 1) or small (d = div u).
    const FINITE: bool = true;

    /// Whether W includes the volumetric part, so that κ is not added.
    const COMPLETE: bool = false;

    /// Whether the law depends on the fiber axes. If `false`, a body ignores its fibers.
    const FIBERS: bool;

    /// Returns W.
    fn energy<R: Real>(&self, strain: &Strain3<R>) -> R;

    /// Returns ∂W/∂F.
    fn stress<R: Real>(&self, strain: &Strain3<R>) -> Tensor3Of<R>;

    /// Returns ∂²W/∂F².
    fn tangent<R: Real>(&self, strain: &Strain3<R>) -> Symmetric3<R>;
}
