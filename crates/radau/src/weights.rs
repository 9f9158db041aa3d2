//! Weights of components in norms, which are the reciprocals of the tolerances.

use myovib_dae::{Problem, StepError};

use crate::failure::{Failure, Operation};
use crate::options::RadauOptions;

/// User-defined weights: a function that writes the weights at y.
pub(crate) type UserWeights<P> =
    Box<dyn FnMut(&mut P, &[f64], &mut [f64]) -> Result<(), StepError> + Send>;

/// Weights at the start of a step, and their scaled values for this step.
pub(crate) struct Weights<P> {
    user: Option<UserWeights<P>>,
    /// Reciprocals of the tolerances at y.
    plain: Vec<f64>,
    /// Powers of h/T by which the errors of components of higher index are reduced.
    powers: Vec<i32>,
    /// Time T.
    time_scale: f64,
    /// Product of `plain` and these powers.
    scaled: Vec<f64>,
    /// Ratio of the tolerance for the estimate to the tolerance for the solution.
    loosened: f64,
    /// Factor of the unscaled weights in the separate test of the local errors of components of higher index.
    own: f64,
}

impl<P> std::fmt::Debug for Weights<P> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Weights")
            .field("plain", &self.plain)
            .field("powers", &self.powers)
            .finish_non_exhaustive()
    }
}

impl<P: Problem> Weights<P> {
    pub(crate) fn new(
        user: Option<UserWeights<P>>,
        powers: Vec<i32>,
        time_scale: f64,
        factors: [f64; 2],
    ) -> Self {
        let [loosened, own] = factors;
        Self {
            user,
            loosened,
            own,
            plain: vec![0.0; powers.len()],
            scaled: vec![0.0; powers.len()],
            powers,
            time_scale,
        }
    }

    /// Computes the weights at `y`.
    pub(crate) fn update(
        &mut self,
        problem: &mut P,
        options: &RadauOptions,
        y: &[f64],
    ) -> Result<(), Failure> {
        write(&mut self.user, problem, options, y, &mut self.plain)
    }

    /// Writes the weights at `y`, scaled for a step of size `h`. Does not change the current weights.
    pub(crate) fn write_at(
        &mut self,
        problem: &mut P,
        options: &RadauOptions,
        y: &[f64],
        h: f64,
        out: &mut [f64],
    ) -> Result<(), Failure> {
        write(&mut self.user, problem, options, y, out)?;
        for (w, &power) in out.iter_mut().zip(&self.powers) {
            *w *= (h / self.time_scale).powi(power);
        }
        Ok(())
    }
}

/// Writes the reciprocals of the tolerances at `y`.
fn write<P>(
    user: &mut Option<UserWeights<P>>,
    problem: &mut P,
    options: &RadauOptions,
    y: &[f64],
    out: &mut [f64],
) -> Result<(), Failure> {
    let Some(user) = user else {
        let (relative, absolute) = options.internal_tolerances(y);
        for (i, (w, y)) in out.iter_mut().zip(y).enumerate() {
            // If only a relative tolerance is given and y = 0, the weight is huge but finite.
            *w = 1.0 / (relative * y.abs() + absolute(i)).max(f64::MIN_POSITIVE);
        }
        return Ok(());
    };
    user(problem, y, out)
        .and_then(|()| expect_positive(out))
        .map_err(Operation::ErrorWeights.failed())
}

fn expect_positive(weights: &[f64]) -> Result<(), StepError> {
    match weights.iter().position(|&w| !(w > 0.0 && w.is_finite())) {
        None => Ok(()),
        Some(i) => {
            let weight = weights[i];
            let message = format!("error weight[{i}] = {weight} must be positive");
            Err(StepError::Recoverable(message))
        }
    }
}

impl<P> Weights<P> {
    /// Returns the relative tolerance implied by user-defined weights at `y`: the minimum of 1/(w |y|). Returns `None`
    /// if y is 0 or if the weights are not user-defined.
    pub(crate) fn implied_relative(&self, y: &[f64]) -> Option<f64> {
        self.user.as_ref()?;
        let relative = self.plain.iter().zip(y).map(|(w, y)| 1.0 / (w * y.abs()));
        let smallest = relative.fold(f64::INFINITY, f64::min);
        smallest.is_finite().then_some(smallest)
    }

    /// Returns whether the weights are user-defined.
    pub(crate) fn are_given(&self) -> bool {
        self.user.is_some()
    }

    /// Sets the ratio of the tolerance for the estimate to the tolerance for the solution, and the factor of the
    /// unscaled weights of components of higher index.
    pub(crate) fn set_factors(&mut self, [loosened, own]: [f64; 2]) {
        (self.loosened, self.own) = (loosened, own);
    }

    /// Scales the weights for a step of size `h`.
    pub(crate) fn scale(&mut self, h: f64) {
        let weights = self.plain.iter().zip(&self.powers);
        for (scaled, (w, &power)) in self.scaled.iter_mut().zip(weights) {
            *scaled = match power {
                0 => *w,
                _ => w * (h / self.time_scale).powi(power),
            };
        }
    }

    pub(crate) fn solution_tolerance(&self, i: usize) -> f64 {
        1.0 / (self.plain[i] * self.loosened)
    }

    /// Returns the unscaled error tolerance of component i of higher index.
    pub(crate) fn own_tolerance(&self, i: usize) -> f64 {
        1.0 / (self.plain[i] * self.own)
    }

    /// Returns the largest error of components of higher index, with unscaled weights, or 0 if there are no such
    /// components.
    pub(crate) fn largest_own(&self, error: impl Fn(usize) -> f64) -> f64 {
        let less = (0..self.powers.len()).filter(|&i| self.powers[i] > 0);
        let weighted = less.map(|i| (error(i) * self.plain[i] * self.own).abs());
        weighted.fold(0.0, f64::max)
    }

    /// Returns the weights at y.
    pub(crate) fn plain(&self) -> &[f64] {
        &self.plain
    }

    /// Returns the weights scaled for the step.
    pub(crate) fn scaled(&self) -> &[f64] {
        &self.scaled
    }
}
