//! Work of a run: element passes of disabled features.

use myovib_fem::{Law, Mesh};
use myovib_model::{
    Formulation, IntegratorKind, Muscle, MuscleDae, Settings, Signal, StepOptions, WorkCounters,
    formula, paper, run, start_at_rest,
};

/// Returns the paper's muscle with the given load, Pa.
fn muscle(law: Law, kappa: f64, beta: f64, load: Signal) -> Muscle {
    let mesh = Mesh::parse_msh(include_str!("../../../../data/meshes/muscle.msh"), "muscle.msh");
    paper::muscle_with_load(&mesh.unwrap(), law, kappa, beta, load).unwrap()
}

/// Runs the paper's muscle for 0.5 s and returns its element passes, and the residuals of the integrator without its start.
fn passes(formulation: Formulation, law: Law, kappa: f64, beta: f64) -> (WorkCounters, u64) {
    let muscle = muscle(law, kappa, beta, Signal::paper(paper::LOAD_AMPLITUDE));
    let settings = Settings { t_end: 0.5, ..Settings::paper(formulation) };
    let dae = MuscleDae::new(muscle, formulation).unwrap();
    let mut integrator = start_at_rest(dae, &settings).unwrap();
    let start = integrator.problem().counters().residual_passes;
    let residuals = run(integrator.as_mut(), &mut []).unwrap().counts.residual_evaluations;
    (*integrator.problem().counters(), start + residuals)
}

#[test]
fn disabled_features_are_not_computed() {
    use Formulation::{Displacement, ImplicitRate, Position, Rate};
    use paper::{BETA, KAPPA, LAW, SMALL_STRAIN};
    for (formulation, law, kappa, beta) in [
        (Displacement, SMALL_STRAIN, KAPPA, 0.0),
        (Position, SMALL_STRAIN, f64::INFINITY, 0.0),
        (Position, SMALL_STRAIN, KAPPA, 0.0),
        (Position, LAW, KAPPA, 0.0),
        (ImplicitRate, LAW, KAPPA, BETA),
        (Rate, LAW, KAPPA, BETA),
    ] {
        let (done, residuals) = passes(formulation, law, kappa, beta);
        assert_eq!(done.residual_passes, residuals, "{done:?}");
        let unused = [
            done.added_passes,
            done.added_tangent_passes,
            done.bed_passes,
            done.relaxing_passes,
            done.relaxing_tangent_passes,
            done.relaxing_solve_passes,
            done.coherence_passes,
            done.fiber_passes,
            done.inversions,
            done.linear.pivoted,
        ];
        assert_eq!(unused, [0; 10], "{done:?}");
        let damped = |passes| if beta > 0.0 { passes } else { 0 };
        assert!(done.residual_passes > 0, "{done:?}");
        assert_eq!(done.force_rate_passes, damped(done.residual_passes), "{done:?}");
        assert_eq!(done.rate_tangent_passes, damped(done.tangent_passes), "{done:?}");
        // A linear law has constant matrices.
        assert_eq!(done.tangent_passes == 1, law == SMALL_STRAIN, "{done:?}");
    }
}

/// Regression: steps that grew fast were tested between their stages also where the schedule limits the steps: twice the
/// solves for a ventricle. `max_step` disables the test.
#[test]
fn inputs_between_stages_are_not_searched_if_the_schedule_limits_the_steps() {
    let step = Signal::from(formula::StepFunction { value: 100.0, start: 0.1, rise: 0.1 });
    let sine = Signal::from(formula::Sine { amplitude: 100.0, frequency: 1.0, phase: 0.0 });
    for (load, is_searched) in [(step, false), (sine, true)] {
        let work = |max_step| {
            let muscle = muscle(paper::LAW, paper::KAPPA, 0.0, load.clone());
            let settings = Settings {
                t_end: 0.5,
                steps: StepOptions { max_step, ..StepOptions::default() },
                integrator: IntegratorKind::Radau5,
                ..Settings::paper(Formulation::Position)
            };
            let dae = MuscleDae::new(muscle, Formulation::Position).unwrap();
            let mut integrator = start_at_rest(dae, &settings).unwrap();
            run(integrator.as_mut(), &mut []).unwrap().counts
        };
        let [free, limited] = [None, Some(1e3)].map(work);
        assert_eq!(free.steps, limited.steps);
        let evaluations = (free.residual_evaluations, limited.residual_evaluations);
        assert_eq!(evaluations.0 > evaluations.1, is_searched, "{evaluations:?}");
    }
}
