//! Residual of each block of F(t, y, ẏ) = 0 for given y and ẏ.

use std::fmt;

use myovib_dae::Problem;

use crate::equation::Equation;
use crate::error::ModelError;
use crate::field::Field;
use crate::muscle_dae::MuscleDae;

/// The residual of one block of equations.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockResidual {
    /// Block of unknowns in whose rows the equation is placed.
    pub field: Field,
    /// The equation.
    pub equation: Equation,
    /// max |F_i| over the block, in the units of the equation.
    pub largest: f64,
    /// The residual as a fraction of max Σ_j (|∂F_i/∂y_j y_j| + |∂F_i/∂ẏ_j ẏ_j|), the size of the terms that should
    /// cancel. It is infinite if these terms are zero but F_i is not.
    pub relative: f64,
    /// Location of the maximum: the name of the unknown in this row, with its node.
    pub worst: String,
}

impl fmt::Display for BlockResidual {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { equation, largest, relative, worst, .. } = self;
        if *largest == 0.0 {
            return write!(f, "{equation}: 0");
        }
        write!(f, "{equation}: {largest:.1e}, ")?;
        match relative.is_finite() {
            true => write!(f, "{relative:.1e} of its terms, ")?,
            false => f.write_str("all other terms 0, ")?,
        }
        write!(f, "largest at {worst}")
    }
}

/// Computes the residual of every block at (t, y, ẏ).
///
/// # Errors
/// [`ModelError::Evaluation`] if F or its Jacobian cannot be evaluated.
pub fn residuals(
    dae: &mut MuscleDae,
    t: f64,
    y: &[f64],
    y_dot: &[f64],
) -> Result<Vec<BlockResidual>, ModelError> {
    let mut residual = vec![0.0; dae.n_unknowns()];
    dae.residual(t, y, y_dot, &mut residual)?;
    blocks(dae, [y, y_dot], t, &residual)
}

/// Computes the [`residuals`] of a body with Prony terms, except for the blocks of internal stresses. The sizes of the
/// terms in each block are computed for `relaxed`, the same body without Prony terms.
///
/// # Errors
/// As for [`residuals`].
pub(crate) fn residuals_with_overstress(
    dae: &mut MuscleDae,
    relaxed: &mut MuscleDae,
    t: f64,
    [y, y_dot]: [&[f64]; 2],
) -> Result<Vec<BlockResidual>, ModelError> {
    let mut residual = vec![0.0; dae.n_unknowns()];
    dae.residual(t, y, y_dot, &mut residual)?;
    let n = relaxed.n_unknowns();
    blocks(relaxed, [&y[..n], &y_dot[..n]], t, &residual[..n])
}

fn blocks(
    dae: &mut MuscleDae,
    [y, y_dot]: [&[f64]; 2],
    t: f64,
    residual: &[f64],
) -> Result<Vec<BlockResidual>, ModelError> {
    let at_rest = y.iter().chain(y_dot).all(|value| *value == 0.0);
    let terms = match at_rest {
        true => vec![0.0; y.len()],
        false => sizes_of_terms(dae, t, y, y_dot)?,
    };
    let rows = dae.rows().to_vec().into_iter().zip(dae.layout().blocks());
    Ok(rows
        // If every node is fixed, there are no unknown displacements.
        .filter(|(_, (_, range))| !range.is_empty())
        .map(|((field, equation), (_, range))| {
            let worst = range
                .clone()
                .max_by(|&i, &j| residual[i].abs().total_cmp(&residual[j].abs()))
                .expect("it is not empty");
            let largest = residual[worst].abs();
            let scale = terms[range.clone()].iter().copied().fold(0.0, f64::max);
            BlockResidual {
                field,
                equation,
                largest,
                relative: if largest > 0.0 { largest / scale } else { 0.0 },
                worst: dae.component_name(worst),
            }
        })
        .collect())
}

/// Computes Σ_j (|∂F_i/∂y_j y_j| + |∂F_i/∂ẏ_j ẏ_j|) for every row i.
fn sizes_of_terms(
    dae: &mut MuscleDae,
    t: f64,
    y: &[f64],
    y_dot: &[f64],
) -> Result<Vec<f64>, ModelError> {
    let pattern = dae.jacobian_pattern();
    let mut values = vec![0.0; pattern.nnz()];
    let mut sizes = vec![0.0; y.len()];
    for (a, b, x) in [(1.0, 0.0, y), (0.0, 1.0, y_dot)] {
        dae.jacobian(t, y, y_dot, a, b, &mut values)?;
        for ((column, row), value) in pattern.entries().zip(&values) {
            sizes[row] += (value * x[column]).abs();
        }
    }
    Ok(sizes)
}
