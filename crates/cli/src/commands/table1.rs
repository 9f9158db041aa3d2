//! `myovib table1`: the indices of the paper's Table 1, computed from matrices.

use clap::Args;
use myovib_fem::{Law, generate};
use myovib_model::Field;
use myovib_model::counterexample::{self, MultiplierSpace, Solution};
use myovib_model::index::IndexReport;
use myovib_model::table1::{self, Case, Sample};
use myovib_structure::Verdict;
use serde::Serialize;

use crate::args::CommonArgs;
use crate::exit::Exit;
use crate::json;
use crate::report::{Align, Cell, Table, Tone, coloured_stdout, exponent, kappa};

/// Options of `myovib table1`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib table1\n  \
    myovib table1 --json t1.json\n\n\
    Every index is computed from the matrices alone, on two meshes and at two random, consistent \
    states of large strain. Exit code 1 when one differs from the paper's or is undecided.")]
pub struct Table1Args {
    /// Options of every command.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// A case with its samples, and what they say together.
struct RowResult {
    case: Case,
    samples: Vec<Sample>,
}

impl RowResult {
    /// The index, if all samples decided for the same.
    fn index(&self) -> Option<usize> {
        let first = self.samples.first()?.report.decided();
        let agree = self.samples.iter().all(|s| s.report.decided() == first);
        first.filter(|_| agree)
    }

    /// The narrowest gap of all samples.
    fn gap(&self) -> f64 {
        let gaps = self.samples.iter().map(|sample| sample.report.gap);
        gaps.fold(f64::INFINITY, f64::min)
    }

    /// Whether the index is the printed one; `None` where nothing is printed.
    fn agrees(&self) -> Option<bool> {
        let printed = self.case.printed?;
        Some(self.index() == Some(printed))
    }

    /// The index of a block: the same in all samples, or `?`.
    fn block(&self, symbol: &str) -> String {
        let mut found = self.samples.iter().map(|s| block(&s.report, symbol));
        let first = found.next().flatten();
        match first {
            None => String::new(),
            Some(text) if found.all(|other| other.as_deref() == Some(&text)) => text,
            Some(_) => "?".into(),
        }
    }
}

/// The index of the block with this symbol, with a question mark where a gap is not decisive.
fn block(report: &IndexReport, symbol: &str) -> Option<String> {
    let (_, found) = report.blocks.iter().find(|(f, _)| f.symbol() == symbol)?;
    let doubt = if found.verdict == Verdict::Decisive {
        ""
    } else {
        "?"
    };
    Some(format!("{}{doubt}", found.index))
}

/// Computes and prints the table.
///
/// # Errors
/// When an index cannot be computed at all, or an output cannot be written.
pub fn run(args: &Table1Args) -> anyhow::Result<Exit> {
    let rows = table1::cases()
        .into_iter()
        .map(|case| {
            let samples = case.samples()?;
            Ok(RowResult { case, samples })
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    let limit = table1::limit()?;
    let mesh = generate::beam(0.1, 0.04, [4, 2])?;
    let matching = counterexample::solve(&mesh, MultiplierSpace::Linear)?;
    let richer = counterexample::solve(&mesh, MultiplierSpace::Quadratic)?;
    let document = Document {
        rows: rows.iter().map(row_json).collect(),
        limit: limit
            .iter()
            .map(|(case, report)| LimitJson {
                kappa: case.kappa,
                beta: case.beta,
                report: report_json(report),
            })
            .collect(),
        counterexample: CounterexampleJson {
            matching: solution_json(&matching),
            richer: solution_json(&richer),
            error: richer.error(&matching),
        },
    };
    let mut text = text(&rows, &limit);
    text.push_str(&counterexample_text(&matching, &richer));
    args.common.give("table1", &text, &document)?;
    let settled = rows
        .iter()
        .all(|row| row.index().is_some() && row.agrees() != Some(false));
    Ok(if settled { Exit::Done } else { Exit::Differs })
}

fn law_name(law: Law) -> &'static str {
    if law.is_linear() {
        "small strain"
    } else {
        "Mooney–Rivlin"
    }
}

fn text(rows: &[RowResult], limit: &[(Case, IndexReport)]) -> String {
    use Align::{Left, Right};
    let coloured = coloured_stdout();
    let mut table = Table::new(&[
        ("eq.", Left),
        ("formulation", Left),
        ("law", Left),
        ("κ", Left),
        ("β", Left),
        ("index: paper", Right),
        ("computed", Right),
        ("q", Right),
        ("v", Right),
        ("λ", Right),
        ("μ", Right),
        ("gap, decades", Right),
        ("samples", Right),
    ]);
    for row in rows {
        let case = &row.case;
        let tone = match (row.index(), row.agrees()) {
            (None, _) | (_, Some(false)) => Tone::Bad,
            (_, Some(true)) => Tone::Good,
            (_, None) => Tone::Plain,
        };
        let printed = case.printed.map_or("–".into(), |index| index.to_string());
        let computed = row.index().map_or("undecided".into(), |i| i.to_string());
        table.row([
            case.equation
                .map_or("–".into(), |e| format!("({e})"))
                .into(),
            case.formulation.name().into(),
            law_name(case.law).into(),
            kappa(case.kappa).into(),
            exponent(case.beta).into(),
            printed.into(),
            Cell::new(computed, tone),
            row.block("q").into(),
            row.block("v").into(),
            row.block("lambda").into(),
            row.block("mu").into(),
            format!("{:.1}", row.gap()).into(),
            row.samples.len().to_string().into(),
        ]);
    }
    let mut text = table.render(coloured);
    text.push_str(
        "\nq v λ μ: perturbation index of each block. gap: the narrowest between what was called \
         zero and what was not;\nthree decades decide. samples: 2 meshes × 2 random states. \
         (29) with β = 0 is the paper's remark below its table.\n\n\
         (29) on the way to κ → ∞, β → 0 has index 2 ever less clearly, and 4 in the limit:\n",
    );
    let mut way = Table::new(&[
        ("κ", Left),
        ("β", Left),
        ("index", Right),
        ("gap, decades", Right),
    ]);
    for (case, report) in limit {
        way.row([
            kappa(case.kappa).into(),
            exponent(case.beta).into(),
            report.index.to_string().into(),
            format!("{:.1}", report.gap).into(),
        ]);
    }
    text.push_str(&way.render(coloured));
    text
}

/// (34) as COMSOL discretised it, beside (33).
fn counterexample_text(matching: &Solution, richer: &Solution) -> String {
    use Align::{Left, Right};
    let mut table = Table::new(&[
        ("extra multiplier", Left),
        ("index", Left),
        ("multipliers", Right),
        ("dependent", Right),
        ("|v - q̇| / |v|", Right),
        ("error of q", Right),
    ]);
    for (name, solution) in [
        ("linear, as the pressure: (33)", matching),
        ("quadratic: (34) as in COMSOL", richer),
    ] {
        table.row([
            name.into(),
            solution.index.to_string().into(),
            solution.multipliers.to_string().into(),
            solution.dependent.to_string().into(),
            format!("{:.1e}", solution.multiplier).into(),
            format!("{:.1e}", solution.error(matching)).into(),
        ]);
    }
    format!(
        "\nThe paper's counterexample: the extra multiplier of (33) in a richer space than the \
         pressure, on a cantilever\nunder 8 Hz for 0.5 s. M (v - q̇) = B̃ᵀμ should be zero:\n{}",
        table.render(coloured_stdout())
    )
}

#[derive(Serialize)]
struct Document {
    rows: Vec<RowJson>,
    limit: Vec<LimitJson>,
    counterexample: CounterexampleJson,
}

#[derive(Serialize)]
struct CounterexampleJson {
    /// (33).
    matching: SolutionJson,
    /// (34) with a quadratic extra multiplier.
    richer: SolutionJson,
    /// max |q - q'| / max |q'|, q' of (33).
    error: f64,
}

#[derive(Serialize)]
struct SolutionJson {
    verdict: String,
    multipliers: usize,
    dependent: usize,
    /// max |M⁻¹B̃ᵀμ| / max |v|.
    multiplier: f64,
    amplitude: f64,
}

fn solution_json(solution: &Solution) -> SolutionJson {
    SolutionJson {
        verdict: solution.index.to_string(),
        multipliers: solution.multipliers,
        dependent: solution.dependent,
        multiplier: solution.multiplier,
        amplitude: solution.amplitude,
    }
}

#[derive(Serialize)]
struct RowJson {
    equation: Option<&'static str>,
    formulation: &'static str,
    law: &'static str,
    #[serde(serialize_with = "json::kappa")]
    kappa: f64,
    beta: f64,
    /// As printed in the paper.
    paper: Option<usize>,
    /// As computed; null when undecided.
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
    #[serde(serialize_with = "json::kappa")]
    kappa: f64,
    beta: f64,
    #[serde(flatten)]
    report: ReportJson,
}

/// An index with its evidence.
#[derive(Serialize)]
pub(super) struct ReportJson {
    unknowns: usize,
    /// Null when undecided, or when there is none.
    index: Option<usize>,
    /// The same in words.
    verdict: String,
    gap_decades: f64,
    blocks: Vec<BlockJson>,
    decisions: Vec<String>,
}

#[derive(Serialize)]
struct BlockJson {
    field: &'static str,
    index: u8,
    decisive: bool,
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

/// The document's form of a report.
pub(super) fn report_json(report: &IndexReport) -> ReportJson {
    let block = |(field, found): &(Field, myovib_structure::VariableIndex)| BlockJson {
        field: field.symbol(),
        index: found.index,
        decisive: found.verdict == Verdict::Decisive,
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
