//! `report.html`: the run at a glance, in one file that needs no network.

use std::fs;
use std::path::Path;

use myovib_fem::Group;
use serde_json::Value;

use crate::outline::outline;
use crate::plot::text::escape;
use crate::plot::{Axis, Colour, EdgeGroup, Figure, LinePlot, MeshPlot, Panel, Series};
use myovib_scene::Error;
use myovib_scene::atomic_file;
use myovib_scene::csv::Table;
use myovib_scene::scene_file::output::Probe;
use myovib_scene::versions::Versions;
use myovib_scene::{Body, Scene};

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;\
padding:0 1rem;color:#222}h1{font-size:1.6rem}h2{font-size:1.2rem;margin-top:2rem}\
table{border-collapse:collapse}td{padding:.15rem 1.2rem .15rem 0;vertical-align:top}\
svg{width:100%;max-width:42rem;height:auto}pre{background:#f5f5f5;padding:1rem;overflow:auto;\
font-size:13px}.bad{color:#b00020;font-weight:600}";

/// Writes the report of a run into its folder.
///
/// # Errors
/// When a table of the folder cannot be read, or the report not be written.
pub fn write(folder: &Path, scene: &Scene, document: &Value) -> Result<(), Error> {
    let title = if scene.file.title.is_empty() {
        "A run"
    } else {
        &scene.file.title
    };
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\">\
         <title>{0}</title><style>{STYLE}</style>\n<h1>{0}</h1>\n",
        escape(title)
    );
    html += &outcome(document);
    if let Some(body) = &scene.body {
        html += "<h2>Mesh and boundary conditions</h2>\n";
        html += &mesh_figure(scene, body);
    }
    for probe in &scene.file.probe {
        let figure = probe_figure(folder, probe)?;
        html += &format!("<h2>Probe {}</h2>\n{figure}", escape(&probe.name));
    }
    html += "<h2>What the run means</h2>\n";
    html += &meaning(document);
    html += "<h2>Statistics</h2>\n";
    html += &statistics(document);
    html += &format!("<h2>The scene</h2>\n<pre>{}</pre>\n", escape(scene.text()));
    let Versions {
        myovib,
        git,
        sundials,
        klu,
    } = Versions::found();
    html += &format!("<p>myovib {myovib} ({git}), SUNDIALS {sundials}, KLU {klu}.</p></html>\n");
    atomic_file::save(&folder.join("report.html"), html)
}

fn outcome(document: &Value) -> String {
    let plain = |key: &str| document[key].as_str().unwrap_or_default();
    match plain("outcome") {
        "finished" => "<p>The run reached its end.</p>\n".to_owned(),
        _ => format!(
            "<p class=\"bad\">Stopped: {}</p>\n",
            escape(plain("message"))
        ),
    }
}

fn mesh_figure(scene: &Scene, body: &Body) -> String {
    let space = body.muscle.solid.space();
    let held = scene.file.fixed.iter().map(|fixed| (&fixed.group, None));
    let moved = scene
        .file
        .displacement
        .iter()
        .map(|moving| (&moving.group, None));
    let loaded = scene.file.traction.iter().map(|traction| {
        let direction =
            [traction.x.is_some(), traction.y.is_some()].map(|g| f64::from(u8::from(g)));
        (&traction.group, Some(direction))
    });
    let pressed = scene.file.pressure.iter().map(|load| (&load.group, None));
    let named = held.chain(moved).chain(loaded).chain(pressed).enumerate();
    let groups = named.filter_map(|(i, (name, arrows))| {
        let Ok(Group::Edges(edges)) = space.mesh().group(name) else {
            return None;
        };
        let nodes = edges.iter().map(|edge| space.facet_nodes(edge));
        let edges = nodes.filter_map(|nodes| nodes.try_into().ok()).collect();
        Some(EdgeGroup {
            name: name.clone(),
            edges,
            colour: Colour::of_series(i),
            arrows,
        })
    });
    let plot = MeshPlot {
        groups: groups.collect(),
        ..outline(space)
    };
    Figure::of("Mesh and boundary conditions", plot).render()
}

/// The columns of a probe over time, one panel for each.
fn probe_figure(folder: &Path, probe: &Probe) -> Result<String, Error> {
    let path = folder.join(format!("{}.csv", probe.name));
    let text = fs::read_to_string(&path).map_err(Error::file("read", &path))?;
    let table = Table::parse(&text).unwrap_or_default();
    let names: Vec<&str> = table.names.iter().map(String::as_str).collect();
    let rows = table.rows.iter().filter_map(|row| table.numbers(row));
    let rows: Vec<Vec<f64>> = rows.collect();
    if rows.len() < 2 {
        return Ok(values(&names, rows.first()));
    }
    let column = |j: usize| rows.iter().map(|row| row[j]).collect::<Vec<f64>>();
    let t = column(0);
    // More panels than fit a screen are left to the CSV file.
    let shown = names.iter().enumerate().skip(1).take(6);
    let panels = shown.map(|(j, name)| {
        Box::new(LinePlot {
            x: Axis::new("*t*", "s"),
            y: Axis::new(name.replace('_', " "), unit(name)),
            series: vec![Series::curve("", &t, &column(j))],
            ..LinePlot::default()
        }) as Box<dyn Panel>
    });
    Ok(Figure::column(&*probe.name, panels.collect()).render())
}

fn values(names: &[&str], row: Option<&Vec<f64>>) -> String {
    let cells = names.iter().zip(row.into_iter().flatten());
    let rows: String = cells
        .map(|(name, value)| {
            format!(
                "<tr><td>{}</td><td>{value:.6e} {}</td></tr>",
                escape(name),
                unit(name)
            )
        })
        .collect();
    format!("<table>{rows}</table>\n")
}

fn unit(name: &str) -> &'static str {
    match name.split('_').next().unwrap_or_default() {
        "t" => "s",
        "u" => "m",
        "v" => "m/s",
        "p" | "stress" | "von" => "Pa",
        "R" => "N/m",
        "kinetic" | "elastic" | "work" | "dissipated" | "imbalance" => "J/m",
        _ => "",
    }
}

/// Index, drift and energy in words, with the numbers of this run.
fn meaning(document: &Value) -> String {
    if document["analysis"] == "static" {
        return format!(
            "<p>Newton's method found the equilibrium in {} iterations over {} load steps.</p>\n",
            document["newton_iterations"], document["load_steps"]
        );
    }
    let index = document["index"].as_u64().unwrap_or(0);
    let mut text = format!(
        "<p>The system has index {index}: {}.</p>\n",
        meaning_of_index(index, document["integrator"] == "ida")
    );
    if let Some(drift) = document["constraint_drift"].as_f64() {
        text += &format!(
            "<p>The volume constraint p/κ + J - 1 = 0 was missed by at most {drift:.1e} \
             (projected on the pressure's functions)."
        );
        if document["formulation"] == "velocity" {
            text += " This formulation imposes its derivative, so that errors add up over time.";
        }
        text += "</p>\n";
    }
    let left_out = document["suppressed"].as_array().into_iter().flatten();
    let left_out: Vec<&str> = left_out.filter_map(Value::as_str).collect();
    if !left_out.is_empty() {
        let names = left_out.join(", ");
        text += &format!("<p>Left out of the error test: {names}.</p>\n");
    }
    if let Some([kinetic, elastic, work, dissipated, imbalance]) = energies(document) {
        text += &format!(
            "<p>Energy per metre of depth at the end: {kinetic:.3e} J kinetic and {elastic:.3e} J \
             elastic; the loads did {work:.3e} J of work, damping took {dissipated:.3e} J. The \
             balance is missed by {imbalance:.1e} J, what time integration with this tolerance \
             loses or gains.</p>\n"
        );
    }
    text
}

/// What an index means for the integrator at hand: IDAS' BDF, or Radau IIA.
fn meaning_of_index(index: u64, is_bdf: bool) -> &'static str {
    match (index, is_bdf) {
        (0, _) => "an ordinary differential equation; all variables are controlled alike",
        (1, _) => {
            "the pressure follows from the displacement without differentiation, and the error \
             test may include it"
        }
        (_, false) => {
            "the multipliers follow only after differentiation. Radau IIA tests their errors times \
             a power of the step, as they act on the motion"
        }
        (2, true) => {
            "the multipliers follow after one differentiation. Their estimated errors do not \
             shrink with the step as those of the other variables do, so they are best left out \
             of the error test"
        }
        (_, true) => {
            "the multipliers follow only after two differentiations. A code of BDF type meets \
             them at the limit of what it can do: with them in the error test it tends to stop, \
             and a formulation of lower index is the better choice"
        }
    }
}

/// The last row of an energy probe.
fn energies(document: &Value) -> Option<[f64; 5]> {
    let row = document["energy"].as_array()?;
    let numbers: Vec<f64> = row.iter().filter_map(Value::as_f64).collect();
    numbers.try_into().ok()
}

fn statistics(document: &Value) -> String {
    let Some(object) = document.as_object() else {
        return String::new();
    };
    let is_plain = |value: &&Value| !value.is_object() && !value.is_array() && !value.is_null();
    let rows: String = object
        .iter()
        .filter(|(_, value)| is_plain(value))
        .map(|(key, value)| {
            let value = value
                .as_str()
                .map_or_else(|| value.to_string(), str::to_owned);
            format!(
                "<tr><td>{}</td><td>{}</td></tr>\n",
                escape(key),
                escape(&value)
            )
        })
        .collect();
    format!("<table>{rows}</table>\n")
}
