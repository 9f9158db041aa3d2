//! Verification of the paper's remark in section 2: (34), in which the space of the additional multiplier is richer
//! than that of the pressure, is not equivalent to (33).
//!
//! With the operator B for the pressures and a different operator B̃ for the additional multiplier, the equations are
//!
//! ```text
//! M q̇ = M v - B̃ᵀμ,   M v̇ = f - A q - D v - Bᵀλ,   0 = B̃ q,   0 = B v.
//! ```
//!
//! v satisfies only B v = 0. If B̃ is more restrictive than B, the multiplier μ must remove the part of v that B̃
//! excludes, so that μ ≠ 0 and q̇ ≠ v. If B̃ = B, the equations are (33), and μ = 0.
//!
//! For small strains, all matrices are constant, and projections eliminate the multipliers. In coordinates in which M
//! is the identity, q̇ = P̃ v and v̇ = P (f - A q - D v) with the orthogonal projections P and P̃ onto the kernels of
//! B and B̃. These equations are solved without a DAE integrator. A solution also exists if B̃ has dependent rows; μ
//! is then not unique.

use myovib_fem::element::{Degree, TRIANGLE, inverse_map};
use myovib_fem::quadrature::Rule;
use myovib_fem::{Mesh, Solid};
use myovib_structure::{Index, Pencil, PencilStructure};
use nalgebra::{DMatrix, DVector};

use crate::error::ModelError;
use crate::operators;
use crate::paper;
use crate::signal::{Signal, formula};

/// Time over which the solutions are compared, s: four periods of the load.
const T_END: f64 = 0.5;
/// Steps of the implicit midpoint rule: 250 per period of the load.
const STEPS: usize = 1000;
/// Eigenvalues of B̃ M⁻¹ B̃ᵀ below this fraction of the largest eigenvalue count as zero. The value is far above
/// rounding errors and far below the eigenvalues of operators with full rank on a coarse mesh.
const DEPENDENT: f64 = 1e-10;

/// Space of the additional multiplier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MultiplierSpace {
    /// Linear, as for the pressure: (33).
    Linear,
    /// Quadratic, as in COMSOL: (34).
    Quadratic,
}

/// A solution of the stabilized equations under a load like the paper's.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Index of the DAE.
    pub index: Index,
    /// Number of additional multipliers.
    pub multipliers: usize,
    /// Number of rows of B̃ minus its rank.
    pub dependent: usize,
    /// Largest displacement component over time, m.
    pub amplitude: f64,
    /// Maximum over time of |M⁻¹B̃ᵀμ| = |v - q̇|, divided by max |v|, in the norm of the kinetic energy.
    pub multiplier: f64,
    /// Displacement, one column per step.
    displacement: DMatrix<f64>,
}

impl Solution {
    /// Returns max |q - q'| / max |q'|, where q' is the reference.
    pub fn error(&self, reference: &Self) -> f64 {
        (&self.displacement - &reference.displacement).amax() / reference.displacement.amax()
    }
}

/// Solves with the additional multiplier in `space`, on a mesh with the groups `fixed` and `load`,
/// under a vertical load of 8 Hz.
///
/// # Errors
/// Returns [`ModelError::Fem`] if the mesh lacks any of the groups.
pub fn solve(mesh: &Mesh, space: MultiplierSpace) -> Result<Solution, ModelError> {
    let amplitude = Signal::constant(paper::LOAD_AMPLITUDE);
    let muscle = paper::muscle_with_load(mesh, paper::SMALL_STRAIN, f64::INFINITY, 0.0, amplitude)?;
    let solid = &muscle.solid;
    let mut load = vec![0.0; solid.dofs().n_full()];
    for part in &muscle.loads {
        part.add_at(0.0, &mut load);
    }
    let mut force = vec![0.0; solid.dofs().n_free()];
    solid.dofs().restrict(&load, &mut force);

    let rest = operators::rest(solid);
    let pressures = DMatrix::from(&operators::divergence(solid, &rest)?);
    let extra = match space {
        MultiplierSpace::Linear => pressures.clone(),
        MultiplierSpace::Quadratic => quadratic_divergence(solid),
    };
    let mass = DMatrix::from(&operators::mass(solid));
    let no_pressure = operators::no_pressure(solid);
    let stiffness = DMatrix::from(&operators::stiffness(solid, &rest, &no_pressure)?);
    let index = index(&mass, &stiffness, &pressures, &extra)?;

    // x ↦ Lᵀx transforms M = L Lᵀ into the identity.
    let lower = mass.cholesky().expect("a mass matrix is positive definite").unpack();
    let to_unit = |rows: &DMatrix<f64>| {
        let columns = lower.solve_lower_triangular(&rows.transpose());
        columns.expect("L has a positive diagonal").transpose()
    };
    let force = DMatrix::from_column_slice(1, force.len(), &force);
    let force = to_unit(&force).transpose().column(0).into_owned();
    let stiffness = to_unit(&to_unit(&stiffness).transpose());
    let (keeps_pressure, _) = kernel_projection(&to_unit(&pressures));
    let (keeps_extra, dependent) = kernel_projection(&to_unit(&extra));
    let motion = integrate(&stiffness, &keeps_pressure, &keeps_extra, &force);

    let n = force.len();
    let (q, v) = (motion.rows(0, n), motion.rows(n, n));
    let largest = |m: &DMatrix<f64>| m.column_iter().map(|c| c.norm()).fold(0.0, f64::max);
    let taken_away = v - &keeps_extra * v;
    let displacement = lower
        .transpose()
        .solve_upper_triangular(&q.into_owned())
        .expect("L has a positive diagonal");
    Ok(Solution {
        index,
        multipliers: extra.nrows(),
        dependent,
        amplitude: displacement.amax(),
        multiplier: largest(&taken_away) / largest(&v.into_owned()),
        displacement,
    })
}

/// Integrates (q, v) by the implicit midpoint rule. Returns one column per step.
fn integrate(
    stiffness: &DMatrix<f64>,
    keeps_pressure: &DMatrix<f64>,
    keeps_extra: &DMatrix<f64>,
    force: &DVector<f64>,
) -> DMatrix<f64> {
    let n = force.len();
    let mut rate = DMatrix::zeros(2 * n, 2 * n);
    rate.view_mut((0, n), (n, n)).copy_from(keeps_extra);
    rate.view_mut((n, 0), (n, n)).copy_from(&-(keeps_pressure * stiffness));
    rate.view_mut((n, n), (n, n)).copy_from(&(keeps_pressure * -paper::ALPHA));
    let push = keeps_pressure * force;
    let load = Signal::from(formula::Sine {
        amplitude: 1.0,
        frequency: paper::LOAD_FREQUENCY,
        phase: 0.0,
    });

    let step = T_END / STEPS as f64;
    let half = &rate * (0.5 * step);
    let identity = DMatrix::identity(2 * n, 2 * n);
    let implicit = (&identity - &half).lu();
    let explicit = identity + half;
    let mut motion = DMatrix::zeros(2 * n, STEPS + 1);
    for k in 0..STEPS {
        let mut right = &explicit * motion.column(k);
        let now = load.at((k as f64 + 0.5) * step).value;
        right.rows_mut(n, n).axpy(step * now, &push, 1.0);
        let next = implicit.solve(&right).expect("I + h/2 A is regular for small steps");
        motion.set_column(k + 1, &next);
    }
    motion
}

/// Returns the orthogonal projection onto the kernel of `b`, and the number of rows of `b` minus its rank.
fn kernel_projection(b: &DMatrix<f64>) -> (DMatrix<f64>, usize) {
    let eigen = (b * b.transpose()).symmetric_eigen();
    let bound = DEPENDENT * eigen.eigenvalues.amax();
    let mut projection = DMatrix::identity(b.ncols(), b.ncols());
    let mut dependent = 0;
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > bound {
            let direction = b.tr_mul(&vector);
            projection -= &direction * direction.transpose() / *value;
        } else {
            dependent += 1;
        }
    }
    (projection, dependent)
}

/// Returns ∫ ψ̃ div φ with quadratic ψ̃ on the displacement nodes.
fn quadratic_divergence(solid: &Solid) -> DMatrix<f64> {
    let space = solid.space();
    let mut full = DMatrix::zeros(space.n_nodes(), solid.dofs().n_full());
    for element in 0..space.n_elements() {
        let (inverse, det) = inverse_map(&space.mesh().corners::<2, 3>(element));
        let nodes = space.element_nodes(element);
        // The integrand has degree 3.
        for point in Rule::Degree4.points(&TRIANGLE) {
            let weight = 0.5 * det * point.weight;
            let (values, gradients) = (
                TRIANGLE.values(Degree::Two, &point.barycentric),
                TRIANGLE.gradients::<2>(Degree::Two, &point.barycentric),
            );
            for (&row, value) in nodes.iter().zip(values) {
                for (&node, [xi, eta]) in nodes.iter().zip(&gradients) {
                    for m in 0..2 {
                        let derivative = xi * inverse[0][m] + eta * inverse[1][m];
                        full[(row, 2 * node + m)] += weight * value * derivative;
                    }
                }
            }
        }
    }
    full.select_columns(solid.dofs().free_to_full())
}

/// Computes the index of the equations in the module documentation for the unknowns q, v, λ, μ.
fn index(
    mass: &DMatrix<f64>,
    stiffness: &DMatrix<f64>,
    b: &DMatrix<f64>,
    extra: &DMatrix<f64>,
) -> Result<Index, ModelError> {
    let (n, m, k) = (mass.nrows(), b.nrows(), extra.nrows());
    let size = 2 * n + m + k;
    let (mut e, mut a) = (DMatrix::zeros(size, size), DMatrix::zeros(size, size));
    e.view_mut((0, 0), (n, n)).copy_from(mass);
    e.view_mut((n, n), (n, n)).copy_from(mass);
    a.view_mut((0, n), (n, n)).copy_from(&-mass);
    a.view_mut((0, 2 * n + m), (n, k)).copy_from(&extra.transpose());
    a.view_mut((n, 0), (n, n)).copy_from(stiffness);
    a.view_mut((n, n), (n, n)).copy_from(&(mass * paper::ALPHA));
    a.view_mut((n, 2 * n), (n, m)).copy_from(&b.transpose());
    a.view_mut((2 * n, n), (m, n)).copy_from(b);
    a.view_mut((2 * n + m, 0), (k, n)).copy_from(extra);
    Ok(PencilStructure::of(&Pencil::new(e, a)?).index)
}
