//! A gallery of all figure types with artificial data, for visual inspection.
//!
//! `cargo run -p myovib --example plot_gallery -- out/gallery` writes SVG and PNG files there.

use std::f64::consts::TAU;
use std::fs;
use std::path::PathBuf;

use myovib_report::plot::heat_map::Cell;
use myovib_report::plot::{
    Axis, Color, ComplexPlane, EdgeGroup, Field, Figure, HeatMap, LinePlot, MeshPlot, Panel,
    Series, movie, raster,
};

fn main() -> anyhow::Result<()> {
    let folder = PathBuf::from(
        std::env::args()
            .nth(1)
            .unwrap_or_else(|| "out/gallery".into()),
    );
    fs::create_dir_all(&folder)?;
    for (name, figure) in [
        ("lines", lines()),
        ("work_precision", work_precision()),
        ("complex_plane", complex_planes()),
        ("mesh", Figure::of("Mesh and boundary", mesh(0.0, false))),
        (
            "field",
            Figure::of("Pressure on the deformed mesh", mesh(1.0, true)),
        ),
        ("heat_map", heat_map()),
    ] {
        let svg = figure.render();
        fs::write(folder.join(format!("{name}.svg")), &svg)?;
        fs::write(folder.join(format!("{name}.png")), raster::png(&svg, 1000)?)?;
    }
    let frames = (0..24).map(|i| {
        Ok(Figure::of(
            "",
            mesh((TAU * f64::from(i) / 24.0).sin(), true),
        ))
    });
    movie::write(fs::File::create(folder.join("mesh.gif"))?, frames, 600, 5)
}

fn lines() -> Figure {
    let t: Vec<f64> = (0..30_000).map(|i| 47.0 + f64::from(i) * 1e-4).collect();
    let wave = |amplitude: f64, phase: f64| -> Vec<f64> {
        t.iter()
            .map(|t| amplitude * (8.0 * TAU * t + phase).sin())
            .collect()
    };
    let time = || Axis::new("*t*", "s").between(47.0, 50.0);
    let displacement = LinePlot {
        x: time(),
        y: Axis::new("*u*_{y}(0, 0)", "m"),
        series: vec![
            Series::curve("κ = 10^{5} Pa", &t, &wave(6.5e-4, 0.0)),
            Series::curve("κ = ∞", &t, &wave(5.7e-4, 0.4)),
        ],
        ..LinePlot::default()
    };
    let pressure = LinePlot {
        x: time(),
        y: Axis::new("*p*(0, 0)", "Pa"),
        series: vec![Series::curve("", &t, &wave(19.8, 0.0))],
        ..LinePlot::default()
    };
    Figure::column(
        "Two curves over time",
        vec![Box::new(displacement), Box::new(pressure)],
    )
}

fn work_precision() -> Figure {
    let tolerances: Vec<f64> = (2..9).map(|k| 10_f64.powi(-k)).collect();
    let errors =
        |factor: f64| -> Vec<f64> { tolerances.iter().map(|t| factor * t.powf(0.9)).collect() };
    let work = |order: f64| -> Vec<f64> {
        tolerances
            .iter()
            .map(|t| 0.2 * t.powf(-1.0 / order))
            .collect()
    };
    let series = [
        ("BDF 2", 1.0, 3.0),
        ("BDF 5", 3.0, 5.0),
        ("Radau IIA", 0.1, 4.5),
    ];
    let plot = LinePlot {
        title: "Work and precision".into(),
        x: Axis::new("relative error", "").logarithmic(),
        y: Axis::new("CPU time", "s").logarithmic(),
        series: series
            .map(|(name, factor, order)| {
                Series::curve(name, &errors(factor), &work(order)).marked()
            })
            .to_vec(),
    };
    Figure::of("Work and precision", plot)
}

fn complex_planes() -> Figure {
    let panel = |spread: f64, t: f64| {
        let angle = |i: u32| t + spread * (f64::from(i) / 19.0 - 0.5);
        let points = (0..20).map(|i| [2.0 * angle(i).cos(), 2.0 * angle(i).sin()]);
        let points: Vec<[f64; 2]> = points.collect();
        let mean = |c: usize| points.iter().map(|p| p[c]).sum::<f64>() / 20.0;
        ComplexPlane {
            title: format!("*t* = {t} s"),
            labels: ["Re *r* e^{iθ}".into(), "Im *r* e^{iθ}".into()],
            centroid: [mean(0), mean(1)],
            points,
            points_name: "oscillators".into(),
            centroid_name: "Ψ".into(),
            radius: 2.6,
        }
    };
    let panels = [(0.2, 15.0), (5.0, 60.0), (1.5, 200.0), (0.1, 210.0)];
    let panels: Vec<Box<dyn Panel>> = panels
        .into_iter()
        .map(|(s, t)| Box::new(panel(s, t)) as Box<dyn Panel>)
        .collect();
    Figure {
        n_columns: 2,
        ..Figure::column("Oscillators in the complex plane", panels)
    }
}

/// Returns a strip of 12 × 4 squares of two quadratic triangles each, thick in the middle.
fn mesh(load: f64, with_field: bool) -> MeshPlot {
    const NX: usize = 24;
    const NY: usize = 8;
    let index = |i: usize, j: usize| j * (NX + 1) + i;
    let node = |i: usize, j: usize| {
        let x = 0.2 * (i as f64 / NX as f64 - 0.5);
        let half = 0.012 + 0.018 * (TAU * x / 0.4).cos().powi(2);
        [x, half * (2.0 * j as f64 / NY as f64 - 1.0)]
    };
    let nodes: Vec<[f64; 2]> = (0..=NY)
        .flat_map(|j| (0..=NX).map(move |i| node(i, j)))
        .collect();
    let mut triangles = Vec::new();
    for j in (0..NY).step_by(2) {
        for i in (0..NX).step_by(2) {
            let at = |di: usize, dj: usize| index(i + di, j + dj);
            triangles.push([at(0, 0), at(2, 0), at(2, 2), at(1, 0), at(2, 1), at(1, 1)]);
            triangles.push([at(0, 0), at(2, 2), at(0, 2), at(1, 1), at(1, 2), at(0, 1)]);
        }
    }
    let end = |i: usize| {
        (0..NY)
            .step_by(2)
            .map(move |j| [index(i, j), index(i, j + 2), index(i, j + 1)])
    };
    let top = (10..14)
        .step_by(2)
        .map(|i| [index(i, NY), index(i + 2, NY), index(i + 1, NY)]);
    let bump = |x: f64| (TAU * x / 0.4).cos().powi(2);
    let u = |&[x, y]: &[f64; 2]| [-8e-3 * load * y, 6.5e-4 * load * bump(x)];
    MeshPlot {
        x: Axis::new("*x*", "m").between(-0.11, 0.11),
        y: Axis::new("*y*", "m").between(-0.045, 0.052),
        displacement: if with_field {
            nodes.iter().map(u).collect()
        } else {
            vec![]
        },
        scale: 20.0,
        groups: vec![
            EdgeGroup {
                name: "fixed".into(),
                edges: end(0).chain(end(NX)).collect(),
                color: Color::BLUE,
                arrows: None,
            },
            EdgeGroup {
                name: "load τ(*t*)".into(),
                edges: top.collect(),
                color: Color::VERMILION,
                arrows: Some([0.0, 1.0]),
            },
        ],
        marks: vec![(index(NX / 2, NY / 2), "origin".into())],
        field: with_field.then(|| Field {
            axis: Axis::new("*p*", "Pa").between(-25.0, 25.0),
            values: nodes
                .iter()
                .map(|[x, y]| 20.0 * load * bump(*x) * (1.0 + 10.0 * y))
                .collect(),
        }),
        nodes,
        triangles,
        ..MeshPlot::default()
    }
}

fn heat_map() -> Figure {
    let cell = |i: usize| Cell {
        category: Some(i % 4),
        text: (i % 4).to_string(),
    };
    let map = HeatMap {
        title: "Index".into(),
        column_label: "κ (Pa)".into(),
        columns: ["10³", "10⁵", "10⁷", "10⁹", "∞"].map(String::from).to_vec(),
        row_label: "β (s)".into(),
        rows: ["0", "10⁻⁶", "10⁻⁴"].map(String::from).to_vec(),
        cells: (0..15).map(cell).collect(),
        categories: [
            ("index 0", Color::SKY),
            ("index 1", Color::GREEN),
            ("index 2", Color::YELLOW),
            ("index 3", Color::VERMILION),
        ]
        .map(|(name, color)| (name.to_owned(), color))
        .to_vec(),
    };
    Figure::of("Index by κ and β", map)
}
