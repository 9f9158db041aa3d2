//! Guccione's law: an exponential of Green's strain along fibre, sheet and normal.

use crate::material::Real;
use crate::material::parameters::{Described, Description, Parameter, Range};
use crate::material::three::{FibreStrains, Law3, Strain3, Symmetric3, Tensor3Of, scaled3};

/// `W = C/2 (e^Q − 1)`, `Q = b_f E_ff² + b_t (E_ss² + E_nn² + 2 E_sn²) + b_fs (2 E_fs² + 2 E_fn²)`.
///
/// Green's strain is not split: J = 1 is the constraint's matter, p is not the mean stress, nor κ
/// the bulk modulus of the whole. Source: Land et al. 2015, Proc. R. Soc. A 471.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Guccione {
    /// C, Pa.
    pub c: f64,
    /// b_f.
    pub b_f: f64,
    /// b_t.
    pub b_t: f64,
    /// b_fs.
    pub b_fs: f64,
}

impl Described for Guccione {
    const DESCRIPTION: Description = Description {
        name: "guccione",
        energy: "C/2 (exp Q - 1), Q = b_f E_ff² + b_t (E_ss² + E_nn² + 2 E_sn²) + \
                 2 b_fs (E_fs² + E_fn²)",
        about: "Heart muscle at rest, in the axes of fibre and sheet.",
        parameters: &[
            Parameter::new("c", "Pa", Range::Positive, "Stiffness C"),
            Parameter::new("b_f", "", Range::NotNegative, "Weight along the fibre"),
            Parameter::new("b_t", "", Range::NotNegative, "Weight across the fibre"),
            Parameter::new(
                "b_fs",
                "",
                Range::NotNegative,
                "Weight of shear along the fibre",
            ),
        ],
        fibres: true,
        complete: false,
    };
}

impl Guccione {
    /// Weights of the strains ff, ss, nn, sn, fn, fs in Q.
    #[inline(always)]
    fn weights(&self) -> [f64; 6] {
        let Self { b_f, b_t, b_fs, .. } = *self;
        [b_f, b_t, b_t, 2.0 * b_t, 2.0 * b_fs, 2.0 * b_fs]
    }

    /// Q and ∂Q/∂F.
    #[inline(always)]
    fn exponent<R: Real>(&self, strains: &FibreStrains<R>) -> (R, Tensor3Of<R>) {
        let mut sum = strains.values[0].like(0.0);
        let mut slopes = strains.values;
        for (slope, weight) in slopes.iter_mut().zip(self.weights()) {
            let half = *slope * weight;
            sum = half.mul_add(*slope, sum);
            *slope = half * 2.0;
        }
        (sum, strains.combine(&slopes))
    }
}

impl Law3 for Guccione {
    const FIBRES: bool = true;

    #[inline(always)]
    fn energy<R: Real>(&self, strain: &Strain3<R>) -> R {
        let (q, _) = self.exponent(&FibreStrains::new(strain));
        q.exp_m1() * (0.5 * self.c)
    }

    #[inline(always)]
    fn stress<R: Real>(&self, strain: &Strain3<R>) -> Tensor3Of<R> {
        let (q, gradient) = self.exponent(&FibreStrains::new(strain));
        scaled3(q.exp() * (0.5 * self.c), &gradient)
    }

    #[inline(always)]
    fn tangent<R: Real>(&self, strain: &Strain3<R>) -> Symmetric3<R> {
        let strains = FibreStrains::new(strain);
        let (q, gradient) = self.exponent(&strains);
        let scale = q.exp() * (0.5 * self.c);
        let mut out = Symmetric3::zero(q);
        out.add_square(scale, &gradient);
        let (mut slopes, mut curvatures) = (strains.values, strains.values);
        for (i, weight) in self.weights().into_iter().enumerate() {
            curvatures[i] = scale * (2.0 * weight);
            slopes[i] = curvatures[i] * strains.values[i];
        }
        strains.add_slopes(&mut out, &slopes);
        strains.add_curvatures(&mut out, &curvatures);
        out
    }
}

#[cfg(test)]
mod tests {
    mod space {
        use crate::material::three::tests::*;

        law_tests! {
            guccione: Law::Guccione { c: 2e3, b_f: 8.0, b_t: 2.0, b_fs: 4.0 }, STATES;
        }
    }
}
