//! Signals with jumps: integrators stop at the jump and restart after it.

use std::f64::consts::TAU;

use myovib_dae::Problem;
use myovib_fem::rod::{EndLoad, Rod, RodData};
use myovib_model::coupling::{
    CoupledDae, CoupledOptions, ErrorTest, StateTolerances, start_coupled,
};
use myovib_model::{
    Advance, Field, Formulation, Integrator, IntegratorKind, MuscleDae, Outcome, Prescribed,
    RodDae, SampleTimes, Sampler, Settings, Signal, formula, run, start_at_rest,
};

use crate::common::{beam, tolerances};

fn jump(value: f64, start: f64) -> Signal {
    Signal::from(formula::StepFunction { value, start, rise: 0.0 })
}

/// Returns y at intervals of `every` seconds, as sampled by a run.
fn rows<P: Problem>(integrator: &mut dyn Integrator<P>, every: f64, t_end: f64) -> Vec<Vec<f64>> {
    let n = integrator.problem().n_unknowns();
    let mut rows = Vec::new();
    let times = SampleTimes::new(every, t_end);
    let mut sampler = Sampler::new(times, n, |_: &mut P, _, y: &[f64]| {
        rows.push(y.to_vec());
        Ok(())
    });
    let statistics = run(integrator, &mut [&mut sampler]).unwrap();
    assert_eq!(statistics.outcome, Outcome::Finished);
    drop(sampler);
    rows
}

/// A rod of one element is an oscillator m ü + k u = f, here of 5 Hz. Impacts act on it at t = 0, 0.31 and 0.62.
#[test]
fn an_oscillator_under_an_impact_moves_as_in_the_closed_form() {
    let rod = Rod::new(RodData {
        axial_stiffness: 100.0 * (TAU * 0.5).powi(2) / 3.0,
        density: 1.0,
        length: 1.0,
        mass_damping: 0.0,
        stiffness_damping: 0.0,
        n_elements: 1,
    })
    .unwrap();
    let omega = (rod.stiffness().values()[0] / rod.mass().values()[0]).sqrt();
    assert!((omega / TAU - 5.0).abs() < 1e-12, "{omega}");
    // Under a constant traction τ, the end moves by τ L.
    let hits = [(1.0, 0.0), (-2.5, 0.31), (0.75, 0.62)];
    let exact = |t: f64| {
        let of_hit = |(value, start): &(f64, f64)| {
            let phase = omega * (t - start).max(0.0);
            [value * (1.0 - phase.cos()), value * omega * phase.sin()]
        };
        let parts: Vec<_> = hits.iter().map(of_hit).collect();
        [0, 1].map(|k| parts.iter().map(|part| part[k]).sum::<f64>())
    };
    let load = Signal::sum(hits.iter().map(|(value, start)| jump(*value, *start)).collect());
    for integrator in IntegratorKind::ALL {
        for relative in [1e-4, 1e-7] {
            let dae = RodDae::new(rod.clone(), EndLoad::Traction, load.clone()).unwrap();
            let dae = CoupledDae::new(dae, Vec::new());
            let tolerances =
                StateTolerances { relative, absolute: relative, ..StateTolerances::default() };
            let test = ErrorTest::of_states(2, tolerances);
            let options = CoupledOptions::of_states(integrator);
            let mut integrator_of_it = start_coupled(dae, test, options, 1.0, &[0.0; 2]).unwrap();
            let rows = rows(&mut *integrator_of_it, 0.01, 1.0);
            let worst = rows.iter().enumerate().flat_map(|(k, y)| {
                let [u, v] = exact(0.01 * k as f64);
                [(y[0] - u).abs(), (y[1] - v).abs() / omega]
            });
            let worst = worst.fold(0.0, f64::max);
            // |u| is at most 5. The error of Radau IIA is at most ten tolerances; with BDF, the error may increase by
            // one tolerance per step.
            let most = match integrator {
                IntegratorKind::Bdf => integrator_of_it.counts().steps as f64,
                _ => 10.0,
            };
            assert!(
                worst < most * relative * (1.0 + 5.0),
                "{integrator:?} {relative:e}: {worst:e}"
            );
        }
    }
}

fn settings(integrator: IntegratorKind, formulation: Formulation, rtol: f64) -> Settings {
    Settings {
        integrator,
        t_end: 0.25,
        relative_tolerance: rtol,
        absolute_tolerances: tolerances(rtol),
        suppressed: match integrator {
            // Required by BDF for index 2 and 3.
            IntegratorKind::Bdf => Settings::paper(formulation).suppressed,
            _ => Vec::new(),
        },
        ..Settings::paper(formulation)
    }
}

/// Returns displacements and pressures at equidistant times.
fn motion(dae: MuscleDae, settings: &Settings) -> Vec<[Vec<f64>; 2]> {
    let ranges = [Field::Displacement, Field::Pressure].map(|field| dae.layout().range(field));
    let mut integrator = start_at_rest(dae, settings).unwrap();
    let rows = rows(integrator.as_mut(), 0.0125, settings.t_end).into_iter();
    rows.map(|y| ranges.clone().map(|range| y[range.unwrap_or_default()].to_vec())).collect()
}

/// Returns the largest differences of displacements and pressures, as fractions of their largest values.
fn apart(a: &[[Vec<f64>; 2]], b: &[[Vec<f64>; 2]]) -> [f64; 2] {
    [0, 1].map(|k| {
        let pairs = || a.iter().flat_map(|a| &a[k]).zip(b.iter().flat_map(|b| &b[k]));
        assert_eq!(a.len(), b.len());
        let size = pairs().fold(0.0, |m: f64, (a, _)| m.max(a.abs()));
        let difference = pairs().fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        if size > 0.0 { difference / size } else { difference }
    })
}

/// With every method and formulation, a body under a sudden load and release moves like a body whose load rises within
/// a thousandth of the shortest time scale. The latter load has no jump, so the comparison is independent of the
/// treatment of jumps.
#[test]
fn a_jump_is_the_limit_of_a_steep_rise() {
    use Formulation::{Displacement, ImplicitRate, Position, Rate, Stabilized, Velocity};
    let load = |rise| {
        let step = |value, middle| {
            Signal::from(formula::StepFunction { value, start: middle - 0.5 * rise, rise })
        };
        Signal::sum(vec![step(60.0, 0.0101), step(-90.0, 0.0998), step(40.0, 0.1503)])
    };
    for (formulation, kappa) in [
        (Displacement, 1e5),
        (Position, 1e5),
        (Position, f64::INFINITY),
        (Velocity, f64::INFINITY),
        (Stabilized, f64::INFINITY),
        (ImplicitRate, 1e5),
        (ImplicitRate, f64::INFINITY),
        (Rate, f64::INFINITY),
    ] {
        let steep = beam(formulation, kappa, load(1e-6));
        let steep = motion(steep, &settings(IntegratorKind::Radau9, formulation, 1e-7));
        for integrator in IntegratorKind::ALL {
            let dae = beam(formulation, kappa, load(0.0));
            let found = motion(dae, &settings(integrator, formulation, 1e-5));
            let off = apart(&steep, &found);
            // One tolerance for displacements and ten for pressures. For BDF 20 and 1000 tolerances, because its errors
            // accumulate and its error test excludes multipliers.
            let most = match integrator {
                IntegratorKind::Bdf => [2e-4, 1e-2],
                _ => [1e-5, 1e-4],
            };
            let holds = off[0] < most[0] && off[1] < most[1];
            assert!(holds, "{formulation} {kappa:e} {integrator:?}: {off:?}");
        }
    }
}

/// A state saved at a jump is the state before the jump. A run resumed from it passes the jump with bitwise identical
/// results.
#[test]
fn a_run_saved_at_a_jump_goes_on_bit_by_bit() {
    let formulation = Formulation::Stabilized;
    let load = Signal::sum(vec![jump(60.0, 0.02), jump(-90.0, 0.1)]);
    let settings = settings(IntegratorKind::Radau9, formulation, 1e-5);
    let start =
        || start_at_rest(beam(formulation, f64::INFINITY, load.clone()), &settings).unwrap();
    let mut whole = start();
    while whole.time() < 0.1 {
        assert_eq!(whole.advance().unwrap(), Advance::Stepped);
    }
    assert_eq!(whole.time(), 0.1, "steps end at a jump");
    let mut again = start();
    again.restore(&whole.save().unwrap()).unwrap();
    while whole.advance().unwrap() == Advance::Stepped {
        assert_eq!(again.advance().unwrap(), Advance::Stepped);
        assert_eq!(again.save(), whole.save());
    }
    // Steps are counted over all starts, so there are more than in the last start alone.
    assert_eq!(again.advance().unwrap(), Advance::Finished);
    assert_eq!(again.counts(), whole.counts());
    assert!(again.time() > 0.1);
}

#[test]
fn jumps_of_smooth_quantities_are_rejected_with_a_remedy() {
    let hit = jump(1.0, 0.1);
    let rod = Rod::new(RodData::default()).unwrap();
    let strained = RodDae::new(rod.clone(), EndLoad::Strain, hit.clone()).unwrap_err();
    let mut muscle = beam(Formulation::Position, 1e5, hit.clone()).muscle().clone();
    let free = muscle.solid.dofs().free_to_full();
    let component = (0..).find(|i| free.binary_search(i).is_err()).unwrap();
    muscle.prescribed.push(Prescribed { component, signal: hit });
    let moved = MuscleDae::new(muscle, Formulation::Position).map(|_| ()).unwrap_err();
    for error in [strained, moved] {
        let text = error.to_string();
        assert!(text.contains("jumps") && text.contains("give the step a rise"), "{text}");
    }
}
