//! A rod can start under any load, with any method.

use myovib_dae::Problem;
use myovib_fem::rod::{EndLoad, Rod, RodData};
use myovib_model::coupling::{
    CoupledDae, CoupledOptions, ErrorTest, StateTolerances, start_coupled,
};
use myovib_model::start::Consistent;
use myovib_model::{IntegratorKind, Outcome, RodDae, Signal, formula, run};

const T_END: f64 = 0.3;

fn rod(load: EndLoad, phase: f64) -> CoupledDae<RodDae> {
    let signal = Signal::from(formula::Sine { amplitude: 1.0, frequency: 8.0, phase });
    let rod = Rod::new(RodData::default()).unwrap();
    CoupledDae::new(RodDae::new(rod, load, signal).unwrap(), Vec::new())
}

/// The state at the end.
fn end(load: EndLoad, phase: f64, integrator: IntegratorKind) -> Vec<f64> {
    let dae = rod(load, phase);
    let n = dae.n_unknowns();
    let test = ErrorTest::of_states(n, StateTolerances::default());
    let options = CoupledOptions::of_states(integrator);
    let mut integration = start_coupled(dae, test, options, T_END, &vec![0.0; n]).unwrap();
    let statistics = run(integration.as_mut(), &mut []).unwrap();
    let name = format!("{load:?} {integrator:?} {statistics:?}");
    assert_eq!(statistics.outcome, Outcome::Finished, "{name}");
    let mut y = vec![0.0; n];
    integration.dense_output(T_END, 0, &mut y).unwrap();
    y
}

/// Regression: for a prescribed strain with a nonzero initial slope, no consistent initial values were found, and under
/// a traction BDF failed its error test ten times at t = 0.
#[test]
fn a_rod_starts_under_a_sine() {
    for load in [EndLoad::Strain, EndLoad::Traction] {
        for phase in [0.0, 1.0] {
            let [reference, others @ ..] =
                IntegratorKind::ALL.map(|integrator| end(load, phase, integrator));
            let size = reference.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
            for (other, integrator) in others.iter().zip(&IntegratorKind::ALL[1..]) {
                let pairs = reference.iter().zip(other);
                let off = pairs.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
                // A relative tolerance of 1e-7, for slowly decaying waves.
                assert!(off < 1e-4 * size, "{load:?} {integrator:?}: {off:e} of {size:e}");
            }
        }
    }
}

/// The initial rates satisfy M v̇ = f: the residual is the rounding of its terms, EA = 1e6.
#[test]
fn the_rates_of_a_rod_satisfy_its_equations() {
    let mut dae = rod(EndLoad::Strain, 1.0);
    let n = dae.n_unknowns();
    let [y, y_dot] = dae.consistent(0.0, &vec![0.0; n]).unwrap();
    assert!(y_dot.iter().any(|rate| rate.abs() > 1.0));
    let mut residual = vec![0.0; n];
    dae.residual(0.0, &y, &y_dot, &mut residual).unwrap();
    assert!(residual.iter().all(|r| r.abs() < 1e-8), "{residual:?}");
}
