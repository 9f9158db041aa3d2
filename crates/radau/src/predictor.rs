//! Initial guesses for Newton's method.

use crate::dense::Collocation;
use crate::method::Method;

/// Initial stage increments, which are extrapolated from the polynomial of the last step, predicted from previous steps
/// in another way, or zero.
///
/// If a polynomial of degree s is extrapolated to a next step of the same size, the errors of its coefficients are
/// amplified by about 10^(s/2). For short steps, several digits of the extrapolated values are correct. For the long
/// steps that a high order allows, zero may be a better guess. Therefore, the type of guess that would have been more
/// accurate in the previous step is used.
#[derive(Debug)]
pub(crate) struct Predictor {
    continued: Vec<f64>,
    continues: bool,
}

impl Predictor {
    pub(crate) fn new(method: &Method, n: usize) -> Self {
        Self { continued: vec![0.0; method.stages() * n], continues: true }
    }

    /// Writes the initial values of `z` for a step of size `h` from (`t`, `y`), where the step `last` ends.
    pub(crate) fn start(
        &mut self,
        method: &Method,
        last: &Collocation,
        (t, h): (f64, f64),
        y: &[f64],
        z: &mut [f64],
    ) {
        self.start_with(z, |continued| last.extrapolate(method, t, h, y, continued));
    }

    /// Writes initial values as [`start`](Self::start) does: either zeros or the prediction written by `continue_to`.
    pub(crate) fn start_with(&mut self, z: &mut [f64], continue_to: impl FnOnce(&mut [f64])) {
        continue_to(&mut self.continued);
        match self.continues {
            true => z.copy_from_slice(&self.continued),
            false => z.fill(0.0),
        }
    }

    /// Starts the next step from zero, because the last step cannot predict its values.
    pub(crate) fn forget(&mut self) {
        self.continues = false;
    }

    /// Returns whether the polynomial of the last step is extrapolated, which is the only state between steps.
    pub(crate) fn continues(&self) -> bool {
        self.continues
    }

    /// Restores the result of [`continues`](Self::continues).
    pub(crate) fn restore(&mut self, continues: bool) {
        self.continues = continues;
    }

    /// Selects the type of guess for the next step from the final increments `z` of this step.
    pub(crate) fn learn(&mut self, z: &[f64], weights: &[f64]) {
        let mut squares = [0.0, 0.0];
        let stages = z.chunks_exact(weights.len());
        let continued = self.continued.chunks_exact(weights.len());
        for (z, continued) in stages.zip(continued) {
            for ((z, continued), w) in z.iter().zip(continued).zip(weights) {
                squares[0] += ((z - continued) * w).powi(2);
                squares[1] += (z * w).powi(2);
            }
        }
        self.continues = squares[0] < squares[1];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closer_start_of_the_last_step_is_taken_next() {
        let method = Method::radau_iia(1).expect("there is one");
        // y = 1 + t up to t = 1. The extrapolation reaches 3 in the next step.
        let last = Collocation::line(&method, 0.0, &[1.0], &[1.0]);
        let mut predictor = Predictor::new(&method, 1);
        let mut z = [0.0];
        let mut start = |predictor: &mut Predictor| {
            predictor.start(&method, &last, (1.0, 1.0), &[2.0], &mut z);
            z[0]
        };
        assert!((start(&mut predictor) - 1.0).abs() < 1e-15);
        predictor.learn(&[0.4], &[1.0]);
        assert_eq!(start(&mut predictor), 0.0);
        predictor.learn(&[0.6], &[1.0]);
        assert!((start(&mut predictor) - 1.0).abs() < 1e-15);
    }
}
