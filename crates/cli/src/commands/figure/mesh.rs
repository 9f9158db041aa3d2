//! Figure 4: the finite element mesh and its boundary conditions.

use std::collections::BTreeSet;

use anyhow::Context;
use myovib_fem::{Mesh, Space};
use myovib_model::paper::{FIXED_GROUP, LOAD_GROUP};
use serde_json::json;

use super::product::Product;
use crate::exit::Exit;
use myovib_report::outline::outline;
use myovib_report::plot::{Color, EdgeGroup, Figure, MeshPlot};
use myovib_scene::Scene;

pub(super) fn draw(scene: &Scene) -> anyhow::Result<Product> {
    let body = scene.body.as_ref().context("the scene has no body")?;
    let space = body.muscle.solid.space();
    let plot = MeshPlot {
        groups: vec![fixed(space)?, loaded(space)?],
        marks: origin_of(space.mesh()).into_iter().collect(),
        ..outline(space)
    };
    let findings = vec![
        ("vertices", json!(space.n_pressures())),
        ("triangles", json!(space.n_elements())),
        ("displacement_nodes", json!(space.n_nodes())),
        ("unknowns_paper", json!(space.n_components() + space.n_pressures())),
    ];
    Ok(Product {
        number: 4,
        rows: edge_rows(space, &plot),
        figure: Figure::of("Finite element mesh and boundary conditions", plot),
        columns: ["x_1", "y_1", "x_2", "y_2", "fixed", "load"].map(String::from).into(),
        findings,
        run: json!({}),
        exit: Exit::Done,
    })
}

/// Returns the edges whose nodes are fixed.
pub(in crate::commands) fn fixed(space: &Space) -> anyhow::Result<EdgeGroup> {
    Ok(EdgeGroup {
        name: "fixed".into(),
        edges: edges(space, FIXED_GROUP)?,
        color: Color::BLUE,
        arrows: None,
    })
}

/// Returns the edges under the vertical load.
pub(super) fn loaded(space: &Space) -> anyhow::Result<EdgeGroup> {
    Ok(EdgeGroup {
        name: "load τ_{*y*}(*t*)".into(),
        edges: edges(space, LOAD_GROUP)?,
        color: Color::VERMILION,
        arrows: Some([0.0, 1.0]),
    })
}

fn edges(space: &Space, group: &str) -> anyhow::Result<Vec<[usize; 3]>> {
    let edges = space.mesh().edges(group)?;
    Ok(edges
        .iter()
        .map(|edge| {
            let nodes = space.facet_nodes(edge);
            [nodes[0], nodes[1], nodes[2]]
        })
        .collect())
}

fn origin_of(mesh: &Mesh) -> Option<(usize, String)> {
    let vertex = mesh.points().iter().position(|point| *point == [0.0, 0.0])?;
    Some((vertex, "(0, 0)".into()))
}

/// Returns the two ends of each edge, and whether the edge is fixed or loaded.
fn edge_rows(space: &Space, plot: &MeshPlot) -> Vec<Vec<f64>> {
    let mesh = space.mesh();
    let edges: BTreeSet<_> = mesh.elements().flat_map(|element| mesh.edges_of(element)).collect();
    let lies_in = |group: &EdgeGroup, [a, b]: [usize; 2]| {
        group.edges.iter().any(|&[p, q, _]| [p.min(q), p.max(q)] == [a, b])
    };
    let points = space.node_points::<2>();
    edges
        .into_iter()
        .map(|edge @ [a, b]| {
            let mut row = [points[a], points[b]].concat();
            row.extend(plot.groups.iter().map(|group| f64::from(lies_in(group, edge))));
            row
        })
        .collect()
}
