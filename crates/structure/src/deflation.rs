//! Deflation of a pencil: the constraints are solved and removed step by step.
//!
//! Consider one step for E ẋ + A x = f. The orthogonal compression of the rows, E = (U₁ U₂) (U₁ᵀE; 0), yields the
//! constraints U₂ᵀ A x = U₂ᵀ f. For a regular pencil, these constraints are linearly independent. With an
//! orthogonal basis (W Z), where Z spans the kernel of G = U₂ᵀA, the unknowns are x = W y + Z x' with G W y = U₂ᵀ
//! f. The smaller square pencil (U₁ᵀE Z, U₁ᵀA Z) remains for x'. This is the Wong sequence V ← A⁻¹(E V) in
//! orthonormal bases (Kunkel and Mehrmann, section 2.1). The index is the number of steps until E is non-singular;
//! linearly dependent constraints indicate a singular pencil.

use nalgebra::DMatrix;

use crate::jacobi::left_svd;
use crate::rank::RankDecision;

/// One deflation step, in the notation of the module documentation.
pub(crate) struct DeflationStep {
    pub(crate) u1: DMatrix<f64>,
    pub(crate) u2: DMatrix<f64>,
    pub(crate) w: DMatrix<f64>,
    pub(crate) z: DMatrix<f64>,
    /// The matrix G W, lower triangular and non-singular.
    pub(crate) gw: DMatrix<f64>,
    /// The matrix U₁ᵀE W.
    pub(crate) ew: DMatrix<f64>,
    /// The matrix U₁ᵀA W.
    pub(crate) aw: DMatrix<f64>,
}

/// All deflation steps and the result.
pub(crate) struct Deflation {
    pub(crate) steps: Vec<DeflationStep>,
    pub(crate) decisions: Vec<RankDecision>,
    pub(crate) end: End,
}

pub(crate) enum End {
    /// The remaining pencil is an ordinary differential equation: E is non-singular, possibly of size zero.
    Regular { e: DMatrix<f64>, a: DMatrix<f64> },
    /// The pencil is singular and has `nullity` dependent constraints.
    Singular { nullity: usize },
}

/// Deflates the scaled pencil.
pub(crate) fn deflate(mut e: DMatrix<f64>, mut a: DMatrix<f64>) -> Deflation {
    let (e_size, a_size) = (typical_row(&e), typical_row(&a));
    let mut steps = Vec::new();
    let mut decisions = Vec::new();
    loop {
        if e.is_empty() {
            return Deflation { steps, decisions, end: End::Regular { e, a } };
        }
        let (values, u) = left_svd(&e);
        let subject = format!("rank of E after {} steps", steps.len());
        let rank_e = RankDecision::new(subject, &values, e_size);
        let rank = rank_e.rank;
        decisions.push(rank_e);
        if rank == e.nrows() {
            return Deflation { steps, decisions, end: End::Regular { e, a } };
        }
        let u1 = u.columns(0, rank).into_owned();
        let u2 = u.columns(rank, u.ncols() - rank).into_owned();

        let g = u2.tr_mul(&a);
        let (w, z, gw) = kernel(&g);
        let subject = format!("rank of the constraints of step {}", steps.len() + 1);
        let rank_g = RankDecision::new(subject, &left_svd(&gw).0, a_size);
        let nullity = rank_g.nullity();
        decisions.push(rank_g);
        if nullity > 0 {
            return Deflation { steps, decisions, end: End::Singular { nullity } };
        }
        let (u1e, u1a) = (u1.tr_mul(&e), u1.tr_mul(&a));
        (e, a) = (&u1e * &z, &u1a * &z);
        steps.push(DeflationStep { ew: u1e * &w, aw: u1a * &w, u1, u2, w, z, gw });
    }
}

/// Returns orthonormal bases (W, Z) with G Z = 0, and the product G W, from Gᵀ = (W Z) (R; 0).
fn kernel(g: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>) {
    let (n_constraints, n) = g.shape();
    let qr = g.transpose().qr();
    let mut q_transposed = DMatrix::identity(n, n);
    qr.q_tr_mul(&mut q_transposed);
    let q = q_transposed.transpose();
    let w = q.columns(0, n_constraints).into_owned();
    let z = q.columns(n_constraints, n - n_constraints).into_owned();
    let gw = g * &w;
    (w, z, gw)
}

/// Returns the root mean square of the row norms.
fn typical_row(matrix: &DMatrix<f64>) -> f64 {
    matrix.norm() / (matrix.nrows().max(1) as f64).sqrt()
}
