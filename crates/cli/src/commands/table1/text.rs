//! Table 1 as text.

use std::collections::BTreeSet;

use myovib_model::counterexample::Solution;
use myovib_model::index::IndexReport;
use myovib_model::table1::Case;

use super::{RowResult, law_name};
use myovib_report::table::{Align, Cell, Table, Tone, colored_stdout, exponent, kappa};

/// Formats the computed table next to the paper's values, followed by the limit of (29).
pub(super) fn table(rows: &[RowResult], limit: &[(Case, IndexReport)]) -> String {
    use Align::{Left, Right};
    let colored = colored_stdout();
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
            case.equation.map_or("–".into(), |e| format!("({e})")).into(),
            case.formulation.name().into(),
            law_name(case.law).into(),
            kappa(case.kappa).into(),
            exponent(case.beta).into(),
            printed.into(),
            Cell::new(computed, tone),
            row.block("u").into(),
            row.block("v").into(),
            row.block("p").into(),
            row.block("p_rate").into(),
            format!("{:.1}", row.gap()).into(),
            row.samples.len().to_string().into(),
        ]);
    }
    let mut text = table.render(colored);
    text.push_str(&notes(rows));
    if limit.is_empty() {
        return text;
    }
    text.push_str(&toward_limit(limit));
    let mut way =
        Table::new(&[("κ", Left), ("β", Left), ("index", Right), ("gap, decades", Right)]);
    for (case, report) in limit {
        way.row([
            kappa(case.kappa).into(),
            exponent(case.beta).into(),
            report.index.to_string().into(),
            format!("{:.1}", report.gap).into(),
        ]);
    }
    text.push_str(&way.render(colored));
    text
}

/// Explains the columns and states the number of samples.
fn notes(rows: &[RowResult]) -> String {
    let samples = || rows.iter().flat_map(|row| &row.samples);
    let meshes: BTreeSet<usize> = samples().map(|sample| sample.triangles).collect();
    let states: BTreeSet<u64> = samples().map(|sample| sample.seed).collect();
    let meshes: Vec<String> = meshes.iter().map(usize::to_string).collect();
    let is_remark = |row: &RowResult| {
        let Case { equation, beta, printed, .. } = row.case;
        equation == Some("29") && beta == 0.0 && printed.is_some()
    };
    let remark = match rows.iter().any(is_remark) {
        true => " (29) with β = 0 is from the remark below the paper's table.",
        false => "",
    };
    format!(
        "\nq v λ μ: perturbation index of each block. gap: the narrowest gap between values treated as zero and as \
         nonzero;\na gap of three decades is decisive. samples: meshes of {} triangles, random states: \
         {}.{remark}\n\n",
        meshes.join(", "),
        states.len()
    )
}

/// Formats the results for (29) as κ → ∞ and β → 0.
fn toward_limit(limit: &[(Case, IndexReport)]) -> String {
    let found = match limit {
        [] => String::new(),
        [earlier @ .., (_, last)] => {
            let mut indices: Vec<String> =
                earlier.iter().map(|(_, r)| r.index.to_string()).collect();
            indices.dedup();
            let gaps: Vec<f64> = earlier.iter().map(|(_, report)| report.gap).collect();
            let trend = match gaps.is_sorted_by(|a, b| a > b) {
                true => ", with decreasing gap",
                false => "",
            };
            format!(
                " has index {}{trend}, and {} in the limit",
                indices.join(", then "),
                last.index
            )
        }
    };
    format!("(29) as κ → ∞, β → 0{found}:\n")
}

/// Formats the comparison between (33) and (34) in the discretization of COMSOL.
pub(super) fn counterexample(matching: &Solution, richer: &Solution) -> String {
    use Align::{Left, Right};
    let mut table = Table::new(&[
        ("extra multiplier", Left),
        ("index", Left),
        ("multipliers", Right),
        ("dependent", Right),
        ("|v - q̇| / |v|", Right),
        ("error of q", Right),
    ]);
    for (name, solution) in
        [("linear, like the pressure: (33)", matching), ("quadratic: (34) as in COMSOL", richer)]
    {
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
        "\nThe paper's counterexample (34): equations (33) with the extra multiplier in a richer space than the \
         pressure.\nCantilever under an 8 Hz load, 0.5 s. M (v - q̇) = B̃ᵀμ should be zero:\n{}",
        table.render(colored_stdout())
    )
}

#[cfg(test)]
mod tests {
    use myovib_model::table1;

    use super::*;

    /// Regression: the notes did not depend on which samples were computed.
    #[test]
    fn notes_are_of_the_samples_that_were_computed() {
        let row = |equation: &str, beta: f64, kappa: f64, n: usize| {
            let of = |case: &Case| {
                case.equation == Some(equation) && case.beta == beta && case.kappa == kappa
            };
            let case = table1::cases().into_iter().find(of).unwrap();
            let mut samples = case.samples().unwrap();
            samples.truncate(n);
            RowResult { case, samples }
        };
        let remark = "the remark below the paper's table";
        let position = row("28", 0.0, 1e5, 1);
        let triangles = position.samples[0].triangles;
        let text = table(&[position], &[]);
        let reported = format!("meshes of {triangles} triangles, random states: 1.");
        assert!(text.contains(&reported), "{text}");
        assert!(!text.contains(remark) && !text.contains("on the way"), "{text}");
        let text = table(&[row("29", 0.0, f64::INFINITY, 4)], &[]);
        assert!(text.contains("triangles, random states: 2."), "{text}");
        assert!(text.contains(remark), "{text}");
        // (29) with β = 0 and a finite κ appears neither in the table nor in the remark.
        assert!(!table(&[row("29", 0.0, 1e5, 1)], &[]).contains(remark));
    }
}
