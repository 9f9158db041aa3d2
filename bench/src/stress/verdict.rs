//! What a run is worth.

use serde::Serialize;

use super::cell::Cell;
use super::measure::Ended;
use super::trusted::Errors;

/// A finished run is wrong when u_y is off by more than this factor times the error of row 1 of
/// Table 2 at the same tolerance and order,
const TIMES_ROW_1: f64 = 100.0;
/// or by more than this factor times what a step's tolerance allows a vibration's phase over the run.
const TIMES_PHASE: f64 = 30.0;

/// What is promised of u_y, as a part of its largest value.
///
/// BDF of order k ≤ 2 takes steps h with h^(k+1) in proportion to the tolerance, and its phase errs by
/// h^k a period: as for random scenes, over the thirty periods of a run. Higher orders promise no more.
fn promised(cell: &Cell) -> f64 {
    let k = f64::from(cell.max_order.min(2));
    TIMES_PHASE * cell.rtol.powf(k / (k + 1.0))
}

/// What a run is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Verdict {
    Ok,
    Wrong,
    Unverified,
    Stopped,
}

impl Verdict {
    pub(super) const ALL: [Self; 4] = [Self::Ok, Self::Wrong, Self::Unverified, Self::Stopped];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Wrong => "wrong",
            Self::Unverified => "unverified",
            Self::Stopped => "stopped",
        }
    }

    /// Judges a run by its error and that of row 1, if row 1 finished; a run without trusted
    /// solution is never ok.
    pub(super) fn of(cell: &Cell, ended: Ended, errors: &Errors, row_1: Option<f64>) -> Self {
        if ended != Ended::Finished {
            return Self::Stopped;
        }
        let promised = promised(cell);
        let limit = row_1.map_or(promised, |error| promised.min(TIMES_ROW_1 * error));
        match (errors.error_u_y, errors.trusted_to) {
            (Some(error), Some(trusted_to)) if trusted_to <= limit => {
                if error <= limit {
                    Self::Ok
                } else {
                    Self::Wrong
                }
            }
            _ => Self::Unverified,
        }
    }
}

#[cfg(test)]
mod tests {
    use myovib_model::Formulation;

    use super::*;

    fn cell(rtol: f64) -> Cell {
        Cell {
            rtol,
            ..Cell::home(Formulation::Position, 1e6)
        }
    }

    fn verdict(rtol: f64, error: f64, trusted_to: f64, row_1: Option<f64>) -> Verdict {
        let errors = Errors {
            error_u_y: Some(error),
            trusted_to: Some(trusted_to),
            ..Errors::default()
        };
        Verdict::of(&cell(rtol), Ended::Finished, &errors, row_1)
    }

    #[test]
    fn the_limit_is_a_hundred_times_row_1_or_what_the_tolerance_promises() {
        let beside = |error| verdict(1e-3, error, 1e-7, Some(1e-4));
        assert_eq!(beside(9.9e-3), Verdict::Ok);
        assert_eq!(beside(1.1e-2), Verdict::Wrong);
        assert_eq!(beside(f64::NAN), Verdict::Wrong);
        // 30 rtol^(2/3)
        for (rtol, limit) in [(1e-3, 0.3), (1e-6, 3e-3)] {
            let alone = |part| verdict(rtol, part * limit, 1e-7, None);
            assert_eq!((alone(0.99), alone(1.01)), (Verdict::Ok, Verdict::Wrong));
        }
    }

    #[test]
    fn without_a_trusted_solution_nothing_is_ok() {
        let cell = cell(1e-3);
        let unknown = Verdict::of(&cell, Ended::Finished, &Errors::default(), None);
        assert_eq!(unknown, Verdict::Unverified);
        // A solution trusted to less than what is to be judged by it.
        assert_eq!(verdict(1e-3, 1e-9, 0.5, None), Verdict::Unverified);
        for ended in [Ended::Stopped, Ended::Failed, Ended::Panicked] {
            let known = Errors {
                error_u_y: Some(1e-9),
                trusted_to: Some(1e-9),
                ..Errors::default()
            };
            assert_eq!(Verdict::of(&cell, ended, &known, None), Verdict::Stopped);
        }
    }
}
