//! Reports of fits: text, `report.html`, and files with data.

use std::path::Path;

use myovib_scene::fit::{FitResult, LEVEL, Outcome, Point};
use myovib_scene::sensitivity::Abscissa;
use myovib_scene::{atomic_file, csv, escape, json};
use serde_json::Value;

use crate::page;
use crate::page::data::PageData;
use crate::page::frame::{self, framed};
use crate::page::probes::axis_of;
use crate::plot::{Axis, Figure, LinePlot, Panel, Series};
use crate::table::{Align, Table, counted};

/// Writes `residuals.csv`, `residuals.svg`, `fit.json` and `report.html`. Returns the body of `fit.json`.
pub fn write(out: &Path, result: &FitResult) -> anyhow::Result<Value> {
    let plots = plots(result);
    let figure = figure(plots.clone()).render();
    atomic_file::save(&out.join("residuals.svg"), &figure)?;
    atomic_file::save(&out.join("residuals.csv"), residuals(result))?;
    let document = result.document();
    atomic_file::save(&out.join("fit.json"), json::document("fit", &document)?)?;
    atomic_file::save(&out.join(page::NAME), html(result, &plots, &figure))?;
    Ok(document)
}

/// Returns the content of `residuals.csv`, with one row per measurement.
fn residuals(result: &FitResult) -> String {
    let abscissas = result.abscissas();
    let row = |point: &Point| {
        let number = |number: f64| format!("{number:.16e}");
        let at = abscissas.iter().map(|abscissa| match *abscissa == point.abscissa {
            true => number(point.t),
            false => String::new(),
        });
        let names = [point.experiment.to_string(), point.output.clone()];
        let numbers = [point.measured, point.fitted, point.residual].map(number);
        let cells = names.into_iter().chain(at).chain(numbers);
        csv::line(&cells.collect::<Vec<_>>())
    };
    let names = abscissas.iter().map(|abscissa| abscissa.name());
    let names = ["experiment", "output"].into_iter().chain(names);
    let names = names.chain(["measured", "fitted", "residual"]);
    let header = csv::line(&names.collect::<Vec<_>>());
    std::iter::once(header).chain(result.points.iter().map(row)).collect()
}

/// Describes the result as text, with terminal colors if `colored` is true.
pub fn describe(result: &FitResult, colored: bool) -> String {
    let mut text = format!("{}\n{}", ending(result), parameters(result).render(colored));
    for line in findings(result) {
        text += &line;
        text.push('\n');
    }
    text
}

fn ending(result: &FitResult) -> String {
    format!(
        "{} after {}: {}, {} with sensitivities",
        result.ending(),
        counted(result.fit.history.len(), "iteration"),
        counted(result.runs[0], "run"),
        result.runs[1],
    )
}

/// Returns the table of parameters with their uncertainties.
fn parameters(result: &FitResult) -> Table {
    let percent = 100.0 * LEVEL;
    let interval = format!("{percent} % interval");
    let mut columns = vec![
        ("parameter", Align::Left),
        ("value", Align::Right),
        ("standard error", Align::Right),
        (interval.as_str(), Align::Right),
    ];
    let by_profile = !result.profiles.is_empty();
    if by_profile {
        columns.push(("by profile", Align::Right));
    }
    let mut table = Table::new(&columns);
    let intervals = result.uncertainty.intervals(LEVEL);
    for (j, name) in result.fit.names.iter().enumerate() {
        let held = if result.fit.at_bound[j] { " (at its bound)" } else { "" };
        let mark = if result.passes_bound(j) { " *" } else { "" };
        let error = result.uncertainty.standard_errors[j];
        let mut cells = vec![
            format!("{name}{held}"),
            format!("{:.6e}", result.fit.values[j]),
            known(error, format!("{error:.2e}")),
            between(intervals[j].map(Some)) + mark,
        ];
        if by_profile {
            cells.push(match &result.profiles[j] {
                Ok(profile) => between(profile.interval),
                Err(_) => "not computed".to_owned(),
            });
        }
        table.row(cells.into_iter().map(Into::into));
    }
    table
}

/// Formats a number with at least three digits.
fn significant(value: f64) -> String {
    match value.abs() {
        0.0 | 0.1..1e4 => format!("{value:.3}"),
        _ => format!("{value:.2e}"),
    }
}

/// Describes the quality of the fit and the parameters that the measurements do not determine.
fn findings(result: &FitResult) -> Vec<String> {
    let of = match result.noise_is_known {
        true => " times the given noise; about 1 if the model fits",
        false => "",
    };
    let mut lines =
        vec![format!("residuals: standard deviation {}{of}", significant(result.deviation()))];
    if result.does_not_fit() {
        let remedy = "the model does not fit the measurements, so the intervals are invalid: check units, outliers \
                      and effects missing from the scene, and try other starting points";
        lines.push(remedy.to_owned());
        if let Some((row, point)) = result.largest_residual() {
            lines.push(format!(
                "largest residual: {} times the noise, {} at {} = {:e}{} of experiment {} (row {} of residuals.csv)",
                significant(point.residual.abs()),
                point.output,
                point.abscissa.name(),
                point.t,
                match &*axis(point.abscissa).unit {
                    "" => String::new(),
                    unit => format!(" {unit}"),
                },
                point.experiment,
                row + 1
            ));
        }
        if result.needs_robust_loss() {
            lines.push(format!(
                "the median residual is {} times the noise: `--loss huber` reduces the weight of outliers",
                significant(result.median_residual())
            ));
        }
    }
    for (j, name) in result.fit.names.iter().enumerate() {
        lines.extend(result.shear_viscosity(j).map(|usual| {
            format!(
                "{name}: η of the stress η Ė; the usual shear viscosity η/2 is {usual:.6e} Pa·s"
            )
        }));
    }
    lines.extend(idle(result));
    lines.extend(passing(result));
    for (name, profile) in result.fit.names.iter().zip(&result.profiles) {
        if let Err(why) = profile {
            lines.push(format!("profile of {name} not computed: {why}"));
        }
    }
    let unknown = result.unknown();
    lines.extend(unknown.iter().map(|direction| {
        format!(
            "not determined by the measurements (a relative change of 1 is within the noise): {}",
            result.in_words(direction)
        )
    }));
    if !unknown.is_empty() {
        let remedy = "fix one of these parameters, or add measurements that distinguish them: other loads, larger \
                      strains, other positions";
        lines.push(remedy.to_owned());
    }
    lines
}

/// Names the parameters that have no effect on any measurement.
fn idle(result: &FitResult) -> Option<String> {
    let names = named(result, |j| !result.fit.acts(j))?;
    Some(format!(
        "no measurement depends on {names}: remove each such [[parameter]], or add measurements where and when it has \
         an effect"
    ))
}

/// Returns a note that explains the mark shown at intervals that exceed a bound, if there are such intervals.
fn passing(result: &FitResult) -> Option<String> {
    let names = named(result, |j| result.passes_bound(j))?;
    let remedy = match result.profiles.is_empty() {
        true => "use --profile for profile-likelihood intervals",
        false => "use the profile-likelihood interval",
    };
    Some(format!("* the linear interval exceeds a bound of {names}: {remedy}"))
}

/// Joins the names of the selected parameters. Returns `None` if no parameter is selected.
fn named(result: &FitResult, is_selected: impl Fn(usize) -> bool) -> Option<String> {
    let names = result.fit.names.iter().enumerate();
    let names = names.filter(|(j, _)| is_selected(*j));
    let names: Vec<&str> = names.map(|(_, name)| name.as_str()).collect();
    (!names.is_empty()).then(|| names.join(", "))
}

/// Returns the correlation matrix as a table.
fn correlations(result: &FitResult) -> Table {
    let names = || result.fit.names.iter();
    let columns = names().map(|name| (name.as_str(), Align::Right));
    let columns: Vec<_> = std::iter::once(("", Align::Left)).chain(columns).collect();
    let mut table = Table::new(&columns);
    for (i, name) in names().enumerate() {
        let row = result.uncertainty.correlation.row(i);
        let cells = row.iter().map(|&c| known(c, format!("{c:.2}")));
        let cells = std::iter::once(name.clone()).chain(cells);
        table.row(cells.map(Into::into));
    }
    table
}

/// Plots the cost as a function of the iteration.
fn iterations(result: &FitResult) -> LinePlot {
    let costs: Vec<f64> = result.fit.history.iter().map(|it| it.cost).collect();
    let numbers: Vec<f64> = (0..costs.len()).map(|k| k as f64).collect();
    LinePlot {
        x: Axis::new("iteration", ""),
        y: Axis::new("cost", "").logarithmic(),
        series: vec![Series::curve("", &numbers, &costs).marked()],
        ..LinePlot::default()
    }
}

/// Plots one line per parameter: its confidence interval relative to its value. Intervals from profiles are used if
/// they were computed. Intervals with an open end and parameters with the value zero are excluded.
fn intervals(result: &FitResult) -> LinePlot {
    let by_profile = |j: usize| result.profiles.get(j)?.as_ref().ok().map(|p| p.interval);
    let linear = result.uncertainty.intervals(LEVEL);
    let names = result.fit.names.iter().enumerate();
    let series = names.filter_map(|(j, name)| {
        let value = result.fit.values[j];
        let [low, high] = by_profile(j).unwrap_or_else(|| linear[j].map(Some));
        let x = [low?, value, high?].map(|end| 100.0 * (end - value) / value.abs());
        let is_shown = x.iter().all(|x| x.is_finite());
        is_shown.then(|| Series::curve(name, &x, &[(j + 1) as f64; 3]).marked())
    });
    LinePlot {
        x: Axis::new("deviation from the value", "%"),
        y: Axis::new("number of the parameter", ""),
        series: series.collect(),
        ..LinePlot::default()
    }
}

/// Returns the content of `report.html`.
fn html(result: &FitResult, plots: &[LinePlot], svg: &str) -> String {
    let title = match result.title.as_str() {
        "" => "A fit",
        title => title,
    };
    let findings = findings(result);
    let findings = findings.iter().map(|line| format!("<p>{}</p>\n", escape(line)));
    let n = result.points.len();
    let summary = format!("{} parameters from {n} measurements.", result.fit.names.len());
    let mut data = PageData::default();
    let numbers: Vec<usize> =
        plots.iter().filter_map(|plot| data.chart(plot, Some(&plot.x.quantity))).collect();
    let mut drawn = |title: &str, plot: LinePlot| {
        let number = data.chart(&plot, None);
        frame::figure("", &Figure::of(title, plot).render(), &number)
    };
    let intervals = match intervals(result) {
        plot if plot.series.is_empty() => String::new(),
        plot => drawn("Intervals", plot),
    };
    let iterations = drawn("Iterations", iterations(result));
    let body = format!(
        "<p{}>{}</p>\n<div class=\"wide\">{}</div>\n{}{intervals}<h2>Measurements, fit and residuals</h2>\n\
         {}<h2>Correlation of the parameters</h2>\n<div class=\"wide\">{}</div>\n\
         <p>Two parameters with a correlation near 1 or -1 have nearly the same effect on the measurements.</p>\n\
         <h2>Iterations</h2>\n<p>The cost is half the sum of the squared residuals, or of the losses. The first \
         iterations may use the first part of the measurements and less accurate runs: see the part column of \
         <code>history.csv</code>.</p>\n{iterations}",
        match result.outcome() {
            Outcome::Converged => "",
            _ => " class=\"bad\"",
        },
        escape(&ending(result)),
        parameters(result).html(),
        findings.collect::<String>(),
        frame::figure("", svg, &numbers),
        correlations(result).html(),
    );
    framed(title, &summary, &body, &data)
}

/// Formats an interval. An open end is shown as a dash.
fn between(interval: [Option<f64>; 2]) -> String {
    let [low, high] = interval.map(|end| {
        let end = end.unwrap_or(f64::NAN);
        known(end, format!("{end:.4e}"))
    });
    format!("{low} … {high}")
}

/// Returns `shown`, or a dash if `number` is not finite.
fn known(number: f64, shown: String) -> String {
    match number.is_finite() {
        true => shown,
        false => "–".to_owned(),
    }
}

/// Arranges plots in one column.
fn figure(plots: Vec<LinePlot>) -> Figure {
    let panels = plots.into_iter().map(|plot| Box::new(plot) as Box<dyn Panel>);
    Figure::column("Measurements and fit", panels.collect())
}

/// Returns the axis of an independent variable.
pub fn axis(abscissa: Abscissa) -> Axis {
    match abscissa {
        Abscissa::Time => Axis::new("*t*", "s"),
        Abscissa::Frequency => Axis::new("*f*", "Hz"),
        Abscissa::Load => Axis::new("load factor", ""),
    }
}

/// Plots the measurements with the fit, followed by the residuals.
fn plots(result: &FitResult) -> Vec<LinePlot> {
    let is_same = |a: &Point, b: &Point| a.experiment == b.experiment && a.output == b.output;
    let mut firsts: Vec<&Point> = Vec::new();
    for point in &result.points {
        if !firsts.iter().any(|first| is_same(first, point)) {
            firsts.push(point);
        }
    }
    let several = firsts.iter().any(|first| first.experiment > 1);
    let panels = firsts.iter().map(|first| {
        let of = || result.points.iter().filter(|p| is_same(p, first));
        let t: Vec<f64> = of().map(|p| p.t).collect();
        let measured: Vec<f64> = of().map(|p| p.measured).collect();
        let fitted: Vec<f64> = of().map(|p| p.fitted).collect();
        LinePlot {
            title: match several {
                true => format!("{}, experiment {}", first.output, first.experiment),
                false => first.output.clone(),
            },
            x: axis(first.abscissa),
            y: axis_of(&first.column, first.abscissa == Abscissa::Frequency, result.in_space),
            series: vec![
                Series::curve("measured", &t, &measured).unjoined(),
                Series::curve("fitted", &t, &fitted),
            ],
        }
    });
    let mut panels: Vec<LinePlot> = panels.collect();
    panels.extend(result.abscissas().into_iter().map(|abscissa| {
        let of = || result.points.iter().filter(|p| p.abscissa == abscissa);
        let t: Vec<f64> = of().map(|p| p.t).collect();
        let residuals: Vec<f64> = of().map(|p| p.residual).collect();
        LinePlot {
            title: "residuals".to_owned(),
            x: axis(abscissa),
            y: Axis::new("residual", if result.noise_is_known { "σ" } else { "" }),
            series: vec![Series::curve("", &t, &residuals).unjoined()],
        }
    }));
    panels
}
