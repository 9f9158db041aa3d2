//! Holzapfel–Ogden law: an isotropic matrix, fibers and sheets in tension, and fiber–sheet shear.

use crate::material::parameters::{Described, Description, Parameter, Range};
use crate::material::three::{
    FiberStrain, Invariants, Isotropic, Law3, Slope, Strain3, Symmetric3, Tensor3Of, add_scaled3,
};
use crate::material::{Dual, Real};

/// Holzapfel–Ogden law `W = a/2b (e^{b(Ī1−3)} − 1) + Σ_f,s a_i/2b_i H(I_i) (e^{b_i (I_i−1)²} − 1) + a_fs/2b_fs
/// (e^{b_fs I8²} − 1)` with `I_i = κ_i I1 + (1 − 3 κ_i) I4i`.
///
/// The dispersion κ_i is 0 for aligned fibers, where I_i = I4i, and 1/3 for fibers in all directions. The switch
/// `H(x) = 1/(1 + e^{−k(x−1)})` activates fibers in tension. The switch is part of the energy, which is therefore
/// not convex just below I_i = 1. With k = ∞, the switch is a step. The tangent then has a jump at I_i = 1, where
/// the value for tension is used. I1, I4 and I8 are invariants of the full C. Sources: Holzapfel and Ogden (2009),
/// Phil. Trans. R. Soc. A 367, in the form of Aróstica et al. (2025); dispersion of Gasser, Ogden and Holzapfel
/// (2006), J. R. Soc. Interface 3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HolzapfelOgden {
    /// Matrix stiffness a, in Pa.
    pub a: f64,
    /// Matrix exponent b.
    pub b: f64,
    /// Fiber stiffness a_f, in Pa.
    pub a_f: f64,
    /// Fiber exponent b_f.
    pub b_f: f64,
    /// Sheet stiffness a_s, in Pa.
    pub a_s: f64,
    /// Sheet exponent b_s.
    pub b_s: f64,
    /// Shear stiffness a_fs, in Pa.
    pub a_fs: f64,
    /// Shear exponent b_fs.
    pub b_fs: f64,
    /// Steepness k of the switch; ∞ for a step.
    pub k: f64,
    /// Dispersion κ_f of the fibers.
    pub dispersion_f: f64,
    /// Dispersion κ_s of the sheets.
    pub dispersion_s: f64,
}

impl Described for HolzapfelOgden {
    const DESCRIPTION: Description = Description {
        name: "holzapfel-ogden",
        energy: "a/2b (exp b(Ī1-3) - 1) + Σ_f,s a_i/2b_i H(I_i) (exp b_i(I_i-1)² - 1) + \
                 a_fs/2b_fs (exp b_fs I8² - 1), I_i = κ_i I1 + (1-3κ_i) I4i, H(x) = 1/(1 + exp -k(x-1))",
        about: "Passive myocardium.",
        parameters: &[
            Parameter::new("a", "Pa", Range::Positive, "Stiffness of the matrix"),
            Parameter::new("b", "", Range::Positive, "Exponent of the matrix"),
            Parameter::new("a_f", "Pa", Range::NotNegative, "Stiffness of the fibers"),
            Parameter::new("b_f", "", Range::Positive, "Exponent of the fibers"),
            Parameter::new("a_s", "Pa", Range::NotNegative, "Stiffness of the sheets"),
            Parameter::new("b_s", "", Range::Positive, "Exponent of the sheets"),
            Parameter::new("a_fs", "Pa", Range::NotNegative, "Stiffness of fiber–sheet shear"),
            Parameter::new("b_fs", "", Range::Positive, "Exponent of fiber–sheet shear"),
            Parameter::new(
                "k",
                "",
                Range::PositiveOrInfinite,
                "Steepness of the switch; `inf`: a step. With a finite value, the energy is not convex near the switch, and a load may have several equilibria",
            )
            .or(f64::INFINITY),
            dispersion("dispersion_f", "Dispersion κ_f of the fibers: 0 for aligned, 1/3 for isotropic ones"),
            dispersion("dispersion_s", "Dispersion κ_s of the sheets"),
        ],
        complete: false,
    };
}

const fn dispersion(name: &'static str, about: &'static str) -> Parameter {
    Parameter::new(name, "", Range::UpToAThird, about).or(0.0)
}

impl HolzapfelOgden {
    #[inline(always)]
    fn matrix(&self) -> Exponential {
        Exponential { a: self.a, b: self.b }
    }

    /// Returns the strain and the fiber family for each of the three anisotropic terms.
    #[inline(always)]
    fn terms<R: Real>(&self, strain: &Strain3<R>) -> [(FiberStrain<R>, Family); 3] {
        let (f, s) = (strain.axes.fiber, strain.axes.sheet);
        let family = |a, b, k| Family { a, b, k };
        [
            (
                FiberStrain::dispersed(strain, f, self.dispersion_f),
                family(self.a_f, self.b_f, Some(self.k)),
            ),
            (
                FiberStrain::dispersed(strain, s, self.dispersion_s),
                family(self.a_s, self.b_s, Some(self.k)),
            ),
            (FiberStrain::new(strain, f, s), family(self.a_fs, self.b_fs, None)),
        ]
    }
}

/// Fiber family with the energy `w(E) = a/2b H (e^{b y²} − 1)`, where y = 2 E is I_i − 1 or I8.
#[derive(Debug, Clone, Copy)]
struct Family {
    a: f64,
    b: f64,
    /// Steepness of the switch. `None` means no switch.
    k: Option<f64>,
}

impl Family {
    /// Multiplies the value g by the switch H. Returns H g, or the derivative of H g if the derivative of g is
    /// given.
    #[inline(always)]
    fn switched<R: Real>(&self, y: R, value: R, derivative: Option<R>) -> R {
        let term = derivative.unwrap_or(value);
        match self.k {
            None => term,
            Some(k) if k.is_infinite() => y.choose(term, y.like(0.0)),
            Some(k) => {
                let one = y.like(1.0);
                let h = one / (one + (y * -k).exp());
                match derivative {
                    None => h * term,
                    Some(slope) => h * (slope + (one - h) * value * k),
                }
            }
        }
    }

    #[inline(always)]
    fn energy<R: Real>(&self, e: R) -> R {
        let y = e * 2.0;
        let g = (y * y * self.b).exp_m1() * (0.5 * self.a / self.b);
        self.switched(y, g, None)
    }

    /// Returns w'.
    #[inline(always)]
    fn slope<R: Real>(&self, e: R) -> R {
        let y = e * 2.0;
        let grown = (y * y * self.b).exp_m1();
        let g = grown * (0.5 * self.a / self.b);
        let slope = (grown + y.like(1.0)) * y * self.a;
        self.switched(y, g, Some(slope)) * 2.0
    }

    /// Returns w''.
    #[inline(always)]
    fn curvature<R: Real>(&self, e: R) -> R {
        let rate = e.like(1.0);
        self.slope(Dual { value: e, rate }).rate
    }
}

/// Isotropic matrix with the energy a/2b (e^{b(Ī1−3)} − 1).
#[derive(Debug, Clone, Copy)]
struct Exponential {
    a: f64,
    b: f64,
}

impl Isotropic for Exponential {
    #[inline(always)]
    fn energy<R: Real>(&self, at: Invariants<R>) -> R {
        let (y, _) = at.isochoric_first();
        (y * self.b).exp_m1() * (0.5 * self.a / self.b)
    }

    #[inline(always)]
    fn slope<R: Real>(&self, at: Invariants<R>) -> Slope<R> {
        let (y, slope) = at.isochoric_first();
        slope.scaled((y * self.b).exp() * (0.5 * self.a))
    }
}

impl Law3 for HolzapfelOgden {
    const FIBERS: bool = true;

    #[inline(always)]
    fn energy<R: Real>(&self, strain: &Strain3<R>) -> R {
        let mut sum = Law3::energy(&self.matrix(), strain);
        for (strain, family) in &self.terms(strain) {
            sum = sum + family.energy(strain.value);
        }
        sum
    }

    #[inline(always)]
    fn stress<R: Real>(&self, strain: &Strain3<R>) -> Tensor3Of<R> {
        let mut stress = self.matrix().stress(strain);
        for (strain, family) in &self.terms(strain) {
            add_scaled3(&mut stress, family.slope(strain.value), &strain.gradient);
        }
        stress
    }

    #[inline(always)]
    fn tangent<R: Real>(&self, strain: &Strain3<R>) -> Symmetric3<R> {
        let mut out = self.matrix().tangent(strain);
        for (strain, family) in &self.terms(strain) {
            strain.add_slope(&mut out, family.slope(strain.value));
            out.add_square(family.curvature(strain.value), &strain.gradient);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    mod space {
        use crate::material::three::tests::*;

        law_tests! {
            holzapfel_ogden: holzapfel_ogden(100.0), MODERATE;
            // The differences must not straddle a kink.
            with_a_step: holzapfel_ogden(f64::INFINITY), MODERATE[1..];
            dispersed: dispersed(holzapfel_ogden(100.0)), MODERATE;
        }

        fn dispersed(law: Law) -> Law {
            let names = law.description().parameters.iter().map(|own| own.name);
            // If a constant is listed twice, the first value is used.
            let own = [("dispersion_f", 0.2), ("dispersion_s", 0.1)];
            let constants: Vec<_> = own.into_iter().chain(names.zip(law.values())).collect();
            Law::named("holzapfel-ogden", &constants).unwrap()
        }
    }
}
