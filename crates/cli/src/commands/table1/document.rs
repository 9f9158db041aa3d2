//! Table 1 as a JSON document.

use myovib_model::Field;
use myovib_model::counterexample::Solution;
use myovib_model::index::IndexReport;
use myovib_model::table1::Case;
use myovib_scene::json::extend;
use myovib_scene::scene_file::solid::BulkModulus;
use myovib_structure::{VariableIndex, Verdict};
use serde_json::{Value, json};

use super::{RowResult, Sample, law_name};

/// Returns a document with the rows of the table, the limit of (29), and the counterexample. The counterexample
/// compares two solutions: q' of (33), and q of (34) with an additional quadratic multiplier function. Its error is max
/// |q - q'| / max |q'|.
pub(super) fn document(
    rows: &[RowResult],
    limit: &[(Case, IndexReport)],
    [matching, richer]: [&Solution; 2],
) -> Value {
    json!({
        "rows": rows.iter().map(row_json).collect::<Vec<_>>(),
        "limit": limit.iter().map(limit_json).collect::<Vec<_>>(),
        "counterexample": {
            "matching": solution_json(matching),
            "richer": solution_json(richer),
            "error": richer.error(matching),
        },
    })
}

/// `multiplier` is max |M⁻¹B̃ᵀμ| / max |v|.
fn solution_json(solution: &Solution) -> Value {
    json!({
        "verdict": solution.index.to_string(),
        "multipliers": solution.multipliers,
        "dependent": solution.dependent,
        "multiplier": solution.multiplier,
        "amplitude": solution.amplitude,
    })
}

/// `index` is null if it is undecided.
fn row_json(row: &RowResult) -> Value {
    let case = &row.case;
    json!({
        "equation": case.equation,
        "formulation": case.formulation.name(),
        "law": law_name(case.law),
        "kappa": BulkModulus(case.kappa),
        "beta": case.beta,
        "paper": case.printed,
        "index": row.index(),
        "gap_decades": row.gap(),
        "samples": row.samples.iter().map(sample_json).collect::<Vec<_>>(),
    })
}

fn sample_json(sample: &Sample) -> Value {
    let mut json = report_json(&sample.report);
    extend(&mut json, json!({ "triangles": sample.triangles, "seed": sample.seed }));
    json
}

fn limit_json((case, report): &(Case, IndexReport)) -> Value {
    let mut json = report_json(report);
    extend(&mut json, json!({ "kappa": BulkModulus(case.kappa), "beta": case.beta }));
    json
}

/// Returns the index and the numerical evidence for it. `index` is null if it is undecided, or if the system has no
/// index; `verdict` is the result in words.
pub(in crate::commands) fn report_json(report: &IndexReport) -> Value {
    let block = |(field, found): &(Field, VariableIndex)| {
        json!({
            "field": field.name(),
            "index": found.index,
            "decisive": found.verdict == Verdict::Decisive,
        })
    };
    json!({
        "unknowns": report.unknowns,
        "index": report.decided(),
        "verdict": report.index.to_string(),
        "gap_decades": report.gap,
        "blocks": report.blocks.iter().map(block).collect::<Vec<_>>(),
        "decisions": report.decisions,
    })
}
