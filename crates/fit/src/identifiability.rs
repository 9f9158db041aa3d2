//! Which combinations of parameters the measurements do not tell.

use crate::result::Fit;

/// A combination of relative changes of the parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// Change of the weighted residuals (their root of the sum of squares) for a relative change
    /// of the parameters of length one along it.
    pub sensitivity: f64,
    /// The share of each parameter, of unit length together.
    pub shares: Vec<f64>,
}

/// The singular values of the Jacobian by relative changes of the parameters, largest first.
#[derive(Debug, Clone, PartialEq)]
pub struct Identifiability {
    /// The directions, the best known first.
    pub directions: Vec<Direction>,
    /// The parameters' names.
    pub names: Vec<String>,
}

impl Fit {
    /// The combinations of parameters that the measurements do not tell.
    pub fn identifiability(&self) -> Identifiability {
        let mut jacobian = self.weighted_jacobian();
        for (mut column, value) in jacobian.column_iter_mut().zip(&self.values) {
            column *= if *value == 0.0 { 1.0 } else { value.abs() };
        }
        let svd = jacobian.svd(false, true);
        let v_t = svd.v_t.as_ref().expect("asked for");
        let mut directions: Vec<_> = svd
            .singular_values
            .iter()
            .zip(v_t.row_iter())
            .map(|(&sensitivity, row)| Direction {
                sensitivity,
                shares: row.iter().copied().collect(),
            })
            .collect();
        directions.sort_by(|a, b| b.sensitivity.total_cmp(&a.sensitivity));
        Identifiability {
            directions,
            names: self.names.clone(),
        }
    }
}

impl Identifiability {
    /// The directions along which a change of all parameters by their own size moves the weighted
    /// residuals by less than `noise` in all: what the measurements cannot tell. With residuals in
    /// units of their standard deviation `noise` = 1 is one standard deviation of the estimate.
    pub fn unknown(&self, noise: f64) -> impl Iterator<Item = &Direction> {
        self.directions
            .iter()
            .filter(move |direction| direction.sensitivity < noise)
    }
}
