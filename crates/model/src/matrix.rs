//! The matrices of the muscle and their positions in a formulation's Jacobian.
//!
//! Each [`Equation`](crate::equation::Equation) lists its Jacobian as [`Term`]s: a matrix, the
//! block of unknowns it multiplies, and its coefficients in ∂F/∂y and ∂F/∂ẏ. The matrix `a ∂F/∂y +
//! b ∂F/∂ẏ` is then a sum of few matrices in one fixed pattern for every formulation. Condensed and
//! complex Newton matrices are the same sum with other coefficients.

use crate::field::Field;

/// A matrix over free displacement components (`n_free`) and vertices (`n_vertices`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Matrix {
    /// I, `n_free × n_free`.
    DisplacementIdentity,
    /// I, `n_vertices × n_vertices`.
    PressureIdentity,
    /// M = ∫ρ φ_i·φ_j.
    Mass,
    /// M_p = ∫ψ_i ψ_j with each element matrix scaled by κ_body/κ.
    PressureMass,
    /// M with each element matrix scaled by α/α_body; used only if α varies between elements.
    DampingMass,
    /// K = ∂/∂q ∫P:∇φ at the current state.
    Stiffness,
    /// ∂/∂q ∫Ṗ:∇φ with each element matrix scaled by β/β_body.
    RateStiffness,
    /// K with each element matrix scaled by β/β_body; used only if β varies between elements.
    DampedStiffness,
    /// B(q)ᵀ with each pressure scaled by β/β_body; used only if β varies between elements.
    DampedDivergenceTransposed,
    /// Transpose of ∂(B(q) v)/∂q with the same scaling.
    DampedDivergenceRateTransposed,
    /// ∂/∂q of follower pressure loads on the deformed boundary.
    PressureStiffness,
    /// Its symmetric part, used in Newton's method in 3D.
    PressureSymmetricStiffness,
    /// B(q), `n_vertices × n_free`.
    Divergence,
    /// B(q)ᵀ.
    DivergenceTransposed,
    /// ∂(B(q) v)/∂q.
    DivergenceRate,
    /// Transpose of `DivergenceRate`, equal to ∂(-∂/∂q(B(q)ᵀλ) v)/∂(-λ).
    DivergenceRateTransposed,
    /// ∂(B(q)ᵀμ)/∂q.
    MultiplierStiffness,
    /// Σ k R: stiffness of elastic foundations, constant.
    FoundationStiffness,
    /// Σ c R: damping of elastic foundations, constant.
    FoundationDamping,
    /// ∂/∂q of the force of active and viscous stresses; symmetric unless one depends on v.
    AddedStiffness,
    /// Its symmetric part, used in Newton's method where all other matrices are symmetric.
    AddedSymmetricStiffness,
    /// ∂/∂v of the force of active and viscous stresses; symmetric.
    AddedDamping,
    /// ∂/∂T of the force of active stresses, `n_free × n_tensions`.
    TensionForce,
    /// I, `n_tensions × n_tensions`.
    TensionIdentity,
    /// −∂Ṫ/∂T of the activation models, diagonal.
    TensionDecay,
    /// Contribution to the stiffness of oscillators that act back on their own elements, after
    /// their elimination for one c.
    CoherenceStiffness,
    /// Their contribution to the damping.
    CoherenceDamping,
    /// ∂/∂q ∫F H:∇φ at constant overstress H = Σ g S − Σ Q.
    RelaxingGeometric,
    /// ∂/∂q ∫F S:∇φ at constant F in the regions of Prony series number n. Once the internal
    /// stresses are eliminated, its coefficient is φ(c) − 1 of that series.
    RelaxingStiffness(usize),
}

/// `(a · df_dy + b · df_dyp) · matrix` in the columns of one block of unknowns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Term {
    /// Block of unknowns that the matrix multiplies.
    pub column: Field,
    /// Matrix of the term.
    pub matrix: Matrix,
    /// Coefficient in ∂F/∂y.
    pub df_dy: f64,
    /// Coefficient in ∂F/∂ẏ.
    pub df_dyp: f64,
}

impl Term {
    /// Returns a term of ∂F/∂y.
    pub fn value(column: Field, matrix: Matrix, coefficient: f64) -> Self {
        Self {
            column,
            matrix,
            df_dy: coefficient,
            df_dyp: 0.0,
        }
    }

    /// Returns a term of ∂F/∂ẏ.
    pub fn rate(column: Field, matrix: Matrix, coefficient: f64) -> Self {
        Self {
            column,
            matrix,
            df_dy: 0.0,
            df_dyp: coefficient,
        }
    }
}
