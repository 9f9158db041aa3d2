//! Cases of a sweep: all combinations of the values of the varied keys.

use std::ops;

use crate::InputError;
use crate::spacing::Range;

const MAX_CASES: usize = 100_000;

/// Case with its zero-based index and its overrides.
#[derive(Debug, Clone)]
pub(super) struct Case {
    pub(super) number: usize,
    pub(super) set: Vec<String>,
}

/// Varied key and its values as text.
#[derive(Debug)]
pub(super) struct Axis {
    pub(super) key: String,
    values: Vec<String>,
}

impl Axis {
    pub(super) fn len(&self) -> usize {
        self.values.len()
    }

    /// Parses `key=a,b,c`, `key=lo..hi:n` or `key=lo..hi:n:log`.
    pub(super) fn parse(text: &str) -> Result<Self, InputError> {
        let wrong = |message: &str| {
            InputError::new(message.to_owned())
                .at(format!("--vary {text}"))
                .allowed(
                    "key=a,b,c, key=lo..hi:n or key=lo..hi:n:log, as in solid.rayleigh_stiffness=1e-5..1e-3:5",
                )
        };
        let (key, values) = text.split_once('=').ok_or_else(|| wrong("values are missing"))?;
        if key.trim().is_empty() {
            return Err(wrong("a key is missing"));
        }
        let values = match Range::read(values) {
            None => split(values),
            Some(range) => {
                let ends_are_whole = range.has_whole_ends();
                let written = |value: f64| {
                    // Integer keys do not accept 1e0.
                    let rounded = value.round();
                    let is_whole = (value - rounded).abs() <= 4.0 * f64::EPSILON * rounded.abs();
                    match ends_are_whole && is_whole {
                        true => format!("{rounded:.0}"),
                        false => format!("{value:e}"),
                    }
                };
                let values = range.values().map_err(wrong)?;
                values.into_iter().map(written).collect()
            }
        };
        if values.iter().any(String::is_empty) {
            return Err(wrong("a value is missing"));
        }
        Ok(Self { key: key.trim().to_owned(), values })
    }
}

/// Splits values at commas. Commas inside brackets or quotes are part of a value.
fn split(values: &str) -> Vec<String> {
    let (mut parts, mut depth, mut quote) = (vec![String::new()], 0_usize, None);
    for c in values.chars() {
        match c {
            ',' if depth == 0 && quote.is_none() => {
                parts.push(String::new());
                continue;
            }
            '"' | '\'' if quote.is_none() => quote = Some(c),
            c if quote == Some(c) => quote = None,
            '[' | '{' if quote.is_none() => depth += 1,
            ']' | '}' if quote.is_none() => depth = depth.saturating_sub(1),
            _ => {}
        }
        if let Some(part) = parts.last_mut() {
            part.push(c);
        }
    }
    parts.iter().map(|part| part.trim().to_owned()).collect()
}

/// Parses the varied keys and their values. Each key may occur only once because it is also the name of a table column.
pub(super) fn axes(vary: &[String]) -> Result<Vec<Axis>, InputError> {
    let axes = vary.iter().map(|text| Axis::parse(text));
    let axes = axes.collect::<Result<Vec<Axis>, _>>()?;
    let twice = (1..axes.len()).find(|&i| axes[..i].iter().any(|axis| axis.key == axes[i].key));
    match twice {
        None => Ok(axes),
        Some(i) => Err(InputError::new("this key is already varied")
            .at(format!("--vary {}", vary[i]))
            .next("list all its values at once: key=a,b,c")),
    }
}

/// Rejects overrides of varied keys, which would have no effect.
pub(super) fn expect_free(axes: &[Axis], set: &[String]) -> Result<(), InputError> {
    let key_of = |text: &str| text.split_once('=').map(|(key, _)| key.trim().to_owned());
    let varied = |key: &String| axes.iter().any(|axis| axis.key == *key);
    match set.iter().find(|text| key_of(text).as_ref().is_some_and(varied)) {
        None => Ok(()),
        Some(text) => Err(InputError::new("this key is varied, so the value has no effect")
            .at(format!("--set {text}"))
            .next("remove --set or --vary for this key")),
    }
}

/// Returns the cases for all combinations of values. The last axis changes fastest.
pub(super) fn cases(axes: &[Axis]) -> Result<Vec<Case>, InputError> {
    let lengths = axes.iter().map(|axis| axis.values.len());
    let count = lengths.fold(1_usize, usize::saturating_mul);
    if count > MAX_CASES {
        let error = InputError::new("the grid has too many cases").at("--vary");
        return Err(error.found(count).allowed(format!("at most {MAX_CASES}")));
    }
    let cases = (0..count)
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
        .collect();
    Ok(cases)
}

/// Parses K/N or K-L/N, where N must be equal to `count`, and returns the range of zero-based case indices.
pub(super) fn case_numbers(text: &str, count: usize) -> Result<ops::Range<usize>, InputError> {
    let number = |word: &str| word.trim().parse::<usize>().ok();
    let numbers = text.split_once('/').and_then(|(cases, n)| {
        let (first, last) = cases.split_once('-').unwrap_or((cases, cases));
        Some([number(first)?, number(last)?, number(n)?])
    });
    match numbers {
        Some([first, last, n]) if n == count && 1 <= first && first <= last && last <= n => {
            Ok(first - 1..last)
        }
        _ => Err(InputError::new("these cases do not exist")
            .at("--case")
            .found(text)
            .allowed(format!("1/{count} to {count}/{count}, or several: 1-{count}/{count}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_key_changes_fastest_and_ranges_include_their_ends() {
        let axes = ["a.b=1,inf", "c=0..1:3"].map(|text| Axis::parse(text).unwrap());
        let cases = cases(&axes).unwrap();
        let sets: Vec<String> = cases.iter().map(|case| case.set.join(" ")).collect();
        assert_eq!(sets[..3], ["a.b=1 c=0", "a.b=1 c=5e-1", "a.b=1 c=1"]);
        assert_eq!((sets.len(), sets[5].as_str()), (6, "a.b=inf c=1"));
        assert_eq!(case_numbers("6/6", 6).unwrap(), 5..6);
        assert_eq!(case_numbers("2-4/6", 6).unwrap(), 1..4);
        for wrong in ["7/6", "1/5", "4-2/6", "0/6", "2-7/6", "x/6"] {
            assert!(case_numbers(wrong, 6).is_err(), "{wrong}");
        }
        let decades = Axis::parse("b=1e-5..1e-3:3:log").unwrap();
        assert_eq!(decades.values[..], ["1e-5", "1e-4", "1e-3"].map(str::to_owned));
    }

    /// Regression: ranges produced 1e0 for integer keys, and lists were split at every comma.
    #[test]
    fn whole_numbers_stay_whole_and_lists_stay_together() {
        for (text, expected) in [
            ("mesh.refine=0..2:3", &["0", "1", "2"][..]),
            ("a=5..15:3", &["5", "10", "15"]),
            ("a=1..4:4", &["1", "2", "3", "4"]),
            ("a=1..100:3:log", &["1", "10", "100"]),
            ("a=1.0..3.0:3", &["1e0", "2e0", "3e0"]),
            ("chain[0].at=[0.0,0.0],[0.03, 0.01]", &["[0.0,0.0]", "[0.03, 0.01]"]),
            ("t={a=[1,2],b=3},4", &["{a=[1,2],b=3}", "4"]),
            ("title=\"a,b\",'c,]',d", &["\"a,b\"", "'c,]'", "d"]),
        ] {
            assert_eq!(Axis::parse(text).unwrap().values, expected, "{text}");
        }
    }

    #[test]
    fn wrong_axes_are_refused() {
        for text in [
            "a",
            "a=1..2",
            "a=1..2:1",
            "a=0..2:3:log",
            "a=1..2:3:lg",
            "a=x..2:3",
            "a=1..x:3",
            "a=1..2:x",
            "a=1..inf:2",
            "a=nan..1:2",
            "=1,2",
            // Regression: a missing value was treated as the default value, which the table did not show.
            "a=",
            "a=1,,2",
            "a=1, ",
        ] {
            assert!(Axis::parse(text).is_err(), "{text}");
        }
    }

    /// Regression: a range of 10⁹ values used all memory, and a path with `..` was rejected as an
    /// invalid range.
    #[test]
    fn ranges_are_bounded_and_paths_are_not_ranges() {
        assert!(Axis::parse("k=1..2:1000000000").is_err());
        let many = ["a=0..1:1000", "b=0..1:1000"].map(|text| Axis::parse(text).unwrap());
        assert!(cases(&many).unwrap_err().to_string().contains("1000000"));
        let path = Axis::parse("mesh.path=../a.msh,b/../c.msh").unwrap();
        assert_eq!(path.values, ["../a.msh", "b/../c.msh"]);
    }
}
