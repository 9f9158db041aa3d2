//! Errors of multipliers of index 2 within a step, from the residual between the stages.

use myovib_dae::{LinearSolver, Problem};

use super::{Multiplier, Multipliers, profile};
use crate::dense::add_scaled;
use crate::failure::{Failure, Operation};
use crate::method::Method;
use crate::newton::{Step, evaluate};
use crate::work::Counters;

/// Ratio of e(ε) to its expected value above which a step is tested for a jump. The expected value is computed from the
/// last step and the power of h. For smooth solutions, the ratio is exceeded in a few percent of the steps.
const SUDDEN: f64 = 10.0;

/// Errors of a multiplier at the end of the step, computed from the residual between the stages.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WithinStep {
    pub(crate) variable: usize,
    /// Part of the residual that the leading error of a smooth solution does not explain.
    pub(crate) unexplained: f64,
    /// Difference between two measurements of the leading error: within the step, and from the last step.
    pub(crate) difference: f64,
}

impl Multipliers {
    /// Measures the errors of multipliers of index 2 in the middle of each interval between the stages, from the
    /// residual of the polynomial through the increments `z`. The values of `algebraic` variables at the start of the
    /// step are not used.
    ///
    /// For a smooth solution, the polynomial violates the constraint by −h ε ω(θ), and the polynomial through the
    /// multipliers at the stages has an error proportional to ℓ_0(θ). The iteration matrix converts the sum of these
    /// errors to −γ ω e(ε) − γ ℓ_0 κ. After a fit of e(ε) and κ, terms of higher order remain. If a multiplier jumps
    /// within the step, the remainder is as large as the jump.
    pub(crate) fn measure_within<P: Problem, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        step: &Step<'_>,
        (z, algebraic): (&[f64], &[usize]),
        counters: &mut Counters,
    ) -> Result<(), Failure> {
        let (n, method) = (step.y.len(), step.method);
        self.between.clear();
        for theta in middles(method) {
            self.y.copy_from_slice(step.y);
            self.y_dot.fill(0.0);
            for (j, z) in z.chunks_exact(n).enumerate() {
                let basis = method.basis(j, theta);
                add_scaled(&mut self.y, basis, z);
                let slope = method.basis_derivative(j, theta) / step.h;
                add_scaled(&mut self.y_dot, slope, z);
                let without_start = basis * (method.nodes()[j] / theta - 1.0);
                for &i in algebraic {
                    self.y[i] += without_start * z[i];
                }
            }
            let t = step.t + theta * step.h;
            evaluate(problem, t, &self.y, &self.y_dot, &mut self.residual, counters)?;
            counters.work.real_solves += 1;
            matrices
                .solve_real(problem, &mut self.residual)
                .map_err(Operation::LinearSolve.failed())?;
            let measured = self.list.iter().map(|m| self.residual[m.variable]);
            self.between.extend(measured);
        }
        let n_multipliers = self.list.len();
        for (k, multiplier) in self.list.iter_mut().enumerate() {
            let measured = self.between[k..].iter().step_by(n_multipliers);
            multiplier.within = fit_errors(method, measured.copied());
        }
        Ok(())
    }

    /// Returns the [measured](Self::measure_within) errors.
    pub(crate) fn within<'a>(&'a self, method: &Method) -> impl Iterator<Item = WithinStep> + 'a {
        let [at_end, _] = profile(method, 2, 1.0);
        self.of_index_2().map(move |multiplier| WithinStep {
            variable: multiplier.variable,
            unexplained: (at_end * multiplier.within[1]).abs(),
            difference: (at_end * (multiplier.within[0] - multiplier.missed)).abs(),
        })
    }

    /// Returns whether the error e(ε) of a multiplier of index 2 exceeds its `tolerance` and has grown much more than
    /// expected for a smooth solution since the previous step. `last` is the size of the previous step.
    pub(crate) fn grow_suddenly(
        &self,
        step: &Step<'_>,
        last: f64,
        tolerance: impl Fn(usize) -> f64,
    ) -> bool {
        let stages = step.method.stages();
        let [at_end, _] = profile(step.method, 2, 1.0);
        self.of_index_2().any(|multiplier| {
            let expected = multiplier.known.last * (step.h / last).powi(multiplier.power(stages));
            (at_end * multiplier.missed).abs() > tolerance(multiplier.variable)
                && multiplier.missed.abs() > SUDDEN * expected.abs()
        })
    }

    /// Uses the leading errors [measured](Self::measure_within) within a first step if they differ by more than the
    /// `tolerance` from the errors measured at the start of the step, where an input may have a kink.
    pub(crate) fn use_within(&mut self, method: &Method, tolerance: impl Fn(usize) -> f64) {
        let [at_end, _] = profile(method, 2, 1.0);
        for multiplier in self.list.iter_mut().filter(|m| m.is_tested()) {
            let [measured, _] = multiplier.within;
            let difference = at_end * (measured - multiplier.missed);
            if difference.abs() > tolerance(multiplier.variable) {
                multiplier.missed = measured;
            }
        }
    }

    /// Discards the measured errors of multipliers of index 2.
    pub(crate) fn discard(&mut self) {
        let multipliers = self.list.iter_mut().filter(|m| m.is_tested());
        multipliers.for_each(|multiplier| multiplier.missed = 0.0);
    }

    /// Returns whether there are multipliers of index 2 and no multipliers of index 3.
    pub(crate) fn are_of_index_2(&self) -> bool {
        self.largest_index() == 2 && self.of_index_2().next().is_some()
    }

    fn of_index_2(&self) -> impl Iterator<Item = &Multiplier> {
        self.list.iter().filter(|multiplier| multiplier.is_tested())
    }
}

/// Returns the midpoints of the intervals between the start and the stages.
fn middles(method: &Method) -> impl Iterator<Item = f64> + Clone {
    let starts = [0.0].into_iter().chain(method.nodes().iter().copied());
    starts.zip(method.nodes()).map(|(a, b)| 0.5 * (a + b))
}

/// Fits e(ε) and κ to the errors `measured` at the [`middles`]. Returns e(ε) and the largest remainder as a fraction of
/// the maximum of γ |ω|.
fn fit_errors(method: &Method, measured: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
    let gamma = method.real_mode().lambda;
    let profiles = |theta: f64| {
        let of_kappa = -gamma * method.start_basis(0, theta);
        [theta * of_kappa, of_kappa]
    };
    let points = || middles(method).map(profiles).zip(measured.clone());
    let sum = |term: fn([f64; 2], f64) -> f64| -> f64 { points().map(|(p, d)| term(p, d)).sum() };
    let squares = [sum(|[a, _], _| a * a), sum(|[_, b], _| b * b)];
    let mixed = sum(|[a, b], _| a * b);
    let right = [sum(|[a, _], d| a * d), sum(|[_, b], d| b * d)];
    let determinant = squares[0] * squares[1] - mixed * mixed;
    let epsilon = (right[0] * squares[1] - right[1] * mixed) / determinant;
    let kappa = (right[1] * squares[0] - right[0] * mixed) / determinant;
    let remainders = points().map(|([a, b], d)| (d - epsilon * a - kappa * b).abs());
    let largest = points().map(|([a, _], _)| a.abs()).fold(0.0, f64::max);
    [epsilon, remainders.fold(0.0, f64::max) / largest]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the fit for errors of the assumed form, and for errors of polynomials that interpolate a function with a
    /// kink between the last two stages.
    #[test]
    fn the_fit_leaves_only_errors_of_a_kink() {
        for stages in [3, 5, 7] {
            let method = Method::radau_iia(stages).unwrap();
            let gamma = method.real_mode().lambda;
            let smooth = middles(&method)
                .map(|theta| -gamma * method.start_basis(0, theta) * (2.0 * theta - 0.5));
            let [epsilon, remainder] = fit_errors(&method, smooth);
            // The bound covers rounding errors of about ten operations, amplified by the condition number of the fit
            // with two similar profiles.
            assert!((epsilon - 2.0).abs() < 1e-10, "{stages} stages: {epsilon}");
            assert!(remainder < 1e-10, "{stages} stages: {remainder}");

            let kink = 0.5 * (method.nodes()[stages - 2] + 1.0);
            let wave = |theta: f64| (theta - kink).max(0.0);
            let errors = middles(&method).map(|theta| {
                let values = method.nodes().iter().enumerate();
                let through: f64 = values.map(|(j, c)| method.basis(j, theta) * wave(*c)).sum();
                gamma * (through - wave(theta))
            });
            let [_, remainder] = fit_errors(&method, errors);
            let [at_end, _] = profile(&method, 2, 1.0);
            let slopes = (0..stages).map(|j| {
                let slope = method.basis_derivative(j, 1.0);
                slope * wave(method.nodes()[j])
            });
            let error = (slopes.sum::<f64>() - 1.0).abs();
            let ratio = (at_end * remainder).abs() / error;
            assert!((0.1..10.0).contains(&ratio), "{stages} stages: {ratio}");
        }
    }
}
