//! Transversely isotropic Mooney–Rivlin law with fibers that first uncrimp and then stretch.

use crate::material::parameters::{Described, Description, Parameter, Range};
use crate::material::three::{
    FiberStrain, Law3, Strain3, Symmetric3, Tensor3Of, add_scaled3, scaled3,
};
use crate::material::{Dual, MooneyRivlin, Real};

/// Mooney–Rivlin law with a fiber energy F2(λ), which is given by the tension T = λ F2'. The tension is `0` for λ
/// < 1, `c3 (e^{c4 (λ−1)} − 1)` for 1 ≤ λ < λ_m, and `c5 λ + c6` for larger λ. The constant c6 follows from
/// continuity.
///
/// Here, λ is the isochoric fiber stretch. F2 contains an exponential integral; it is needed for energies only and
/// is evaluated by quadrature. The tangent has jumps at λ = 1 and λ_m, where the value for larger stretches is
/// used. Source: Weiss, Maker, Govindjee (1996), Comput. Methods Appl. Mech. Engrg. 135; FEBio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransverseMooneyRivlin {
    /// Coefficient of the first invariant, in Pa.
    pub c10: f64,
    /// Coefficient of the second invariant, in Pa.
    pub c01: f64,
    /// Scale of the exponential, in Pa.
    pub c3: f64,
    /// Rate of uncrimping c4.
    pub c4: f64,
    /// Modulus of straightened fibers, in Pa.
    pub c5: f64,
    /// Stretch λ_m at which fibers are straight.
    pub stretch_max: f64,
}

impl Described for TransverseMooneyRivlin {
    const DESCRIPTION: Description = Description {
        name: "transverse-mooney-rivlin",
        energy: "c10 (Ī1-3) + c01 (Ī2-3) + F2(λ), λ F2' = 0 for λ < 1, \
                 c3 (exp c4(λ-1) - 1) to stretch_max, c5 λ + c6 beyond",
        about: "Tendon and passive muscle: fibers that uncrimp.",
        parameters: &[
            Parameter::new("c10", "Pa", Range::Positive, "Coefficient of the first invariant"),
            Parameter::new(
                "c01",
                "Pa",
                Range::Finite,
                "Coefficient of the second invariant, above -c10",
            )
            .or(0.0),
            Parameter::new("c3", "Pa", Range::NotNegative, "Scale of the exponential"),
            Parameter::new("c4", "", Range::Positive, "Rate of uncrimping"),
            Parameter::new("c5", "Pa", Range::NotNegative, "Modulus of straightened fibers"),
            Parameter::new(
                "stretch_max",
                "",
                Range::AtLeastOne,
                "Stretch at which fibers are straight",
            ),
        ],
        complete: false,
    };
}

impl TransverseMooneyRivlin {
    #[inline(always)]
    fn matrix(&self) -> MooneyRivlin {
        let Self { c10, c01, .. } = *self;
        MooneyRivlin { c10, c01 }
    }

    /// Returns c6.
    fn offset(&self) -> f64 {
        self.c3 * (self.c4 * (self.stretch_max - 1.0)).exp_m1() - self.c5 * self.stretch_max
    }

    /// Returns T = λ F2' as a function of λ − 1.
    #[inline(always)]
    fn tension<R: Real>(&self, beyond: R) -> R {
        let one = beyond.like(1.0);
        let crimped = (beyond * self.c4).exp_m1() * self.c3;
        let straight = (beyond + one) * self.c5 + one * self.offset();
        let tension = (beyond - one * (self.stretch_max - 1.0)).choose(straight, crimped);
        beyond.choose(tension, beyond.like(0.0))
    }

    /// Returns F2 as a function of λ − 1. A three-point Gauss rule is used on equal intervals up to λ_m; the
    /// integral beyond λ_m is exact.
    #[inline(always)]
    fn fiber_energy<R: Real>(&self, beyond: R) -> R {
        const INTERVALS: usize = 64;
        let one = beyond.like(1.0);
        let at_max = one * (self.stretch_max - 1.0);
        let over = (beyond - at_max).choose(beyond - at_max, at_max * 0.0);
        let width = (beyond - over) * (1.0 / INTERVALS as f64);
        let mut sum = over * self.c5 + (over * (1.0 / self.stretch_max)).ln_1p() * self.offset();
        let node = 0.5 * 0.6_f64.sqrt();
        for k in 0..INTERVALS {
            for (at, weight) in [(-node, 5.0 / 18.0), (0.0, 4.0 / 9.0), (node, 5.0 / 18.0)] {
                let beyond = width * (k as f64 + 0.5 + at);
                sum = sum + self.tension(beyond) / (beyond + one) * width * weight;
            }
        }
        beyond.choose(sum, beyond.like(0.0))
    }

    /// Returns λ − 1 for C̄, from λ² − 1 = x² (I4 − 1) + x² − 1 with x = J^(−1/3), x² − 1 = −d x³ (1 + x)/s and s
    /// = 1 + x + x².
    #[inline(always)]
    fn extension<R: Real>(e: R, d: R) -> R {
        let one = d.like(1.0);
        let x = (d + one).inverse_cube_root();
        let x2 = x * x;
        let square = x2 * e * 2.0 - d * x2 * x * (one + x) / (one + x + x2);
        square / ((square + one).sqrt() + one)
    }

    /// Returns the derivatives of F2 with respect to E_ff and d, which are T / I4 and −T / 3J.
    #[inline(always)]
    fn slopes<R: Real>(&self, e: R, d: R) -> [R; 2] {
        let one = d.like(1.0);
        let tension = self.tension(Self::extension(e, d));
        [tension / (e * 2.0 + one), tension / (d + one) * (-1.0 / 3.0)]
    }
}

impl Law3 for TransverseMooneyRivlin {
    const FIBERS: bool = true;

    #[inline(always)]
    fn energy<R: Real>(&self, strain: &Strain3<R>) -> R {
        let fiber = strain.axes.fiber;
        let e = strain.green_along(fiber, fiber);
        let extension = Self::extension(e, strain.d);
        Law3::energy(&self.matrix(), strain) + self.fiber_energy(extension)
    }

    #[inline(always)]
    fn stress<R: Real>(&self, strain: &Strain3<R>) -> Tensor3Of<R> {
        let fiber = FiberStrain::new(strain, strain.axes.fiber, strain.axes.fiber);
        let [by_e, by_d] = self.slopes(fiber.value, strain.d);
        let mut stress = self.matrix().stress(strain);
        add_scaled3(&mut stress, by_e, &fiber.gradient);
        add_scaled3(&mut stress, by_d, &strain.cofactor);
        stress
    }

    #[inline(always)]
    fn tangent<R: Real>(&self, strain: &Strain3<R>) -> Symmetric3<R> {
        let fiber = FiberStrain::new(strain, strain.axes.fiber, strain.axes.fiber);
        let (e, d) = (fiber.value, strain.d);
        let (one, zero) = (d.like(1.0), d.like(0.0));
        let dual = |value, rate| Dual { value, rate };
        let [ee, ed] = self.slopes(dual(e, one), dual(d, zero));
        let [_, dd] = self.slopes(dual(e, zero), dual(d, one));
        let mut out = self.matrix().tangent(strain);
        fiber.add_slope(&mut out, ee.value);
        out.add_cofactor_slope(ed.value, &strain.f);
        out.add_square(ee.rate, &fiber.gradient);
        out.add_square(dd.rate, &strain.cofactor);
        out.add_pair(&fiber.gradient, &scaled3(ed.rate, &strain.cofactor));
        out
    }
}

#[cfg(test)]
mod tests {
    mod space {
        use crate::material::three::tests::*;

        law_tests! {
            // The differences must not straddle a kink.
            transverse_mooney_rivlin: TRANSVERSE, STATES[1..];
        }
    }
}
