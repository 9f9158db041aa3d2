//! Columns of the sweep table computed from recorded probes, such as `gain=max(tip.u_y)/max(base.u_y)`.

use std::path::Path;

use exmex::Express;

use super::grid::Axis;
use crate::csv::read_numbers;
use crate::expression::{Expression, ExpressionError, expect_moderate, parse};
use crate::{InputError, Scene, run};

pub(super) const COLUMNS: [&str; 10] = [
    "outcome",
    "reason",
    "index",
    "steps",
    "error_test_failures",
    "step_solve_failures",
    "newton_iterations",
    "t_reached",
    "constraint_drift",
    "cpu_seconds",
];

/// Columns of a row in addition to [`COLUMNS`], the varied keys and the requested columns.
const OTHER_COLUMNS: [&str; 3] = ["case", "message", "probes"];

/// Function that reduces a column to one number. Its arguments are the first column of the table and the column to be
/// reduced.
type Reduction = fn(&[f64], &[f64]) -> f64;

/// Names of the reductions and the corresponding functions. The arguments of a function are nonempty columns.
const REDUCTIONS: [(&str, Reduction); 6] = [
    ("min", |_, values| least(values)),
    ("max", |_, values| largest(values)),
    ("argmax", |first, values| {
        let largest = largest(values);
        values.iter().position(|value| *value == largest).map_or(f64::NAN, |k| first[k])
    }),
    ("mean", |_, values| values.iter().sum::<f64>() / values.len() as f64),
    ("last", |_, values| values[values.len() - 1]),
    ("amplitude", |_, values| (largest(values) - least(values)) / 2.0),
];

fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// Reduced column, written as `reduction(probe.column)` or `reduction(probe.column, from)`. The latter uses only the
/// rows whose first value is at least `from`.
#[derive(Debug)]
struct Reduced {
    reduction: Reduction,
    probe: String,
    column: String,
    from: f64,
}

impl Reduced {
    /// Returns the value, or `None` if the run recorded no such value.
    fn value(&self, folder: &Path) -> Option<f64> {
        let (names, rows) = read_numbers(&folder.join(format!("{}.csv", self.probe))).ok()?;
        let column = names.iter().position(|name| *name == self.column)?;
        let rows = rows.iter().filter(|row| row[0] >= self.from);
        let (first, values): (Vec<f64>, Vec<f64>) = rows.map(|row| (row[0], row[column])).unzip();
        (!values.is_empty()).then(|| (self.reduction)(&first, &values))
    }
}

/// Table column with a name and an expression in terms of reduced probe columns.
#[derive(Debug)]
pub(super) struct ResultColumn {
    pub(super) name: String,
    expression: Expression,
    /// Reduced columns, in the order of the variables of the expression.
    reduced: Vec<Reduced>,
}

impl ResultColumn {
    /// Parses `name=expression`.
    pub(super) fn parse(text: &str) -> Result<Self, InputError> {
        let wrong = |message: String| {
            let names: Vec<&str> = REDUCTIONS.iter().map(|(name, _)| *name).collect();
            InputError::new(message).at(format!("--result {text}")).allowed(format!(
                "name=expression of reduction(probe.column) or reduction(probe.column, from), \
                     as in gain=amplitude(tip.u_y, 1.5)/1e-3; reductions: {}",
                names.join(", ")
            ))
        };
        let (name, formula) =
            text.split_once('=').ok_or_else(|| wrong("an expression is missing".to_owned()))?;
        let not_an_expression =
            |error: ExpressionError| wrong(format!("not an expression: {error}"));
        expect_moderate(formula).map_err(not_an_expression)?;
        let mut reduced = Vec::new();
        let mut flat = String::new();
        let mut rest = formula;
        while let Some((before, word, inside, after)) = next_call(rest) {
            let known = REDUCTIONS.iter().find(|(known, _)| *known == word);
            let Some((_, reduction)) = known else {
                // A function of numbers, such as `sqrt`, remains part of the expression.
                let cut = rest.len() - after.len() - inside.len() - 1;
                flat.push_str(&rest[..cut]);
                rest = &rest[cut..];
                continue;
            };
            let (place, from) = match inside.split_once(',') {
                None => (inside, Some(f64::NEG_INFINITY)),
                Some((place, from)) => (place, from.trim().parse().ok()),
            };
            let Some(((probe, column), from)) = place.trim().split_once('.').zip(from) else {
                return Err(wrong(format!("cannot read `{word}({inside})`")));
            };
            flat.push_str(before);
            flat.push_str(&variable(reduced.len()));
            reduced.push(Reduced {
                reduction: *reduction,
                probe: probe.to_owned(),
                column: column.to_owned(),
                from,
            });
            rest = after;
        }
        flat.push_str(rest);
        let expression = parse(&flat).map_err(not_an_expression)?;
        let variables: Vec<String> = (0..reduced.len()).map(variable).collect();
        if let Some(unknown) = expression.var_names().iter().find(|v| !variables.contains(v)) {
            return Err(wrong(format!("`{unknown}` is not a reduction of a probe's column")));
        }
        Ok(Self { name: name.trim().to_owned(), expression, reduced })
    }

    /// Returns the probe and the column of each reduced column.
    pub(super) fn places(&self) -> impl Iterator<Item = (&str, &str)> {
        self.reduced.iter().map(|r| (&*r.probe, &*r.column))
    }

    /// Returns the value for the run in `folder`, or `None` if the run failed or a table has damaged rows.
    pub(super) fn value(&self, folder: &Path) -> Option<f64> {
        let values = self.reduced.iter().map(|reduced| reduced.value(folder));
        let values = values.collect::<Option<Vec<f64>>>()?;
        self.expression.eval(&values).ok()
    }
}

/// Parses the requested columns. The scene must contain their probes.
pub(super) fn columns(
    texts: &[String],
    axes: &[Axis],
    scene: &Scene,
) -> Result<Vec<ResultColumn>, InputError> {
    let tables = run::columns_of(scene)?;
    let mut columns: Vec<ResultColumn> = Vec::new();
    for text in texts {
        let column = ResultColumn::parse(text)?;
        let wrong = |message: String| InputError::new(message).at(format!("--result {text}"));
        let is_taken = COLUMNS.contains(&column.name.as_str())
            || OTHER_COLUMNS.contains(&column.name.as_str())
            || axes.iter().any(|axis| axis.key == column.name)
            || columns.iter().any(|other| other.name == column.name);
        if is_taken || column.name.is_empty() {
            return Err(wrong(format!("the name `{}` is empty or already used", column.name)));
        }
        for (probe, name) in column.places() {
            let Some((_, names)) = tables.iter().find(|(table, _)| table == probe) else {
                let error = wrong(format!("unknown probe `{probe}`"));
                let probes: Vec<&str> = tables.iter().map(|(table, _)| table.as_str()).collect();
                return Err(error.allowed(probes.join(", ")));
            };
            if !names.iter().any(|known| known == name) {
                let error = wrong(format!("the probe `{probe}` has no column `{name}`"));
                return Err(error.allowed(names.join(", ")));
            }
        }
        columns.push(column);
    }
    Ok(columns)
}

/// Returns the name of the variable with the given index. Sorting the names preserves the order of the indices.
fn variable(number: usize) -> String {
    format!("reduced_{number:03}")
}

/// Splits the text at the next call `word(inside)`. Returns the text before the call, `word`, `inside`, and the text
/// after the call. Nested brackets inside a call are not supported.
fn next_call(text: &str) -> Option<(&str, &str, &str, &str)> {
    let open = text.find('(')?;
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let start = text[..open].rfind(|c| !is_word(c)).map_or(0, |i| i + 1);
    if start == open {
        // This bracket belongs to the expression itself, so the search continues after it.
        let (before, word, inside, after) = next_call(&text[open + 1..])?;
        return Some((&text[..open + 1 + before.len()], word, inside, after));
    }
    let close = open + text[open..].find(')')?;
    Some((&text[..start], &text[start..open], &text[open + 1..close], &text[close + 1..]))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn expressions_of_reduced_columns_are_computed() {
        let folder = tempfile::tempdir().unwrap();
        let table = "t,u_y,p,tie\n0,0,1,NaN\n1,-2,2,5\n2,4,3,5\n3,1,4,0\n";
        fs::write(folder.path().join("tip.csv"), table).unwrap();
        for (text, expected) in [
            ("a=max(tip.u_y)", 4.0),
            ("a=min(tip.u_y) ", -2.0),
            ("a=mean(tip.p)", 2.5),
            ("a=last(tip.u_y)", 1.0),
            ("a=amplitude(tip.u_y)", 3.0),
            ("a=argmax(tip.u_y)", 2.0),
            ("a=argmax(tip.p, 1)", 3.0),
            ("a=argmax(tip.tie)", 1.0),
            ("a=amplitude(tip.u_y, 1.5)", 1.5),
            ("a=2*(max(tip.u_y) - last(tip.p))^2 + 1", 1.0),
            ("a=sqrt(max(tip.u_y)) / 2", 1.0),
            ("a=max(tip.u_y)/mean(tip.p)", 1.6),
            ("a=1.5e1 + max(tip.u_y)/1e-1 - 2E+0", 53.0),
        ] {
            let column = ResultColumn::parse(text).unwrap();
            assert_eq!(column.name, "a");
            // The expressions contain a few operations on small integers. Except for quotients, these operations are
            // exact.
            let found = column.value(folder.path()).unwrap();
            assert!(
                (found - expected).abs() <= 4.0 * f64::EPSILON * expected.abs(),
                "{text}: {found}"
            );
        }
        let missing = ResultColumn::parse("a=max(tip.u_x)").unwrap();
        assert_eq!(missing.value(folder.path()), None);
    }

    #[test]
    fn invalid_expressions_are_rejected() {
        for text in ["a", "a=max(tip)", "a=max(tip.u_y, x)", "a=max(tip.u_y) +* 2", "a=tip"] {
            let error = ResultColumn::parse(text).unwrap_err().to_string();
            assert!(error.contains("max"), "{text}: {error}");
        }
    }
}
