//! The paper's chains without a body: their limit cycles have the values to which Figures 3 and 7 settle.

use myovib_dae::Problem;
use myovib_model::coupling::{Source, StateTolerances};
use myovib_model::periodic::{Shooting, shoot};
use myovib_model::{Integrator as _, ModelError, paper, run};

use crate::common::{chain_alone, observe, start};

/// Checks |Ψ|, |χ| and the frequency of a period. At the gain 1, the vibration of rod and muscle at 8 Hz hardly acts on the chains, which
/// do not follow it. The period T of their own motion is an unknown: the state (y, T) repeats if y does, and the first velocity
/// is as in the guess.
///
/// The references are averages over 20 s of motion by an independent program, with its error bounds.
#[test]
fn the_chains_of_figures_3_and_7_have_limit_cycles_with_the_settled_values() {
    let tolerances =
        StateTolerances { relative: 1e-9, absolute: 1e-9, ..StateTolerances::default() };
    for (n, half_width, range, coherence, bound, frequency) in [
        (20, 0.05, [1.62, 1.67], 0.836, 0.001, Some(7.763)),
        (5, 0.5, [1.64, 1.70], 0.94, 0.005, None),
    ] {
        let dae = chain_alone(&paper::chain(n, half_width).unwrap(), 1.0, Source::Rest);
        let after = |time: f64, y: &[f64]| -> Result<Vec<f64>, ModelError> {
            let mut integrator = start(dae.clone(), tolerances, time, y);
            run(&mut integrator, &mut [])?;
            let mut y = vec![0.0; y.len()];
            integrator.dense_output(time, 0, &mut y)?;
            Ok(y)
        };
        let m = dae.n_unknowns();
        let at_rest: Vec<f64> = (0..m).map(|i| if i < n { 2.0 } else { 0.0 }).collect();
        let mut guess = after(20.0, &at_rest).unwrap();
        guess.push(0.128);
        let scales = (0..=m).map(|i| {
            if i < n {
                2.0
            } else if i < m {
                100.0
            } else {
                0.128
            }
        });
        let shooting = Shooting::new(scales.collect());
        let mut repeated = |y: &[f64]| {
            let mut end = after(y[m], &y[..m])?;
            end.push(y[m] + 1e-3 * (y[n] - guess[n]));
            Ok(end)
        };
        let found = shoot(&mut repeated, &guess, &shooting).unwrap().state;
        let (y, period) = (&found[..m], found[m]);
        let mut integrator = start(dae.clone(), tolerances, period, y);
        let (history, _) = observe(&mut integrator, period / 64.0, period, &mut []);
        let settled = history.settled(period).unwrap();
        let (strength, phase) = (settled.centroid, settled.phase);
        let place = format!("{n}: period {period}, {strength:?}, {phase:?}");
        assert!((strength.min - range[0]).abs() < 0.005, "{place}");
        assert!((strength.max - range[1]).abs() < 0.005, "{place}");
        assert!((phase.mean - coherence).abs() < bound, "{place}");
        if let Some(frequency) = frequency {
            assert!((strength.mean - 1.642).abs() < 0.002, "{place}");
            assert!((1.0 / period - frequency).abs() < 0.001, "{place}");
        }
    }
}
