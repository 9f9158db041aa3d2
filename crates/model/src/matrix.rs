//! The matrices of the muscle and their places in a formulation's Jacobian.
//!
//! Each [`Equation`](crate::equation::Equation) lists its Jacobian as [`Term`]s: a matrix, the
//! unknowns it acts on, and its coefficients in ∂F/∂y and ∂F/∂ẏ. The whole of
//! `a ∂F/∂y + b ∂F/∂ẏ` is then a sum of few matrices into one fixed pattern, whatever the
//! formulation; a condensed or complex Newton matrix is the same sum with other coefficients.

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
    /// M_p = ∫ψ_i ψ_j, each element's multiplied by κ_body/κ.
    PressureMass,
    /// M with each element's multiplied by α/α_body; only where elements differ.
    DampingMass,
    /// K = ∂/∂q ∫P:∇φ, at the present state.
    Stiffness,
    /// ∂/∂q ∫Ṗ:∇φ, each element's multiplied by β/β_body.
    RateStiffness,
    /// K with each element's multiplied by β/β_body; only where elements differ.
    DampedStiffness,
    /// B(q)ᵀ with each pressure multiplied by its β/β_body; only where elements differ.
    DampedDivergenceTransposed,
    /// The same for the transpose of ∂(B(q) v)/∂q.
    DampedDivergenceRateTransposed,
    /// ∂/∂q of the load by pressures on the deformed boundary.
    PressureStiffness,
    /// Its symmetric part, what Newton's method takes for it in space.
    PressureSymmetricStiffness,
    /// B(q), `n_vertices × n_free`.
    Divergence,
    /// B(q)ᵀ.
    DivergenceTransposed,
    /// ∂(B(q) v)/∂q.
    DivergenceRate,
    /// Its transpose, = ∂(-∂/∂q(B(q)ᵀλ) v)/∂(-λ).
    DivergenceRateTransposed,
    /// ∂(B(q)ᵀμ)/∂q.
    MultiplierStiffness,
    /// Σ k R: the stiffness of beds, constant.
    BedStiffness,
    /// Σ c R: the damping of beds, constant.
    BedDamping,
    /// ∂/∂q of the force of active and viscous stresses; symmetric unless one depends on v.
    AddedStiffness,
    /// Its symmetric part, what Newton's method takes for it where all the rest is symmetric.
    AddedSymmetricStiffness,
    /// ∂/∂v of the same; symmetric.
    AddedDamping,
    /// ∂/∂T of the same, `n_free × n_tensions`.
    TensionForce,
    /// I, `n_tensions × n_tensions`.
    TensionIdentity,
    /// −∂Ṫ/∂T of the models of activation, diagonal.
    TensionDecay,
    /// What oscillators that act back on their own elements do to the stiffness, once they are
    /// eliminated for one c.
    CoherenceStiffness,
    /// The same for the damping.
    CoherenceDamping,
    /// ∂/∂q ∫F H:∇φ under constant overstress H = Σ g S − Σ Q.
    RelaxingGeometric,
    /// ∂/∂q ∫F S:∇φ under constant F, where the stress relaxes by Prony series of this number; once
    /// the internal stresses are eliminated, its coefficient is φ(c) − 1 of the series.
    RelaxingStiffness(usize),
}

/// `(a · of_value + b · of_rate) · matrix` in the columns of one block of unknowns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Term {
    /// The block of unknowns the matrix acts on.
    pub column: Field,
    /// The matrix.
    pub matrix: Matrix,
    /// Its coefficient in ∂F/∂y.
    pub of_value: f64,
    /// Its coefficient in ∂F/∂ẏ.
    pub of_rate: f64,
}

impl Term {
    /// A term of ∂F/∂y.
    pub fn value(column: Field, matrix: Matrix, coefficient: f64) -> Self {
        Self {
            column,
            matrix,
            of_value: coefficient,
            of_rate: 0.0,
        }
    }

    /// A term of ∂F/∂ẏ.
    pub fn rate(column: Field, matrix: Matrix, coefficient: f64) -> Self {
        Self {
            column,
            matrix,
            of_value: 0.0,
            of_rate: coefficient,
        }
    }
}
