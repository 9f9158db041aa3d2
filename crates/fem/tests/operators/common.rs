//! Shared helper functions: meshes, random fields, equilibria by Newton's method with a sparse solver, and norms.

use std::sync::Arc;

use myovib_fem::element::TRIANGLE;
use myovib_fem::material::Law;
use myovib_fem::quadrature::Rule;
use myovib_fem::solid::{Fields, Pressure, Solid, Tangents, Vectors};
use myovib_fem::{DofMap, ElementPoint, Mesh, Space};
use myovib_sparse::SparseOptions;
use myovib_sparse::pivoting::{Factors, Symbolic};
use nalgebra::DMatrix;
use nalgebra_sparse::pattern::SparsityPattern;
use nalgebra_sparse::{CooMatrix, CscMatrix};
use rand::{Rng, SeedableRng, rngs::StdRng};

pub(crate) const MUSCLE_LAW: Law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
pub(crate) const SMALL_LAW: Law = Law::SmallStrain { shear_modulus: 2.04e4 };
pub(crate) const DENSITY: f64 = 1.1e3;

pub(crate) fn muscle_mesh() -> Mesh {
    Mesh::read_msh(concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/meshes/muscle.msh")).unwrap()
}

/// Returns a solid that has a single law and is clamped on a group.
pub(crate) fn clamped(space: Space, group: &str, law: Law) -> Solid {
    let dofs = DofMap::clamped(&space, &space.nodes_of(group).unwrap()).unwrap();
    Solid::uniform(Arc::new(space), dofs, law, DENSITY).unwrap()
}

/// Returns reproducible random numbers, uniform in ±size.
pub(crate) fn random(n: usize, size: f64, seed: u64) -> Vec<f64> {
    let mut rng = StdRng::seed_from_u64(seed);
    (0..n).map(|_| rng.random_range(-size..size)).collect()
}

/// Reads a file from `data/references`.
pub(crate) fn reference(name: &str) -> serde_json::Value {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/references");
    serde_json::from_str(&std::fs::read_to_string(format!("{folder}/{name}")).unwrap()).unwrap()
}

/// Returns the entries (row, column, value) of a sparse block.
fn entries<'a>(
    pattern: &'a SparsityPattern,
    values: &'a [f64],
) -> impl Iterator<Item = (usize, usize, f64)> + 'a {
    pattern.entries().zip(values).map(|((column, row), &value)| (row, column, value))
}

pub(crate) fn dense(pattern: &SparsityPattern, values: &[f64]) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(pattern.minor_dim(), pattern.major_dim());
    for (row, column, value) in entries(pattern, values) {
        matrix[(row, column)] += value;
    }
    matrix
}

/// Displacement at all nodes, and pressures.
pub(crate) struct Equilibrium {
    pub(crate) u: Vec<f64>,
    pub(crate) p: Vec<f64>,
}

/// Solves force(u, p) = load and p/κ + (J − 1) = 0 by Newton's method. The iteration starts from the given state
/// and keeps the constrained entries of this state. `inv_kappa` = 0 is the incompressible case. If the whole
/// boundary is fixed, `zero_mean` removes the constant pressure mode.
pub(crate) fn equilibrium(
    solid: &Solid,
    load: &[f64],
    inv_kappa: f64,
    zero_mean: bool,
    mut state: Equilibrium,
) -> Equilibrium {
    let (n, m) = (solid.dofs().n_free(), state.p.len());
    let size = n + m + usize::from(zero_mean);
    let mut stiffness = vec![0.0; solid.displacement_pattern().nnz()];
    let mut divergence = vec![0.0; solid.divergence_pattern().nnz()];
    let (mut force, mut volume_residual) = (vec![0.0; load.len()], vec![0.0; m]);
    let mut mass_p = vec![0.0; m];
    for _ in 0..20 {
        let fields = Fields::new(&state.u, Pressure::Nodal(&state.p));
        let vectors = Vectors {
            force: Some(&mut force),
            volume_residual: Some(&mut volume_residual),
            ..Vectors::default()
        };
        solid.evaluate(&fields, &mut { vectors }).unwrap();
        let tangents = Tangents {
            stiffness: Some(&mut stiffness),
            divergence: Some(&mut divergence),
            ..Tangents::default()
        };
        solid.tangents(&fields, &mut { tangents }).unwrap();
        solid.apply_compliance(&state.p, &mut mass_p);

        let mut matrix = CooMatrix::new(size, size);
        for (row, column, value) in entries(solid.displacement_pattern(), &stiffness) {
            matrix.push(row, column, value);
        }
        for (row, column, value) in entries(solid.divergence_pattern(), &divergence) {
            matrix.push(n + row, column, value);
            matrix.push(column, n + row, -value);
        }
        for (row, column, value) in entries(solid.pressure_pattern(), solid.pressure_mass_values())
        {
            matrix.push(n + row, n + column, inv_kappa * value);
        }
        let imbalance: Vec<f64> = force.iter().zip(load).map(|(f, g)| f - g).collect();
        let mut step = vec![0.0; size];
        solid.dofs().restrict(&imbalance, &mut step[..n]);
        for k in 0..m {
            step[n + k] = inv_kappa * mass_p[k] + volume_residual[k];
        }
        if zero_mean {
            for (k, &weight) in solid.pressure_weights().iter().enumerate() {
                matrix.push(n + m, n + k, weight);
                matrix.push(n + k, n + m, weight);
                step[n + m] += weight * state.p[k];
            }
        }
        let matrix = CscMatrix::from(&matrix);
        let options = SparseOptions { btf: false, ..SparseOptions::default() };
        let symbolic = Symbolic::analyze(matrix.pattern(), options).unwrap();
        let mut factors = Factors::new(symbolic);
        factors.renew(matrix.values()).unwrap();
        factors.solve(&mut step).unwrap();

        for (&full, step) in solid.dofs().free_to_full().iter().zip(&step) {
            state.u[full] -= step;
        }
        for (p, step) in state.p.iter_mut().zip(&step[n..]) {
            *p -= step;
        }
        let largest = |x: &[f64]| x.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        // Convergence is quadratic, so the next step would be far below rounding errors.
        if largest(&step[..n]) <= 1e-9 * largest(&state.u) {
            return state;
        }
    }
    panic!("Newton's method does not converge");
}

/// Exact solution for the computation of error norms.
pub(crate) trait Exact {
    fn u(&self, x: [f64; 2]) -> [f64; 2];
    fn gradient(&self, x: [f64; 2]) -> [[f64; 2]; 2];
    fn p(&self, x: [f64; 2]) -> f64;
}

/// Returns the rule of degree 6 on each of sixteen parts of a triangle, as pairs of barycentric coordinates and
/// weights. It integrates errors of a higher polynomial degree.
fn fine_rule() -> Vec<([f64; 3], f64)> {
    let mut parts = vec![[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]];
    for _ in 0..2 {
        parts = parts
            .into_iter()
            .flat_map(|[a, b, c]: [[f64; 3]; 3]| {
                let middle = |p: [f64; 3], q: [f64; 3]| [0, 1, 2].map(|i| 0.5 * (p[i] + q[i]));
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let fraction = 1.0 / parts.len() as f64;
    let point_in = |part: &[[f64; 3]; 3], l: [f64; 3]| {
        [0, 1, 2].map(|i| (0..3).map(|k| l[k] * part[k][i]).sum())
    };
    let points = Rule::Degree6.points(&TRIANGLE);
    parts
        .iter()
        .flat_map(|part| {
            points.iter().map(move |q| {
                (point_in(part, (*q.barycentric).try_into().unwrap()), fraction * q.weight)
            })
        })
        .collect()
}

/// Returns the errors of u in the L2 norm, of u in the H1 seminorm, and of p in the L2 norm.
pub(crate) fn errors(solid: &Solid, state: &Equilibrium, exact: &impl Exact) -> [f64; 3] {
    let space = solid.space();
    let rule = fine_rule();
    let mut squares = [0.0; 3];
    for element in 0..space.n_elements() {
        let corners = space.mesh().corners::<2, 3>(element);
        let [a, b, c] = corners;
        let area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]));
        for &(barycentric, weight) in &rule {
            let at = ElementPoint { element, barycentric: barycentric.into() };
            let x = [0, 1].map(|j| (0..3).map(|i| barycentric[i] * corners[i][j]).sum());
            let (u, exact_u) = (space.displacement_at::<2>(&state.u, &at), exact.u(x));
            let (h, exact_h) = (solid.gradient_at::<2>(&state.u, &at), exact.gradient(x));
            let p = space.pressure_at(&state.p, &at) - exact.p(x);
            for i in 0..2 {
                squares[0] += area * weight * (u[i] - exact_u[i]).powi(2);
                for j in 0..2 {
                    squares[1] += area * weight * (h[i][j] - exact_h[i][j]).powi(2);
                }
            }
            squares[2] += area * weight * p * p;
        }
    }
    squares.map(f64::sqrt)
}

/// Asserts the convergence orders 3, 2 and 2 between the last two meshes. Each mesh has half the element size of
/// the previous mesh.
///
/// # Panics
/// Panics if an order is too small by more than 0.1, the margin of similar tests in scikit-fem.
pub(crate) fn assert_orders(errors: &[[f64; 3]]) {
    let [.., coarse, fine] = errors else { panic!("at least two meshes are required") };
    for (k, expected) in [3.0, 2.0, 2.0].into_iter().enumerate() {
        let order = (coarse[k] / fine[k]).log2();
        assert!(
            order > expected - 0.1,
            "norm {k}: order {order:.3} instead of {expected} in {errors:?}"
        );
    }
}
