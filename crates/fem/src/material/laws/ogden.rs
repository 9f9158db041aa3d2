//! Ogden's law, a sum of powers of the principal stretches.
//!
//! With the traceless logarithmic strain L = ln Ū and its invariants q = tr L²/2 and r = det L, the sum of powers
//! of the modified stretches is an entire function of q and r,
//!
//! ```text
//! t(α) = Σ λ̄ᵢ^α − 3 = tr exp(α L) − 3 = Σ_{n≥2} αⁿ tr Lⁿ/n!,    tr Lⁿ = q tr Lⁿ⁻² + r tr Lⁿ⁻³
//! ```
//!
//! Therefore neither this sum nor its derivatives require principal stretches, and equal stretches are not a
//! special case. The series is summed for a small multiple of L. The exponential of this multiple is then squared
//! repeatedly with `tr X² = (tr X)² − 2 tr X⁻¹` for det X = 1. Conversely, q and r follow from t(2) = Ī1 − 3 and
//! t(−2) = Ī2 − 3 by repeated square roots.

use super::mooney_rivlin::MooneyRivlin;
use crate::material::Real;
use crate::material::parameters::{Described, Description, Parameter, Range};
use crate::material::three::{Curvature, Invariants, Isotropic, Slope};

/// Ogden's law `W = Σ μ_i/α_i (λ̄1^α_i + λ̄2^α_i + λ̄3^α_i − 3)` of rubber, brain and fat, with up to six terms.
///
/// Source: Ogden (1972), Proceedings of the Royal Society A 326, 565–584. The initial shear modulus is Σ μ_i α_i/2
/// and must be positive. Programs that write `2 μ_i/α_i²` or `c_i/m_i²` define other constants. Multiply those
/// constants by 2/α_i or 1/m_i, respectively.
///
/// A term with μ_i = 0 is skipped. For stretches between 0.05 and 20, the relative error is close to rounding.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)] // μ_i in Pa and α_i of each term
pub struct Ogden {
    pub mu_1: f64,
    pub alpha_1: f64,
    pub mu_2: f64,
    pub alpha_2: f64,
    pub mu_3: f64,
    pub alpha_3: f64,
    pub mu_4: f64,
    pub alpha_4: f64,
    pub mu_5: f64,
    pub alpha_5: f64,
    pub mu_6: f64,
    pub alpha_6: f64,
}

const fn coefficient(name: &'static str) -> Parameter {
    Parameter::new(name, "Pa", Range::Finite, "Coefficient of the term")
}

const fn exponent(name: &'static str) -> Parameter {
    Parameter::new(name, "", Range::Finite, "Exponent of the term, not 0")
}

impl Described for Ogden {
    const DESCRIPTION: Description = Description {
        name: "ogden",
        energy: "Σ mu_i/alpha_i (λ̄1^alpha_i + λ̄2^alpha_i + λ̄3^alpha_i - 3)",
        about: "One to six terms; initial shear modulus Σ mu_i alpha_i/2.",
        parameters: &[
            coefficient("mu_1"),
            exponent("alpha_1"),
            coefficient("mu_2").or(0.0),
            exponent("alpha_2").or(0.0),
            coefficient("mu_3").or(0.0),
            exponent("alpha_3").or(0.0),
            coefficient("mu_4").or(0.0),
            exponent("alpha_4").or(0.0),
            coefficient("mu_5").or(0.0),
            exponent("alpha_5").or(0.0),
            coefficient("mu_6").or(0.0),
            exponent("alpha_6").or(0.0),
        ],
        complete: false,
    };
}

/// Function of q and r, with its derivatives.
#[derive(Clone, Copy)]
struct Jet<R> {
    value: R,
    q: R,
    r: R,
    qq: R,
    qr: R,
    rr: R,
}

impl<R: Real> Jet<R> {
    /// Returns a x + y.
    #[inline(always)]
    fn mul_add(a: R, x: &Self, y: &Self) -> Self {
        Self {
            value: a.mul_add(x.value, y.value),
            q: a.mul_add(x.q, y.q),
            r: a.mul_add(x.r, y.r),
            qq: a.mul_add(x.qq, y.qq),
            qr: a.mul_add(x.qr, y.qr),
            rr: a.mul_add(x.rr, y.rr),
        }
    }

    /// Returns t(2α) = t² + 6 t − 2 u from t = t(α) and u = t(−α).
    #[inline(always)]
    fn squared(t: &Self, u: &Self) -> Self {
        let trace = t.value + t.value.like(3.0);
        Self {
            value: t.value * (trace + trace.like(3.0)) - u.value * 2.0,
            q: (trace * t.q - u.q) * 2.0,
            r: (trace * t.r - u.r) * 2.0,
            qq: (t.q.mul_add(t.q, trace * t.qq) - u.qq) * 2.0,
            qr: (t.q.mul_add(t.r, trace * t.qr) - u.qr) * 2.0,
            rr: (t.r.mul_add(t.r, trace * t.rr) - u.rr) * 2.0,
        }
    }
}

/// Number of terms of the series. The error is 3e-17 for eigenvalues of 0.375, which occur at a stretch of 20.
const TERMS: usize = 14;

/// The values 1/n!.
const INVERSE_FACTORIALS: [f64; TERMS + 5] = {
    let mut all = [1.0; TERMS + 5];
    let (mut n, mut factorial) = (1, 1.0);
    while n < TERMS + 5 {
        factorial *= n as f64;
        all[n] = 1.0 / factorial;
        n += 1;
    }
    all
};

/// Returns the sums of c_m/(m + shift)! over even and over odd m.
#[inline(always)]
fn sums<R: Real>(c: &[R; TERMS], shift: usize) -> [R; 2] {
    let mut out = [c[0].like(0.0); 2];
    for m in (0..TERMS).rev() {
        out[m % 2] = c[m].mul_add(c[m].like(INVERSE_FACTORIALS[m + shift]), out[m % 2]);
    }
    out
}

/// Returns t(1) and t(−1) for small q and r.
///
/// With the complete homogeneous polynomials h of the eigenvalues, `tr Lⁿ = 2 q hₙ₋₂ + 3 r hₙ₋₃`. The derivatives
/// with respect to q and r are n hₙ₋₂ and n hₙ₋₃. The sequence h has the generating function 1/D with D = 1 − q z²
/// − r z³. The derivatives of h have the generating functions z²/D² and z³/D². The sequence g belongs to 1/D².
#[inline(always)]
fn series<R: Real>(q: R, r: R) -> [Jet<R>; 2] {
    let (zero, one) = (q.like(0.0), q.like(1.0));
    let mut h = [zero; TERMS];
    h[0] = one;
    h[2] = q;
    for m in 3..TERMS {
        h[m] = q.mul_add(h[m - 2], r * h[m - 3]);
    }
    let mut g = h;
    g[2] = q * 2.0;
    for m in 3..TERMS {
        g[m] = h[m] + q.mul_add(g[m - 2], r * g[m - 3]);
    }
    let (first, second, third) = (sums(&h, 1), sums(&h, 2), sums(&h, 3));
    let (qq, qr, rr) = (sums(&g, 3), sums(&g, 4), sums(&g, 5));
    let (q2, r3) = (q * 2.0, r * 3.0);
    // Separate sums of the terms of even and odd degree in L.
    let even = Jet {
        value: q2.mul_add(second[0], r3 * third[1]),
        q: first[0],
        r: second[1],
        qq: qq[0],
        qr: qr[1],
        rr: rr[0],
    };
    let odd = Jet {
        value: q2.mul_add(second[1], r3 * third[0]),
        q: first[1],
        r: second[0],
        qq: qq[1],
        qr: qr[0],
        rr: rr[1],
    };
    [Jet::mul_add(one, &odd, &even), Jet::mul_add(one * -1.0, &odd, &even)]
}

/// Returns t(α) and t(−α).
#[inline(always)]
fn traces<R: Real>(q: R, r: R, alpha: f64) -> [Jet<R>; 2] {
    let (mut c, mut squarings) = (alpha, 0);
    while c.abs() > 0.125 {
        c *= 0.5;
        squarings += 1;
    }
    let (c2, c3) = (c * c, c * c * c);
    let mut out = series(q * c2, r * c3);
    for jet in &mut out {
        jet.q = jet.q * c2;
        jet.r = jet.r * c3;
        jet.qq = jet.qq * (c2 * c2);
        jet.qr = jet.qr * (c2 * c3);
        jet.rr = jet.rr * (c3 * c3);
    }
    for _ in 0..squarings {
        let [t, u] = &out;
        out = [Jet::squared(t, u), Jet::squared(u, t)];
    }
    out
}

/// Returns t(1) and t(−1) from t(2) and t(−2). For stretches between 0.05 and 20, six Newton steps converge,
/// including an extra step for the derivatives.
#[inline(always)]
fn square_root<R: Real>([first, second]: [R; 2]) -> [R; 2] {
    let (three, six) = (first.like(3.0), first.like(6.0));
    let other = (second + three) * 3.0;
    let mut u = other.sqrt();
    let mut t = (first + three + u * 2.0).sqrt() - three;
    u = u - three;
    for _ in 0..6 {
        let t_residual = t.mul_add(t + six, u * -2.0) - first;
        let u_residual = u.mul_add(u + six, t * -2.0) - second;
        let (t_slope, u_slope) = (t * 2.0 + six, u * 2.0 + six);
        let scale = t.like(1.0) / (t_slope * u_slope - t.like(4.0));
        t = t - u_slope.mul_add(t_residual, u_residual * 2.0) * scale;
        u = u - t_slope.mul_add(u_residual, t_residual * 2.0) * scale;
    }
    [t, u]
}

/// Returns q and r from t(2) and t(−2).
#[inline(always)]
fn logarithm<R: Real>(mut traces: [R; 2]) -> [R; 2] {
    for _ in 0..4 {
        traces = square_root(traces);
    }
    // These are traces of exp(±L/8). The even and odd terms in L/8 determine q/64 and r/512.
    let even = (traces[0] + traces[1]) * 0.5;
    let odd = (traces[0] - traces[1]) * 0.5;
    let (mut q, mut r) = (even, odd * 2.0);
    for _ in 0..4 {
        let [t, u] = series(q, r);
        let t_residual = t.value - traces[0];
        let u_residual = u.value - traces[1];
        let scale = q.like(1.0) / (t.q * u.r - t.r * u.q);
        q = q - (u.r * t_residual - t.r * u_residual) * scale;
        r = r - (t.q * u_residual - u.q * t_residual) * scale;
    }
    [q * 64.0, r * 512.0]
}

const FIRST: MooneyRivlin = MooneyRivlin { c10: 1.0, c01: 0.0 };
const SECOND: MooneyRivlin = MooneyRivlin { c10: 0.0, c01: 1.0 };

/// Derivatives of W with respect to Ī1 and Ī2.
struct Derivatives<R> {
    first: [R; 2],
    /// Derivatives in the order 11, 12, 22.
    second: [R; 3],
}

impl Ogden {
    /// Returns the pair (μ_i, α_i) of each term.
    #[inline(always)]
    pub(in crate::material) fn terms(&self) -> [(f64, f64); 6] {
        [
            (self.mu_1, self.alpha_1),
            (self.mu_2, self.alpha_2),
            (self.mu_3, self.alpha_3),
            (self.mu_4, self.alpha_4),
            (self.mu_5, self.alpha_5),
            (self.mu_6, self.alpha_6),
        ]
    }

    /// Returns q and r of the logarithmic strain.
    #[inline(always)]
    fn strain<R: Real>(at: Invariants<R>) -> [R; 2] {
        let (first, _) = at.isochoric_first();
        logarithm([first, Isotropic::energy(&SECOND, at)])
    }

    /// Returns W as a function of q and r.
    #[inline(always)]
    fn sum<R: Real>(&self, q: R, r: R) -> Jet<R> {
        let zero = q.like(0.0);
        let mut sum = Jet { value: zero, q: zero, r: zero, qq: zero, qr: zero, rr: zero };
        for (mu, alpha) in self.terms() {
            if mu != 0.0 {
                let [t, _] = traces(q, r, alpha);
                sum = Jet::mul_add(q.like(mu / alpha), &t, &sum);
            }
        }
        sum
    }

    #[inline(always)]
    fn derivatives<R: Real>(&self, at: Invariants<R>) -> Derivatives<R> {
        let [q, r] = Self::strain(at);
        let w = self.sum(q, r);
        let [t, u] = traces(q, r, 2.0);
        // Chain rule: W_q = W_1 t_q + W_2 u_q, and similarly for r.
        let scale = q.like(1.0) / (t.q * u.r - t.r * u.q);
        let first = [(w.q * u.r - w.r * u.q) * scale, (w.r * t.q - w.q * t.r) * scale];
        // Derivatives of q and r with respect to the invariants.
        let (q1, q2) = (u.r * scale, -(t.r * scale));
        let (r1, r2) = (-(u.q * scale), t.q * scale);
        let qq = w.qq - first[0] * t.qq - first[1] * u.qq;
        let qr = w.qr - first[0] * t.qr - first[1] * u.qr;
        let rr = w.rr - first[0] * t.rr - first[1] * u.rr;
        let (along_1, along_2) = (qq * q1 + qr * r1, qq * q2 + qr * r2);
        let (across_1, across_2) = (qr * q1 + rr * r1, qr * q2 + rr * r2);
        Derivatives {
            first,
            second: [
                q1 * along_1 + r1 * across_1,
                q1 * along_2 + r1 * across_2,
                q2 * along_2 + r2 * across_2,
            ],
        }
    }
}

impl Isotropic for Ogden {
    #[inline(always)]
    fn energy<R: Real>(&self, at: Invariants<R>) -> R {
        let [q, r] = Self::strain(at);
        self.sum(q, r).value
    }

    #[inline(always)]
    fn slope<R: Real>(&self, at: Invariants<R>) -> Slope<R> {
        let w = self.derivatives(at);
        let first = FIRST.slope(at).scaled(w.first[0]);
        let second = SECOND.slope(at).scaled(w.first[1]);
        Slope { a: first.a, b: second.b, d: first.d + second.d }
    }

    #[inline(always)]
    fn curvature<R: Real>(&self, at: Invariants<R>) -> Curvature<R> {
        let w = self.derivatives(at);
        let ([w1, w2], [w11, w12, w22]) = (w.first, w.second);
        let (first, second) = (FIRST.slope(at), SECOND.slope(at));
        let (first_curve, second_curve) = (FIRST.curvature(at), SECOND.curvature(at));
        // Derivatives of W_1 and W_2 with respect to d.
        let w1d = w11 * first.d + w12 * second.d;
        let w2d = w12 * first.d + w22 * second.d;
        Curvature {
            aa: w11 * first.a * first.a,
            ab: w12 * first.a * second.b,
            bb: w22 * second.b * second.b,
            ad: w1 * first_curve.ad + w1d * first.a,
            bd: w2 * second_curve.bd + w2d * second.b,
            dd: w1 * first_curve.dd + w2 * second_curve.dd + w1d * first.d + w2d * second.d,
        }
    }
}

#[cfg(test)]
mod tests;
