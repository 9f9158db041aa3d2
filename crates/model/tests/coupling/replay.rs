//! Chains coupled to a body, compared with chains driven by its recorded motion.

use std::sync::Arc;

use crate::common::{EVERY, chain_alone, observe, recorded_rod, rod_and_chain, start};
use myovib_dae::Problem;
use myovib_model::coupling::{Source, StateTolerances};
use myovib_model::paper;

const T_END: f64 = 6.0;

/// Returns the largest difference of Ψ of two runs at the same sample times.
fn apart(
    a: &myovib_model::coupling::CoherenceHistory,
    b: &myovib_model::coupling::CoherenceHistory,
) -> f64 {
    assert_eq!(a.t, b.t);
    let pairs = a.centroid.iter().zip(&b.centroid);
    pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn the_replayed_rod_drives_the_chain_as_the_rod_does() {
    let chain = paper::chain(5, 0.5).unwrap();
    let tolerances = StateTolerances::default();
    // The drive is strong, so that the replayed motion affects the result.
    let gain = 4000.0;
    let together = rod_and_chain(&chain, gain);
    let y = vec![0.0; together.n_unknowns()];
    let mut together = start(together, tolerances, T_END, &y);
    let (at_once, _) = observe(&mut together, EVERY, T_END, &mut []);

    let (recording, statistics) = recorded_rod(T_END);
    assert_eq!(recording.n_steps() as u64, statistics.counts.steps);
    assert_eq!(recording.covers().map(|[_, end]| end), Some(T_END));

    let replayed = chain_alone(&chain, gain, Source::Recorded(Arc::new(recording)));
    let y = vec![0.0; replayed.n_unknowns()];
    let mut replayed = start(replayed, tolerances, T_END, &y);
    let (afterwards, _) = observe(&mut replayed, EVERY, T_END, &mut []);
    // The relative local errors are 1e-7, for a motion of size 2. Over 6 s × 8 cycles × about 250 steps they accumulate
    // with random signs to at most 2e-7 √12000 = 2e-5.
    let distance = apart(&at_once, &afterwards);
    assert!(distance < 2e-5, "{distance:e}");
}

#[test]
fn a_recording_that_ends_too_early_is_an_error() {
    let chain = paper::chain(2, 0.0).unwrap();
    let empty = Source::Recorded(Arc::default());
    let mut dae = chain_alone(&chain, 1.0, empty);
    let error = dae.derivatives_at(0.25, &[0.0; 4]).unwrap_err().to_string();
    assert_eq!(error, "the recorded motion does not cover t = 0.25 s");
}

#[test]
fn output_times_do_not_change_the_results() {
    let chain = paper::chain(5, 0.5).unwrap();
    let with_samples_every = |every: f64| {
        use myovib_model::Integrator as _;
        let dae = rod_and_chain(&chain, 1.0);
        let n = dae.n_unknowns();
        let mut integrator = start(dae, StateTolerances::default(), 2.0, &vec![0.0; n]);
        let (_, statistics) = observe(&mut integrator, every, 2.0, &mut []);
        let mut end = vec![0.0; n];
        integrator.dense_output(2.0, 0, &mut end).unwrap();
        (end, statistics.counts.steps, statistics.counts.newton_iterations)
    };
    assert_eq!(with_samples_every(0.5), with_samples_every(1e-3));
}
