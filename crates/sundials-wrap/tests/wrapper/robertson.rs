//! Robertson's kinetics: IDAS with KLU, compared with the published run and an accurate solution.

use crate::common::{numbers, reference};
use myovib_conformance::samples::{Robertson, Sample};
use myovib_dae::{Direction, Outcome, Tolerances};

use sundials_wrap::{IdaOptions, IdaSolver};

fn published_options() -> IdaOptions {
    let run = &reference("s3_robertson")["published_runs"];
    IdaOptions {
        tolerances: Tolerances::vector(run["rtol"].as_f64().unwrap(), numbers(&run["atol"])),
        ..IdaOptions::default()
    }
}

/// The run of SUNDIALS' example idasRoberts_klu. With the same library and the same settings, the outputs agree to the
/// printed digits, and the counters are equal. Two rows of the output are events.
#[test]
fn reproduces_the_published_run_with_klu() {
    let published = reference("s3_robertson")["published_runs"]["klu"].clone();
    let start = Robertson.start();
    let mut solver = IdaSolver::builder(Robertson)
        .options(published_options())
        .roots([Direction::Both; 2], |_, _, y, _, g| {
            (g[0], g[1]) = (y[0] - 1e-4, y[2] - 0.01);
            Ok(())
        })
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    let rows = numbers(&published["t"]).into_iter().zip(numbers(&published["y1"]));
    let events = [(0, [0, 1]), (9, [-1, 0])];
    let mut t_out = 0.4;
    for (row, (t, y1)) in rows.enumerate() {
        let outcome = solver.integrate_to(t_out).unwrap();
        match events.iter().find(|(event_row, _)| *event_row == row) {
            Some((_, expected)) => {
                let Outcome::Root { crossings, .. } = &outcome else { panic!("{outcome:?}") };
                assert_eq!(crossings, expected);
            }
            None => {
                assert_eq!(outcome, Outcome::Reached { t: t_out });
                t_out *= 10.0;
            }
        }
        // The published values are printed with five digits.
        assert!((outcome.t() / t - 1.0).abs() < 5e-5, "row {row}: t = {}", outcome.t());
        assert!((solver.y()[0] / y1 - 1.0).abs() < 5e-5, "row {row}: y1 = {}", solver.y()[0]);
        assert_eq!(solver.statistics().steps, published["nst"][row].as_u64().unwrap(), "row {row}");
    }
    let stats = solver.statistics();
    let counters = [
        ("steps", stats.steps),
        ("res", stats.residual_evaluations),
        ("jac", stats.jacobian_evaluations),
        ("nni", stats.newton_iterations),
        ("netf", stats.error_test_failures),
        ("ncfn", stats.newton_failures),
        ("root_evals", stats.root_evaluations),
    ];
    for (key, ours) in counters {
        assert_eq!(ours, published[key].as_u64().unwrap(), "{key}");
    }
}

/// The error must be at most a moderate multiple of the tolerance. Local errors of rtol per step accumulate over
/// several hundred steps and are damped by the stiffness.
#[test]
fn is_accurate_at_a_tight_tolerance() {
    let accurate = reference("s3_robertson")["accurate"].clone();
    let (rtol, start) = (1e-9, Robertson.start());
    let mut solver = IdaSolver::builder(Robertson)
        .tolerances(Tolerances::vector(rtol, [1e-18, 1e-22, 1e-12]))
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    let (y1, y2) = (numbers(&accurate["y1"]), numbers(&accurate["y2"]));
    for (i, t) in numbers(&accurate["t"]).into_iter().enumerate() {
        assert_eq!(solver.integrate_to(t).unwrap(), Outcome::Reached { t });
        for (component, exact) in [(0, y1[i]), (1, y2[i])] {
            let error = (solver.y()[component] / exact - 1.0).abs();
            assert!(error < 1e3 * rtol, "t = {t}: relative error {error:e} in y{component}");
        }
        let total: f64 = solver.y().iter().sum();
        // The conservation of mass is satisfied up to the tolerance of Newton's method.
        assert!((total - 1.0).abs() < rtol, "t = {t}: mass {total}");
    }
}
