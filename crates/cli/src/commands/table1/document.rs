//! Table 1 as JSON.

use myovib_model::Field;
use myovib_model::counterexample::Solution;
use myovib_model::index::IndexReport;
use myovib_model::table1::Case;
use myovib_scene::json::kappa;
use myovib_structure::{VariableIndex, Verdict};
use serde::Serialize;
use serde_json::{Value, json};

use super::{RowResult, law_name};

/// Returns the document of the table's rows, of the limit of (29), and of the counterexample with the original and with
/// a richer multiplier.
pub(super) fn document(
    rows: &[RowResult],
    limit: &[(Case, IndexReport)],
    [matching, richer]: [&Solution; 2],
) -> Document {
    Document {
        rows: rows.iter().map(row_json).collect(),
        limit: limit
            .iter()
            .map(|(case, report)| LimitJson {
                kappa: case.kappa,
                beta: case.beta,
                report: report_json(report),
            })
            .collect(),
        counterexample: json!({
            "matching": solution_json(matching),
            "richer": solution_json(richer),
            "error": richer.error(matching),
        }),
    }
}

/// Document of the command.
#[derive(Serialize)]
pub(super) struct Document {
    rows: Vec<RowJson>,
    limit: Vec<LimitJson>,
    /// The solutions of (33) and, with an additional quadratic multiplier function, of (34), and max |q - q'| / max |q'|, where
    /// q' is the solution of (33).
    counterexample: Value,
}

/// `multiplier`: max |M⁻¹B̃ᵀμ| / max |v|.
fn solution_json(solution: &Solution) -> Value {
    json!({
        "verdict": solution.index.to_string(),
        "multipliers": solution.multipliers,
        "dependent": solution.dependent,
        "multiplier": solution.multiplier,
        "amplitude": solution.amplitude,
    })
}

#[derive(Serialize)]
struct RowJson {
    equation: Option<&'static str>,
    formulation: &'static str,
    law: &'static str,
    #[serde(serialize_with = "kappa")]
    kappa: f64,
    beta: f64,
    /// Index printed in the paper.
    paper: Option<usize>,
    /// Computed index; null if undecided.
    index: Option<usize>,
    gap_decades: f64,
    samples: Vec<SampleJson>,
}

#[derive(Serialize)]
struct SampleJson {
    triangles: usize,
    seed: u64,
    #[serde(flatten)]
    report: ReportJson,
}

#[derive(Serialize)]
struct LimitJson {
    #[serde(serialize_with = "kappa")]
    kappa: f64,
    beta: f64,
    #[serde(flatten)]
    report: ReportJson,
}

/// Index with the numerical evidence.
#[derive(Serialize)]
pub(in crate::commands) struct ReportJson {
    unknowns: usize,
    /// Null if undecided, or if the system has no index.
    index: Option<usize>,
    /// Result in words.
    verdict: String,
    gap_decades: f64,
    blocks: Vec<Value>,
    decisions: Vec<String>,
}

fn row_json(row: &RowResult) -> RowJson {
    let case = &row.case;
    RowJson {
        equation: case.equation,
        formulation: case.formulation.name(),
        law: law_name(case.law),
        kappa: case.kappa,
        beta: case.beta,
        paper: case.printed,
        index: row.index(),
        gap_decades: row.gap(),
        samples: row
            .samples
            .iter()
            .map(|sample| SampleJson {
                triangles: sample.triangles,
                seed: sample.seed,
                report: report_json(&sample.report),
            })
            .collect(),
    }
}

/// Converts a report for the JSON document.
pub(in crate::commands) fn report_json(report: &IndexReport) -> ReportJson {
    let block = |(field, found): &(Field, VariableIndex)| {
        json!({
            "field": field.name(),
            "index": found.index,
            "decisive": found.verdict == Verdict::Decisive,
        })
    };
    ReportJson {
        unknowns: report.unknowns,
        index: report.decided(),
        verdict: report.index.to_string(),
        gap_decades: report.gap,
        blocks: report.blocks.iter().map(block).collect(),
        decisions: report.decisions.clone(),
    }
}
