//! The Levenberg–Marquardt step within a trust region.

use nalgebra::{DMatrix, DVector, SVD};

/// The linearised problem min |r + J D⁻¹ x|, |x| ≤ Δ, with J D⁻¹ by its singular values: one
/// decomposition serves all radii.
pub(crate) struct Linearised {
    svd: SVD<f64, nalgebra::Dyn, nalgebra::Dyn>,
    /// Uᵀ r.
    rotated: DVector<f64>,
}

impl Linearised {
    /// `scaled` is J D⁻¹.
    pub(crate) fn new(scaled: DMatrix<f64>, residuals: &DVector<f64>) -> Self {
        let svd = scaled.svd(true, true);
        let rotated = svd.u.as_ref().expect("asked for").tr_mul(residuals);
        Self { svd, rotated }
    }

    /// x(ν) = −V s/(s² + ν) Uᵀ r, in the basis V.
    fn coefficients(&self, nu: f64) -> DVector<f64> {
        let s = &self.svd.singular_values;
        let negligible = s.max() * f64::EPSILON * self.rotated.len() as f64;
        self.rotated.zip_map(s, |g, s| {
            if s <= negligible {
                0.0
            } else {
                -g * s / (s * s + nu)
            }
        })
    }

    /// The step of length at most `radius`, and what it is predicted to take off |r|²/2.
    pub(crate) fn step(&self, radius: f64) -> (DVector<f64>, f64) {
        let nu = self.damping(radius);
        let coefficients = self.coefficients(nu);
        let s = &self.svd.singular_values;
        let mut predicted = 0.0;
        for ((c, s), g) in coefficients.iter().zip(s.iter()).zip(self.rotated.iter()) {
            // (g² − (g + s c)²)/2 without cancellation.
            predicted -= 0.5 * s * c * (2.0 * g + s * c);
        }
        let v = self.svd.v_t.as_ref().expect("asked for");
        (v.tr_mul(&coefficients), predicted)
    }

    /// The ν ≥ 0 at which the step has the length `radius`, to a tenth; 0 if the Gauss–Newton step
    /// is shorter.
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
            nu = if low > 0.0 {
                (low * high).sqrt()
            } else {
                1e-3 * high
            };
        }
        nu
    }
}
