//! A body and its oscillators, integrated with separate steps.
//!
//! Oscillators without feedback never act on the body. The body therefore takes the same steps as without oscillators.
//! After each accepted step of the body, the oscillators are integrated over the same interval with their own steps
//! and tolerances, driven by the body's dense output:
//!
//! ```text
//! F_b(t, y, ẏ) = 0 over [t_n, t_{n+1}],   then   F_o(s, ṡ; γ ũ(t)) = 0,  ũ the dense output of u.
//! ```
//!
//! # Error
//! The error of the forcing, γ |ũ − u|, adds to the oscillators' own integration error. It equals γ δu, where δu is
//! the error of the body's displacement at the driving point. A constant error moves an oscillator by γ δu/ω². At
//! resonance, or along a limit cycle (whose phase is free), the effects of the error accumulate to γ δu T/(2ω) over a
//! time T. [`Driving`] contains the factors of the bound γ δu (1/ω² + T/(2ω)). For BDF, δu is the sum of the local
//! errors of u. Radau IIA provides no δu, because its estimates have a lower order than its error. Within steps, the
//! error of its dense output is not dominant: when the dense output was replaced by the integral of the dense output
//! of the velocity, which has a higher order, the error of the oscillators did not change.

use std::sync::Arc;

use super::chebyshev;
use super::dae::CoupledDae;
use super::no_body::NoBody;
use super::oscillators::{Oscillators, Source};
use super::step_motion::StepMotion;
use crate::error::ModelError;
use crate::integration::integrator::{Advance, Continuation, Integrator};
use crate::integration::settings::IntegratorKind;
use crate::integration::statistics::Counts;
use crate::reading::displacement::Displacement;
use crate::signal::schedule::ROUNDING;
use serde::{Deserialize, Serialize};

/// Integrator of oscillators without a body.
pub type ChainIntegrator = Box<dyn Integrator<CoupledDae<NoBody>>>;

/// A body `B` and the oscillators it drives, with an integrator for each. This type is both the integrator and the
/// system that it solves: Y = (y, s_1, s_2, …), as for [`CoupledDae`].
pub struct Multirate<B> {
    body: Box<dyn Integrator<B>>,
    n_body: usize,
    chains: ChainIntegrator,
    /// Driving points, and their motion over the last step of the body.
    places: Vec<Displacement>,
    motion: Arc<StepMotion>,
    driven: Driven,
    /// Steps of the oscillators within the last step of the body.
    steps: Steps,
    /// Sum of the magnitudes of the local errors of these steps and of the effects of driving errors; `None` if no
    /// estimate is available.
    error: Option<Vec<f64>>,
    /// Whether the integrator of the oscillators stopped before its end time.
    chains_stopped: bool,
    y: Vec<f64>,
}

/// Magnitudes of the driving displacements and of the resulting positions over a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Driven {
    /// Largest displacement of each driving point and the sum of the magnitudes of its local errors, m.
    places: Vec<[f64; 2]>,
    /// Whether the body's integrator estimates its local errors.
    has_errors: bool,
    /// Largest magnitude of the positions of each network.
    positions: Vec<f64>,
}

/// Magnitude and error of the driving of a network over a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Driving {
    /// Current bound γ (1/ω² + T/(2ω)) on the change of a position per unit error of the displacement, 1/m.
    pub response: f64,
    /// Largest displacement of the driving points without prescribed parts, m.
    pub displacement: f64,
    /// Largest estimated error of these displacements, m; `None` if no estimate is available.
    pub error: Option<f64>,
    /// Largest magnitude of a position.
    pub position: f64,
}

/// Interpolating polynomials of consecutive steps.
struct Steps {
    n_states: usize,
    /// Number of values that determine a polynomial.
    n_points: usize,
    /// Number of steps in use; the remaining ones are kept for reuse.
    n: usize,
    list: Vec<Interpolated>,
}

/// States over one step.
#[derive(Default)]
struct Interpolated {
    from: f64,
    to: f64,
    /// States at the Chebyshev points, one after the other.
    states: Vec<f64>,
}

impl Driven {
    /// Updates the largest positions with the `states` of `chains`.
    fn record(&mut self, states: &[f64], chains: &CoupledDae<NoBody>) {
        for (k, largest) in self.positions.iter_mut().enumerate() {
            let n = chains.oscillators(k).network().n_oscillators();
            let positions = &states[chains.range(k)][..n];
            *largest = positions.iter().fold(*largest, |max, y| max.max(y.abs()));
        }
    }
}

impl Steps {
    /// Adds the last step of `chains`, which began at `from`.
    fn add(&mut self, chains: &mut ChainIntegrator, from: f64) -> Result<(), ModelError> {
        if self.n == self.list.len() {
            self.list.push(Interpolated::default());
        }
        let (n_states, n_points, to) = (self.n_states, self.n_points, chains.time());
        let step = &mut self.list[self.n];
        (step.from, step.to) = (from, to);
        step.states.resize(n_points * n_states, 0.0);
        let states = step.states.chunks_exact_mut(n_states);
        for (t, states) in chebyshev::times(n_points, [from, to]).zip(states) {
            chains.dense_output(t, 0, states)?;
        }
        self.n += 1;
        Ok(())
    }

    fn last_states(&self) -> &[f64] {
        &self.list[self.n - 1].states[(self.n_points - 1) * self.n_states..]
    }

    /// Writes the states at time `t` to `out`; returns false before the first step.
    fn at(&self, t: f64, out: &mut [f64]) -> bool {
        let steps = &self.list[..self.n];
        let after = steps.partition_point(|step| step.to < t);
        let Some(step) = steps.get(after).or(steps.last()) else {
            return false;
        };
        // After a jump, rounding can make the body's step begin later than the first of these steps.
        let x = ((t - step.from) / (step.to - step.from)).clamp(0.0, 1.0);
        out.fill(0.0);
        chebyshev::weights(x, self.n_points, |k, weight| {
            let states = &step.states[k * self.n_states..(k + 1) * self.n_states];
            for (out, state) in out.iter_mut().zip(states) {
                *out += weight * state;
            }
        });
        true
    }
}

impl<B> Multirate<B> {
    /// Combines the integrator of a `body`, which is at time `t` in state `y`, with the `oscillators` that the body
    /// drives. `start` creates the integrator of the oscillators, which must be of this `kind`.
    ///
    /// # Errors
    /// Returns the errors of `start`.
    pub fn new<E>(
        body: Box<dyn Integrator<B>>,
        (t, y): (f64, &[f64]),
        oscillators: Vec<Oscillators>,
        kind: IntegratorKind,
        start: impl FnOnce(CoupledDae<NoBody>) -> Result<ChainIntegrator, E>,
    ) -> Result<Self, E> {
        let (motion, mut places) = (Arc::new(StepMotion::default()), Vec::new());
        let follow = |own: Oscillators| own.following(&motion, &mut places);
        let oscillators: Vec<Oscillators> = oscillators.into_iter().map(follow).collect();
        motion.start(t, y, &places);
        let n_states = oscillators.iter().map(|own| own.network().n_states()).sum();
        let driven = Driven {
            places: vec![[0.0; 2]; places.len()],
            has_errors: false,
            positions: vec![0.0; oscillators.len()],
        };
        Ok(Self {
            driven,
            body,
            n_body: y.len(),
            chains: start(CoupledDae::new(NoBody, oscillators))?,
            places,
            motion,
            steps: Steps {
                n_states,
                // For Radau IIA, the degree of the dense output is the number of stages plus one; for BDF, it is at
                // most the order.
                n_points: kind.stages().unwrap_or(4) + 2,
                n: 0,
                list: Vec::new(),
            },
            error: None,
            chains_stopped: false,
            y: vec![0.0; y.len()],
        })
    }

    /// Returns the number of unknowns of the body and of the oscillators. The body's unknowns come first.
    pub fn n_unknowns(&self) -> [usize; 2] {
        [self.n_body, self.steps.n_states]
    }

    /// Returns the body.
    pub fn body(&self) -> &B {
        self.body.problem()
    }

    /// Returns the body for evaluations outside the time integration.
    pub fn body_mut(&mut self) -> &mut B {
        self.body.problem_mut()
    }

    /// Returns the oscillators.
    pub fn chains(&self) -> &CoupledDae<NoBody> {
        self.chains.problem()
    }

    /// Returns the counts of the integrator of the oscillators.
    pub fn chain_counts(&self) -> Counts {
        self.chains.counts()
    }

    /// Returns the largest displacements of the driving points and the largest positions of the oscillators so far.
    pub fn driven(&self) -> &Driven {
        &self.driven
    }

    /// Restores the magnitudes of an earlier part of the run. Returns `false` and changes nothing if the number of
    /// driving points or networks differs.
    pub fn set_driven(&mut self, driven: &Driven) -> bool {
        let n = |own: &Driven| [own.places.len(), own.positions.len()];
        let fits = n(driven) == n(&self.driven);
        if fits {
            self.driven.clone_from(driven);
        }
        fits
    }

    /// Returns the magnitude and the error of the displacement that drives network `k`, or `None` if the body does not
    /// drive this network.
    pub fn driving(&self, k: usize) -> Option<Driving> {
        let own = self.chains().oscillators(k);
        let points = own.sources().iter().filter_map(Source::step_point);
        let magnitudes = points.map(|i| self.driven.places[i]);
        let [displacement, error] = magnitudes.reduce(|a, b| [a[0].max(b[0]), a[1].max(b[1])])?;
        let omega = own.network().omega().iter();
        let slowest = omega.copied().fold(f64::INFINITY, f64::min);
        Some(Driving {
            response: own.drive().gain.abs() * (1.0 / slowest + 0.5 * self.time()) / slowest,
            displacement,
            error: self.driven.has_errors.then_some(error),
            position: self.driven.positions[k],
        })
    }

    /// Adds the local errors |e| of the body's last step, of length h, to the driving errors δu. Adds the effects of
    /// these errors to the errors of the oscillators: γ (|e|/ω² + δu h/(2ω)) for y, and ω times this value for ẏ.
    fn add_local_errors(&mut self, h: f64) -> Result<(), ModelError> {
        let Some(error) = &mut self.error else {
            return Ok(());
        };
        if self.places.is_empty() || !self.body.local_error(&mut self.y)? {
            return Ok(());
        }
        let of_places: Vec<f64> = self.places.iter().map(|p| p.of(&self.y).abs()).collect();
        self.driven.has_errors = true;
        for ([_, sum], own) in self.driven.places.iter_mut().zip(&of_places) {
            *sum += own;
        }
        let chains = self.chains.problem();
        for k in 0..chains.n_networks() {
            let (own, start) = (chains.oscillators(k), chains.range(k).start);
            let (network, gain) = (own.network(), own.drive().gain.abs());
            let n = network.n_oscillators();
            for (channel, source) in own.sources().iter().enumerate() {
                let Some(place) = source.step_point() else {
                    continue;
                };
                for row in network.forced_rows(channel) {
                    let omega = network.omega()[row - n];
                    let [_, sum] = self.driven.places[place];
                    let moved = gain * (of_places[place] / omega + 0.5 * sum * h);
                    error[start + row] += moved;
                    error[start + row - n] += moved / omega;
                }
            }
        }
        Ok(())
    }

    /// Integrates the oscillators to `to`, the end of the body's last step.
    fn advance_chains(&mut self, to: f64) -> Result<Option<Advance>, ModelError> {
        self.steps.n = 0;
        self.error = None;
        let mut local = vec![0.0; self.steps.n_states];
        while self.chains.time() + ROUNDING * self.chains.time().abs() < to {
            let from = self.chains.time();
            if let Advance::Stopped { reason, message, .. } = self.chains.advance()? {
                self.chains_stopped = true;
                return Ok(Some(Advance::Stopped {
                    reason,
                    message: format!("oscillators: {message}"),
                    inverted: None,
                }));
            }
            self.steps.add(&mut self.chains, from)?;
            self.driven.record(self.steps.last_states(), self.chains.problem());
            if self.chains.local_error(&mut local)? {
                let error = self.error.get_or_insert_with(|| vec![0.0; local.len()]);
                for (error, local) in error.iter_mut().zip(&local) {
                    *error += local.abs();
                }
            }
        }
        Ok(None)
    }
}

impl<B> Integrator<Multirate<B>> for Multirate<B> {
    fn pass_jump(&mut self) -> Result<(), ModelError> {
        self.body.pass_jump()
    }

    fn advance(&mut self) -> Result<Advance, ModelError> {
        self.body.pass_jump()?;
        let from = self.body.time();
        let advance = self.body.advance()?;
        if matches!(advance, Advance::Stopped { .. }) {
            return Ok(advance);
        }
        let to = self.body.time();
        let seen = &mut self.driven.places;
        let body = &mut *self.body;
        self.motion.record(body, [from, to], &self.places, &mut self.y, |i, u| {
            seen[i][0] = seen[i][0].max(u);
        })?;
        if let Some(stopped) = self.advance_chains(to)? {
            return Ok(stopped);
        }
        self.add_local_errors(to - from)?;
        Ok(advance)
    }

    fn time(&self) -> f64 {
        match self.chains_stopped {
            true => self.chains.time(),
            false => self.body.time(),
        }
    }

    fn dense_output(&mut self, t: f64, derivative: u32, out: &mut [f64]) -> Result<(), ModelError> {
        let (body, chains) = out.split_at_mut(self.n_body);
        self.body.dense_output(t, derivative, body)?;
        if !self.steps.at(t, chains) {
            return self.chains.dense_output(t, derivative, chains);
        }
        if derivative > 0 {
            // Only first derivatives are requested here. The second derivatives of the oscillators follow from their
            // equations.
            let (rates, _) = self.chains.problem_mut().derivatives_at(t, chains)?;
            chains.copy_from_slice(&rates);
        }
        Ok(())
    }

    /// Returns the end times of the oscillators' steps within the last step of the body.
    fn inner_ends(&self) -> Vec<f64> {
        let steps = &self.steps.list[..self.steps.n];
        let inner = steps.iter().take(self.steps.n.saturating_sub(1));
        inner.map(|step| step.to).collect()
    }

    fn local_error(&mut self, out: &mut [f64]) -> Result<bool, ModelError> {
        let (body, chains) = out.split_at_mut(self.n_body);
        let Some(error) = &self.error else {
            return Ok(false);
        };
        chains.copy_from_slice(error);
        self.body.local_error(body)
    }

    /// Returns the counts of the body's integrator.
    fn counts(&self) -> Counts {
        self.body.counts()
    }

    fn save(&self) -> Option<Continuation> {
        let chains = Some(Box::new(self.chains.save()?));
        Some(Continuation { chains, ..self.body.save()? })
    }

    fn restore(&mut self, continuation: &Continuation) -> Result<(), ModelError> {
        self.body.restore(continuation)?;
        match &continuation.chains {
            Some(chains) => self.chains.restore(chains),
            None => Ok(()),
        }
    }

    fn problem(&self) -> &Self {
        self
    }

    fn problem_mut(&mut self) -> &mut Self {
        self
    }
}
