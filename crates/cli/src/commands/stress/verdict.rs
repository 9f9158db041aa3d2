//! What a run is worth.

use serde::Serialize;

use super::measure::{Ended, Measured};

/// A finished run is wrong when u_y is off by more than this factor times the error of row 1 of
/// Table 2 at the same tolerance and order,
const TIMES_ROW_1: f64 = 100.0;
/// or by this part of its largest value.
const AT_MOST: f64 = 0.3;

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

    /// Judges a run by its error and that of row 1; a run without trusted solution is never ok.
    pub(super) fn of(measured: &Measured, row_1: Option<&Measured>) -> Self {
        if measured.ended != Ended::Finished {
            return Self::Stopped;
        }
        let of_row_1 = row_1
            .filter(|row| row.ended == Ended::Finished)
            .and_then(|row| row.error_u_y);
        let limit = of_row_1.map_or(AT_MOST, |error| AT_MOST.min(TIMES_ROW_1 * error));
        match (measured.error_u_y, measured.trusted_to) {
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
    use super::*;

    fn finished(error: f64, trusted_to: f64) -> Measured {
        Measured {
            ended: Ended::Finished,
            error_u_y: Some(error),
            trusted_to: Some(trusted_to),
            ..Measured::default()
        }
    }

    #[test]
    fn the_limit_is_a_hundred_times_row_1_or_thirty_per_cent() {
        let row_1 = finished(1e-4, 1e-7);
        let verdict = |error| Verdict::of(&finished(error, 1e-7), Some(&row_1));
        assert_eq!(verdict(9.9e-3), Verdict::Ok);
        assert_eq!(verdict(1.1e-2), Verdict::Wrong);
        assert_eq!(verdict(f64::NAN), Verdict::Wrong);
        let alone = |error| Verdict::of(&finished(error, 1e-7), None);
        assert_eq!((alone(0.29), alone(0.31)), (Verdict::Ok, Verdict::Wrong));
    }

    #[test]
    fn without_a_trusted_solution_nothing_is_ok() {
        let unknown = Measured {
            error_u_y: None,
            trusted_to: None,
            ..finished(0.0, 0.0)
        };
        assert_eq!(Verdict::of(&unknown, None), Verdict::Unverified);
        // A solution trusted to less than what is to be judged by it.
        let vague = finished(1e-9, 0.5);
        assert_eq!(Verdict::of(&vague, None), Verdict::Unverified);
        let stopped = Measured {
            ended: Ended::Stopped,
            ..finished(1e-9, 1e-9)
        };
        assert_eq!(Verdict::of(&stopped, None), Verdict::Stopped);
    }
}
