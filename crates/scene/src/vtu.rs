//! Fields on the mesh as VTK files for ParaView: one VTU per time and a PVD that lists them.

mod cloud;
mod data;
mod grid;
mod listing;

use std::io;
use std::path::{Path, PathBuf};

use myovib_fem::Space;
use myovib_fem::space::Degree;
use myovib_model::{Components, Quantity, Snapshot};
use serde::{Deserialize, Serialize};

pub use cloud::Cloud;
use data::{floats, integers};
pub use grid::Grid;
use listing::Listing;
pub use listing::is_of_a_series;

/// VTK's number for the elements; their nodes are ordered as ours.
fn cell_type(space: &Space) -> usize {
    match (space.dimension(), space.degree()) {
        (2, Degree::One) => 5,
        (2, Degree::Two) => 22,
        (_, Degree::One) => 10,
        (_, Degree::Two) => 24,
    }
}

/// The name of the list of the fields on the mesh.
pub const LIST: &str = "fields.pvd";
/// The name of the list of the numbers at places of chains.
pub const PLACES_LIST: &str = "places.pvd";

/// A number for each of some elements.
#[derive(Debug, Clone, PartialEq)]
pub struct CellField {
    /// Name of the field.
    pub name: String,
    /// Elements with their values; not a number elsewhere.
    pub values: Vec<(usize, f64)>,
}

/// The numbers of a field in the text of a file, not a number where there is none.
pub fn field_of(text: &str, name: &str) -> Option<Vec<f64>> {
    data::read_floats(text, name)
}

/// A numbered series of files in a folder.
#[derive(Debug)]
pub struct Series {
    listing: Listing,
    grid: Grid,
    quantities: Vec<Quantity>,
    not_finite: Option<NotFinite>,
}

/// Values of a field that are infinite or no numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NotFinite {
    quantity: Quantity,
    /// When they were seen first, s.
    t: f64,
    points: usize,
}

impl NotFinite {
    /// What to say of them.
    pub fn note(&self) -> String {
        let Self {
            quantity,
            t,
            points,
        } = self;
        let points = match points {
            1 => "1 point".to_owned(),
            n => format!("{n} points"),
        };
        format!(
            "field `{}` is not finite at {points} at t = {t} s: the tissue is deformed there beyond what its law is \
             defined for; the field `J` shows where",
            quantity.label()
        )
    }
}

impl Series {
    /// A series of `quantities` in `folder`, which exists. `done` are the times already there.
    pub fn new(folder: &Path, grid: Grid, quantities: Vec<Quantity>, done: &[f64]) -> Self {
        Self {
            listing: Listing::new(folder, listing::FIELDS, done),
            grid,
            quantities,
            not_finite: None,
        }
    }

    /// The series, in whose earlier files these values were seen.
    #[must_use]
    pub fn with_seen(self, not_finite: Option<NotFinite>) -> Self {
        Self { not_finite, ..self }
    }

    /// Values that are not finite, if there were any: the first that were seen.
    pub fn not_finite(&self) -> Option<NotFinite> {
        self.not_finite
    }

    /// Times of the files written so far, s.
    pub fn times(&self) -> impl Iterator<Item = f64> + '_ {
        self.listing.times()
    }

    /// Whether a stress is among the fields.
    pub fn has_stress(&self) -> bool {
        self.quantities.iter().any(|own| own.is_of_stress())
    }

    /// A file of those written so far that is no longer there, or empty.
    pub fn missing(&self) -> Option<PathBuf> {
        self.listing.missing()
    }

    /// Writes the body at time `t` with numbers of some elements, then the list of all files; gives the
    /// number of states (det F, stress) that had to be computed.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn write(
        &mut self,
        t: f64,
        snapshot: &Snapshot<'_>,
        cells: &[CellField],
    ) -> io::Result<u64> {
        let (text, not_finite) = vtu(snapshot, &self.grid, &self.quantities, cells);
        self.listing.add(t, &text)?;
        self.not_finite = self
            .not_finite
            .or(not_finite.map(|(quantity, points)| NotFinite {
                quantity,
                t,
                points,
            }));
        let states = self.quantities.iter().filter(|q| q.needs_state()).count();
        Ok((states * self.grid.n_evaluations()) as u64)
    }
}

/// Time and nodal displacement (three components each, by node) of the last file of a folder;
/// nothing if there is none, or its files have no displacement.
///
/// # Errors
/// Those of the file system, and files that are not of this grid.
pub fn last_displacement(folder: &Path, grid: &Grid) -> io::Result<Option<(f64, Vec<[f64; 3]>)>> {
    let list = match std::fs::read_to_string(folder.join(LIST)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        list => list?,
    };
    let value = |line: &str, key: &str| -> Option<String> {
        let (_, rest) = line.split_once(&format!("{key}=\""))?;
        Some(rest.split_once('"')?.0.to_owned())
    };
    let last = list.lines().rev().find_map(|line| {
        let t: f64 = value(line, "timestep")?.parse().ok()?;
        Some((t, value(line, "file")?))
    });
    let Some((t, file)) = last else {
        return Ok(None);
    };
    let text = std::fs::read_to_string(folder.join(file))?;
    let Some(values) = data::read_floats(&text, Quantity::Displacement.label()) else {
        return Ok(None);
    };
    let vectors = values.as_chunks::<3>().0;
    if vectors.len() != grid.n_points() {
        let message = "the fields are not those of this mesh";
        return Err(io::Error::new(io::ErrorKind::InvalidData, message));
    }
    let n_nodes = grid.nodes.iter().max().map_or(0, |last| last + 1);
    let mut displacement = vec![[0.0; 3]; n_nodes];
    for (&node, vector) in grid.nodes.iter().zip(vectors) {
        displacement[node] = *vector;
    }
    Ok(Some((t, displacement)))
}

/// A time's file, and the first quantity that is not finite at so many points.
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
        let strange = values
            .iter()
            .filter(|row| row.iter().any(|x| !x.is_finite()));
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

/// The text of a file of the body at rest with numbers of its elements.
pub fn of_elements(space: &Space, grid: &Grid, cells: &[CellField]) -> String {
    file(space, grid, "", cells)
}

/// A file: points at rest, cells, values at the points, regions and fibres of the cells, and numbers of theirs.
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
    if !grid.fibres.is_empty() {
        let values = grid.fibres.iter().copied().flatten();
        text += &floats("fibre", &["x", "y", "z"], 3, values);
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

/// The places of the file's components among the quantity's; a place beyond them is zero.
/// Symmetric tensors have six components in the order that ParaView expects, in the plane too.
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

    #[test]
    fn values_that_are_not_finite_are_told_with_their_first_time() {
        let text = "[time]\nend = 1.0\n[mesh]\ntype = \"rectangle\"\nwidth = 1.0\nheight = 1.0\ncells = [2, 2]\n\
                    [solid]\nkappa = 1e5\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
                    [[fixed]]\ngroup = \"left\"\n";
        let scene = Scene::build("scene.toml", text, &[], Path::new("")).unwrap();
        let body = scene.body.unwrap();
        let folder = tempfile::tempdir().unwrap();
        let quantities = vec![Quantity::Pressure, Quantity::Displacement];
        let mut series = Series::new(folder.path(), Grid::of_body(&body), quantities, &[]);
        let mut dae = MuscleDae::new(body.muscle, body.formulation).unwrap();
        let mut y = vec![0.0; dae.n_unknowns()];
        let own = dae.layout().range(Field::Displacement).unwrap();
        for (t, u) in [(0.0, 0.1), (0.5, f64::INFINITY), (1.0, f64::NAN)] {
            y[own.start] = u;
            let rest = vec![0.0; y.len()];
            series.write(t, &dae.snapshot(t, &y, &rest), &[]).unwrap();
            let said = series.not_finite().map(|seen| seen.note());
            let expected = "field `displacement` is not finite at 1 point at t = 0.5 s";
            match t {
                0.0 => assert_eq!(said, None),
                _ => assert!(said.unwrap().starts_with(expected)),
            }
        }
    }
}
