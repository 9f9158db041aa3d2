//! The discrete adjoint on row 4 of Table 2, of index 3, with the stiffness of each of its 311 elements
//! as a parameter.

use myovib_dae::{Jacobian, Linearization, Parameter, Parameters, Problem, StepError};
use myovib_fem::Mesh;
use myovib_model::linear::CondensedSolver;
use myovib_model::sensitivity::ElementStiffness;
use myovib_model::{Formulation, IntegratorKind, MuscleDae, Probe, Settings, paper, radau};
use myovib_radau::{Adjoint, ForwardSensitivities, Gradient, RadauSolver, Recording};

/// The load has risen to two thirds of its amplitude.
const T_END: f64 = 0.9;
const SAMPLES: [f64; 4] = [0.5, 0.7, 0.83, T_END];

type Run = RadauSolver<MuscleDae, CondensedSolver>;

fn start(integrator: IntegratorKind) -> Run {
    let mesh = include_str!("../../../../data/meshes/muscle.msh");
    let mesh = Mesh::parse_msh(mesh, "muscle.msh").unwrap();
    let muscle = paper::muscle(&mesh, f64::INFINITY, 0.0).unwrap();
    let dae = MuscleDae::new(muscle, Formulation::Position).unwrap();
    let settings = Settings { integrator, t_end: T_END, ..Settings::paper(Formulation::Position) };
    let options = radau::options(&dae, &settings);
    let matrices = CondensedSolver::new(&dae, options.sparse).unwrap();
    let rest = vec![0.0; dae.n_unknowns()];
    let builder = RadauSolver::builder(dae).options(options);
    builder.build_with(matrices, 0.0, &rest, &rest).unwrap()
}

/// Returns the derivative of J = Σ_k u_y(t_k)²/2 at the origin with respect to y, at a time with known u_y.
fn cotangent(dae: &MuscleDae, y: &[f64]) -> Vec<f64> {
    let probe = Probe::at(dae.muscle().solid.space(), [0.0, 0.0]).unwrap();
    let displacement = dae.displacement_at(&probe, 1);
    let mut cotangent = vec![0.0; y.len()];
    for &(i, weight) in &displacement.unknowns {
        cotangent[i] = weight * displacement.of(y);
    }
    cotangent
}

fn adjoint(integrator: IntegratorKind, with_checkpoints: bool) -> Gradient {
    let mut solver = start(integrator);
    let mut recording = match with_checkpoints {
        true => Recording::of_checkpoints(&solver),
        false => Recording::of_stages(&solver),
    }
    .unwrap();
    recording.integrate_to(&mut solver, T_END).unwrap();
    let dae = solver.problem().clone();
    let mut adjoint = Adjoint::new(&solver, ElementStiffness::new(&dae));
    let mut y = vec![0.0; dae.n_unknowns()];
    let gradient = adjoint.gradient(&mut solver, &recording, &mut |step| {
        for t in SAMPLES {
            if step.covers(t) {
                step.evaluate(t, 0, &mut y);
                step.add(t, 0, &cotangent(&dae, &y));
            }
        }
        Ok(())
    });
    gradient.unwrap()
}

/// Directions in the space of the stiffness factors of all elements, each of which is one parameter.
struct Directions {
    list: Vec<Parameter>,
    all: Vec<Vec<f64>>,
    stiffness: ElementStiffness,
}

impl Directions {
    fn new(dae: &MuscleDae, all: Vec<Vec<f64>>) -> Self {
        let parameter = |k| Parameter::new(format!("direction {k}"), 1.0);
        Self {
            list: (0..all.len()).map(parameter).collect(),
            stiffness: ElementStiffness::new(dae),
            all,
        }
    }
}

impl Parameters<MuscleDae> for Directions {
    fn list(&self) -> &[Parameter] {
        &self.list
    }

    fn derivative(
        &mut self,
        problem: &mut MuscleDae,
        j: usize,
        t: f64,
        y: &[f64],
        _: &[f64],
        out: &mut [f64],
    ) -> Result<(), StepError> {
        let at_corners: Vec<f64> = self.all[j].iter().flat_map(|d| [*d; 3]).collect();
        out.fill(0.0);
        problem.add_factor_response(t, y, &at_corners, out)
    }

    fn linearize(
        &mut self,
        problem: &mut MuscleDae,
        jacobian: &mut Jacobian,
        at: &Linearization<'_>,
        parts: [&mut [f64]; 2],
    ) -> Result<(), StepError> {
        self.stiffness.linearize(problem, jacobian, at, parts)
    }
}

fn forward(integrator: IntegratorKind, all: Vec<Vec<f64>>) -> Vec<f64> {
    let mut solver = start(integrator);
    let dae = solver.problem().clone();
    let (n, count) = (dae.n_unknowns(), all.len());
    let directions = Directions::new(&dae, all);
    let mut followed = ForwardSensitivities::new(&solver, directions, vec![vec![0.0; n]; count])
        .unwrap()
        .with_tolerance(1e-12);
    solver.set_stop_time(T_END).unwrap();
    let mut sums = vec![0.0; count];
    let (mut y, mut s) = (vec![0.0; n], vec![0.0; n]);
    while solver.t() < T_END {
        let from = solver.t();
        solver.step(T_END).unwrap();
        followed.follow(&mut solver).unwrap();
        for t in SAMPLES {
            let is_covered = from < t && t <= solver.t();
            if !is_covered {
                continue;
            }
            solver.dense_output(t, 0, &mut y).unwrap();
            let g = cotangent(&dae, &y);
            for (j, sum) in sums.iter_mut().enumerate() {
                followed.dense_output(&solver, j, t, 0, &mut s).unwrap();
                *sum += g.iter().zip(&s).map(|(g, s)| g * s).sum::<f64>();
            }
        }
    }
    sums
}

/// Checks ten digits of the gradient, for directions to which all elements contribute and for single elements.
#[test]
fn the_gradient_by_311_stiffnesses_is_that_of_forward_sensitivities() {
    for integrator in [IntegratorKind::Radau5, IntegratorKind::Radau9, IntegratorKind::Radau13] {
        let gradient = adjoint(integrator, false).parameters;
        let n = gradient.len();
        assert_eq!(n, 311);
        let of = |f: &dyn Fn(usize) -> f64| (0..n).map(f).collect::<Vec<f64>>();
        let directions =
            vec![of(&|_| 1.0), of(&|e| (e as f64).sin()), of(&|e| f64::from(u8::from(e == 100)))];
        let dot = |d: &Vec<f64>| d.iter().zip(&gradient).map(|(d, g)| d * g).sum::<f64>();
        let by_adjoint: Vec<f64> = directions.iter().map(dot).collect();
        let by_forward = forward(integrator, directions);
        for (f, a) in by_forward.iter().zip(&by_adjoint) {
            println!("{integrator:?}: {f:e} {:.1e}", (f - a) / f);
        }
        for (f, a) in by_forward.iter().zip(&by_adjoint) {
            assert!((f - a).abs() <= 1e-10 * f.abs(), "{integrator:?}: {f:e} {a:e}");
        }
        let repeated = adjoint(integrator, true).parameters;
        let size = gradient.iter().fold(0.0, |max, g| f64::max(max, g.abs()));
        for (stored, repeated) in gradient.iter().zip(&repeated) {
            assert!((stored - repeated).abs() <= 1e-10 * size);
        }
    }
}
