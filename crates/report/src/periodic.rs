//! Tables of a periodic state: stability, multipliers, and harmonics of the probes.

use myovib_scene::escape;
use myovib_scene::periodic::{Column, Periodic};

use crate::table::{Align, Table, colored_stdout};

/// Number of harmonics in tables; `run.json` contains the others.
const MOST_HARMONICS: usize = 3;

/// Returns the values of all probes with their names.
fn columns(found: &Periodic) -> impl Iterator<Item = (&str, &Column)> {
    let probes = found.probes.iter();
    probes.flat_map(|probe| {
        let columns = probe.columns.iter();
        columns.map(|column| (&*probe.name, column))
    })
}

/// Returns mean, range, and the amplitudes of the first harmonics.
fn numbers(column: &Column) -> Vec<f64> {
    let mut numbers = vec![column.mean, column.minimum, column.maximum];
    numbers.extend(column.amplitudes.iter().take(MOST_HARMONICS));
    numbers
}

/// Describes the period, the stability, and the multipliers.
fn description(found: &Periodic) -> String {
    let multipliers = found.multipliers.iter().map(|[re, im]| match *im == 0.0 {
        true => format!("{re:.6}"),
        false => format!(
            "{re:.6} {} {:.6} i",
            if *im < 0.0 { "-" } else { "+" },
            im.abs()
        ),
    });
    let multipliers: Vec<String> = multipliers.collect();
    format!(
        "Periodic state at {} Hz, {}. Largest |multiplier|: {:.6}; leading multipliers: {}. \
         {} Newton iterations, {} integrations over a period; the ends of the period differ by {:.1e}.",
        found.frequency,
        match found.is_stable {
            Some(true) => "stable",
            Some(false) => "unstable",
            None => "neither stable nor unstable",
        },
        found.spectral_radius,
        multipliers.join(", "),
        found.newton_iterations,
        found.integrations,
        found.residual,
    )
}

/// Returns the harmonics of all probes as a table.
pub fn text(found: &Periodic) -> String {
    let right = ["mean", "minimum", "maximum", "|f|", "|2 f|", "|3 f|"];
    let right = right.map(|name| (name, Align::Right));
    let left = [("probe", Align::Left), ("value", Align::Left)];
    let mut table = Table::new(&[&left[..], &right[..]].concat());
    for (probe, column) in columns(found) {
        let numbers = numbers(column).into_iter();
        let numbers = numbers.map(|number| format!("{number:.4e}").into());
        let names = [probe.into(), (&*column.name).into()].into_iter();
        table.row(names.chain(numbers));
    }
    format!("{}{}\n", table.render(colored_stdout()), description(found))
}

/// Returns the section of the report.
pub(crate) fn section(found: &Periodic) -> String {
    let rows = columns(found).map(|(probe, column)| {
        let numbers = numbers(column).into_iter();
        let numbers = numbers.map(|number| format!("<td class=\"n\">{number:.4e}</td>"));
        format!(
            "<tr><td>{}</td><td>{}</td>{}</tr>\n",
            escape(probe),
            escape(&column.name),
            numbers.collect::<String>()
        )
    });
    let names = ["mean", "minimum", "maximum", "|f|", "|2 f|", "|3 f|"];
    let names = names.map(|name| format!("<th class=\"n\">{name}</th>"));
    format!(
        "<h2>Periodic state</h2>\n<p>{}</p>\n<table><tr><th>probe</th><th>value</th>{}</tr>\n{}</table>\n",
        description(found),
        names.concat(),
        rows.collect::<String>()
    )
}
