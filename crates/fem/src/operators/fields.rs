//! What the operators of a [`Solid`](crate::solid::Solid) are evaluated at, and where results go.

use crate::element::Barycentric;

/// What acts on the volume besides the material law.
#[derive(Debug, Clone, Copy)]
pub enum Pressure<'a> {
    /// A pressure field by its vertex values: `P = P_iso − p cof F`. Paper: eq. (20).
    Nodal(&'a [f64]),
    /// No pressure field: the energy κ/2 (J − 1)² pointwise. Paper: eq. (16).
    Penalty {
        /// Bulk modulus, Pa.
        kappa: f64,
    },
}

/// The fields at which operators are evaluated.
///
/// # Shapes
/// `u`, `v`: `n_components`, interleaved, constrained components included. `p`, `p_rate`, `mu`:
/// `n_pressures`. `factors`: one at each vertex of each element. A `p_rate` or `mu` not given
/// counts as zero, factors not given as one.
#[derive(Debug, Clone, Copy)]
pub struct Fields<'a> {
    /// Displacement.
    pub u: &'a [f64],
    /// Pressure, or what replaces it.
    pub pressure: Pressure<'a>,
    /// Velocity; needed by all rates.
    pub v: Option<&'a [f64]>,
    /// Rate of the pressure.
    pub p_rate: Option<&'a [f64]>,
    /// Multiplier of the velocity constraint, as in (33).
    pub mu: Option<&'a [f64]>,
    /// Factors of the law's energy W, linear in each element: a stiffness that varies in space and
    /// time, as the paper's E(ξ, t). They leave the volume terms alone, and rates are those at
    /// fixed factors.
    pub factors: Option<&'a [f64]>,
}

impl<'a> Fields<'a> {
    /// Displacement and pressure, nothing else.
    pub fn new(u: &'a [f64], pressure: Pressure<'a>) -> Self {
        Self {
            u,
            pressure,
            v: None,
            p_rate: None,
            mu: None,
            factors: None,
        }
    }
}

/// What a pass needs of the arrays wanted from it, `$n` of them, all in the order of their declaration.
macro_rules! slots {
    ($name:ident, $n:literal, $($array:ident),+) => {
        impl $name<'_> {
            /// Which are wanted.
            pub(crate) fn wanted(&self) -> [bool; $n] {
                [$(self.$array.is_some()),+]
            }

            /// All of them, lent.
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

/// The vectors wanted from [`Solid::evaluate`](crate::solid::Solid::evaluate); each that is given
/// is overwritten.
#[derive(Debug, Default)]
pub struct Vectors<'a> {
    /// ∫ P(F, p) : ∇φ; `n_components`.
    pub force: Option<&'a mut [f64]>,
    /// ∫ Ṗ : ∇φ with Ṗ = ∂P/∂F : ∇v + ∂P/∂p ṗ; `n_components`.
    pub force_rate: Option<&'a mut [f64]>,
    /// ∫ ψ (J − 1); `n_pressures`.
    pub defect: Option<&'a mut [f64]>,
    /// ∫ ψ cof F : ∇v = B(u) v; `n_pressures`.
    pub defect_rate: Option<&'a mut [f64]>,
    /// B(u)ᵀ μ = ∫ μ cof F : ∇φ; `n_components`.
    pub multiplier_force: Option<&'a mut [f64]>,
}

impl Vectors<'_> {
    /// Whether anything is wanted that depends on v, ṗ or μ.
    pub(crate) fn has_rates(&self) -> bool {
        self.force_rate.is_some() || self.defect_rate.is_some() || self.multiplier_force.is_some()
    }
}

slots!(
    Vectors,
    5,
    force,
    force_rate,
    defect,
    defect_rate,
    multiplier_force
);

/// The tangents wanted from [`Solid::tangents`](crate::solid::Solid::tangents); each that is given
/// is overwritten with values in the order of its pattern.
#[derive(Debug, Default)]
pub struct Tangents<'a> {
    /// ∂force/∂u; displacement pattern.
    pub stiffness: Option<&'a mut [f64]>,
    /// ∂force_rate/∂v, the stiffness with each element's multiplied by its ratio of β; displacement
    /// pattern.
    pub damped_stiffness: Option<&'a mut [f64]>,
    /// ∂force_rate/∂u; displacement pattern.
    pub rate_stiffness: Option<&'a mut [f64]>,
    /// B(u) = ∂defect/∂u; divergence pattern.
    pub divergence: Option<&'a mut [f64]>,
    /// ∂(B(u) v)/∂u = ∫ ψ Ṅ : ∇φ with Ṅ = ∂cof F/∂F : ∇v; divergence pattern.
    pub divergence_rate: Option<&'a mut [f64]>,
    /// ∂(B(u)ᵀ μ)/∂u; displacement pattern.
    pub multiplier_stiffness: Option<&'a mut [f64]>,
}

impl Tangents<'_> {
    /// Whether anything is wanted that depends on v, ṗ or μ.
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

/// What [`Solid::multiply`](crate::solid::Solid::multiply) linearises.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linearized {
    /// β of force + β force_rate; 0: the force alone.
    pub beta: f64,
    /// Whether the constraint is defect_rate, not the defect.
    pub constraint_rate: bool,
}

impl Linearized {
    /// Whether anything depends on v or ṗ.
    pub(crate) fn has_rates(self) -> bool {
        self.beta > 0.0 || self.constraint_rate
    }
}

/// A direction in which the fields change, and what it changes: both are overwritten.
///
/// # Shapes
/// As of [`Fields`]. What is not given counts as zero.
#[derive(Debug)]
pub struct Change<'a> {
    /// Of the displacement.
    pub u: &'a [f64],
    /// Of the velocity.
    pub v: Option<&'a [f64]>,
    /// Of the pressure.
    pub p: Option<&'a [f64]>,
    /// Of its rate.
    pub p_rate: Option<&'a [f64]>,
    /// The change of force + β force_rate; `n_components`.
    pub force: &'a mut [f64],
    /// The change of the constraint; `n_pressures`.
    pub defect: Option<&'a mut [f64]>,
}

/// The deformation turns an element inside out (or is not a number): no stress is defined there.
///
/// An integrator recovers from it with a smaller step.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("det F = {jacobian:.3e} in element {element} at barycentric {barycentric}")]
pub struct Inverted {
    /// The element.
    pub element: usize,
    /// The place in it.
    pub barycentric: Barycentric,
    /// det F there.
    pub jacobian: f64,
}

impl Inverted {
    pub(crate) fn new(element: usize, barycentric: &[f64], jacobian: f64) -> Self {
        Self {
            element,
            barycentric: Barycentric::new(barycentric),
            jacobian,
        }
    }
}
