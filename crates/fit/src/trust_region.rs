//! Levenberg–Marquardt step within a trust region.

use nalgebra::{DMatrix, DVector, SVD};

/// Linearized problem min |r + J D x| with |x| ≤ Δ, where D contains the scales of the parameters. A single singular
/// value decomposition of J D is sufficient for all radii.
pub(crate) struct LinearLeastSquares {
    svd: SVD<f64, nalgebra::Dyn, nalgebra::Dyn>,
    /// Uᵀ r.
    rotated: DVector<f64>,
}

impl LinearLeastSquares {
    /// Decomposes the matrix `scaled` = J D.
    pub(crate) fn new(scaled: DMatrix<f64>, residuals: &DVector<f64>) -> Self {
        let svd = scaled.svd(true, true);
        let rotated = svd.u.as_ref().expect("computed").tr_mul(residuals);
        Self { svd, rotated }
    }

    /// Returns the bound below which a singular value is considered to be zero because of rounding errors.
    fn negligible(&self) -> f64 {
        self.svd.singular_values.max() * f64::EPSILON * self.rotated.len() as f64
    }

    /// Returns the relative offset of the residuals `r` (Bates and Watts 1981), |Uᵀ r|/√n over |r − U Uᵀ r|/√(m − n).
    /// It is the length of the Gauss–Newton step in units of the parameters' uncertainty, and infinite if there are no
    /// degrees of freedom.
    pub(crate) fn offset(&self, r: &DVector<f64>) -> f64 {
        let negligible = self.negligible();
        let significant = self.rotated.iter().zip(self.svd.singular_values.iter());
        let significant = significant.filter(|(_, s)| **s > negligible);
        let (n, along) = significant.fold((0, 0.0), |(n, sum), (g, _)| (n + 1, sum + g * g));
        let across = (r.norm_squared() - along).max(0.0);
        match r.len().saturating_sub(n) {
            0 => f64::INFINITY,
            _ if along == 0.0 => 0.0,
            freedom => (along / n as f64 * freedom as f64 / across).sqrt(),
        }
    }

    /// Returns x(ν) = −V s/(s² + ν) Uᵀ r in the basis V.
    fn coefficients(&self, nu: f64) -> DVector<f64> {
        let s = &self.svd.singular_values;
        let negligible = self.negligible();
        self.rotated.zip_map(s, |g, s| if s <= negligible { 0.0 } else { -g * s / (s * s + nu) })
    }

    /// Returns the step, whose length is at most `radius`, and the predicted reduction of |r|²/2.
    pub(crate) fn step(&self, radius: f64) -> (DVector<f64>, f64) {
        let nu = self.damping(radius);
        let coefficients = self.coefficients(nu);
        let s = &self.svd.singular_values;
        let mut predicted = 0.0;
        for ((c, s), g) in coefficients.iter().zip(s.iter()).zip(self.rotated.iter()) {
            // This equals (g² − (g + s c)²)/2, but without cancellation.
            predicted -= 0.5 * s * c * (2.0 * g + s * c);
        }
        let v = self.svd.v_t.as_ref().expect("computed");
        (v.tr_mul(&coefficients), predicted)
    }

    /// Returns ν ≥ 0 such that the length of the step is `radius` within 10 %, or 0 if the Gauss–Newton step is shorter
    /// than `radius`.
    fn damping(&self, radius: f64) -> f64 {
        let length = |nu: f64| self.coefficients(nu).norm();
        if length(0.0) <= 1.1 * radius {
            return 0.0;
        }
        // |x(ν)| falls below |Jᵀ r|/ν.
        let gradient = self.rotated.component_mul(&self.svd.singular_values).norm();
        let (mut low, mut high) = (0.0, gradient / radius);
        let mut nu = 1e-3 * high;
        for _ in 0..200 {
            let excess = length(nu) / radius - 1.0;
            if excess.abs() < 0.1 {
                break;
            }
            if excess > 0.0 {
                low = nu;
            } else {
                high = nu;
            }
            nu = if low > 0.0 { (low * high).sqrt() } else { 1e-3 * high };
        }
        nu
    }
}
