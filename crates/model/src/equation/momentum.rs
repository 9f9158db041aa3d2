//! Balance of momentum.

use super::{Context, PressureRateSource};
use crate::field::Field;
use crate::matrix::{Matrix, Term};
use crate::state::Integrals;

/// Writes M (v̇ + α v) + ∫(P + β Ṗ + added stresses):∇φ + foundations + friction - f(t, q) for the
/// free components.
pub(super) fn residual(context: &Context, integrals: &mut Integrals<'_>, rows: &mut [f64]) {
    integrals.momentum_balance(context.alpha, context.beta, rows);
}

/// Returns the terms of the Jacobian. P = P_iso - p cof F gives ∂(force)/∂λ = -Bᵀ and, for the
/// damping force, ∂(force rate)/∂v = K, ∂(force rate)/∂λ = -∂(B(q)v)/∂qᵀ, ∂(force rate)/∂λ̇ = -Bᵀ.
pub(super) fn terms(context: &Context) -> Vec<Term> {
    let Context { alpha, beta, has_pressure, pressed, added, graded, coherence, .. } = *context;
    let mut terms = vec![
        Term {
            column: Field::Velocity,
            matrix: Matrix::Mass,
            df_dy: if graded { 0.0 } else { alpha },
            df_dyp: 1.0,
        },
        Term::value(Field::Displacement, Matrix::Stiffness, 1.0),
    ];
    if pressed {
        let of_load = Matrix::PressureStiffness;
        terms.push(Term::value(Field::Displacement, of_load, -1.0));
    }
    if graded && alpha > 0.0 {
        terms.push(Term::value(Field::Velocity, Matrix::DampingMass, alpha));
    }
    let (u, v) = (Field::Displacement, Field::Velocity);
    let [by_u, by_v] = added.stress.map(|acts| acts || added.friction);
    for (acts, column, matrix) in [
        (added.foundation[0], u, Matrix::FoundationStiffness),
        (added.foundation[1], v, Matrix::FoundationDamping),
        (by_u, u, Matrix::AddedStiffness),
        (by_v, v, Matrix::AddedDamping),
        (added.tensions, Field::Tension, Matrix::TensionForce),
    ] {
        if acts {
            terms.push(Term::value(column, matrix, 1.0));
        }
    }
    if added.relaxing > 0 {
        let series = (0..added.relaxing).map(Matrix::RelaxingStiffness);
        let matrices = series.chain([Matrix::RelaxingGeometric]);
        terms.extend(matrices.map(|matrix| Term::value(Field::Displacement, matrix, 1.0)));
    }
    if coherence {
        let column = Field::Displacement;
        terms.push(Term::value(column, Matrix::CoherenceStiffness, 1.0));
        terms.push(Term::rate(column, Matrix::CoherenceDamping, 1.0));
    }
    if has_pressure {
        let gradient = Matrix::DivergenceTransposed;
        terms.push(Term::value(Field::Pressure, gradient, -1.0));
    }
    if beta > 0.0 {
        add_damping(context, &mut terms);
    }
    terms
}

/// Adds the terms of the damping force β Ṗ.
fn add_damping(context: &Context, terms: &mut Vec<Term>) {
    let beta = context.beta;
    let [stiffness, divergence_rate, rate_of_pressure] = match context.graded {
        false => {
            [Matrix::Stiffness, Matrix::DivergenceRateTransposed, Matrix::DivergenceTransposed]
        }
        true => [
            Matrix::DampedStiffness,
            Matrix::DampedDivergenceRateTransposed,
            Matrix::DampedDivergenceTransposed,
        ],
    };
    let rate_stiffness = Matrix::RateStiffness;
    terms.push(Term::value(Field::Displacement, rate_stiffness, beta));
    terms.push(Term::value(Field::Velocity, stiffness, beta));
    if context.has_pressure {
        terms.push(Term::value(Field::Pressure, divergence_rate, -beta));
    }
    match context.pressure_rate {
        PressureRateSource::None => {}
        PressureRateSource::Unknown => {
            terms.push(Term::value(Field::PressureRate, rate_of_pressure, -beta));
        }
        PressureRateSource::Derivative => {
            terms.push(Term::rate(Field::Pressure, rate_of_pressure, -beta));
        }
    }
}
