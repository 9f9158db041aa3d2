//! A network of oscillators and its forcing.

use std::f64::consts::TAU;
use std::sync::Arc;

use myovib_oscillators::{Drive, Network};

use super::recording::Recording;
use super::step_motion::{StepMotion, StepPoint};
use crate::error::ModelError;
use crate::reading::displacement::Displacement;
use crate::signal::Signal;
use crate::signal::schedule::Schedule;
use myovib_sparse::Scalar;

/// Source of the displacement u in the forcing γ u of one direction.
#[derive(Debug, Clone, Default)]
pub enum Source {
    /// Zero displacement: the oscillators are free.
    #[default]
    Rest,
    /// A point of the body in the same system.
    Body(Displacement),
    /// A given function of time.
    Given(Signal),
    /// A previously recorded motion.
    Recorded(Arc<Recording>),
    /// A point of a separately integrated body.
    Step(StepPoint),
}

impl Source {
    /// Returns u at time `t` for the unknowns `y` of the body, or `None` if a recording does not cover `t`.
    pub(super) fn displacement(&self, t: f64, y: &[f64]) -> Option<f64> {
        Some(match self {
            Self::Rest => 0.0,
            Self::Body(point) => point.at(t, y),
            Self::Given(signal) => signal.at(t).value,
            Self::Recorded(recording) => return recording.at(t),
            Self::Step(point) => point.at(t),
        })
    }

    /// Returns the index of the point of a separately integrated body.
    pub(super) fn step_point(&self) -> Option<usize> {
        match self {
            Self::Step(point) => Some(point.number()),
            Self::Rest | Self::Body(_) | Self::Given(_) | Self::Recorded(_) => None,
        }
    }

    /// Returns the unknowns of the body on which u depends, with their weights. Empty unless the source is a point of the
    /// body in the same system.
    pub(super) fn unknowns(&self) -> &[(usize, f64)] {
        match self {
            Self::Body(point) => &point.unknowns,
            Self::Rest | Self::Given(_) | Self::Recorded(_) | Self::Step(_) => &[],
        }
    }

    /// Returns wᵀ `body`, the change of u if the body's unknowns change by `body`.
    fn change<T: Scalar>(&self, body: &[T]) -> T {
        let terms = self.unknowns().iter().map(|&(i, weight)| body[i] * weight);
        terms.fold(T::zero(), |sum, term| sum + term)
    }
}

/// Oscillators as part of a coupled system.
#[derive(Debug, Clone)]
pub struct Oscillators {
    network: Network,
    drive: Drive,
    sources: Vec<Source>,
}

impl Oscillators {
    /// Creates a network driven by one source per direction of its forcing. Only the gain γ of
    /// `drive` is used; the network determines the forced oscillators.
    ///
    /// # Errors
    /// Returns [`ModelError::OutOfRange`] if the gain is not finite, and [`ModelError::Sources`] if the number of
    /// sources differs from the number of directions.
    pub fn new(network: Network, drive: Drive, sources: Vec<Source>) -> Result<Self, ModelError> {
        if !drive.gain.is_finite() {
            return Err(ModelError::OutOfRange {
                name: "gamma",
                value: drive.gain,
                allowed: "finite",
            });
        }
        if sources.len() != network.n_channels() {
            return Err(ModelError::Sources { needed: network.n_channels(), given: sources.len() });
        }
        Ok(Self { network, drive, sources })
    }

    /// Replaces the points of the body in the sources by their `motion` over the body's steps, and appends these
    /// points to `places`.
    pub(super) fn following(
        mut self,
        motion: &Arc<StepMotion>,
        places: &mut Vec<Displacement>,
    ) -> Self {
        for source in &mut self.sources {
            if let Source::Body(place) = source {
                let point = StepPoint::new(motion, places.len(), place);
                places.push(std::mem::take(place));
                *source = Source::Step(point);
            }
        }
        self
    }

    /// Returns the equations of the oscillators.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// Returns the drive passed to [`new`](Self::new), of which only the gain is used.
    pub fn drive(&self) -> Drive {
        self.drive
    }

    /// Adds the excitation from outside the system and the oscillators' periods to `schedule`.
    pub(super) fn add_to(&self, schedule: &mut Schedule) {
        schedule.add_own_times(self.network.omega().iter().map(|omega| TAU / omega));
        for source in &self.sources {
            match source {
                Source::Given(signal) => schedule.add(signal.clone(), 0),
                Source::Recorded(recording) => schedule.add(recording.clone(), 0),
                Source::Step(point) => schedule.add(point.motion().clone(), 0),
                // The body's own schedule contains the prescribed motion of the point.
                Source::Rest | Source::Body(_) => {}
            }
        }
    }

    /// Subtracts γ e wᵀ `body` from `rows`. This is the effect of a change of the body's unknowns on the equations of
    /// the oscillators.
    pub(super) fn subtract_forcing<T: Scalar>(&self, body: &[T], rows: &mut [T]) {
        for (channel, source) in self.sources.iter().enumerate() {
            let change = source.change(body) * self.drive.gain;
            for row in self.network.forced_rows(channel) {
                rows[row] -= change;
            }
        }
    }

    /// Subtracts γ e wᵀ `body` for matrices of `n_columns` columns in row-major order.
    pub(crate) fn subtract_forcing_columns(
        &self,
        body: &[f64],
        rows: &mut [f64],
        n_columns: usize,
    ) {
        for (channel, source) in self.sources.iter().enumerate() {
            for column in 0..n_columns {
                let terms = source.unknowns().iter();
                let change: f64 =
                    terms.map(|&(i, weight)| weight * body[i * n_columns + column]).sum();
                for row in self.network.forced_rows(channel) {
                    rows[row * n_columns + column] -= self.drive.gain * change;
                }
            }
        }
    }

    /// Returns γ e with all directions of the forcing in one vector.
    pub(super) fn forcing(&self) -> Vec<f64> {
        let mut forcing = vec![0.0; self.network.n_states()];
        for channel in 0..self.sources.len() {
            for row in self.network.forced_rows(channel) {
                forcing[row] = self.drive.gain;
            }
        }
        forcing
    }

    /// Subtracts J_o⁻¹ γ e wᵀ `body` from `states`, given the `response` J_o⁻¹ γ e to all directions of the forcing.
    /// Each direction acts on different oscillators.
    pub(super) fn subtract_response<T: Scalar>(
        &self,
        response: &[T],
        body: &[T],
        states: &mut [T],
    ) {
        let n = self.network.n_oscillators();
        let (positions, velocities) = states.split_at_mut(n);
        let of_response = response.split_at(n);
        for (channel, source) in self.sources.iter().enumerate() {
            let change = source.change(body);
            let own = self.network.reached(channel);
            let parts = [
                (&mut positions[own.clone()], &of_response.0[own.clone()]),
                (&mut velocities[own.clone()], &of_response.1[own]),
            ];
            for (states, response) in parts {
                for (state, &response) in states.iter_mut().zip(response) {
                    *state -= change * response;
                }
            }
        }
    }

    /// Returns the sources, one per direction.
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }
}
