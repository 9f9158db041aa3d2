//! Energy balance of a contracting, viscous block on an elastic foundation, and its derived
//! quantities.

use std::ops::ControlFlow;

use myovib_dae::Problem;
use myovib_fem::AddedStress;
use myovib_model::{
    AcceptedStep, Energies, Formulation, InitialValues, IntegratorKind, LinearSolverKind,
    ModelError, MuscleDae, Observer, Outcome, Powers, Settings, run, start_from,
};

use crate::common::{contracting, viscous};

const T_END: f64 = 0.15;

/// Integrates powers over each step by Gauss's rule of three points, of order 6 in the step.
#[derive(Default)]
pub(crate) struct Balance {
    start: Option<f64>,
    given: f64,
    pub(crate) taken: f64,
    active: f64,
    pub(crate) largest: f64,
    pub(crate) gap: f64,
}

fn energies(
    step: &mut AcceptedStep<'_, MuscleDae>,
    t: f64,
) -> Result<(Energies, Powers), ModelError> {
    let n = step.integrator.problem().n_unknowns();
    let (mut y, mut y_dot) = (vec![0.0; n], vec![0.0; n]);
    step.integrator.dense_output(t, 0, &mut y)?;
    step.integrator.dense_output(t, 1, &mut y_dot)?;
    let dae = step.integrator.problem_mut();
    Ok((dae.energies(t, &y, &y_dot), dae.powers(t, &y, &y_dot)?))
}

impl Observer<MuscleDae> for Balance {
    fn accepted(
        &mut self,
        step: &mut AcceptedStep<'_, MuscleDae>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
        let (from, to) = (step.from, step.to);
        let (first, _) = energies(step, from)?;
        let start = *self.start.get_or_insert(first.kinetic + first.elastic);
        let (h, offset) = (to - from, 0.6_f64.sqrt());
        for (place, weight) in [(-offset, 5.0), (0.0, 8.0), (offset, 5.0)] {
            let (_, at) = energies(step, from + 0.5 * h * (1.0 + place))?;
            let share = h * weight / 18.0;
            self.given += share * (at.load + at.support + at.active);
            self.active += share * at.active;
            self.taken += share * at.dissipation;
        }
        let (now, _) = energies(step, to)?;
        let stored = now.kinetic + now.elastic - start;
        self.largest = self.largest.max(stored.abs()).max(self.active.abs());
        self.gap = self.gap.max((stored + self.taken - self.given).abs());
        Ok(ControlFlow::Continue(()))
    }
}

pub(crate) fn settings(formulation: Formulation, rtol: f64) -> Settings {
    let mut settings = Settings::paper(formulation).with_integrator(IntegratorKind::Radau5);
    settings.t_end = T_END;
    settings.relative_tolerance = rtol;
    settings.absolute_tolerances.displacement = 1e-2 * rtol;
    settings.absolute_tolerances.velocity = 1e-1 * rtol;
    settings.absolute_tolerances.pressure = 1e3 * rtol;
    settings.absolute_tolerances.multiplier = 1e4 * rtol;
    settings
}

/// Returns the balance of a run in 3D with all features: β, viscosity, Hill's curve, foundations,
/// both kinds of activation.
fn balance(rtol: f64) -> Balance {
    let formulation = Formulation::ImplicitRate;
    let muscle = contracting(3, 1e5, 1e-3, viscous());
    let settings = settings(formulation, rtol);
    let mut dae = MuscleDae::new(muscle, formulation).unwrap();
    let rest = vec![0.0; dae.muscle().solid.dofs().n_free()];
    let start = InitialValues::new(&mut dae, 0.0, &rest, &rest).unwrap();
    let mut integrator = start_from(dae, &settings, 0.0, &start.y, &start.y_dot).unwrap();
    let mut balance = Balance::default();
    let statistics = run(&mut *integrator, &mut [&mut balance]).unwrap();
    assert_eq!(statistics.outcome, Outcome::Finished);
    let counters = integrator.problem().counters();
    assert!(counters.added_passes == counters.residual_passes && counters.added_passes > 0);
    assert_eq!(counters.added_tangent_passes, counters.tangent_passes);
    assert_eq!(counters.bed_passes, counters.residual_passes);
    balance
}

#[test]
fn the_work_of_active_stress_is_stored_or_dissipated() {
    let [loose, tight] = [1e-3, 1e-5].map(balance);
    let relative = |balance: &Balance| balance.gap / balance.largest;
    // Tolerance of a step: values of Radau IIA at ends of steps are of higher order than its
    // estimate. A power that is omitted or counted twice is detected at any tolerance.
    assert!(relative(&loose) < 1e-3, "{:e}", relative(&loose));
    assert!(relative(&tight) < 1e-5, "{:e}", relative(&tight));
    assert!(tight.taken > 0.1 * tight.active, "{} {}", tight.taken, tight.active);
}

#[test]
fn a_body_without_active_or_viscous_stress_skips_their_evaluation() {
    for (dimension, in_bed) in [(2, false), (2, true), (3, false), (3, true)] {
        let mut muscle = contracting(dimension, 1e5, 0.0, [AddedStress::default(); 2]);
        muscle.solid = muscle.solid.clone().with_added_stresses(&[]).unwrap();
        if !in_bed {
            muscle.foundations.clear();
        }
        let formulation = Formulation::Position;
        let dae = MuscleDae::new(muscle, formulation).unwrap();
        let zero = vec![0.0; dae.n_unknowns()];
        let settings = settings(formulation, 1e-3);
        let mut integrator = start_from(dae, &settings, 0.0, &zero, &zero).unwrap();
        run(&mut *integrator, &mut []).unwrap();
        let counters = integrator.problem().counters();
        assert!(counters.residual_passes > 0 && counters.tangent_passes > 0);
        assert_eq!([counters.added_passes, counters.added_tangent_passes], [0; 2]);
        let expected = if in_bed { counters.residual_passes } else { 0 };
        assert_eq!(counters.bed_passes, expected);
        assert_eq!(counters.relaxing_passes, 0);
    }
}

/// Compares Newton's method with the symmetric part of the viscous stiffness and with the full stiffness.
#[test]
fn the_skew_part_of_the_viscous_stiffness_saves_few_iterations() {
    let formulation = Formulation::Position;
    let counts = [LinearSolverKind::Condensed, LinearSolverKind::Full].map(|linear_solver| {
        let settings = Settings { linear_solver, ..settings(formulation, 1e-4) };
        let muscle = contracting(2, 1e5, 0.0, viscous());
        let mut dae = MuscleDae::new(muscle, formulation).unwrap();
        let rest = vec![0.0; dae.muscle().solid.dofs().n_free()];
        let start = InitialValues::new(&mut dae, 0.0, &rest, &rest).unwrap();
        let mut integrator = start_from(dae, &settings, 0.0, &start.y, &start.y_dot).unwrap();
        let statistics = run(&mut *integrator, &mut []).unwrap();
        assert_eq!(statistics.outcome, Outcome::Finished);
        statistics.counts
    });
    let [symmetric, whole] = counts.map(|counts| counts.newton_iterations as f64);
    assert!(symmetric < 1.1 * whole, "{symmetric} {whole}");
}
