//! From a potential W(e, d) to tensors. Scalar code, inlined into loops over lanes.
//!
//! With D = H − cof H, N = cof F, d and e as in the [module above](super), W_e for ∂W/∂e and so on:
//!
//! ```text
//! P = 2 W_e D + (W_d − p) N
//! A = ∂P/∂F = 2 W_e 𝔻 + 4 W_ee D⊗D + 2 W_ed (D⊗N + N⊗D) + W_dd N⊗N + (W_d − p) ℂ
//! ```
//!
//! where 𝔻 and ℂ are the constant maps G → G − cof G and G → cof G. Rates are derivatives along V.

use super::potential::{First, Potential, Second};
use super::{Tangent, Tensor};

/// What acts on the volume besides W: a pressure, or the penalty energy κ/2 d² in its place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Volumetric {
    pub(crate) p: f64,
    pub(crate) p_rate: f64,
    pub(crate) kappa: f64,
}

impl Volumetric {
    #[inline(always)]
    pub(crate) fn pressure(p: f64) -> Self {
        Self {
            p,
            p_rate: 0.0,
            kappa: 0.0,
        }
    }
}

/// A symmetric derivative of a tensor by a tensor: the upper triangle of [`Tangent`] by rows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Symmetric(pub(crate) [f64; 10]);

/// Place of (row, column), row ≤ column, in [`Symmetric`].
pub(crate) const UPPER: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 4, 5, 6], [2, 5, 7, 8], [3, 6, 8, 9]];

impl Symmetric {
    pub(crate) fn full(self) -> Tangent {
        UPPER.map(|row| row.map(|place| self.0[place]))
    }

    /// a 𝔻 + c ℂ.
    #[inline(always)]
    fn constant_maps(a: f64, c: f64) -> Self {
        Self([a, 0.0, 0.0, c - a, a, a - c, 0.0, a, 0.0, a])
    }

    /// Adds x⊗y + y⊗x.
    #[inline(always)]
    fn add_pair(&mut self, x: Tensor, y: Tensor) {
        let (x, y) = (flat(x), flat(y));
        for r in 0..4 {
            for c in r..4 {
                self.0[UPPER[r][c]] += x[r] * y[c] + y[r] * x[c];
            }
        }
    }
}

#[inline(always)]
fn flat(t: Tensor) -> [f64; 4] {
    [t[0][0], t[0][1], t[1][0], t[1][1]]
}

/// x : y.
#[inline(always)]
pub(crate) fn contract(x: Tensor, y: Tensor) -> f64 {
    x[0][0] * y[0][0] + x[0][1] * y[0][1] + x[1][0] * y[1][0] + x[1][1] * y[1][1]
}

/// a x + b y.
#[inline(always)]
fn combine(a: f64, x: Tensor, b: f64, y: Tensor) -> Tensor {
    let entry = |i: usize, j: usize| a * x[i][j] + b * y[i][j];
    [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]]
}

/// a x.
#[inline(always)]
pub(crate) fn scaled(a: f64, x: Tensor) -> Tensor {
    [[a * x[0][0], a * x[0][1]], [a * x[1][0], a * x[1][1]]]
}

#[inline(always)]
fn sum(x: Tensor, y: Tensor) -> Tensor {
    combine(1.0, x, 1.0, y)
}

/// D = H − cof H, half of ∂e/∂F: symmetric and traceless.
#[inline(always)]
fn distortion(h: Tensor) -> Tensor {
    let (stretch, shear) = (h[0][0] - h[1][1], h[0][1] + h[1][0]);
    [[stretch, shear], [shear, -stretch]]
}

/// e = |F|² − 2 J.
#[inline(always)]
pub(crate) fn distortion_measure(h: Tensor) -> f64 {
    let [[stretch, shear], _] = distortion(h);
    stretch * stretch + shear * shear
}

/// d = J − 1 (finite) or div u (small strains).
#[inline(always)]
pub(crate) fn dilation<W: Potential>(_: &W, h: Tensor) -> f64 {
    let trace = h[0][0] + h[1][1];
    if W::FINITE {
        trace + (h[0][0] * h[1][1] - h[0][1] * h[1][0])
    } else {
        trace
    }
}

/// N = ∂d/∂F: cof F or I.
#[inline(always)]
pub(crate) fn volume_gradient<W: Potential>(_: &W, h: Tensor) -> Tensor {
    if W::FINITE {
        [[1.0 + h[1][1], -h[1][0]], [-h[0][1], 1.0 + h[0][0]]]
    } else {
        [[1.0, 0.0], [0.0, 1.0]]
    }
}

/// Ṅ = cof V or 0.
#[inline(always)]
pub(crate) fn volume_gradient_rate<W: Potential>(_: &W, v: Tensor) -> Tensor {
    if W::FINITE {
        [[v[1][1], -v[1][0]], [-v[0][1], v[0][0]]]
    } else {
        [[0.0; 2]; 2]
    }
}

/// m ℂ: the derivative of m N for constant m.
#[inline(always)]
pub(crate) fn volume_tangent<W: Potential>(_: &W, m: f64) -> Symmetric {
    Symmetric::constant_maps(0.0, if W::FINITE { m } else { 0.0 })
}

#[inline(always)]
pub(crate) fn energy<W: Potential>(w: &W, h: Tensor) -> f64 {
    w.energy(distortion_measure(h), dilation(w, h))
}

/// W_e and W_d with the volumetric part: κ d − p is added to the latter.
#[inline(always)]
fn first<W: Potential>(w: &W, e: f64, d: f64, volumetric: Volumetric) -> First {
    let slope = w.first(e, d);
    First {
        d: slope.d + volumetric.kappa * d - volumetric.p,
        ..slope
    }
}

#[inline(always)]
fn second<W: Potential>(w: &W, e: f64, d: f64, volumetric: Volumetric) -> Second {
    let slope = w.second(e, d);
    Second {
        dd: slope.dd + volumetric.kappa,
        ..slope
    }
}

/// P = 2 W_e D + (W_d − p) N.
#[inline(always)]
pub(crate) fn stress<W: Potential>(w: &W, h: Tensor, volumetric: Volumetric) -> Tensor {
    let slope = first(w, distortion_measure(h), dilation(w, h), volumetric);
    combine(2.0 * slope.e, distortion(h), slope.d, volume_gradient(w, h))
}

/// Ṗ = 2 (W_e)˙ D + 2 W_e Ḋ + ((W_d)˙ − ṗ) N + (W_d − p) Ṅ.
#[inline(always)]
pub(crate) fn stress_rate<W: Potential>(
    w: &W,
    h: Tensor,
    v: Tensor,
    volumetric: Volumetric,
) -> Tensor {
    let (e, d) = (distortion_measure(h), dilation(w, h));
    let (distortion_h, normal) = (distortion(h), volume_gradient(w, h));
    let (e_rate, d_rate) = (2.0 * contract(distortion_h, v), contract(normal, v));
    let slope = first(w, e, d, volumetric);
    let curve = second(w, e, d, volumetric);
    let slope_e_rate = curve.ee * e_rate + curve.ed * d_rate;
    let slope_d_rate = curve.ed * e_rate + curve.dd * d_rate - volumetric.p_rate;
    sum(
        combine(
            2.0 * slope_e_rate,
            distortion_h,
            2.0 * slope.e,
            distortion(v),
        ),
        combine(slope_d_rate, normal, slope.d, volume_gradient_rate(w, v)),
    )
}

/// A = ∂P/∂F.
#[inline(always)]
pub(crate) fn tangent<W: Potential>(w: &W, h: Tensor, volumetric: Volumetric) -> Symmetric {
    let (e, d) = (distortion_measure(h), dilation(w, h));
    let (distortion, normal) = (distortion(h), volume_gradient(w, h));
    let slope = first(w, e, d, volumetric);
    let curve = second(w, e, d, volumetric);
    let mut a = Symmetric::constant_maps(2.0 * slope.e, if W::FINITE { slope.d } else { 0.0 });
    // With M = 2 W_ee D + 2 W_ed N: D⊗M + M⊗D holds both terms in D; likewise for N.
    a.add_pair(
        distortion,
        combine(2.0 * curve.ee, distortion, 2.0 * curve.ed, normal),
    );
    a.add_pair(normal, combine(0.5 * curve.dd, normal, 0.0, normal));
    a
}

/// Ȧ, the derivative of A along V; equals ∂Ṗ/∂F.
#[inline(always)]
pub(crate) fn tangent_rate<W: Potential>(
    w: &W,
    h: Tensor,
    v: Tensor,
    volumetric: Volumetric,
) -> Symmetric {
    let (e, d) = (distortion_measure(h), dilation(w, h));
    let (distortion_h, normal) = (distortion(h), volume_gradient(w, h));
    let (distortion_v, normal_rate) = (distortion(v), volume_gradient_rate(w, v));
    let (e_rate, d_rate) = (2.0 * contract(distortion_h, v), contract(normal, v));
    let curve = second(w, e, d, volumetric);
    let third = w.third(e, d);
    let slope_e_rate = curve.ee * e_rate + curve.ed * d_rate;
    let slope_d_rate = curve.ed * e_rate + curve.dd * d_rate - volumetric.p_rate;
    let ee_rate = third.eee * e_rate + third.eed * d_rate;
    let ed_rate = third.eed * e_rate + third.edd * d_rate;
    let dd_rate = third.edd * e_rate + third.ddd * d_rate;

    let mut a = Symmetric::constant_maps(
        2.0 * slope_e_rate,
        if W::FINITE { slope_d_rate } else { 0.0 },
    );
    // The rate of D⊗M + M⊗D with M = 2 W_ee D + 2 W_ed N, terms collected by D and N.
    let m_rate = sum(
        combine(2.0 * ee_rate, distortion_h, 4.0 * curve.ee, distortion_v),
        combine(2.0 * ed_rate, normal, 2.0 * curve.ed, normal_rate),
    );
    a.add_pair(distortion_h, m_rate);
    let n_part = sum(
        combine(0.5 * dd_rate, normal, curve.dd, normal_rate),
        combine(2.0 * curve.ed, distortion_v, 0.0, normal),
    );
    a.add_pair(normal, n_part);
    a
}
