//! Fung's law: an exponential of a quadratic form of the Green strain in the axes fiber, sheet and normal.

use crate::material::Real;
use crate::material::parameters::{Described, Description, Parameter, Range};
use crate::material::three::{FiberStrains, Law3, Strain3, Symmetric3, Tensor3Of, scaled3};

/// Fung's orthotropic law `W = c/2 (e^Q − 1)` in the axes fiber (1), sheet (2) and normal (3), with `Q = b_1
/// E11² + b_2 E22² + b_3 E33² + 2 b_4 E11 E22 + 2 b_5 E22 E33 + 2 b_6 E33 E11 + b_7 E12² + b_8 E23² + b_9 E13²`.
///
/// The matrix of b_1 to b_6 must not have a negative eigenvalue, so that the energy is convex in E. As with
/// `guccione`, the Green strain is not split, and p is not the mean stress. Source, without the shear terms:
/// Chuong and Fung (1983), Journal of Biomechanical Engineering 105, 268–274.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)] // the weights of Q
pub struct Fung {
    /// Stiffness c, in Pa.
    pub c: f64,
    pub b_1: f64,
    pub b_2: f64,
    pub b_3: f64,
    pub b_4: f64,
    pub b_5: f64,
    pub b_6: f64,
    pub b_7: f64,
    pub b_8: f64,
    pub b_9: f64,
}

const fn square(name: &'static str, about: &'static str) -> Parameter {
    Parameter::new(name, "", Range::NotNegative, about)
}

const fn coupling(name: &'static str, about: &'static str) -> Parameter {
    Parameter::new(name, "", Range::Finite, about).or(0.0)
}

impl Described for Fung {
    const DESCRIPTION: Description = Description {
        name: "fung",
        energy: "c/2 (exp Q - 1), Q = b_1 E_ff² + b_2 E_ss² + b_3 E_nn² + 2 b_4 E_ff E_ss + \
                 2 b_5 E_ss E_nn + 2 b_6 E_nn E_ff + b_7 E_fs² + b_8 E_sn² + b_9 E_fn²",
        about: "Orthotropic: arteries, skin, pericardium.",
        parameters: &[
            Parameter::new("c", "Pa", Range::Positive, "Stiffness c"),
            square("b_1", "Weight of strain along the fiber"),
            square("b_2", "Weight of strain along the sheet"),
            square("b_3", "Weight of strain along the normal"),
            coupling("b_4", "Coupling of fiber and sheet"),
            coupling("b_5", "Coupling of sheet and normal"),
            coupling("b_6", "Coupling of normal and fiber"),
            square("b_7", "Weight of fiber–sheet shear"),
            square("b_8", "Weight of sheet–normal shear"),
            square("b_9", "Weight of fiber–normal shear"),
        ],
        complete: false,
    };
}

impl Fung {
    /// Returns the weights of the squares of the strains ff, ss, nn, sn, fn, fs.
    #[inline(always)]
    fn squares(&self) -> [f64; 6] {
        [self.b_1, self.b_2, self.b_3, self.b_8, self.b_9, self.b_7]
    }

    /// Returns pairs of strains with the weight of their product.
    #[inline(always)]
    fn couplings(&self) -> [([usize; 2], f64); 3] {
        let twice = |pair, b| (pair, 2.0 * b);
        [twice([0, 1], self.b_4), twice([1, 2], self.b_5), twice([0, 2], self.b_6)]
    }

    /// Returns Q and its derivatives with respect to the strains.
    #[inline(always)]
    fn exponent<R: Real>(&self, strains: &[R; 6]) -> (R, [R; 6]) {
        let mut slopes = *strains;
        for (slope, weight) in slopes.iter_mut().zip(self.squares()) {
            *slope = *slope * (2.0 * weight);
        }
        for ([i, j], weight) in self.couplings() {
            slopes[i] = slopes[i] + strains[j] * weight;
            slopes[j] = slopes[j] + strains[i] * weight;
        }
        let mut twice = strains[0].like(0.0);
        for (slope, strain) in slopes.iter().zip(strains) {
            twice = slope.mul_add(*strain, twice);
        }
        (twice * 0.5, slopes)
    }
}

impl Law3 for Fung {
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
        for (i, weight) in self.squares().into_iter().enumerate() {
            curvatures[i] = scale * (2.0 * weight);
            slopes[i] = scale * slopes[i];
        }
        strains.add_slopes(&mut out, &slopes);
        strains.add_curvatures(&mut out, &curvatures);
        for (pair, weight) in self.couplings() {
            strains.add_coupling(&mut out, scale * weight, pair);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::Fung;
    use crate::material::Law;

    const LAW: Law = Law::Fung {
        c: 2e3,
        b_1: 8.0,
        b_2: 3.0,
        b_3: 2.0,
        b_4: 1.5,
        b_5: -0.5,
        b_6: 1.0,
        b_7: 4.0,
        b_8: 3.0,
        b_9: 5.0,
    };

    mod space {
        use super::LAW;
        use crate::material::three::tests::*;

        law_tests! {
            fung: LAW, STATES;
        }
    }

    #[test]
    fn nonconvex_weights_are_rejected() {
        use crate::material::parameters::Described;
        let names = Fung::DESCRIPTION.parameters.iter().map(|own| own.name);
        let with = |name, value| {
            let constants = [(name, value)].into_iter().chain(names.clone().zip(LAW.values()));
            Law::named("fung", &constants.collect::<Vec<_>>())
        };
        assert_eq!(with("b_5", -0.5).unwrap(), LAW);
        // Here, b_1 b_2 = 24 = 4.90², and the determinant 43 − b_4 − 2 b_4² is zero at b_4 = 4.39.
        assert!(with("b_4", 4.3).is_ok());
        assert!(with("b_4", 4.6).is_err());
        assert!(with("b_4", 5.0).is_err());
        assert!(with("b_5", 2.5).is_err());
        assert!(with("b_7", -1.0).is_err());
        // With equal weights, the determinants of the form (tr E)² are zero, so rounding decides their sign.
        for k in [0.1, 0.3, 1.1, 7.7] {
            let names = Fung::DESCRIPTION.parameters.iter().map(|own| own.name);
            let constants: Vec<_> = names.map(|name| (name, k)).collect();
            assert!(Law::named("fung", &constants).is_ok(), "{k}");
        }
    }
}
