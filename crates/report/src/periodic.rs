//! Tables of a periodic state: stability, multipliers, and harmonics of the probes.

use myovib_scene::periodic::{Column, Curve, CurvePoint, Periodic};

use crate::page::data::PageData;
use crate::page::frame::figure;
use crate::page::probes::{label, unit};
use crate::plot::{Axis, Figure, LinePlot, Series};
use crate::table::{Align, Table, colored_stdout};

/// Maximum number of harmonics in tables; `run.json` contains all of them.
const MOST_HARMONICS: usize = 3;

/// Returns the columns of all probes, each with the name of its probe.
fn columns(found: &Periodic) -> impl Iterator<Item = (&str, &Column)> {
    let probes = found.probes.iter();
    probes.flat_map(|probe| {
        let columns = probe.columns.iter();
        columns.map(|column| (&*probe.name, column))
    })
}

/// Returns the mean, the range, and the amplitudes of the first harmonics.
fn numbers(column: &Column) -> Vec<f64> {
    let mut numbers = vec![column.mean, column.minimum, column.maximum];
    numbers.extend(column.amplitudes.iter().take(MOST_HARMONICS));
    numbers
}

/// Describes the period, the stability, and the multipliers.
fn description(found: &Periodic) -> String {
    let multipliers = found.multipliers.iter().map(|[re, im]| match *im == 0.0 {
        true => format!("{re:.6}"),
        false => format!("{re:.6} {} {:.6} i", if *im < 0.0 { "-" } else { "+" }, im.abs()),
    });
    let multipliers: Vec<String> = multipliers.collect();
    let leading = found.spectral_radius.map_or(String::new(), |radius| {
        let all = multipliers.join(", ");
        format!(" Largest |multiplier|: {radius:.6}; leading multipliers: {all}.")
    });
    format!(
        "Periodic state at {} Hz, {}.{leading} {} Newton iterations, {} integrations over a period; the states at its ends differ by {:.1e}.",
        found.frequency,
        match found.is_stable {
            Some(true) => "stable",
            Some(false) => "unstable",
            None if found.spectral_radius.is_none() => "of unknown stability",
            None => "of unresolved stability",
        },
        found.newton_iterations,
        found.integrations,
        found.residual,
    )
}

fn harmonics(found: &Periodic) -> Table {
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
    table
}

/// Returns the harmonics of all probes, the stability, and the curve of periodic states as text.
pub fn text(found: &Periodic) -> String {
    let curve = found.continuation.as_ref().map_or(String::new(), curve_text);
    format!("{}{}\n{curve}", harmonics(found).render(colored_stdout()), description(found))
}

/// Returns the folds and the ends of a curve of periodic states as a table.
fn curve_text(curve: &Curve) -> String {
    let first = [(&*curve.parameter, Align::Right), ("", Align::Left)];
    let values = curve.columns.iter().map(|name| (&**name, Align::Right));
    let columns: Vec<_> =
        first.into_iter().chain([("stability", Align::Left)]).chain(values).collect();
    let mut table = Table::new(&columns);
    let n = curve.points.len();
    for (k, point) in curve.points.iter().enumerate() {
        let place = match point.is_fold {
            true => "fold",
            false if k == 0 => "start",
            false if k + 1 == n => "end",
            false => continue,
        };
        let names =
            [format!("{:.6}", point.parameter), place.to_owned(), stability(point).to_owned()];
        let values = point.amplitudes.iter().map(|a| format!("{a:.4e}"));
        table.row(names.into_iter().chain(values).map(Into::into));
    }
    let end = match &curve.incomplete {
        None => String::new(),
        Some(reason) => format!(" The curve ends inside the range: {reason}."),
    };
    format!(
        "\nAmplitudes of the first harmonics along the curve\n{}{n} points; continuation.csv lists all.{end}\n",
        table.render(colored_stdout())
    )
}

fn stability(point: &CurvePoint) -> &'static str {
    match point.is_stable {
        Some(true) => "stable",
        Some(false) => "unstable",
        None => "boundary",
    }
}

/// Returns the figures of a curve of periodic states: the amplitude as a function of the parameter.
fn curve_section(curve: &Curve, in_space: bool, data: &mut PageData) -> String {
    let x: Vec<f64> = curve.points.iter().map(|point| point.parameter).collect();
    let figures = curve.columns.iter().enumerate().map(|(j, name)| {
        let all: Vec<f64> = curve.points.iter().map(|point| point.amplitudes[j]).collect();
        let those = |keep: &dyn Fn(&CurvePoint) -> bool| {
            let points = curve.points.iter().zip(&all);
            let kept = points.filter(|(point, _)| keep(point));
            kept.map(|(point, y)| (point.parameter, *y)).unzip()
        };
        let (x_unstable, unstable): (Vec<f64>, Vec<f64>) = those(&|p| p.is_stable == Some(false));
        let (x_folds, folds): (Vec<f64>, Vec<f64>) = those(&|p| p.is_fold);
        let column = name.rsplit('.').next().unwrap_or_default();
        let plot = LinePlot {
            x: Axis::new(&*curve.parameter, ""),
            y: Axis::new(label(column), unit(column, in_space)),
            series: vec![
                Series::curve("periodic states", &x, &all),
                Series::curve("unstable", &x_unstable, &unstable).marked().unjoined(),
                Series::curve("folds", &x_folds, &folds).marked().unjoined(),
            ],
            ..LinePlot::default()
        };
        let chart: Vec<usize> = data.chart(&plot, None).into_iter().collect();
        let svg = Figure::column(&**name, vec![Box::new(plot)]).render();
        figure(name, &svg, &chart)
    });
    let figures: String = figures.collect();
    let title = "<h2>Amplitudes of the first harmonics along the curve</h2>\n";
    format!("{title}{figures}")
}

pub(crate) fn section(found: &Periodic, in_space: bool, data: &mut PageData) -> String {
    let curve = found.continuation.as_ref();
    let curve = curve.map_or(String::new(), |curve| curve_section(curve, in_space, data));
    format!(
        "<h2>Periodic state</h2>\n<p>{}</p>\n{}{curve}",
        description(found),
        harmonics(found).html()
    )
}
