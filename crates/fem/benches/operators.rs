//! Benchmarks of the operators on the mesh of the paper: `cargo bench -p myovib-fem`.
//!
//! Each line shows the time of the fastest of many runs, in microseconds, and the ratio of this time to the time
//! of the residual pass.
#![allow(clippy::unwrap_used, reason = "benchmarks may panic")]

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use myovib_fem::quadrature::Rule;
use myovib_fem::solid::{Fields, Pressure, Solid, Tangents, Vectors};
use myovib_fem::{DofMap, Law, Mesh, Space};

/// Returns the time of the fastest of `REPEATS` runs, in microseconds.
fn fastest(mut run: impl FnMut()) -> f64 {
    const REPEATS: usize = 2000;
    let mut best = f64::INFINITY;
    for _ in 0..REPEATS {
        let start = Instant::now();
        run();
        best = best.min(start.elapsed().as_secs_f64());
    }
    1e6 * best
}

fn main() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/meshes/muscle.msh");
    let space = Arc::new(Space::taylor_hood(&Mesh::read_msh(path).unwrap()));
    let dofs = DofMap::clamped(&space, &space.nodes_of("fixed").unwrap()).unwrap();
    let law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
    let solid = Solid::uniform(space.clone(), dofs.clone(), law, 1.1e3).unwrap();
    let laws = vec![law; space.n_elements()];
    let rule = Rule::Degree2;
    let three_points = Solid::with_rule(space.clone(), dofs, laws, 1.1e3, rule).unwrap();

    let (n, m) = (space.n_components(), space.n_pressures());
    let wave = |n: usize, size: f64| (0..n).map(|i| size * (i as f64).sin()).collect::<Vec<_>>();
    let (u, v, p, p_rate, mu) =
        (wave(n, 1e-4), wave(n, 1e-2), wave(m, 20.0), wave(m, 100.0), wave(m, 100.0));
    let fields = Fields {
        u: &u,
        pressure: Pressure::Nodal(&p),
        v: Some(&v),
        p_rate: Some(&p_rate),
        mu: Some(&mu),
        factors: None,
    };
    let plain = Fields::new(&u, Pressure::Nodal(&p));
    let mut a = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
    let mut b = [vec![0.0; m], vec![0.0; m]];
    let [force, force_rate, multiplier_force] = &mut a;
    let [volume_residual, volume_residual_rate] = &mut b;
    let nnz = solid.displacement_pattern().nnz();
    let mut k = [vec![0.0; nnz], vec![0.0; nnz], vec![0.0; nnz]];
    let [stiffness, rate_stiffness, multiplier_stiffness] = &mut k;
    let mut d = [0, 1].map(|_| vec![0.0; solid.divergence_pattern().nnz()]);
    let [divergence, divergence_rate] = &mut d;

    let residual = fastest(|| {
        let mut out = Vectors {
            force: Some(force),
            volume_residual: Some(volume_residual),
            ..Default::default()
        };
        solid.evaluate(black_box(&plain), &mut out).unwrap();
    });
    let report =
        |name: &str, time: f64| println!("{name:<42}{time:9.1} µs {:7.2}", time / residual);
    report("force, volume residual", residual);
    report(
        "force, volume residual, three points",
        fastest(|| {
            let mut out = Vectors {
                force: Some(force),
                volume_residual: Some(volume_residual),
                ..Default::default()
            };
            three_points.evaluate(black_box(&plain), &mut out).unwrap();
        }),
    );
    report(
        "force, force rate, volume residual",
        fastest(|| {
            let mut out = Vectors {
                force: Some(force),
                force_rate: Some(force_rate),
                volume_residual: Some(volume_residual),
                ..Default::default()
            };
            solid.evaluate(black_box(&fields), &mut out).unwrap();
        }),
    );
    report(
        "all five vectors",
        fastest(|| {
            let mut out = Vectors {
                force: Some(force),
                force_rate: Some(force_rate),
                volume_residual: Some(volume_residual),
                volume_residual_rate: Some(volume_residual_rate),
                multiplier_force: Some(multiplier_force),
            };
            solid.evaluate(black_box(&fields), &mut out).unwrap();
        }),
    );
    report("mass times vector", fastest(|| solid.apply_mass(black_box(&v), multiplier_force)));
    report(
        "stiffness, divergence",
        fastest(|| {
            let mut out = Tangents {
                stiffness: Some(stiffness),
                divergence: Some(divergence),
                ..Default::default()
            };
            solid.tangents(black_box(&plain), &mut out).unwrap();
        }),
    );
    report(
        "all five tangents",
        fastest(|| {
            let mut out = Tangents {
                stiffness: Some(stiffness),
                rate_stiffness: Some(rate_stiffness),
                divergence: Some(divergence),
                divergence_rate: Some(divergence_rate),
                multiplier_stiffness: Some(multiplier_stiffness),
                ..Tangents::default()
            };
            solid.tangents(black_box(&fields), &mut out).unwrap();
        }),
    );
}
