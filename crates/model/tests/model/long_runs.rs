//! Checks that memory does not grow in long runs, and that drift is bounded.
//!
//! The high-water mark of memory belongs to the process, so this file has only one test.

use std::fs;
use std::ops::ControlFlow;

use myovib_conformance::samples::{MechanicalForm, Pendulum, Sample};
use myovib_dae::{Problem, Suppressed, Tolerances};
use myovib_fem::Mesh;
use myovib_model::coupling::{Body, CoupledDae, ErrorTest, Oscillators, Source, StateTolerances};
use myovib_model::start::Consistent;
use myovib_model::{
    AcceptedStep, Displacement, Formulation, IdaIntegrator, LinearSolverKind, ModelError,
    MuscleDae, Observer, Outcome, Probe, Settings, ida, paper, run,
};
use myovib_oscillators::Drive;

use sundials_wrap::{IdaOptions, IdaSolver};

/// Returns the peak memory so far, KiB, if the operating system reports it.
fn high_water() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// Records the largest value of a quantity, and the memory, in the first and in the second half of a run.
struct Halves<F> {
    middle: f64,
    quantity: F,
    y: Vec<f64>,
    largest: [f64; 2],
    /// KiB at the middle.
    memory: Option<u64>,
}

impl<P: Problem, F: FnMut(&mut P, f64, &[f64]) -> f64> Observer<P> for Halves<F> {
    fn accepted(
        &mut self,
        step: &mut AcceptedStep<'_, P>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
        let t = step.to;
        step.integrator.dense_output(t, 0, &mut self.y)?;
        let value = (self.quantity)(step.integrator.problem_mut(), t, &self.y);
        let half = usize::from(t > self.middle);
        if half == 1 && self.memory.is_none() {
            self.memory = high_water();
        }
        self.largest[half] = self.largest[half].max(value);
        Ok(ControlFlow::Continue(()))
    }
}

/// Allowed late allocations, KiB, for example by reading the high-water mark; a leak of one double
/// per step would be larger.
const SLACK: u64 = 64;

fn assert_constant(name: &str, before: Option<u64>) {
    if let (Some(before), Some(after)) = (before, high_water()) {
        println!("{name}: {before} KiB at the middle, {after} KiB at the end");
        assert!(after <= before + SLACK, "{name}: {before} to {after} KiB");
    }
}

/// Runs a coupled system of a body and a chain, and checks that `quantity` increases from the first half of the run to
/// the second by at most a factor of 2.
fn long_run<B: Body>(
    name: &str,
    mut integrator: IdaIntegrator<CoupledDae<B>>,
    n: usize,
    t_end: f64,
    quantity: impl FnMut(&mut CoupledDae<B>, f64, &[f64]) -> f64,
) {
    let mut halves =
        Halves { middle: 0.5 * t_end, quantity, y: vec![0.0; n], largest: [0.0; 2], memory: None };
    let statistics = run(&mut integrator, &mut [&mut halves]).unwrap();
    assert_eq!(statistics.outcome, Outcome::Finished, "{name}");
    let [first, second] = halves.largest;
    println!(
        "{name}: {} steps in {:.0} s; {first:.2e}, then {second:.2e}",
        statistics.counts.steps, statistics.cpu_seconds
    );
    assert!(second <= 2.0 * first, "{name}: {first:e}, then {second:e}");
    assert_constant(name, halves.memory);
}

fn oscillators(n: usize, half_width: f64, source: Displacement) -> Oscillators {
    let chain = paper::chain(n, half_width).unwrap();
    let network = chain.network().unwrap();
    Oscillators::new(network, Drive::default(), vec![Source::Body(source)]).unwrap()
}

/// Checks the distance of the pendulum of index 2 from its circle, over a million steps of at most 1 ms.
fn pendulum() {
    const STEPS: u64 = 1_000_000;
    let pendulum = Pendulum::new(MechanicalForm::Stabilized);
    let start = pendulum.start();
    let options = IdaOptions {
        tolerances: Tolerances::scalar(1e-6, 1e-6),
        suppressed: Suppressed::Algebraic,
        max_steps: None,
        max_step: Some(1e-3),
        ..IdaOptions::default()
    };
    let builder = IdaSolver::builder(pendulum).options(options);
    let mut solver = builder.build(start.t, &start.y, &start.y_dot).unwrap();
    let (mut largest, mut memory) = ([0.0_f64; 2], None);
    for step in 0..STEPS {
        solver.step(f64::MAX).unwrap();
        let half = usize::from(step >= STEPS / 2);
        if half == 1 && memory.is_none() {
            memory = high_water();
        }
        let y = solver.y();
        let residual = (y[0] * y[0] + y[1] * y[1] - 1.0).abs();
        largest[half] = largest[half].max(residual);
    }
    let [first, second] = largest;
    let t = solver.t();
    println!("pendulum: {STEPS} steps to t = {t:.0}; {first:.2e}, then {second:.2e}");
    assert_eq!(solver.statistics().steps, STEPS);
    assert!(second <= 2.0 * first, "{first:e}, then {second:e}");
    assert_constant("pendulum", memory);
}

/// Checks the largest state of the chain, for the rod with twenty oscillators over [0, 200] s.
fn rod_with_chain() {
    const T_END: f64 = 200.0;
    let rod = paper::rod().unwrap();
    let point = rod.displacement_at(paper::ROD_POINT).unwrap();
    let mut dae = CoupledDae::new(rod, vec![oscillators(20, 0.05, point)]);
    let tolerances = StateTolerances::default();
    let test =
        ErrorTest::of_states(dae.body_range().len(), tolerances).with_oscillators(&dae, tolerances);
    let (n, rest) = (dae.n_unknowns(), vec![0.0; dae.n_unknowns()]);
    let options = IdaOptions::default();
    let [y, y_dot] = dae.consistent(0.0, &rest).unwrap();
    let integrator = IdaIntegrator::coupled_at(
        dae,
        test,
        options,
        LinearSolverKind::Full,
        [0.0, T_END],
        &y,
        &y_dot,
    )
    .unwrap();
    let largest = |dae: &mut CoupledDae<_>, _, y: &[f64]| {
        let states = &y[dae.range(0)];
        states.iter().fold(0.0_f64, |most, y| most.max(y.abs()))
    };
    long_run("rod with chain", integrator, n, T_END, largest);
}

/// Checks the drift of the constraint, for the muscle with five oscillators over [0, 50] s.
fn muscle_with_chain() {
    const T_END: f64 = 50.0;
    let mesh = include_str!("../../../../data/meshes/muscle.msh");
    let mesh = Mesh::parse_msh(mesh, "muscle.msh").unwrap();
    let muscle = paper::muscle(&mesh, paper::KAPPA, paper::BETA).unwrap();
    let origin = Probe::at(muscle.solid.space(), [0.0, 0.0]).unwrap();
    let muscle = MuscleDae::new(muscle, Formulation::Rate).unwrap();
    let settings = Settings { max_order: 5, t_end: T_END, ..Settings::paper(Formulation::Rate) };
    let options = ida::options(&muscle, &settings);
    let point = muscle.displacement_at(&origin, 1);
    let mut dae = CoupledDae::new(muscle, vec![oscillators(5, 0.5, point)]);
    let test = ErrorTest::of_muscle(dae.body(), &settings)
        .with_oscillators(&dae, StateTolerances::default());
    let (n, rest) = (dae.n_unknowns(), vec![0.0; dae.n_unknowns()]);
    let solver = LinearSolverKind::Condensed;
    let [y, y_dot] = dae.consistent(0.0, &rest).unwrap();
    let times = [0.0, T_END];
    let integrator =
        IdaIntegrator::coupled_at(dae, test, options, solver, times, &y, &y_dot).unwrap();
    let drift = |dae: &mut CoupledDae<MuscleDae>, t, y: &[f64]| {
        let range = dae.body_range();
        dae.body_mut().constraint_drift(t, &y[range]).unwrap()
    };
    long_run("muscle with chain", integrator, n, T_END, drift);
}

#[test]
#[ignore = "slow"]
fn long_runs_keep_their_memory_and_their_drift() {
    pendulum();
    rod_with_chain();
    muscle_with_chain();
}
