//! Guccione's law, in a full and an isochoric form: an exponential of the Green strain along fiber, sheet and
//! normal.

use crate::material::Real;
use crate::material::parameters::{Described, Description, Parameter, Range};
use crate::material::three::{
    FiberStrains, Law3, Strain3, Symmetric3, Tensor3Of, add_scaled3, scaled3,
};

/// Guccione's law `W = C/2 (e^Q − 1)` with
/// `Q = b_f E_ff² + b_t (E_ss² + E_nn² + 2 E_sn²) + b_fs (2 E_fs² + 2 E_fn²)`.
///
/// The Green strain is not split into an isochoric and a volumetric part; the constraint enforces J = 1. Therefore
/// p is not the mean stress and κ is not the bulk modulus. Source: Land et al. (2015), Proc. R. Soc. A 471.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Guccione {
    /// Stress scale C, in Pa.
    pub c: f64,
    /// Weight b_f of fiber strain.
    pub b_f: f64,
    /// Weight b_t of transverse strain.
    pub b_t: f64,
    /// Weight b_fs of fiber shear.
    pub b_fs: f64,
}

impl Described for Guccione {
    const DESCRIPTION: Description = Description {
        name: "guccione",
        energy: "C/2 (exp Q - 1), Q = b_f E_ff² + b_t (E_ss² + E_nn² + 2 E_sn²) + \
                 2 b_fs (E_fs² + E_fn²)",
        about: "Passive myocardium.",
        parameters: CONSTANTS,
        complete: false,
    };
}

/// Constants of both laws.
const CONSTANTS: &[Parameter] = &[
    Parameter::new("c", "Pa", Range::Positive, "Stiffness C"),
    Parameter::new("b_f", "", Range::NotNegative, "Weight of strain along the fiber"),
    Parameter::new("b_t", "", Range::NotNegative, "Weight of strain across the fiber"),
    Parameter::new("b_fs", "", Range::NotNegative, "Weight of shear along the fiber"),
];

impl Guccione {
    /// Returns the weights of the strains ff, ss, nn, sn, fn, fs in Q.
    #[inline(always)]
    fn weights(&self) -> [f64; 6] {
        let Self { b_f, b_t, b_fs, .. } = *self;
        [b_f, b_t, b_t, 2.0 * b_t, 2.0 * b_fs, 2.0 * b_fs]
    }

    /// Returns Q and its derivatives with respect to the strains.
    #[inline(always)]
    fn exponent<R: Real>(&self, strains: &[R; 6]) -> (R, [R; 6]) {
        let mut sum = strains[0].like(0.0);
        let mut slopes = *strains;
        for (slope, weight) in slopes.iter_mut().zip(self.weights()) {
            let half = *slope * weight;
            sum = half.mul_add(*slope, sum);
            *slope = half * 2.0;
        }
        (sum, slopes)
    }
}

impl Law3 for Guccione {
    const FIBERS: bool = true;

    #[inline(always)]
    fn energy<R: Real>(&self, strain: &Strain3<R>) -> R {
        let (q, _) = self.exponent(&FiberStrains::new(strain).values);
        q.exp_m1() * (0.5 * self.c)
    }

    #[inline(always)]
    fn stress<R: Real>(&self, strain: &Strain3<R>) -> Tensor3Of<R> {
        let strains = FiberStrains::new(strain);
        let (q, slopes) = self.exponent(&strains.values);
        scaled3(q.exp() * (0.5 * self.c), &strains.combine(&slopes))
    }

    #[inline(always)]
    fn tangent<R: Real>(&self, strain: &Strain3<R>) -> Symmetric3<R> {
        let strains = FiberStrains::new(strain);
        let (q, mut slopes) = self.exponent(&strains.values);
        let scale = q.exp() * (0.5 * self.c);
        let mut out = Symmetric3::zero(q);
        out.add_square(scale, &strains.combine(&slopes));
        let mut curvatures = slopes;
        for (i, weight) in self.weights().into_iter().enumerate() {
            curvatures[i] = scale * (2.0 * weight);
            slopes[i] = curvatures[i] * strains.values[i];
        }
        strains.add_slopes(&mut out, &slopes);
        strains.add_curvatures(&mut out, &curvatures);
        out
    }
}

/// Guccione's law as a function of the isochoric strain Ē = (C̄ − I)/2 with `C̄ = J^(−2/3) C`.
///
/// For J = 1, it is the same material as [`Guccione`] with a different pressure. Discrete pressures enforce J = 1
/// only on average, but with this law thin walls do not collapse at large strains. Sources: the source of
/// [`Guccione`]; FEBio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IsochoricGuccione {
    /// Stress scale C, in Pa.
    pub c: f64,
    /// Weight b_f of fiber strain.
    pub b_f: f64,
    /// Weight b_t of transverse strain.
    pub b_t: f64,
    /// Weight b_fs of fiber shear.
    pub b_fs: f64,
}

impl Described for IsochoricGuccione {
    const DESCRIPTION: Description = Description {
        name: "isochoric-guccione",
        energy: "energy of guccione with Ē = (J^(-2/3) C - I)/2",
        about: "Equal to `guccione` for J = 1 except for the pressure; more stable at large strains.",
        parameters: CONSTANTS,
        complete: false,
    };
}

/// The strain Ē and the quantities that occur in its derivatives. With x = J^(−1/3), N = cof F and c = 2 E + I in
/// the fiber axes,
/// ```text
/// Ē = x² E + (x² − 1)/2 I,    ∂Ē = x² ∂E − x⁵/3 c N
/// ∂²Ē = x² ∂²E − 2 x⁵/3 (∂E⊗N + N⊗∂E) + c (5 x⁸/9 N⊗N − x⁵/3 ∂N)
/// ```
struct Isochoric<R> {
    strains: FiberStrains<R>,
    /// Components of Ē: ff, ss, nn, sn, fn, fs.
    values: [R; 6],
    /// Components of c.
    stretched: [R; 6],
    x: R,
}

impl<R: Real> Isochoric<R> {
    #[inline(always)]
    fn new(strain: &Strain3<R>) -> Self {
        let strains = FiberStrains::new(strain);
        let (d, one) = (strain.d, strain.d.like(1.0));
        let x = (d + one).inverse_cube_root();
        let x2 = x * x;
        // The expression (x² − 1)/2, without cancellation near rest.
        let shrunk = d * x2 * x * (one + x) / (one + x + x2) * -0.5;
        let (mut values, mut stretched) = (strains.values, strains.values);
        for i in 0..6 {
            values[i] = x2 * values[i];
            stretched[i] = stretched[i] * 2.0;
            if i < 3 {
                values[i] = values[i] + shrunk;
                stretched[i] = stretched[i] + one;
            }
        }
        Self { strains, values, stretched, x }
    }

    /// Returns Σ a c over the components.
    #[inline(always)]
    fn dot(&self, a: &[R; 6]) -> R {
        let mut sum = self.x.like(0.0);
        for (a, c) in a.iter().zip(&self.stretched) {
            sum = a.mul_add(*c, sum);
        }
        sum
    }

    /// Returns x⁵/3.
    #[inline(always)]
    fn third(&self) -> R {
        let x2 = self.x * self.x;
        x2 * x2 * self.x * (1.0 / 3.0)
    }

    /// Returns Σ slope ∂Ē over the components.
    #[inline(always)]
    fn combine(&self, slopes: &[R; 6], cofactor: &Tensor3Of<R>) -> Tensor3Of<R> {
        let mut out = scaled3(self.x * self.x, &self.strains.combine(slopes));
        add_scaled3(&mut out, -(self.third() * self.dot(slopes)), cofactor);
        out
    }
}

impl IsochoricGuccione {
    /// Returns the corresponding law of the full strain E.
    #[inline(always)]
    fn full(&self) -> Guccione {
        let Self { c, b_f, b_t, b_fs } = *self;
        Guccione { c, b_f, b_t, b_fs }
    }
}

impl Law3 for IsochoricGuccione {
    const FIBERS: bool = true;

    #[inline(always)]
    fn energy<R: Real>(&self, strain: &Strain3<R>) -> R {
        let (q, _) = self.full().exponent(&Isochoric::new(strain).values);
        q.exp_m1() * (0.5 * self.c)
    }

    #[inline(always)]
    fn stress<R: Real>(&self, strain: &Strain3<R>) -> Tensor3Of<R> {
        let isochoric = Isochoric::new(strain);
        let (q, slopes) = self.full().exponent(&isochoric.values);
        let gradient = isochoric.combine(&slopes, &strain.cofactor);
        scaled3(q.exp() * (0.5 * self.c), &gradient)
    }

    #[inline(always)]
    fn tangent<R: Real>(&self, strain: &Strain3<R>) -> Symmetric3<R> {
        let isochoric = Isochoric::new(strain);
        let (q, mut slopes) = self.full().exponent(&isochoric.values);
        let scale = q.exp() * (0.5 * self.c);
        let mut out = Symmetric3::zero(q);
        out.add_square(scale, &isochoric.combine(&slopes, &strain.cofactor));
        let (x2, third) = (isochoric.x * isochoric.x, isochoric.third());
        let (mut curvatures, mut pairs, mut squares) = (slopes, slopes, slopes);
        for (i, weight) in self.full().weights().into_iter().enumerate() {
            let curvature = scale * (2.0 * weight);
            let stretched = curvature * isochoric.stretched[i];
            slopes[i] = scale * slopes[i];
            curvatures[i] = x2 * x2 * curvature;
            pairs[i] = -(third * (x2 * stretched + slopes[i] * 2.0));
            squares[i] = third * third * stretched;
        }
        let strains = &isochoric.strains;
        strains.add_curvatures(&mut out, &curvatures);
        out.add_pair(&strains.combine(&pairs), &strain.cofactor);
        let sum = isochoric.dot(&slopes);
        let second_order = third * x2 * isochoric.x * sum * (5.0 / 3.0);
        out.add_square(isochoric.dot(&squares) + second_order, &strain.cofactor);
        out.add_cofactor_slope(-(third * sum), &strain.f);
        for slope in &mut slopes {
            *slope = x2 * *slope;
        }
        strains.add_slopes(&mut out, &slopes);
        out
    }
}

#[cfg(test)]
mod tests {
    mod space {
        use crate::material::three::tests::*;

        law_tests! {
            guccione: Law::Guccione { c: 2e3, b_f: 8.0, b_t: 2.0, b_fs: 4.0 }, STATES;
            isochoric_guccione: Law::IsochoricGuccione { c: 2e3, b_f: 8.0, b_t: 2.0, b_fs: 4.0 }, STATES;
        }
    }
}
