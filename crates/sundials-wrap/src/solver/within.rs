//! Check of the equations within a step.

use myovib_dae::{Problem, StepError};

use super::linear::Linear;

/// Number of points within a step at which F is evaluated.
const POINTS: usize = 10;

/// Threshold for the mean residual within a step, in units of the tolerances. A larger residual indicates an undetected
/// input; in a smooth step, the residual is below 1.
const UNSEEN: f64 = 10.0;

/// Search for inputs that act between the ends of a step.
///
/// IDAS evaluates F only at the ends of steps. If the prediction satisfies F there, an input that acts within the step
/// is not detected. As long as the equations are at rest at the ends of steps, the step size doubles without limit.
#[derive(Debug, Default)]
pub(super) struct WithinStep {
    /// Start of the current step; empty vectors if it is unknown.
    start: End,
    /// Prediction at the end of the current step.
    end: End,
    between: End,
    residual: Vec<f64>,
    mean: Vec<f64>,
    /// Number of evaluations of F.
    pub(super) evaluations: u64,
}

#[derive(Debug, Default)]
struct End {
    t: f64,
    y: Vec<f64>,
    y_dot: Vec<f64>,
}

impl End {
    fn set(&mut self, t: f64, y: &[f64], y_dot: &[f64]) {
        self.t = t;
        for (own, given) in [(&mut self.y, y), (&mut self.y_dot, y_dot)] {
            own.clear();
            own.extend_from_slice(given);
        }
    }
}

impl WithinStep {
    /// Forgets the start of the step. The end of the step is then accepted without a check within the step.
    pub(super) fn forget_start(&mut self) {
        self.start.y.clear();
    }

    /// Sets the start of the next step.
    pub(super) fn start_at(&mut self, t: f64, y: &[f64], y_dot: &[f64]) {
        self.start.set(t, y, y_dot);
    }

    /// Sets the start of the next step. `write(k, out)` writes the k-th derivative of y at the start.
    pub(super) fn write_start<E>(
        &mut self,
        t: f64,
        mut write: impl FnMut(i32, &mut Vec<f64>) -> Result<(), E>,
    ) -> Result<(), E> {
        self.start.t = t;
        write(0, &mut self.start.y)?;
        write(1, &mut self.start.y_dot)
    }

    /// Sets the values at the end of the step, where IDAS evaluates F.
    pub(super) fn end_at(&mut self, t: f64, y: &[f64], y_dot: &[f64]) {
        self.end.set(t, y, y_dot);
    }

    /// Returns whether an input acts between the start and the end of the step.
    ///
    /// The solution is approximated by a cubic polynomial from the values and slopes at both ends. The Newton matrix
    /// converts the residuals of this polynomial to errors of y.
    ///
    /// # Errors
    /// Returns errors of the residual or of the linear solver.
    pub(super) fn acts<P: Problem>(
        &mut self,
        problem: &mut P,
        linear: &mut Linear<P>,
        weights: &[f64],
    ) -> Result<bool, StepError> {
        let (start, end, n) = (&self.start, &self.end, self.start.y.len());
        let h = end.t - start.t;
        if n == 0 || h == 0.0 {
            return Ok(false);
        }
        self.between.set(start.t, &start.y, &start.y_dot);
        self.residual.resize(n, 0.0);
        self.mean.clear();
        self.mean.resize(n, 0.0);
        for point in 1..=POINTS {
            let s = point as f64 / (POINTS + 1) as f64;
            for i in 0..n {
                let change = end.y[i] - start.y[i];
                let (a, b) = (h * start.y_dot[i] - change, change - h * end.y_dot[i]);
                let bend = (1.0 - s) * a + s * b;
                self.between.y[i] = start.y[i] + s * change + s * (1.0 - s) * bend;
                let slope = change + (1.0 - 2.0 * s) * bend + s * (1.0 - s) * (b - a);
                self.between.y_dot[i] = slope / h;
            }
            let (y, y_dot) = (&self.between.y, &self.between.y_dot);
            self.evaluations += 1;
            problem.residual(start.t + s * h, y, y_dot, &mut self.residual)?;
            linear.solve(problem, &mut self.residual)?;
            for (mean, error) in self.mean.iter_mut().zip(&self.residual) {
                *mean += error / POINTS as f64;
            }
        }
        let squares: f64 = self.mean.iter().zip(weights).map(|(e, w)| (e * w).powi(2)).sum();
        Ok((squares / n as f64).sqrt() > UNSEEN)
    }
}
