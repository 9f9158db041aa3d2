//! Cost of the gradient of a misfit with respect to the stiffness of each element: row 4 of Table 2
//! by Radau IIA, with the adjoint using stored stages or checkpoints. `cargo run --release -p
//! myovib-model --example adjoint_cost [T_END]`
use myovib_dae::Problem;
use myovib_fem::Mesh;
use myovib_model::linear::CondensedSolver;
use myovib_model::sensitivity::ElementStiffness;
use myovib_model::{Formulation, IntegratorKind, MuscleDae, Probe, Settings, paper, radau};
use myovib_radau::{Adjoint, RadauSolver, Recording};

/// Times are the least of so many runs.
const BEST_OF: usize = 3;

type Run = RadauSolver<MuscleDae, CondensedSolver>;

fn start(integrator: IntegratorKind, t_end: f64) -> Run {
    let mesh = include_str!("../../../data/meshes/muscle.msh");
    let mesh = Mesh::parse_msh(mesh, "muscle.msh").expect("the mesh is good");
    let muscle = paper::muscle(&mesh, f64::INFINITY, 0.0).expect("the muscle is good");
    let dae = MuscleDae::new(muscle, Formulation::Position).expect("it can be run");
    let settings = Settings {
        integrator,
        t_end,
        ..Settings::paper(Formulation::Position)
    };
    let options = radau::options(&dae, &settings);
    let matrices = CondensedSolver::new(&dae, options.sparse).expect("it can be analyzed");
    let rest = vec![0.0; dae.n_unknowns()];
    let builder = RadauSolver::builder(dae).options(options);
    let solver = builder.build_with(matrices, 0.0, &rest, &rest);
    solver.expect("the options are good")
}

fn main() {
    let t_end: f64 = std::env::args()
        .nth(1)
        .map_or(10.0, |t| t.parse().expect("a time in s"));
    println!(
        "method   steps fact. plain s  kept: ratio    MiB fact. solves  checkpoints: ratio    MiB repeated"
    );
    for (name, integrator) in [
        ("radau5", IntegratorKind::Radau5),
        ("radau9", IntegratorKind::Radau9),
        ("radau13", IntegratorKind::Radau13),
    ] {
        let (mut plain, mut statistics) = (f64::INFINITY, None);
        for _ in 0..BEST_OF {
            let started = cpu_time::ThreadTime::now();
            let mut solver = start(integrator, t_end);
            solver.integrate_to(t_end).expect("it runs");
            plain = plain.min(started.elapsed().as_secs_f64());
            statistics = Some(solver.statistics());
        }
        let statistics = statistics.expect("it ran");
        let [kept, repeated] = [Recording::of_stages, Recording::of_checkpoints].map(|record| {
            (0..BEST_OF)
                .map(|_| {
                    let started = cpu_time::ThreadTime::now();
                    let mut solver = start(integrator, t_end);
                    let mut recording = record(&solver).expect("it has not begun");
                    recording.integrate_to(&mut solver, t_end).expect("it runs");
                    let dae = solver.problem();
                    let probe =
                        Probe::at(dae.muscle().solid.space(), [0.0, 0.0]).expect("in the body");
                    let displacement = dae.displacement_at(&probe, 1);
                    let n = dae.n_unknowns();
                    let stiffness = ElementStiffness::new(dae);
                    let mut adjoint = Adjoint::new(&solver, stiffness);
                    let samples: Vec<f64> =
                        (1..=100).map(|k| t_end * f64::from(k) / 100.0).collect();
                    let mut y = vec![0.0; n];
                    let gradient = adjoint
                        .gradient(&mut solver, &recording, &mut |step| {
                            for &t in &samples {
                                if !step.covers(t) {
                                    continue;
                                }
                                step.evaluate(t, 0, &mut y);
                                let u = displacement.of(&y);
                                y.fill(0.0);
                                let of = displacement.unknowns.iter();
                                of.for_each(|&(i, weight)| y[i] = weight * u);
                                step.add(t, 0, &y);
                            }
                            Ok(())
                        })
                        .expect("it can be taken back");
                    let norm: f64 = gradient.parameters.iter().map(|g| g * g).sum();
                    assert!(norm > 0.0);
                    let ratio = started.elapsed().as_secs_f64() / plain;
                    (
                        ratio,
                        recording.n_bytes() as f64 / (1 << 20) as f64,
                        adjoint.work(),
                    )
                })
                .min_by(|a, b| f64::total_cmp(&a.0, &b.0))
                .expect("it ran")
        });
        let (ratio, memory, work) = kept;
        println!(
            "{name:8} {:5} {:5} {plain:7.3} {ratio:12.2} {memory:6.1} {:5} {:6} {:18.2} {:6.1} {:5}",
            statistics.steps,
            statistics.linear_setups,
            work.factorizations,
            work.real_solves,
            repeated.0,
            repeated.1,
            repeated.2.repeated_steps
        );
    }
}
