//! The matrices of the muscle and their positions in a formulation's Jacobian.
//!
//! Each [`Equation`](crate::equation::Equation) describes its Jacobian by [`Term`]s. A term consists of a matrix, the
//! block of unknowns that the matrix multiplies, and its coefficients in ∂F/∂y and ∂F/∂ẏ. In every formulation, the
//! matrix `a ∂F/∂y + b ∂F/∂ẏ` is therefore a sum of a few matrices in one fixed pattern. Condensed and complex Newton
//! matrices are the same sum with other coefficients.

use crate::field::Field;

/// A matrix whose rows and columns are free displacement components (`n_free`), vertices (`n_vertices`) or unknown
/// tensions (`n_tensions`).
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
    /// Transpose of ∂(B(q) v)/∂q with each pressure scaled by β/β_body.
    DampedDivergenceRateTransposed,
    /// ∂/∂q of the forces on the deformed boundary: follower pressures and contacts.
    PressureStiffness,
    /// Symmetric part of `PressureStiffness`, used in Newton's method in 3D.
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
    /// ∂/∂q of the force of active and viscous stresses and of friction; symmetric unless one of these forces depends
    /// on v.
    AddedStiffness,
    /// Symmetric part of `AddedStiffness`, used in Newton's method if all other matrices are symmetric.
    AddedSymmetricStiffness,
    /// ∂/∂v of the same force; symmetric.
    AddedDamping,
    /// ∂/∂T of the force of active stresses, `n_free × n_tensions`.
    TensionForce,
    /// I, `n_tensions × n_tensions`.
    TensionIdentity,
    /// −∂Ṫ/∂T of the activation models, diagonal.
    TensionDecay,
    /// Stiffness that results from the elimination, for one value of c, of oscillators that act on the elements that
    /// drive them.
    CoherenceStiffness,
    /// Damping that results from the same elimination.
    CoherenceDamping,
    /// ∂/∂q ∫F H:∇φ at constant overstress H = Σ g S − Σ Q.
    RelaxingGeometric,
    /// ∂/∂q ∫F S:∇φ at constant F in the regions of the Prony series with this index. After the internal stresses are
    /// eliminated, its coefficient is φ(c) − 1 of this series.
    RelaxingStiffness(usize),
}

/// Pattern that determines the order of the values of a matrix.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Pattern {
    DisplacementIdentity,
    PressureIdentity,
    TensionIdentity,
    /// Entries that couple the same component of two nodes.
    Mass,
    FoundationStiffness,
    FoundationDamping,
    Tensions,
    Displacement,
    Pressure,
    Divergence,
}

/// Origin of the values of a matrix.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Source {
    /// Independent of the state.
    Constant,
    /// Computed at each state.
    Computed,
    /// Transpose of another matrix, with the same stored values.
    TransposeOf(Matrix),
    /// Transpose of another matrix with scaled rows.
    ScaledRows(Matrix),
    /// Symmetric part of another matrix.
    SymmetricPartOf(Matrix),
    /// Computed together with the other tangents of viscoelastic stress.
    Relaxation,
    /// Computed by the linear solver of coupled systems.
    Coherence,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Properties {
    pub(crate) pattern: Pattern,
    pub(crate) source: Source,
    /// The transposed matrix, if any. The stiffness of added stresses is treated as symmetric: if it is unsymmetric,
    /// its symmetric part is used.
    pub(crate) transpose: Option<Matrix>,
}

impl Matrix {
    pub(crate) fn properties(self) -> Properties {
        use Matrix::*;
        use Source::*;
        let symmetric = Some(self);
        let (pattern, source, transpose) = match self {
            DisplacementIdentity => (Pattern::DisplacementIdentity, Constant, symmetric),
            PressureIdentity => (Pattern::PressureIdentity, Constant, symmetric),
            TensionIdentity => (Pattern::TensionIdentity, Constant, None),
            Mass | DampingMass => (Pattern::Mass, Constant, symmetric),
            PressureMass => (Pattern::Pressure, Constant, symmetric),
            FoundationStiffness => (Pattern::FoundationStiffness, Constant, symmetric),
            FoundationDamping => (Pattern::FoundationDamping, Constant, symmetric),
            Stiffness | MultiplierStiffness | AddedStiffness | AddedDamping => {
                (Pattern::Displacement, Computed, symmetric)
            }
            RateStiffness | DampedStiffness | PressureStiffness => {
                (Pattern::Displacement, Computed, None)
            }
            PressureSymmetricStiffness => {
                let source = SymmetricPartOf(PressureStiffness);
                (Pattern::Displacement, source, symmetric)
            }
            AddedSymmetricStiffness => {
                let source = SymmetricPartOf(AddedStiffness);
                (Pattern::Displacement, source, symmetric)
            }
            Divergence => (Pattern::Divergence, Computed, Some(DivergenceTransposed)),
            DivergenceTransposed => {
                let source = TransposeOf(Divergence);
                (Pattern::Divergence, source, Some(Divergence))
            }
            DivergenceRate => {
                let transpose = Some(DivergenceRateTransposed);
                (Pattern::Divergence, Computed, transpose)
            }
            DivergenceRateTransposed => {
                let source = TransposeOf(DivergenceRate);
                (Pattern::Divergence, source, Some(DivergenceRate))
            }
            DampedDivergenceTransposed => (Pattern::Divergence, ScaledRows(Divergence), None),
            DampedDivergenceRateTransposed => {
                (Pattern::Divergence, ScaledRows(DivergenceRate), None)
            }
            TensionForce => (Pattern::Tensions, Computed, None),
            TensionDecay => (Pattern::TensionIdentity, Computed, None),
            CoherenceStiffness | CoherenceDamping => (Pattern::Displacement, Coherence, None),
            RelaxingGeometric | RelaxingStiffness(_) => {
                (Pattern::Displacement, Relaxation, symmetric)
            }
        };
        Properties { pattern, source, transpose }
    }
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
        Self { column, matrix, df_dy: coefficient, df_dyp: 0.0 }
    }

    /// Returns a term of ∂F/∂ẏ.
    pub fn rate(column: Field, matrix: Matrix, coefficient: f64) -> Self {
        Self { column, matrix, df_dy: 0.0, df_dyp: coefficient }
    }
}
