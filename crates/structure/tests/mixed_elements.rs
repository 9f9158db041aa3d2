//! Tests of the inf–sup constants of P2–P1 and of equal-order P1–P1 triangles.

use std::sync::Arc;

use myovib_fem::generate::rectangle;
use myovib_fem::{DofMap, Fields, Law, Mesh, Pressure, Solid, Space, Tangents};
use myovib_structure::{Index, InfSup, Pencil, PencilStructure, Verdict};
use nalgebra::DMatrix;
use nalgebra_sparse::CscMatrix;
use nalgebra_sparse::pattern::SparsityPattern;

fn matrix(pattern: &SparsityPattern, values: Vec<f64>) -> CscMatrix<f64> {
    CscMatrix::try_from_pattern_and_values(pattern.clone(), values).expect("values of the pattern")
}

/// Matrices of a body clamped on `fixed`: B at rest, the H1 norm, the L2 norm of pressures, and the mass.
struct Mixed {
    b: CscMatrix<f64>,
    h1: CscMatrix<f64>,
    l2: CscMatrix<f64>,
    mass: CscMatrix<f64>,
}

impl Mixed {
    fn new(space: Space, fixed: &[&str]) -> Self {
        let nodes: Vec<usize> =
            fixed.iter().flat_map(|name| space.nodes_of(name).expect("its group")).collect();
        let dofs = DofMap::clamped(&space, &nodes).expect("nodes of the mesh");
        let law = Law::SmallStrain { shear_modulus: 1.0 };
        let solid = Solid::uniform(Arc::new(space), dofs, law, 1.0).expect("a valid solid");
        let u = vec![0.0; solid.space().n_components()];
        let p = vec![0.0; solid.space().n_pressures()];
        let mut divergence = vec![0.0; solid.divergence_pattern().nnz()];
        let mut wanted = Tangents { divergence: Some(&mut divergence), ..Tangents::default() };
        let fields = Fields::new(&u, Pressure::Nodal(&p));
        solid.tangents(&fields, &mut wanted).expect("rest is not inverted");
        Self {
            b: matrix(solid.divergence_pattern(), divergence),
            h1: matrix(solid.displacement_pattern(), solid.gradient_values()),
            l2: matrix(solid.pressure_pattern(), solid.pressure_mass_values().to_vec()),
            mass: matrix(solid.displacement_pattern(), solid.mass_values()),
        }
    }

    /// Computes the singular values of B.
    fn raw(&self) -> InfSup {
        let identity = CscMatrix::identity;
        InfSup::of(&self.b, &identity(self.b.ncols()), &identity(self.b.nrows())).expect("sizes")
    }

    /// Computes the constants in the norms of (27).
    fn in_norms(&self) -> InfSup {
        let found = InfSup::of(&self.b, &self.h1, &self.l2).expect("sizes");
        assert_eq!(found.decision.verdict, Verdict::Decisive);
        found
    }
}

fn square(n: usize) -> Mesh {
    rectangle([0.0, 0.0], [1.0, 1.0], [n, n]).expect("a valid rectangle")
}

fn clamped_square(space: Space) -> Mixed {
    Mixed::new(space, &["left", "right"])
}

/// The constant of P2–P1 remains nearly the same under three refinements, while σ_min(B) decreases like h².
#[test]
fn taylor_hood_is_stable() {
    let mut last_raw = None;
    for n in [4, 8, 16, 32] {
        let mixed = clamped_square(Space::taylor_hood(&square(n)));
        let found = mixed.in_norms();
        assert_eq!(found.nullity(), 0);
        let constant = found.smallest().expect("B is not zero");
        assert!((0.59..0.61).contains(&constant), "{constant} at n = {n}");
        let raw = mixed.raw().smallest().expect("B is not zero");
        if let Some(last) = last_raw.replace(raw) {
            let decay: f64 = last / raw;
            assert!((3.0..4.2).contains(&decay), "σ_min(B) fell by {decay} at n = {n}");
        }
    }
}

/// For P1–P1 on a square with right diagonals, three pressures are not controlled, and the smallest non-zero
/// constant decreases under refinement. The reference values are from the model's specification and agree to their
/// printed digits.
#[test]
fn equal_order_is_unstable() {
    for (n, expected) in [(4, 0.115), (8, 0.085), (16, 0.048), (24, 0.033)] {
        let found = clamped_square(Space::equal_order(&square(n))).in_norms();
        assert_eq!(found.nullity(), 3);
        let constant = found.smallest().expect("B is not zero");
        assert!((constant - expected).abs() <= 5e-4, "{constant} at n = {n}");
    }
}

/// Checks the spindle of the paper's muscle at two refinement levels. The reference values are from the model's
/// specification and agree to their printed digits.
#[test]
fn the_spindle() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/meshes/muscle.msh");
    let coarse = Mesh::read_msh(path).expect("our mesh");
    let fine = coarse.refined().unwrap();
    for (mesh, equal_order) in [(coarse, 0.06), (fine, 0.05)] {
        let constant = |space| {
            let found = Mixed::new(space, &["fixed"]).in_norms();
            assert_eq!(found.nullity(), 0);
            found.smallest().expect("B is not zero")
        };
        let taylor_hood = constant(Space::taylor_hood(&mesh));
        assert!((taylor_hood - 0.68).abs() < 0.015, "{taylor_hood}");
        let found = constant(Space::equal_order(&mesh));
        assert!((found - equal_order).abs() < 5e-3, "{found}");
    }
}

/// The system M v̇ = Bᵀλ, B q = 0, q̇ = v has index 3 with P2–P1. With P1–P1, its pencil is singular. With a
/// compliance, both pencils are regular with index 1.
#[test]
fn uncontrolled_pressures_make_the_pencil_singular() {
    let index = |mixed: &Mixed, compliance: f64| {
        let [b, l2, mass] = [&mixed.b, &mixed.l2, &mixed.mass].map(DMatrix::from);
        let (m, n) = b.shape();
        let mut e = DMatrix::identity(2 * n + m, 2 * n + m);
        e.view_mut((n, n), (n, n)).copy_from(&mass);
        e.view_mut((2 * n, 2 * n), (m, m)).fill(0.0);
        let mut a = DMatrix::zeros(2 * n + m, 2 * n + m);
        a.view_mut((0, n), (n, n)).fill_diagonal(-1.0);
        a.view_mut((n, 2 * n), (n, m)).copy_from(&-b.transpose());
        a.view_mut((2 * n, 0), (m, n)).copy_from(&b);
        a.view_mut((2 * n, 2 * n), (m, m)).copy_from(&(l2 * compliance));
        PencilStructure::of(&Pencil::new(e, a).expect("square and finite")).index
    };
    let stable = clamped_square(Space::taylor_hood(&square(2)));
    let unstable = clamped_square(Space::equal_order(&square(4)));
    assert_eq!(index(&stable, 0.0), Index::Decided(3));
    assert_eq!(index(&unstable, 0.0), Index::Singular { nullity: 3 });
    for mixed in [&stable, &unstable] {
        assert_eq!(index(mixed, 0.1), Index::Decided(1));
    }
}
