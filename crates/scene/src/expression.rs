//! Expressions of numbers and variables, as users write them.

use exmex::{ExResult, Express, FlatEx, FloatOpsFactory, MatchLiteral};

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

/// Reads an expression, with the precedence that mathematics has.
pub(crate) fn parse(text: &str) -> ExResult<Expression> {
    Expression::parse(&bracketed(text))
}

/// The `text` with brackets around powers: they bind tighter than the sign before them, and nest to the right. For the
/// parser a sign binds tighter, and powers nest to the left. What is not understood is left to it.
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
    /// Powers between other operators, or the arguments of a function.
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

    /// A number, a name, a function of what follows in brackets, or brackets.
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

    /// The next character that is no space.
    fn next(&mut self) -> Option<char> {
        self.rest = self.rest.trim_start();
        self.rest.chars().next()
    }

    /// Copies so many bytes.
    fn take(&mut self, bytes: usize) {
        let (taken, rest) = self.rest.split_at(bytes);
        self.out.push_str(taken);
        self.rest = rest;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: -x^2 was (-x)^2, and 2^3^2 was 64.
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
            // Few operations.
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
