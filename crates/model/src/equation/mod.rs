//! The equations from which the formulations are composed: residual and Jacobian of each.
//!
//! An equation sees the unknowns of a [`State`] by field, the element integrals it
//! [`needs`](Equation::needs), and writes the rows of its block.

mod activation;
mod constraint;
mod kinematic;
mod momentum;

use std::fmt;

use myovib_fem::AddedStress;

use crate::field::Field;
use crate::matrix::Term;
use crate::muscle::Muscle;
use crate::state::{Integrals, State};

/// One block of rows of a formulation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Equation {
    /// q̇ - v = 0.
    Kinematic,
    /// M (q̇ - v) + B(q)ᵀ μ = 0, first line of (33).
    StabilizedKinematic,
    /// λ̇ - μ = 0, second line of (29).
    PressureKinematic,
    /// M (v̇ + α v) + ∫(P + β Ṗ + added stresses):∇φ + beds - f(t) = 0.
    Momentum,
    /// ∫ψ (p/κ + J - 1) = 0.
    Constraint,
    /// ∫ψ (ṗ/κ + cof F:∇v) = 0.
    ConstraintRate,
    /// Ṫ = −|a(t)| T + σ0 max(a(t), 0).
    Activation,
    /// Q̇ = (g S − Q)/τ at each quadrature point.
    Relaxation,
}

impl fmt::Display for Equation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Kinematic => "kinematic",
            Self::StabilizedKinematic => "stabilized kinematic",
            Self::PressureKinematic => "rate of the pressure",
            Self::Momentum => "momentum",
            Self::Constraint => "constraint",
            Self::ConstraintRate => "rate of the constraint",
            Self::Activation => "activation",
            Self::Relaxation => "relaxation",
        })
    }
}

/// Where the rate of the pressure ṗ is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PressureRateSource {
    /// There is no pressure, or nothing asks for its rate.
    None,
    /// The unknown μ of (29).
    Unknown,
    /// λ̇ of the integrator.
    Derivative,
}

/// What an equation's coefficients depend on.
#[derive(Debug, Clone, Copy)]
pub struct Context {
    /// Mass-proportional damping α, 1/s.
    pub alpha: f64,
    /// Stiffness-proportional damping β, s.
    pub beta: f64,
    /// 1/κ, 1/Pa.
    pub inv_kappa: f64,
    /// Whether the pressure is an unknown of its own.
    pub has_pressure: bool,
    /// Where ṗ is found.
    pub pressure_rate: PressureRateSource,
    /// Whether pressures act on the deformed boundary.
    pub pressed: bool,
    /// What acts beside the law's stress.
    pub added: Added,
    /// Whether κ, α or β differ between elements.
    pub graded: bool,
    /// Whether oscillators that are eliminated act on the stiffness.
    pub coherence: bool,
}

/// What acts on a body beside the stress of its law: where it is not, it costs nothing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Added {
    /// Whether a bed has stiffness, and whether one has damping.
    pub bed: [bool; 2],
    /// Whether there are active or viscous stresses, and whether one depends on the velocity.
    pub stress: [bool; 2],
    /// Whether tensions are unknowns.
    pub tensions: bool,
    /// Number of series of Prony terms.
    pub relaxing: usize,
}

impl Added {
    /// What acts on a muscle.
    pub(crate) fn of(muscle: &Muscle) -> Self {
        let stresses = muscle.solid.added_stresses();
        Self {
            bed: [
                muscle.beds.iter().any(|bed| bed.stiffness() > 0.0),
                muscle.beds.iter().any(|bed| bed.damping() > 0.0),
            ],
            stress: [
                !stresses.is_empty(),
                stresses.iter().any(AddedStress::is_viscous),
            ],
            tensions: muscle.models().next().is_some(),
            relaxing: muscle.solid.relaxing_parts().len(),
        }
    }

    /// Whether a force depends on the velocity.
    pub(crate) fn is_damped(self) -> bool {
        self.bed[1] || self.stress[1]
    }
}

/// The element integrals an equation asks for; what no equation asks for is not computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Needs {
    /// ∫P:∇φ.
    pub force: bool,
    /// ∫Ṗ:∇φ.
    pub force_rate: bool,
    /// ∫ψ(J - 1).
    pub defect: bool,
    /// ∫ψ cof F:∇v.
    pub defect_rate: bool,
    /// B(q)ᵀμ.
    pub multiplier_force: bool,
}

impl Needs {
    /// What either asks for.
    pub fn or(self, other: Self) -> Self {
        Self {
            force: self.force || other.force,
            force_rate: self.force_rate || other.force_rate,
            defect: self.defect || other.defect,
            defect_rate: self.defect_rate || other.defect_rate,
            multiplier_force: self.multiplier_force || other.multiplier_force,
        }
    }
}

impl Equation {
    /// The element integrals this equation is made of.
    pub fn needs(self, context: &Context) -> Needs {
        let none = Needs::default();
        match self {
            Self::Kinematic | Self::PressureKinematic => none,
            Self::Activation | Self::Relaxation => none,
            Self::StabilizedKinematic => Needs {
                multiplier_force: true,
                ..none
            },
            Self::Momentum => Needs {
                force: true,
                force_rate: context.beta > 0.0,
                ..none
            },
            Self::Constraint => Needs {
                defect: true,
                ..none
            },
            Self::ConstraintRate => Needs {
                defect_rate: true,
                ..none
            },
        }
    }

    /// Writes the equation's residual into its rows.
    pub(crate) fn residual(
        self,
        context: &Context,
        state: &State<'_>,
        integrals: &mut Integrals<'_>,
        rows: &mut [f64],
    ) {
        match self {
            Self::Kinematic => kinematic::residual(state, rows),
            Self::StabilizedKinematic => kinematic::stabilized_residual(state, integrals, rows),
            Self::PressureKinematic => kinematic::pressure_residual(state, rows),
            Self::Momentum => momentum::residual(context, integrals, rows),
            Self::Constraint => constraint::residual(context, state, integrals, rows),
            Self::ConstraintRate => constraint::rate_residual(context, state, integrals, rows),
            Self::Activation => {
                rate_residual(Field::Tension, integrals.tension_rates(), state, rows);
            }
            Self::Relaxation => {
                rate_residual(
                    Field::InternalStress,
                    integrals.internal_rates(),
                    state,
                    rows,
                );
            }
        }
    }

    /// The terms of the equation's Jacobian.
    pub fn terms(self, context: &Context) -> Vec<Term> {
        match self {
            Self::Kinematic => kinematic::terms(),
            Self::StabilizedKinematic => kinematic::stabilized_terms(),
            Self::PressureKinematic => kinematic::pressure_terms(),
            Self::Momentum => momentum::terms(context),
            Self::Constraint => constraint::terms(context),
            Self::ConstraintRate => constraint::rate_terms(context),
            Self::Activation => activation::terms(),
            // Eliminated point by point before the blocks are looked at.
            Self::Relaxation => Vec::new(),
        }
    }
}

/// The rates of a field less what they are to be.
fn rate_residual(field: Field, model: &[f64], state: &State<'_>, rows: &mut [f64]) {
    let rates = state.rate(field).iter();
    for ((row, rate), model) in rows.iter_mut().zip(rates).zip(model) {
        *row = rate - model;
    }
}
