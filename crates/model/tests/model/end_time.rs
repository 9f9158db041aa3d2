//! The steps of a run do not depend on its end time.

use myovib_dae::Problem;
use myovib_fem::generate;
use myovib_model::coupling::{CoupledDae, ErrorTest, Oscillators, Source, StateTolerances};
use myovib_model::start::Consistent;
use myovib_model::{
    Advance, Formulation, IdaIntegrator, Integrator, IntegratorKind, LinearSolverKind, MuscleDae,
    Settings, Signal, paper, start_at_rest,
};
use myovib_oscillators::Drive;

use sundials_wrap::IdaOptions;

/// Returns the times of the first steps, up to `t` at most.
fn steps<P>(integrator: &mut dyn Integrator<P>, t: f64) -> Vec<f64> {
    let mut times = Vec::new();
    loop {
        let advance = integrator.advance().expect("no misuse");
        let stopped = matches!(advance, Advance::Stopped { .. });
        assert!(!stopped, "{advance:?} at t = {}", integrator.time());
        if integrator.time() > t || advance == Advance::Finished {
            return times;
        }
        times.push(integrator.time());
    }
}

#[test]
fn a_rod_with_a_chain_starts_alike_for_any_end_time() {
    let start = |t_end: f64| {
        let rod = paper::rod().unwrap();
        let point = rod.displacement_at(paper::ROD_POINT).unwrap();
        let network = paper::chain(20, 0.05).unwrap().network().unwrap();
        let source = vec![Source::Body(point)];
        let chain = Oscillators::new(network, Drive::default(), source).unwrap();
        let mut dae = CoupledDae::new(rod, vec![chain]);
        // The default tolerances of scenes.
        let tolerances = StateTolerances { relative: 1e-7, absolute: 1e-10, tested: true };
        let test = ErrorTest::of_states(dae.body_range().len(), tolerances)
            .with_oscillators(&dae, tolerances);
        let rest = vec![0.0; dae.n_unknowns()];
        let options = IdaOptions::default();
        let [y, y_dot] = dae.consistent(0.0, &rest).unwrap();
        let times = [0.0, t_end];
        IdaIntegrator::coupled_at(dae, test, options, LinearSolverKind::Full, times, &y, &y_dot)
            .unwrap()
    };
    let (short, long) = (steps(&mut start(1.0), 0.9), steps(&mut start(2000.0), 0.9));
    assert!(short.len() > 100, "{}", short.len());
    assert_eq!(short, long);
}

#[test]
fn a_muscle_starts_alike_for_any_end_time() {
    let mesh = generate::beam(0.1, 0.02, [4, 1]).unwrap();
    let start = |integrator: IntegratorKind, t_end: f64| {
        let muscle = paper::muscle_with_load(&mesh, paper::LAW, 1e5, 0.0, Signal::paper(1.0));
        let dae = MuscleDae::new(muscle.unwrap(), Formulation::Position).unwrap();
        let settings = Settings { integrator, t_end, ..Settings::paper(Formulation::Position) };
        start_at_rest(dae, &settings).unwrap()
    };
    for integrator in [IntegratorKind::Bdf, IntegratorKind::Radau5] {
        // Radau IIA adjusts the last steps to the end time; in the first second, steps are shorter than 1 s.
        let steps = |t_end: f64| steps(start(integrator, t_end).as_mut(), 1.0);
        let (short, long) = (steps(4.0), steps(5000.0));
        assert!(short.len() > 3, "{integrator:?}: {}", short.len());
        assert_eq!(short, long, "{integrator:?}");
    }
}
