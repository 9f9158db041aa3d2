//! Input fields of the operators of a [`Solid`](crate::solid::Solid), and buffers for their results.

use crate::element::Barycentric;

/// Volumetric stress added to the material law.
#[derive(Debug, Clone, Copy)]
pub enum Pressure<'a> {
    /// Pressure field, given by its values at the vertices: `P = P_iso − p cof F`. Paper, eq. (20).
    Nodal(&'a [f64]),
    /// Penalty energy κ/2 g(J)² at each point, used instead of a pressure field. Paper, eq. (16).
    Penalty {
        /// Bulk modulus, Pa.
        kappa: f64,
    },
}

/// Fields for which operators are evaluated.
///
/// # Shapes
/// `u` and `v` are interleaved and have length `n_components`, including constrained components. `p`, `p_rate` and
/// `mu` have length `n_pressures`. `factors` has one entry per vertex of each element. A missing `p_rate` or `mu`
/// counts as zero, and missing factors count as one.
#[derive(Debug, Clone, Copy)]
pub struct Fields<'a> {
    /// Displacement.
    pub u: &'a [f64],
    /// Pressure field or penalty.
    pub pressure: Pressure<'a>,
    /// Velocity. It is required for all rates.
    pub v: Option<&'a [f64]>,
    /// Pressure rate.
    pub p_rate: Option<&'a [f64]>,
    /// Multiplier of the velocity constraint in (33).
    pub mu: Option<&'a [f64]>,
    /// Factors by which the energy W is multiplied. They vary linearly in each element and describe a stiffness that
    /// varies in space and time, like E(ξ, t) in the paper. The factors do not affect the volume terms, and rates are
    /// computed with the factors held constant.
    pub factors: Option<&'a [f64]>,
}

impl<'a> Fields<'a> {
    /// Creates fields with displacement and pressure only.
    pub fn new(u: &'a [f64], pressure: Pressure<'a>) -> Self {
        Self { u, pressure, v: None, p_rate: None, mu: None, factors: None }
    }
}

/// Implements access to the `$n` result buffers of a pass, in the order in which they are declared.
macro_rules! slots {
    ($name:ident, $n:literal, $($array:ident),+) => {
        impl $name<'_> {
            pub(crate) fn requested(&self) -> [bool; $n] {
                [$(self.$array.is_some()),+]
            }

            /// Borrows all buffers.
            pub(crate) fn slots(&mut self) -> [Option<&mut [f64]>; $n] {
                [$(self.$array.as_deref_mut()),+]
            }

            pub(crate) fn all_mut(&mut self) -> impl Iterator<Item = &mut [f64]> {
                self.slots().into_iter().flatten()
            }
        }

        impl<'a> From<[Option<&'a mut [f64]>; $n]> for $name<'a> {
            fn from([$($array),+]: [Option<&'a mut [f64]>; $n]) -> Self {
                Self { $($array),+ }
            }
        }
    };
}
pub(crate) use slots;

/// Vectors requested from [`Solid::evaluate`](crate::solid::Solid::evaluate). Each given buffer is overwritten.
#[derive(Debug, Default)]
pub struct Vectors<'a> {
    /// Internal force ∫ P(F, p) : ∇φ; length `n_components`.
    pub force: Option<&'a mut [f64]>,
    /// Force rate ∫ Ṗ : ∇φ with Ṗ = ∂P/∂F : ∇v + ∂P/∂p ṗ; length `n_components`.
    pub force_rate: Option<&'a mut [f64]>,
    /// Volume residual ∫ ψ g(J); length `n_pressures`.
    pub volume_residual: Option<&'a mut [f64]>,
    /// Volume residual rate ∫ ψ cof F : ∇v = B(u) v; length `n_pressures`.
    pub volume_residual_rate: Option<&'a mut [f64]>,
    /// Multiplier force B(u)ᵀ μ = ∫ μ cof F : ∇φ; length `n_components`.
    pub multiplier_force: Option<&'a mut [f64]>,
}

impl Vectors<'_> {
    /// Returns whether a requested result depends on v, ṗ or μ.
    pub(crate) fn has_rates(&self) -> bool {
        self.force_rate.is_some()
            || self.volume_residual_rate.is_some()
            || self.multiplier_force.is_some()
    }
}

slots!(Vectors, 5, force, force_rate, volume_residual, volume_residual_rate, multiplier_force);

/// Tangents requested from [`Solid::tangents`](crate::solid::Solid::tangents). Each given buffer is overwritten
/// with values in the order of its pattern.
#[derive(Debug, Default)]
pub struct Tangents<'a> {
    /// ∂force/∂u, in the displacement pattern.
    pub stiffness: Option<&'a mut [f64]>,
    /// ∂force_rate/∂v, in the displacement pattern. This is the stiffness with the contribution of each element
    /// scaled by its ratio of β.
    pub damped_stiffness: Option<&'a mut [f64]>,
    /// ∂force_rate/∂u, in the displacement pattern.
    pub rate_stiffness: Option<&'a mut [f64]>,
    /// B(u) = ∂volume_residual/∂u, in the divergence pattern.
    pub divergence: Option<&'a mut [f64]>,
    /// ∂(B(u) v)/∂u = ∫ ψ Ṅ : ∇φ with Ṅ = ∂cof F/∂F : ∇v, in the divergence pattern.
    pub divergence_rate: Option<&'a mut [f64]>,
    /// ∂(B(u)ᵀ μ)/∂u, in the displacement pattern.
    pub multiplier_stiffness: Option<&'a mut [f64]>,
}

impl Tangents<'_> {
    /// Returns whether a requested result depends on v, ṗ or μ.
    pub(crate) fn has_rates(&self) -> bool {
        self.rate_stiffness.is_some()
            || self.divergence_rate.is_some()
            || self.multiplier_stiffness.is_some()
    }
}

slots!(
    Tangents,
    6,
    stiffness,
    damped_stiffness,
    rate_stiffness,
    divergence,
    divergence_rate,
    multiplier_stiffness
);

/// Tangent that [`Solid::multiply`](crate::solid::Solid::multiply) applies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TangentProduct {
    /// Coefficient β of force + β force_rate. For β = 0, the product uses only the force.
    pub beta: f64,
    /// Whether the constraint is volume_residual_rate instead of volume_residual.
    pub constraint_rate: bool,
}

impl TangentProduct {
    /// Returns whether the differentiated functions depend on v or ṗ.
    pub(crate) fn has_rates(self) -> bool {
        self.beta > 0.0 || self.constraint_rate
    }
}

/// Direction in which the fields change, and buffers for the resulting changes. The buffers are overwritten.
///
/// # Shapes
/// The lengths are as in [`Fields`]. Missing directions count as zero.
#[derive(Debug)]
pub struct Change<'a> {
    /// Change of the displacement.
    pub u: &'a [f64],
    /// Change of the velocity.
    pub v: Option<&'a [f64]>,
    /// Change of the pressure.
    pub p: Option<&'a [f64]>,
    /// Change of the pressure rate.
    pub p_rate: Option<&'a [f64]>,
    /// Resulting change of force + β force_rate; length `n_components`.
    pub force: &'a mut [f64],
    /// Resulting change of the constraint; length `n_pressures`.
    pub volume_residual: Option<&'a mut [f64]>,
}

/// Error for an inverted element: det F ≤ 0 or NaN at a quadrature point. The stress at this point is undefined.
///
/// An integrator can recover with a smaller step.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("det F = {jacobian:.3e} in element {element} at barycentric coordinates {barycentric}")]
pub struct Inverted {
    /// Index of the element.
    pub element: usize,
    /// Barycentric coordinates of the point.
    pub barycentric: Barycentric,
    /// Value of det F.
    pub jacobian: f64,
}

impl Inverted {
    pub(crate) fn new(element: usize, barycentric: &[f64], jacobian: f64) -> Self {
        Self { element, barycentric: Barycentric::new(barycentric), jacobian }
    }
}
