use nalgebra_sparse::pattern::SparsityPattern;

use super::{Sample, Start};
use myovib_dae::{Problem, StepError, VariableKind};

/// The heat equation on the unit square, discretized by central differences on an m × m grid. Algebraic equations set
/// the boundary values to zero.
///
/// ```text
/// interior: u̇_ij = (u_{i−1,j} + u_{i+1,j} + u_{i,j−1} + u_{i,j+1} − 4 u_ij) / Δx²
/// boundary:    0 = u_ij
/// u(0) = 16 x (1 − x) y (1 − y)
/// ```
///
/// The unknown `j * m + i` is the value at (i Δx, j Δx), where Δx = 1/(m − 1).
///
/// Source: the IDA example idaHeat2D_klu of SUNDIALS, with m = 10.
#[derive(Debug, Clone, Copy)]
pub struct Heat2d {
    m: usize,
}

impl Heat2d {
    /// Creates a grid with `m` points along each side.
    ///
    /// # Panics
    /// Panics if m < 3, because the grid would have no interior points.
    pub fn new(m: usize) -> Self {
        assert!(m >= 3, "a grid of {m} points on a side has no interior");
        Self { m }
    }

    fn is_boundary(&self, k: usize) -> bool {
        let (i, j) = (k % self.m, k / self.m);
        i == 0 || j == 0 || i == self.m - 1 || j == self.m - 1
    }

    /// Returns 1/Δx².
    fn inverse_square_spacing(&self) -> f64 {
        ((self.m - 1) * (self.m - 1)) as f64
    }

    /// Computes the discrete Laplacian at an interior point.
    fn laplacian(&self, u: &[f64], k: usize) -> f64 {
        let neighbors = u[k - 1] + u[k + 1] + u[k - self.m] + u[k + self.m];
        self.inverse_square_spacing() * (neighbors - 4.0 * u[k])
    }

    /// Returns the indices of the equations that contain the unknown k, in ascending order. These are equation k and
    /// the equations of its interior neighbors.
    fn rows_of_column(&self, k: usize) -> impl Iterator<Item = usize> {
        let (m, i) = (self.m, k % self.m);
        let left = (i > 0).then(|| k - 1);
        let right = (i < m - 1).then(|| k + 1);
        let above = (k + m < self.n_unknowns()).then_some(k + m);
        let interior = move |l: &usize| !self.is_boundary(*l);
        let before = [k.checked_sub(m), left].into_iter().flatten().filter(interior);
        let after = [right, above].into_iter().flatten().filter(interior);
        before.chain([k]).chain(after)
    }
}

impl Sample for Heat2d {
    fn start(&self) -> Start {
        let spacing = 1.0 / (self.m - 1) as f64;
        let n = self.n_unknowns();
        let bump = |k: usize| {
            let (x, y) = ((k % self.m) as f64 * spacing, (k / self.m) as f64 * spacing);
            16.0 * x * (1.0 - x) * y * (1.0 - y)
        };
        let y: Vec<f64> = (0..n).map(|k| if self.is_boundary(k) { 0.0 } else { bump(k) }).collect();
        let slope = |k| {
            if self.is_boundary(k) { 0.0 } else { self.laplacian(&y, k) }
        };
        let y_dot = (0..n).map(slope).collect();
        Start { t: 0.0, y, y_dot }
    }
}

impl Problem for Heat2d {
    fn n_unknowns(&self) -> usize {
        self.m * self.m
    }

    fn residual(
        &mut self,
        _t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        for k in 0..self.n_unknowns() {
            residual[k] = if self.is_boundary(k) { y[k] } else { y_dot[k] - self.laplacian(y, k) };
        }
        Ok(())
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        let n = self.n_unknowns();
        let (mut offsets, mut rows) = (vec![0], Vec::new());
        for column in 0..n {
            rows.extend(self.rows_of_column(column));
            offsets.push(rows.len());
        }
        SparsityPattern::try_from_offsets_and_indices(n, n, offsets, rows)
            .expect("neighbors come in rising order, without repetition")
    }

    fn jacobian(
        &mut self,
        _t: f64,
        _y: &[f64],
        _y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        let stiffness = a * self.inverse_square_spacing();
        let columns = 0..self.n_unknowns();
        let entries =
            columns.flat_map(|column| self.rows_of_column(column).map(move |r| (r, column)));
        for (value, (row, column)) in values.iter_mut().zip(entries) {
            *value = match (row == column, self.is_boundary(column)) {
                (true, true) => a,
                (true, false) => b + 4.0 * stiffness,
                (false, _) => -stiffness,
            };
        }
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        let kind = |k| {
            if self.is_boundary(k) { VariableKind::Algebraic } else { VariableKind::Differential }
        };
        Some((0..self.n_unknowns()).map(kind).collect())
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some((0..self.n_unknowns()).map(|k| u8::from(self.is_boundary(k))).collect())
    }
}
