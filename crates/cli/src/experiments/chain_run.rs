//! What a run with a chain came to.

use std::collections::BTreeMap;

use myovib_dae::Problem;
use myovib_model::coupling::{
    Body, CoherenceHistory, CoupledDae, CoupledOptions, Settling, StateTolerances,
};
use myovib_model::{Integrator, IntegratorKind, SampleTimes, Sampler, Statistics};
use myovib_oscillators::Settled;
use serde::Serialize;
use serde_json::{Map, Value};

use super::{EVERY, run_watched};
use crate::exit::Exit;
use crate::progress::Progress;
use myovib_scene::statistics::CountsJson;

/// How a run is made.
#[derive(Clone, Copy)]
pub struct Course<'a> {
    /// End time, s.
    pub t_end: f64,
    /// The integrator.
    pub integrator: IntegratorKind,
    /// What is told of it meanwhile.
    pub progress: &'a Progress,
}

/// A finished run of a chain, on whatever body.
pub struct ChainRun {
    /// Coherence at sample times.
    pub history: CoherenceHistory,
    /// Counts and outcome.
    pub statistics: Statistics,
    /// Length of the integrator's vector.
    pub unknowns: usize,
    /// The integrator.
    pub integrator: IntegratorKind,
    /// Relative and absolute tolerances by block.
    pub tolerances: BTreeMap<&'static str, [f64; 2]>,
    /// Blocks left out of the error test.
    pub suppressed: Vec<&'static str>,
    /// Highest order of the BDF; none for other integrators.
    pub max_order: Option<usize>,
    /// End time asked for, s.
    pub t_end: f64,
    /// Name of the linear solver.
    pub linear_solver: &'static str,
    /// Settings of the body that moves with the chain; empty where its motion is replayed.
    pub body: Map<String, Value>,
}

impl ChainRun {
    /// Length of the window over which the run is judged: 20 s, or less for a short run.
    pub fn window(&self) -> f64 {
        20.0_f64.min(self.t_end / 2.0)
    }

    /// Settled values over the window; none for a run that stopped too early to have any.
    pub fn settled(&self) -> Option<Settling> {
        self.history.settled(self.window()).ok()
    }

    /// How a command that shows this run ends; a run that stopped is shown as far as it got.
    pub fn exit(&self) -> Exit {
        Exit::of(&self.statistics.outcome)
    }

    /// Integrates and observes the first network of a coupled system.
    pub(super) fn observe<B: Body>(
        integrator: &mut dyn Integrator<CoupledDae<B>>,
        name: &str,
        course: Course,
    ) -> anyhow::Result<(CoherenceHistory, Statistics)> {
        let Course {
            t_end, progress, ..
        } = course;
        let n = integrator.problem().n_unknowns();
        let mut history = CoherenceHistory::default();
        let mut sampler = Sampler::new(
            SampleTimes::new(EVERY, t_end),
            n,
            |dae: &mut CoupledDae<B>, t, y: &[f64]| Ok(history.record(dae, 0, t, y)?),
        );
        let statistics = run_watched(integrator, &mut sampler, (name, t_end), progress)?;
        drop(sampler);
        Ok((history, statistics))
    }

    /// Statistics and settings for a JSON document.
    pub fn json(&self) -> ChainRunJson<'_> {
        let part = |which: usize| {
            let entries = self.tolerances.iter();
            entries.map(|(name, pair)| (*name, pair[which])).collect()
        };
        ChainRunJson {
            counts: CountsJson::new(&self.statistics),
            unknowns: self.unknowns,
            integrator: self.integrator.name(),
            suppressed: self.suppressed.clone(),
            rtol: part(0),
            atol: part(1),
            max_order: self.max_order,
            initial_step: None,
            max_step: None,
            t_end: self.t_end,
            linear_solver: self.linear_solver,
            body: &self.body,
        }
    }
}

/// The highest order of the BDF with these options; none for other integrators.
pub(super) fn max_order(options: &CoupledOptions) -> Option<usize> {
    (options.integrator == IntegratorKind::Ida).then_some(options.ida.max_order)
}

/// The tolerances of a block of states for the output.
pub(super) fn pair(tolerances: StateTolerances) -> [f64; 2] {
    [tolerances.relative, tolerances.absolute]
}

/// Statistics of a run with a chain, with all settings used.
#[derive(Debug, Serialize)]
#[allow(missing_docs)] // the names are the contract's
pub struct ChainRunJson<'a> {
    #[serde(flatten)]
    pub counts: CountsJson<'a>,
    pub unknowns: usize,
    pub integrator: &'a str,
    pub suppressed: Vec<&'a str>,
    pub rtol: BTreeMap<&'a str, f64>,
    pub atol: BTreeMap<&'a str, f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_order: Option<usize>,
    pub initial_step: Option<f64>,
    pub max_step: Option<f64>,
    pub t_end: f64,
    pub linear_solver: &'a str,
    #[serde(flatten)]
    pub body: &'a Map<String, Value>,
}

/// Settled values for a JSON document.
#[derive(Debug, Serialize)]
pub struct SettledJson {
    /// Length of the trailing window, s.
    window: f64,
    /// |Ψ|.
    psi: Settled,
    /// |χ|.
    chi: Settled,
    /// Frequency of the centroid, Hz.
    frequency: Settled,
}

impl From<Settling> for SettledJson {
    fn from(settling: Settling) -> Self {
        Self {
            window: settling.window,
            psi: settling.centroid,
            chi: settling.phase,
            frequency: settling.frequency,
        }
    }
}
