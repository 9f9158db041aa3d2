//! The incompressibility constraint and its time derivative.

use super::Context;
use crate::field::Field;
use crate::matrix::{Matrix, Term};
use crate::state::{Integrals, State};

/// Computes ∫ψ (p/κ + g(J)).
pub(super) fn residual(
    context: &Context,
    state: &State<'_>,
    integrals: &mut Integrals<'_>,
    rows: &mut [f64],
) {
    rows.copy_from_slice(integrals.volume_residual());
    if context.inv_kappa > 0.0 {
        integrals.add_pressure_mass(context.inv_kappa, state.value(Field::Pressure), rows);
    }
}

pub(super) fn terms(context: &Context) -> Vec<Term> {
    let mut terms = vec![Term::value(Field::Displacement, Matrix::Divergence, 1.0)];
    if context.inv_kappa > 0.0 {
        terms.push(Term::value(Field::Pressure, Matrix::PressureMass, context.inv_kappa));
    }
    terms
}

/// Computes ∫ψ (ṗ/κ + g' cof F:∇v).
pub(super) fn rate_residual(
    context: &Context,
    state: &State<'_>,
    integrals: &mut Integrals<'_>,
    rows: &mut [f64],
) {
    rows.copy_from_slice(integrals.volume_residual_rate());
    if context.inv_kappa > 0.0 {
        integrals.add_pressure_mass(context.inv_kappa, state.rate(Field::Pressure), rows);
    }
}

pub(super) fn rate_terms(context: &Context) -> Vec<Term> {
    let mut terms = vec![
        Term::value(Field::Velocity, Matrix::Divergence, 1.0),
        Term::value(Field::Displacement, Matrix::DivergenceRate, 1.0),
    ];
    if context.inv_kappa > 0.0 {
        terms.push(Term::rate(Field::Pressure, Matrix::PressureMass, context.inv_kappa));
    }
    terms
}
