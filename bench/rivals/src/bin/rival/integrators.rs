//! Integrators of diffsol and of this project.

use cpu_time::ThreadTime;
use diffsol::{
    FaerSparseLU, FaerSparseMat, OdeBuilder, OdeSolverMethod, OdeSolverStopReason, Vector,
};
use myovib_dae::Problem;
use myovib_model::{
    Formulation, IntegratorKind, MuscleDae, Outcome, Probe, SampleTimes, Sampler, Settings, run,
    start_at_rest,
};

use crate::Run;
use crate::equations::Equations;

/// Relative tolerances. The absolute tolerances are proportional to the relative tolerance, with the factors of the
/// paper.
pub const TOLERANCES: [f64; 5] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

/// Maximum CPU time (s) of a diffsol run.
const CAP: f64 = 60.0;

/// Integrator with its options.
#[derive(Clone, Copy)]
pub enum Integrator {
    DiffsolBdf,
    DiffsolTrBdf2,
    DiffsolEsdirk34,
    /// Integrator of this project, with its maximum order.
    Ours(IntegratorKind, u8),
}

pub const INTEGRATORS: [Integrator; 6] = [
    Integrator::DiffsolBdf,
    Integrator::DiffsolTrBdf2,
    Integrator::DiffsolEsdirk34,
    Integrator::Ours(IntegratorKind::Bdf, 2),
    Integrator::Ours(IntegratorKind::Bdf, 5),
    Integrator::Ours(IntegratorKind::Radau9, 9),
];

impl Integrator {
    pub fn name(self) -> &'static str {
        match self {
            Self::DiffsolBdf => "diffsol BDF",
            Self::DiffsolTrBdf2 => "diffsol TR-BDF2",
            Self::DiffsolEsdirk34 => "diffsol ESDIRK34",
            Self::Ours(IntegratorKind::Bdf, 2) => "ours, BDF 2",
            Self::Ours(IntegratorKind::Bdf, _) => "ours, BDF 5",
            Self::Ours(..) => "ours, Radau IIA 9",
        }
    }

    /// Returns whether the integrator belongs to diffsol.
    pub fn is_rival(self) -> bool {
        !matches!(self, Self::Ours(..))
    }

    /// Integrates `dae` from rest, with outputs at `times`.
    pub fn run(self, dae: MuscleDae, rtol: f64, times: &[f64]) -> anyhow::Result<Run> {
        let settings = settings(rtol, times.last().copied().unwrap_or(0.0));
        if let Self::Ours(integrator, max_order) = self {
            let settings = Settings { integrator, max_order: max_order.min(5), ..settings };
            return ours(dae, &settings, times);
        }
        let origin = Probe::at(dae.muscle().solid.space(), [0.0, 0.0])?;
        let atol = dae.layout().fill(|field| settings.absolute_tolerances.of(field));
        let start = ThreadTime::now();
        let problem = OdeBuilder::<FaerSparseMat<f64>>::new()
            .rtol(rtol)
            .atol(atol)
            .build_from_eqn(Equations::new(dae)?)?;
        type Lu = FaerSparseLU<f64>;
        let mut result = match self {
            Self::DiffsolBdf => follow(problem.bdf::<Lu>()?, times, &origin)?,
            Self::DiffsolTrBdf2 => follow(problem.tr_bdf2::<Lu>()?, times, &origin)?,
            _ => follow(problem.esdirk34::<Lu>()?, times, &origin)?,
        };
        result.cpu_seconds = start.elapsed().as_secs_f64();
        result.residual_evaluations = problem.eqn.residual_evaluations();
        Ok(result)
    }
}

/// Returns settings for the integrators of this project. All components are included in the error test.
fn settings(rtol: f64, t_end: f64) -> Settings {
    Settings {
        t_end,
        suppressed: Vec::new(),
        ..Settings::paper(Formulation::Position).with_relative_tolerance(rtol)
    }
}

/// Returns u_y and p at a point in the state `y`.
fn read(dae: &mut MuscleDae, point: &Probe, t: f64, y: &[f64]) -> (f64, f64) {
    let value = dae.read(point, t, y);
    (value.displacement[1], value.pressure)
}

/// Integrates up to the last of `times`, and samples the solution at `times`.
fn follow<'a, S>(mut solver: S, times: &[f64], origin: &Probe) -> anyhow::Result<Run>
where
    S: OdeSolverMethod<'a, Equations>,
{
    let start = ThreadTime::now();
    let mut result = Run::default();
    let end = times.last().copied().unwrap_or(0.0);
    solver.set_stop_time(end)?;
    let mut due = times.iter().copied().peekable();
    loop {
        let stop = solver.step()?;
        let t = solver.state().t;
        while let Some(time) = due.next_if(|&time| time <= t) {
            let y = solver.interpolate(time)?;
            let dae = &mut solver.problem().eqn.dae.borrow_mut();
            let (u_y, p) = read(dae, origin, time, &y.clone_as_vec());
            result.u_y.push(u_y);
            result.p.push(p);
        }
        if matches!(stop, OdeSolverStopReason::TstopReached) {
            break;
        }
        if start.elapsed().as_secs_f64() > CAP {
            anyhow::bail!("more than {CAP} s at t = {t:.3}");
        }
    }
    let statistics = solver.get_statistics();
    result.steps = statistics.number_of_steps as u64;
    result.linear_setups = statistics.number_of_linear_solver_setups as u64;
    Ok(result)
}

fn ours(dae: MuscleDae, settings: &Settings, times: &[f64]) -> anyhow::Result<Run> {
    let origin = Probe::at(dae.muscle().solid.space(), [0.0, 0.0])?;
    let mut result = Run::default();
    let n = dae.n_unknowns();
    let mut integrator = start_at_rest(dae, settings)?;
    let every = settings.t_end / (times.len() - 1) as f64;
    let times = SampleTimes::new(every, settings.t_end);
    let mut sampler = Sampler::new(times, n, |dae: &mut MuscleDae, t, y: &[f64]| {
        let (u_y, p) = read(dae, &origin, t, y);
        result.u_y.push(u_y);
        result.p.push(p);
        Ok(())
    });
    let statistics = run(integrator.as_mut(), &mut [&mut sampler])?;
    drop(sampler);
    anyhow::ensure!(statistics.outcome == Outcome::Finished, "{:?}", statistics.outcome);
    result.cpu_seconds = statistics.cpu_seconds;
    result.steps = statistics.counts.steps;
    result.residual_evaluations = statistics.counts.residual_evaluations;
    result.linear_setups = statistics.counts.linear_setups;
    Ok(result)
}
