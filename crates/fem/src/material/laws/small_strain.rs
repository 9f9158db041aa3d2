//! Linear isochoric elasticity: W = ζ |dev ε|² = ζ (e/2 + d²/6).

use crate::material::Real;
use crate::material::parameters::{Described, Description, Parameter, Range};
use crate::material::potential::{PlaneCurvature, PlaneSlope, Potential};
use crate::material::three::{Law3, Strain3, Symmetric3, Tensor3Of, contract3, scaled3, trace3};

/// Linear law `W = ζ |dev ε|²`, where dev is the deviator in 3D.
///
/// The law is intended for small ∇u. Paper, eqs. (7) and (26). The linearization of the Mooney–Rivlin law has ζ =
/// 2 (c10 + c01).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SmallStrain {
    /// Shear modulus ζ, in Pa.
    pub shear_modulus: f64,
}

impl Described for SmallStrain {
    const DESCRIPTION: Description = Description {
        name: "small-strain",
        energy: "ζ |dev ε|²",
        about: "Eq. (26): linear, for small displacements only.",
        parameters: &[Parameter::new("shear_modulus", "Pa", Range::Positive, "Shear modulus ζ")],
        complete: false,
    };
}

impl Potential for SmallStrain {
    const FINITE: bool = false;

    #[inline(always)]
    fn energy(&self, e: f64, d: f64) -> f64 {
        self.shear_modulus * (e / 2.0 + d * d / 6.0)
    }

    #[inline(always)]
    fn first<R: Real>(&self, _e: R, d: R) -> PlaneSlope<R> {
        PlaneSlope { e: d.like(self.shear_modulus / 2.0), d: d * (self.shear_modulus / 3.0) }
    }

    #[inline(always)]
    fn second<R: Real>(&self, _e: R, d: R) -> PlaneCurvature<R> {
        let zero = d.like(0.0);
        PlaneCurvature { ee: zero, ed: zero, dd: d.like(self.shear_modulus / 3.0) }
    }
}

impl Law3 for SmallStrain {
    const FIBERS: bool = false;
    const FINITE: bool = false;

    #[inline(always)]
    fn energy<R: Real>(&self, strain: &Strain3<R>) -> R {
        let deviator = deviator(strain.green);
        contract3(&deviator, &deviator) * self.shear_modulus
    }

    #[inline(always)]
    fn stress<R: Real>(&self, strain: &Strain3<R>) -> Tensor3Of<R> {
        scaled3(strain.d.like(2.0 * self.shear_modulus), &deviator(strain.green))
    }

    #[inline(always)]
    fn tangent<R: Real>(&self, strain: &Strain3<R>) -> Symmetric3<R> {
        let mut out = Symmetric3::zero(strain.d);
        out.add_symmetrizer(strain.d.like(2.0 * self.shear_modulus));
        // F = I for small strains.
        out.add_square(strain.d.like(-2.0 / 3.0 * self.shear_modulus), &strain.f);
        out
    }
}

#[inline(always)]
fn deviator<R: Real>(mut t: Tensor3Of<R>) -> Tensor3Of<R> {
    let third = trace3(&t) * (1.0 / 3.0);
    for (i, row) in t.iter_mut().enumerate() {
        row[i] = row[i] - third;
    }
    t
}

#[cfg(test)]
mod tests {
    mod plane {
        use crate::material::tests::*;

        law_tests! {
            small_strain: Law::SmallStrain { shear_modulus: 2.04e4 };
        }
    }

    mod space {
        use crate::material::three::tests::*;

        law_tests! {
            small_strain: Law::SmallStrain { shear_modulus: 2.04e4 }, STATES;
        }
    }
}
