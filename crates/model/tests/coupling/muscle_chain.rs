//! The paper's section 3.2: the muscle drives a chain of five.

use std::sync::Arc;

use crate::common::{
    EVERY, chain_alone, muscle, muscle_and_chain, observe, origin, start, start_muscle,
};
use myovib_dae::Problem;
use myovib_model::coupling::{CoherenceHistory, CoupledDae, Recorder, Source, StateTolerances};
use myovib_model::{Formulation, Integrator, Outcome, Settings, paper, run};

/// Returns the paper's settings up to `t_end`, with all tolerances multiplied by `factor`.
fn settings(t_end: f64, factor: f64) -> Settings {
    let paper = Settings::paper(Formulation::Rate);
    let rtol = factor * paper.relative_tolerance;
    Settings { t_end, max_order: 5, ..paper.with_relative_tolerance(rtol) }
}

/// Integrates muscle and chain as one system.
fn at_once(gain: f64, settings: &Settings) -> CoherenceHistory {
    let dae = muscle_and_chain(&paper::chain(5, 0.5).unwrap(), gain);
    let mut integrator = start_muscle(dae, settings, StateTolerances::default());
    observe(&mut integrator, EVERY, settings.t_end, &mut []).0
}

/// Runs the muscle alone, records its motion, and then runs the chain.
fn replayed(gain: f64, settings: &Settings) -> CoherenceHistory {
    let muscle = muscle();
    let point = origin(&muscle);
    let alone = CoupledDae::new(muscle, Vec::new());
    let mut recorder = Recorder::new(point, alone.n_unknowns());
    let mut integrator = start_muscle(alone, settings, StateTolerances::default());
    let statistics = run(&mut integrator, &mut [&mut recorder]).unwrap();
    assert_eq!(statistics.outcome, Outcome::Finished);
    let recording = Source::Recorded(Arc::new(recorder.finish()));
    let chain = chain_alone(&paper::chain(5, 0.5).unwrap(), gain, recording);
    let rest = vec![0.0; chain.n_unknowns()];
    let mut integrator = start(chain, StateTolerances::default(), settings.t_end, &rest);
    observe(&mut integrator, EVERY, settings.t_end, &mut []).0
}

#[test]
fn the_replayed_muscle_drives_the_chain_as_the_muscle_does() {
    // The drive is so strong that Ψ follows it, so that the replayed motion affects the result.
    let (gain, settings) = (1e5, settings(2.0, 1e-2));
    let (together, afterwards) = (at_once(gain, &settings), replayed(gain, &settings));
    assert_eq!(together.t, afterwards.t);
    let pairs = together.centroid.iter().zip(&afterwards.centroid);
    let apart = pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    let size = together.strength().into_iter().fold(0.0, f64::max);
    assert!(size > 0.1, "{size}");
    // In each run, u has an amplitude of 4e-4 m and an absolute tolerance of 1e-7 m, a relative error of 2.5e-4, and Ψ
    // is proportional to u. The errors of several steps accumulate.
    assert!(apart / size < 1e-3, "{apart:e} of {size}");
}

#[test]
fn output_times_do_not_change_the_results() {
    let with_samples_every = |every: f64| {
        let settings = settings(0.5, 1.0);
        let dae = muscle_and_chain(&paper::chain(5, 0.5).unwrap(), 1.0);
        let mut end = vec![0.0; dae.n_unknowns()];
        let mut integrator = start_muscle(dae, &settings, StateTolerances::default());
        let (_, statistics) = observe(&mut integrator, every, settings.t_end, &mut []);
        integrator.dense_output(settings.t_end, 0, &mut end).unwrap();
        (end, statistics.counts.steps, statistics.counts.newton_iterations)
    };
    assert_eq!(with_samples_every(0.25), with_samples_every(1e-3));
}

/// Compares with reference values of an independent integration on the rod, which converges to the same values: once
/// the chain moves, γ = 1 is too small to have an effect.
fn assert_settled(history: &CoherenceHistory) {
    let settled = history.settled(20.0).unwrap();
    let strength = settled.centroid;
    // To the digits printed: [1.64, 1.70] and 0.94.
    assert!(strength.min > 1.635 && strength.max < 1.705, "{strength:?}");
    assert!((settled.phase.mean - 0.94).abs() < 0.005, "{settled:?}");
}

#[test]
fn five_oscillators_on_the_replayed_muscle_settle_where_they_should() {
    assert_settled(&replayed(1.0, &Settings { max_order: 2, ..settings(50.0, 1.0) }));
}

#[test]
#[ignore = "slow"]
fn five_oscillators_on_the_muscle_settle_where_they_should() {
    assert_settled(&at_once(1.0, &settings(50.0, 1.0)));
}
