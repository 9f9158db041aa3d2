//! The weights of components in norms: the inverses of their tolerances.

use crate::options::RadauOptions;

/// A user's weights: fills in weights at y.
pub(crate) type UserWeights = Box<dyn FnMut(&[f64], &mut [f64]) + Send>;

/// Weights at the beginning of a step, and as they count in it.
pub(crate) struct Weights {
    user: Option<UserWeights>,
    /// Inverse tolerances at y.
    plain: Vec<f64>,
    /// The powers of h by which errors count less.
    powers: Vec<i32>,
    /// The product of both.
    scaled: Vec<f64>,
}

impl std::fmt::Debug for Weights {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Weights")
            .field("plain", &self.plain)
            .field("powers", &self.powers)
            .finish_non_exhaustive()
    }
}

impl Weights {
    pub(crate) fn new(user: Option<UserWeights>, powers: Vec<i32>) -> Self {
        Self {
            user,
            plain: vec![0.0; powers.len()],
            scaled: vec![0.0; powers.len()],
            powers,
        }
    }

    /// Computes the weights at `y`.
    pub(crate) fn update(&mut self, options: &RadauOptions, y: &[f64]) {
        if let Some(user) = &mut self.user {
            return user(y, &mut self.plain);
        }
        let (relative, absolute) = options.internal_tolerances();
        for (i, (w, y)) in self.plain.iter_mut().zip(y).enumerate() {
            // Where a relative tolerance alone meets y = 0, the weight is huge but finite.
            *w = 1.0 / (relative * y.abs() + absolute(i)).max(f64::MIN_POSITIVE);
        }
    }

    /// The first weight of the user's that is none, which must be positive and finite.
    pub(crate) fn first_bad(&self) -> Option<(usize, f64)> {
        self.user.as_ref()?;
        let mut numbered = self.plain.iter().copied().enumerate();
        numbered.find(|(_, weight)| !(*weight > 0.0 && weight.is_finite()))
    }

    /// Scales the weights for a step of size `h`.
    pub(crate) fn scale(&mut self, h: f64) {
        let weights = self.plain.iter().zip(&self.powers);
        for (scaled, (w, &power)) in self.scaled.iter_mut().zip(weights) {
            *scaled = w * h.powi(power);
        }
    }

    /// The weights at y.
    pub(crate) fn plain(&self) -> &[f64] {
        &self.plain
    }

    /// The weights as errors count in the step they were scaled for.
    pub(crate) fn scaled(&self) -> &[f64] {
        &self.scaled
    }
}
