//! Fields on the mesh as VTK files for ParaView: one VTU file per output time, and a PVD file that lists the VTU files.

mod cloud;
mod data;
mod grid;
mod listing;

use std::io;
use std::path::{Path, PathBuf};

use myovib_fem::Space;
use myovib_fem::space::Degree;
use myovib_model::{Components, Quantity, Snapshot};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

pub(crate) use cloud::Cloud;
pub use data::{StoredField, read_field};
use data::{floats, integers};
pub use grid::Grid;
pub(crate) use listing::Listing;

use crate::Error;
use crate::modes::Mode;
use crate::result_folder::ResultFolder;

/// Returns the VTK cell type of the elements. VTK orders the nodes of these cells in the same way as this crate.
fn cell_type(space: &Space) -> usize {
    match (space.dimension(), space.degree()) {
        (2, Degree::One) => 5,
        (2, Degree::Two) => 22,
        (_, Degree::One) => 10,
        (_, Degree::Two) => 24,
    }
}

/// Name of the file that lists all files with fields on the mesh.
pub const LIST: &str = "fields.pvd";
/// Name of the file that lists all files with complex fields of a response.
pub const AMPLITUDES_LIST: &str = "amplitudes.pvd";
/// Name of the file with the mode shapes.
pub const SHAPES: &str = "modes.vtu";
/// Name of the file that lists all files with values at the positions of chains.
pub const PLACES_LIST: &str = "places.pvd";

/// Values of a field in some of the elements.
#[derive(Debug, Clone, PartialEq)]
pub struct CellField {
    pub name: String,
    /// Indices of elements with their values. All other elements have the value NaN.
    pub values: Vec<(usize, f64)>,
}

/// A numbered series of files in a folder.
#[derive(Debug)]
pub(crate) struct Series {
    pub(crate) listing: Listing,
    grid: Grid,
    quantities: Vec<Quantity>,
    not_finite: Option<NotFinite>,
}

/// Non-finite values of a field.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NotFinite {
    quantity: Quantity,
    /// Time (s) at which non-finite values first occurred.
    t: f64,
    points: usize,
}

impl NotFinite {
    pub fn note(&self) -> String {
        let Self { quantity, t, points } = self;
        let points = match points {
            1 => "1 point".to_owned(),
            n => format!("{n} points"),
        };
        format!(
            "field `{}` is not finite at {points} at t = {t} s: the deformation there is outside the domain of the \
             law; the field `J` shows where",
            quantity.label()
        )
    }
}

impl Series {
    /// Creates a series of `quantities`. `done` contains the times of existing files.
    pub(crate) fn new(grid: Grid, quantities: Vec<Quantity>, done: &[f64]) -> Self {
        Self { listing: Listing::new(LIST, done), grid, quantities, not_finite: None }
    }

    /// Sets the non-finite values that were found in earlier files.
    #[must_use]
    pub(crate) fn with_seen(self, not_finite: Option<NotFinite>) -> Self {
        Self { not_finite, ..self }
    }

    /// Returns the first non-finite values that were found, if any.
    pub(crate) fn not_finite(&self) -> Option<NotFinite> {
        self.not_finite
    }

    pub(crate) fn quantities(&self) -> &[Quantity] {
        &self.quantities
    }

    /// Writes the fields of the body at time `t` and the values of some elements, then the list of all files. Returns
    /// the number of evaluated material states (det F or stress).
    pub(crate) fn write(
        &mut self,
        folder: &ResultFolder,
        t: f64,
        snapshot: &Snapshot<'_>,
        cells: &[CellField],
    ) -> Result<u64, Error> {
        let (text, not_finite) = vtu(snapshot, &self.grid, &self.quantities, cells);
        self.listing.add(folder, t, &text)?;
        self.not_finite = self.not_finite.or(not_finite.map(|(quantity, points)| NotFinite {
            quantity,
            t,
            points,
        }));
        let states = self.quantities.iter().filter(|q| q.needs_state()).count();
        Ok((states * self.grid.n_evaluations()) as u64)
    }
}

/// Returns the times and paths of all field files in a folder. The result is empty if the folder contains no fields.
pub fn files(folder: &Path) -> io::Result<Vec<(f64, PathBuf)>> {
    listed(folder, LIST)
}

/// Returns the times (or frequencies) and paths of the files in the `list` of a folder. The result is empty if the list
/// does not exist.
pub fn listed(folder: &Path, list: &str) -> io::Result<Vec<(f64, PathBuf)>> {
    let list = match std::fs::read_to_string(folder.join(list)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        list => list?,
    };
    let value = |line: &str, key: &str| -> Option<String> {
        let (_, rest) = line.split_once(&format!("{key}=\""))?;
        Some(rest.split_once('"')?.0.to_owned())
    };
    let file = |line: &str| {
        let t: f64 = value(line, "timestep")?.parse().ok()?;
        Some((t, folder.join(value(line, "file")?)))
    };
    Ok(list.lines().filter_map(file).collect())
}

/// Mesh read from a file. It consists of the undeformed points, and of triangles or tetrahedra with nodes on their
/// edges.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredMesh {
    /// Points of the undeformed body; z = 0 in 2D.
    pub points: Vec<[f64; 3]>,
    /// Point indices of each cell: first the corners, then the edges.
    pub cells: Vec<Vec<usize>>,
}

/// Reads the mesh and the real-valued fields from a file. The scene is not required.
///
/// # Errors
/// Fails if the file cannot be read or was written by another program.
pub fn read(file: &Path) -> io::Result<(StoredMesh, Vec<StoredField>)> {
    let text = std::fs::read_to_string(file)?;
    let mesh = || {
        let points = data::read_field(&text, "points")?.as_chunks::<3>().0.to_vec();
        let connectivity = data::read_integers(&text, "connectivity")?;
        let offsets = data::read_integers(&text, "offsets")?;
        let starts = std::iter::once(&0).chain(&offsets);
        let cell = |(&start, &end): (&usize, &usize)| {
            let cell = connectivity.get(start..end)?;
            let is_right = cell.iter().all(|&point| point < points.len());
            is_right.then(|| cell.to_vec())
        };
        let cells = starts.zip(&offsets).map(cell).collect::<Option<_>>()?;
        Some(StoredMesh { points, cells })
    };
    let other = || io::Error::new(io::ErrorKind::InvalidData, "not a field file of myovib");
    Ok((mesh().ok_or_else(other)?, data::read_fields(&text)))
}

/// Reads the real-valued fields from a file.
///
/// # Errors
/// Fails if the file cannot be read or belongs to another mesh.
pub fn read_fields(file: &Path, grid: &Grid) -> io::Result<Vec<StoredField>> {
    let fields = data::read_fields(&std::fs::read_to_string(file)?);
    let n_cells = grid.regions.len();
    let fits = |field: &StoredField| {
        let n = if field.of_cells { n_cells } else { grid.n_points() };
        field.values.len() == n * field.components.len()
    };
    match fields.iter().all(fits) {
        true => Ok(fields),
        false => Err(of_another_mesh()),
    }
}

fn of_another_mesh() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "the fields belong to another mesh")
}

/// Returns the time and the nodal displacement (three components per node) from the last file in a folder. Returns
/// `None` if the folder contains no such file, or if the file contains no displacement.
///
/// # Errors
/// Fails if the file cannot be read or belongs to another mesh.
pub fn last_displacement(folder: &Path, grid: &Grid) -> io::Result<Option<(f64, Vec<[f64; 3]>)>> {
    let Some((t, file)) = files(folder)?.pop() else {
        return Ok(None);
    };
    let text = std::fs::read_to_string(file)?;
    let Some(values) = data::read_field(&text, Quantity::Displacement.label()) else {
        return Ok(None);
    };
    let vectors = values.as_chunks::<3>().0;
    if vectors.len() != grid.n_points() {
        return Err(of_another_mesh());
    }
    let n_nodes = grid.nodes.iter().max().map_or(0, |last| last + 1);
    let mut displacement = vec![[0.0; 3]; n_nodes];
    for (&node, vector) in grid.nodes.iter().zip(vectors) {
        displacement[node] = *vector;
    }
    Ok(Some((t, displacement)))
}

/// Formats the file for one point in time. Also returns the first quantity with non-finite values and the number of
/// points with such values.
fn vtu(
    snapshot: &Snapshot<'_>,
    grid: &Grid,
    quantities: &[Quantity],
    cells: &[CellField],
) -> (String, Option<(Quantity, usize)>) {
    let space = snapshot.solid.space();
    let mut points = String::new();
    let mut not_finite = None;
    for &quantity in quantities {
        let values = grid.values(snapshot, quantity);
        let strange = values.iter().filter(|row| row.iter().any(|x| !x.is_finite()));
        let strange = strange.count();
        not_finite = not_finite.or((strange > 0).then_some((quantity, strange)));
        let picked = order(quantity.components(), space.dimension());
        let names = component_names(quantity.components());
        let rows = values.iter();
        let values =
            rows.flat_map(|row| picked.iter().map(|&i| row.get(i).copied().unwrap_or(0.0)));
        points += &floats(quantity.label(), names, picked.len(), values);
    }
    (file(space, grid, &points, cells), not_finite)
}

/// Formats a file with the real and imaginary parts of quantities at all points. The names are, for example, `u_re` and
/// `u_im`.
pub(crate) fn of_amplitudes(
    space: &Space,
    grid: &Grid,
    fields: &[(Quantity, Vec<Complex64>)],
) -> String {
    let mut points = String::new();
    for (quantity, values) in fields {
        let names = component_names(quantity.components());
        let width = values.len() / grid.n_points();
        let re: fn(&Complex64) -> f64 = |z| z.re;
        for (suffix, part) in [("re", re), ("im", |z| z.im)] {
            let name = format!("{}_{suffix}", quantity.label());
            points += &floats(&name, names, width, values.iter().map(part));
        }
    }
    file(space, grid, &points, &[])
}

/// Formats a file with mode shapes as vector fields `mode_1`, `mode_2`, …
pub fn of_modes<'a>(space: &Space, grid: &Grid, modes: impl Iterator<Item = &'a Mode>) -> String {
    let names = component_names(Components::Vector);
    let fields = modes.enumerate().map(|(n, mode)| {
        let vectors = grid.vectors(&mode.shape, space.dimension());
        floats(&format!("mode_{}", n + 1), names, 3, vectors.iter().flatten().copied())
    });
    file(space, grid, &fields.collect::<String>(), &[])
}

/// Formats a file with the undeformed body and values of its elements.
pub fn of_elements(space: &Space, grid: &Grid, cells: &[CellField]) -> String {
    file(space, grid, "", cells)
}

/// Formats a file with the undeformed points, the cells, the point data, the regions and fiber directions of the cells,
/// and additional cell data.
fn file(space: &Space, grid: &Grid, of_points: &str, of_cells: &[CellField]) -> String {
    let (n_points, n_cells) = (grid.n_points(), space.n_elements());
    let n_cell_nodes = space.mesh().shape().n_nodes(space.degree());
    let mut text = data::head(n_points, n_cells);
    let point = |&node: &usize| {
        let place = space.node_point(node);
        [0, 1, 2].map(|axis| place.get(axis).copied().unwrap_or_default())
    };
    text += &floats("points", &[], 3, grid.nodes.iter().flat_map(point));
    text += "</Points>\n<Cells>\n";
    text += &integers("connectivity", grid.cells.iter().copied());
    text += &integers("offsets", (1..=n_cells).map(|cell| n_cell_nodes * cell));
    text += &integers("types", (0..n_cells).map(|_| cell_type(space)));
    text += "</Cells>\n<PointData>\n";
    text += of_points;
    text += "</PointData>\n<CellData>\n";
    text += &integers("region", grid.regions.iter().copied());
    if !grid.fibers.is_empty() {
        let values = grid.fibers.iter().copied().flatten();
        text += &floats("fiber", &["x", "y", "z"], 3, values);
    }
    for CellField { name, values } in of_cells {
        let mut all = vec![f64::NAN; n_cells];
        for &(cell, value) in values {
            all[cell] = value;
        }
        text += &floats(name, &[], 1, all.into_iter());
    }
    text + "</CellData>\n" + data::END
}

/// Returns, for each component in the file, the index of the corresponding component of the quantity. If the quantity
/// has no component with this index, the value is zero. Symmetric tensors have six components in ParaView's order, also
/// in 2D.
fn order(components: Components, dimension: usize) -> &'static [usize] {
    match (components, dimension) {
        (Components::Scalar, _) => &[0],
        (Components::Vector | Components::Principal, _) => &[0, 1, 2],
        (Components::Symmetric, 2) => &[0, 1, 3, 2, 4, 5],
        (Components::Symmetric, _) => &[0, 1, 2, 3, 4, 5],
    }
}

fn component_names(components: Components) -> &'static [&'static str] {
    match components {
        Components::Scalar => &[],
        Components::Vector => &["x", "y", "z"],
        Components::Principal => &["1", "2", "3"],
        Components::Symmetric => &["xx", "yy", "zz", "xy", "yz", "xz"],
    }
}

#[cfg(test)]
mod tests {
    use myovib_dae::Problem;
    use myovib_model::{Field, MuscleDae};

    use super::*;
    use crate::Scene;
    use crate::result_folder::FolderRequest;

    #[test]
    fn non_finite_values_are_reported_with_their_first_time() {
        let text = "[time]\nend = 1.0\n[mesh]\ntype = \"rectangle\"\nwidth = 1.0\nheight = 1.0\ncells = [2, 2]\n\
                    [solid]\nbulk_modulus = 1e5\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
                    [[fixed]]\ngroup = \"left\"\n";
        let scene = Scene::build("scene.toml", text, &[], Path::new("")).unwrap();
        let body = scene.body.unwrap();
        let folder = tempfile::tempdir().unwrap();
        let request = FolderRequest::to_add(folder.path(), "run", Vec::new());
        let folder = request.open().unwrap();
        let quantities = vec![Quantity::Pressure, Quantity::Displacement];
        let mut series = Series::new(Grid::of_body(&body), quantities, &[]);
        let mut dae = MuscleDae::new(body.muscle, body.formulation).unwrap();
        let mut y = vec![0.0; dae.n_unknowns()];
        let own = dae.layout().range(Field::Displacement).unwrap();
        for (t, u) in [(0.0, 0.1), (0.5, f64::INFINITY), (1.0, f64::NAN)] {
            y[own.start] = u;
            let rest = vec![0.0; y.len()];
            series.write(&folder, t, &dae.snapshot(t, &y, &rest), &[]).unwrap();
            let printed = series.not_finite().map(|seen| seen.note());
            let expected = "field `u` is not finite at 1 point at t = 0.5 s";
            match t {
                0.0 => assert_eq!(printed, None),
                _ => assert!(printed.unwrap().starts_with(expected)),
            }
        }
    }
}
