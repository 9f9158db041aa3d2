//! The sweep as text, CSV, JSON and picture.

use myovib_model::coupling::Synchrony;
use myovib_oscillators::Settled;
use serde::Serialize;
use serde_json::{Map, Value};

use super::{Outcome, SynchronizationArgs};
use crate::experiments::{ChainSetup, SettledJson, rod_json};
use crate::picture;
use crate::plot::heat_map::Cell as MapCell;
use crate::plot::{Axis, Colour, Figure, HeatMap, LinePlot, Panel, Series};
use crate::report::{Align, Cell, Table, Tone, coloured_stdout};

/// All states, with their colours, the dearest last.
const STATES: [(&str, Colour); 4] = [
    ("none", Colour::PALE),
    ("coherent", Colour::SKY),
    ("follows", Colour::ORANGE),
    ("locked", Colour::GREEN),
];

#[derive(Serialize)]
struct CaseJson<'a> {
    frequency: f64,
    #[serde(flatten)]
    chain: &'a ChainSetup,
    #[serde(flatten)]
    rod: Map<String, Value>,
    #[serde(flatten)]
    run: &'a Value,
    settled: SettledJson,
    follows: bool,
    coherent: bool,
    locked: bool,
}

#[derive(Serialize)]
struct Document<'a> {
    oscillators: usize,
    generator: &'a str,
    seed: u32,
    point: f64,
    t_end: f64,
    criterion: CriterionJson,
    cases: Vec<CaseJson<'a>>,
}

#[derive(Serialize)]
struct CriterionJson {
    slip: f64,
    coherence: f64,
}

/// Writes the files and gives out the table.
pub(super) fn give(args: &SynchronizationArgs, results: &[Outcome]) -> anyhow::Result<()> {
    let document = document(args, results);
    let columns = [
        "frequency",
        "width",
        "coupling",
        "gamma",
        "psi_mean",
        "psi_min",
        "psi_max",
        "chi_mean",
        "chi_min",
        "chi_max",
        "centroid_frequency",
        "follows",
        "coherent",
        "locked",
    ];
    let columns = columns.map(String::from);
    let rows: Vec<Vec<f64>> = results.iter().map(row).collect();
    let figure = figure(args, results);
    let files = picture::write(
        &args.out,
        "synchronization",
        &figure,
        (&columns, &rows),
        args.png,
    )?;
    let mut text = table(results).render(coloured_stdout());
    text += &format!(
        "\nlocked: the centroid slips less than {} turns against the drive in the last {} s, and \
         |χ| ≥ {}\n",
        args.slip,
        results.first().map_or(0.0, |result| result.settled.window),
        args.coherence
    );
    text += &format!("{}\n", files.join(", "));
    args.common.give("synchronization", &text, &document)
}

fn flag(value: bool) -> f64 {
    f64::from(u8::from(value))
}

fn row(result: &Outcome) -> Vec<f64> {
    let (setup, settled, state) = (&result.setup, &result.settled, result.synchrony);
    let (psi, chi) = (settled.centroid, settled.phase);
    vec![
        result.frequency,
        setup.width,
        setup.coupling,
        setup.gamma,
        psi.mean,
        psi.min,
        psi.max,
        chi.mean,
        chi.min,
        chi.max,
        settled.frequency.mean,
        flag(state.follows),
        flag(state.coherent),
        flag(state.is_locked()),
    ]
}

fn table(results: &[Outcome]) -> Table {
    let mut table = Table::new(&[
        ("drive Hz", Align::Right),
        ("width", Align::Right),
        ("D", Align::Right),
        ("γ", Align::Right),
        ("|Ψ|", Align::Right),
        ("range", Align::Left),
        ("|χ|", Align::Right),
        ("range", Align::Left),
        ("Hz", Align::Right),
        ("state", Align::Left),
    ]);
    for result in results {
        let (setup, settled) = (&result.setup, &result.settled);
        let (psi, chi) = (settled.centroid, settled.phase);
        let tone = if result.synchrony.is_locked() {
            Tone::Good
        } else {
            Tone::Plain
        };
        table.row([
            format!("{}", result.frequency).into(),
            format!("{}", setup.width).into(),
            format!("{}", setup.coupling).into(),
            format!("{}", setup.gamma).into(),
            format!("{:.3}", psi.mean).into(),
            format!("[{:.3}, {:.3}]", psi.min, psi.max).into(),
            format!("{:.3}", chi.mean).into(),
            format!("[{:.3}, {:.3}]", chi.min, chi.max).into(),
            format!("{:.3}", settled.frequency.mean).into(),
            Cell::new(result.synchrony.name(), tone),
        ]);
    }
    table
}

fn document<'a>(args: &'a SynchronizationArgs, results: &'a [Outcome]) -> Document<'a> {
    let case = |result: &'a Outcome| CaseJson {
        frequency: result.frequency,
        chain: &result.setup,
        rod: rod_json(args.point, result.frequency),
        run: &result.run,
        settled: result.settled.into(),
        follows: result.synchrony.follows,
        coherent: result.synchrony.coherent,
        locked: result.synchrony.is_locked(),
    };
    Document {
        oscillators: args.oscillators,
        generator: args.generator.0.name(),
        seed: args.seed,
        point: args.point,
        t_end: args.t_end,
        criterion: CriterionJson {
            slip: args.slip,
            coherence: args.coherence,
        },
        cases: results.iter().map(case).collect(),
    }
}

/// Curves over γ; with several frequencies of the drive, also a map of the states.
fn figure(args: &SynchronizationArgs, results: &[Outcome]) -> Figure {
    let mut panels: Vec<Box<dyn Panel>> = Vec::new();
    type Quantity = fn(&Outcome) -> Settled;
    let quantities: [(&str, &str, Quantity); 3] = [
        ("|Ψ|", "", |result| result.settled.centroid),
        ("|χ|", "", |result| result.settled.phase),
        ("centroid", "Hz", |result| result.settled.frequency),
    ];
    let several_drives = args.frequency.len() > 1;
    let several_curves = chunks(results).count() > 1;
    for (i, (name, unit, value)) in quantities.into_iter().enumerate() {
        // The legend once, above the first panel.
        let named = |name: String| if i == 0 { name } else { String::new() };
        let mut series = Vec::new();
        for chunk in chunks(results) {
            let gamma: Vec<f64> = chunk.iter().map(|result| result.setup.gamma).collect();
            let curve = |name: String, part: fn(Settled) -> f64| {
                let values: Vec<f64> = chunk.iter().map(|result| part(value(result))).collect();
                Series::curve(named(name), &gamma, &values)
            };
            if several_curves {
                series.push(curve(curve_name(args, &chunk[0]), |s| s.mean).marked());
            } else {
                let range = |name: &str, part| curve(name.into(), part).coloured(Colour::SKY);
                series.push(range("least and largest in the window", |s| s.min));
                series.push(range("", |s| s.max));
                series.push(
                    curve("mean".into(), |s| s.mean)
                        .coloured(Colour::BLUE)
                        .marked(),
                );
            }
        }
        panels.push(Box::new(LinePlot {
            x: Axis::new("gain *γ*", "").logarithmic(),
            y: Axis::new(name, unit),
            series,
            ..LinePlot::default()
        }));
    }
    // An interrupted sweep leaves gaps, which a grid does not show.
    if several_drives && results.len().is_multiple_of(args.gamma.len()) {
        panels.push(Box::new(map(args, results)));
    }
    Figure {
        panel_height_mm: 34.0,
        ..Figure::column("Settled coherence over the gain of the drive", panels)
    }
}

/// The runs of one curve: they differ in γ alone.
fn chunks(results: &[Outcome]) -> impl Iterator<Item = &[Outcome]> {
    let key = |o: &Outcome| (o.frequency, o.setup.width, o.setup.coupling);
    results.chunk_by(move |a, b| key(a) == key(b))
}

/// What distinguishes a curve from the others.
fn curve_name(args: &SynchronizationArgs, result: &Outcome) -> String {
    let mut parts = Vec::new();
    if args.frequency.len() > 1 {
        parts.push(format!("{} Hz", result.frequency));
    }
    if args.width.len() > 1 {
        parts.push(format!("±{} rad/s", result.setup.width));
    }
    if args.coupling.len() > 1 {
        parts.push(format!("*D* = {}", result.setup.coupling));
    }
    parts.join(", ")
}

/// States over γ, one row for each drive (and width and D, where these vary).
fn map(args: &SynchronizationArgs, results: &[Outcome]) -> HeatMap {
    let category = |state: Synchrony| STATES.iter().position(|(name, _)| *name == state.name());
    HeatMap {
        column_label: "gain *γ* (in the cells: mean |χ|)".into(),
        columns: args.gamma.iter().map(f64::to_string).collect(),
        row_label: "drive".into(),
        rows: chunks(results)
            .map(|chunk| curve_name(args, &chunk[0]))
            .collect(),
        cells: results
            .iter()
            .map(|result| MapCell {
                category: category(result.synchrony),
                text: format!("{:.2}", result.settled.phase.mean),
            })
            .collect(),
        categories: STATES.map(|(name, c)| (name.to_owned(), c)).into(),
        ..HeatMap::default()
    }
}
