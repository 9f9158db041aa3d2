//! Combinations of parameters that the measurements do not determine.

use nalgebra::RowDVector;

use crate::result::Fit;

/// Combination of relative changes of the parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// Euclidean norm of the change of the weighted residuals if the parameters undergo the relative changes of this
    /// unit vector.
    pub sensitivity: f64,
    /// Components of the unit vector, one per parameter.
    pub shares: Vec<f64>,
}

/// Singular values and right singular vectors of the Jacobian with respect to relative changes of the parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Identifiability {
    /// Directions sorted by sensitivity; the best determined direction is first. Parameters without effect are
    /// excluded.
    pub directions: Vec<Direction>,
    /// Names of the parameters.
    pub names: Vec<String>,
}

impl Fit {
    /// Returns the directions in parameter space with their sensitivities. Parameters that [have no effect](Fit::acts)
    /// on any measurement are excluded.
    pub fn identifiability(&self) -> Identifiability {
        Identifiability { directions: self.directions(), names: self.names.clone() }
    }

    fn directions(&self) -> Vec<Direction> {
        let acting = self.acting();
        if acting.is_empty() {
            return Vec::new();
        }
        let mut jacobian = self.weighted_jacobian();
        for (mut column, value) in jacobian.column_iter_mut().zip(&self.values) {
            column *= if *value == 0.0 { 1.0 } else { value.abs() };
        }
        let svd = jacobian.select_columns(&acting).svd(false, true);
        let v_t = svd.v_t.as_ref().expect("computed");
        let direction = |(&sensitivity, row): (&f64, RowDVector<f64>)| {
            let mut shares = vec![0.0; self.values.len()];
            for (&j, &share) in acting.iter().zip(row.iter()) {
                shares[j] = share;
            }
            Direction { sensitivity, shares }
        };
        let rows = v_t.row_iter().map(|row| row.into_owned());
        let mut directions: Vec<_> = svd.singular_values.iter().zip(rows).map(direction).collect();
        directions.sort_by(|a, b| b.sensitivity.total_cmp(&a.sensitivity));
        directions
    }
}

impl Identifiability {
    /// Returns the directions in which a relative change of 1 changes the weighted residuals by less than `noise`. If
    /// the residuals are in units of their standard deviation, `noise` = 1 corresponds to one standard deviation of the
    /// estimate.
    pub fn unknown(&self, noise: f64) -> impl Iterator<Item = &Direction> {
        self.directions.iter().filter(move |direction| direction.sensitivity < noise)
    }
}
