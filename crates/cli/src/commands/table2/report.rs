//! The table as text, CSV and JSON, beside the paper's.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::sync::LazyLock;

use myovib_fem::Mesh;
use myovib_model::linear::LinearWork;
use myovib_model::{Outcome, StopReason};
use serde::{Deserialize, Serialize};

use super::rows::Convention;
use super::run_row::RowResult;
use super::{Suppress, Table2Args};
use crate::exit::Exit;
use myovib_report::table::{Align, Cell, Table, Tone, coloured_stdout, compared, exponent, kappa};
use myovib_scene::json;
use myovib_scene::statistics::StatisticsJson;

/// What the paper printed.
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

static PAPER: LazyLock<PaperTable> = LazyLock::new(|| {
    serde_json::from_str(include_str!("../../../../../data/paper/table2.json"))
        .expect("the paper's table is part of the program, and tested")
});

fn paper(result: &RowResult) -> &'static PaperRow {
    &PAPER.rows[result.row.paper_key]
}

/// Whether the run ended as the paper's did. Variants and Radau IIA have no counterpart there.
fn agrees(result: &RowResult) -> Option<bool> {
    (result.convention() != Convention::Variant)
        .then(|| paper(result).outcome == result.statistics.outcome.name())
}

/// The exit code: a run that ends otherwise than the paper's. Where settings are overridden, only
/// a stop of a run that the paper finished counts, or one of Radau IIA.
pub(super) fn exit(results: &[RowResult], is_modified: bool) -> Exit {
    let reason = |result: &RowResult| result.statistics.outcome.reason();
    if results
        .iter()
        .any(|result| reason(result) == Some(StopReason::Interrupted))
    {
        return Exit::Interrupted;
    }
    let differs = results.iter().any(|result| agrees(result) == Some(false));
    let stopped = results.iter().any(|result| {
        let should_finish = agrees(result) == Some(false) || is_radau(result);
        should_finish && result.statistics.outcome != Outcome::Finished
    });
    match (is_modified, differs, stopped) {
        (false, true, _) => Exit::Differs,
        (true, _, true) => Exit::Stopped,
        _ => Exit::Done,
    }
}

fn is_radau(result: &RowResult) -> bool {
    result.settings.integrator.stages().is_some()
}

fn suppressed(result: &RowResult) -> String {
    let symbols: Vec<_> = result
        .settings
        .suppressed
        .iter()
        .map(|field| field.symbol())
        .collect();
    if symbols.is_empty() {
        "none".into()
    } else {
        symbols.join(",")
    }
}

/// The table for people: counts beside the paper's, then what stands behind them.
pub(super) fn text(results: &[RowResult], args: &Table2Args) -> String {
    let coloured = coloured_stdout();
    format!(
        "{}\n{}\n{}",
        comparison(results).render(coloured),
        settings_and_work(results).render(coloured),
        notes(results, args)
    )
}

fn comparison(results: &[RowResult]) -> Table {
    use Align::{Left, Right};
    let mut table = Table::new(&[
        ("row", Left),
        ("eq.", Left),
        ("κ", Left),
        ("β", Left),
        ("index", Right),
        ("convention", Left),
        ("steps: paper", Right),
        ("ours", Right),
        ("ratio", Right),
        ("rejected: paper", Right),
        ("ours", Right),
        ("ratio", Right),
        ("conv. fail.: paper", Right),
        ("ours", Right),
        ("ratio", Right),
        ("t reached", Right),
        ("CPU s", Right),
        ("outcome", Left),
    ]);
    for result in results {
        let (row, statistics, paper) = (result.row, &result.statistics, paper(result));
        let outcome = match &statistics.outcome {
            Outcome::Finished => "finished".to_owned(),
            Outcome::Stopped { reason, .. } => format!("stopped: {reason}"),
        };
        let tone = match agrees(result) {
            Some(true) => Tone::Good,
            Some(false) => Tone::Bad,
            None => Tone::Plain,
        };
        let mut cells: Vec<Cell> = [
            row.key.into(),
            format!("({})", row.formulation.equation()),
            kappa(row.kappa),
            exponent(row.beta),
            result.index.to_string(),
            result.convention().name().into(),
        ]
        .map(Cell::from)
        .into();
        cells.extend(compared(Some(paper.steps), statistics.counts.steps));
        cells.extend(compared(
            Some(paper.rejected),
            statistics.counts.error_test_failures,
        ));
        cells.extend(compared(
            paper.convergence_failures,
            statistics.counts.step_solve_failures,
        ));
        cells.push(format!("{:.4}", statistics.t_reached).into());
        cells.push(format!("{:.2}", statistics.cpu_seconds).into());
        cells.push(Cell::new(outcome, tone));
        table.row(cells);
    }
    table
}

fn settings_and_work(results: &[RowResult]) -> Table {
    use Align::{Left, Right};
    let mut table = Table::new(&[
        ("row", Left),
        ("left out", Left),
        ("max order", Right),
        ("unknowns", Right),
        ("residuals", Right),
        ("Newton it.", Right),
        ("Newton fail.", Right),
        ("factorisations", Right),
        ("drift", Right),
    ]);
    for result in results {
        let statistics = &result.statistics;
        table.row(
            [
                result.row.key.to_owned(),
                suppressed(result),
                result.order().to_string(),
                result.unknowns.to_string(),
                statistics.counts.residual_evaluations.to_string(),
                statistics.counts.newton_iterations.to_string(),
                statistics.counts.newton_failures.to_string(),
                statistics.counts.linear_setups.to_string(),
                format!("{:.1e}", result.constraint_drift),
            ]
            .map(Cell::from),
        );
    }
    table
}

/// The step ratios of the rows of one convention, on one line.
fn convention_line(results: &[RowResult], name: &str, meaning: &str) -> String {
    let ratios: Vec<String> = results
        .iter()
        .filter(|result| result.convention().names().contains(&name))
        .map(|result| {
            let ratio = result.statistics.counts.steps as f64 / paper(result).steps as f64;
            format!("{} {ratio:.2}", result.row.key)
        })
        .collect();
    if ratios.is_empty() {
        return String::new();
    }
    format!(
        "convention `{name}`: {meaning}. Steps, ours : paper: {}\n",
        ratios.join(", ")
    )
}

fn notes(results: &[RowResult], args: &Table2Args) -> String {
    let mut notes = convention_line(
        results,
        "paper",
        "the algebraic variables are left out of the error test, λ in (28) and (31), only μ in (29)",
    );
    notes += &convention_line(
        results,
        "multipliers",
        "λ and μ are left out everywhere, which comes closest to the paper",
    );
    if let Some(order) = args.integrator.order() {
        notes.push_str(&format!(
            "Radau IIA of order {order}: the rows' order and what they leave out of the error test \
             are those of BDF; here {}.\n",
            match &args.suppress {
                Suppress::Default => "all variables are tested",
                Suppress::Blocks(_) => "what `left out` says is left out",
            }
        ));
    }
    if args.is_modified() {
        notes.push_str("Settings differ from those of the table: the outcomes are not judged.\n");
    }
    let mut stops = results
        .iter()
        .filter_map(|result| match &result.statistics.outcome {
            Outcome::Stopped { message, .. } => Some((result, message)),
            Outcome::Finished => None,
        });
    if let Some(first) = stops.next() {
        for (result, message) in std::iter::once(first).chain(stops) {
            notes.push_str(&format!(
                "row {} (index {}) stopped: {message}\n",
                result.row.key, result.index
            ));
        }
    }
    if results
        .iter()
        .any(|result| result.row.key == "4" && !is_radau(result))
    {
        notes.push_str(
            "Row 4 stops with λ in the error test at order 5, as the paper's run did; no setting \
             gives both the paper's other counts and this failure: at order 2 (4-order2), or with λ \
             left out (4-suppressed), it runs through.\n",
        );
    }
    notes
}

#[derive(Serialize)]
struct RowJson<'a> {
    key: &'a str,
    equation: &'a str,
    formulation: &'a str,
    #[serde(serialize_with = "json::kappa")]
    kappa: f64,
    beta: f64,
    index: u8,
    /// The first of `conventions`, as in the contract's example.
    convention: &'a str,
    conventions: &'a [&'a str],
    #[serde(flatten)]
    statistics: StatisticsJson<'a>,
    /// Why `max_order` was chosen; null where it was given.
    max_order_reason: Option<&'a str>,
    linear_work: LinearWork,
    unknowns: usize,
    unknowns_paper: usize,
    constraint_drift: f64,
    paper: &'a PaperRow,
}

/// The body of the JSON document.
#[derive(Serialize)]
pub(super) struct Document<'a> {
    rows: Vec<RowJson<'a>>,
    mesh: MeshJson<'a>,
    modified: bool,
}

#[derive(Serialize)]
struct MeshJson<'a> {
    name: &'a str,
    vertices: usize,
    triangles: usize,
}

/// The table for programs.
pub(super) fn document<'a>(
    results: &'a [RowResult],
    mesh: &Mesh,
    mesh_name: &'a str,
    args: &Table2Args,
) -> Document<'a> {
    let rows = results
        .iter()
        .map(|result| RowJson {
            key: result.row.key,
            equation: result.row.formulation.equation(),
            formulation: result.row.formulation.name(),
            kappa: result.row.kappa,
            beta: result.row.beta,
            index: result.index,
            convention: result.convention().names().first().unwrap_or(&"–"),
            conventions: result.convention().names(),
            statistics: StatisticsJson::new(
                &result.statistics,
                &result.settings,
                result.row.formulation,
            ),
            max_order_reason: result.max_order_reason.as_deref(),
            linear_work: result.linear_work,
            unknowns: result.unknowns,
            unknowns_paper: result.unknowns_paper,
            constraint_drift: result.constraint_drift,
            paper: paper(result),
        })
        .collect();
    let mesh = MeshJson {
        name: mesh_name,
        vertices: mesh.n_points(),
        triangles: mesh.n_elements(),
    };
    Document {
        rows,
        mesh,
        modified: args.is_modified(),
    }
}

/// The table as comma-separated values.
pub(super) fn write_csv(sink: &mut dyn Write, results: &[RowResult]) -> io::Result<()> {
    writeln!(
        sink,
        "key,equation,kappa,beta,index,convention,suppressed,max_order,steps,steps_paper,\
         error_test_failures,rejected_paper,step_solve_failures,convergence_failures_paper,\
         t_reached,outcome,reason,cpu_seconds,constraint_drift"
    )?;
    for result in results {
        let (row, statistics, paper) = (result.row, &result.statistics, paper(result));
        writeln!(
            sink,
            "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{:.16e},{},{},{:.3},{:.16e}",
            row.key,
            row.formulation.equation(),
            row.kappa,
            row.beta,
            result.index,
            result.convention().name(),
            suppressed(result).replace(',', "+"),
            result.order(),
            statistics.counts.steps,
            paper.steps,
            statistics.counts.error_test_failures,
            paper.rejected,
            statistics.counts.step_solve_failures,
            paper
                .convergence_failures
                .map_or(String::new(), |n| n.to_string()),
            statistics.t_reached,
            statistics.outcome.name(),
            statistics
                .outcome
                .reason()
                .map_or("", |reason| reason.name()),
            statistics.cpu_seconds,
            result.constraint_drift,
        )?;
    }
    Ok(())
}
