//! Energy balance of an undamped body under a load.

use myovib_dae::Problem;
use myovib_model::{
    Formulation, IdaIntegrator, MuscleDae, SampleTimes, Sampler, Signal, formula, paper, run,
};

use crate::common::{accurate, loaded_block};

/// Returns the largest difference between energy and work, relative to the largest energy.
fn imbalance(rtol: f64) -> f64 {
    const EVERY: f64 = 1e-3;
    let load = Signal::from(formula::Sine { amplitude: 400.0, frequency: 1.0, phase: 0.0 });
    let mut block = loaded_block(1, paper::LAW, 1e5, 0.0, load);
    block.parameters.alpha = 0.0;
    let settings = accurate(Formulation::Position, rtol, 0.4);
    let dae = MuscleDae::new(block, Formulation::Position).unwrap();
    let n = dae.n_unknowns();
    let mut integrator = IdaIntegrator::from_rest(dae, &settings).unwrap();
    let (mut work, mut power, mut largest, mut gap) = (0.0, 0.0, 0.0_f64, 0.0_f64);
    let rest = vec![0.0; n];
    let mut balance = Sampler::new(
        SampleTimes::new(EVERY, settings.t_end),
        n,
        |dae: &mut MuscleDae, t, y: &[f64]| {
            let (energies, powers) = (dae.energies(t, y, &rest), dae.powers(t, y, &rest)?);
            work += 0.5 * EVERY * (power + powers.load);
            power = powers.load;
            let stored = energies.kinetic + energies.elastic;
            largest = largest.max(stored);
            gap = gap.max((stored - work).abs());
            Ok(())
        },
    );
    run(&mut integrator, &mut [&mut balance]).unwrap();
    drop(balance);
    gap / largest
}

#[test]
fn energy_is_the_work_done_as_tolerances_tighten() {
    let [loose, tight] = [1e-3, 1e-5].map(imbalance);
    // The error of BDF 2 is proportional to rtol^(2/3), a factor of 21; the error of the
    // trapezoidal rule, at 1000 samples per period, is below 1e-5.
    assert!(tight < loose / 20.0, "{loose:e}, {tight:e}");
    // The local errors of BDF accumulate to at most ten times the tolerance of one step.
    assert!(tight < 1e-4, "{tight:e}");
}
