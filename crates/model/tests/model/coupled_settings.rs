//! The settings of a muscle are also applied, or rejected, if the muscle has a chain.

use myovib_dae::Problem;
use myovib_fem::generate;
use myovib_model::coupling::{
    CoupledDae, CoupledOptions, Effect, ErrorTest, Feedback, FeedbackDae, Oscillators, Source,
    StateTolerances, start_coupled, start_with_feedback,
};
use myovib_model::{
    Formulation, IntegratorKind, ModelError, MultiplierWeights, MuscleDae, Outcome, Probe,
    Settings, Signal, paper, run,
};
use myovib_oscillators::{Drive, SmoothCoherence};

const T_END: f64 = 0.5;

/// Returns an incompressible beam in the formulation `velocity`, which drifts, whose tip drives a chain.
fn beam_and_chain() -> CoupledDae<MuscleDae> {
    let mesh = generate::beam(0.1, 0.02, [4, 1]).unwrap();
    let infinite = f64::INFINITY;
    let muscle = paper::muscle_with_load(&mesh, paper::LAW, infinite, 0.0, Signal::paper(200.0));
    let dae = MuscleDae::new(muscle.unwrap(), Formulation::Velocity).unwrap();
    let tip = Probe::at(dae.muscle().solid.space(), [0.1, 0.0]).unwrap();
    let source = Source::Body(dae.displacement_at(&tip, 1));
    let network = paper::chain(3, 0.5).unwrap().network().unwrap();
    let chain = Oscillators::new(network, Drive::default(), vec![source]).unwrap();
    CoupledDae::new(dae, vec![chain])
}

fn settings() -> Settings {
    Settings { t_end: T_END, ..Settings::paper(Formulation::Velocity) }
}

/// Returns the number of steps, and the constraint drift at the end.
fn end(settings: &Settings) -> Result<(u64, f64), ModelError> {
    let dae = beam_and_chain();
    let loose = StateTolerances { relative: 1e-3, absolute: 1e-5, tested: true };
    let test = ErrorTest::of_muscle(dae.body(), settings).with_oscillators(&dae, loose);
    let options = CoupledOptions::of_muscle(dae.body(), settings);
    let n = dae.n_unknowns();
    let own = dae.body_range();
    let mut integrator = start_coupled(dae, test, options, T_END, &vec![0.0; n])?;
    let statistics = run(integrator.as_mut(), &mut [])?;
    assert_eq!(statistics.outcome, Outcome::Finished);
    let mut y = vec![0.0; n];
    integrator.dense_output(T_END, 0, &mut y)?;
    let body = integrator.problem_mut().body_mut();
    let drift = body.constraint_drift(T_END, &y[own])?;
    Ok((statistics.counts.steps, drift))
}

/// Regression: both settings had no effect for a muscle with a chain.
#[test]
fn a_chain_changes_neither_projection_nor_weights() {
    let (steps, drift) = end(&settings()).unwrap();
    let projected = Settings { projection_interval: Some(1e-3), ..settings() };
    let (restarted, less) = end(&projected).unwrap();
    assert!(restarted > steps, "{restarted} {steps}");
    assert!(less < 0.1 * drift, "{less:e} {drift:e}");

    let tested = Settings {
        suppressed: Vec::new(),
        multiplier_weights: MultiplierWeights::StepScaled,
        ..settings()
    };
    // With constant weights, a multiplier in the error test stops the run or causes extremely small steps.
    let (weighted, _) = end(&tested).unwrap();
    assert!(weighted < 4 * steps, "{weighted} {steps}");
}

#[test]
fn settings_without_effect_on_integrator_or_system_are_rejected() {
    let radau = settings().with_integrator(IntegratorKind::Radau5);
    let projected = Settings { projection_interval: Some(0.1), ..radau.clone() };
    let weighted = Settings { multiplier_weights: MultiplierWeights::StepScaled, ..radau };
    for settings in [projected, weighted] {
        let refused = end(&settings);
        assert!(matches!(refused, Err(ModelError::OnlyBdf { .. })), "{refused:?}");
    }

    let settings = Settings { projection_interval: Some(0.1), ..settings() };
    let one_way = beam_and_chain();
    let n_elements = one_way.body().muscle().solid.space().n_elements();
    let test = ErrorTest::of_muscle(one_way.body(), &settings)
        .with_oscillators(&one_way, StateTolerances::default());
    let options = CoupledOptions::of_muscle(one_way.body(), &settings);
    let rest = vec![0.0; one_way.n_unknowns()];
    let feedback = Feedback {
        network: 0,
        coherence: SmoothCoherence::new(1e-3).unwrap(),
        unsynchronized: 2.0,
        coherent: 1.0,
        effect: Effect::Stiffness,
        weights: Feedback::of_one_place(&vec![1.0; 3 * n_elements]),
    };
    let dae = FeedbackDae::new(one_way, vec![feedback]);
    let refused = start_with_feedback(dae, test, options, [0.0, T_END], &rest, &rest);
    assert!(matches!(refused.err(), Some(ModelError::NotWithFeedback { .. })));
}
