//! Definitions of the velocity and of the pressure rate.

use super::rate_residual;
use crate::field::Field;
use crate::matrix::{Matrix, Term};
use crate::state::{Integrals, State};

pub(super) fn terms() -> Vec<Term> {
    vec![
        Term::rate(Field::Displacement, Matrix::DisplacementIdentity, 1.0),
        Term::value(Field::Velocity, Matrix::DisplacementIdentity, -1.0),
    ]
}

pub(super) fn pressure_terms() -> Vec<Term> {
    vec![
        Term::rate(Field::Pressure, Matrix::PressureIdentity, 1.0),
        Term::value(Field::PressureRate, Matrix::PressureIdentity, -1.0),
    ]
}

/// Computes M (q̇ - v) + B(q)ᵀ μ. At constrained nodes, q̇ and v are the same prescribed velocity.
pub(super) fn stabilized_residual(
    state: &State<'_>,
    integrals: &mut Integrals<'_>,
    rows: &mut [f64],
) {
    rate_residual(Field::Displacement, state.value(Field::Velocity), state, rows);
    integrals.apply_free_mass(rows);
    integrals.add_multiplier_force(rows);
}

pub(super) fn stabilized_terms() -> Vec<Term> {
    vec![
        Term::rate(Field::Displacement, Matrix::Mass, 1.0),
        Term::value(Field::Velocity, Matrix::Mass, -1.0),
        Term::value(Field::Displacement, Matrix::MultiplierStiffness, 1.0),
        Term::value(Field::GglMultiplier, Matrix::DivergenceTransposed, 1.0),
    ]
}
