//! Loss functions.

/// Loss ρ(r²) of a residual r. The cost is half the sum of the losses of all residuals.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum Loss {
    /// Least squares: r².
    #[default]
    Squares,
    /// Huber loss: r² for |r| ≤ δ, otherwise 2 δ |r| − δ². It grows linearly for outliers.
    Huber(f64),
    /// Cauchy loss: δ² ln(1 + r²/δ²). It grows logarithmically for outliers.
    Cauchy(f64),
}

impl Loss {
    /// Returns ρ(r²).
    pub fn value(self, r: f64) -> f64 {
        match self {
            Self::Squares => r * r,
            Self::Huber(delta) if r.abs() <= delta => r * r,
            Self::Huber(delta) => delta * (2.0 * r.abs() - delta),
            Self::Cauchy(delta) => delta * delta * (r / delta).powi(2).ln_1p(),
        }
    }

    /// Returns √ρ'(r²). The residual and its derivatives are multiplied by this weight in the Gauss–Newton step.
    pub(crate) fn weight(self, r: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::Huber(delta) if r.abs() <= delta => 1.0,
            Self::Huber(delta) => (delta / r.abs()).sqrt(),
            Self::Cauchy(delta) => (1.0 + (r / delta).powi(2)).sqrt().recip(),
        }
    }

    pub(crate) fn delta(self) -> Option<f64> {
        match self {
            Self::Squares => None,
            Self::Huber(delta) | Self::Cauchy(delta) => Some(delta),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Loss;

    /// Compares the squared weight with central differences of ρ with respect to r².
    #[test]
    fn weights_are_derivatives_of_the_loss() {
        for loss in [Loss::Squares, Loss::Huber(1.5), Loss::Cauchy(0.7)] {
            for r in [0.1, 1.0, 1.4, 1.6, 8.0_f64] {
                let s = r * r;
                let h = 1e-5 * s;
                let slope = (loss.value((s + h).sqrt()) - loss.value((s - h).sqrt())) / (2.0 * h);
                // The truncation error is about 1e-10, and the rounding error is about 1e-11.
                assert!((slope / loss.weight(r).powi(2) - 1.0).abs() < 1e-8, "{loss:?} at {r}");
            }
        }
    }
}
