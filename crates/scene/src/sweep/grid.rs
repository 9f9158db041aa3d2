//! The cases of a sweep: all combinations of the values of some keys.

use crate::InputError;

/// One case: its number from 0, and its overrides.
#[derive(Debug, Clone)]
pub(super) struct Case {
    pub(super) number: usize,
    pub(super) set: Vec<String>,
}

/// A key and its values, as text.
#[derive(Debug)]
pub(super) struct Axis {
    pub(super) key: String,
    values: Vec<String>,
}

impl Axis {
    /// Reads `key=a,b,c` or `key=lo..hi:n`.
    pub(super) fn parse(text: &str) -> Result<Self, InputError> {
        let wrong = |message: &str| {
            InputError::new(message.to_owned())
                .at(format!("--vary {text}"))
                .allowed("key=a,b,c or key=lo..hi:n, as in solid.beta=1e-5..1e-3:5")
        };
        let (key, values) = text
            .split_once('=')
            .ok_or_else(|| wrong("values are missing"))?;
        let values = match values.split_once("..") {
            None => values
                .split(',')
                .map(|value| value.trim().to_owned())
                .collect(),
            Some((low, rest)) => {
                let (high, n) = rest
                    .split_once(':')
                    .ok_or_else(|| wrong("`:n` is missing"))?;
                let number = |word: &str| word.trim().parse::<f64>().ok();
                let (Some(low), Some(high), Ok(n)) =
                    (number(low), number(high), n.trim().parse::<usize>())
                else {
                    return Err(wrong("a range is made of numbers"));
                };
                if n < 2 {
                    return Err(wrong("a range has two values at least"));
                }
                let value = |i: usize| {
                    let s = i as f64 / (n - 1) as f64;
                    format!("{:e}", (1.0 - s) * low + s * high)
                };
                (0..n).map(value).collect()
            }
        };
        Ok(Self {
            key: key.trim().to_owned(),
            values,
        })
    }
}

/// All combinations; the last axis changes fastest.
pub(super) fn cases(axes: &[Axis]) -> Vec<Case> {
    let count: usize = axes.iter().map(|axis| axis.values.len()).product();
    (0..count)
        .map(|number| {
            let mut rest = number;
            let mut set: Vec<String> = axes
                .iter()
                .rev()
                .map(|axis| {
                    let value = &axis.values[rest % axis.values.len()];
                    rest /= axis.values.len();
                    format!("{}={value}", axis.key)
                })
                .collect();
            set.reverse();
            Case { number, set }
        })
        .collect()
}

/// The number, from 0, of case `text` = K/N of `count`.
pub(super) fn case_number(text: &str, count: usize) -> Result<usize, InputError> {
    let number = |word: &str| word.parse::<usize>().ok();
    let numbers = text
        .split_once("/")
        .and_then(|(k, n)| Some((number(k)?, number(n)?)));
    match numbers {
        Some((k, n)) if n == count && (1..=count).contains(&k) => Ok(k - 1),
        _ => Err(InputError::new("there is no such case")
            .at("--case")
            .found(text)
            .allowed(format!("1/{count} to {count}/{count}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_key_changes_fastest_and_ranges_include_their_ends() {
        let axes = ["a.b=1,inf", "c=0..1:3"].map(|text| Axis::parse(text).unwrap());
        let cases = cases(&axes);
        let sets: Vec<String> = cases.iter().map(|case| case.set.join(" ")).collect();
        assert_eq!(sets[..3], ["a.b=1 c=0e0", "a.b=1 c=5e-1", "a.b=1 c=1e0"]);
        assert_eq!((sets.len(), sets[5].as_str()), (6, "a.b=inf c=1e0"));
        assert_eq!(case_number("6/6", 6).unwrap(), 5);
        assert!(case_number("7/6", 6).is_err() && case_number("1/5", 6).is_err());
    }

    #[test]
    fn wrong_axes_are_refused() {
        for text in ["a", "a=1..2", "a=1..2:1", "a=x..2:3"] {
            assert!(Axis::parse(text).is_err(), "{text}");
        }
    }
}
