//! Harmonic response: a table of peaks, plots of amplitude and phase against frequency (Bode plot), and curves in the
//! complex plane (Nyquist plot).

use myovib_scene::response::{Curves, Peak, Response, phase};

use crate::page::data::PageData;
use crate::page::frame::figure;
use crate::page::probes::{label, unit};
use crate::plot::{Axis, Figure, LinePlot, Panel, Series};
use crate::table::{Align, Table, colored_stdout};

/// Maximum number of values plotted for a probe; the CSV file contains all values.
const MOST_COLUMNS: usize = 6;

/// Maximum number of values printed for a probe, such as a line with many points.
const MOST_PRINTED: usize = 30;

/// Returns the probes to be printed, and a sentence on the others.
fn printed(found: &Response) -> (Vec<&str>, String) {
    let (short, long): (Vec<&Curves>, Vec<&Curves>) =
        found.probes.iter().partition(|probe| probe.columns.len() <= MOST_PRINTED);
    let omitted = long.iter().map(|probe| {
        let (name, n) = (&probe.name, probe.columns.len());
        format!("{name}.csv contains the {n} values of the probe `{name}`.\n")
    });
    (short.iter().map(|probe| probe.name.as_str()).collect(), omitted.collect())
}

fn peaks<'a>(peaks: impl Iterator<Item = &'a Peak>, damping_ratio_heading: &str) -> Table {
    let mut table = Table::new(&[
        ("probe", Align::Left),
        ("value", Align::Left),
        ("peak, Hz", Align::Right),
        ("amplitude", Align::Right),
        (damping_ratio_heading, Align::Right),
        ("mode, Hz", Align::Right),
    ]);
    for peak in peaks {
        table.row([
            peak.probe.as_str().into(),
            peak.column.as_str().into(),
            format!("{:.4}", peak.frequency).into(),
            format!("{:.4e}", peak.amplitude).into(),
            damping_ratio(peak).into(),
            mode(peak).into(),
        ]);
    }
    table
}

/// Returns the peaks of all values as text. If there is only one frequency, returns all values at this frequency.
pub fn text(found: &Response) -> String {
    if let [frequency] = found.frequencies[..] {
        return at_one_frequency(found, frequency);
    }
    let (names, omitted) = printed(found);
    let of_printed = |peak: &&Peak| names.contains(&peak.probe.as_str());
    let peaks = match found.peaks.is_empty() {
        true => "No value has a peak between these frequencies; the tables contain all values.\n"
            .to_owned(),
        false => {
            peaks(found.peaks.iter().filter(of_printed), "damping ratio").render(colored_stdout())
        }
    };
    let n = found.frequencies.len();
    let [first, last] = [found.frequencies.first(), found.frequencies.last()]
        .map(|frequency| frequency.copied().unwrap_or_default());
    let interrupted = match found.is_interrupted {
        true => "Interrupted: the response ends early, and its peaks are provisional.\n",
        false => "",
    };
    format!(
        "{peaks}{omitted}{}Harmonic response {}, {n} frequencies from {first} to {last} Hz.\n{interrupted}",
        unresolved(found),
        about(found)
    )
}

/// Explains why some peaks have no damping ratio.
fn unresolved(found: &Response) -> &'static str {
    let is_given = found.interpolation_error.is_none();
    match (found.peaks.iter().any(|peak| peak.damping_ratio.is_none()), is_given) {
        (false, _) => "",
        (true, true) => {
            "–: the maximum is not a resonance, or the frequencies do not resolve its half-power width, and the peak may \
            be higher than shown (`adaptive` resolves it).\n"
        }
        (true, false) => {
            "–: the amplitude does not fall to half power on both sides, or the maximum is not a resonance.\n"
        }
    }
}

/// Returns a table of all values at the only frequency.
fn at_one_frequency(found: &Response, frequency: f64) -> String {
    let mut table = Table::new(&[
        ("probe", Align::Left),
        ("value", Align::Left),
        ("amplitude", Align::Right),
        ("phase, °", Align::Right),
    ]);
    let (names, omitted) = printed(found);
    for probe in found.probes.iter().filter(|probe| names.contains(&probe.name.as_str())) {
        let values = probe.columns.iter().zip(probe.amplitudes.iter().flatten());
        for (column, value) in values {
            table.row([
                probe.name.as_str().into(),
                column.as_str().into(),
                format!("{:.4e}", value.norm()).into(),
                format!("{:.2}", phase(*value)).into(),
            ]);
        }
    }
    format!(
        "{}{omitted}Harmonic response {}, at {frequency} Hz.\n",
        table.render(colored_stdout()),
        about(found)
    )
}

/// Describes the state about which the body vibrates.
fn about(found: &Response) -> String {
    match found.preload_time {
        None => "about rest".to_owned(),
        Some(t) => format!("about the equilibrium under the loads at t = {t} s"),
    }
}

/// Returns the damping ratio of a peak, or a dash if it is unknown.
fn damping_ratio(peak: &Peak) -> String {
    let ratio = peak.damping_ratio;
    ratio.map_or("–".to_owned(), |ratio| format!("{ratio:.4}"))
}

/// Returns the frequency and the number of the mode that belongs to a peak, or a dash.
fn mode(peak: &Peak) -> String {
    let mode = peak.mode;
    mode.map_or("–".to_owned(), |mode| format!("{:.4} (mode {})", mode.frequency, mode.number))
}

pub(crate) fn section(found: &Response, in_space: bool, data: &mut PageData) -> String {
    let (frequencies, drawn) = match &found.drawn {
        Some((frequencies, drawn)) => (frequencies, drawn),
        None => (&found.frequencies, &found.probes),
    };
    let figures = drawn.iter().map(|curves| {
        let plots = plots(frequencies, curves, in_space);
        let link = |plot: &LinePlot| (plot.x.unit == "Hz").then_some("f");
        let charts = plots.iter().filter_map(|plot| data.chart(plot, link(plot)));
        let charts: Vec<usize> = charts.collect();
        let panels = plots.into_iter().map(|plot| Box::new(plot) as Box<dyn Panel>);
        let svg = Figure::column(&*curves.name, panels.collect()).render();
        figure(&curves.name, &svg, &charts)
    });
    let peaks = match found.peaks.is_empty() {
        true => String::new(),
        false => peaks(found.peaks.iter(), "damping ratio (half power)").html(),
    };
    format!(
        "<h2>Harmonic response</h2>\n{peaks}<div class=\"beside\">\n{}</div>\n",
        figures.collect::<String>()
    )
}

/// Plots the values of a probe: amplitude and phase against frequency, and the curve in the complex plane.
fn plots(frequencies: &[f64], curves: &Curves, in_space: bool) -> Vec<LinePlot> {
    let columns = curves.columns.iter().enumerate().take(MOST_COLUMNS);
    let plots = columns.flat_map(|(k, name)| {
        let values = curves.amplitudes.iter().map(|row| row[k]);
        let amplitudes: Vec<f64> = values.clone().map(|z| z.norm()).collect();
        let phases: Vec<f64> = values.clone().map(phase).collect();
        let re: Vec<f64> = values.clone().map(|z| z.re).collect();
        let im: Vec<f64> = values.map(|z| z.im).collect();
        let panel = |y: Axis, values: &[f64]| LinePlot {
            x: Axis::new("*f*", "Hz"),
            y,
            series: vec![Series::curve("", frequencies, values)],
            ..LinePlot::default()
        };
        // A ratio has no known unit.
        let is_ratio = *name == curves.name;
        let unit = if is_ratio { "" } else { unit(name, in_space) };
        let axis = |text: String| Axis::new(text, unit);
        let size = axis(format!("|{}|", label(name)));
        let nyquist = LinePlot {
            x: axis(format!("Re {}", label(name))),
            y: axis(format!("Im {}", label(name))),
            series: vec![Series::curve("", &re, &im)],
            ..LinePlot::default()
        };
        [panel(size, &amplitudes), panel(Axis::new("phase", "°"), &phases), nyquist]
    });
    plots.collect()
}
