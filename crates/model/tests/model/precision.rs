//! Checks that factors in single precision change neither steps nor results.

use myovib_dae::Problem;
use myovib_fem::generate;
use myovib_model::{
    Formulation, IntegratorKind, MuscleDae, Outcome, Settings, Statistics, StepOptions, paper, run,
    start_at_rest,
};
use myovib_sparse::{LinearWork, Precision};

/// The matrices are small: only their precision is compared, not their cost.
fn integrate(
    formulation: Formulation,
    [kappa, beta]: [f64; 2],
    integrator: IntegratorKind,
    precision: Precision,
) -> (Statistics, LinearWork, Vec<f64>) {
    let settings = Settings {
        t_end: 0.5,
        steps: StepOptions { initial_step: Some(1e-3), ..StepOptions::default() },
        precision,
        ..Settings::paper(formulation).with_integrator(integrator)
    };
    let muscle = paper::muscle(&generate::spindle([10, 2]).unwrap(), kappa, beta).unwrap();
    let dae = MuscleDae::new(muscle, formulation).unwrap();
    let mut integrator = start_at_rest(dae, &settings).unwrap();
    let statistics = run(&mut *integrator, &mut []).unwrap();
    let mut state = vec![0.0; integrator.problem_mut().n_unknowns()];
    integrator.dense_output(settings.t_end, 0, &mut state).unwrap();
    (statistics, integrator.problem_mut().counters().linear, state)
}

#[test]
fn single_precision_changes_neither_steps_nor_results() {
    use Formulation::{Displacement, ImplicitRate, Position, Rate, Stabilized, Velocity};
    let infinite = f64::INFINITY;
    let cases = [
        (Displacement, [1e5, 0.0]),
        (Position, [1e5, 0.0]),
        (Position, [1e12, 0.0]),
        (Position, [infinite, 0.0]),
        (Velocity, [1e5, 0.0]),
        (Stabilized, [infinite, 0.0]),
        (Rate, [1e5, 1e-4]),
        (Rate, [infinite, 1e-4]),
        (ImplicitRate, [infinite, 1e-4]),
    ];
    for (formulation, parameters) in cases {
        for method in [IntegratorKind::Bdf, IntegratorKind::Radau5] {
            let name = format!("{formulation}, {parameters:?}, {}", method.name());
            let of = |precision| integrate(formulation, parameters, method, precision);
            let (double, _, exact) = of(Precision::Double);
            let (mixed, linear, state) = of(Precision::Mixed);
            assert_eq!([&double.outcome, &mixed.outcome], [&Outcome::Finished; 2], "{name}");
            let in_single = match formulation {
                Stabilized => 0,
                _ => linear.factorizations,
            };
            assert_eq!(linear.in_single_precision, in_single, "{name}");
            assert_eq!(double.counts.steps, mixed.counts.steps, "{name}");
            let difference = exact.iter().zip(&state).map(|(a, b)| (a - b).abs());
            let difference = difference.fold(0.0, f64::max);
            let largest = exact.iter().fold(0.0, |max, a| f64::max(max, a.abs()));
            // Solutions of Newton's method are accurate only to a fraction of the tolerance.
            let bound = Settings::paper(formulation).relative_tolerance * largest;
            assert!(difference <= bound, "{name}: {difference:e} > {bound:e}");
        }
    }
}
