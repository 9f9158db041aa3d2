//! The paper's Table 2, compiled from the results of its runs as [`text()`], CSV and JSON and compared with the paper's
//! counts.

mod text;

use std::collections::BTreeMap;
use std::sync::LazyLock;

use myovib_scene::csv;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

pub use text::text;

/// Row of the table; its scene is `table2-KEY`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Name of the row on the command line and in JSON.
    pub key: &'static str,
    /// Key of the corresponding row in the paper.
    paper_key: &'static str,
    /// Conventions for the error test to which the row belongs. `paper` means, in the paper's words, "the algebraic
    /// variables are excluded": λ in (28) and (31), but only μ in (29). `multipliers` means λ and μ in all equations.
    /// Empty for a variant missing from the paper.
    conventions: &'static [&'static str],
}

impl Row {
    pub fn scene(&self) -> String {
        format!("table2-{}", self.key)
    }

    /// Returns whether the row is a separate problem. Every other row differs from such a row only in the order of BDF
    /// or in the variables that BDF excludes from the error test.
    pub fn is_distinct(&self) -> bool {
        self.conventions.contains(&"paper")
    }
}

const fn row(
    key: &'static str,
    paper_key: &'static str,
    conventions: &'static [&'static str],
) -> Row {
    Row { key, paper_key, conventions }
}

/// All rows in the order of the table.
pub const ROWS: [Row; 9] = [
    row("1", "1", &["paper", "multipliers"]),
    row("2", "2", &["paper"]),
    row("2m", "2", &["multipliers"]),
    row("3", "3", &["paper"]),
    row("3m", "3", &["multipliers"]),
    row("4", "4", &["paper"]),
    row("4-order2", "4", &[]),
    row("4-suppressed", "4", &[]),
    row("31", "31", &["paper", "multipliers"]),
];

/// Row as printed in the paper.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct PaperRow {
    steps: u64,
    rejected: u64,
    convergence_failures: Option<u64>,
    outcome: String,
}

#[derive(Deserialize)]
struct PaperTable {
    rows: BTreeMap<String, PaperRow>,
}

/// End time of the paper's runs, s.
const T_END: f64 = 10.0;

static PAPER: LazyLock<PaperTable> = LazyLock::new(|| {
    serde_json::from_str(include_str!("../../data/paper/table2.json"))
        .expect("the built-in table is valid, as tested")
});

/// Row together with the document of its run.
#[derive(Debug, Clone)]
pub struct RowRun {
    pub row: Row,
    /// Content of the `run.json` of the run.
    pub document: Value,
}

impl RowRun {
    fn paper(&self) -> &'static PaperRow {
        &PAPER.rows[self.row.paper_key]
    }

    /// Returns whether the run has the end time of the paper. Only then can its counts be compared.
    fn has_the_papers_end(&self) -> bool {
        self.number("t_end") == T_END
    }

    fn count(&self, name: &str) -> u64 {
        self.document[name].as_u64().unwrap_or_default()
    }

    fn number(&self, name: &str) -> f64 {
        self.document[name].as_f64().unwrap_or_default()
    }

    fn word(&self, name: &str) -> &str {
        self.document[name].as_str().unwrap_or_default()
    }

    /// Returns whether the run reached its end time.
    fn is_finished(&self) -> bool {
        self.word("outcome") == "finished"
    }

    fn is_radau(&self) -> bool {
        self.document["stages"].is_u64()
    }

    /// Conventions of the error test; empty for Radau IIA.
    fn conventions(&self) -> &'static [&'static str] {
        if self.is_radau() { &[] } else { self.row.conventions }
    }

    fn convention(&self) -> &'static str {
        match self.conventions() {
            [] => "–",
            [one] => one,
            _ => "both",
        }
    }

    /// Returns whether the outcome of the run is the same as in the paper. `None` for variants and for Radau IIA, which
    /// the paper does not contain.
    fn agrees(&self) -> Option<bool> {
        let has_counterpart = !self.conventions().is_empty();
        has_counterpart.then(|| self.paper().outcome == self.word("outcome"))
    }

    fn constants(&self) -> (f64, f64) {
        let solid = &self.document["scene"]["solid"];
        let kappa = solid["bulk_modulus"].as_f64().unwrap_or(f64::INFINITY);
        (kappa, solid["rayleigh_stiffness"].as_f64().unwrap_or_default())
    }

    /// Names of the blocks excluded from the error test.
    fn suppressed(&self) -> Vec<&str> {
        let fields = self.document["suppressed"].as_array();
        fields.into_iter().flatten().filter_map(Value::as_str).map(symbol).collect()
    }

    /// Maximum order of BDF, or order of Radau IIA.
    fn order(&self) -> u64 {
        self.count(if self.is_radau() { "order" } else { "max_order" })
    }

    fn outcome(&self) -> String {
        match self.document["reason"].as_str() {
            None => "finished".to_owned(),
            Some(reason) => format!("stopped: {}", reason.replace('_', " ")),
        }
    }
}

/// Overall result of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// All outcomes are as expected.
    Done,
    /// The outcome of a run differs from the paper's.
    Differs,
    /// A run with modified settings stopped, so there is no outcome in the paper to compare with.
    Stopped,
    Interrupted,
}

/// Returns the overall result. `is_modified` states whether any setting of the table is overridden.
pub fn verdict(runs: &[RowRun], is_modified: bool) -> Verdict {
    let differs = |run: &RowRun| run.agrees() == Some(false);
    if runs.iter().any(|run| run.word("reason") == "interrupted") {
        Verdict::Interrupted
    } else if !is_modified && runs.iter().any(differs) {
        Verdict::Differs
    } else if is_modified && !runs.iter().all(RowRun::is_finished) {
        Verdict::Stopped
    } else {
        Verdict::Done
    }
}

/// Returns the body of the JSON document.
pub fn document(runs: &[RowRun], mesh_name: &str, is_modified: bool) -> Value {
    let mesh = runs.first().map(|run| &run.document["mesh"]);
    json!({
        "rows": runs.iter().map(row_json).collect::<Vec<_>>(),
        "mesh": {
            "name": mesh_name,
            "vertices": mesh.map(|mesh| &mesh["vertices"]),
            "triangles": mesh.map(|mesh| &mesh["triangles"]),
        },
        "modified": is_modified,
    })
}

/// Describes the row, followed by the statistics and settings of its run.
fn row_json(run: &RowRun) -> Value {
    let solid = &run.document["scene"]["solid"];
    let mut row = Map::from_iter([
        ("key".to_owned(), json!(run.row.key)),
        ("kappa".to_owned(), solid["bulk_modulus"].clone()),
        ("beta".to_owned(), solid["rayleigh_stiffness"].clone()),
        ("convention".to_owned(), json!(run.conventions().first().unwrap_or(&"–"))),
        ("conventions".to_owned(), json!(run.conventions())),
        ("max_order_reason".to_owned(), Value::Null),
        ("linear_work".to_owned(), run.document["work"]["linear"].clone()),
        ("paper".to_owned(), json!(run.paper())),
    ]);
    let of_the_folder = ["scene", "mesh", "work", "output_work"];
    let entries = run.document.as_object().into_iter().flatten();
    let rest = entries.filter(|(name, _)| !of_the_folder.contains(&name.as_str()));
    row.extend(rest.map(|(name, value)| (name.clone(), value.clone())));
    row.insert("suppressed".to_owned(), json!(run.suppressed()));
    for key in ["atol", "indices"] {
        if let Some(Value::Object(blocks)) = row.get_mut(key) {
            let entries = std::mem::take(blocks).into_iter();
            blocks.extend(entries.map(|(name, value)| (symbol(&name).to_owned(), value)));
        }
    }
    Value::Object(row)
}

/// Returns the paper's symbol of a block of unknowns.
fn symbol(name: &str) -> &str {
    match name {
        "u" => "q",
        "p" => "lambda",
        "p_rate" => "mu",
        other => other,
    }
}

/// Returns the table as comma-separated values.
pub fn csv(runs: &[RowRun]) -> String {
    let names = [
        "key",
        "equation",
        "kappa",
        "beta",
        "index",
        "convention",
        "suppressed",
        "max_order",
        "steps",
        "steps_paper",
        "error_test_failures",
        "rejected_paper",
        "step_solve_failures",
        "convergence_failures_paper",
        "t_reached",
        "outcome",
        "reason",
        "cpu_seconds",
        "constraint_drift",
    ];
    let mut text = csv::line(&names);
    for run in runs {
        let (paper, (kappa, beta)) = (run.paper(), run.constants());
        let count = |name| run.count(name).to_string();
        let failures = paper.convergence_failures;
        text += &csv::line(&[
            run.row.key.to_owned(),
            run.word("equation").to_owned(),
            kappa.to_string(),
            beta.to_string(),
            count("index"),
            run.convention().to_owned(),
            run.suppressed().join("+"),
            run.order().to_string(),
            count("steps"),
            paper.steps.to_string(),
            count("error_test_failures"),
            paper.rejected.to_string(),
            count("step_solve_failures"),
            failures.map_or(String::new(), |n| n.to_string()),
            format!("{:.16e}", run.number("t_reached")),
            run.word("outcome").to_owned(),
            run.word("reason").to_owned(),
            format!("{:.3}", run.number("cpu_seconds")),
            format!("{:.16e}", run.number("constraint_drift")),
        ]);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::text::notes;
    use super::*;

    fn ran(key: &str, document: Value) -> RowRun {
        let row = *ROWS.iter().find(|row| row.key == key).unwrap();
        RowRun { row, document }
    }

    fn finished(order: u8, excluded: &[&str]) -> Value {
        json!({ "outcome": "finished", "max_order": order, "suppressed": excluded })
    }

    fn stopped(order: u8) -> Value {
        json!({
            "outcome": "stopped", "reason": "error_test_failures", "message": "at t = 1",
            "max_order": order, "suppressed": [],
        })
    }

    /// Regression: `--rows 4 --max-order 2` reported that row 4 stops at order 5.
    #[test]
    fn notes_describe_only_computed_runs() {
        let alone = notes(&[ran("4", finished(2, &[]))], true);
        assert!(!alone.contains("order 5") && !alone.contains("stop"), "{alone}");
        let all = [
            ran("4", stopped(5)),
            ran("4-order2", finished(2, &[])),
            ran("4-suppressed", finished(2, &["p"])),
        ];
        // Both lists name the runs with their actual orders.
        let notes = notes(&all, false);
        assert!(notes.contains(": 4 (order 5, "), "{notes}");
        assert!(notes.contains("4-suppressed (order 2, lambda "), "{notes}");
    }

    #[test]
    fn the_verdict_follows_the_papers_outcomes() {
        let as_paper = [ran("1", finished(2, &[])), ran("4", stopped(5))];
        assert_eq!(verdict(&as_paper, false), Verdict::Done);
        let unlike = [ran("4", finished(5, &[]))];
        assert_eq!(verdict(&unlike, false), Verdict::Differs);
        assert_eq!(verdict(&unlike, true), Verdict::Done);
        for row in ["1", "4"] {
            assert_eq!(verdict(&[ran(row, stopped(2))], true), Verdict::Stopped);
        }
    }

    /// Regression: the step counts of shorter runs were divided by the step counts of the paper, whose runs reach 10 s.
    #[test]
    fn only_runs_to_the_papers_end_have_a_ratio() {
        let at = |t_end: f64| {
            let mut document = finished(2, &[]);
            (document["t_end"], document["steps"]) = (json!(t_end), json!(3412));
            super::text(&[ran("1", document)], true)
        };
        let ratio = 3412.0 / PAPER.rows["1"].steps as f64;
        let printed = format!("{ratio:.2}");
        assert!(at(10.0).contains(&printed));
        assert!(!at(1.0).contains(&printed));
    }
}
