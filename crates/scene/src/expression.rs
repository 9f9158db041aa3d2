//! Arithmetic expressions with numbers and variables.

use exmex::{Express, FlatEx, FloatOpsFactory, MakeOperators, MatchLiteral};

/// Number literals such as `1.5` and `1e-3`.
#[derive(Clone, Eq, PartialEq, Ord, PartialOrd, Debug, Default)]
pub(crate) struct Number;

impl MatchLiteral for Number {
    /// Returns the longest prefix of `text` that forms an unsigned number.
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

pub(crate) type Expression = FlatEx<f64, FloatOpsFactory<f64>, Number>;

/// Reason why a text is not a valid expression.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum ExpressionError {
    /// The end of the expression is missing.
    #[error("an operand or a bracket is missing at the end")]
    Incomplete,
    /// The text at this position is unexpected.
    #[error("`{0}` is not expected here")]
    Unexpected(String),
    #[error("`{0}` is not a function; known functions: {known}", known = functions().join(", "))]
    UnknownFunction(String),
    /// The expression exceeds the limit on its length or nesting depth.
    #[error("it is too long or nested too deeply (at most {LENGTH} characters, {DEPTH} levels)")]
    TooLarge,
}

const LENGTH: usize = 10_000;
/// Maximum nesting depth of brackets, signs and powers.
const DEPTH: usize = 100;

/// Rejects excessively long or deeply nested texts, because parsing them could overflow the stack.
pub(crate) fn expect_moderate(text: &str) -> Result<(), ExpressionError> {
    let mut depth = 0_usize;
    for c in text.chars() {
        match c {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > DEPTH {
            return Err(ExpressionError::TooLarge);
        }
    }
    match text.len() > LENGTH {
        true => Err(ExpressionError::TooLarge),
        false => Ok(()),
    }
}

/// Parses an expression with the usual mathematical precedence.
pub(crate) fn parse(text: &str) -> Result<Expression, ExpressionError> {
    expect_moderate(text)?;
    let bracketed = bracketed(text)?;
    Expression::parse(&bracketed).map_err(|_| ExpressionError::Unexpected(text.trim().to_owned()))
}

/// Adds brackets around the powers in `text` so that they bind more tightly than a preceding sign and are
/// right-associative. The parsing library follows neither convention.
fn bracketed(text: &str) -> Result<String, ExpressionError> {
    let mut brackets = Brackets { rest: text.trim(), out: String::new(), depth: 0 };
    brackets.sum()?;
    match brackets.rest {
        "" => Ok(brackets.out),
        _ => Err(brackets.unexpected()),
    }
}

struct Brackets<'a> {
    rest: &'a str,
    out: String,
    depth: usize,
}

impl Brackets<'_> {
    /// Copies a sum or product of powers, or a comma-separated list of function arguments.
    fn sum(&mut self) -> Result<(), ExpressionError> {
        loop {
            self.power()?;
            match self.next() {
                Some('+' | '-' | '*' | '/' | ',') => self.take(1),
                _ => return Ok(()),
            }
        }
    }

    fn power(&mut self) -> Result<(), ExpressionError> {
        self.depth += 1;
        if self.depth > DEPTH {
            return Err(ExpressionError::TooLarge);
        }
        let power = self.signed_power();
        self.depth -= 1;
        power
    }

    fn signed_power(&mut self) -> Result<(), ExpressionError> {
        if matches!(self.next(), Some('+' | '-')) {
            self.out.push('(');
            self.take(1);
            self.power()?;
            self.out.push(')');
            return Ok(());
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
        Ok(())
    }

    /// Copies a number, a name, a function call, or an expression in brackets.
    fn operand(&mut self) -> Result<(), ExpressionError> {
        self.next();
        if let Some(number) = Number::is_literal(self.rest) {
            self.take(number.len());
            return Ok(());
        }
        let is_of_name = |c: char| c.is_alphanumeric() || c == '_';
        let end = self.rest.find(|c| !is_of_name(c));
        let length = end.unwrap_or(self.rest.len());
        let name = &self.rest[..length];
        let start = self.out.len();
        self.take(length);
        match self.next() {
            Some('(') => {
                if !name.is_empty() && !is_function(name) {
                    return Err(ExpressionError::UnknownFunction(name.to_owned()));
                }
                self.take(1);
                self.sum()?;
                match self.next() {
                    Some(')') => {
                        self.take(1);
                        Ok(())
                    }
                    _ => Err(self.unexpected()),
                }
            }
            _ if name.is_empty() => Err(self.unexpected()),
            _ => {
                // The parsing library accepts this constant only in capital letters.
                if &self.out[start..] == "pi" {
                    self.out.replace_range(start.., "PI");
                }
                Ok(())
            }
        }
    }

    /// Returns the error for the remaining text, or for an incomplete expression if no text remains.
    fn unexpected(&self) -> ExpressionError {
        match self.rest.trim() {
            "" => ExpressionError::Incomplete,
            rest => ExpressionError::Unexpected(rest.chars().take(20).collect()),
        }
    }

    /// Skips spaces and returns the next character.
    fn next(&mut self) -> Option<char> {
        self.rest = self.rest.trim_start();
        self.rest.chars().next()
    }

    /// Copies the given number of bytes to the output.
    fn take(&mut self, bytes: usize) {
        let (taken, rest) = self.rest.split_at(bytes);
        self.out.push_str(taken);
        self.rest = rest;
    }
}

/// Returns whether the parsing library defines a function with this name.
fn is_function(name: &str) -> bool {
    let known = FloatOpsFactory::<f64>::make();
    known.iter().any(|operator| operator.repr() == name)
}

fn functions() -> Vec<&'static str> {
    let all = FloatOpsFactory::<f64>::make().into_iter();
    let named =
        all.filter(|one| one.constant().is_none() && one.repr().starts_with(char::is_alphabetic));
    named.map(|one| one.repr()).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// Regression: the reference did not list the functions.
    #[test]
    fn the_reference_lists_the_functions() {
        let text = crate::scene_file::reference();
        let (_, section) = text.split_once("\n## Spatial factors").unwrap();
        let (section, _) = section.split_once("\n## ").unwrap();
        let words: Vec<&str> = section.split(|c: char| !c.is_alphanumeric()).collect();
        assert!(functions().len() > 20);
        for name in functions() {
            assert!(words.contains(&name), "{name}");
        }
        for (text, expected) in
            [("max(x, 2)", 3.0), ("min(x, 2)", 2.0), ("atan2(x, -x)", 0.75 * PI)]
        {
            let found = parse(text).unwrap().eval(&[3.0]).unwrap();
            // The tolerance covers the rounding error of the last operation.
            assert!((found - expected).abs() < 1e-15, "{text}: {found}");
        }
    }

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
            ("PI^2", PI.powi(2)),
            ("2*pi*x - pi^2", 6.0 * PI - PI.powi(2)),
        ] {
            let expression = parse(text).unwrap();
            let values = vec![x; expression.var_names().len()];
            let found = expression.eval(&values).unwrap();
            // The tolerance covers the rounding errors of a few operations.
            assert!((found - expected).abs() <= 1e-14 * expected.abs(), "{text}: {found}");
        }
        use ExpressionError::{Incomplete, TooLarge, Unexpected, UnknownFunction};
        let unexpected = |rest: &str| Unexpected(rest.to_owned());
        for (text, error) in [
            ("x^", Incomplete),
            ("(x", Incomplete),
            ("", Incomplete),
            ("x)", unexpected(")")),
            ("x^^2", unexpected("^2")),
            ("2x", unexpected("x")),
            ("2 x", unexpected("x")),
            ("*x", unexpected("*x")),
            ("foo(x)", UnknownFunction("foo".to_owned())),
        ] {
            assert_eq!(parse(text).unwrap_err(), error, "{text}");
        }
        // Regression: nested brackets overflowed the stack.
        for (one, n) in
            [("(", 20_000), ("-", 20_000), ("2^", 20_000), ("x+", 20_000), ("sin(", 101)]
        {
            assert_eq!(parse(&(one.repeat(n) + "x")).unwrap_err(), TooLarge, "{one}");
        }
        let nested = |n: usize| "(".repeat(n) + "x" + &")".repeat(n);
        assert!(parse(&nested(40)).is_ok());
    }
}
