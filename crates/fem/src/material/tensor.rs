//! Stress and tangent of a potential W(e, d), evaluated with `f64` or vector registers.
//!
//! With D = H − cof H, N = cof F, d and e as in the [parent module](super), and W_e = ∂W/∂e etc.:
//!
//! ```text
//! P = 2 W_e D + (W_d − p) N
//! A = ∂P/∂F = 2 W_e 𝔻 + 4 W_ee D⊗D + 2 W_ed (D⊗N + N⊗D) + W_dd N⊗N + (W_d − p) ℂ
//! ```
//!
//! Here 𝔻 and ℂ are the constant maps G → G − cof G and G → cof G. Rates are derivatives along V.
//!
//! [`Strain`] holds the quantities at a point that several results share. Subexpressions that occur in several
//! results are written identically, so that the compiler evaluates them once.

use super::potential::Potential;
use super::{Dual, PlaneCurvature, PlaneSlope, Real};

/// 2 × 2 tensor.
pub(crate) type TensorOf<R> = [[R; 2]; 2];

/// Function g(J) in the volumetric energy κ/2 g². The pressure is p = −κ g, and the energy with a pressure
/// contains −p g. For κ = ∞, the constraint is g = 0, and all functions are equivalent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum VolumeFunction {
    /// g = J − 1.
    #[default]
    Quadratic,
    /// g = ln J.
    Logarithmic,
}

impl VolumeFunction {
    /// Returns g at d = J − 1.
    #[inline(always)]
    pub(crate) fn value<R: Real>(self, d: R) -> R {
        match self {
            Self::Quadratic => d,
            Self::Logarithmic => d.ln_1p(),
        }
    }

    /// Returns g'.
    #[inline(always)]
    pub(crate) fn slope<R: Real>(self, d: R) -> R {
        let one = d.like(1.0);
        match self {
            Self::Quadratic => one,
            Self::Logarithmic => one / (d + one),
        }
    }

    /// Returns g''.
    #[inline(always)]
    pub(crate) fn curvature<R: Real>(self, d: R) -> R {
        match self {
            Self::Quadratic => d.like(0.0),
            Self::Logarithmic => {
                let slope = self.slope(d);
                -(slope * slope)
            }
        }
    }
}

/// Volumetric terms added to W: a pressure, or the penalty energy κ/2 g².
#[derive(Debug, Clone, Copy)]
pub(crate) struct Volumetric<R> {
    pub(crate) p: R,
    pub(crate) p_rate: R,
    pub(crate) kappa: f64,
}

impl<R: Real> Volumetric<R> {
    /// Creates the terms for a constant pressure.
    #[inline(always)]
    pub(crate) fn pressure(p: R) -> Self {
        Self { p, p_rate: p.like(0.0), kappa: 0.0 }
    }

    /// Returns the terms as dual numbers. The derivative of p is its rate.
    #[inline(always)]
    pub(crate) fn moving(self) -> Volumetric<Dual<R>> {
        Volumetric {
            p: Dual { value: self.p, rate: self.p_rate },
            p_rate: Dual::constant(self.p_rate.like(0.0)),
            kappa: self.kappa,
        }
    }
}

/// Symmetric derivative of a tensor with respect to a tensor. The upper triangle is stored row by row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Symmetric<R>(pub(crate) [R; 10]);

/// Index of the entry (row, column) in [`Symmetric`].
pub(crate) const UPPER: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 4, 5, 6], [2, 5, 7, 8], [3, 6, 8, 9]];

impl<R: Real> Symmetric<R> {
    /// Returns a 𝔻 + c ℂ.
    #[inline(always)]
    fn constant_maps(a: R, c: R) -> Self {
        let zero = a.like(0.0);
        Self([a, zero, zero, c - a, a, a - c, zero, a, zero, a])
    }

    /// Adds x⊗y + y⊗x.
    #[inline(always)]
    fn add_pair(&mut self, x: TensorOf<R>, y: TensorOf<R>) {
        let (x, y) = (in_plane(x), in_plane(y));
        for r in 0..4 {
            for c in r..4 {
                let entry = &mut self.0[UPPER[r][c]];
                *entry = x[r].mul_add(y[c], y[r].mul_add(x[c], *entry));
            }
        }
    }
}

/// Returns m ℂ, the derivative of m N at constant m.
#[inline(always)]
pub(crate) fn volume_tangent<W: Potential, R: Real>(_: &W, m: R) -> Symmetric<R> {
    let zero = m.like(0.0);
    Symmetric::constant_maps(zero, if W::FINITE { m } else { zero })
}

#[inline(always)]
fn in_plane<R: Real>(t: TensorOf<R>) -> [R; 4] {
    [t[0][0], t[0][1], t[1][0], t[1][1]]
}

/// Returns x : y.
#[inline(always)]
pub(crate) fn contract<R: Real>(x: TensorOf<R>, y: TensorOf<R>) -> R {
    let first = x[0][0].mul_add(y[0][0], x[0][1] * y[0][1]);
    x[1][0].mul_add(y[1][0], x[1][1].mul_add(y[1][1], first))
}

/// Returns a x + b y.
#[inline(always)]
fn combine<R: Real>(a: R, x: TensorOf<R>, b: R, y: TensorOf<R>) -> TensorOf<R> {
    let mut out = scaled(b, y);
    for i in 0..2 {
        for j in 0..2 {
            out[i][j] = a.mul_add(x[i][j], out[i][j]);
        }
    }
    out
}

/// Returns a x.
#[inline(always)]
pub(crate) fn scaled<R: Real>(a: R, x: TensorOf<R>) -> TensorOf<R> {
    [[a * x[0][0], a * x[0][1]], [a * x[1][0], a * x[1][1]]]
}

#[inline(always)]
fn sum<R: Real>(x: TensorOf<R>, y: TensorOf<R>) -> TensorOf<R> {
    [[x[0][0] + y[0][0], x[0][1] + y[0][1]], [x[1][0] + y[1][0], x[1][1] + y[1][1]]]
}

/// Returns G − cof G, which is symmetric and traceless. For G = H, it is half of ∂e/∂F.
#[inline(always)]
fn distortion<R: Real>(g: TensorOf<R>) -> TensorOf<R> {
    let (stretch, shear) = (g[0][0] - g[1][1], g[0][1] + g[1][0]);
    [[stretch, shear], [shear, -stretch]]
}

/// Returns Ṅ, which is cof V, or 0 for small strains.
#[inline(always)]
pub(crate) fn volume_gradient_rate<W: Potential, R: Real>(_: &W, v: TensorOf<R>) -> TensorOf<R> {
    if W::FINITE { [[v[1][1], -v[1][0]], [-v[0][1], v[0][0]]] } else { [[v[0][0].like(0.0); 2]; 2] }
}

/// Deformation at a point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Strain<R> {
    /// Invariant e = |F|² − 2 J.
    pub(crate) e: R,
    /// Invariant d = J − 1 (finite strains) or div u (small strains).
    pub(crate) d: R,
    /// Tensor D = H − cof H.
    distortion: TensorOf<R>,
    /// Tensor N = ∂d/∂F: cof F, or I for small strains.
    pub(crate) cofactor: TensorOf<R>,
    /// Factor of the energy W. `None` means one.
    pub(crate) factor: Option<R>,
}

impl<R: Real> Strain<R> {
    #[inline(always)]
    pub(crate) fn new<W: Potential>(_: &W, h: TensorOf<R>) -> Self {
        let distortion = distortion(h);
        let [[stretch, shear], _] = distortion;
        let trace = h[0][0] + h[1][1];
        let one = trace.like(1.0);
        let (d, cofactor) = if W::FINITE {
            let det = h[0][0] * h[1][1] - h[0][1] * h[1][0];
            let cofactor = [[one + h[1][1], -h[1][0]], [-h[0][1], one + h[0][0]]];
            (trace + det, cofactor)
        } else {
            let zero = one.like(0.0);
            (trace, [[one, zero], [zero, one]])
        };
        Self { e: stretch.mul_add(stretch, shear * shear), d, distortion, cofactor, factor: None }
    }

    /// Multiplies a derivative of W by the factor.
    #[inline(always)]
    fn times_factor(&self, derivative: R) -> R {
        match self.factor {
            Some(factor) => factor * derivative,
            None => derivative,
        }
    }

    /// Returns W_e and W_d. The latter includes the volumetric term κ d − p.
    #[inline(always)]
    fn first<W: Potential>(&self, w: &W, volumetric: Volumetric<R>) -> PlaneSlope<R> {
        let slope = w.first(self.e, self.d);
        PlaneSlope {
            e: self.times_factor(slope.e),
            d: if W::COMPLETE {
                self.times_factor(slope.d) - volumetric.p
            } else {
                self.times_factor(slope.d) + self.d * volumetric.kappa - volumetric.p
            },
        }
    }

    #[inline(always)]
    fn second<W: Potential>(&self, w: &W, volumetric: Volumetric<R>) -> PlaneCurvature<R> {
        let slope = w.second(self.e, self.d);
        PlaneCurvature {
            ee: self.times_factor(slope.ee),
            ed: self.times_factor(slope.ed),
            dd: if W::COMPLETE {
                self.times_factor(slope.dd)
            } else {
                self.times_factor(slope.dd) + self.d.like(volumetric.kappa)
            },
        }
    }

    /// Returns the second derivatives of W times the factor, with the rates along ė and ḋ.
    #[inline(always)]
    fn moving_second<W: Potential>(&self, w: &W, e_rate: R, d_rate: R) -> PlaneCurvature<Dual<R>> {
        let moving = |value, rate| Dual { value, rate };
        let curve = w.second(moving(self.e, e_rate), moving(self.d, d_rate));
        let times_factor = |entry: Dual<R>| Dual {
            value: self.times_factor(entry.value),
            rate: self.times_factor(entry.rate),
        };
        PlaneCurvature {
            ee: times_factor(curve.ee),
            ed: times_factor(curve.ed),
            dd: times_factor(curve.dd),
        }
    }

    /// Returns ė and ḋ.
    #[inline(always)]
    fn rates(&self, v: TensorOf<R>) -> (R, R) {
        (contract(self.distortion, v) * 2.0, contract(self.cofactor, v))
    }

    /// Returns P = 2 W_e D + (W_d − p) N.
    #[inline(always)]
    pub(crate) fn stress<W: Potential>(&self, w: &W, volumetric: Volumetric<R>) -> TensorOf<R> {
        let slope = self.first(w, volumetric);
        combine(slope.e * 2.0, self.distortion, slope.d, self.cofactor)
    }

    /// Returns Ṗ = 2 (W_e)˙ D + 2 W_e Ḋ + ((W_d)˙ − ṗ) N + (W_d − p) Ṅ.
    #[inline(always)]
    pub(crate) fn stress_rate<W: Potential>(
        &self,
        w: &W,
        v: TensorOf<R>,
        volumetric: Volumetric<R>,
    ) -> TensorOf<R> {
        let (e_rate, d_rate) = self.rates(v);
        let slope = self.first(w, volumetric);
        let curve = self.second(w, volumetric);
        let slope_e_rate = curve.ee.mul_add(e_rate, curve.ed * d_rate);
        let slope_d_rate = curve.ed.mul_add(e_rate, curve.dd * d_rate) - volumetric.p_rate;
        sum(
            combine(slope_e_rate * 2.0, self.distortion, slope.e * 2.0, distortion(v)),
            combine(slope_d_rate, self.cofactor, slope.d, volume_gradient_rate(w, v)),
        )
    }

    /// Returns ḋ = N : V.
    #[inline(always)]
    pub(crate) fn dilation_rate(&self, v: TensorOf<R>) -> R {
        contract(self.cofactor, v)
    }

    /// Returns A = ∂P/∂F.
    #[inline(always)]
    pub(crate) fn tangent<W: Potential>(&self, w: &W, volumetric: Volumetric<R>) -> Symmetric<R> {
        let slope = self.first(w, volumetric);
        let curve = self.second(w, volumetric);
        let mut a = Symmetric::constant_maps(
            slope.e * 2.0,
            if W::FINITE { slope.d } else { slope.d.like(0.0) },
        );
        // Here, M = 2 W_ee D + 2 W_ed N. The pair D⊗M + M⊗D contains all terms with D, and the next pair contains
        // the term with N only.
        let m = combine(curve.ee * 2.0, self.distortion, curve.ed * 2.0, self.cofactor);
        a.add_pair(self.distortion, m);
        a.add_pair(self.cofactor, scaled(curve.dd * 0.5, self.cofactor));
        a
    }

    /// Returns Ȧ, the derivative of A along V, which equals ∂Ṗ/∂F.
    #[inline(always)]
    pub(crate) fn tangent_rate<W: Potential>(
        &self,
        w: &W,
        v: TensorOf<R>,
        volumetric: Volumetric<R>,
    ) -> Symmetric<R> {
        let (distortion_v, cofactor_rate) = (distortion(v), volume_gradient_rate(w, v));
        let (e_rate, d_rate) = self.rates(v);
        let curve = self.second(w, volumetric);
        let moving = self.moving_second(w, e_rate, d_rate);
        let slope_e_rate = curve.ee.mul_add(e_rate, curve.ed * d_rate);
        let slope_d_rate = curve.ed.mul_add(e_rate, curve.dd * d_rate) - volumetric.p_rate;
        let [ee_rate, ed_rate, dd_rate] = [moving.ee.rate, moving.ed.rate, moving.dd.rate];

        let mut a = Symmetric::constant_maps(
            slope_e_rate * 2.0,
            if W::FINITE { slope_d_rate } else { e_rate.like(0.0) },
        );
        // Rate of D⊗M + M⊗D with M = 2 W_ee D + 2 W_ed N. The terms are grouped by D and N.
        let m_rate = sum(
            combine(ee_rate * 2.0, self.distortion, curve.ee * 4.0, distortion_v),
            combine(ed_rate * 2.0, self.cofactor, curve.ed * 2.0, cofactor_rate),
        );
        a.add_pair(self.distortion, m_rate);
        let n_part = sum(
            combine(dd_rate * 0.5, self.cofactor, curve.dd, cofactor_rate),
            scaled(curve.ed * 2.0, distortion_v),
        );
        a.add_pair(self.cofactor, n_part);
        a
    }
}

impl Strain<f64> {
    /// Returns W.
    pub(crate) fn energy<W: Potential>(&self, w: &W) -> f64 {
        w.energy(self.e, self.d)
    }
}
