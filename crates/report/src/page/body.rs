//! Data of the body for the interactive view: the visible triangles, and the stored fields or modes at their vertices.

use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use myovib_model::Quantity;
use myovib_scene::modes::BodyModes;
use myovib_scene::scene_file::Analysis;
use myovib_scene::vtu::{self, Grid, StoredField};
use myovib_scene::{Body, Error, Scene, plain};
use serde_json::{Value, json};

use super::surface::Surface;
use crate::film::loads;
use crate::modes::{frequency, shape};
use crate::plot::Color;

/// Maximum total size (bytes) of all frames in base64 encoding.
const MOST_BYTES: usize = 4_000_000;
/// Largest level at which values are stored; the next level encodes non-finite values.
const LEVELS: f64 = 65534.0;
/// Number of colors in the color scale.
const N_COLORS: usize = 33;

/// Description of the body, and notes on omitted parts.
#[derive(Debug)]
pub(super) struct BodyData {
    pub(super) document: Value,
    pub(super) notes: Vec<String>,
}

/// Field at the visible points in all frames.
struct Frames {
    name: String,
    unit: &'static str,
    components: Vec<String>,
    moves: bool,
    /// Values with the indices frame, component and point.
    values: Vec<Vec<Vec<f64>>>,
}

impl Frames {
    /// Returns the description of the field. Each component is rounded to 16-bit levels over its range in all frames.
    fn document(&self) -> Value {
        let ranges: Vec<[f64; 2]> = (0..self.components.len())
            .map(|c| {
                let all = self.values.iter().flat_map(|frame| &frame[c]);
                let finite = all.copied().filter(|value| value.is_finite());
                finite.fold(None, |range: Option<[f64; 2]>, x| {
                    let [low, high] = range.unwrap_or([x, x]);
                    Some([low.min(x), high.max(x)])
                })
            })
            .map(|range| range.unwrap_or_default())
            .collect();
        let component = |(values, range): (&Vec<f64>, &[f64; 2])| levels(values, *range);
        let frame = |frame: &Vec<Vec<f64>>| -> Vec<String> {
            frame.iter().zip(&ranges).map(component).collect()
        };
        let limits = ranges.iter();
        let limits = limits.map(|[low, high]| json!({ "lowest": low, "highest": high }));
        json!({
            "name": plain(&self.name),
            "unit": self.unit,
            "components": self.components,
            "is_vector": self.components.iter().any(|name| name == "x"),
            "moves": self.moves,
            "ranges": limits.collect::<Vec<_>>(),
            "frames": self.values.iter().map(frame).collect::<Vec<_>>(),
        })
    }
}

/// Rounds values to 16-bit levels between the given limits, and encodes them.
fn levels(values: &[f64], [low, high]: [f64; 2]) -> String {
    let level = |&value: &f64| match value.is_finite() {
        true if high > low => (LEVELS * (value - low) / (high - low)).round() as u16,
        true => 0,
        false => u16::MAX,
    };
    STANDARD.encode(values.iter().map(level).flat_map(u16::to_le_bytes).collect::<Vec<u8>>())
}

/// Returns the body of a run with the fields stored in its folder.
pub(super) fn of_run(folder: &Path, scene: &Scene, body: &Body) -> Result<BodyData, Error> {
    let space = body.muscle.solid.space();
    let grid = Grid::of_body(body);
    let surface = Surface::of(space, &grid);
    let list = folder.join(vtu::LIST);
    let files = vtu::files(folder).map_err(Error::file("read", &list))?;
    let read = |file: &Path| vtu::read_fields(file, &grid).map_err(Error::file("read", file));
    let width = match files.last() {
        Some((_, last)) => read(last)?.iter().map(|field| field.components.len()).sum(),
        None => 0,
    };
    let kept = spread(files.len(), MOST_BYTES / bytes(&surface, width).max(1));
    let mut fields: Vec<Frames> = Vec::new();
    for &i in &kept {
        for (k, field) in read(&files[i].1)?.into_iter().enumerate() {
            let values = at_points(&field, &grid, &surface);
            if fields.len() <= k {
                fields.push(Frames {
                    unit: unit(&field.name),
                    moves: field.name == Quantity::Displacement.label(),
                    name: field.name,
                    components: field.components,
                    values: Vec::new(),
                });
            }
            fields[k].values.push(values);
        }
    }
    let loads = loads(folder);
    let label = |&i: &usize| match (scene.file().analysis, loads.get(i)) {
        (_, Some(load)) => format!("load factor {load}"),
        (Analysis::Static, None) => String::new(),
        _ => format!("t = {} s", files[i].0),
    };
    let labels: Vec<String> = kept.iter().map(label).collect();
    let mut notes = thinning(&surface);
    if kept.len() < files.len() {
        notes.push(format!(
            "The view shows {} of {} stored times; the field files contain all of them.",
            kept.len(),
            files.len()
        ));
    }
    let document = document(scene, body, &grid, &surface, &fields, &labels, false);
    Ok(BodyData { document, notes })
}

/// Returns the body, with one frame per mode.
pub(super) fn of_modes(scene: &Scene, body: &Body, modes: &BodyModes) -> BodyData {
    let grid = Grid::of_body(body);
    let space = body.muscle.solid.space();
    let surface = Surface::of(space, &grid);
    let dimension = space.dimension();
    let shown = modes.modes.iter().take(MOST_BYTES / bytes(&surface, 3).max(1));
    let shown: Vec<_> = shown.collect();
    let values = shown.iter().map(|mode| {
        let shape = shape(&body.muscle, mode);
        let at = |c: usize| {
            let nodes = surface.points.iter().map(|&point| grid.nodes()[point]);
            match c < dimension {
                true => nodes.map(|node| shape[dimension * node + c]).collect(),
                false => vec![0.0; surface.points.len()],
            }
        };
        (0..3).map(at).collect()
    });
    let motion = Frames {
        name: "motion (arbitrary scale)".to_owned(),
        unit: "",
        components: ["x", "y", "z"].map(str::to_owned).to_vec(),
        moves: true,
        values: values.collect(),
    };
    let labels = shown.iter().enumerate();
    let labels = labels.map(|(n, mode)| format!("mode {}: {} Hz", n + 1, frequency(mode)));
    let labels: Vec<String> = labels.collect();
    let mut notes = thinning(&surface);
    if shown.len() < modes.modes.len() {
        notes.push(format!("The view shows the lowest {} modes.", shown.len()));
    }
    let document = document(scene, body, &grid, &surface, &[motion], &labels, true);
    BodyData { document, notes }
}

/// Returns the size (bytes) of a base64-encoded frame with `n_components` components.
fn bytes(surface: &Surface, n_components: usize) -> usize {
    surface.points.len() * n_components * 8 / 3
}

/// Returns at most `most` indices below `n`. They are equally spaced and always include the last index.
fn spread(n: usize, most: usize) -> Vec<usize> {
    match most.clamp(1, n.max(1)) {
        _ if n == 0 => Vec::new(),
        1 => vec![n - 1],
        most => (0..most).map(|i| i * (n - 1) / (most - 1)).collect(),
    }
}

fn thinning(surface: &Surface) -> Vec<String> {
    let note = |n| {
        format!(
            "The view shows {} of {n} triangles of the surface: neighboring nodes are merged.",
            surface.triangles.len()
        )
    };
    surface.thinned_from.map(note).into_iter().collect()
}

/// Returns the components of a field at the visible points. For a field on cells, the value at a point is the mean over
/// all adjacent cells that have a finite value.
fn at_points(field: &StoredField, grid: &Grid, surface: &Surface) -> Vec<Vec<f64>> {
    let width = field.components.len();
    if !field.of_cells {
        let value = |c: usize| {
            let points = surface.points.iter();
            points.map(|point| field.values[width * point + c]).collect()
        };
        return (0..width).map(value).collect();
    }
    let n_nodes = grid.cells().len() / grid.regions().len().max(1);
    let component = |c: usize| {
        let mut sums = vec![(0.0, 0.0); grid.n_points()];
        for (cell, points) in grid.cells().chunks(n_nodes).enumerate() {
            let value = field.values[width * cell + c];
            if value.is_finite() {
                for &point in points {
                    sums[point] = (sums[point].0 + value, sums[point].1 + 1.0);
                }
            }
        }
        let mean = |&point: &usize| sums[point].0 / sums[point].1;
        surface.points.iter().map(mean).collect()
    };
    (0..width).map(component).collect()
}

/// Returns the unit of a stored field; empty for a ratio or an unknown field.
pub(crate) fn unit(name: &str) -> &'static str {
    Quantity::labeled(name).map_or("", Quantity::unit)
}

fn document(
    scene: &Scene,
    body: &Body,
    grid: &Grid,
    surface: &Surface,
    fields: &[Frames],
    labels: &[String],
    oscillates: bool,
) -> Value {
    let space = body.muscle.solid.space();
    let points = surface.points.iter().flat_map(|&point| {
        let place = space.node_point(grid.nodes()[point]);
        [0, 1, 2].map(|axis| place.get(axis).copied().unwrap_or_default() as f32)
    });
    let points: Vec<u8> = points.flat_map(f32::to_le_bytes).collect();
    let indices = |indices: &[usize]| {
        let bytes = indices.iter().flat_map(|&i| (i as u32).to_le_bytes());
        STANDARD.encode(bytes.collect::<Vec<u8>>())
    };
    let mut regions = vec![0_u8; grid.n_points()];
    let n_nodes = grid.cells().len() / space.n_elements().max(1);
    for (points, &region) in grid.cells().chunks(n_nodes).zip(grid.regions()) {
        for &point in points {
            regions[point] = u8::try_from(region).unwrap_or(u8::MAX);
        }
    }
    let regions: Vec<u8> = surface.points.iter().map(|&point| regions[point]).collect();
    let materials = scene.file().material.iter().enumerate();
    let materials = materials.map(|(i, material)| {
        let name = material.group.as_deref().unwrap_or("everywhere");
        json!({ "name": plain(name), "color": Color::of_material(i).to_string() })
    });
    let color = |i: usize| Color::of_fraction(i as f64 / (N_COLORS - 1) as f64).to_string();
    json!({
        "dimension": space.dimension(),
        "points": STANDARD.encode(points),
        "triangles": indices(surface.triangles.as_flattened()),
        "edges": indices(surface.edges.as_flattened()),
        "material": STANDARD.encode(regions),
        "materials": materials.collect::<Vec<_>>(),
        "colors": (0..N_COLORS).map(color).collect::<Vec<_>>(),
        "fields": fields.iter().map(Frames::document).collect::<Vec<_>>(),
        "labels": labels,
        "oscillates": oscillates,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_spread_from_the_first_to_the_last() {
        assert_eq!(spread(0, 5), [0; 0]);
        assert_eq!(spread(5, 9), [0, 1, 2, 3, 4]);
        assert_eq!(spread(11, 3), [0, 5, 10]);
        assert_eq!(spread(11, 0), [10]);
    }

    /// Checks that the ends of the range are stored exactly and that NaN has its own level.
    #[test]
    fn values_are_rounded_to_levels() {
        let text = levels(&[-1.0, 0.0, 1.0, f64::NAN], [-1.0, 1.0]);
        let bytes = STANDARD.decode(text).unwrap();
        let read = bytes.as_chunks::<2>().0.iter().map(|&pair| u16::from_le_bytes(pair));
        assert_eq!(read.collect::<Vec<_>>(), [0, 32767, 65534, 65535]);
        let constant = STANDARD.decode(levels(&[3.0, 3.0], [3.0, 3.0])).unwrap();
        assert_eq!(constant, [0; 4]);
    }
}
