//! Reference trajectories: converged in time, with the digits they claim and where they come from.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use anyhow::Context;
use myovib_dae::Problem;
use myovib_fem::{Mesh, Solid};
use myovib_model::{
    MuscleDae, Outcome, Probe, SampleTimes, Sampler, Settings, paper, run, start_at_rest,
};
use serde::{Deserialize, Serialize};

use super::cases::{Case, Way, selected};
use super::{BenchArgs, goes_on};
use myovib_cli::exit::Exit;
use myovib_cli::progress::Progress;
use myovib_scene::atomic_file;
use myovib_scene::versions::Versions;

/// Time between two samples, s: twenty to a period of the load.
pub(super) const EVERY: f64 = 1.0 / 160.0;
/// The fields are kept at every so many samples, which meets all phases of the load.
const FIELD_STRIDE: usize = 16;
/// End of the references, s.
const T_END: f64 = 1.0;
/// The largest steps of the two runs whose difference is the error claimed, s; apart from the
/// start, all steps are of this size.
const STEPS: [f64; 2] = [2.5e-3, 1.25e-3];
/// Relative tolerance of the runs.
const TOLERANCE: f64 = 1e-10;

/// A solution sampled in time.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Trajectory {
    pub(super) times: Vec<f64>,
    /// u_y at the origin, m.
    pub(super) u_y: Vec<f64>,
    /// p at the origin, Pa; empty without pressure.
    pub(super) p: Vec<f64>,
    pub(super) field_times: Vec<f64>,
    /// All nodal displacements at the field times, m.
    pub(super) displacement: Vec<Vec<f64>>,
    /// All vertex pressures at the field times, Pa.
    pub(super) pressure: Vec<Vec<f64>>,
}

/// The errors of a trajectory, each relative to the largest value of the reference.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Errors {
    /// u_y at the origin, the largest over the samples.
    pub(super) u_y: f64,
    /// p at the origin; null without pressure.
    pub(super) p: Option<f64>,
    /// u in L2(Ω), the largest over the field times.
    pub(super) displacement_l2: f64,
    /// The largest nodal displacement error.
    pub(super) displacement_max: f64,
    /// p in L2(Ω).
    pub(super) pressure_l2: Option<f64>,
    /// The largest vertex pressure error.
    pub(super) pressure_max: Option<f64>,
}

#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Reference {
    case: String,
    provenance: String,
    /// The difference of the two finest runs, which bounds the error of the finer one.
    pub(super) claimed: Errors,
    #[serde(flatten)]
    pub(super) trajectory: Trajectory,
}

const BUILT_IN: [(&str, &str); 5] = [
    (
        "undamped",
        include_str!("../../../data/references/muscle_undamped.json"),
    ),
    (
        "damped",
        include_str!("../../../data/references/muscle_damped.json"),
    ),
    (
        "incompressible",
        include_str!("../../../data/references/muscle_incompressible.json"),
    ),
    (
        "damped-incompressible",
        include_str!("../../../data/references/muscle_damped-incompressible.json"),
    ),
    (
        "displacement",
        include_str!("../../../data/references/muscle_displacement.json"),
    ),
];

fn file_name(case: &Case) -> String {
    format!("muscle_{}.json", case.name)
}

impl Reference {
    /// The reference of a case, from a folder or built in.
    pub(super) fn load(case: &Case, folder: Option<&Path>) -> anyhow::Result<Self> {
        let text = match folder {
            Some(folder) => {
                let path = folder.join(file_name(case));
                fs::read_to_string(&path)
                    .with_context(|| format!("no reference `{}`", path.display()))?
            }
            None => BUILT_IN
                .iter()
                .find(|(name, _)| *name == case.name)
                .map(|(_, text)| (*text).to_owned())
                .context("each case has a reference built in")?,
        };
        serde_json::from_str(&text).context("a reference is JSON as `--write-references` writes it")
    }

    /// The end of what it covers, s.
    pub(super) fn t_end(&self) -> f64 {
        self.trajectory.times.last().copied().unwrap_or(0.0)
    }
}

impl Trajectory {
    /// Where a run's samples go.
    pub(super) fn recorder<'a>(
        &'a mut self,
        dae: &MuscleDae,
        origin: &'a Probe,
        t_end: f64,
    ) -> Sampler<impl FnMut(&mut MuscleDae, f64, &[f64]) -> Result<(), myovib_model::ModelError> + 'a>
    {
        let times = SampleTimes::new(EVERY, t_end);
        Sampler::new(
            times,
            dae.n_unknowns(),
            |dae: &mut MuscleDae, t, y: &[f64]| {
                let pressure = dae.pressure(y);
                let (displacement, _) = dae.nodal_motion(t, y);
                let value = origin.read(displacement, pressure);
                let keep_field =
                    self.times.len().is_multiple_of(FIELD_STRIDE) && !self.times.is_empty();
                if keep_field {
                    self.field_times.push(t);
                    self.displacement.push(displacement.to_vec());
                    self.pressure.extend(pressure.map(<[f64]>::to_vec));
                }
                self.times.push(t);
                self.u_y.push(value.displacement[1]);
                if pressure.is_some() {
                    self.p.push(value.pressure);
                }
                Ok(())
            },
        )
    }

    /// The errors of `self`, which may end earlier than `reference`.
    pub(super) fn errors(&self, reference: &Self, solid: &Solid) -> Errors {
        let absolute = |values: &[f64]| values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let l2 = |vector: &[f64], product: &dyn Fn(&[f64], &mut [f64])| {
            let mut image = vec![0.0; vector.len()];
            product(vector, &mut image);
            vector
                .iter()
                .zip(&image)
                .map(|(a, b)| a * b)
                .sum::<f64>()
                .sqrt()
        };
        let mass = |a: &[f64], out: &mut [f64]| solid.apply_mass(a, out);
        let pressure_mass = |a: &[f64], out: &mut [f64]| solid.apply_pressure_mass(a, out);
        let has_pressure = !reference.p.is_empty();
        let fields = |ours: &[Vec<f64>], theirs: &[Vec<f64>], norm: &dyn Fn(&[f64]) -> f64| {
            relative(
                ours.iter()
                    .zip(theirs)
                    .map(|(a, b)| (norm(&difference(a, b)), norm(b))),
            )
        };
        let points = |ours: &[f64], theirs: &[f64]| {
            relative(
                ours.iter()
                    .zip(theirs)
                    .map(|(a, b)| ((a - b).abs(), b.abs())),
            )
        };
        let (u, u_ref) = (&self.displacement, &reference.displacement);
        let (p, p_ref) = (&self.pressure, &reference.pressure);
        Errors {
            u_y: points(&self.u_y, &reference.u_y),
            p: has_pressure.then(|| points(&self.p, &reference.p)),
            displacement_l2: fields(u, u_ref, &|v| l2(v, &mass)),
            displacement_max: fields(u, u_ref, &absolute),
            pressure_l2: has_pressure.then(|| fields(p, p_ref, &|v| l2(v, &pressure_mass))),
            pressure_max: has_pressure.then(|| fields(p, p_ref, &absolute)),
        }
    }
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// The largest error over the largest value.
fn relative(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (error, value) = pairs.fold((0.0_f64, 0.0_f64), |(e, v), (error, value)| {
        (e.max(error), v.max(value))
    });
    error / value
}

/// Computes the references of the cases asked for.
pub(super) fn write_all(args: &BenchArgs, mesh: &Mesh) -> anyhow::Result<Exit> {
    let folder = args
        .references
        .as_deref()
        .context("--write-references needs --references")?;
    let progress = Progress::new(args.common.quiet);
    for case in selected(&args.cases)?.into_iter().take_while(|_| goes_on()) {
        let in_steps_of = |step| {
            progress.show(|| format!("{}: Radau IIA in steps of {step:e} s", case.name));
            compute(case, mesh, step, T_END)
        };
        let (coarse, fine) = (in_steps_of(STEPS[0])?, in_steps_of(STEPS[1])?);
        let muscle = paper::muscle(mesh, case.kappa, case.beta)?;
        let claimed = coarse.errors(&fine, &muscle.solid);
        let reference = Reference {
            case: case.name.to_owned(),
            provenance: format!(
                "myovib {} bench --write-references: mesh muscle.msh, formulation `{}`, Radau IIA \
                 of order 13 in steps of {:e} s; `claimed` is the relative difference to the run \
                 in steps of {:e} s",
                Versions::found().myovib,
                case.formulations[0],
                STEPS[1],
                STEPS[0]
            ),
            claimed,
            trajectory: fine,
        };
        let text = serde_json::to_string(&reference)?;
        atomic_file::save(&folder.join(file_name(case)), text)?;
        writeln!(io::stdout(), "{}: {claimed:?}", case.name)?;
    }
    Ok(if goes_on() {
        Exit::Done
    } else {
        Exit::Interrupted
    })
}

/// A trajectory up to `t_end`, by Radau IIA of order 13 in steps of `step` at most.
pub(super) fn compute(
    case: &Case,
    mesh: &Mesh,
    step: f64,
    t_end: f64,
) -> anyhow::Result<Trajectory> {
    let muscle = paper::muscle(mesh, case.kappa, case.beta)?;
    let formulation = case.formulations[0];
    let origin = Probe::at(muscle.solid.space(), [0.0, 0.0])?;
    let dae = MuscleDae::new(muscle, formulation)?;
    let settings = Settings {
        max_step: Some(step),
        ..Way::Radau13.settings(formulation, TOLERANCE, t_end)
    };
    let mut trajectory = Trajectory::default();
    let mut recorder = trajectory.recorder(&dae, &origin, t_end);
    let mut integrator = start_at_rest(dae, &settings)?;
    let statistics = run(integrator.as_mut(), &mut [&mut recorder])?;
    if let Outcome::Stopped { message, .. } = statistics.outcome {
        anyhow::bail!("the reference of {} stopped: {message}", case.name);
    }
    drop(recorder);
    Ok(trajectory)
}
