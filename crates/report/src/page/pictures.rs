//! The body: its mesh, materials, supports and loads.

use myovib_fem::Group;
use myovib_scene::{Body, Scene};
use serde_json::Value;

use crate::outline::outline;
use crate::plot::text::escape;
use crate::plot::{Colour, EdgeGroup, Figure, MeshPlot, Region};

/// The picture of the body beside its materials; nothing for a scene without one.
pub(super) fn body(scene: &Scene) -> String {
    let Some(body) = &scene.body else {
        return String::new();
    };
    let picture = match body.muscle.solid.space().dimension() {
        2 => figure("Mesh, supports and loads", &plane(scene, body)),
        _ => String::new(),
    };
    format!(
        "<h2>The body</h2>\n<div class=\"beside\">\n{picture}{}</div>\n",
        materials(scene)
    )
}

fn figure(caption: &str, svg: &str) -> String {
    format!("<figure><figcaption>{caption}</figcaption>\n{svg}</figure>\n")
}

fn plane(scene: &Scene, body: &Body) -> String {
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
    let regions = scene.file.material.iter().enumerate();
    let regions = regions.filter_map(|(i, material)| {
        let name = material.group.as_ref()?;
        match space.mesh().group(name) {
            Ok(Group::Elements(members)) => Some(Region {
                triangles: members.clone(),
                colour: shade(i),
            }),
            _ => None,
        }
    });
    let plot = MeshPlot {
        groups: groups.collect(),
        regions: regions.collect(),
        ..outline(space)
    };
    Figure::of("Mesh, supports and loads", plot).render()
}

/// The colour of a material: pale, so that the mesh is seen on it.
fn shade(i: usize) -> Colour {
    Colour::of_series(i).paler()
}

/// The materials and their constants.
fn materials(scene: &Scene) -> String {
    let rows: String = scene
        .file
        .material
        .iter()
        .enumerate()
        .map(|(i, material)| {
            let constants = match serde_json::to_value(material) {
                Ok(Value::Object(constants)) => constants,
                _ => serde_json::Map::new(),
            };
            let words = constants.iter().filter_map(|(key, value)| match value {
                _ if key == "group" || key == "law" => None,
                Value::Null => None,
                value => Some(format!("{} = {}", escape(key), escape(&value.to_string()))),
            });
            format!(
                "<tr><td><span class=\"swatch\" style=\"background:{}\"></span>{}</td><td>{}</td>\
                 <td>{}</td></tr>\n",
                shade(i),
                escape(material.group.as_deref().unwrap_or("everywhere")),
                escape(constants.get("law").and_then(Value::as_str).unwrap_or("")),
                words.collect::<Vec<_>>().join(", ")
            )
        })
        .collect();
    format!(
        "<div class=\"wide\"><table><tr><th>material</th><th>law</th><th>constants, SI</th></tr>\n\
         {rows}</table></div>\n"
    )
}
