//! The run behind Figures 5 and 6: the muscle of section 3.2 in formulation (29).

use myovib_dae::Problem;
use myovib_fem::{Mesh, Space};
use myovib_model::paper::{BETA, KAPPA};
use myovib_model::{
    Formulation, IntegratorKind, MuscleDae, Probe, SampleTimes, Sampler, Settings, Statistics,
    paper, start_at_rest,
};
use serde_json::{Map, Value, json};

use super::last_period::{LastPeriod, PER_PERIOD};
use crate::exit::Exit;
use crate::experiments::{Course, run_watched};
use myovib_scene::statistics::StatisticsJson;

/// Period of the load, s.
pub(in crate::commands) const PERIOD: f64 = 1.0 / 8.0;

/// What was recorded of the run.
pub(in crate::commands) struct MuscleRun {
    pub(super) space: Space,
    pub(super) settings: Settings,
    pub(super) statistics: Statistics,
    /// t, u_x, u_y, p in the origin.
    pub(super) origin: Vec<[f64; 4]>,
    /// Displacement of every node.
    pub(super) last_period: LastPeriod<Vec<[f64; 2]>>,
}

impl MuscleRun {
    /// The settings of a run to `t_end` (s).
    pub(in crate::commands) fn settings(t_end: f64, integrator: IntegratorKind) -> Settings {
        Settings {
            t_end,
            ..Settings::paper(Formulation::Rate).with_integrator(integrator)
        }
    }

    /// Integrates from rest.
    pub(in crate::commands) fn compute(mesh: &Mesh, course: Course) -> anyhow::Result<Self> {
        let t_end = course.t_end;
        let muscle = paper::muscle(mesh, KAPPA, BETA)?;
        let space = Space::clone(muscle.solid.space());
        let origin = Probe::at(&space, [0.0, 0.0])?;
        let settings = Self::settings(t_end, course.integrator);
        let dae = MuscleDae::new(muscle, Formulation::Rate)?;
        let unknowns = dae.n_unknowns();
        let mut integrator = start_at_rest(dae, &settings)?;

        let (mut values, mut last_period) = (Vec::new(), LastPeriod::new(PERIOD));
        let times = SampleTimes::new(PERIOD / PER_PERIOD, t_end);
        let mut sampler = Sampler::new(times, unknowns, |dae: &mut MuscleDae, t, y: &[f64]| {
            let value = dae.read(&origin, t, y);
            let [u_x, u_y, _] = value.displacement;
            values.push([t, u_x, u_y, value.pressure]);
            let (displacement, _) = dae.nodal_motion(t, y);
            let nodal = displacement.chunks_exact(2).map(|u| [u[0], u[1]]).collect();
            last_period.push(t, nodal);
            Ok(())
        });
        let end = ("muscle", t_end);
        let statistics = run_watched(&mut *integrator, &mut sampler, end, course.progress)?;
        drop(sampler);
        Ok(Self {
            space,
            settings,
            statistics,
            origin: values,
            last_period,
        })
    }

    /// Parameters, settings and statistics, for the document of a figure.
    pub(super) fn document(&self) -> anyhow::Result<Map<String, Value>> {
        let statistics = StatisticsJson::new(&self.statistics, &self.settings, Formulation::Rate);
        let mut document = Map::from_iter([
            ("formulation".to_owned(), json!(Formulation::Rate.name())),
            ("kappa".to_owned(), json!(KAPPA)),
            ("beta".to_owned(), json!(BETA)),
        ]);
        if let Value::Object(statistics) = serde_json::to_value(statistics)? {
            document.extend(statistics);
        }
        Ok(document)
    }

    /// A run that did not reach its end is still drawn, as far as it got.
    pub(in crate::commands) fn exit(&self) -> Exit {
        Exit::of(&self.statistics.outcome)
    }
}
