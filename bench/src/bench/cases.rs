//! The problems of the benchmark, and the ways to solve each.

use myovib_model::{Field, Formulation, IntegratorKind, LinearSolver, Settings, paper};
use myovib_sparse::Ordering;
use sundials_wrap::VectorArithmetic;

use myovib_scene::InputError;

/// One body and load: all its formulations have the same solution in space and time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Case {
    pub(super) name: &'static str,
    pub(super) kappa: f64,
    pub(super) beta: f64,
    pub(super) formulations: &'static [Formulation],
}

/// All cases. `displacement` discretises the volume in another way, so it is a case of its own.
pub(super) const CASES: [Case; 5] = [
    Case {
        name: "undamped",
        kappa: paper::KAPPA,
        beta: 0.0,
        formulations: &[Formulation::Position, Formulation::Velocity],
    },
    Case {
        name: "damped",
        kappa: paper::KAPPA,
        beta: paper::BETA,
        formulations: &[Formulation::Rate, Formulation::ImplicitRate],
    },
    Case {
        name: "incompressible",
        kappa: f64::INFINITY,
        beta: 0.0,
        formulations: &[
            Formulation::Position,
            Formulation::Velocity,
            Formulation::Stabilized,
        ],
    },
    Case {
        name: "damped-incompressible",
        kappa: f64::INFINITY,
        beta: paper::BETA,
        formulations: &[Formulation::Rate, Formulation::ImplicitRate],
    },
    Case {
        name: "displacement",
        kappa: paper::KAPPA,
        beta: 0.0,
        formulations: &[Formulation::Displacement],
    },
];

/// The cases with these names; all if there are none.
pub(super) fn selected(names: &[String]) -> Result<Vec<&'static Case>, InputError> {
    if names.is_empty() {
        return Ok(CASES.iter().collect());
    }
    names
        .iter()
        .map(|name| {
            CASES.iter().find(|case| case.name == name).ok_or_else(|| {
                InputError::new("unknown case")
                    .at("--cases")
                    .found(name)
                    .allowed(CASES.map(|case| case.name).join(", "))
            })
        })
        .collect()
}

/// A way to integrate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    /// IDAS at order 2, condensed.
    Bdf2,
    /// IDAS at order 5, condensed.
    Bdf5,
    /// Radau IIA of order 5, all components in the error test.
    Radau,
    /// The same of order 9.
    Radau9,
    /// The same of order 13.
    Radau13,
    /// What SUNDIALS does by itself: order 5, all components in the error test, the whole matrix
    /// with COLAMD and block triangular form.
    ByHand,
}

impl Way {
    pub(super) const ALL: [Self; 6] = [
        Self::Bdf2,
        Self::Bdf5,
        Self::Radau,
        Self::Radau9,
        Self::Radau13,
        Self::ByHand,
    ];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Bdf2 => "BDF 2",
            Self::Bdf5 => "BDF 5",
            Self::Radau => "Radau IIA 5",
            Self::Radau9 => "Radau IIA 9",
            Self::Radau13 => "Radau IIA 13",
            Self::ByHand => "IDAS defaults",
        }
    }

    /// The settings for a relative tolerance; absolute ones in the paper's proportion to it.
    pub(super) fn settings(self, formulation: Formulation, rtol: f64, t_end: f64) -> Settings {
        let ours = Settings {
            t_end,
            ..Settings::paper(formulation).with_relative_tolerance(rtol)
        };
        let radau = |integrator| Settings {
            integrator,
            suppressed: Vec::new(),
            ..ours.clone()
        };
        match self {
            Self::Bdf2 => ours,
            Self::Bdf5 => Settings {
                max_order: 5,
                ..ours
            },
            Self::Radau => radau(IntegratorKind::Radau),
            Self::Radau9 => radau(IntegratorKind::Radau9),
            Self::Radau13 => radau(IntegratorKind::Radau13),
            Self::ByHand => Settings {
                max_order: 5,
                suppressed: Vec::<Field>::new(),
                linear_solver: LinearSolver::Full,
                ordering: Ordering::Colamd,
                btf: true,
                vectors: VectorArithmetic::Serial,
                ..ours
            },
        }
    }
}
