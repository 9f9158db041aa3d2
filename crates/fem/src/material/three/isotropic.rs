//! Isotropic laws as functions of three invariants that vanish at rest.
//!
//! ```text
//! a = I1 − 3 − 2 d = |H|² − 2 tr cof H − 2 det H,    ∂a/∂F = 2 D,  D = F − cof F
//! b = I2 − 3 − 4 d = 2 a + 4 tr cof E,               ∂b/∂F = 2 B,  B = 2 D + 2 F (tr E I − E)
//! d = J − 1,                                         ∂d/∂F = N = cof F
//!
//! P = 2 W_a D + 2 W_b B + W_d N
//! ```

use super::super::potential::plane_invariants;
use super::super::{Dual, PlaneCurvature, PlaneSlope, Real};
use super::law::Law3;
use super::strain::Strain3;
use super::tensor::{
    Symmetric3, Tensor3Of, UPPER3, add_scaled3, cofactor3, product3, scaled3, trace3,
};

/// Invariants of an isotropic law. All of them are zero at rest.
#[derive(Debug, Clone, Copy)]
pub struct Invariants<R> {
    /// I1 − 3 − 2 d, which is of second order near rest.
    pub a: R,
    /// I2 − 3 − 4 d, which is of second order near rest.
    pub b: R,
    /// J − 1.
    pub d: R,
}

impl<R: Real> Invariants<R> {
    /// Returns Ī1 − 3 = J^(−2/3) I1 − 3 and its derivatives. Computed from I1 and J, the difference would lose the digits
    /// of small strains.
    #[inline(always)]
    pub fn isochoric_first(self) -> (R, Slope<R>) {
        let Self { a, d, .. } = self;
        let one = d.like(1.0);
        let x = (d + one).inverse_cube_root();
        let x2 = x * x;
        let x5 = x2 * x2 * x;
        let ratio = d / (one + x + x2);
        let slope = Slope { a: x2, b: one * 0.0, d: x5 * (d - a) * (2.0 / 3.0) };
        (x2 * a + ratio * ratio * x5 * (x + one * 2.0), slope)
    }

    /// Returns Ī2 − 3 = J^(−4/3) I2 − 3 and its derivatives, without cancellation at small strains.
    #[inline(always)]
    pub fn isochoric_second(self) -> (R, Slope<R>) {
        let Self { b, d, .. } = self;
        let one = d.like(1.0);
        let x = (d + one).inverse_cube_root();
        let ratio = d / (one + x + x * x);
        let k2 = ratio * ratio * (one + x * 2.0) - d * d;
        let x4 = x * x * x * x;
        let slope = Slope { a: one * 0.0, b: x4, d: x4 * (x * x * x) * (b + d) * (-4.0 / 3.0) };
        (x4 * (b + k2), slope)
    }
}

/// First partial derivatives of W(a, b, d).
#[derive(Debug, Clone, Copy)]
pub struct Slope<R> {
    /// ∂W/∂a.
    pub a: R,
    /// ∂W/∂b.
    pub b: R,
    /// ∂W/∂d.
    pub d: R,
}

impl<R: Real> Slope<R> {
    /// Returns the derivatives multiplied by `factor`. If `self` holds the derivatives of y, and `factor` is
    /// w'(y), then the result holds the derivatives of w(y).
    #[inline(always)]
    pub fn scaled(self, factor: R) -> Self {
        Self { a: factor * self.a, b: factor * self.b, d: factor * self.d }
    }
}

/// Second partial derivatives of W(a, b, d).
#[derive(Debug, Clone, Copy)]
pub struct Curvature<R> {
    /// ∂²W/∂a².
    pub aa: R,
    /// ∂²W/∂a∂b.
    pub ab: R,
    /// ∂²W/∂b².
    pub bb: R,
    /// ∂²W/∂a∂d.
    pub ad: R,
    /// ∂²W/∂b∂d.
    pub bd: R,
    /// ∂²W/∂d².
    pub dd: R,
}

/// Isotropic law for finite strains, given by W(a, b, d).
///
/// Only the energy is required. The derivatives may be implemented by hand for speed. All functions must be
/// `#[inline(always)]`.
pub trait Isotropic {
    /// Whether W includes the volumetric part, so that κ is not added.
    const COMPLETE: bool = false;

    /// Returns W.
    fn energy<R: Real>(&self, at: Invariants<R>) -> R;

    /// Returns the first derivatives.
    #[inline(always)]
    fn slope<R: Real>(&self, at: Invariants<R>) -> Slope<R> {
        let [a, b, d] = directions(at);
        Slope { a: self.energy(a).rate, b: self.energy(b).rate, d: self.energy(d).rate }
    }

    /// Returns the second derivatives.
    #[inline(always)]
    fn curvature<R: Real>(&self, at: Invariants<R>) -> Curvature<R> {
        let [a, b, d] = directions(at);
        let (a, b, d) = (self.slope(a), self.slope(b), self.slope(d));
        Curvature {
            aa: a.a.rate,
            ab: a.b.rate,
            bb: b.b.rate,
            ad: a.d.rate,
            bd: b.d.rate,
            dd: d.d.rate,
        }
    }

    /// Returns the first derivatives of W with respect to e = a and d in plane strain, where
    /// b = a + d².
    #[inline(always)]
    fn plane_slope<R: Real>(&self, e: R, d: R) -> PlaneSlope<R> {
        let slope = self.slope(plane_invariants(e, d));
        PlaneSlope { e: slope.a + slope.b, d: (slope.b * 2.0).mul_add(d, slope.d) }
    }

    /// Returns the second derivatives in plane strain.
    #[inline(always)]
    fn plane_curvature<R: Real>(&self, e: R, d: R) -> PlaneCurvature<R> {
        let at = plane_invariants(e, d);
        let (slope, curve) = (self.slope(at), self.curvature(at));
        let b_slope = d * 2.0;
        PlaneCurvature {
            ee: curve.aa + curve.ab * 2.0 + curve.bb,
            ed: curve.ad + curve.bd + b_slope * (curve.ab + curve.bb),
            dd: curve.dd + b_slope * (curve.bd * 2.0 + b_slope * curve.bb) + slope.b * 2.0,
        }
    }
}

/// Returns the invariants as dual numbers. There is one copy for each invariant, in which this invariant has unit
/// rate.
#[inline(always)]
fn directions<R: Real>(at: Invariants<R>) -> [Invariants<Dual<R>>; 3] {
    let one = at.d.like(1.0);
    let constant =
        Invariants { a: Dual::constant(at.a), b: Dual::constant(at.b), d: Dual::constant(at.d) };
    let mut all = [constant; 3];
    all[0].a.rate = one;
    all[1].b.rate = one;
    all[2].d.rate = one;
    all
}

impl<R: Real> Strain3<R> {
    /// Returns a, b and d.
    #[inline(always)]
    pub fn invariants(&self) -> Invariants<R> {
        Invariants {
            a: self.a,
            b: trace3(&cofactor3(&self.green)).mul_add(self.d.like(4.0), self.a * 2.0),
            d: self.d,
        }
    }

    /// Returns B, half the derivative of b.
    #[inline(always)]
    fn second_distortion(&self, distortion: &Tensor3Of<R>) -> Tensor3Of<R> {
        let trace = trace3(&self.green);
        let mut inner = scaled3(trace.like(-1.0), &self.green);
        for (i, row) in inner.iter_mut().enumerate() {
            row[i] = row[i] + trace;
        }
        let mut out = product3(&self.f, &inner);
        add_scaled3(&mut out, trace.like(1.0), distortion);
        scaled3(trace.like(2.0), &out)
    }
}

impl<W: Isotropic> Law3 for W {
    const FIBERS: bool = false;
    const COMPLETE: bool = W::COMPLETE;

    #[inline(always)]
    fn energy<R: Real>(&self, strain: &Strain3<R>) -> R {
        Isotropic::energy(self, strain.invariants())
    }

    #[inline(always)]
    fn stress<R: Real>(&self, strain: &Strain3<R>) -> Tensor3Of<R> {
        let slope = self.slope(strain.invariants());
        let distortion = strain.distortion();
        let mut stress = scaled3(slope.d, &strain.cofactor);
        add_scaled3(&mut stress, slope.a * 2.0, &distortion);
        let second = strain.second_distortion(&distortion);
        add_scaled3(&mut stress, slope.b * 2.0, &second);
        stress
    }

    #[inline(always)]
    fn tangent<R: Real>(&self, strain: &Strain3<R>) -> Symmetric3<R> {
        let at = strain.invariants();
        let (slope, curve) = (self.slope(at), self.curvature(at));
        let first = strain.distortion();
        let second = strain.second_distortion(&first);
        let mut out = Symmetric3::zero(at.d);
        // 2 W_a ∂D/∂F + 2 W_b ∂B/∂F + W_d ∂N/∂F, grouped by the type of the terms.
        let trace = trace3(&strain.green);
        let mut inner = scaled3(slope.b * -4.0, &strain.green);
        let diagonal = slope.a * 2.0 + slope.b * (trace + trace.like(1.0)) * 4.0;
        for (i, row) in inner.iter_mut().enumerate() {
            row[i] = row[i] + diagonal;
        }
        out.add_geometric(&inner);
        out.add_second_invariant(slope.b * 2.0, &strain.f);
        out.add_cofactor_slope(slope.d - slope.a * 2.0 - slope.b * 4.0, &strain.f);
        // Half of Σ W_ij G_i⊗G_j plus its transpose, where G is 2 D, 2 B and N.
        let mut with_first = scaled3(curve.aa * 2.0, &first);
        add_scaled3(&mut with_first, curve.ab * 4.0, &second);
        out.add_pair(&first, &with_first);
        out.add_pair(&second, &scaled3(curve.bb * 2.0, &second));
        let mut with_normal = scaled3(curve.dd * 0.5, &strain.cofactor);
        add_scaled3(&mut with_normal, curve.ad * 2.0, &first);
        add_scaled3(&mut with_normal, curve.bd * 2.0, &second);
        out.add_pair(&strain.cofactor, &with_normal);
        out
    }
}

impl<R: Real> Symmetric3<R> {
    /// Adds m (2 F_iJ F_kL − F_iL F_kJ − (F Fᵀ)_ik δ_JL), which is m ∂B/∂F without its geometric and cofactor
    /// terms.
    #[inline(always)]
    fn add_second_invariant(&mut self, m: R, f: &Tensor3Of<R>) {
        let mf = scaled3(m, f);
        for i in 0..3 {
            for k in i..3 {
                let left = mf[i][2].mul_add(f[k][2], mf[i][1].mul_add(f[k][1], mf[i][0] * f[k][0]));
                for j in 0..3 {
                    for l in 0..3 {
                        if i == k && l < j {
                            continue;
                        }
                        let entry = &mut self.0[UPPER3[3 * i + j][3 * k + l]];
                        let direct = (mf[i][j] * 2.0).mul_add(f[k][l], *entry);
                        *entry = direct - mf[i][l] * f[k][j];
                        if j == l {
                            *entry = *entry - left;
                        }
                    }
                }
            }
        }
    }
}
