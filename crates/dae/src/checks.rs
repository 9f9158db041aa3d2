//! Checks of the arguments and settings of integrators. Each check returns the first violation as an
//! [`IntegratorError`].

use nalgebra_sparse::pattern::SparsityPattern;

use crate::integrator::covers;
use crate::integrator_error::IntegratorError;
use crate::tolerances::Tolerances;

type Checked = Result<(), IntegratorError>;

/// Returns an error for the `option` unless `good` is true.
pub fn expect(option: &'static str, value: f64, good: bool, expected: &'static str) -> Checked {
    if good { Ok(()) } else { Err(IntegratorError::InvalidOption { option, value, expected }) }
}

/// Checks that a value is finite.
pub fn expect_finite_value(option: &'static str, value: f64) -> Checked {
    expect(option, value, value.is_finite(), "finite")
}

/// Checks that a value is finite and positive.
pub fn expect_positive(option: &'static str, value: f64) -> Checked {
    expect(option, value, value.is_finite() && value > 0.0, "finite and > 0")
}

/// Checks that a value is finite and not negative.
pub fn expect_not_negative(option: &'static str, value: f64) -> Checked {
    expect(option, value, value.is_finite() && value >= 0.0, "finite and ≥ 0")
}

/// Checks that a number of steps or iterations is positive and fits in an `i32`.
pub fn expect_count(option: &'static str, count: usize) -> Checked {
    let good = count > 0 && i32::try_from(count).is_ok();
    expect(option, count as f64, good, "a positive count")
}

/// Checks the length of an array.
pub fn expect_length(what: &'static str, expected: usize, got: usize) -> Checked {
    match got == expected {
        true => Ok(()),
        false => Err(IntegratorError::WrongLength { what, expected, got }),
    }
}

/// Checks that all components of an array are finite.
pub fn expect_finite(what: &'static str, values: &[f64]) -> Checked {
    match values.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(IntegratorError::NotFinite { what, index, value: values[index] }),
        None => Ok(()),
    }
}

/// Checks the length and the values of an array.
pub fn expect_vector(what: &'static str, expected: usize, values: &[f64]) -> Checked {
    expect_length(what, expected, values.len())?;
    expect_finite(what, values)
}

/// Checks the initial time and the initial values of `n` unknowns.
pub fn expect_state(n: usize, t0: f64, y0: &[f64], y_dot0: &[f64]) -> Checked {
    expect_length("initial values y0", n, y0.len())?;
    expect_length("initial derivatives y_dot0", n, y_dot0.len())?;
    expect_finite_value("t0", t0)?;
    expect_finite("y0", y0)?;
    expect_finite("y_dot0", y_dot0)
}

/// Checks that a Jacobian has `n` rows and columns.
pub fn expect_square(n: usize, pattern: &SparsityPattern) -> Checked {
    expect_length("rows of the Jacobian", n, pattern.minor_dim())?;
    expect_length("columns of the Jacobian", n, pattern.major_dim())
}

/// Checks that the tolerances of `n` unknowns are finite and not negative, and that each unknown has a
/// positive tolerance.
pub fn expect_tolerances(tolerances: &Tolerances, n: usize) -> Checked {
    let relative = tolerances.relative();
    expect_not_negative("relative tolerance", relative)?;
    if let Tolerances::Vector { absolute, .. } = tolerances {
        expect_length("absolute tolerances", n, absolute.len())?;
    }
    (0..n).map(|i| tolerances.absolute(i)).try_for_each(|absolute| {
        expect_not_negative("absolute tolerance", absolute)?;
        let tested = relative + absolute > 0.0;
        expect("absolute tolerance", absolute, tested, "> 0 if the relative tolerance is 0")
    })
}

/// Checks that dense output is available: `t` must be in the last step [from, to], and the order of the `derivative`
/// must be at most `highest`.
pub fn expect_dense_output(
    t: f64,
    derivative: usize,
    highest: usize,
    [from, to]: [f64; 2],
) -> Checked {
    match derivative <= highest && covers([from, to], t) {
        true => Ok(()),
        false => Err(IntegratorError::NoDenseOutput { t, derivative, highest, from, to }),
    }
}
