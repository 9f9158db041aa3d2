//! The rows of Table 2 (the command line's contract): formulation, parameters, error test.

use myovib_model::{Field, Formulation};

/// Which algebraic variables the error test leaves out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Convention {
    /// By the paper's words, "the algebraic variables are excluded": λ in (28) and (31), only μ
    /// in (29).
    Paper,
    /// λ and μ everywhere.
    Multipliers,
    /// The same in both conventions.
    Both,
    /// None: a variant beside the paper's rows, or an integrator that leaves nothing out.
    Variant,
}

impl Convention {
    /// The conventions a row stands for; none for a variant.
    pub fn names(self) -> &'static [&'static str] {
        match self {
            Self::Paper => &["paper"],
            Self::Multipliers => &["multipliers"],
            Self::Both => &["paper", "multipliers"],
            Self::Variant => &[],
        }
    }

    /// The name used in output.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Multipliers => "multipliers",
            Self::Both => "both",
            Self::Variant => "–",
        }
    }
}

/// One row: a run of the muscle to t = 10.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// The row's name on the command line and in JSON.
    pub key: &'static str,
    /// The paper's row it stands beside.
    pub paper_key: &'static str,
    /// The formulation.
    pub formulation: Formulation,
    /// κ, Pa.
    pub kappa: f64,
    /// β, s.
    pub beta: f64,
    /// The convention it belongs to.
    pub convention: Convention,
    /// What the error test leaves out.
    pub suppressed: &'static [Field],
    /// Maximum BDF order.
    pub max_order: u8,
}

impl Row {
    /// Whether the row is a problem of its own: the others differ from one of these in what BDF
    /// leaves out of the error test, or in its order.
    pub(super) fn is_of_its_own(&self) -> bool {
        matches!(self.convention, Convention::Paper | Convention::Both)
    }
}

const INF: f64 = f64::INFINITY;
const LAMBDA: &[Field] = &[Field::Pressure];
const MU: &[Field] = &[Field::PressureRate];
const LAMBDA_MU: &[Field] = &[Field::Pressure, Field::PressureRate];

const fn row(
    key: &'static str,
    paper_key: &'static str,
    formulation: Formulation,
    (kappa, beta): (f64, f64),
    convention: Convention,
    suppressed: &'static [Field],
    max_order: u8,
) -> Row {
    Row {
        key,
        paper_key,
        formulation,
        kappa,
        beta,
        convention,
        suppressed,
        max_order,
    }
}

/// All rows in the order of the table.
pub const ROWS: [Row; 9] = {
    use Convention::{Both, Multipliers, Paper, Variant};
    use Formulation::{Position, Rate, Velocity};
    [
        row("1", "1", Position, (1e5, 0.0), Both, LAMBDA, 2),
        row("2", "2", Rate, (1e5, 1e-4), Paper, MU, 2),
        row("2m", "2", Rate, (1e5, 1e-4), Multipliers, LAMBDA_MU, 2),
        row("3", "3", Rate, (INF, 1e-4), Paper, MU, 2),
        row("3m", "3", Rate, (INF, 1e-4), Multipliers, LAMBDA_MU, 2),
        row("4", "4", Position, (INF, 0.0), Paper, &[], 5),
        row("4-order2", "4", Position, (INF, 0.0), Variant, &[], 2),
        row(
            "4-suppressed",
            "4",
            Position,
            (INF, 0.0),
            Variant,
            LAMBDA,
            2,
        ),
        row("31", "31", Velocity, (INF, 0.0), Both, LAMBDA, 2),
    ]
};
