//! Limits on the number, size and end of steps.

use myovib_dae::IntegratorError::TimeBehind;
use myovib_dae::{Outcome, StopReason};
use myovib_radau::{RadauError, RadauOptions};

use crate::common::stopped;
use crate::failures::{solver, touchy};

#[test]
fn the_number_of_steps_is_limited() {
    let options = RadauOptions { max_steps: Some(3), ..RadauOptions::default() };
    let stop = stopped(solver(touchy(|_, _| Ok(0.0)), options).integrate_to(1.0).unwrap());
    assert_eq!((stop.reason, stop.statistics.steps), (StopReason::MaxSteps, 3));
}

#[test]
fn the_stop_time_is_met_exactly_and_can_be_moved() {
    let options = RadauOptions { stop_time: Some(0.7), ..RadauOptions::default() };
    let mut solver = solver(touchy(|_, _| Ok(0.0)), options);
    let mut outcome = solver.step(2.0).unwrap();
    while let Outcome::StepTaken { t } = outcome {
        assert!(t < 0.7);
        outcome = solver.step(2.0).unwrap();
    }
    assert_eq!(outcome, Outcome::StopTime { t: 0.7 });
    solver.set_stop_time(1.5).unwrap();
    assert_eq!(solver.integrate_to(2.0).unwrap(), Outcome::StopTime { t: 1.5 });
    assert!(matches!(solver.step(1.4), Err(RadauError::Common(TimeBehind { t_out: 1.4, t: 1.5 }))));
    assert!(matches!(solver.set_stop_time(1.4), Err(RadauError::Common(TimeBehind { .. }))));
}

#[test]
fn steps_stay_below_the_largest() {
    let options = RadauOptions { max_step: Some(0.01), ..RadauOptions::default() };
    let mut solver = solver(touchy(|_, _| Ok(0.0)), options);
    // Steps are shortened to meet each of these times except 0.2.
    for t_out in [0.015, 0.035, 0.2] {
        while solver.t() < t_out {
            solver.set_stop_time(t_out).unwrap();
            solver.step(t_out).unwrap();
            let stats = solver.statistics();
            // The last step may be longer by a relative remainder of up to 1e-8.
            assert!(stats.last_step <= 0.01 * (1.0 + 1e-8), "{stats:?}");
            assert!(stats.current_step <= 0.01, "{stats:?}");
        }
    }
}
