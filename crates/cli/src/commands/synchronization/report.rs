//! Results of the sweep as text, CSV, JSON and a picture.

use anyhow::Context;
use myovib_model::coupling::{Settling, Synchrony};
use myovib_oscillators::Settled;
use serde_json::{Value, json};

use super::{Outcome, SynchronizationArgs, Verdict};
use crate::chains::chain_document;
use myovib_report::picture;
use myovib_report::plot::heat_map::Cell as MapCell;
use myovib_report::plot::{Axis, Color, Figure, HeatMap, LinePlot, Panel, Series};
use myovib_report::table::{Align, Cell, Table, Tone, colored_stdout};
use myovib_scene::json::extend;
use myovib_scene::result_folder::ResultFolder;
use myovib_scene::scene_file::chain::Chain;

/// All states and their colors. The desired state is the last one.
const STATES: [(&str, Color); 4] = [
    ("none", Color::PALE),
    ("coherent", Color::SKY),
    ("follows", Color::ORANGE),
    ("locked", Color::GREEN),
];

/// Base name of the files.
pub(super) const NAME: &str = "synchronization";

/// Writes the files and prints the table.
pub(super) fn write_and_print(
    args: &SynchronizationArgs,
    results: &[Outcome],
    folder: &ResultFolder,
) -> anyhow::Result<()> {
    let document = document(args, results)?;
    let columns = [
        "frequency",
        "frequency_spread",
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
    let files = picture::write(folder, NAME, &figure, (&columns, &rows), args.png)?;
    let mut text = table(results).render(colored_stdout());
    text.push('\n');
    if let Some(Verdict { settled, .. }) = results.iter().find_map(|result| result.verdict) {
        text += &format!(
            "locked: the centroid slips less than {} turns relative to the drive in the last {} s, and \
             |χ| ≥ {}\n",
            args.slip, settled.window, args.coherence
        );
    }
    text += &format!("{}\n", files.join(", "));
    args.common.print_or_write(NAME, &text, &document)
}

fn flag(value: bool) -> f64 {
    f64::from(u8::from(value))
}

/// Returns the values that define a case, followed by its settled values, which are NaN for a run that stopped.
fn row(result: &Outcome) -> Vec<f64> {
    let case = result.case();
    let settled = result.verdict.map_or([f64::NAN; 10], values);
    case.into_iter().chain(settled).collect()
}

fn values(Verdict { settled, synchrony: state }: Verdict) -> [f64; 10] {
    let (psi, chi) = (settled.centroid, settled.phase);
    [
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
        ("± Hz", Align::Right),
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
        let case = result.case();
        let case = case.map(|value| Cell::from(value.to_string()));
        let state = match result.verdict {
            None => [(); 5]
                .map(|()| Cell::from("–"))
                .into_iter()
                .chain([Cell::new("stopped", Tone::Bad)])
                .collect::<Vec<_>>(),
            Some(Verdict { settled, synchrony }) => {
                let (psi, chi) = (settled.centroid, settled.phase);
                let tone = match synchrony.is_locked() {
                    true => Tone::Good,
                    false => Tone::Plain,
                };
                vec![
                    format!("{:.3}", psi.mean).into(),
                    format!("[{:.3}, {:.3}]", psi.min, psi.max).into(),
                    format!("{:.3}", chi.mean).into(),
                    format!("[{:.3}, {:.3}]", chi.min, chi.max).into(),
                    format!("{:.3}", settled.frequency.mean).into(),
                    Cell::new(synchrony.name(), tone),
                ]
            }
        };
        table.row(case.into_iter().chain(state));
    }
    table
}

/// Returns the JSON document of the cases. Settled values and states are null for a run that stopped.
fn document(args: &SynchronizationArgs, results: &[Outcome]) -> anyhow::Result<Value> {
    let case = |result: &Outcome| {
        let state = result.verdict.map(|verdict| verdict.synchrony);
        let mut case = chain_document(&result.run);
        extend(
            &mut case,
            json!({
                "frequency": result.frequency,
                "settled": result.verdict.map(|verdict| verdict.settled),
                "follows": state.map(|state| state.follows),
                "coherent": state.map(|state| state.coherent),
                "locked": state.map(|state| state.is_locked()),
            }),
        );
        case
    };
    // All cases share these settings.
    let scene = &results.first().context("there are no cases")?.run.scene;
    let chain = &scene.file().chain[0];
    Ok(json!({
        "oscillators": chain.oscillators,
        "generator": chain.generator,
        "seed": chain.seed,
        "point": chain.at,
        "t_end": scene.t_end,
        "criterion": { "slip": args.slip, "coherence": args.coherence },
        "cases": results.iter().map(case).collect::<Vec<_>>(),
    }))
}

impl Outcome {
    fn chain(&self) -> &Chain {
        &self.run.scene.file().chain[0]
    }

    /// Returns the drive frequency, the frequency spread, D and γ.
    fn case(&self) -> [f64; 4] {
        let chain = self.chain();
        [self.frequency, chain.frequency_spread, chain.coupling, chain.gain]
    }
}

/// Plots the settled values against γ and, if there are several drive frequencies, adds a map of the states.
fn figure(args: &SynchronizationArgs, results: &[Outcome]) -> Figure {
    let mut panels: Vec<Box<dyn Panel>> = Vec::new();
    type Quantity = fn(&Settling) -> Settled;
    let quantities: [(&str, &str, Quantity); 3] = [
        ("|Ψ|", "", |settled| settled.centroid),
        ("|χ|", "", |settled| settled.phase),
        ("centroid", "Hz", |settled| settled.frequency),
    ];
    let several_drives = args.frequency.len() > 1;
    let several_curves = chunks(results).count() > 1;
    for (i, (name, unit, value)) in quantities.into_iter().enumerate() {
        // Only the first panel has a legend.
        let named = |name: String| if i == 0 { name } else { String::new() };
        let mut series = Vec::new();
        for chunk in chunks(results) {
            // A stopped run has no point on its curve.
            let settled = |result: &Outcome| {
                let verdict = result.verdict?;
                Some((result.chain().gain, value(&verdict.settled)))
            };
            let (gamma, settled): (Vec<f64>, Vec<Settled>) =
                chunk.iter().filter_map(settled).unzip();
            let curve = |name: String, part: fn(Settled) -> f64| {
                let values: Vec<f64> = settled.iter().copied().map(part).collect();
                Series::curve(named(name), &gamma, &values)
            };
            if several_curves {
                series.push(curve(curve_name(args, &chunk[0]), |s| s.mean).marked());
            } else {
                let range = |name: &str, part| curve(name.into(), part).colored(Color::SKY);
                series.push(range("minimum and maximum in the window", |s| s.min));
                series.push(range("", |s| s.max));
                series.push(curve("mean".into(), |s| s.mean).colored(Color::BLUE).marked());
            }
        }
        panels.push(Box::new(LinePlot {
            x: Axis::new("gain *γ*", "").logarithmic(),
            y: Axis::new(name, unit),
            series,
            ..LinePlot::default()
        }));
    }
    if several_drives {
        panels.push(Box::new(map(args, results)));
    }
    Figure {
        panel_height_mm: 34.0,
        ..Figure::column("Settled coherence over the gain of the drive", panels)
    }
}

/// Splits the results into curves. The runs of one curve differ only in γ.
fn chunks(results: &[Outcome]) -> impl Iterator<Item = &[Outcome]> {
    let key = |o: &Outcome| (o.frequency, o.chain().frequency_spread, o.chain().coupling);
    results.chunk_by(move |a, b| key(a) == key(b))
}

/// Returns the label of a curve, which contains the values that differ between curves.
fn curve_name(args: &SynchronizationArgs, result: &Outcome) -> String {
    let mut parts = Vec::new();
    if args.frequency.len() > 1 {
        parts.push(format!("{} Hz", result.frequency));
    }
    if args.frequency_spread.len() > 1 {
        parts.push(format!("±{} Hz", result.chain().frequency_spread));
    }
    if args.coupling.len() > 1 {
        parts.push(format!("*D* = {}", result.chain().coupling));
    }
    parts.join(", ")
}

/// Draws a map of the states: γ varies along a row, and there is one row for each drive frequency and, if they vary,
/// each spread and D.
fn map(args: &SynchronizationArgs, results: &[Outcome]) -> HeatMap {
    let category = |state: Synchrony| STATES.iter().position(|(name, _)| *name == state.name());
    HeatMap {
        column_label: "gain *γ* (in the cells: mean |χ|)".into(),
        columns: args.gamma.iter().map(f64::to_string).collect(),
        row_label: "drive".into(),
        rows: chunks(results).map(|chunk| curve_name(args, &chunk[0])).collect(),
        cells: results
            .iter()
            .map(|result| MapCell {
                category: result.verdict.and_then(|verdict| category(verdict.synchrony)),
                text: result.verdict.map_or("stopped".into(), |verdict| {
                    format!("{:.2}", verdict.settled.phase.mean)
                }),
            })
            .collect(),
        categories: STATES.map(|(name, c)| (name.to_owned(), c)).into(),
        ..HeatMap::default()
    }
}
