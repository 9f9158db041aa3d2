//! What the integration tests share: meshes, random fields, a dense Newton solver.

use std::sync::Arc;

use myovib_fem::material::Law;
use myovib_fem::solid::{Fields, Pressure, Solid, Tangents, Vectors};
use myovib_fem::{DofMap, Mesh, Space};
use nalgebra::{DMatrix, DVector};
use nalgebra_sparse::pattern::SparsityPattern;
use rand::{Rng, SeedableRng, rngs::StdRng};

pub(crate) const MUSCLE_LAW: Law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
pub(crate) const SMALL_LAW: Law = Law::SmallStrain {
    shear_modulus: 2.04e4,
};
pub(crate) const DENSITY: f64 = 1.1e3;

pub(crate) fn muscle_mesh() -> Mesh {
    Mesh::read_msh(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../data/meshes/muscle.msh"
    ))
    .unwrap()
}

pub(crate) fn clamped(space: Space, group: &str, law: Law) -> Solid {
    let dofs = DofMap::clamped(&space, &space.nodes_of(group).unwrap()).unwrap();
    Solid::uniform(Arc::new(space), dofs, law, DENSITY).unwrap()
}

/// Uniform random numbers in ±size, the same each time.
pub(crate) fn random(n: usize, size: f64, seed: u64) -> Vec<f64> {
    let mut rng = StdRng::seed_from_u64(seed);
    (0..n).map(|_| rng.random_range(-size..size)).collect()
}

pub(crate) fn dense(pattern: &SparsityPattern, values: &[f64]) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(pattern.minor_dim(), pattern.major_dim());
    for ((column, row), value) in pattern.entries().zip(values) {
        matrix[(row, column)] += value;
    }
    matrix
}

/// Static equilibrium force(u, p) = load, p/κ + (J − 1) = 0, by Newton's method; `inv_kappa` = 0
/// is the incompressible case. Starts from `u` (whose constrained entries it keeps) and `p`.
/// Returns the number of iterations.
pub(crate) fn equilibrium(
    solid: &Solid,
    load: &[f64],
    inv_kappa: f64,
    u: &mut [f64],
    p: &mut [f64],
) -> usize {
    let (n, m) = (solid.dofs().n_free(), p.len());
    let mass = dense(solid.pressure_pattern(), solid.pressure_mass_values());
    let mut stiffness = vec![0.0; solid.displacement_pattern().nnz()];
    let mut divergence = vec![0.0; solid.divergence_pattern().nnz()];
    let (mut force, mut defect) = (vec![0.0; u.len()], vec![0.0; m]);
    let mut free = vec![0.0; n];
    for iteration in 1..30 {
        let fields = Fields::new(u, Pressure::Nodal(p));
        let mut vectors = Vectors {
            force: Some(&mut force),
            defect: Some(&mut defect),
            ..Default::default()
        };
        solid.evaluate(&fields, &mut vectors).unwrap();
        let mut tangents = Tangents {
            stiffness: Some(&mut stiffness),
            divergence: Some(&mut divergence),
            ..Default::default()
        };
        solid.tangents(&fields, &mut tangents).unwrap();
        let imbalance: Vec<f64> = force.iter().zip(load).map(|(f, g)| f - g).collect();
        solid.dofs().restrict(&imbalance, &mut free);
        let mut matrix = DMatrix::zeros(n + m, n + m);
        let b = dense(solid.divergence_pattern(), &divergence);
        matrix
            .view_mut((0, 0), (n, n))
            .copy_from(&dense(solid.displacement_pattern(), &stiffness));
        matrix.view_mut((0, n), (n, m)).copy_from(&-b.transpose());
        matrix.view_mut((n, 0), (m, n)).copy_from(&b);
        matrix
            .view_mut((n, n), (m, m))
            .copy_from(&(&mass * inv_kappa));
        let constraint =
            &mass * DVector::from_column_slice(p) * inv_kappa + DVector::from_column_slice(&defect);
        let mut right = DVector::zeros(n + m);
        right
            .rows_mut(0, n)
            .copy_from(&DVector::from_column_slice(&free));
        right.rows_mut(n, m).copy_from(&constraint);
        let step = matrix.lu().solve(&right).unwrap();
        for (i, &full) in solid.dofs().free_to_full().iter().enumerate() {
            u[full] -= step[i];
        }
        for k in 0..m {
            p[k] -= step[n + k];
        }
        let size = u.iter().fold(0.0, |s: f64, x| s.max(x.abs()));
        let change = (0..n).fold(0.0, |s: f64, i| s.max(step[i].abs()));
        if change <= 1e-10 * size {
            return iteration;
        }
    }
    panic!("Newton's method does not converge");
}
