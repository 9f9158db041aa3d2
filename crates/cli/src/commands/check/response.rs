//! Loads and cost of a harmonic response before it is computed.

use std::time::Instant;

use myovib_model::check::FactorizationCost;
use myovib_model::harmonic::HarmonicResponse;
use myovib_model::statics::Equilibrium;
use myovib_report::table::counted;
use myovib_scene::response::MAX_FREQUENCIES;
use myovib_scene::scene_file::SceneFile;
use myovib_scene::scene_file::response::Grid;
use myovib_scene::{Body, InputError, Scene};
use myovib_sparse::resources;
use serde::Serialize;

use super::{memory, size_of};

/// Harmonic loads and cost of a response.
#[derive(Serialize)]
pub(super) struct ResponseJson {
    /// Number of frequencies; null if the response chooses them.
    frequencies: Option<usize>,
    /// Number of unknowns of each linear system.
    unknowns: usize,
    /// Computation time (s) for one frequency on one thread.
    seconds_per_frequency: f64,
    /// Computation time (s) for all frequencies on one thread; an upper bound if the response chooses them.
    seconds: f64,
    /// Loads and displacements that have a harmonic part.
    harmonic: Vec<String>,
    /// Loads, displacements and tensions whose static part belongs to the preload; empty for a response about rest.
    preload: Vec<String>,
    /// Time (s) at which the preload is evaluated; null for a response about rest.
    preload_time: Option<f64>,
}

/// Tables of a scene that define loads and displacements.
const LOADS: [&str; 5] =
    ["prescribed_displacement", "traction", "pressure", "body_force", "point_force"];
/// Keys of the static parts, which may depend on time.
const STATIC: [&str; 5] = ["x", "y", "z", "rotation", "value"];

/// Solves for one frequency about rest, which costs as much as a frequency about a preload. Returns the text and the
/// JSON document.
pub(super) fn examine(scene: &Scene, body: &Body) -> anyhow::Result<(String, ResponseJson)> {
    let Some(wanted) = &scene.file().response else {
        return Err(InputError::new("the scene has no [response] table").into());
    };
    let (frequencies, largest) = match wanted.frequencies.grid().map_err(InputError::new)? {
        Grid::Fixed(values) => (Some(values.len()), values.last().copied().unwrap_or(0.0)),
        Grid::Adaptive(adaptive) => (None, adaptive.range[1]),
    };
    let rest = Equilibrium::unloaded(&body.muscle);
    let response =
        HarmonicResponse::about(&body.muscle, body.formulation, &rest, &body.excitation)?;
    // The first solution also allocates the factors, so it is not timed.
    response.map(&[largest.max(1.0)], |_| Ok(()))?;
    let started = Instant::now();
    response.map(&[largest.max(1.0)], |_| Ok(()))?;
    let seconds = started.elapsed().as_secs_f64();
    let found = ResponseJson {
        frequencies,
        unknowns: response.n_unknowns(),
        seconds_per_frequency: seconds,
        seconds: seconds * frequencies.unwrap_or(MAX_FREQUENCIES) as f64,
        harmonic: with_keys(scene.file(), &LOADS, &["response"])?,
        preload: match wanted.preload_time {
            None => Vec::new(),
            Some(_) => preload(scene.file())?,
        },
        preload_time: wanted.preload_time,
    };
    let mut lines = vec![
        size_of(scene, body),
        format!("harmonic        {}", found.harmonic.join(", ")),
        match found.preload_time {
            None => "preload         none: the body vibrates about rest".to_owned(),
            Some(t) if found.preload.is_empty() => {
                format!("preload         none at t = {t} s: no load has a static part")
            }
            Some(t) => format!("preload         {} at t = {t} s", found.preload.join(", ")),
        },
    ];
    lines.extend(response.prediction().map(|needs| {
        memory(FactorizationCost { matrices: 1, needs, in_use: resources::in_use() })
    }));
    let total = found.seconds;
    lines.push(match found.frequencies {
        Some(n) => format!(
            "cost            {} of {seconds:.1e} s each, {total:.1} s on one thread",
            counted(n, "solution")
        ),
        None => format!(
            "cost            {seconds:.1e} s per frequency; the maximum of {MAX_FREQUENCIES}, chosen adaptively, \
             takes {total:.1} s on one thread"
        ),
    });
    let text = format!("harmonic response: {} unknowns\n\n{}\n", found.unknowns, lines.join("\n"));
    Ok((text, found))
}

/// Lists the loads, displacements and tensions that have a static part.
fn preload(file: &SceneFile) -> anyhow::Result<Vec<String>> {
    let tensions = with_keys(file, &["material"], &["active"])?;
    let tensions = tensions.into_iter().map(|material| format!("{material}.active"));
    Ok(with_keys(file, &LOADS, &STATIC)?.into_iter().chain(tensions).collect())
}

/// Lists the entries of these tables that have any of these keys.
fn with_keys(file: &SceneFile, tables: &[&str], keys: &[&str]) -> anyhow::Result<Vec<String>> {
    let file = serde_json::to_value(file)?;
    let found = tables.iter().flat_map(|table| {
        let entries = file[*table].as_array().into_iter().flatten().enumerate();
        let found = entries.filter(|(_, entry)| keys.iter().any(|key| !entry[*key].is_null()));
        found.map(move |(i, _)| format!("{table}[{i}]"))
    });
    Ok(found.collect())
}
