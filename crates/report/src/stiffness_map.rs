//! Maps of the sensitivity to the stiffness: a table, pictures, and a file for ParaView.

use anyhow::Context;
use myovib_fem::Space;
use myovib_scene::json;
use myovib_scene::result_folder::ResultFolder;
use myovib_scene::sensitivity::StiffnessMap;
use myovib_scene::vtu::{self, CellField, Grid};
use serde_json::Value;

use crate::outline::outline;
use crate::plot::{Axis, Field, Figure, MeshPlot, Panel, SurfacePlot};
use crate::spatial;
use crate::table::{Align, Table, colored_stdout};

/// Name of the schema of the JSON document.
pub const SCHEMA: &str = "stiffness-map";

/// Returns the sensitivity of each output to the stiffness of the whole body, followed by notes, as text.
pub fn text(map: &StiffnessMap) -> String {
    let mut table = Table::new(&[
        ("output", Align::Left),
        ("relative change of RMS per relative change of stiffness", Align::Right),
    ]);
    for output in &map.outputs {
        let total = output.total();
        let shown = match total.is_finite() {
            // Adding 0.0 avoids a negative zero.
            true => format!("{:.3e}", total + 0.0),
            false => "– (always zero)".to_owned(),
        };
        table.row([output.name.clone(), shown].map(Into::into));
    }
    let mut text = table.render(colored_stdout());
    if !map.omitted.is_empty() {
        text += &format!(
            "excluded, since they are not displacements or velocities: {}\n",
            map.omitted.join(", ")
        );
    }
    text
}

/// Files written by [`write()`].
pub const FILES: [&str; 3] = ["stiffness.vtu", "stiffness.svg", "stiffness.json"];

/// Writes `stiffness.vtu`, `stiffness.json` and, unless all maps are zero, `stiffness.svg`. Returns the paths of all
/// files except the JSON file, and the content of the JSON file.
pub fn write(folder: &ResultFolder, map: &StiffnessMap) -> anyhow::Result<(Vec<String>, Value)> {
    let body = map.scene.body.as_ref().context("the scene has no body")?;
    let space = body.muscle.solid.space();
    let densities = map.densities()?;
    let of_elements = vtu::of_elements(space, &Grid::of_body(body), &densities);
    // A map that is zero everywhere is not drawn.
    let seen = |own: &&CellField| own.values.iter().any(|(_, value)| value.abs() > 0.0);
    let panels = densities.iter().filter(seen);
    let panels: Vec<_> = panels.map(|density| panel(space, density)).collect();
    let mut texts = vec![("stiffness.vtu", of_elements)];
    if !panels.is_empty() {
        let figure = Figure::column("Sensitivity of the outputs to the stiffness", panels);
        texts.push(("stiffness.svg", figure.render()));
    }
    let mut files = Vec::new();
    for (name, text) in texts {
        folder.write(name, text)?;
        files.push(folder.path().join(name).display().to_string());
    }
    let document = map.document();
    let text = json::document(SCHEMA, &document)?;
    folder.write("stiffness.json", text)?;
    Ok((files, document))
}

fn panel(space: &Space, density: &CellField) -> Box<dyn Panel> {
    let title = format!("{}: change by stiffness", density.name);
    let values = at_nodes(space, density);
    // Zero is in the middle of the color scale.
    let largest = values.iter().fold(0.0_f64, |max, value| max.max(value.abs()));
    let field = Field { axis: Axis::default().between(-largest, largest), values };
    if space.dimension() == 3 {
        return Box::new(SurfacePlot {
            title,
            ..spatial::field_plot(space, space.node_points::<3>(), &field)
        });
    }
    Box::new(MeshPlot { title, field: Some(field), ..outline(space) })
}

/// Returns, for each node, the mean over the adjacent elements, weighted by their area or volume.
fn at_nodes(space: &Space, density: &CellField) -> Vec<f64> {
    let mut sums = vec![[0.0; 2]; space.n_nodes()];
    for &(element, value) in &density.values {
        let measure = space.measure_of(element);
        for &node in space.element_nodes(element) {
            sums[node][0] += measure * value;
            sums[node][1] += measure;
        }
    }
    sums.iter().map(|[sum, measure]| sum / measure).collect()
}

#[cfg(test)]
mod tests {
    use myovib_scene::Scene;
    use myovib_scene::watch::Watcher;

    use std::path::Path;

    use myovib_scene::result_folder::FolderRequest;

    use super::*;

    /// Checks in 2D and 3D that no picture is drawn for a probe on a prescribed support, because its value does not
    /// depend on the stiffness.
    #[test]
    fn a_map_of_zeros_has_no_picture() {
        for (mesh, at) in [
            ("type = \"rectangle\"\nwidth = 1.0\nheight = 1.0\ncells = [1, 1]", "1.0, 1.0"),
            ("type = \"box\"\nsize = [1.0, 1.0, 1.0]\ncells = [1, 1, 1]", "1.0, 1.0, 1.0"),
        ] {
            let text = format!(
                "[time]\nend = 0.01\n[mesh]\n{mesh}\n[solid]\nbulk_modulus = 1e5\n[[material]]\nlaw = \"mooney-rivlin\"\n\
                 density = 1e3\nc10 = 1e4\n[[fixed]]\ngroup = \"left\"\n[[prescribed_displacement]]\ngroup = \"right\"\n\
                 x = {{ type = \"step\", value = 0.01, rise = 0.01 }}\n[[probe]]\nname = \"end\"\ntype = \"point\"\n\
                 at = [{at}]\nquantities = [\"u\"]\ninterval = 0.005\n[[output]]\nname = \"end\"\nprobe = \"end\"\n\
                 column = \"u_x\"\n"
            );
            let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
            let map = StiffnessMap::of(&scene, Watcher::NOBODY).unwrap();
            assert!(map.outputs[0].elements.iter().all(|e| *e == 0.0), "{map:?}");
            let folder = tempfile::tempdir().unwrap();
            let request = FolderRequest::to_add(folder.path(), "sensitivity", Vec::new());
            let (files, _) = write(&request.open().unwrap(), &map).unwrap();
            assert_eq!(files.len(), 1, "{files:?}");
        }
    }

    /// Checks two halves of a square with the values 1 and 4. The nodes on the diagonal have the mean of these values,
    /// the other corners the value of their half.
    #[test]
    fn nodes_have_the_mean_of_adjacent_elements() {
        let mesh = myovib_fem::generate::rectangle([0.0; 2], [1.0, 1.0], [1, 1]).unwrap();
        let space = Space::taylor_hood(&mesh);
        let density = CellField { name: "u".to_owned(), values: vec![(0, 1.0), (1, 4.0)] };
        for (node, value) in at_nodes(&space, &density).into_iter().enumerate() {
            let has = |element| space.element_nodes(element).contains(&node);
            let expected = match [has(0), has(1)] {
                [true, true] => 2.5,
                [true, false] => 1.0,
                _ => 4.0,
            };
            assert_eq!(value, expected, "node {node}");
        }
    }
}
