//! The map of a system over one period.

use myovib_dae::{VariableKind, kinds_at};

use crate::error::ModelError;
use crate::integration::integrator::Integrator;
use crate::integration::run::{Observer, run};
use crate::integration::statistics::{Counts, EndReason, Outcome};
use crate::start::Consistent;

/// Time interval of an integration, with its step control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Start and end, s.
    pub times: [f64; 2],
    /// Constant step size (s), or `None` for adaptive steps.
    pub fixed_step: Option<f64>,
    /// Factor by which the tolerances are multiplied.
    pub tolerance_factor: f64,
}

/// Function that creates an integrator for an interval, starting from consistent y and ẏ.
pub trait StartInterval<P>:
    FnMut(P, Interval, &[f64], &[f64]) -> Result<Box<dyn Integrator<P>>, ModelError>
{
}

impl<P, S> StartInterval<P> for S where
    S: FnMut(P, Interval, &[f64], &[f64]) -> Result<Box<dyn Integrator<P>>, ModelError>
{
}

/// Map of a system over one period, computed by time integration.
///
/// The unknowns of the map are the differential variables. Before each integration, they are projected onto the
/// constraints ([`Consistent`]), which also determines the algebraic variables and the derivatives. A periodic state
/// satisfies the constraints, because the state at the end of an integration satisfies them.
pub struct PeriodMap<P, S> {
    dae: P,
    start: S,
    interval: Interval,
    differential: Vec<usize>,
    n_unknowns: usize,
    evaluations: u64,
    counts: Counts,
}

impl<P: Consistent + Clone, S: StartInterval<P>> PeriodMap<P, S> {
    /// Creates the map from the first to the second of the `times` (s). `y` may be any state.
    ///
    /// # Errors
    /// Errors of the problem.
    pub fn new(mut dae: P, start: S, times: [f64; 2], y: &[f64]) -> Result<Self, ModelError> {
        let [y, y_dot] = dae.consistent(times[0], y)?;
        let kinds = kinds_at(&mut dae, times[0], &y, &y_dot)?;
        let differential = (0..y.len()).filter(|&i| kinds[i] == VariableKind::Differential);
        Ok(Self {
            differential: differential.collect(),
            n_unknowns: y.len(),
            dae,
            start,
            interval: Interval { times, fixed_step: None, tolerance_factor: 1.0 },
            evaluations: 0,
            counts: Counts::default(),
        })
    }

    /// Returns the differential variables of a state.
    pub fn restrict(&self, y: &[f64]) -> Vec<f64> {
        self.differential.iter().map(|&i| y[i]).collect()
    }

    /// Returns the indices of the differential variables.
    pub fn differential(&self) -> &[usize] {
        &self.differential
    }

    /// Returns the number of unknowns of the system.
    pub fn n_unknowns(&self) -> usize {
        self.n_unknowns
    }

    /// Returns the system for evaluations outside the integrations.
    pub fn problem_mut(&mut self) -> &mut P {
        &mut self.dae
    }

    /// Sets the number of equal steps for all further integrations; `None` selects adaptive steps. With equal steps,
    /// the final state is a smooth function of the initial state. Fast vibrations of a deviation then decay instead of
    /// shortening the steps.
    pub fn set_steps(&mut self, n_steps: Option<u64>) {
        let [from, to] = self.interval.times;
        self.interval.fixed_step = n_steps.map(|n| (to - from) / n as f64);
    }

    /// Multiplies the tolerances of the integrator by `factor` in all further integrations.
    pub fn set_tolerance_factor(&mut self, factor: f64) {
        self.interval.tolerance_factor = factor;
    }

    /// Returns the factor by which the tolerances of the integrator are multiplied.
    pub fn tolerance_factor(&self) -> f64 {
        self.interval.tolerance_factor
    }

    /// Returns the number of integrations.
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// Returns the work counts of all integrations together.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Returns consistent y and ẏ at the start of the period for the differential variables `state`.
    ///
    /// # Errors
    /// Errors of [`Consistent::consistent`].
    pub fn consistent(&mut self, state: &[f64]) -> Result<[Vec<f64>; 2], ModelError> {
        let mut y = vec![0.0; self.n_unknowns];
        for (&i, value) in self.differential.iter().zip(state) {
            y[i] = *value;
        }
        self.dae.consistent(self.interval.times[0], &y)
    }

    /// Returns the differential variables after one period.
    ///
    /// # Errors
    /// Errors of [`consistent`](Self::consistent) and of the integrator; [`ModelError::PeriodStopped`] if the
    /// integration ends early.
    pub fn map(&mut self, state: &[f64]) -> Result<Vec<f64>, ModelError> {
        self.observed(state, &mut [])
    }

    /// Returns the differential variables after one period and calls the observers after each step.
    ///
    /// # Errors
    /// As for [`map`](Self::map).
    pub fn observed(
        &mut self,
        state: &[f64],
        observers: &mut [&mut dyn Observer<P>],
    ) -> Result<Vec<f64>, ModelError> {
        let [y, y_dot] = self.consistent(state)?;
        let mut integrator = (self.start)(self.dae.clone(), self.interval, &y, &y_dot)?;
        let ended = run(&mut *integrator, observers)?;
        self.evaluations += 1;
        self.counts = self.counts.followed_by(ended.counts);
        match ended.outcome {
            Outcome::Finished => {
                let mut y = vec![0.0; self.n_unknowns];
                integrator.dense_output(self.interval.times[1], 0, &mut y)?;
                Ok(self.restrict(&y))
            }
            outcome if outcome.reason() == Some(EndReason::Interrupted) => {
                Err(ModelError::Interrupted)
            }
            outcome => Err(ModelError::PeriodStopped {
                t: ended.t_reached,
                message: outcome.message().unwrap_or_default().to_owned(),
            }),
        }
    }
}
