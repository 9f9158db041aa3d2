//! Fields on the mesh as VTK files for ParaView: one VTU per time and a PVD that lists them.

use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

use myovib_fem::space::Degree;
use myovib_fem::{Located, Pressure, Space};
use myovib_model::{Quantity, Snapshot};

use crate::atomic_file;

/// VTK's number for the elements; their nodes are ordered as ours.
fn cell_type(space: &Space) -> usize {
    match (space.dimension(), space.degree()) {
        (2, Degree::One) => 5,
        (2, Degree::Two) => 22,
        (_, Degree::One) => 10,
        (_, Degree::Two) => 24,
    }
}

/// The components of a vector field at each node, with a third one in the plane.
fn vectors(space: &Space, field: &[f64]) -> Vec<Vec<f64>> {
    let vector = |components: &[f64]| {
        let mut vector = components.to_vec();
        vector.resize(3, 0.0);
        vector
    };
    field.chunks(space.dimension()).map(vector).collect()
}

/// The name of the list of a series.
pub const LIST: &str = "fields.pvd";

/// A numbered series of files in a folder.
#[derive(Debug)]
pub struct Series {
    folder: PathBuf,
    quantities: Vec<Quantity>,
    /// Times and names of the files written so far.
    entries: Vec<(f64, String)>,
}

impl Series {
    /// A series of `quantities` in `folder`, which exists. `done` are the times already there.
    pub fn new(folder: &Path, quantities: Vec<Quantity>, done: &[f64]) -> Self {
        let entries = done
            .iter()
            .enumerate()
            .map(|(i, &t)| (t, name(i)))
            .collect();
        Self {
            folder: folder.to_owned(),
            quantities,
            entries,
        }
    }

    /// Times of the files written so far, s.
    pub fn times(&self) -> impl Iterator<Item = f64> + '_ {
        self.entries.iter().map(|(t, _)| *t)
    }

    /// Writes the body at time `t`, then the list of all files; gives the number of states
    /// (det F, stress) that had to be computed.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn write(&mut self, t: f64, snapshot: &Snapshot<'_>) -> io::Result<u64> {
        let name = name(self.entries.len());
        let text = vtu(snapshot, &self.quantities);
        atomic_file::write(&self.folder.join(&name), |file| {
            file.write_all(text.as_bytes())
        })?;
        self.entries.push((t, name));
        let text = pvd(&self.entries);
        let path = self.folder.join(LIST);
        atomic_file::write(&path, |file| file.write_all(text.as_bytes()))?;
        let states = self.quantities.iter().filter(|q| q.needs_state()).count();
        Ok((states * 6 * snapshot.solid.space().n_elements()) as u64)
    }
}

fn name(i: usize) -> String {
    format!("fields_{i:05}.vtu")
}

/// Whether a file of this name is of a series.
pub fn is_of_a_series(name: &str) -> bool {
    let number = name
        .strip_prefix("fields_")
        .and_then(|rest| rest.strip_suffix(".vtu"));
    number.is_some_and(|number| number.len() >= 5 && number.bytes().all(|b| b.is_ascii_digit()))
}

fn pvd(entries: &[(f64, String)]) -> String {
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n",
    );
    for (t, name) in entries {
        text += &format!("<DataSet timestep=\"{t}\" part=\"0\" file=\"{name}\"/>\n");
    }
    text + "</Collection>\n</VTKFile>\n"
}

fn vtu(snapshot: &Snapshot<'_>, quantities: &[Quantity]) -> String {
    let space = snapshot.solid.space();
    let (n_nodes, n_cells) = (space.n_nodes(), space.n_elements());
    let n_cell_nodes = space.mesh().shape().n_nodes(space.degree());
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\">\n\
         <UnstructuredGrid>\n\
         <Piece NumberOfPoints=\"{n_nodes}\" NumberOfCells=\"{n_cells}\">\n<Points>\n"
    );
    let points = vectors(space, space.coordinates());
    array(&mut text, "points", 3, points.into_iter());
    text += "</Points>\n<Cells>\n";
    let cells = (0..n_cells).map(|e| space.element_nodes(e).to_vec());
    integers(&mut text, "connectivity", cells);
    integers(
        &mut text,
        "offsets",
        (1..=n_cells).map(|e| vec![n_cell_nodes * e]),
    );
    integers(
        &mut text,
        "types",
        (0..n_cells).map(|_| vec![cell_type(space)]),
    );
    text += "</Cells>\n<PointData>\n";
    for &quantity in quantities {
        let values = nodal(snapshot, space, quantity);
        let width = values.first().map_or(1, Vec::len);
        array(&mut text, label(quantity), width, values.into_iter());
    }
    text + "</PointData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n"
}

fn label(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Displacement => "displacement",
        Quantity::Velocity => "velocity",
        Quantity::Pressure => "pressure",
        Quantity::VolumeRatio => "J",
        Quantity::Stress => "stress",
        Quantity::VonMises => "von_mises",
    }
}

/// Values at all nodes: exact for displacement, velocity and pressure; averaged over the elements
/// at a node for what jumps between them.
pub fn nodal(snapshot: &Snapshot<'_>, space: &Space, quantity: Quantity) -> Vec<Vec<f64>> {
    match (quantity, snapshot.pressure) {
        (Quantity::Displacement, _) => return vectors(space, snapshot.displacement),
        (Quantity::Velocity, _) => return vectors(space, snapshot.velocity),
        _ => {}
    }
    let continuous =
        matches!(snapshot.pressure, Pressure::Nodal(_)) && quantity == Quantity::Pressure;
    let mut sums = vec![vec![0.0; quantity.components(space.dimension()).len()]; space.n_nodes()];
    let mut counts = vec![0.0_f64; space.n_nodes()];
    let nodes = space.mesh().shape().nodes(space.degree());
    for element in 0..space.n_elements() {
        for (&node, &barycentric) in space.element_nodes(element).iter().zip(&nodes) {
            if continuous && counts[node] > 0.0 {
                continue;
            }
            let values = snapshot.at(
                &Located {
                    element,
                    barycentric,
                },
                quantity,
            );
            for (sum, value) in sums[node].iter_mut().zip(values) {
                *sum += value;
            }
            counts[node] += 1.0;
        }
    }
    for (sum, count) in sums.iter_mut().zip(counts) {
        sum.iter_mut().for_each(|value| *value /= count);
    }
    sums
}

fn array(text: &mut String, name: &str, width: usize, rows: impl Iterator<Item = Vec<f64>>) {
    *text += &format!(
        "<DataArray type=\"Float64\" Name=\"{name}\" NumberOfComponents=\"{width}\" format=\"ascii\">\n"
    );
    for row in rows {
        for value in row {
            // Nine digits draw any picture; the exact values are the probes' business.
            write!(text, "{value:.9e} ").expect("writing to a string does not fail");
        }
        text.push('\n');
    }
    *text += "</DataArray>\n";
}

fn integers(text: &mut String, name: &str, rows: impl Iterator<Item = Vec<usize>>) {
    *text += &format!("<DataArray type=\"Int64\" Name=\"{name}\" format=\"ascii\">\n");
    for row in rows {
        for value in row {
            write!(text, "{value} ").expect("writing to a string does not fail");
        }
        text.push('\n');
    }
    *text += "</DataArray>\n";
}
