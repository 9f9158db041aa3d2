//! Activation models. Their equations do not depend on the body.

use crate::field::Field;
use crate::matrix::{Matrix, Term};

pub(super) fn terms() -> Vec<Term> {
    vec![
        Term::rate(Field::Tension, Matrix::TensionIdentity, 1.0),
        Term::value(Field::Tension, Matrix::TensionDecay, 1.0),
    ]
}
