//! Pictures of the body: its mesh, materials, supports and loads.

use std::path::Path;

use myovib_fem::Group;
use myovib_scene::modes::Modes;
use myovib_scene::scene_file::Analysis;
use myovib_scene::{Body, Error, Scene, escape, vtu};
use serde_json::Value;

use super::data::PageData;
use super::frame::figure;
use super::{body, obstacles};
use crate::outline::{self, outline};
use crate::plot::{Color, EdgeGroup, Figure, MeshPlot, Region, SurfacePlot};
use crate::spatial;

/// Returns the view of the body, and pictures of its materials and of the last stored fields; empty for a scene without
/// a body. Without JavaScript, a picture of the deformed body replaces the interactive view.
pub(super) fn body(
    folder: &Path,
    scene: &Scene,
    modes: Option<&Modes>,
    data: &mut PageData,
) -> Result<String, Error> {
    let Some(body) = &scene.body else {
        return Ok(String::new());
    };
    let picture = match body.muscle.solid.space().dimension() {
        2 => plane(scene, body),
        _ => surface(scene, body),
    };
    let view = match modes.and_then(|modes| modes.muscles.first()) {
        Some(modes) => body::of_modes(scene, body, modes),
        None => body::of_run(folder, scene, body)?,
    };
    let number = data.body(view.document);
    let notes = view.notes.iter();
    let notes: String = notes.map(|note| format!("<p class=\"note\">{note}</p>\n")).collect();
    let mut pictures = displacement(folder, scene, body)?.into_iter();
    let deformed = pictures.next().unwrap_or_default();
    let section: String = pictures.collect();
    let picture = figure("Mesh, supports and loads", &picture, &[]);
    Ok(format!(
        "<h2>The body</h2>\n<div class=\"view\" data-body=\"{number}\">{deformed}</div>\n{notes}\
         <div class=\"beside\">\n{picture}{section}{}{}</div>\n",
        materials(scene, "wide"),
        contacts_and_points(scene)
    ))
}

/// Returns the groups that are fixed, moved, loaded, pressurized or in contact. For tractions, also returns which
/// components are given.
fn groups(scene: &Scene) -> Vec<(&str, Option<[f64; 2]>)> {
    let file = scene.file();
    let held = file.fixed.iter().map(|fixed| (&*fixed.group, None));
    let moved = file.prescribed_displacement.iter();
    let moved = moved.map(|moving| (&*moving.group, None));
    let loaded = file.traction.iter().map(|traction| {
        let harmonic = traction.response.as_ref();
        let [x, y] = [
            traction.x.is_some() || harmonic.is_some_and(|own| own.x.is_some()),
            traction.y.is_some() || harmonic.is_some_and(|own| own.y.is_some()),
        ];
        let direction = [x, y].map(|given| f64::from(u8::from(given)));
        (&*traction.group, Some(direction))
    });
    let pressed = file.surface_loads.all().into_iter();
    let pressed = pressed.map(|(_, load)| (load.group, None));
    let on_foundation = file.elastic_foundation.iter().map(|foundation| (&*foundation.group, None));
    let touched = file.contact.iter().map(|contact| (&*contact.group, None));
    let all = held.chain(moved).chain(on_foundation).chain(touched);
    let all = all.chain(loaded).chain(pressed);
    let mut once = Vec::new();
    for group in all {
        if !once.contains(&group) {
            once.push(group);
        }
    }
    once
}

/// Draws the surface of a 3D body with colored groups.
fn surface(scene: &Scene, body: &Body) -> String {
    let named = groups(scene).into_iter().enumerate();
    let groups: Vec<_> = named.map(|(i, (name, _))| (name, Color::of_series(i))).collect();
    let space = body.muscle.solid.space();
    let plot = SurfacePlot {
        obstacles: obstacles::outlines(scene, space),
        ..spatial::groups_plot(space, &groups)
    };
    Figure::of("Surface, supports and loads", plot).render()
}

/// Draws the deformed body at the last stored time, if the stored fields contain the displacement. A 3D body is drawn
/// as a surface and as a section.
fn displacement(folder: &Path, scene: &Scene, body: &Body) -> Result<Vec<String>, Error> {
    let space = body.muscle.solid.space();
    let last = vtu::last_displacement(folder, &vtu::Grid::of_body(body));
    let last = last.map_err(Error::file("read", &folder.join(vtu::LIST)))?;
    let Some((t, displacement)) = last else {
        return Ok(Vec::new());
    };
    let figures = match space.dimension() {
        2 => {
            let plot = outline::displacement_plot(space, &displacement);
            vec![("Deformed body", Figure::of("Deformed body", plot))]
        }
        _ => {
            let surface = spatial::displacement_plot(space, &displacement);
            let section = spatial::section_plot(space, &displacement);
            vec![
                ("Deformed surface", Figure::of("Deformed surface", surface)),
                ("Section", Figure::of("Section", section)),
            ]
        }
    };
    let when = match scene.file().analysis {
        Analysis::Static => String::new(),
        _ => format!(" at t = {t} s"),
    };
    let figures = figures.into_iter();
    Ok(figures
        .map(|(what, drawn)| figure(&format!("{what}{when}"), &drawn.render(), &[]))
        .collect())
}

fn plane(scene: &Scene, body: &Body) -> String {
    let space = body.muscle.solid.space();
    let named = groups(scene).into_iter().enumerate();
    let groups = named.filter_map(|(i, (name, arrows))| {
        let Ok(edges) = space.mesh().facets(name) else {
            return None;
        };
        let nodes = edges.into_iter().map(|edge| space.facet_nodes(edge));
        let edges = nodes.filter_map(|nodes| nodes.try_into().ok()).collect();
        Some(EdgeGroup { name: name.to_owned(), edges, color: Color::of_series(i), arrows })
    });
    let regions = scene.file().material.iter().enumerate();
    let regions = regions.filter_map(|(i, material)| {
        let name = material.group.as_ref()?;
        match space.mesh().group_of_dimension(name, 2) {
            Ok(Group::Elements(members)) => {
                Some(Region { triangles: members.clone(), color: Color::of_material(i) })
            }
            _ => None,
        }
    });
    let outlines = obstacles::outlines(scene, space).into_iter();
    let outlines = outlines.map(|line| line.iter().map(|&[x, y, _]| [x, y]).collect());
    let plot = MeshPlot {
        obstacles: outlines.collect(),
        groups: groups.collect(),
        regions: regions.collect(),
        ..outline(space)
    };
    Figure::of("Mesh, supports and loads", plot).render()
}

/// Formats a value in the scene.
fn written(value: &Value) -> String {
    match value {
        Value::Object(members) => {
            let given = members.iter().filter(|(_, value)| !value.is_null());
            let given = given.map(|(key, value)| format!("{key} = {}", written(value)));
            format!("{{ {} }}", given.collect::<Vec<_>>().join(", "))
        }
        Value::String(word) => word.clone(),
        Value::Array(entries) => {
            let entries: Vec<String> = entries.iter().map(written).collect();
            format!("[{}]", entries.join(", "))
        }
        // Prints 200.0 as 200.
        Value::Number(number) => number.as_f64().map_or(number.to_string(), |x| x.to_string()),
        value => value.to_string(),
    }
}

/// Lists the keys of a table with their values, except for the keys in `others`.
fn listed(table: &serde_json::Map<String, Value>, others: &[&str]) -> String {
    let words = table.iter().filter_map(|(key, value)| match value {
        _ if others.contains(&&**key) => None,
        Value::Null => None,
        value => Some(format!("{} = {}", escape(key), escape(&written(value)))),
    });
    words.collect::<Vec<_>>().join(", ")
}

/// Returns a table of contacts, springs and point forces, if there are any.
fn contacts_and_points(scene: &Scene) -> String {
    let file = scene.file();
    let all = [
        ("contact", serde_json::to_value(&file.contact)),
        ("spring", serde_json::to_value(&file.spring)),
        ("point force", serde_json::to_value(&file.point_force)),
    ];
    let rows = all.iter().flat_map(|(kind, tables)| {
        let tables = tables.iter().filter_map(Value::as_array).flatten();
        let tables = tables.filter_map(Value::as_object);
        tables
            .map(move |table| format!("<tr><td>{kind}</td><td>{}</td></tr>\n", listed(table, &[])))
    });
    let rows: String = rows.collect();
    match rows.is_empty() {
        true => rows,
        false => format!(
            "<div class=\"wide\"><table class=\"materials\"><tr><th>acts on the body</th><th>values, SI</th></tr>\n\
             {rows}</table></div>\n"
        ),
    }
}

/// Returns a table of materials and their constants, in an HTML element of the class `class`.
fn materials(scene: &Scene, class: &str) -> String {
    let rows: String = scene
        .file()
        .material
        .iter()
        .enumerate()
        .map(|(i, material)| {
            let constants = match serde_json::to_value(material) {
                Ok(Value::Object(constants)) => constants,
                _ => serde_json::Map::new(),
            };
            format!(
                "<tr><td><span class=\"swatch\" style=\"background:{}\"></span>{}</td><td>{}</td>\
                 <td>{}</td></tr>\n",
                Color::of_material(i),
                escape(material.group.as_deref().unwrap_or("everywhere")),
                escape(constants.get("law").and_then(Value::as_str).unwrap_or("")),
                listed(&constants, &["group", "law"])
            )
        })
        .collect();
    format!(
        "<div class=\"{class}\"><table class=\"materials\"><tr><th>material</th><th>law</th><th>constants, SI</th></tr>\n\
         {rows}</table></div>\n"
    )
}
