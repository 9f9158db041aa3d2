//! Obstacles driven by a force. Each obstacle has one unknown displacement, which is eliminated from the linear system.

use std::ops::Range;

use myovib_fem::{DofMap, DrivenSlope};
use myovib_sparse::{Scalar, SparseError};
use num_complex::ComplexFloat;

use crate::muscle::load::Contact;

/// Linearized equations F_k(u, s_k) = force for obstacles driven by a force. Let c = ∂F/∂u; the derivative of the
/// force on the body with respect to s is −c. Eliminating s subtracts c cᵀ/(∂F/∂s) from the matrix. The obstacles are
/// eliminated one after another (Sherman–Morrison).
#[derive(Debug, Default)]
pub(crate) struct DrivenObstacles<T> {
    obstacles: Vec<Driven<T>>,
}

#[derive(Debug)]
struct Driven<T> {
    /// c for the free displacement components.
    by_nodes: Vec<f64>,
    /// Positions of the displacement components among the unknowns.
    columns: Range<usize>,
    /// Solution of the linear system for the right-hand side c, after elimination of the preceding obstacles.
    response: Vec<T>,
    /// ∂F/∂s minus cᵀ times the response.
    pivot: T,
}

/// Returns, for each force-driven obstacle in contact, the derivatives of the contact force with respect to the
/// obstacle's displacement and to the free displacement components, and the force under the full load. `u` is the
/// displacement of all nodes under the fraction `part` of the loads at time `t`.
pub(crate) fn slopes(
    dofs: &DofMap,
    contacts: &[Contact],
    (t, part): (f64, f64),
    u: &[f64],
) -> impl Iterator<Item = (DrivenSlope, f64)> {
    let free = dofs.free_to_full();
    contacts.iter().filter_map(move |contact| {
        let (mut slope, force) = contact.driven_slope(t, part, u)?;
        slope.by_nodes = free.iter().map(|&i| slope.by_nodes[i]).collect();
        Some((slope, force))
    })
}

impl<T: Scalar> DrivenObstacles<T> {
    /// Prepares [`correct`](Self::correct) after the matrix for `n` unknowns was factorized; `solve` solves systems
    /// with this matrix. `rows` are the rows of the momentum balance, and `columns` are the columns of the
    /// displacement.
    pub(crate) fn factorize(
        &mut self,
        slopes: &[DrivenSlope],
        (n, rows, columns): (usize, Range<usize>, Range<usize>),
        mut solve: impl FnMut(&mut [T]) -> Result<(), SparseError>,
    ) -> Result<(), SparseError> {
        self.obstacles.clear();
        for slope in slopes {
            let mut own = Driven {
                by_nodes: slope.by_nodes.clone(),
                columns: columns.clone(),
                response: vec![T::zero(); n],
                pivot: T::zero(),
            };
            for (entry, &c) in own.response[rows.clone()].iter_mut().zip(&own.by_nodes) {
                *entry = T::one() * c;
            }
            solve(&mut own.response)?;
            self.correct(&mut own.response, 1);
            own.pivot = T::one() * slope.by_obstacle - own.product(&own.response, 0, 1);
            let size = ComplexFloat::abs(own.pivot);
            // The pivot consists only of rounding errors, or is NaN.
            if size.is_nan() || size <= 16.0 * f64::EPSILON * slope.by_obstacle {
                return Err(SparseError::Singular { n: n + 1, column: None });
            }
            self.obstacles.push(own);
        }
        Ok(())
    }

    /// Converts solutions `x` for fixed obstacles, stored row by row, into solutions for force-driven obstacles.
    pub(crate) fn correct(&self, x: &mut [T], n_columns: usize) {
        for own in &self.obstacles {
            for j in 0..n_columns {
                let factor = own.product(x, j, n_columns) / own.pivot;
                let entries = x[j..].iter_mut().step_by(n_columns);
                for (x, &response) in entries.zip(&own.response) {
                    *x += factor * response;
                }
            }
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.obstacles.is_empty()
    }
}

impl DrivenObstacles<f64> {
    pub(crate) fn negative_pivots(&self) -> usize {
        let pivots = self.obstacles.iter().map(|own| own.pivot);
        pivots.filter(|pivot| *pivot < 0.0).count()
    }
}

impl<T: Scalar> Driven<T> {
    /// Returns cᵀ times column `j` of `x`.
    fn product(&self, x: &[T], j: usize, n_columns: usize) -> T {
        let entries = x[self.columns.start * n_columns + j..].iter();
        let products = self.by_nodes.iter().zip(entries.step_by(n_columns));
        products.fold(T::zero(), |sum, (&c, &x)| sum + x * c)
    }
}
