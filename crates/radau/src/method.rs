//! Coefficients of the Radau IIA methods, and the eigenvectors that decouple the stage equations.

mod construction;

use nalgebra::DMatrix;
use num_complex::Complex64;

use construction::{
    derivative, lagrange, lagrange_derivative, modes, radau_nodes, ramp, start_basis, weights,
};

/// A real eigenvalue λ of A⁻¹ with its right and left eigenvectors, normalized to ℓ·r = 1.
#[derive(Debug, Clone, PartialEq)]
pub struct RealMode {
    /// Eigenvalue λ.
    pub lambda: f64,
    /// Right eigenvector r, with A⁻¹ r = λ r.
    pub right: Vec<f64>,
    /// Left eigenvector ℓ, with ℓ A⁻¹ = λ ℓ.
    pub left: Vec<f64>,
}

/// A complex eigenvalue λ of A⁻¹ with positive imaginary part, and its right and left eigenvectors, normalized to
/// ℓ·r = 1 (without conjugation).
#[derive(Debug, Clone, PartialEq)]
pub struct ComplexMode {
    /// Eigenvalue λ.
    pub lambda: Complex64,
    /// Right eigenvector r, with A⁻¹ r = λ r.
    pub right: Vec<Complex64>,
    /// Left eigenvector ℓ, with ℓ A⁻¹ = λ ℓ.
    pub left: Vec<Complex64>,
}

/// A Radau IIA method: collocation at the zeros of P_s − P_{s−1}, the last of which is 1.
///
/// The method has order 2s − 1 and stage order s. It is L-stable. Its last stage is the solution at the end of the
/// step, so algebraic equations are satisfied there. Only odd s are supported: A⁻¹ then has exactly one real
/// eigenvalue, whose matrix also filters the error estimate.
///
/// Let z_i = Y_i − y_n be the stage increments and A⁻¹ = Σ_k λ_k r_k ℓ_kᵀ, where k runs over the real mode, the complex
/// modes and their conjugates. The sn × sn Newton system
///
/// ```text
/// (I ⊗ J_y + h⁻¹ A⁻¹ ⊗ J_ẏ) Δz = −G
/// ```
///
/// decouples into (J_y + λ_k/h J_ẏ) w_k = −Σ_i ℓ_ki G_i with Δz_i = Σ_k r_ki w_k. These are one real and (s − 1)/2
/// complex systems of order n.
///
/// # Examples
/// ```
/// let method = myovib_radau::Method::radau_iia(3)?;
/// assert_eq!(method.order(), 5);
/// assert!((method.nodes()[0] - (4.0 - 6f64.sqrt()) / 10.0).abs() < 1e-15);
/// # Ok::<(), myovib_radau::RadauError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Method {
    nodes: Vec<f64>,
    /// Coefficients of the ramp in ascending powers of θ.
    ramp: Vec<f64>,
    /// Coefficients of ℓ_0 and its first two derivatives in ascending powers of θ.
    start_basis: [Vec<f64>; 3],
    a_inverse: DMatrix<f64>,
    weights: Vec<f64>,
    real: RealMode,
    complex: Vec<ComplexMode>,
}

impl Method {
    /// Creates the method with s `stages`.
    ///
    /// All coefficients follow from the nodes: A⁻¹ differentiates polynomials that vanish at 0, (A⁻¹)_ij = ℓ_j'(c_i)
    /// with the Lagrange polynomials on {0, c_1, …, c_s}.
    ///
    /// # Errors
    /// Returns [`RadauError::Stages`](crate::RadauError::Stages) unless `stages` is 1, 3, 5 or 7. With 9 or more
    /// stages, the coefficients lose digits.
    pub fn radau_iia(stages: usize) -> Result<Self, crate::RadauError> {
        if !matches!(stages, 1 | 3 | 5 | 7) {
            return Err(crate::RadauError::Stages { stages });
        }
        let nodes = radau_nodes(stages);
        let a_inverse =
            DMatrix::from_fn(stages, stages, |i, j| lagrange_derivative(&nodes, j, nodes[i]));
        let (real, complex) = modes(&a_inverse);
        let weights = weights(&a_inverse);
        let start_basis = start_basis(&nodes);
        let slope = derivative(&start_basis);
        Ok(Self {
            ramp: ramp(&start_basis),
            start_basis: [start_basis, slope.clone(), derivative(&slope)],
            nodes,
            a_inverse,
            weights,
            real,
            complex,
        })
    }

    /// Returns the number of stages s.
    pub fn stages(&self) -> usize {
        self.nodes.len()
    }

    /// Returns the classical order, 2s − 1.
    pub fn order(&self) -> usize {
        2 * self.stages() - 1
    }

    /// Returns the nodes c_1 < … < c_s = 1.
    pub fn nodes(&self) -> &[f64] {
        &self.nodes
    }

    /// Returns entry (i, j) of A⁻¹; i and j are zero-based indices.
    pub fn a_inverse(&self, i: usize, j: usize) -> f64 {
        self.a_inverse[(i, j)]
    }

    /// Returns the weights b_i of the quadrature ∫_0^1 f ≈ Σ_i b_i f(c_i).
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Returns the mode of the real eigenvalue of A⁻¹.
    pub fn real_mode(&self) -> &RealMode {
        &self.real
    }

    /// Returns the modes of the complex eigenvalues of A⁻¹ with positive imaginary part.
    pub fn complex_modes(&self) -> &[ComplexMode] {
        &self.complex
    }

    /// Returns λ/h for each complex mode.
    pub(crate) fn shifts(&self, h: f64) -> Vec<Complex64> {
        self.complex.iter().map(|mode| mode.lambda / h).collect()
    }

    /// Returns ℓ_j(θ), the Lagrange polynomial on {0, c_1, …, c_s} that equals 1 at node j, with j counted from 0.
    pub(crate) fn basis(&self, j: usize, theta: f64) -> f64 {
        lagrange(&self.nodes, j, theta)
    }

    /// Writes ℓ_j(c_i × `ratio`) row by row. These are the values at the stages of a step that is longer by the factor
    /// `ratio`.
    pub(crate) fn write_bases(&self, ratio: f64, out: &mut Vec<f64>) {
        out.clear();
        for c in &self.nodes {
            out.extend((0..self.stages()).map(|j| self.basis(j, c * ratio)));
        }
    }

    /// Returns r(θ), the polynomial of degree s + 1 with r(0) = 0, r'(0) = 1 and r'(c_i) = 0. If s > 1, r(1) is also 0.
    /// If s = 1, such a polynomial does not exist, and r = 0.
    pub(crate) fn ramp(&self, theta: f64) -> f64 {
        theta * self.ramp.iter().rev().fold(0.0, |sum, a| sum * theta + a)
    }

    /// Returns the maximum of |r| over the unit interval, sampled at 31 points; see [`ramp`](Method::ramp).
    pub(crate) fn largest_ramp(&self) -> f64 {
        (1..32).map(|k| self.ramp(f64::from(k) / 32.0).abs()).fold(0.0, f64::max)
    }

    /// Returns ∫_0^θ τ ℓ_0(τ) dτ, which has a double zero at 0 and whose derivative is zero at the nodes.
    pub(crate) fn second_ramp(&self, theta: f64) -> f64 {
        let terms = self.start_basis[0].iter().enumerate().rev();
        let sum = terms.fold(0.0, |sum, (k, c)| sum * theta + c / (k as f64 + 2.0));
        theta * theta * sum
    }

    /// Returns r'(θ); see [`ramp`](Method::ramp).
    pub(crate) fn ramp_derivative(&self, theta: f64) -> f64 {
        let powers = self.ramp.iter().enumerate().rev();
        powers.fold(0.0, |sum, (k, a)| sum * theta + (k as f64 + 1.0) * a)
    }

    /// Returns ℓ_0(θ) = Π (1 − θ/c_i), the Lagrange polynomial on {0, c_1, …, c_s} that equals 1 at 0, or its first or
    /// second derivative.
    pub(crate) fn start_basis(&self, derivative: usize, theta: f64) -> f64 {
        let powers = self.start_basis[derivative].iter().rev();
        powers.fold(0.0, |sum, a| sum * theta + a)
    }

    /// Returns ℓ_j'(θ); see [`basis`](Method::basis).
    pub(crate) fn basis_derivative(&self, j: usize, theta: f64) -> f64 {
        lagrange_derivative(&self.nodes, j, theta)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ODD: [usize; 4] = [1, 3, 5, 7];

    /// Returns a bound for rounding errors, which are amplified by the condition number of the eigenvector matrix. This
    /// number grows with s.
    fn rounding(stages: usize) -> f64 {
        f64::EPSILON * 10f64.powi(stages as i32 / 2 + 1)
    }

    #[test]
    fn nodes_and_eigenvalues_of_three_stages_have_their_closed_forms() {
        let method = Method::radau_iia(3).unwrap();
        let root6 = 6f64.sqrt();
        let nodes = [(4.0 - root6) / 10.0, (4.0 + root6) / 10.0, 1.0];
        for (c, exact) in method.nodes().iter().zip(nodes) {
            assert!((c - exact).abs() < rounding(1), "{c} {exact}");
        }
        // The expected values are the eigenvalues of A in Hairer & Wanner IV.8, inverted.
        let (a, b) = (81f64.cbrt(), 9f64.cbrt());
        let gamma = 30.0 / (6.0 + a - b);
        let of_a = Complex64::new((12.0 - a + b) / 60.0, 3f64.sqrt() * (a + b) / 60.0);
        let pair = of_a.conj() / of_a.norm_sqr();
        assert!((method.real.lambda - gamma).abs() < rounding(3));
        assert!(
            (method.complex[0].lambda - if pair.im > 0.0 { pair } else { pair.conj() }).norm()
                < rounding(3)
        );
    }

    /// Checks that ∫ θ^k = 1/(k + 1) up to degree 2s − 2.
    #[test]
    fn weights_integrate_polynomials_exactly() {
        for s in ODD {
            let method = Method::radau_iia(s).unwrap();
            for k in 0..2 * s - 1 {
                let values = method.nodes().iter().map(|c| c.powi(k as i32));
                let sum: f64 = values.zip(method.weights()).map(|(f, b)| b * f).sum();
                assert!((sum - 1.0 / (k + 1) as f64).abs() < rounding(s), "{s} {k}");
            }
        }
    }

    #[test]
    fn modes_compose_the_inverse_of_a() {
        for s in ODD {
            let method = Method::radau_iia(s).unwrap();
            assert_eq!(method.complex.len(), (s - 1) / 2);
            for i in 0..s {
                for j in 0..s {
                    let RealMode { lambda, right, left } = &method.real;
                    let real = lambda * right[i] * left[j];
                    let complex: Complex64 =
                        method.complex.iter().map(|m| m.lambda * m.right[i] * m.left[j]).sum();
                    let composed = real + 2.0 * complex.re;
                    let scale = method.a_inverse.amax();
                    assert!(
                        (composed - method.a_inverse(i, j)).abs() < rounding(s) * scale,
                        "s = {s}: {composed} {}",
                        method.a_inverse(i, j)
                    );
                }
            }
        }
    }

    #[test]
    fn the_ramp_rises_only_at_0() {
        for s in [3, 5, 7] {
            let method = Method::radau_iia(s).unwrap();
            assert_eq!((method.ramp(0.0), method.ramp_derivative(0.0)), (0.0, 1.0));
            // r(1) = ∫ Π (1 − τ/c_i) dτ. The quadrature at the nodes c_i computes this integral exactly, and the result
            // is 0.
            assert!(method.ramp(1.0).abs() < rounding(s), "s = {s}");
            for &theta in method.nodes() {
                assert!(method.ramp_derivative(theta).abs() < 10.0 * rounding(s), "s = {s}");
            }
            let (d, theta) = (1e-4, 0.3 * method.nodes()[0]);
            let difference = method.ramp(theta + d) - method.ramp(theta - d);
            let slope = difference / (2.0 * d);
            // The error is d² r'''/6, where r' decreases from 1 at 0 to 0 at c_1.
            let allowed = (d / method.nodes()[0]).powi(2);
            assert!((slope - method.ramp_derivative(theta)).abs() < allowed, "s = {s}");
        }
    }

    #[test]
    fn order_conditions_hold() {
        for s in ODD {
            let method = Method::radau_iia(s).unwrap();
            let a = method.a_inverse.clone().try_inverse().unwrap();
            for k in 1..=2 * s - 1 {
                // B(2s − 1): Σ b_j c_j^(k−1) = 1/k, where b is the last row of A.
                let sum: f64 =
                    (0..s).map(|j| a[(s - 1, j)] * method.nodes[j].powi(k as i32 - 1)).sum();
                assert!((sum - 1.0 / k as f64).abs() < rounding(s), "B({k}), s = {s}: {sum}");
            }
            for k in 1..=s {
                for i in 0..s {
                    // C(s): Σ a_ij c_j^(k−1) = c_i^k / k.
                    let sum: f64 =
                        (0..s).map(|j| a[(i, j)] * method.nodes[j].powi(k as i32 - 1)).sum();
                    let exact = method.nodes[i].powi(k as i32) / k as f64;
                    assert!((sum - exact).abs() < rounding(s), "C({k}), s = {s}: {sum} {exact}");
                }
            }
            for k in 1..s {
                for j in 0..s {
                    // D(s − 1): Σ b_i c_i^(k−1) a_ij = b_j (1 − c_j^k) / k.
                    let sum: f64 = (0..s)
                        .map(|i| a[(s - 1, i)] * method.nodes[i].powi(k as i32 - 1) * a[(i, j)])
                        .sum();
                    let exact = a[(s - 1, j)] * (1.0 - method.nodes[j].powi(k as i32)) / k as f64;
                    assert!((sum - exact).abs() < rounding(s), "D({k}), s = {s}: {sum} {exact}");
                }
            }
        }
    }

    #[test]
    fn even_and_large_numbers_of_stages_are_refused() {
        for stages in [0, 2, 4, 9] {
            assert!(matches!(
                Method::radau_iia(stages),
                Err(crate::RadauError::Stages { stages: s }) if s == stages
            ));
        }
    }

    #[test]
    fn the_basis_is_nodal_and_its_derivative_differentiates() {
        let method = Method::radau_iia(3).unwrap();
        for j in 0..3 {
            assert_eq!(method.basis(j, 0.0), 0.0);
            for (i, &c) in method.nodes().iter().enumerate() {
                assert!((method.basis(j, c) - f64::from(u8::from(i == j))).abs() < rounding(1));
            }
            // For the cubic polynomial, the error of a central difference is h²/6 times the third derivative.
            let (theta, h) = (0.3, 1e-4);
            let difference = (method.basis(j, theta + h) - method.basis(j, theta - h)) / (2.0 * h);
            assert!((difference - method.basis_derivative(j, theta)).abs() < 1e-6);
        }
    }
}
