//! Radau IIA with forward sensitivities for a muscle and the chains it drives.

use myovib_dae::{LinearSolver, Problem};
use myovib_radau::{ForwardSensitivities, SensitivityWork};

use super::dependence::Dependences;
use super::driven::DrivenDependences;
use super::perturbed::PerturbedSystems;
use crate::coupling::{Body, CoupledDae, CoupledOptions, ErrorTest, SystemMatrices};
use crate::error::ModelError;
use crate::integration::integrator::{Advance, Integrator, forward_to_inner};
use crate::integration::radau::RadauIntegrator;
use crate::integration::settings::Settings;
use crate::muscle_dae::MuscleDae;
use crate::start::Consistent;

/// A function that computes quantities of a system for a state (t, y, ẏ).
pub type OutputFunction<'a, P> =
    dyn FnMut(&mut P, f64, &[f64], &[f64]) -> Result<Vec<f64>, ModelError> + 'a;

/// A muscle, with or without chains, integrated by Radau IIA from t = 0 together with ∂y/∂p.
pub struct SensitiveIntegrator<
    P: Problem = MuscleDae,
    M = SystemMatrices<MuscleDae>,
    Q = Dependences,
> {
    inner: RadauIntegrator<P, M>,
    sensitivities: ForwardSensitivities<Q>,
}

/// The integrator of a muscle with chains.
pub type DrivingIntegrator =
    SensitiveIntegrator<Driving, SystemMatrices<Driving>, DrivenDependences>;

/// A muscle and the networks that it drives.
type Driving = CoupledDae<MuscleDae>;

impl SensitiveIntegrator {
    /// Starts the integration of a muscle at t = 0 from a state with consistent derivatives. `dependences` also
    /// contains the derivatives of this state with respect to the parameters. Without parameters, only the motion is
    /// integrated.
    ///
    /// # Errors
    /// [`ModelError::Jump`] if there are parameters and a load jumps, [`ModelError::OnlyBdf`] if a setting is available
    /// only for BDF, [`ModelError::Radau`] if a setting of Radau IIA is invalid.
    pub fn starting_at(
        dae: MuscleDae,
        settings: &Settings,
        [y, y_dot]: [&[f64]; 2],
        dependences: Dependences,
    ) -> Result<Self, ModelError> {
        if dependences.count() > 0 {
            if dae.muscle().solid.has_inertia() {
                expect_no_jump(&dae, settings.t_end)?;
            } else if let Some(t) = dae.muscle().first_jump(settings.t_end) {
                // If only slopes jump, at times that do not depend on parameters, the state is continuous.
                return Err(ModelError::Jump { t });
            }
        }
        let starts = dependences.starts(dae.n_unknowns());
        let inner = RadauIntegrator::starting_at(dae, settings, 0.0, y, y_dot)?;
        let sensitivities = ForwardSensitivities::new(inner.solver(), dependences, starts)?;
        Ok(Self { inner, sensitivities })
    }
}

impl DrivingIntegrator {
    /// Starts the integration of a muscle with chains, as [`starting_at`](SensitiveIntegrator::starting_at) does.
    ///
    /// # Errors
    /// [`ModelError::Jump`] if there are parameters and a load jumps, [`ModelError::Radau`] if an option of Radau IIA
    /// is invalid.
    pub fn driving(
        dae: CoupledDae<MuscleDae>,
        (test, options): (ErrorTest, CoupledOptions),
        t_end: f64,
        [y, y_dot]: [&[f64]; 2],
        dependences: Dependences,
    ) -> Result<Self, ModelError> {
        if dependences.count() > 0 {
            expect_no_jump(&dae, t_end)?;
        }
        let dependences = DrivenDependences::new(dependences);
        let starts = dependences.starts(&dae);
        let (times, linear_solver) = ([0.0, t_end], options.linear_solver);
        let options = options.radau;
        let inner =
            RadauIntegrator::coupled_at(dae, test, options, linear_solver, times, y, y_dot)?;
        let sensitivities = ForwardSensitivities::new(inner.solver(), dependences, starts)?;
        Ok(Self { inner, sensitivities })
    }
}

impl<P, M, Q> SensitiveIntegrator<P, M, Q>
where
    P: Consistent,
    M: LinearSolver<P>,
    Q: PerturbedSystems<P>,
{
    /// Sets the tolerance of the linear systems for the sensitivities as a fraction of the tolerance of the
    /// integration.
    #[must_use]
    pub fn with_tolerance(self, tolerance: f64) -> Self {
        Self { sensitivities: self.sensitivities.with_tolerance(tolerance), ..self }
    }

    /// Includes the errors of the sensitivities in the step-size control.
    #[must_use]
    pub fn controlling_steps(self) -> Self {
        let sensitivities = self.sensitivities.controlling_steps(self.inner.solver());
        Self { sensitivities, ..self }
    }

    /// Returns the additional work of the sensitivities, beyond the work of the integration.
    pub fn work(&self) -> SensitivityWork {
        self.sensitivities.work()
    }

    /// Evaluates quantities at a time within the last step.
    pub fn read(
        &mut self,
        t: f64,
        read: &mut OutputFunction<'_, P>,
    ) -> Result<Vec<f64>, ModelError> {
        let [y, y_dot] = self.state(t)?;
        read(self.inner.problem_mut(), t, &y, &y_dot)
    }

    /// Returns the derivatives of quantities with respect to parameter j at a time within the last step. Each
    /// derivative is a central difference of the quantity along ∂y/∂p plus the explicit derivative; at a kink, it is
    /// NaN. `own` contains the values of the quantities.
    ///
    /// # Panics
    /// Panics if the parameter does not exist.
    pub fn derivative(
        &mut self,
        j: usize,
        t: f64,
        own: &[f64],
        read: &mut OutputFunction<'_, P>,
    ) -> Result<Vec<f64>, ModelError> {
        let [y, y_dot] = self.state(t)?;
        let n = y.len();
        let mut s = [vec![0.0; n], vec![0.0; n]];
        for (derivative, s) in s.iter_mut().enumerate() {
            self.sensitivities.dense_output(self.inner.solver(), j, t, derivative, s)?;
        }
        let parameters = self.sensitivities.parameters_mut();
        let scale = parameters.list()[j].scale;
        let problem = self.inner.problem();
        let mut total = parameters
            .reading_derivative(problem, j, own, &mut |other| read(other, t, &y, &y_dot))?;
        let mut slopes = vec![f64::NAN; own.len()];
        let mut bends = vec![f64::NAN; own.len()];
        for delta in STEPS.map(|step| step * scale) {
            let mut side = |sign: f64| {
                let moved = |of: &[f64], s: &[f64]| -> Vec<f64> {
                    let both = of.iter().zip(s);
                    both.map(|(y, s)| y + sign * delta * s).collect()
                };
                let (y, y_dot) = (moved(&y, &s[0]), moved(&y_dot, &s[1]));
                read(self.inner.problem_mut(), t, &y, &y_dot)
            };
            let [above, below] = [side(1.0)?, side(-1.0)?];
            for (k, slope) in slopes.iter_mut().enumerate() {
                let before = bends[k];
                bends[k] = (above[k] - 2.0 * own[k] + below[k]).abs();
                if slope.is_nan() && is_smooth([above[k], own[k], below[k]], [before, bends[k]]) {
                    *slope = (above[k] - below[k]) / (2.0 * delta);
                }
            }
            if slopes.iter().all(|slope| !slope.is_nan()) {
                break;
            }
        }
        let both = total.iter_mut().zip(slopes);
        both.for_each(|(total, slope)| *total += slope);
        Ok(total)
    }

    fn state(&mut self, t: f64) -> Result<[Vec<f64>; 2], ModelError> {
        let n = self.inner.problem().n_unknowns();
        let mut state = [vec![0.0; n], vec![0.0; n]];
        for (derivative, out) in state.iter_mut().enumerate() {
            self.inner.dense_output(t, derivative as u32, out)?;
        }
        Ok(state)
    }
}

/// Steps of finite differences along ∂y/∂p, in units of the parameter's scale p̄, because p̄ ∂y/∂p has the magnitude of
/// y. The first step, about ε^(1/3), balances truncation and rounding errors. Most readings are linear; the shorter
/// steps are used if a reading has a kink nearby.
const STEPS: [f64; 3] = [6e-6, 6e-9, 6e-12];

/// Returns whether three values at short, equal distances belong to a smooth function rather than a function with a
/// kink or jump in the middle. If all oscillators are at rest, the modulus and the argument of an order parameter have
/// such a kink or jump. `bends` contains the second differences over the previous step, if any, and over this step,
/// which is a thousand times shorter.
fn is_smooth([above, own, below]: [f64; 3], bends: [f64; 2]) -> bool {
    let [before, bend] = bends;
    if bend <= 0.1 * (above - below).abs() {
        return true;
    }
    match before.is_nan() {
        // The second difference is a rounding error, or the function has a flat maximum.
        true => bend <= 1e-9 * (above.abs() + own.abs() + below.abs()),
        // The second difference decreases to 1e-6 of its value if the function is smooth, but only to 1e-3 at a kink.
        false => bend <= 1e-5 * before,
    }
}

/// Rejects loads that jump before the end of the run. The state of a body with inertia may jump with a load, and
/// derivatives across such jumps are not implemented.
///
/// # Errors
/// [`ModelError::Jump`].
pub(super) fn expect_no_jump(system: &impl Body, t_end: f64) -> Result<(), ModelError> {
    let jump = system.schedule().next_jump(-t_end);
    match jump.filter(|t| *t < t_end) {
        Some(t) => Err(ModelError::Jump { t }),
        None => Ok(()),
    }
}

impl<P, M, Q> Integrator<P> for SensitiveIntegrator<P, M, Q>
where
    P: Consistent,
    M: LinearSolver<P>,
    Q: PerturbedSystems<P>,
{
    forward_to_inner!(P);

    fn advance(&mut self) -> Result<Advance, ModelError> {
        self.inner.pass_jump()?;
        if self.sensitivities.needs_reinit(self.inner.solver()) {
            // Only quasi-static bodies can reach a jump.
            let parameters = 0..self.sensitivities.n_parameters();
            let values = parameters.map(|j| self.sensitivities.of(j).to_vec());
            let values = values.collect();
            self.sensitivities.reinit(self.inner.solver(), values)?;
        }
        let advance = self.inner.advance()?;
        self.sensitivities.follow(self.inner.solver_mut())?;
        Ok(advance)
    }
}

#[cfg(test)]
mod tests {
    use super::{STEPS, is_smooth};

    /// Returns whether a function is classified as smooth at x with any of the steps.
    fn has_slope(x: f64, of: fn(f64) -> f64) -> bool {
        let mut before = f64::NAN;
        STEPS.into_iter().any(|step| {
            let values = [step, 0.0, -step].map(|d| of(x + d));
            let bend = (values[0] - 2.0 * values[1] + values[2]).abs();
            let bends = [std::mem::replace(&mut before, bend), bend];
            is_smooth(values, bends)
        })
    }

    #[test]
    fn slopes_are_missing_at_kinks_and_jumps_but_not_at_minima() {
        assert!(has_slope(3.0, |x| x * x) && has_slope(0.0, |x| x * x));
        assert!(has_slope(1.0, f64::sin) && has_slope(0.0, f64::cos));
        assert!(has_slope(0.3, |_| 0.1) && has_slope(0.0, |_| 0.0));
        assert!(!has_slope(0.0, f64::abs) && !has_slope(0.0, |x| 1.0 + x.abs()));
        assert!(!has_slope(0.0, |x| if x < 0.0 { 3.0 } else { 0.0 }));
        // The step is too short to reach the kink.
        assert!(has_slope(1e-7, f64::abs));
    }
}
