//! Arithmetic expressions of numbers and variables.

use exmex::{ExResult, Express, FlatEx, FloatOpsFactory, MatchLiteral};

/// Number literals such as `1.5` and `1e-3`.
#[derive(Clone, Eq, PartialEq, Ord, PartialOrd, Debug, Default)]
pub(crate) struct Number;

impl MatchLiteral for Number {
    /// Returns the longest prefix of `text` that is an unsigned number.
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

/// A parsed expression.
pub(crate) type Expression = FlatEx<f64, FloatOpsFactory<f64>, Number>;

/// Parses an expression with the usual mathematical precedence.
pub(crate) fn parse(text: &str) -> ExResult<Expression> {
    Expression::parse(&bracketed(text))
}

/// Adds brackets around powers in `text`, so that they bind tighter than a preceding sign and
/// associate to the right. The parsing library treats both differently. Unrecognized parts are
/// copied for the library to report.
fn bracketed(text: &str) -> String {
    let mut brackets = Brackets {
        rest: text.trim(),
        out: String::new(),
    };
    match brackets.sum() {
        Some(()) if brackets.rest.is_empty() => brackets.out,
        _ => text.to_owned(),
    }
}

struct Brackets<'a> {
    rest: &'a str,
    out: String,
}

impl Brackets<'_> {
    /// Copies powers between other operators, or the arguments of a function.
    fn sum(&mut self) -> Option<()> {
        loop {
            self.power()?;
            match self.next() {
                Some('+' | '-' | '*' | '/' | ',') => self.take(1),
                _ => return Some(()),
            }
        }
    }

    fn power(&mut self) -> Option<()> {
        if matches!(self.next()?, '+' | '-') {
            self.out.push('(');
            self.take(1);
            self.power()?;
            self.out.push(')');
            return Some(());
        }
        let start = self.out.len();
        self.operand()?;
        if self.next() == Some('^') {
            self.out.insert(start, '(');
            self.take(1);
            self.out.push('(');
            self.power()?;
            self.out.push_str("))");
        }
        Some(())
    }

    /// Copies a number, a name, a function call, or an expression in brackets.
    fn operand(&mut self) -> Option<()> {
        if let Some(number) = Number::is_literal(self.rest) {
            self.take(number.len());
            return Some(());
        }
        let is_of_name = |c: char| c.is_alphanumeric() || c == '_';
        let end = self.rest.find(|c| !is_of_name(c));
        let name = end.unwrap_or(self.rest.len());
        self.take(name);
        match self.next() {
            Some('(') => {
                self.take(1);
                self.sum()?;
                (self.next()? == ')').then(|| self.take(1))
            }
            _ => (name > 0).then_some(()),
        }
    }

    /// Returns the next character that is not a space.
    fn next(&mut self) -> Option<char> {
        self.rest = self.rest.trim_start();
        self.rest.chars().next()
    }

    /// Copies this number of bytes.
    fn take(&mut self, bytes: usize) {
        let (taken, rest) = self.rest.split_at(bytes);
        self.out.push_str(taken);
        self.rest = rest;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: -x^2 was evaluated as (-x)^2, and 2^3^2 as 64.
    #[test]
    fn powers_bind_tighter_than_signs_and_nest_to_the_right() {
        let x: f64 = 3.0;
        for (text, expected) in [
            ("-x^2", -9.0),
            ("2*-x^2", -18.0),
            ("1 - x^2", -8.0),
            ("(-x)^2", 9.0),
            ("2^-x", 0.125),
            ("2^3^2", 512.0),
            ("-x^2^-1", -3f64.sqrt()),
            ("exp(-((x-1)/2)^2)", (-1f64).exp()),
            ("-(x)^2 + -x", -12.0),
            ("2.5e-1*x^2/x", 0.75),
            ("sin(-x)^2 - -x^2", x.sin().powi(2) + 9.0),
            ("- - x^2", 9.0),
            ("-x*x", -9.0),
            ("PI^2", std::f64::consts::PI.powi(2)),
        ] {
            let expression = parse(text).unwrap();
            let values = vec![x; expression.var_names().len()];
            let found = expression.eval(&values).unwrap();
            // Rounding errors of few operations.
            assert!(
                (found - expected).abs() <= 1e-14 * expected.abs(),
                "{text}: {found}"
            );
        }
        for text in ["x^", "(x", "x)", "x^^2", "", "2 x", "*x"] {
            assert_eq!(bracketed(text), text);
            assert!(parse(text).is_err(), "{text}");
        }
    }
}
