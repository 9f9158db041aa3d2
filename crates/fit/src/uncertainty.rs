//! Standard errors, intervals and correlations from the linearization at the end of a fit.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::error::FitError;
use crate::result::Fit;

/// Uncertainty of the parameters, which assumes that the model is nearly linear within the range of the uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertainty {
    /// Variance of the weighted residuals, s² = 2 cost/degrees of freedom.
    pub variance: f64,
    /// Standard errors; infinite for parameters that have no effect on any measurement.
    pub standard_errors: Vec<f64>,
    /// Correlations, n × n; NaN for parameters that have no effect on any measurement.
    pub correlation: DMatrix<f64>,
    values: Vec<f64>,
    freedom: usize,
}

impl Fit {
    /// Returns standard errors, intervals and correlations from the final linearization. Parameters without effect do
    /// not change the results of the other parameters.
    ///
    /// # Errors
    /// Returns [`FitError::NoFreedom`] if there are as many parameters as measurements.
    pub fn uncertainty(&self) -> Result<Uncertainty, FitError> {
        let freedom = self.degrees_of_freedom();
        if freedom == 0 {
            return Err(FitError::NoFreedom(self.residuals.len()));
        }
        let variance = 2.0 * self.cost / freedom as f64;
        let acting = self.acting();
        let inverse = inverse_normal_matrix(self.weighted_jacobian().select_columns(&acting));
        let n = self.values.len();
        let place = |j: usize| acting.iter().position(|&acting| acting == j);
        let error = |a: usize| (variance * inverse[(a, a)]).sqrt();
        let standard_errors: Vec<f64> =
            (0..n).map(|j| place(j).map_or(f64::INFINITY, error)).collect();
        let correlation = DMatrix::from_fn(n, n, |i, j| match (place(i), place(j)) {
            _ if i == j => 1.0,
            (Some(a), Some(b)) => inverse[(a, b)] / (inverse[(a, a)] * inverse[(b, b)]).sqrt(),
            _ => f64::NAN,
        });
        Ok(Uncertainty {
            variance,
            standard_errors,
            correlation,
            values: self.values.clone(),
            freedom,
        })
    }
}

impl Uncertainty {
    /// Returns two-sided confidence intervals at `level` from Student's t distribution.
    ///
    /// # Panics
    /// Panics if `level` is not in (0, 1).
    pub fn intervals(&self, level: f64) -> Vec<[f64; 2]> {
        assert!(level > 0.0 && level < 1.0, "level in (0, 1)");
        let t = student_quantile(0.5 + 0.5 * level, self.freedom);
        let around = |(value, error): (&f64, &f64)| [value - t * error, value + t * error];
        self.values.iter().zip(&self.standard_errors).map(around).collect()
    }
}

/// Returns the quantile of Student's t distribution with `freedom` degrees of freedom.
pub(crate) fn student_quantile(probability: f64, freedom: usize) -> f64 {
    StudentsT::new(0.0, 1.0, freedom as f64)
        .expect("a positive number of degrees of freedom")
        .inverse_cdf(probability)
}

/// Returns (JᵀJ)⁻¹, computed from the singular values of J with normalized columns. No column may be zero.
fn inverse_normal_matrix(mut jacobian: DMatrix<f64>) -> DMatrix<f64> {
    if jacobian.is_empty() {
        return DMatrix::zeros(0, 0);
    }
    let norms: DVector<f64> =
        DVector::from_iterator(jacobian.ncols(), jacobian.column_iter().map(|c| c.norm()));
    for (mut column, &norm) in jacobian.column_iter_mut().zip(norms.iter()) {
        column /= norm;
    }
    let svd = jacobian.svd(false, true);
    let v = svd.v_t.as_ref().expect("computed").transpose();
    let mut scaled = v.clone();
    for (mut column, &s) in scaled.column_iter_mut().zip(svd.singular_values.iter()) {
        column /= s * s;
    }
    let inverse = scaled * v.transpose();
    DMatrix::from_fn(norms.len(), norms.len(), |i, j| inverse[(i, j)] / (norms[i] * norms[j]))
}
