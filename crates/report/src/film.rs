//! Films of the stored fields of a run, made without reading the scene.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use anyhow::Context;
use myovib_fem::bounds;
use myovib_model::Quantity;
use myovib_scene::InputError;
use myovib_scene::vtu::{self, StoredField, StoredMesh};
use serde_json::Value;

use crate::page::body::unit;
use crate::plot::surface_plot::{Face, Paint};
use crate::plot::{Axis, Field, Figure, MeshPlot, SurfacePlot};
use crate::spatial::alone;
use crate::vector::{Place, cross, dot, minus};

/// Margin around the moving body, as a fraction of its extent.
const MARGIN: f64 = 0.04;

/// Content of a film.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// Field that determines the colors of the body; by default, the displacement. If a field has several components,
    /// its magnitude is shown.
    pub field: Option<&'a str>,
    /// Factor by which displacements are multiplied.
    pub factor: f64,
    /// First and last time (s) of the run to be shown.
    pub between: [f64; 2],
    /// Frequency (Hz) of a response or a mode. The nearest stored frequency is shown; by default, the lowest.
    pub frequency: Option<f64>,
}

/// Number of pictures per cycle.
const PER_CYCLE: usize = 25;
/// Largest displacement in the picture of a mode, as a fraction of the body's extent. The size of a mode itself is
/// arbitrary.
const MODE_SIZE: f64 = 0.1;

/// Nodal values at one point in time.
struct Shot {
    title: String,
    displacement: Vec<[f64; 3]>,
    values: Vec<f64>,
}

impl Shot {
    /// Selects the displacement and the values of `field` from the fields of a file with `n` points.
    fn of(title: String, fields: &[StoredField], n: usize, field: &str) -> anyhow::Result<Self> {
        let values = found(fields, field)?;
        let width = values.components.len();
        let displacement = fields.iter().find(|field| field.name == Quantity::Displacement.label());
        Ok(Self {
            title,
            displacement: match displacement {
                Some(field) => field.values.as_chunks::<3>().0.to_vec(),
                None => vec![[0.0; 3]; n],
            },
            values: match width {
                1 => values.values.clone(),
                _ => values.values.chunks(width).map(magnitude).collect(),
            },
        })
    }
}

/// Returns a picture for each stored time of the run in `folder`, or, for a response or a mode, pictures of one cycle.
/// All pictures have the same scale and colors.
pub fn frames(folder: &Path, request: Request<'_>) -> anyhow::Result<Vec<Figure>> {
    let listed =
        |list: &str| vtu::listed(folder, list).context(format!("cannot read {}", folder.display()));
    let (files, amplitudes) = (listed(vtu::LIST)?, listed(vtu::AMPLITUDES_LIST)?);
    let field = request.field.unwrap_or(Quantity::Displacement.label());
    let (mesh, shots) = match (files.is_empty(), amplitudes.is_empty()) {
        (false, _) => stored(&files, loads(folder), field, request)?,
        (true, false) => cycle(&amplitudes, field, request)?,
        (true, true) if folder.join(vtu::SHAPES).exists() => vibration(folder, field, request)?,
        (true, true) => {
            return Err(InputError::new("the folder contains no fields")
                .at(folder.display())
                .next("name the folder of a dynamic analysis with [fields], of a response with response.fields, or of modes")
                .into());
        }
    };
    let axis = axis(field, &shots);
    let drawing = Drawing::of(&mesh, request.factor, axis, &shots);
    Ok(shots.iter().map(|shot| drawing.frame(shot)).collect())
}

fn read(file: &Path) -> anyhow::Result<(StoredMesh, Vec<StoredField>)> {
    vtu::read(file).context(format!("cannot read {}", file.display()))
}

/// Returns the document of the run in a folder; null if it cannot be read.
fn document(folder: &Path) -> Value {
    let text = std::fs::read_to_string(folder.join("run.json")).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or_default()
}

/// Returns the load factors of the states on a loading path; empty for other runs.
pub(crate) fn loads(folder: &Path) -> Vec<f64> {
    let document = document(folder);
    let states = document["path"].as_array().into_iter().flatten();
    states.filter_map(|state| state["load"].as_f64()).collect()
}

/// Reads the stored times of a run, or the states of a loading path with the load factors `loads`.
fn stored(
    files: &[(f64, PathBuf)],
    loads: Vec<f64>,
    field: &str,
    request: Request<'_>,
) -> anyhow::Result<(StoredMesh, Vec<Shot>)> {
    if request.frequency.is_some() {
        let error = InputError::new("the option has no effect on the movie of a dynamic analysis");
        return Err(error
            .at("--frequency")
            .next("use it with the folder of a response or of modes")
            .into());
    }
    let mut mesh = None;
    let mut shots = Vec::new();
    let [from, to] = request.between;
    let states = files.iter().enumerate();
    for (i, (t, file)) in states.filter(|(_, (t, _))| (from..=to).contains(t)) {
        let (own, fields) = read(file)?;
        let title = match loads.get(i) {
            Some(load) => format!("load factor {load:.4}"),
            None => format!("*t* = {t:.4} s"),
        };
        shots.push(Shot::of(title, &fields, own.points.len(), field)?);
        mesh = Some(own);
    }
    let Some(mesh) = mesh else {
        let (first, last) = (files[0].0, files[files.len() - 1].0);
        return Err(InputError::new("no fields are stored in this time interval")
            .at("--from, --to")
            .found(format!("{from} to {to} s"))
            .allowed(format!("times from {first} to {last} s"))
            .into());
    };
    Ok((mesh, shots))
}

/// Reads the amplitudes û of a response and computes Re(û e^{iφ}) for the phases φ of one cycle.
fn cycle(
    files: &[(f64, PathBuf)],
    field: &str,
    request: Request<'_>,
) -> anyhow::Result<(StoredMesh, Vec<Shot>)> {
    let frequencies = files.iter().map(|(frequency, _)| *frequency);
    let nearest = nearest(frequencies, request)?.context("the list of amplitudes is empty")?;
    let (frequency, file) = &files[nearest];
    let (mesh, fields) = read(file)?;
    let pairs = fields.iter().filter_map(|re| {
        let name = re.name.strip_suffix("_re")?;
        let im = fields.iter().find(|im| im.name.strip_suffix("_im") == Some(name))?;
        Some((name, re, im))
    });
    let pairs: Vec<_> = pairs.collect();
    let shots = (0..PER_CYCLE).map(|k| {
        let phase = k as f64 / PER_CYCLE as f64;
        let (sine, cosine) = (TAU * phase).sin_cos();
        let moved = pairs.iter().map(|(name, re, im)| StoredField {
            name: (*name).to_owned(),
            components: re.components.clone(),
            values: re
                .values
                .iter()
                .zip(&im.values)
                .map(|(re, im)| re * cosine - im * sine)
                .collect(),
            of_cells: re.of_cells,
        });
        let title = format!("{frequency:.4} Hz, {:.0}°", 360.0 * phase);
        Shot::of(title, &moved.collect::<Vec<_>>(), mesh.points.len(), field)
    });
    let shots = shots.collect::<anyhow::Result<_>>()?;
    Ok((mesh, shots))
}

/// Reads the shapes φ of the modes and computes φ cos ωt for the phases ωt of one cycle.
fn vibration(
    folder: &Path,
    field: &str,
    request: Request<'_>,
) -> anyhow::Result<(StoredMesh, Vec<Shot>)> {
    let document = document(folder);
    let modes = document["muscles"][0]["modes"].as_array().into_iter().flatten();
    let frequencies: Vec<f64> =
        modes.map(|mode| mode["frequency"].as_f64().unwrap_or(f64::NAN)).collect();
    let nearest =
        nearest(frequencies.iter().copied(), request)?.context("run.json lists no modes")?;
    let (mesh, fields) = read(&folder.join(vtu::SHAPES))?;
    let shape = found(&fields, &format!("mode_{}", nearest + 1))?;
    let largest = shape.values.chunks(3).map(magnitude).fold(0.0, f64::max);
    let [low, high] = bounds(mesh.points.as_flattened(), 3);
    let extent = (0..3).map(|axis| high[axis] - low[axis]);
    let size = MODE_SIZE * extent.fold(0.0, f64::max) / largest;
    let shots = (0..PER_CYCLE).map(|k| {
        let phase = k as f64 / PER_CYCLE as f64;
        let displacement = StoredField {
            name: Quantity::Displacement.label().to_owned(),
            components: shape.components.clone(),
            values: shape.values.iter().map(|x| size * (TAU * phase).cos() * x).collect(),
            of_cells: false,
        };
        let title = format!("mode {}, {:.4} Hz", nearest + 1, frequencies[nearest]);
        Shot::of(title, &[displacement], mesh.points.len(), field)
    });
    let shots = shots.collect::<anyhow::Result<_>>()?;
    Ok((mesh, shots))
}

/// Returns the index of the frequency nearest to the requested frequency.
fn nearest(
    frequencies: impl Iterator<Item = f64>,
    request: Request<'_>,
) -> Result<Option<usize>, InputError> {
    if request.between != [0.0, f64::MAX] {
        let error = InputError::new("the option has no effect on the movie of a cycle");
        return Err(error.at("--from, --to").next("`--frequency` selects a stored frequency"));
    }
    let wanted = request.frequency.unwrap_or(0.0);
    let distances = frequencies.map(|frequency| (frequency - wanted).abs()).enumerate();
    Ok(distances.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(position, _)| position))
}

fn magnitude(vector: &[f64]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn found<'a>(fields: &'a [StoredField], name: &str) -> anyhow::Result<&'a StoredField> {
    let of_points = || fields.iter().filter(|field| !field.of_cells);
    let known = || of_points().map(|field| field.name.as_str());
    of_points().find(|field| field.name == name).ok_or_else(|| {
        InputError::new("the run has no such field")
            .at("--field")
            .found(name)
            .allowed(known().collect::<Vec<_>>().join(", "))
            .into()
    })
}

/// Returns the axis of the color scale. It extends from the smallest to the largest value at all times.
fn axis(field: &str, shots: &[Shot]) -> Axis {
    let values = shots.iter().flat_map(|shot| &shot.values);
    let finite = values.copied().filter(|value| value.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
        (f64::min(low, x), f64::max(high, x))
    });
    let axis = Axis::new(field.replace('_', " "), unit(field));
    match low < high {
        true => axis.between(low, high),
        false => axis,
    }
}

/// Settings common to all frames.
struct Drawing<'a> {
    mesh: &'a StoredMesh,
    factor: f64,
    axis: Axis,
    /// Boundary triangles of a 3D body; `None` in 2D.
    faces: Option<Vec<[usize; 3]>>,
    /// Corners of the box that contains all states.
    limits: [[f64; 2]; 3],
}

impl<'a> Drawing<'a> {
    fn of(mesh: &'a StoredMesh, factor: f64, axis: Axis, shots: &[Shot]) -> Self {
        let is_in_space = mesh.cells.iter().any(|cell| cell.len() == 10);
        let mut limits = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for shot in shots {
            for (x, u) in mesh.points.iter().zip(&shot.displacement) {
                for (k, limit) in limits.iter_mut().enumerate() {
                    for place in [x[k], x[k] + factor * u[k]].into_iter().filter(|x| x.is_finite())
                    {
                        *limit = [limit[0].min(place), limit[1].max(place)];
                    }
                }
            }
        }
        Self { faces: is_in_space.then(|| boundary(mesh)), mesh, factor, axis, limits }
    }

    fn frame(&self, shot: &Shot) -> Figure {
        let title = shot.title.clone();
        match &self.faces {
            Some(faces) => Figure::of("", self.surface(faces, shot, title)),
            None => Figure::of("", self.plane(shot, title)),
        }
    }

    fn surface(&self, faces: &[[usize; 3]], shot: &Shot, title: String) -> SurfacePlot {
        let place = |node: usize| {
            let (x, u) = (self.mesh.points[node], shot.displacement[node]);
            [0, 1, 2].map(|k| x[k] + self.factor * u[k])
        };
        let face = |nodes: &[usize; 3]| Face {
            corners: nodes.map(place),
            paint: Paint::Value(nodes.map(|node| shot.values[node]).iter().sum::<f64>() / 3.0),
        };
        let corner = |bits: usize| [0, 1, 2].map(|k| self.limits[k][bits >> k & 1]);
        SurfacePlot {
            title,
            faces: faces.iter().map(face).collect(),
            field: Some(self.axis.clone()),
            around: (0..8).map(corner).collect(),
            ..SurfacePlot::default()
        }
    }

    fn plane(&self, shot: &Shot, title: String) -> MeshPlot {
        let plane = |points: &[[f64; 3]]| points.iter().map(|&[x, y, _]| [x, y]).collect();
        let cells = self.mesh.cells.iter();
        let axis = |name: &str, k: usize| {
            let [low, high] = self.limits[k];
            let margin = MARGIN * (high - low);
            Axis::new(name, "m").between(low - margin, high + margin)
        };
        MeshPlot {
            title,
            x: axis("*x*", 0),
            y: axis("*y*", 1),
            nodes: plane(&self.mesh.points),
            triangles: cells.filter_map(|cell| cell.as_slice().try_into().ok()).collect(),
            displacement: plane(&shot.displacement),
            scale: self.factor,
            field: Some(Field { axis: self.axis.clone(), values: shot.values.clone() }),
            ..MeshPlot::default()
        }
    }
}

/// Returns the boundary triangles of tetrahedra, with corners counterclockwise seen from outside. Points at the same
/// position, which occur on boundaries between regions, are treated as one point.
fn boundary(mesh: &StoredMesh) -> Vec<[usize; 3]> {
    const SIDES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    let mut first: BTreeMap<[u64; 3], usize> = BTreeMap::new();
    let points = mesh.points.iter().enumerate();
    let same: Vec<usize> =
        points.map(|(i, point)| *first.entry(point.map(f64::to_bits)).or_insert(i)).collect();
    let faces = mesh.cells.iter().flat_map(|cell| {
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| mesh.points[cell[i]]);
        let volume = triple([b, c, d].map(|x| minus(x, a)));
        SIDES.map(|side| {
            let [p, q, r] = side.map(|i| cell[i]);
            let face = if volume > 0.0 { [p, q, r] } else { [p, r, q] };
            (face.map(|node| same[node]), face)
        })
    });
    alone(faces).collect()
}

/// Returns a · (b × c).
fn triple([a, b, c]: [Place; 3]) -> f64 {
    dot(a, cross(b, c))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks two tetrahedra in different regions. Their common face has separate points in each region, but does not
    /// belong to the boundary.
    #[test]
    fn faces_between_regions_are_inside() {
        let points = vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, -1.0],
        ];
        let cell = |corners: [usize; 4]| [&corners[..], &[corners[0]; 6]].concat();
        let mesh = StoredMesh { points, cells: vec![cell([0, 1, 2, 3]), cell([4, 5, 6, 7])] };
        let faces = boundary(&mesh);
        assert_eq!(faces.len(), 6);
        // By the divergence theorem, outward normals give the volume of the two tetrahedra, 2/6.
        let volume: f64 = faces.iter().map(|face| triple(face.map(|node| mesh.points[node]))).sum();
        assert!((volume / 6.0 - 1.0 / 3.0).abs() < 1e-15);
    }
}
