//! The weights of components in norms: the inverses of their tolerances.

use myovib_dae::{Problem, StepError};

use crate::failure::{Failure, Operation};
use crate::options::RadauOptions;

/// A user's weights: fills in weights at y.
pub(crate) type UserWeights<P> =
    Box<dyn FnMut(&mut P, &[f64], &mut [f64]) -> Result<(), StepError> + Send>;

/// Weights at the beginning of a step, and as they count in it.
pub(crate) struct Weights<P> {
    user: Option<UserWeights<P>>,
    /// Inverse tolerances at y.
    plain: Vec<f64>,
    /// The powers of h by which errors count less.
    powers: Vec<i32>,
    /// The product of both.
    scaled: Vec<f64>,
    /// The factor on the weights of variables that count less, for their own errors.
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
    pub(crate) fn new(user: Option<UserWeights<P>>, powers: Vec<i32>, own: f64) -> Self {
        Self {
            user,
            own,
            plain: vec![0.0; powers.len()],
            scaled: vec![0.0; powers.len()],
            powers,
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

    /// Writes what the weights would be at `y`, scaled for a step of size `h`; those in use stay.
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
            *w *= h.powi(power);
        }
        Ok(())
    }
}

/// Writes the inverse tolerances at `y`.
fn write<P>(
    user: &mut Option<UserWeights<P>>,
    problem: &mut P,
    options: &RadauOptions,
    y: &[f64],
    out: &mut [f64],
) -> Result<(), Failure> {
    let Some(user) = user else {
        let (relative, absolute) = options.internal_tolerances();
        for (i, (w, y)) in out.iter_mut().zip(y).enumerate() {
            // Where a relative tolerance alone meets y = 0, the weight is huge but finite.
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
    /// The relative tolerance for the estimate that a user's weights at `y` mean: the smallest of
    /// 1/(w |y|). `None` for weights that follow from the options, and where y is 0.
    pub(crate) fn implied_relative(&self, y: &[f64]) -> Option<f64> {
        self.user.as_ref()?;
        let relative = self.plain.iter().zip(y).map(|(w, y)| 1.0 / (w * y.abs()));
        let smallest = relative.fold(f64::INFINITY, f64::min);
        smallest.is_finite().then_some(smallest)
    }

    /// Whether a function gives the weights.
    pub(crate) fn are_given(&self) -> bool {
        self.user.is_some()
    }

    /// Sets the factor on the weights of variables that count less, for their own errors.
    pub(crate) fn set_own(&mut self, own: f64) {
        self.own = own;
    }

    /// Scales the weights for a step of size `h`.
    pub(crate) fn scale(&mut self, h: f64) {
        let weights = self.plain.iter().zip(&self.powers);
        for (scaled, (w, &power)) in self.scaled.iter_mut().zip(weights) {
            *scaled = match power {
                0 => *w,
                _ => w * h.powi(power),
            };
        }
    }

    /// The error that the variable i, which counts less, may have itself.
    pub(crate) fn own_tolerance(&self, i: usize) -> f64 {
        1.0 / (self.plain[i] * self.own)
    }

    /// The largest of the `errors` of variables that count less, weighed for themselves; 0 where
    /// there are none.
    pub(crate) fn largest_own(&self, error: impl Fn(usize) -> f64) -> f64 {
        let less = (0..self.powers.len()).filter(|&i| self.powers[i] > 0);
        let weighted = less.map(|i| (error(i) * self.plain[i] * self.own).abs());
        weighted.fold(0.0, f64::max)
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
