//! Error of dense output within a step.

use crate::dense::{Collocation, add_scaled};
use crate::newton::Step;

/// Estimates the error of dense output between the ends of a step.
///
/// The error estimate of a step covers only the differential variables. For an algebraic variable on which no other
/// variable depends, the estimate is zero, even if the polynomial between the nodes is far from the solution.
/// Therefore, the polynomial û of a step is extrapolated backward to the start t_{n−1} of the previous step, where y is
/// known. To leading order, the error of û at t_n + θ h is
/// - C ψ(θ) in algebraic variables, with ψ = θ ℓ_0,
/// - C q(θ) in differential variables, with q = ∫ θ ℓ_0,
/// - C (ψ − r)(θ), with the ramp r, in differential variables determined by constraints.
///
/// The difference at t_{n−1} determines C. The estimate does not require an evaluation of F. It also detects a kink of
/// the solution within either of the two steps.
#[derive(Debug)]
pub(crate) struct Interpolation {
    /// Whether dense output is used. If so, its error is limited to the tolerances.
    pub(crate) active: bool,
    /// Difference between û and y at t_{n−1}.
    difference: Vec<f64>,
}

/// Safety factor for terms of higher order and for a derivative that grows within the step.
const MARGIN: f64 = 3.0;

/// Number of points of the unit interval at which the profiles of the error are compared.
const POINTS: usize = 32;

impl Interpolation {
    pub(crate) fn new(active: bool, n: usize) -> Self {
        Self { active, difference: vec![0.0; n] }
    }

    /// Measures the error of the step with increments `z`, which [`of`](Self::of) then returns. The step follows the
    /// step `last` and starts with the derivative `y_dot`.
    pub(crate) fn measure(
        &mut self,
        step: &Step<'_>,
        z: &[f64],
        (y_dot, algebraic): (&[f64], &[usize]),
        last: &Collocation,
    ) {
        let Step { method, h, y, .. } = *step;
        let tau = (last.t0 - step.t) / h;
        let ramp = method.ramp(tau);
        let difference = &mut self.difference;
        difference.copy_from_slice(y);
        add_scaled(difference, -1.0, &last.y0);
        add_scaled(difference, h * ramp, y_dot);
        for (j, z) in z.chunks_exact(y.len()).enumerate() {
            let basis = method.basis(j, tau) - ramp * method.basis_derivative(j, 0.0);
            add_scaled(difference, basis, z);
        }
        let profiles = |theta: f64| {
            let psi = theta * method.start_basis(0, theta);
            [psi, psi - method.ramp(theta), method.second_ramp(theta)]
        };
        let mut largest = [0.0_f64; 3];
        for k in 1..POINTS {
            let values = profiles(k as f64 / POINTS as f64);
            (0..3).for_each(|i| largest[i] = largest[i].max(values[i].abs()));
        }
        let at_tau = profiles(tau);
        let [of_u, of_values, of_slopes] = std::array::from_fn(|i| (largest[i] / at_tau[i]).abs());
        for &i in algebraic {
            let z_i = z[i..].iter().step_by(y.len()).enumerate();
            let slope: f64 = z_i.map(|(j, z)| method.basis_derivative(j, 0.0) * z).sum();
            difference[i] -= ramp * (h * y_dot[i] - slope);
            difference[i] *= of_u / of_values.max(of_slopes);
        }
        let scale = of_values.max(of_slopes);
        difference.iter_mut().for_each(|d| *d *= scale);
    }

    /// Returns the largest error of variable i within the step.
    pub(crate) fn of(&self, i: usize) -> f64 {
        MARGIN * self.difference[i].abs()
    }
}
