//! Rational functions that interpolate several curves at once. They are computed by the AAA algorithm (Nakatsukasa,
//! Sète and Trefethen 2018, doi:10.1137/16M1106122) with common support points and weights for all curves (Lietaert et
//! al. 2022, doi:10.1093/imanum/drab098).

use nalgebra::DMatrix;
use num_complex::Complex64;

/// Residual at which the approximation stops, relative to the value or to the size of its curve. It is far above the
/// rounding errors of the values and far below the tolerances of responses.
const REPRESENTED: f64 = 1e-8;

/// Rational functions in barycentric form.
pub(super) struct Rational {
    support: Vec<f64>,
    weights: Vec<Complex64>,
    /// Values of all curves at each support point.
    values: Vec<Vec<Complex64>>,
}

impl Rational {
    /// Approximates curves, given the `rows` of their values at the frequencies `f`. Each curve is weighted by the
    /// inverse of its size; curves of size 0 have no weight.
    pub(super) fn fit(f: &[f64], rows: &[Vec<Complex64>], sizes: &[f64]) -> Self {
        let weight = |size: f64| if size > 0.0 { 1.0 / size } else { 0.0 };
        let curve_weights: Vec<f64> = sizes.iter().map(|size| weight(*size)).collect();
        let distance = |row: &[Complex64], other: &[Complex64]| {
            let differences = row.iter().zip(other).zip(&curve_weights);
            differences.fold(0.0, |largest, ((a, b), w)| {
                (w * (a - b).norm() / (w * a.norm()).max(1.0)).max(largest)
            })
        };
        let mut is_support = vec![false; f.len()];
        let mut fitted = Self { support: Vec::new(), weights: Vec::new(), values: Vec::new() };
        // The number of weights cannot exceed the number of remaining samples, which determine the weights.
        while 2 * fitted.support.len() < f.len() {
            let others = (0..f.len()).filter(|&k| !is_support[k]);
            let residuals = others.map(|k| (k, distance(&rows[k], &fitted.at(f[k], sizes.len()))));
            let Some((worst, residual)) = residuals.max_by(|a, b| a.1.total_cmp(&b.1)) else {
                break;
            };
            if residual <= REPRESENTED {
                break;
            }
            is_support[worst] = true;
            fitted.support.push(f[worst]);
            fitted.values.push(rows[worst].clone());
            let others: Vec<usize> = (0..f.len()).filter(|&k| !is_support[k]).collect();
            fitted.weights = fitted.loewner_weights(f, rows, &others, &curve_weights);
        }
        fitted
    }

    /// Interpolates an odd number of samples. Every second sample is a support point. The weights are chosen such that
    /// the function also interpolates the other samples.
    pub(super) fn through(f: &[f64], rows: &[Vec<Complex64>]) -> Self {
        let (support, others): (Vec<usize>, Vec<usize>) = (0..f.len()).partition(|k| k % 2 == 0);
        let values = support.iter().map(|&k| rows[k].clone()).collect();
        let support = support.into_iter().map(|k| f[k]).collect();
        let mut through = Self { support, weights: Vec::new(), values };
        through.weights = through.loewner_weights(f, rows, &others, &vec![1.0; rows[0].len()]);
        through
    }

    /// Returns the weights that minimize the linearized residual: the last right singular vector of the Loewner matrix.
    fn loewner_weights(
        &self,
        f: &[f64],
        rows: &[Vec<Complex64>],
        others: &[usize],
        curve_weights: &[f64],
    ) -> Vec<Complex64> {
        let (n, n_curves) = (self.support.len(), curve_weights.len());
        // The matrix needs at least as many rows as columns, so that all right singular vectors are computed.
        let n_rows = (others.len() * n_curves).max(n);
        let loewner = DMatrix::from_fn(n_rows, n, |i, j| {
            let (Some(&k), curve) = (others.get(i / n_curves), i % n_curves) else {
                return Complex64::ZERO;
            };
            let difference = rows[k][curve] - self.values[j][curve];
            curve_weights[curve] * difference / (f[k] - self.support[j])
        });
        let directions = loewner.svd(false, true).v_t;
        let last = directions.map(|v| v.row(n - 1).map(|w| w.conj()).iter().copied().collect());
        last.unwrap_or_else(|| vec![Complex64::ONE; n])
    }

    pub(super) fn of_curve(&self, curve: usize) -> Self {
        let values = self.values.iter().map(|values| vec![values[curve]]).collect();
        Self { support: self.support.clone(), weights: self.weights.clone(), values }
    }

    /// Returns the values of all curves at the frequency `f`, or zeros if there are no support points.
    pub(super) fn at(&self, f: f64, n_curves: usize) -> Vec<Complex64> {
        let mut above = vec![Complex64::ZERO; n_curves];
        let mut below = Complex64::ZERO;
        for ((at, values), weight) in self.support.iter().zip(&self.values).zip(&self.weights) {
            if f == *at {
                return values.clone();
            }
            let share = weight / (f - at);
            below += share;
            above.iter_mut().zip(values).for_each(|(sum, value)| *sum += share * value);
        }
        if !self.support.is_empty() {
            above.iter_mut().for_each(|sum| *sum /= below);
        }
        above
    }
}
