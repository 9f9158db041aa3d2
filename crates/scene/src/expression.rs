//! Expressions of numbers and variables, as users write them.

use exmex::{FlatEx, FloatOpsFactory, MatchLiteral};

/// Numbers as in `1.5` and `1e-3`.
#[derive(Clone, Eq, PartialEq, Ord, PartialOrd, Debug, Default)]
pub(crate) struct Number;

impl MatchLiteral for Number {
    /// The longest start of `text` that is a number without sign.
    fn is_literal(text: &str) -> Option<&str> {
        let has_digit = |c: char| c.is_ascii_digit() || c == '.';
        let part = |from: usize| -> usize {
            let rest = text[from..].find(|c| !has_digit(c));
            rest.map_or(text.len(), |end| from + end)
        };
        let mantissa = part(0);
        let exponent = text[mantissa..].strip_prefix(['e', 'E']).map(|exponent| {
            let sign = usize::from(exponent.starts_with(['+', '-']));
            part(mantissa + 1 + sign)
        });
        let is_number = |end: &usize| text[..*end].parse::<f64>().is_ok();
        let end = exponent.filter(is_number).unwrap_or(mantissa);
        is_number(&end).then(|| &text[..end])
    }
}

/// An expression of numbers.
pub(crate) type Expression = FlatEx<f64, FloatOpsFactory<f64>, Number>;
