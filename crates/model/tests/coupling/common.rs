//! The paper's rod and chain as one system, run and observed.

use myovib_model::coupling::{
    CoherenceHistory, CoupledDae, ErrorTest, NoBody, Oscillators, Source, StateTolerances,
};
use myovib_model::{
    IdaIntegrator, Observer, Outcome, RodDae, SampleTimes, Sampler, Statistics, paper, run,
};
use myovib_oscillators::{Chain, Drive};
use sundials_wrap::{DaeProblem, IdaOptions};

/// 12.5 samples per cycle.
pub(crate) const EVERY: f64 = 0.01;

/// The paper's rod drives `chain` at L/2 with the gain `gain`.
pub(crate) fn rod_and_chain(chain: &Chain, gain: f64) -> CoupledDae<RodDae> {
    let rod = paper::rod().unwrap();
    let point = rod.displacement_at(paper::ROD_POINT).unwrap();
    let drive = Drive {
        gain,
        reach: chain.reach,
    };
    let network = chain.network().unwrap();
    let oscillators = Oscillators::new(network, drive, vec![Source::Body(point)]).unwrap();
    CoupledDae::new(rod, vec![oscillators])
}

/// `chain` driven by `source` alone.
pub(crate) fn chain_alone(chain: &Chain, gain: f64, source: Source) -> CoupledDae<NoBody> {
    let drive = Drive {
        gain,
        reach: chain.reach,
    };
    let oscillators = Oscillators::new(chain.network().unwrap(), drive, vec![source]).unwrap();
    CoupledDae::new(NoBody, vec![oscillators])
}

/// Starts a system whose states all have the tolerances `tolerances`.
pub(crate) fn start<B: DaeProblem + Send + 'static>(
    dae: CoupledDae<B>,
    tolerances: StateTolerances,
    t_end: f64,
    y: &[f64],
) -> IdaIntegrator<CoupledDae<B>> {
    let test =
        ErrorTest::of_states(dae.body_range().len(), tolerances).with_oscillators(&dae, tolerances);
    IdaIntegrator::coupled(dae, test, IdaOptions::default(), t_end, y).unwrap()
}

/// Runs to the end, sampling the coherence of the first network every `every` seconds.
pub(crate) fn observe<B: DaeProblem + Send + 'static>(
    integrator: &mut IdaIntegrator<CoupledDae<B>>,
    every: f64,
    t_end: f64,
    further: &mut [&mut dyn Observer<CoupledDae<B>>],
) -> (CoherenceHistory, Statistics) {
    use myovib_model::Integrator as _;
    let mut history = CoherenceHistory::default();
    let n = integrator.problem().n_unknowns();
    let mut sampler = Sampler::new(
        SampleTimes::new(every, t_end),
        n,
        |dae: &mut CoupledDae<B>, t, y: &[f64]| Ok(history.record(dae, 0, t, y)?),
    );
    let mut observers: Vec<&mut dyn Observer<CoupledDae<B>>> = vec![&mut sampler];
    for observer in further {
        observers.push(&mut **observer);
    }
    let statistics = run(integrator, &mut observers).unwrap();
    assert_eq!(statistics.outcome, Outcome::Finished);
    drop(sampler);
    (history, statistics)
}

/// From rest to `t_end` with the default tolerances.
pub(crate) fn from_rest(chain: &Chain, gain: f64, t_end: f64) -> (CoherenceHistory, Statistics) {
    let dae = rod_and_chain(chain, gain);
    let y = vec![0.0; dae.n_unknowns()];
    let mut integrator = start(dae, StateTolerances::default(), t_end, &y);
    observe(&mut integrator, EVERY, t_end, &mut [])
}
