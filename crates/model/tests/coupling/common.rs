//! The paper's rod and chain as one system, and functions that run and observe it.

use myovib_dae::Problem;
use myovib_fem::Mesh;
use myovib_model::coupling::{
    Body, CoherenceHistory, CoupledDae, ErrorTest, NoBody, Oscillators, Recorder, Recording,
    Source, StateTolerances,
};
use myovib_model::linear::Scalar;
use myovib_model::start::Consistent;
use myovib_model::{
    Displacement, Formulation, IdaIntegrator, LinearSolverKind, MuscleDae, Observer, Outcome,
    Probe, RodDae, SampleTimes, Sampler, Settings, Statistics, ida, paper, run,
};
use myovib_oscillators::{Chain, Drive};

use sundials_wrap::IdaOptions;

/// 12.5 samples per cycle.
pub(crate) const EVERY: f64 = 0.01;

/// Returns the paper's rod, which drives `chain` at L/2 with the gain `gain`.
pub(crate) fn rod_and_chain(chain: &Chain, gain: f64) -> CoupledDae<RodDae> {
    let rod = paper::rod().unwrap();
    let point = rod.displacement_at(paper::ROD_POINT).unwrap();
    let drive = Drive { gain, reach: chain.reach };
    let network = chain.network().unwrap();
    let oscillators = Oscillators::new(network, drive, vec![Source::Body(point)]).unwrap();
    CoupledDae::new(rod, vec![oscillators])
}

/// `chain` driven by `source` alone.
pub(crate) fn chain_alone(chain: &Chain, gain: f64, source: Source) -> CoupledDae<NoBody> {
    let drive = Drive { gain, reach: chain.reach };
    let oscillators = Oscillators::new(chain.network().unwrap(), drive, vec![source]).unwrap();
    CoupledDae::new(NoBody, vec![oscillators])
}

/// Returns the motion of the paper's rod at L/2, from rest to `t_end`.
pub(crate) fn recorded_rod(t_end: f64) -> (Recording, Statistics) {
    let rod = CoupledDae::new(paper::rod().unwrap(), Vec::new());
    let point = rod.body().displacement_at(paper::ROD_POINT).unwrap();
    let (n, y) = (rod.n_unknowns(), vec![0.0; rod.n_unknowns()]);
    let mut recorder = Recorder::new(point, n);
    let mut alone = start(rod, StateTolerances::default(), t_end, &y);
    let statistics = run(&mut alone, &mut [&mut recorder]).unwrap();
    (recorder.finish(), statistics)
}

/// Starts a system in which all states have these `tolerances`.
pub(crate) fn start<B: Body>(
    mut dae: CoupledDae<B>,
    tolerances: StateTolerances,
    t_end: f64,
    y: &[f64],
) -> IdaIntegrator<CoupledDae<B>> {
    let test =
        ErrorTest::of_states(dae.body_range().len(), tolerances).with_oscillators(&dae, tolerances);
    let [y, y_dot] = dae.consistent(0.0, y).unwrap();
    let (options, full, times) = (IdaOptions::default(), LinearSolverKind::Full, [0.0, t_end]);
    IdaIntegrator::coupled_at(dae, test, options, full, times, &y, &y_dot).unwrap()
}

/// The paper's mesh.
pub(crate) fn muscle_mesh() -> Mesh {
    Mesh::parse_msh(include_str!("../../../../data/meshes/muscle.msh"), "muscle.msh").unwrap()
}

/// Returns the paper's muscle in the formulation of Figure 7.
pub(crate) fn muscle() -> MuscleDae {
    let muscle = paper::muscle(&muscle_mesh(), paper::KAPPA, paper::BETA).unwrap();
    MuscleDae::new(muscle, Formulation::Rate).unwrap()
}

/// Returns u_y at the origin of a muscle.
pub(crate) fn origin(muscle: &MuscleDae) -> Displacement {
    let probe = Probe::at(muscle.muscle().solid.space(), [0.0, 0.0]).unwrap();
    muscle.displacement_at(&probe, 1)
}

/// Returns the paper's muscle, which drives `chain` at the origin with the gain `gain`.
pub(crate) fn muscle_and_chain(chain: &Chain, gain: f64) -> CoupledDae<MuscleDae> {
    let muscle = muscle();
    let source = Source::Body(origin(&muscle));
    let drive = Drive { gain, reach: chain.reach };
    let oscillators = Oscillators::new(chain.network().unwrap(), drive, vec![source]).unwrap();
    CoupledDae::new(muscle, vec![oscillators])
}

/// Starts a muscle from rest with `settings`, and its chains with the tolerances `chain`.
pub(crate) fn start_muscle(
    mut dae: CoupledDae<MuscleDae>,
    settings: &Settings,
    chain: StateTolerances,
) -> IdaIntegrator<CoupledDae<MuscleDae>> {
    let test = ErrorTest::of_muscle(dae.body(), settings).with_oscillators(&dae, chain);
    let options = ida::options(dae.body(), settings);
    let (solver, times) = (settings.linear_solver, [0.0, settings.t_end]);
    let rest = vec![0.0; dae.n_unknowns()];
    let [y, y_dot] = dae.consistent(0.0, &rest).unwrap();
    IdaIntegrator::coupled_at(dae, test, options, solver, times, &y, &y_dot).unwrap()
}

/// Runs to the end, sampling the coherence of the first network every `every` seconds.
pub(crate) fn observe<B: Body>(
    integrator: &mut IdaIntegrator<CoupledDae<B>>,
    every: f64,
    t_end: f64,
    further: &mut [&mut dyn Observer<CoupledDae<B>>],
) -> (CoherenceHistory, Statistics) {
    use myovib_model::Integrator as _;
    let mut history = CoherenceHistory::default();
    let n = integrator.problem().n_unknowns();
    let mut sampler =
        Sampler::new(SampleTimes::new(every, t_end), n, |dae: &mut CoupledDae<B>, t, y: &[f64]| {
            Ok(history.record(dae, 0, t, y)?)
        });
    let mut observers: Vec<&mut dyn Observer<CoupledDae<B>>> = vec![&mut sampler];
    for observer in further {
        observers.push(&mut **observer);
    }
    let statistics = run(integrator, &mut observers).unwrap();
    assert_eq!(statistics.outcome, Outcome::Finished);
    drop(sampler);
    (history, statistics)
}

/// Integrates from rest to `t_end` with the default tolerances.
pub(crate) fn from_rest(chain: &Chain, gain: f64, t_end: f64) -> (CoherenceHistory, Statistics) {
    let dae = rod_and_chain(chain, gain);
    let y = vec![0.0; dae.n_unknowns()];
    let mut integrator = start(dae, StateTolerances::default(), t_end, &y);
    observe(&mut integrator, EVERY, t_end, &mut [])
}

/// Returns max_i |b − (∂F/∂y + c ∂F/∂ẏ) x|_i / (|A||x| + |b|)_i at time t in the full system.
pub(crate) fn backward_error<P: Problem, T: Scalar>(
    dae: &mut P,
    t: f64,
    [y, y_dot]: [&[f64]; 2],
    c: T,
    b: &[T],
    x: &[T],
) -> f64 {
    let pattern = dae.jacobian_pattern();
    let mut at = |df_dy, df_dyp| {
        let mut values = vec![0.0; pattern.nnz()];
        dae.jacobian(t, y, y_dot, df_dy, df_dyp, &mut values).unwrap();
        values
    };
    let (df_dy, df_dyp) = (at(1.0, 0.0), at(0.0, 1.0));
    let (mut residual, mut scale) = (b.to_vec(), vec![0.0; b.len()]);
    for ((column, row), (&value, &rate)) in pattern.entries().zip(df_dy.iter().zip(&df_dyp)) {
        let a = T::one() * value + c * rate;
        residual[row] -= a * x[column];
        scale[row] += a.abs() * x[column].abs();
    }
    let rows = residual.iter().zip(b).zip(&scale);
    rows.map(|((r, b), scale)| r.abs() / (scale + b.abs())).fold(0.0, f64::max)
}
