//! Perturbation index of each variable, which depends on the highest derivative of a perturbation that the variable
//! contains.
//!
//! In the Laplace domain, the solution of E ẋ + A x = δ is x = (sE + A)⁻¹ δ. The resolvent (sE + A)⁻¹ of a regular
//! pencil is the sum of a strictly proper part and a polynomial H₀ + s H₁ + … + s^(k−1) H_(k−1), where k is the
//! index. Row i of H_j is non-zero if x_i contains the j-th derivative of δ and not only integrals of δ. The
//! perturbation index of x_i is the degree of row i plus one, or zero if the row vanishes. In Weierstrass form
//! with the nilpotent block N, H_j = T₂ (−N)^j S₂.
//!
//! The polynomial follows from the deflation steps. The right-hand side F(s) is a polynomial in s. Each step maps
//! it to the right-hand side F'(s) of the smaller pencil:
//!
//!   y = (G W)⁻¹ U₂ᵀF,   F' = U₁ᵀF - (U₁ᵀA W + s U₁ᵀE W) y,   x = W y + Z x'.

use nalgebra::DMatrix;

use crate::deflation::DeflationStep;

/// A polynomial in s with matrix coefficients. The constant term comes first.
pub(crate) type Polynomial = Vec<DMatrix<f64>>;

/// Returns the polynomial part of (sE + A)⁻¹, given the deflation steps and the final matrices (E, A).
pub(crate) fn resolvent_polynomial(
    steps: &[DeflationStep],
    e: &DMatrix<f64>,
    a: &DMatrix<f64>,
) -> Polynomial {
    let n = steps.first().map_or(e.nrows(), |step| step.u1.nrows());
    let mut right: Polynomial = vec![DMatrix::identity(n, n)];
    let mut solved: Vec<Polynomial> = Vec::new();
    for step in steps {
        let gw = step.gw.clone().lu();
        let solve = |f: &DMatrix<f64>| {
            gw.solve(&step.u2.tr_mul(f)).expect("the constraints are linearly independent")
        };
        let y: Polynomial = right.iter().map(solve).collect();
        let mut next: Polynomial = right.iter().map(|f| step.u1.tr_mul(f)).collect();
        next.push(DMatrix::zeros(step.u1.ncols(), n));
        for (j, y_j) in y.iter().enumerate() {
            next[j] -= &step.aw * y_j;
            next[j + 1] -= &step.ew * y_j;
        }
        right = next;
        solved.push(y);
    }
    let mut x = divide(&right, e, a);
    for (step, y) in steps.iter().zip(&solved).rev() {
        x = (0..x.len().max(y.len()))
            .map(|j| {
                let own = y.get(j).map(|y_j| &step.w * y_j);
                let rest = x.get(j).map(|x_j| &step.z * x_j);
                own.into_iter().chain(rest).sum()
            })
            .collect();
    }
    x
}

/// Returns the polynomial part of (sE + A)⁻¹ F(s) for a non-singular E. It is computed by polynomial division: E
/// X_(j−1) = F_j − A X_j.
fn divide(f: &Polynomial, e: &DMatrix<f64>, a: &DMatrix<f64>) -> Polynomial {
    if e.is_empty() {
        return f[1..].to_vec();
    }
    let e = e.clone().lu();
    let mut quotient: Polynomial = Vec::new();
    for f_j in f[1..].iter().rev() {
        let remainder = quotient.last().map_or_else(|| f_j.clone(), |x_j| f_j - a * x_j);
        quotient.push(e.solve(&remainder).expect("E is non-singular"));
    }
    quotient.reverse();
    quotient
}
