//! Check of the equations between the ends of a step.

use crate::draw::draw;
use crate::problem::{Problem, StepError};

/// Equation violated between the ends of a step.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Unsatisfied {
    /// Index of the equation.
    pub equation: usize,
    /// Time at which the residual was evaluated.
    pub t: f64,
    /// Residual divided by the change that errors of y and ẏ within the tolerances cause.
    pub ratio: f64,
}

/// Number of random perturbations used to measure the effect of errors within the tolerances.
const PERTURBATIONS: u64 = 4;

/// Residuals above this ratio are reported. Between the ends of a step, errors of y may be several times the tolerance,
/// and errors of ẏ may be several times the tolerance divided by the step size. The value 2500 allows a factor of 50
/// for each.
const MAX_RESIDUAL_RATIO: f64 = 2500.0;

/// Checks F(t, y, ẏ) at a time within a step of size `h`, with y and ẏ from the dense output. `weights` contains the
/// reciprocals of the tolerances.
///
/// Integrators evaluate F only at the ends of steps or at stages. The error test does not detect an input that acts
/// between these times or oscillates many times within a step. In this case, dense output does not satisfy the
/// equations. As dense output never satisfies the equations exactly, the residual is compared with its change when y
/// and ẏ are perturbed by their tolerances, 1/w and 1/(w h). The check costs five evaluations of F.
///
/// # Errors
/// Returns errors of the residual, for example if the dense output is outside the domain of F.
pub fn check_between<P: Problem + ?Sized>(
    problem: &mut P,
    (t, y, y_dot): (f64, &[f64], &[f64]),
    h: f64,
    weights: &[f64],
) -> Result<Option<Unsatisfied>, StepError> {
    let n = y.len();
    let mut residual = vec![0.0; n];
    problem.residual(t, y, y_dot, &mut residual)?;
    let (mut explained, mut changed) = (vec![0.0_f64; n], vec![0.0; n]);
    for trial in 0..PERTURBATIONS {
        let sign = |i: usize| draw(trial, i).signum();
        let moved: Vec<f64> = (0..n).map(|i| y[i] + sign(i) / weights[i]).collect();
        let rates = (0..n).map(|i| y_dot[i] + sign(n + i) / (weights[i] * h));
        let rates: Vec<f64> = rates.collect();
        problem.residual(t, &moved, &rates, &mut changed)?;
        for i in 0..n {
            explained[i] = explained[i].max((changed[i] - residual[i]).abs());
        }
    }
    // Equations that no perturbation changes are not checked, because the scale of their residual is unknown.
    let ratios = (0..n).filter(|&i| explained[i] > 0.0);
    let ratios = ratios.map(|i| (i, residual[i].abs() / explained[i]));
    let worst = ratios.max_by(|a, b| a.1.total_cmp(&b.1));
    let far = worst.filter(|&(_, ratio)| ratio > MAX_RESIDUAL_RATIO);
    Ok(far.map(|(equation, ratio)| Unsatisfied { equation, t, ratio }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ẏ = 1 + sin² ωt
    struct Heater {
        omega: f64,
    }

    impl Problem for Heater {
        fn n_unknowns(&self) -> usize {
            1
        }

        fn residual(
            &mut self,
            t: f64,
            _: &[f64],
            v: &[f64],
            r: &mut [f64],
        ) -> Result<(), StepError> {
            r[0] = v[0] - 1.0 - (self.omega * t).sin().powi(2);
            Ok(())
        }
    }

    /// Checks that a solution that follows only the mean of the input is reported, and that an error of ten tolerances
    /// is not reported.
    #[test]
    fn an_input_that_is_not_seen_is_reported() {
        let (h, weights) = (1.0, [1e6]);
        let mut fast = Heater { omega: 1e4 };
        let seen = check_between(&mut fast, (0.3, &[0.3], &[1.0]), h, &weights).unwrap();
        assert_eq!(seen.map(|found| found.equation), Some(0));
        let mut slow = Heater { omega: 1.0 };
        let rate = 1.0 + 0.3_f64.sin().powi(2) + 1e-5;
        let seen = check_between(&mut slow, (0.3, &[0.3], &[rate]), h, &weights).unwrap();
        assert_eq!(seen, None);
    }
}
