//! Conditions that become true within a step are located there, with every method.

use std::ops::ControlFlow;

use myovib_dae::Problem;
use myovib_fem::generate;
use myovib_model::{
    AcceptedStep, EndReason, Formulation, Integrator, IntegratorKind, ModelError, MuscleDae,
    Observer, Outcome, Probe, Settings, Signal, first_positive, paper, run, start_at_rest,
};

fn start(integrator: IntegratorKind) -> (Box<dyn Integrator<MuscleDae>>, Probe) {
    let mesh = generate::beam(0.1, 0.02, [4, 1]).unwrap();
    let muscle = paper::muscle_with_load(&mesh, paper::LAW, 1e5, 1e-3, Signal::paper(20.0));
    let dae = MuscleDae::new(muscle.unwrap(), Formulation::ImplicitRate).unwrap();
    let tip = Probe::at(dae.muscle().solid.space(), [0.1, 0.0]).unwrap();
    let settings = Settings {
        t_end: 1.0,
        ..Settings::paper(Formulation::ImplicitRate).with_integrator(integrator)
    };
    (start_at_rest(dae, &settings).unwrap(), tip)
}

/// Returns |u| at the tip, which is not a polynomial.
fn size(dae: &mut MuscleDae, tip: &Probe, t: f64, y: &[f64]) -> f64 {
    let u = tip.vector(dae.nodal_motion(t, y).0);
    u.iter().map(|u| u * u).sum::<f64>().sqrt()
}

/// Samples |u| between the ends of steps on a grid much finer than the steps.
struct Raster {
    tip: Probe,
    values: Vec<(f64, f64)>,
    y: Vec<f64>,
}

impl Observer<MuscleDae> for Raster {
    fn accepted(
        &mut self,
        step: &mut AcceptedStep<'_, MuscleDae>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
        for k in 0..=400 {
            let t = step.from + (step.to - step.from) * f64::from(k) / 400.0;
            step.integrator.dense_output(t, 0, &mut self.y)?;
            let value = size(step.integrator.problem_mut(), &self.tip, t, &self.y);
            self.values.push((t, value));
        }
        Ok(ControlFlow::Continue(()))
    }
}

/// Ends the run when |u| exceeds a bound.
struct Stop {
    tip: Probe,
    above: f64,
    y: Vec<f64>,
}

impl Observer<MuscleDae> for Stop {
    fn accepted(
        &mut self,
        step: &mut AcceptedStep<'_, MuscleDae>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
        let Self { tip, above, y } = self;
        let met = first_positive(step.integrator, [step.from, step.to], y, |dae, t, y| {
            Ok(size(dae, tip, t, y) - *above)
        })?;
        Ok(match met {
            None => ControlFlow::Continue(()),
            Some(t) => {
                step.to = t;
                ControlFlow::Break(Outcome::ended(EndReason::Event, "far enough".into()))
            }
        })
    }
}

/// Regression: conditions were checked only at the ends of steps. A bound of 0.97 of the maximum
/// was missed, and a bound of 0.6 was detected a tenth of a second late.
#[test]
fn a_run_ends_where_its_condition_is_first_met() {
    for integrator in IntegratorKind::ALL {
        let (mut whole, tip) = start(integrator);
        let n = whole.problem().n_unknowns();
        let (values, y) = (Vec::new(), vec![0.0; n]);
        let mut raster = Raster { tip, values, y };
        run(whole.as_mut(), &mut [&mut raster]).unwrap();
        let most = raster.values.iter().fold(0.0_f64, |m, (_, u)| m.max(*u));
        for fraction in [0.3, 0.6, 0.97, 0.9999] {
            let above = fraction * most;
            let at = raster.values.iter().position(|(_, u)| *u > above).unwrap();
            let (expected, spacing) =
                (raster.values[at].0, raster.values[at].0 - raster.values[at - 1].0);
            let (mut stopped, tip) = start(integrator);
            let y = vec![0.0; n];
            let mut stop = Stop { tip, above, y };
            let statistics = run(stopped.as_mut(), &mut [&mut stop]).unwrap();
            let name = format!("{integrator:?}, {fraction}: {statistics:?}, expected {expected}");
            assert_eq!(statistics.outcome.reason(), Some(EndReason::Event), "{name}");
            let late = expected - statistics.t_reached;
            assert!((0.0..=spacing.max(1e-12)).contains(&late), "{name}: {late:e}");
        }
    }
}
