//! Products with the tangents of element integrals, computed by element passes.

use std::ops::Range;

use myovib_dae::StepError;
use myovib_fem::{Change, TangentProduct};

use crate::equation::{Equation, PressureRateSource};
use crate::field::Field;
use crate::matrix::Matrix;
use crate::muscle_dae::MuscleDae;

/// Contribution of the element integrals to ∂F/∂y X + ∂F/∂ẏ Ẋ. One element pass computes all columns
/// and costs less than assembling the matrices.
#[derive(Debug)]
pub(super) struct ElementProduct {
    at: TangentProduct,
    momentum: Range<usize>,
    constraint: Option<Range<usize>>,
    displacement: Range<usize>,
    velocity: Range<usize>,
    pressure: Option<Range<usize>>,
    /// Range of the pressure rate if it is an unknown.
    pressure_rate: Option<Range<usize>>,
    rate_is_derivative: bool,
    columns: Vec<Column>,
}

/// Nodal values for one column of X and Ẋ, and the resulting changes.
#[derive(Debug, Clone)]
struct Column {
    u: Vec<f64>,
    v: Vec<f64>,
    p: Vec<f64>,
    p_rate: Vec<f64>,
    force: Vec<f64>,
    volume_residual: Vec<f64>,
}

impl ElementProduct {
    /// Creates the product for a muscle. Returns `None` if a state-dependent matrix is not a tangent of the element
    /// integrals.
    pub(super) fn new(dae: &MuscleDae) -> Option<Self> {
        let blocks = dae.blocks();
        let terms = blocks.iter().flat_map(|(_, terms)| terms);
        let known = |matrix| Self::takes(matrix) || is_constant(matrix);
        if !terms.clone().all(|term| known(term.matrix)) {
            return None;
        }
        let range = |field| dae.layout().range(field);
        let row_of = |equation| {
            let mut rows = dae.rows().iter();
            rows.find(|(_, found)| *found == equation).map(|row| row.0)
        };
        let rate = row_of(Equation::ConstraintRate);
        let context = dae.context();
        Some(Self {
            at: TangentProduct { beta: context.beta, constraint_rate: rate.is_some() },
            momentum: range(Field::Velocity)?,
            constraint: rate.or(row_of(Equation::Constraint)).and_then(range),
            displacement: range(Field::Displacement)?,
            velocity: range(Field::Velocity)?,
            pressure: range(Field::Pressure),
            pressure_rate: range(Field::PressureRate),
            rate_is_derivative: context.pressure_rate == PressureRateSource::Derivative,
            columns: Vec::new(),
        })
    }

    /// Returns whether a matrix is included in the product.
    pub(super) fn takes(matrix: Matrix) -> bool {
        matches!(
            matrix,
            Matrix::Stiffness
                | Matrix::RateStiffness
                | Matrix::Divergence
                | Matrix::DivergenceTransposed
                | Matrix::DivergenceRate
                | Matrix::DivergenceRateTransposed
        )
    }

    /// Subtracts the product at a state from `out` for `n_columns` columns, which are stored row by row.
    pub(super) fn subtract(
        &mut self,
        dae: &mut MuscleDae,
        state: (f64, &[f64], &[f64]),
        [x, x_dot]: [&[f64]; 2],
        out: &mut [f64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        let solid = &dae.muscle().solid;
        let (nodal, vertex) = (solid.dofs().n_full(), solid.space().n_pressures());
        let new_column = || Column {
            u: vec![0.0; nodal],
            v: vec![0.0; nodal],
            p: vec![0.0; vertex],
            p_rate: vec![0.0; vertex],
            force: vec![0.0; nodal],
            volume_residual: vec![0.0; vertex],
        };
        self.columns.resize_with(n_columns, new_column);
        let free = solid.dofs().free_to_full();
        let df_dyp = match self.rate_is_derivative {
            true => (self.pressure.as_ref(), x_dot),
            false => (self.pressure_rate.as_ref(), x),
        };
        for (c, column) in self.columns.iter_mut().enumerate() {
            for (to, rows) in [(&mut column.u, &self.displacement), (&mut column.v, &self.velocity)]
            {
                let own = x[rows.start * n_columns + c..].iter().step_by(n_columns);
                free.iter().zip(own).for_each(|(&i, x)| to[i] = *x);
            }
            for (to, (rows, of)) in
                [(&mut column.p, (self.pressure.as_ref(), x)), (&mut column.p_rate, df_dyp)]
            {
                if let Some(rows) = rows {
                    let own = of[rows.start * n_columns + c..].iter().step_by(n_columns);
                    to.iter_mut().zip(own).for_each(|(to, x)| *to = *x);
                }
            }
        }
        let has_constraint = self.constraint.is_some();
        let changes = self.columns.iter_mut().map(|column| Change {
            u: &column.u,
            v: Some(&column.v),
            p: Some(&column.p),
            p_rate: Some(&column.p_rate),
            force: &mut column.force,
            volume_residual: has_constraint.then_some(&mut column.volume_residual),
        });
        dae.change_integrals(state, self.at, &mut changes.collect::<Vec<_>>())?;
        let free = dae.muscle().solid.dofs().free_to_full();
        for (c, column) in self.columns.iter().enumerate() {
            let rows = &mut out[self.momentum.start * n_columns + c..];
            let rows = rows.iter_mut().step_by(n_columns);
            rows.zip(free).for_each(|(row, &i)| *row -= column.force[i]);
            if let Some(constraint) = &self.constraint {
                let rows = &mut out[constraint.start * n_columns + c..];
                let rows = rows.iter_mut().step_by(n_columns);
                rows.zip(&column.volume_residual).for_each(|(row, d)| *row -= d);
            }
        }
        Ok(())
    }
}

/// Returns whether a matrix does not depend on the state.
fn is_constant(matrix: Matrix) -> bool {
    matches!(
        matrix,
        Matrix::DisplacementIdentity
            | Matrix::PressureIdentity
            | Matrix::Mass
            | Matrix::PressureMass
            | Matrix::FoundationStiffness
            | Matrix::FoundationDamping
    )
}
