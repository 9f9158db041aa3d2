//! Benchmarks of the residual, the tangents, the factorization and the solve on the paper's mesh, and of one second of
//! simulation for rows of Table 2. Run them with `cargo bench`.
#![allow(clippy::unwrap_used, reason = "a bench is a test")]

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use myovib_dae::Problem;
use myovib_fem::Mesh;
use myovib_model::linear::{Condensation, Condensed, LinearWork};
use myovib_model::{Field, Formulation, MuscleDae, Settings, ida, paper, run, start_at_rest};
use myovib_sparse::supernodal::Supernodal;

/// Rows 1, 2m, 3m and (31), each with its formulation, κ, β, and the blocks excluded from the error test.
const ROWS: [(&str, Formulation, f64, f64, &[Field]); 4] = [
    ("1", Formulation::Position, 1e5, 0.0, &[Field::Pressure]),
    ("2m", Formulation::Rate, 1e5, 1e-4, &[Field::Pressure, Field::PressureRate]),
    ("3m", Formulation::Rate, f64::INFINITY, 1e-4, &[Field::Pressure, Field::PressureRate]),
    ("31", Formulation::Velocity, f64::INFINITY, 0.0, &[Field::Pressure]),
];

fn dae(formulation: Formulation, kappa: f64, beta: f64) -> MuscleDae {
    let mesh =
        Mesh::parse_msh(include_str!("../../../data/meshes/muscle.msh"), "muscle.msh").unwrap();
    MuscleDae::new(paper::muscle(&mesh, kappa, beta).unwrap(), formulation).unwrap()
}

/// Returns an arbitrary state with small strain. The cost does not depend on the state.
fn state(n: usize, size: f64) -> Vec<f64> {
    (0..n).map(|i| size * (i as f64).sin()).collect()
}

fn kernels(criterion: &mut Criterion) {
    for (row, formulation, kappa, beta, _) in ROWS {
        let mut dae = dae(formulation, kappa, beta);
        let n = dae.n_unknowns();
        let (y, y_dot, mut out) = (state(n, 1e-6), state(n, 1e-5), vec![0.0; n]);
        let mut group = criterion.benchmark_group(format!("row {row}"));
        group.bench_function("residual", |b| {
            b.iter(|| dae.residual(0.5, black_box(&y), &y_dot, &mut out).unwrap());
        });
        group.bench_function("tangents", |b| {
            b.iter(|| dae.update_matrices(0.5, black_box(&y), &y_dot).unwrap());
        });
        let settings = Settings::paper(formulation);
        let plan = Arc::new(Condensation::new(&dae));
        let elimination = plan.elimination(ida::options(&dae, &settings).sparse).unwrap();
        let analysis = Arc::clone(elimination.analysis().expect("no engine is installed"));
        let mut matrix = Condensed::<f64>::new(plan, Arc::new(elimination));
        let mut work = LinearWork::default();
        group.bench_function("sum and factor", |b| {
            b.iter(|| matrix.set_up(1e3, |m| dae.matrix_values(m), &mut work).unwrap());
        });
        let narrow: Vec<_> = analysis.supernodes().filter(|(k, _)| *k == 2).collect();
        let rows: usize = narrow.iter().map(|(_, rows)| rows).sum();
        println!(
            "row {row}/supernodes: {}, of two columns {}, with {:.1} rows in the mean",
            analysis.supernodes().count(),
            narrow.len(),
            rows as f64 / narrow.len() as f64
        );
        let mut blocks = Supernodal::new(Arc::clone(&analysis));
        blocks.factor(matrix.values()).unwrap();
        let mut x = vec![1.0; analysis.n()];
        group.bench_function("triangles", |b| {
            b.iter(|| {
                x.fill(1.0);
                blocks.solve(black_box(&mut x));
            });
        });
        let mut x = out.clone();
        group.bench_function("solve", |b| {
            b.iter(|| {
                x.copy_from_slice(&out);
                matrix.solve(black_box(&mut x), &mut work).unwrap();
            });
        });
        group.finish();
    }
}

fn rows(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("one second");
    group.sample_size(10);
    for (row, formulation, kappa, beta, suppressed) in ROWS {
        let settings = Settings {
            t_end: 1.0,
            suppressed: suppressed.to_vec(),
            ..Settings::paper(formulation)
        };
        group.bench_function(row, |b| {
            b.iter(|| {
                let dae = dae(formulation, kappa, beta);
                let mut integrator = start_at_rest(dae, &settings).unwrap();
                run(integrator.as_mut(), &mut []).unwrap()
            });
        });
    }
    group.finish();
}

criterion_group!(all, kernels, rows);
criterion_main!(all);
