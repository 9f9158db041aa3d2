//! A network of oscillators and what drives it.

use std::f64::consts::TAU;
use std::sync::Arc;

use myovib_oscillators::{Drive, Network};

use super::recording::Recording;
use crate::error::ModelError;
use crate::reading::displacement::Displacement;
use crate::signal::Signal;
use crate::signal::schedule::Schedule;
use myovib_sparse::Scalar;

/// The displacement u in the forcing γ u of one direction.
#[derive(Debug, Clone, Default)]
pub enum Source {
    /// None: the oscillators are free.
    #[default]
    Rest,
    /// A point of the body in the same system.
    Body(Displacement),
    /// A given function of time.
    Given(Signal),
    /// A motion recorded before.
    Recorded(Arc<Recording>),
}

impl Source {
    /// u at time `t` for the unknowns `y` of the body; `None` beyond the end of a recording.
    pub(super) fn displacement(&self, t: f64, y: &[f64]) -> Option<f64> {
        Some(match self {
            Self::Rest => 0.0,
            Self::Body(point) => point.at(t, y),
            Self::Given(signal) => signal.at(t).value,
            Self::Recorded(recording) => return recording.at(t),
        })
    }

    /// The body's unknowns that make up u, with their weights.
    pub(super) fn unknowns(&self) -> &[(usize, f64)] {
        match self {
            Self::Body(point) => &point.unknowns,
            Self::Rest | Self::Given(_) | Self::Recorded(_) => &[],
        }
    }

    /// The change of u with a change of the body's unknowns: wᵀ `body`.
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
    /// A network driven by one source per direction of its forcing; of `drive` the gain γ is used
    /// (whom it reaches is part of the network).
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] for a gain that is not finite, [`ModelError::Sources`] for
    /// another number of sources than directions.
    pub fn new(network: Network, drive: Drive, sources: Vec<Source>) -> Result<Self, ModelError> {
        if !drive.gain.is_finite() {
            return Err(ModelError::OutOfRange {
                name: "gamma",
                value: drive.gain,
                allowed: "finite",
            });
        }
        if sources.len() != network.n_channels() {
            return Err(ModelError::Sources {
                needed: network.n_channels(),
                given: sources.len(),
            });
        }
        Ok(Self {
            network,
            drive,
            sources,
        })
    }

    /// The equations of the oscillators.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// The gain and reach of the forcing.
    pub fn drive(&self) -> Drive {
        self.drive
    }

    /// Adds what drives them from outside the system, and their periods.
    pub(super) fn add_to(&self, schedule: &mut Schedule) {
        schedule.add_own_times(self.network.omega().iter().map(|omega| TAU / omega));
        for source in &self.sources {
            match source {
                Source::Given(signal) => schedule.add(signal.clone(), 0),
                Source::Recorded(recording) => schedule.add(recording.clone(), 0),
                // What is prescribed at the point drives the body too.
                Source::Rest | Source::Body(_) => {}
            }
        }
    }

    /// `rows` −= γ e wᵀ `body`: what a change of the body's unknowns does to the equations.
    pub(super) fn subtract_forcing<T: Scalar>(&self, body: &[T], rows: &mut [T]) {
        for (channel, source) in self.sources.iter().enumerate() {
            let change = source.change(body) * self.drive.gain;
            for row in self.network.forced_rows(channel) {
                rows[row] -= change;
            }
        }
    }

    /// The same for several columns side by side.
    pub(crate) fn subtract_forcing_columns(
        &self,
        body: &[f64],
        rows: &mut [f64],
        n_columns: usize,
    ) {
        for (channel, source) in self.sources.iter().enumerate() {
            for column in 0..n_columns {
                let terms = source.unknowns().iter();
                let change: f64 = terms
                    .map(|&(i, weight)| weight * body[i * n_columns + column])
                    .sum();
                for row in self.network.forced_rows(channel) {
                    rows[row * n_columns + column] -= self.drive.gain * change;
                }
            }
        }
    }

    /// γ e, all components of the forcing at once.
    pub(super) fn forcing(&self) -> Vec<f64> {
        let mut forcing = vec![0.0; self.network.n_states()];
        for channel in 0..self.sources.len() {
            for row in self.network.forced_rows(channel) {
                forcing[row] = self.drive.gain;
            }
        }
        forcing
    }

    /// `states` −= J_o⁻¹ γ e wᵀ `body`, with the `response` J_o⁻¹ γ e of all components of the forcing:
    /// each reaches oscillators of its own.
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

    /// The sources, one per direction.
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }
}
