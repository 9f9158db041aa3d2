//! One cell of the matrix: a physics and a way to integrate it.

use std::fmt;

use myovib_fem::Mesh;
use myovib_model::{
    Formulation, ModelError, MultiplierWeights, Muscle, Parameters, Settings, Signal, paper,
};
use serde::Serialize;

use myovib_scene::json;

/// End of all runs, s.
pub(super) const T_END: f64 = 2.0;

/// What the error test makes of multipliers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Multipliers {
    LeftOut,
    Tested,
    StepScaled,
}

impl Multipliers {
    pub(super) const ALL: [Self; 3] = [Self::LeftOut, Self::Tested, Self::StepScaled];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::LeftOut => "left-out",
            Self::Tested => "tested",
            Self::StepScaled => "step-scaled",
        }
    }
}

/// A body, its load and its mesh: all formulations of one physics have the same solution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Physics {
    /// Whether the pressure is an unknown; without it the volume is discretised in another way.
    pub(super) mixed: bool,
    #[serde(serialize_with = "json::kappa")]
    pub(super) kappa: f64,
    pub(super) beta: f64,
    /// Multiple of the paper's load.
    pub(super) load: f64,
    /// Refinements of the mesh.
    pub(super) level: u8,
}

impl Physics {
    /// The body on `mesh`, which is refined.
    pub(super) fn muscle(&self, mesh: &Mesh) -> Result<Muscle, ModelError> {
        let signal = Signal::paper(self.load * paper::LOAD_AMPLITUDE);
        let refined = (0..self.level).try_fold(mesh.clone(), |mesh, _| mesh.refined())?;
        paper::muscle_with_load(&refined, paper::LAW, self.kappa, self.beta, signal)
    }
}

impl fmt::Display for Physics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} kappa={:e} beta={:e} load={} level={}",
            if self.mixed { "mixed" } else { "displacement" },
            self.kappa,
            self.beta,
            self.load,
            self.level
        )
    }
}

/// One run of the matrix.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Cell {
    #[serde(serialize_with = "name")]
    pub(super) formulation: Formulation,
    #[serde(flatten)]
    pub(super) physics: Physics,
    pub(super) rtol: f64,
    pub(super) max_order: u8,
    pub(super) multipliers: Multipliers,
}

fn name<S: serde::Serializer>(formulation: &Formulation, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(formulation.name())
}

impl Cell {
    /// The paper's point of a formulation: its load and tolerance, β where the formulation needs
    /// one, order 2, multipliers out of the error test.
    pub(super) fn home(formulation: Formulation, kappa: f64) -> Self {
        let damped = matches!(formulation, Formulation::Rate | Formulation::ImplicitRate);
        Self {
            formulation,
            physics: Physics {
                mixed: formulation != Formulation::Displacement,
                kappa,
                beta: if damped { paper::BETA } else { 0.0 },
                load: 1.0,
                level: 0,
            },
            rtol: 1e-3,
            max_order: 2,
            multipliers: Multipliers::LeftOut,
        }
    }

    /// Row 1 of Table 2 with the tolerance and order of this cell.
    pub(super) fn row_1(&self) -> Self {
        Self {
            rtol: self.rtol,
            max_order: self.max_order,
            ..Self::home(Formulation::Position, paper::KAPPA)
        }
    }

    /// Whether the formulation goes with κ and β, and has multipliers to weigh.
    pub(super) fn is_allowed(&self) -> bool {
        let Physics { kappa, beta, .. } = self.physics;
        let weighed = self.formulation != Formulation::Displacement
            || self.multipliers == Multipliers::LeftOut;
        weighed
            && Parameters::new(paper::ALPHA, beta, kappa)
                .is_ok_and(|parameters| self.formulation.check(&parameters).is_ok())
    }

    /// The settings: absolute tolerances in the paper's proportion to the relative one.
    pub(super) fn settings(&self) -> Settings {
        let mut settings = settings(self.formulation, self.rtol);
        settings.max_order = self.max_order;
        if self.multipliers != Multipliers::LeftOut {
            settings.suppressed = Vec::new();
        }
        if self.multipliers == Multipliers::StepScaled {
            settings.multiplier_weights = MultiplierWeights::StepScaled;
        }
        settings
    }
}

/// The paper's settings to the end of the runs, at a relative tolerance.
pub(super) fn settings(formulation: Formulation, rtol: f64) -> Settings {
    Settings {
        t_end: T_END,
        ..Settings::paper(formulation).with_relative_tolerance(rtol)
    }
}

/// The key under which results are stored.
impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} {} rtol={:e} order={} multipliers={}",
            self.formulation,
            self.physics,
            self.rtol,
            self.max_order,
            self.multipliers.name()
        )
    }
}
