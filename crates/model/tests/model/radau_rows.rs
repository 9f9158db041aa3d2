//! Radau IIA on the rows of Table 2, with all components in the error test.

use std::ops::ControlFlow;

use myovib_dae::Problem;
use myovib_fem::Mesh;
use myovib_model::coupling::ErrorTest;
use myovib_model::{
    AcceptedStep, Formulation, Integrator, IntegratorKind, ModelError, MuscleDae, Observer,
    Outcome, Probe, RadauIntegrator, SampleTimes, Sampler, Settings, paper, radau, run,
    start_at_rest,
};
use myovib_radau::{RadauOptions, StepSize};

/// A row: formulation, κ, β.
type Row = (Formulation, f64, f64);

const INF: f64 = f64::INFINITY;
const ROWS: [Row; 5] = [
    (Formulation::Position, 1e5, 0.0),
    (Formulation::Rate, 1e5, 1e-4),
    (Formulation::Rate, INF, 1e-4),
    (Formulation::Position, INF, 0.0),
    (Formulation::Velocity, INF, 0.0),
];
const INDEX_3: Row = ROWS[3];

fn start((formulation, kappa, beta): Row) -> MuscleDae {
    let mesh = include_str!("../../../../data/meshes/muscle.msh");
    let mesh = Mesh::parse_msh(mesh, "muscle.msh").unwrap();
    MuscleDae::new(paper::muscle(&mesh, kappa, beta).unwrap(), formulation).unwrap()
}

/// Returns tolerances for all components, in the proportions of the paper.
fn settings(row: Row, integrator: IntegratorKind, rtol: f64, t_end: f64) -> Settings {
    Settings {
        integrator,
        t_end,
        suppressed: Vec::new(),
        ..Settings::paper(row.0).with_relative_tolerance(rtol)
    }
}

/// Time between two samples, s.
const EVERY: f64 = 0.01;

/// u_y and p at the origin at intervals of [`EVERY`].
struct Samples {
    u_y: Vec<f64>,
    p: Vec<f64>,
    steps: Steps,
}

/// Start and end times of the steps, s.
#[derive(Default)]
struct Steps(Vec<[f64; 2]>);

impl Steps {
    /// Returns the size of the step in which a sample was taken.
    fn of_sample(&self, sample: usize) -> f64 {
        let t = sample as f64 * EVERY;
        let last = self.0.len() - 1;
        let [from, to] = self.0[self.0.partition_point(|[_, to]| *to < t).min(last)];
        to - from
    }
}

impl Observer<MuscleDae> for Steps {
    fn accepted(
        &mut self,
        step: &mut AcceptedStep<'_, MuscleDae>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
        self.0.push([step.from, step.to]);
        Ok(ControlFlow::Continue(()))
    }
}

fn samples(integrator: &mut dyn Integrator<MuscleDae>, t_end: f64) -> Samples {
    let dae = integrator.problem();
    let origin = Probe::at(dae.muscle().solid.space(), [0.0, 0.0]).unwrap();
    let n = dae.n_unknowns();
    let (mut u_y, mut p) = (Vec::new(), Vec::new());
    let mut sampler =
        Sampler::new(SampleTimes::new(EVERY, t_end), n, |dae: &mut MuscleDae, t, y: &[f64]| {
            let value = dae.read(&origin, t, y);
            u_y.push(value.displacement[1]);
            p.push(value.pressure);
            Ok(())
        });
    let mut steps = Steps::default();
    let statistics = run(integrator, &mut [&mut sampler, &mut steps]).unwrap();
    assert_eq!(statistics.outcome, Outcome::Finished);
    drop(sampler);
    Samples { u_y, p, steps }
}

fn adaptive(row: Row, integrator: IntegratorKind, rtol: f64, t_end: f64) -> Samples {
    let settings = settings(row, integrator, rtol, t_end);
    samples(start_at_rest(start(row), &settings).unwrap().as_mut(), t_end)
}

/// Returns the largest difference, relative to the largest value of `reference`.
fn error(values: &[f64], reference: &[f64]) -> f64 {
    assert_eq!(values.len(), reference.len());
    let apart = values.iter().zip(reference).map(|(a, b)| (a - b).abs());
    let size = reference.iter().fold(0.0_f64, |max, b| max.max(b.abs()));
    apart.fold(0.0, f64::max) / size
}

/// Allowed ratio of the errors of u_y to the relative tolerance: ratios up to 6 were observed over
/// 10 s, for a few hundred steps of an undamped motion.
const OF_TOLERANCE: f64 = 10.0;

#[test]
fn all_rows_hold_their_tolerance() {
    let (t_end, rtol) = (1.5, 1e-5);
    for row in ROWS {
        let reference = adaptive(row, IntegratorKind::Radau13, 1e-9, t_end);
        for kind in [IntegratorKind::Radau5, IntegratorKind::Radau9, IntegratorKind::Radau13] {
            let ours = adaptive(row, kind, rtol, t_end);
            let error = error(&ours.u_y, &reference.u_y);
            println!("{row:?} {}: {} steps, {error:.1e}", kind.name(), ours.steps.0.len());
            assert!(error < OF_TOLERANCE * rtol, "{row:?} {}: {error:e}", kind.name());
        }
    }
}

#[test]
#[ignore = "slow"]
fn index_3_agrees_with_the_stabilized_formulation_to_the_tolerance() {
    let t_end = 10.0;
    let stabilized = (Formulation::Stabilized, INF, 0.0);
    let reference = adaptive(stabilized, IntegratorKind::Radau13, 1e-9, t_end);
    let size = reference.p.iter().fold(0.0_f64, |max, p| max.max(p.abs()));
    println!("rtol     steps  u_y      p");
    // In addition to the tolerance, the pressure has an error C h^(s − 1), where h is the step that contains the
    // sample. For s = 3 it is 0.07 to 0.15 s⁻² h², as with fixed steps; for s = 5 it was up to 14 s⁻⁴ h⁴ in the first
    // run of this test. The mean step size cannot be used, because the first steps are twice as long.
    for (kind, c, order) in [(IntegratorKind::Radau5, 0.2, 2), (IntegratorKind::Radau9, 20.0, 4)] {
        for digits in 3..=8 {
            let rtol = 10f64.powi(-digits);
            let ours = adaptive(INDEX_3, kind, rtol, t_end);
            let u_y = error(&ours.u_y, &reference.u_y);
            assert!(u_y < OF_TOLERANCE * rtol, "{rtol:e}: {u_y:e}");
            println!(
                "{} {rtol:.0e} {:>6}  {u_y:.1e}  {:.1e}",
                kind.name(),
                ours.steps.0.len(),
                error(&ours.p, &reference.p)
            );
            for (sample, (ours_p, p)) in ours.p.iter().zip(&reference.p).enumerate() {
                let h = ours.steps.of_sample(sample);
                let (error, allowed) =
                    ((ours_p - p).abs() / size, OF_TOLERANCE * rtol + c * h.powi(order));
                assert!(error < allowed, "{rtol:e}, {h:e}: {error:e} of {allowed:e}");
            }
        }
    }
}

#[test]
fn in_index_3_the_pressure_errs_by_the_cube_of_the_step() {
    let t_end = 1.5;
    let fixed = |kind, h: f64| {
        let dae = start(INDEX_3);
        let settings = settings(INDEX_3, kind, 1e-9, t_end);
        let options =
            RadauOptions { step_size: StepSize::Fixed(h), ..radau::options(&dae, &settings) };
        let zero = vec![0.0; dae.n_unknowns()];
        let (test, solver, times) = (None::<ErrorTest>, settings.linear_solver, [0.0, t_end]);
        let mut integrator =
            RadauIntegrator::coupled_at(dae, test, options, solver, times, &zero, &zero).unwrap();
        samples(&mut integrator, t_end)
    };
    // Reference with seven stages and the second smallest of these steps: the order of p is 7, so its error is far
    // below the measured errors.
    let reference = fixed(IntegratorKind::Radau13, 2.5e-3);
    let errors: Vec<[f64; 2]> = [10e-3, 5e-3, 2.5e-3, 1.25e-3]
        .into_iter()
        .map(|h| {
            let ours = fixed(IntegratorKind::Radau5, h);
            let errors = [error(&ours.u_y, &reference.u_y), error(&ours.p, &reference.p)];
            println!(
                "h = {h}: u_y {:.1e}, p {:.1e} = {:.2} h³",
                errors[0],
                errors[1],
                errors[1] / (h * h * h)
            );
            errors
        })
        .collect();
    for (coarse, fine) in errors.iter().zip(&errors[1..]) {
        let order = (coarse[1] / fine[1]).log2();
        // The order converges to 3 from above: the motion has order 5, and higher-order terms of p are not negligible.
        assert!((2.7..4.0).contains(&order), "order {order} of p");
        assert!(fine[0] < coarse[0], "{errors:?}");
    }
}
