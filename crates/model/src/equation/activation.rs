//! Models of activation, in which nothing depends on the body.

use crate::field::Field;
use crate::matrix::{Matrix, Term};
use crate::state::{Integrals, State};

/// Ṫ less what the model says.
pub(super) fn residual(state: &State<'_>, integrals: &Integrals<'_>, rows: &mut [f64]) {
    let rates = state.rate(Field::Tension).iter();
    for ((row, rate), model) in rows.iter_mut().zip(rates).zip(integrals.tension_rates()) {
        *row = rate - model;
    }
}

pub(super) fn terms() -> Vec<Term> {
    vec![
        Term::rate(Field::Tension, Matrix::TensionIdentity, 1.0),
        Term::value(Field::Tension, Matrix::TensionDecay, 1.0),
    ]
}
