//! Damped rod, a one-dimensional substitute for the muscle in long simulations.
//!
//! The module provides the residual and the Jacobian of the semi-discrete rod. The equation is linear, so the
//! matrices are assembled once. The time integration is in other crates.
//!
//! # Types
//! - [`RodData`]: parameters, with default values from the paper.
//! - [`Rod`]: assembled operators.
//! - [`EndLoad`]: the two interpretations of the load at the free end.
//! - [`PointValue`]: displacement at a point as a linear functional of the unknowns.
//!
//! # References
//! B. Simeon, R. Serban, L. Petzold, ESAIM: M2AN 43 (2009) 805–823, section 3.1.

use std::iter::once;

use nalgebra_sparse::CscMatrix;
use nalgebra_sparse::pattern::SparsityPattern;

use crate::error::FemError;
use crate::material::Range;
use crate::space::sparsity::pattern;

/// Parameters of the rod.
///
/// `ρ (ü + α u̇) = EA u_xx + β EA u̇_xx` on (0, L) with u(0, t) = 0 and a load at x = L. Paper, eq. (35).
///
/// # Units
/// The parameters are dimensionless in the paper. Any consistent system of units is valid, with α in 1/s and β in
/// s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RodData {
    /// Axial stiffness EA.
    pub axial_stiffness: f64,
    /// Density ρ.
    pub density: f64,
    /// Length L.
    pub length: f64,
    /// Coefficient α of the Rayleigh damping D = α M + β A.
    pub mass_damping: f64,
    /// Coefficient β of the Rayleigh damping.
    pub stiffness_damping: f64,
    /// Number of linear elements of equal length.
    pub n_elements: usize,
}

impl Default for RodData {
    /// Returns the parameters of section 3.1 of the paper.
    fn default() -> Self {
        Self {
            axial_stiffness: 1e6,
            density: 1e3,
            length: 0.1,
            mass_damping: 0.25,
            stiffness_damping: 1e-3,
            n_elements: 10,
        }
    }
}

/// Quantity that the signal τ(t) prescribes at the free end.
///
/// The two interpretations differ by the phase lag of the damping: 0.05 rad at 8 Hz with the data of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum EndLoad {
    /// Strain, `u_x(L, t) = τ`, as printed in the paper. The damped rod then requires the force EA
    /// (τ + β τ̇).
    #[default]
    Strain,
    /// Traction, `EA (u_x + β u̇_x)(L, t) = EA τ`.
    Traction,
}

/// Semi-discrete rod in first-order form.
///
/// The states are `s = (q, v)`, the displacements and velocities of the free nodes, from the first node after the
/// fixed end to the loaded node. With the force f at the loaded end, the equations are
///
/// ```text
/// q̇ − v = 0
/// M v̇ + (α M + β A) v + A q − f e_last = 0
/// ```
///
/// This is eq. (36) of the paper with corrected symbols of the damping and stiffness matrices: D = α M + β A
/// multiplies q̇ and A multiplies q.
///
/// # Shapes
/// [`n_free`](Self::n_free) is the number of elements. States, derivatives and residuals have length `2 · n_free`.
///
/// # Examples
/// ```
/// use myovib_fem::rod::{EndLoad, Rod, RodData};
/// # fn main() -> Result<(), myovib_fem::FemError> {
/// let rod = Rod::new(RodData::default())?;
/// // A steady strain τ = 0.02 stretches the rod uniformly: u = τ x.
/// let mut s = vec![0.0; rod.n_states()];
/// (0..10).for_each(|j| s[j] = 0.02 * 0.01 * (j + 1) as f64);
/// let mut residual = vec![0.0; rod.n_states()];
/// let force = rod.end_force(EndLoad::Strain, 0.02, 0.0);
/// rod.residual(&s, &vec![0.0; 20], force, &mut residual);
/// assert!(residual.iter().all(|r| r.abs() < 1e-10 * force));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Rod {
    data: RodData,
    mass: CscMatrix<f64>,
    stiffness: CscMatrix<f64>,
    pattern: SparsityPattern,
}

impl Rod {
    /// Assembles the matrices.
    ///
    /// # Errors
    /// Returns [`FemError::Parameter`] if EA, ρ or L is not positive, a damping coefficient is negative, a value
    /// is not finite or `n_elements` is zero.
    pub fn new(data: RodData) -> Result<Self, FemError> {
        check(&data)?;
        let h = data.length / data.n_elements as f64;
        let mass = data.density * h / 6.0;
        let stiffness = data.axial_stiffness / h;
        let lanes = tridiagonal_pattern(data.n_elements);
        Ok(Self {
            data,
            mass: assemble(&lanes, 2.0 * mass, mass),
            stiffness: assemble(&lanes, stiffness, -stiffness),
            pattern: first_order_pattern(&lanes),
        })
    }

    /// Returns the parameters.
    pub fn data(&self) -> &RodData {
        &self.data
    }

    /// Returns the number of free nodes, equal to the number of elements.
    pub fn n_free(&self) -> usize {
        self.data.n_elements
    }

    /// Returns the number of states and equations, twice the number of free nodes.
    pub fn n_states(&self) -> usize {
        2 * self.n_free()
    }

    /// Returns the consistent mass matrix M, which is tridiagonal.
    pub fn mass(&self) -> &CscMatrix<f64> {
        &self.mass
    }

    /// Returns the stiffness matrix A, which has the pattern of M.
    pub fn stiffness(&self) -> &CscMatrix<f64> {
        &self.stiffness
    }

    /// Returns the force at the loaded end for the signal τ and its exact derivative τ̇.
    ///
    /// The force is `EA (τ + β τ̇)` for a strain and `EA τ` for a traction.
    pub fn end_force(&self, load: EndLoad, tau: f64, tau_dot: f64) -> f64 {
        let RodData { axial_stiffness, stiffness_damping, .. } = self.data;
        match load {
            EndLoad::Strain => axial_stiffness * (tau + stiffness_damping * tau_dot),
            EndLoad::Traction => axial_stiffness * tau,
        }
    }

    /// Writes the residual under the force `end_force` to `residual`.
    ///
    /// # Panics
    /// Panics unless all slices have length [`n_states`](Self::n_states).
    pub fn residual(&self, s: &[f64], s_dot: &[f64], end_force: f64, residual: &mut [f64]) {
        let n = self.n_free();
        assert_eq!(s.len(), 2 * n, "states");
        assert_eq!(s_dot.len(), 2 * n, "derivatives");
        assert_eq!(residual.len(), 2 * n, "residual");
        let RodData { mass_damping: alpha, stiffness_damping: beta, .. } = self.data;
        let ((q, v), (q_dot, v_dot)) = (s.split_at(n), s_dot.split_at(n));
        let (kinematic, momentum) = residual.split_at_mut(n);
        momentum.fill(0.0);
        momentum[n - 1] = -end_force;
        for j in 0..n {
            kinematic[j] = q_dot[j] - v[j];
            let (inertia, strain) = (v_dot[j] + alpha * v[j], q[j] + beta * v[j]);
            for (i, m, a) in self.column(j) {
                momentum[i] += m * inertia + a * strain;
            }
        }
    }

    /// Returns the compressed-column pattern of `a ∂F/∂s + b ∂F/∂ṡ` (major dimension: columns).
    pub fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.pattern
    }

    /// Writes the entries of `a ∂F/∂s + b ∂F/∂ṡ` to `values`, in the order of the pattern.
    ///
    /// # Panics
    /// Panics unless `values` has one entry per entry of the pattern.
    pub fn jacobian(&self, a: f64, b: f64, values: &mut [f64]) {
        assert_eq!(values.len(), self.pattern.nnz(), "Jacobian values");
        let RodData { mass_damping: alpha, stiffness_damping: beta, .. } = self.data;
        let n = self.n_free();
        let q_columns = (0..n).flat_map(|j| {
            let momentum = self.column(j).map(move |(_, _, k)| a * k);
            once(b).chain(momentum)
        });
        let v_columns = (0..n).flat_map(|j| {
            let momentum = self.column(j).map(move |(_, m, k)| (b + a * alpha) * m + a * beta * k);
            once(-a).chain(momentum)
        });
        values.iter_mut().zip(q_columns.chain(v_columns)).for_each(|(entry, value)| *entry = value);
    }

    /// Returns the mechanical energy `½ vᵀ M v + ½ qᵀ A q`.
    ///
    /// Without a load, the energy decreases at the rate `vᵀ (α M + β A) v`.
    ///
    /// # Panics
    /// Panics unless `s` has length [`n_states`](Self::n_states).
    pub fn energy(&self, s: &[f64]) -> f64 {
        let n = self.n_free();
        assert_eq!(s.len(), 2 * n, "states");
        let (q, v) = s.split_at(n);
        let twice: f64 = (0..n)
            .flat_map(|j| self.column(j).map(move |(i, m, a)| v[i] * m * v[j] + q[i] * a * q[j]))
            .sum();
        twice / 2.0
    }

    /// Returns the displacement at the point `x` of the rod as a linear functional of the displacements q.
    ///
    /// # Errors
    /// Returns [`FemError::Parameter`] if the point is not on the rod.
    pub fn displacement_at(&self, x: f64) -> Result<PointValue, FemError> {
        let RodData { length, n_elements, .. } = self.data;
        if !(0.0..=length).contains(&x) {
            return Err(FemError::Parameter {
                name: "x",
                value: x,
                condition: "on the rod, 0 ≤ x ≤ L",
            });
        }
        let scaled = x / length * n_elements as f64;
        let element = (scaled as usize).min(n_elements - 1);
        let right = scaled - element as f64;
        // Node 0 is fixed, and node k has the unknown k − 1.
        let weights = [(element.checked_sub(1), 1.0 - right), (Some(element), right)];
        let entries = weights
            .into_iter()
            .filter_map(|(unknown, weight)| Some((unknown?, weight)))
            .filter(|&(_, weight)| weight != 0.0)
            .collect();
        Ok(PointValue { entries })
    }

    /// Returns the row, the mass and the stiffness of each entry in column `j`.
    fn column(&self, j: usize) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        let offsets = self.mass.pattern().major_offsets();
        (offsets[j]..offsets[j + 1]).map(|e| {
            (self.mass.row_indices()[e], self.mass.values()[e], self.stiffness.values()[e])
        })
    }
}

/// Displacement at a point as a linear functional, given by unknowns and weights.
#[derive(Debug, Clone, PartialEq)]
pub struct PointValue {
    /// Index in q and weight of each term. The list is empty at the fixed end.
    pub entries: Vec<(usize, f64)>,
}

impl PointValue {
    /// Returns the displacement at the point for the nodal displacements `q`, or the velocity if nodal velocities
    /// are given instead.
    ///
    /// # Panics
    /// Panics if `q` is shorter than the displacements of the rod.
    pub fn of(&self, q: &[f64]) -> f64 {
        self.entries.iter().map(|&(unknown, weight)| weight * q[unknown]).sum()
    }
}

fn check(data: &RodData) -> Result<(), FemError> {
    let positive = [
        ("axial_stiffness", data.axial_stiffness),
        ("density", data.density),
        ("length", data.length),
    ];
    for (name, value) in positive {
        Range::Positive.check(name, value)?;
    }
    let damping =
        [("mass_damping", data.mass_damping), ("stiffness_damping", data.stiffness_damping)];
    for (name, value) in damping {
        if !(value >= 0.0 && value.is_finite()) {
            return Err(FemError::Parameter { name, value, condition: "at least 0 and finite" });
        }
    }
    if data.n_elements == 0 {
        return Err(FemError::Parameter {
            name: "n_elements",
            value: 0.0,
            condition: "at least 1",
        });
    }
    Ok(())
}

fn tridiagonal_pattern(n: usize) -> SparsityPattern {
    pattern(n, (0..n).map(|j| (j.saturating_sub(1)..(j + 2).min(n)).collect()))
}

/// Returns the pattern of the first-order system. Each of the columns q_j and v_j contains the kinematic row of j
/// and the momentum rows of its neighbors.
fn first_order_pattern(lanes: &SparsityPattern) -> SparsityPattern {
    let n = lanes.major_dim();
    let column = |j: usize| once(j).chain(lanes.lane(j).iter().map(|i| n + i)).collect();
    pattern(2 * n, (0..2 * n).map(|column_index| column(column_index % n)))
}

/// Assembles the element matrices `(d, o; o, d)` for the free nodes.
fn assemble(lanes: &SparsityPattern, diagonal: f64, off_diagonal: f64) -> CscMatrix<f64> {
    let n = lanes.major_dim();
    let values = lanes
        .entries()
        .map(|(column, row)| match (row == column, row + 1 == n) {
            (true, true) => diagonal,
            (true, false) => 2.0 * diagonal,
            (false, _) => off_diagonal,
        })
        .collect();
    CscMatrix::try_from_pattern_and_values(lanes.clone(), values)
        .expect("one value per entry of the pattern")
}
