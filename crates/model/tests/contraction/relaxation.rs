//! Viscoelastic stress with Prony terms: elimination, closed form, energy, counters.

use std::sync::Arc;

use myovib_dae::{LinearSolver as _, Linearization, Problem};
use myovib_fem::material::{Prony, PronyTerm};
use myovib_fem::{DofMap, Solid, Space, generate};
use myovib_model::linear::CondensedSolver;
use myovib_model::{
    Field, Formulation, InitialValues, IntegratorKind, Muscle, MuscleDae, Outcome, Parameters,
    Prescribed, Settings, Signal, check, formula, run, start_from,
};
use myovib_sparse::SparseOptions;
use num_complex::Complex64;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

use crate::common::{INF, block, contracting, elastic, halves, neo_hooke, viscous};
use crate::energy::{Balance, settings};
use crate::jacobian::NEAR;

pub(crate) fn series(terms: &[(f64, f64)]) -> Prony {
    let terms = terms.iter();
    let terms = terms.map(|&(weight, time)| PronyTerm { weight, time });
    Prony::new(terms.collect()).unwrap()
}

/// Returns the contracting block with a different Prony series in each half.
pub(crate) fn relaxing(dimension: usize, kappa: f64, beta: f64) -> Muscle {
    let stresses = if beta > 0.0 { viscous() } else { elastic() };
    let mut muscle = contracting(dimension, kappa, beta, stresses);
    let [left, right] = halves(&block(dimension));
    let regions = [(left, series(&[(0.5, 0.02), (0.3, 0.4)])), (right, series(&[(0.7, 0.1)]))];
    muscle.solid = muscle.solid.with_relaxation(&regions).unwrap();
    muscle
}

/// Returns (F(y + ε x, ẏ + ε z) − F(y − ε x, ẏ − ε z))/2ε.
fn along(dae: &mut MuscleDae, [y, y_dot]: [&[f64]; 2], x: &[f64], z: &[f64]) -> Vec<f64> {
    let step = 1e-7;
    let mut at = |sign: f64| {
        let moved = |from: &[f64], by: &[f64]| -> Vec<f64> {
            let pairs = from.iter().zip(by);
            pairs.map(|(from, by)| from + sign * step * by).collect()
        };
        let mut residual = vec![0.0; y.len()];
        let (y, y_dot) = (moved(y, x), moved(y_dot, z));
        dae.residual(0.1, &y, &y_dot, &mut residual).unwrap();
        residual
    };
    let (after, before) = (at(1.0), at(-1.0));
    let pairs = after.iter().zip(before);
    pairs.map(|(a, b)| (a - b) / (2.0 * step)).collect()
}

/// Returns the largest error of a row of each block, relative to the largest right-hand side of the block.
fn mismatch(dae: &MuscleDae, found: &[f64], right: &[f64]) -> f64 {
    let largest = |v: &mut dyn Iterator<Item = f64>| v.fold(0.0, |m: f64, x| m.max(x.abs()));
    let blocks = dae.layout().blocks().iter();
    blocks.fold(0.0, |max, (_, range)| {
        let pairs = found[range.clone()].iter().zip(&right[range.clone()]);
        let error = largest(&mut pairs.map(|(f, r)| f - r));
        max.max(error / largest(&mut right[range.clone()].iter().copied()))
    })
}

#[test]
fn elimination_solves_the_linearized_equations() {
    let mut rng = StdRng::seed_from_u64(5);
    let mut cases = 0;
    for (dimension, kappa, beta) in [
        (2, 1e5, 0.0),
        (2, INF, 0.0),
        (2, 1e5, 1e-2),
        (2, INF, 1e-2),
        (3, 1e5, 1e-2),
        (3, INF, 0.0),
    ] {
        let still_and_moving = |formulation| [(formulation, 0.0), (formulation, 1.0)];
        for (formulation, speed) in Formulation::ALL.into_iter().flat_map(still_and_moving) {
            let Ok(mut dae) = MuscleDae::new(relaxing(dimension, kappa, beta), formulation) else {
                continue;
            };
            cases += 1;
            let mut draw = |sizes: &dyn Fn(Field) -> f64| -> Vec<f64> {
                let size = dae.layout().fill(sizes);
                size.iter().map(|s| s * rng.random_range(-1.0..1.0)).collect()
            };
            let sizes = |field| match field {
                Field::Displacement => 0.01,
                Field::Velocity | Field::GglMultiplier => 1.0,
                _ => 1e3,
            };
            let (mut y, mut y_dot) = (draw(&sizes), draw(&sizes));
            let velocities = dae.layout().range(Field::Velocity).unwrap_or_default();
            let rates = y[velocities].iter_mut().chain(&mut y_dot);
            rates.for_each(|rate| *rate *= speed);
            // A right-hand side of the size that corresponds to a solution of these sizes.
            let c = Complex64::new(400.0, 300.0);
            let wanted: [Vec<f64>; 2] = [draw(&sizes), draw(&sizes)];
            let scaled = |x: &[f64], c: f64| -> Vec<f64> { x.iter().map(|x| c * x).collect() };
            let sum = |a: &[f64], b: &[f64]| -> Vec<f64> {
                a.iter().zip(b).map(|(a, b)| a + b).collect()
            };
            let image = |dae: &mut MuscleDae, [re, im]: [&[f64]; 2]| {
                let rate_re = sum(&scaled(re, c.re), &scaled(im, -c.im));
                let rate_im = sum(&scaled(re, c.im), &scaled(im, c.re));
                [along(dae, [&y, &y_dot], re, &rate_re), along(dae, [&y, &y_dot], im, &rate_im)]
            };
            let right = image(&mut dae, [&wanted[0], &wanted[1]]);
            let mut solver = CondensedSolver::new(&dae, SparseOptions::default()).unwrap();
            let weights = vec![1.0; y.len()];
            let at = Linearization { t: 0.1, y: &y, y_dot: &y_dot, step: 1e-3, weights: &weights };
            solver.evaluate(&mut dae, &at).unwrap();
            solver.set_up(&mut dae, c.re, &[c]).unwrap();
            let mut x: Vec<Complex64> =
                right[0].iter().zip(&right[1]).map(|(re, im)| Complex64::new(*re, *im)).collect();
            solver.solve_complex(&mut dae, 0, &mut x).unwrap();
            let found: [Vec<f64>; 2] =
                [x.iter().map(|z| z.re).collect(), x.iter().map(|z| z.im).collect()];
            let again = image(&mut dae, [&found[0], &found[1]]);
            let errors = [0, 1].map(|k| mismatch(&dae, &again[k], &right[k]));
            let case = format!("{dimension} {formulation} {kappa} {beta} {speed}: {errors:?}");
            // Errors of the differences: truncation of 1e-14 times the second derivatives, which are a thousand times
            // as large as the first, and rounding of 1e-16 divided by 1e-7. A missing term gives an error of 1e-2 or
            // more.
            let bound = match dimension == 3 && beta > 0.0 && speed > 0.0 {
                true => NEAR,
                false => 1e-4,
            };
            assert!(errors[0].max(errors[1]) < bound, "{case}");
            // One real solve, with the real c.
            let rate = scaled(&wanted[0], c.re);
            let right = along(&mut dae, [&y, &y_dot], &wanted[0], &rate);
            let mut x = right.clone();
            solver.solve_real(&mut dae, &mut x).unwrap();
            let again = along(&mut dae, [&y, &y_dot], &x, &scaled(&x, c.re));
            let error = mismatch(&dae, &again, &right);
            assert!(error < bound, "{case} {error}");
        }
    }
    assert!(cases >= 20, "{cases}");
}

/// Duration of the stretch, s; the stretch; the Prony terms.
const RISE: f64 = 0.05;
const STRETCH: f64 = 1.2;
const TERMS: [(f64, f64); 2] = [(0.5, 0.02), (0.3, 0.2)];
const MODULUS: f64 = 2e4;

/// Returns a block on rollers with negligible mass whose right side is pulled and then held.
fn pulled(relaxes: bool) -> Muscle {
    let mesh = generate::rectangle([0.0; 2], [1.0, 1.0], [1, 1]).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let mut held = Vec::new();
    for (group, axis) in [("left", 0), ("bottom", 1), ("right", 0)] {
        let nodes = space.nodes_of(group).unwrap();
        held.extend(nodes.into_iter().map(|node| (node, axis)));
    }
    let dofs = DofMap::new(&space, &held).unwrap();
    let all = (0..mesh.n_elements()).collect();
    let right = space.nodes_of("right").unwrap();
    let mut solid = Solid::uniform(space, dofs, neo_hooke(MODULUS), 1e-3).unwrap();
    if relaxes {
        solid = solid.with_relaxation(&[(all, series(&TERMS))]).unwrap();
    }
    let signal =
        Signal::from(formula::StepFunction { value: STRETCH - 1.0, start: 0.0, rise: RISE });
    let prescribed =
        right.into_iter().map(|node| Prescribed { component: 2 * node, signal: signal.clone() });
    Muscle {
        prescribed: prescribed.collect(),
        ..Muscle::unloaded(solid, Parameters::new(0.0, 0.0, INF).unwrap())
    }
}

/// Returns the force on the right side, P_xx = λ (T_xx − T_yy λ⁻⁴) with T = S + H, in plane strain without lateral
/// force. S is the stress of the neo-Hookean law with J = 1, and H = Σ g ∫ Ṡ e^{−(t−s)/τ} ds is computed by the
/// midpoint rule.
fn exact_force(t: f64) -> f64 {
    let stretch = |t: f64| {
        let s = (t / RISE).min(1.0);
        1.0 + (STRETCH - 1.0) * s.powi(3) * (6.0 * s * s - 15.0 * s + 10.0)
    };
    // S = ζ/2 · 2 (I − Ī1/3 C⁻¹), C = diag(λ², λ⁻², 1).
    let stress = |t: f64| {
        let c = stretch(t).powi(2);
        let i1 = c + 1.0 / c + 1.0;
        [1.0 / c, c].map(|inverse| MODULUS * (1.0 - i1 / 3.0 * inverse))
    };
    let n = 2000;
    let h = RISE.min(t) / f64::from(n);
    let mut total = stress(t);
    for (weight, time) in TERMS {
        for k in 0..n {
            // The integral of Ṡ over an interval is exact; the kernel is evaluated at its midpoint.
            let (from, to) = (stress(f64::from(k) * h), stress(f64::from(k + 1) * h));
            let kernel = (-(t - (f64::from(k) + 0.5) * h) / time).exp();
            for i in 0..2 {
                total[i] += weight * kernel * (to[i] - from[i]);
            }
        }
    }
    let stretch = stretch(t);
    stretch * (total[0] - total[1] / stretch.powi(4))
}

/// Returns the force on the right side at the given times, and the system with its counters.
fn forces(muscle: Muscle, kind: IntegratorKind, rtol: f64, times: &[f64]) -> (Vec<f64>, MuscleDae) {
    let formulation = Formulation::Velocity;
    let mut settings = settings(formulation, rtol).with_integrator(kind);
    settings.t_end = 1.0;
    settings.max_order = 5;
    let right = muscle.solid.space().nodes_of("right").unwrap();
    let mut dae = MuscleDae::new(muscle, formulation).unwrap();
    let rest = vec![0.0; dae.muscle().solid.dofs().n_free()];
    let start = InitialValues::new(&mut dae, 0.0, &rest, &rest).unwrap();
    let mut integrator = start_from(dae, &settings, 0.0, &start.y, &start.y_dot).unwrap();
    let n = integrator.problem().n_unknowns();
    let (mut y, mut y_dot) = (vec![0.0; n], vec![0.0; n]);
    let mut forces = Vec::new();
    for &t in times {
        while integrator.time() < t {
            integrator.advance().unwrap();
        }
        integrator.dense_output(t, 0, &mut y).unwrap();
        integrator.dense_output(t, 1, &mut y_dot).unwrap();
        let force = integrator.problem_mut().unbalanced_force(t, &y, &y_dot).unwrap();
        forces.push(right.iter().map(|node| force[2 * node]).sum());
    }
    (forces, integrator.problem().clone())
}

#[test]
fn a_held_stretch_relaxes_as_in_the_closed_form() {
    let times = [0.03, 0.06, 0.1, 0.2, 0.5, 0.9];
    let kinds = [
        (IntegratorKind::Radau5, 1e-5),
        (IntegratorKind::Radau9, 1e-6),
        (IntegratorKind::Bdf, 1e-5),
    ];
    for (kind, rtol) in kinds {
        let (found, dae) = forces(pulled(true), kind, rtol, &times);
        for (t, found) in times.iter().zip(found) {
            let exact = exact_force(*t);
            // Thirty times the tolerance, for the error that BDF accumulates over its steps.
            let error = (found / exact - 1.0).abs();
            assert!(error < 30.0 * rtol, "{kind:?} t = {t}: {found} {exact} {error:e}");
        }
        let counters = dae.counters();
        assert_eq!(counters.relaxing_tangent_passes, counters.tangent_passes);
        assert!(counters.relaxing_passes >= counters.residual_passes);
    }
    // After relaxation the stress of the law remains, as without Prony terms.
    let (long_term, dae) = forces(pulled(false), IntegratorKind::Radau5, 1e-5, &[0.9]);
    let beyond = TERMS[1].0 * (-(0.9 - RISE) / TERMS[1].1).exp();
    let ratio = exact_force(0.9) / long_term[0] - 1.0;
    // The decay of the relaxing stress begins between the start and the end of the rise.
    let earliest = beyond * (-RISE / TERMS[1].1).exp();
    assert!(ratio < beyond && ratio > earliest, "{ratio} {beyond}");
    let counters = dae.counters();
    assert!(counters.residual_passes > 0);
    let relaxing = [
        counters.relaxing_passes,
        counters.relaxing_tangent_passes,
        counters.relaxing_solve_passes,
    ];
    assert_eq!(relaxing, [0; 3]);
}

#[test]
fn no_more_is_factorized_or_solved_than_without_terms() {
    let solid = pulled(true).solid;
    // Three components in the plane and the out-of-plane component, at each point of each triangle, for each term.
    assert_eq!(solid.n_internal(), TERMS.len() * solid.n_slots());
    assert_eq!(solid.n_slots() % (4 * solid.space().n_elements()), 0);
    let size = |relaxes| {
        let dae = MuscleDae::new(pulled(relaxes), Formulation::Velocity).unwrap();
        let plan = myovib_model::linear::Condensation::new(&dae);
        (plan.n_condensed(), plan.pattern().nnz())
    };
    assert_eq!(size(true), size(false));
}

#[test]
fn relaxation_closes_the_energy_balance() {
    let formulation = Formulation::ImplicitRate;
    let relative = |rtol: f64| {
        let mut dae = MuscleDae::new(relaxing(3, 1e5, 1e-3), formulation).unwrap();
        let rest = vec![0.0; dae.muscle().solid.dofs().n_free()];
        let start = InitialValues::new(&mut dae, 0.0, &rest, &rest).unwrap();
        let settings: Settings = settings(formulation, rtol);
        let mut integrator = start_from(dae, &settings, 0.0, &start.y, &start.y_dot).unwrap();
        let mut balance = Balance::default();
        let statistics = run(&mut *integrator, &mut [&mut balance]).unwrap();
        assert_eq!(statistics.outcome, Outcome::Finished);
        balance.gap / balance.largest
    };
    // The energy balance is satisfied to the tolerance, and more accurately with a tighter one.
    let [loose, tight] = [1e-3, 1e-5].map(relative);
    assert!(loose < 1e-3 && tight < 1e-5, "{loose:e} {tight:e}");
    assert!(tight < 0.1 * loose, "{loose:e} {tight:e}");
}

#[test]
fn initial_overstress_is_relaxed_or_given() {
    let mut dae = MuscleDae::new(pulled(true), Formulation::Velocity).unwrap();
    let rest = vec![0.0; dae.muscle().solid.dofs().n_free()];
    // At t = 0.9 s the right side is displaced, and the start projects the other displacements onto J = 1.
    let start = InitialValues::new(&mut dae, 0.9, &rest, &rest).unwrap();
    let own = dae.layout().range(Field::InternalStress).unwrap();
    let largest = |v: &[f64]| v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let (values, rates) = (&start.y[own.clone()], &start.y_dot[own.clone()]);
    assert!(largest(values) > 0.1 * MODULUS);
    // Q = g S to rounding, over the shortest time.
    assert!(largest(rates) < 1e-12 * largest(values) / TERMS[0].1);
    // Given internal stresses are unchanged, and the residual is zero with them.
    let mut y = start.y.clone();
    y[own.clone()].iter_mut().for_each(|q| *q *= 0.5);
    let again = InitialValues::of(&mut dae, 0.9, &y).unwrap();
    assert_eq!(again.y[own.clone()], y[own]);
    let mut residual = vec![0.0; y.len()];
    dae.residual(0.9, &again.y, &again.y_dot, &mut residual).unwrap();
    // Rounding of stresses of 1e4 Pa.
    assert!(largest(&residual) < 1e-8, "{:e}", largest(&residual));
}

#[test]
fn the_whole_matrix_is_refused() {
    let mut dae = MuscleDae::new(pulled(true), Formulation::Velocity).unwrap();
    let zero = vec![0.0; dae.n_unknowns()];
    let mut values = vec![0.0; dae.jacobian_pattern().nnz()];
    let refused = dae.jacobian(0.0, &zero, &zero, 1.0, 1.0, &mut values);
    let message = refused.unwrap_err().to_string();
    let mut solver = CondensedSolver::new(&dae, SparseOptions::default()).unwrap();
    let adjoint = solver.solve_real_transposed(&mut dae, &mut vec![0.0; zero.len()]);
    assert!(adjoint.unwrap_err().to_string().contains("does not support"));
    assert!(message.contains("condensed linear solver"), "{message}");
}

/// Regression: `check` used a state without internal stresses.
#[test]
fn a_check_before_the_run_counts_internal_stresses() {
    for dimension in [2, 3] {
        for integrator in [IntegratorKind::Radau9, IntegratorKind::Bdf] {
            let muscle = relaxing(dimension, 1e5, 0.0);
            let formulation = Formulation::Position;
            let settings = settings(formulation, 1e-3).with_integrator(integrator);
            let report = check::check(&muscle, formulation, &settings, None).unwrap();
            let (block, size) = report.unknowns[report.unknowns.len() - 1];
            assert_eq!(block, Field::InternalStress);
            assert_eq!(size, muscle.solid.n_internal());
        }
    }
}
