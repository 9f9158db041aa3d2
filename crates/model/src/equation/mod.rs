//! Equations of the formulations, with the residual and Jacobian of each equation.
//!
//! An equation reads the unknowns of a [`State`] by field, reads the element integrals that it
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
    /// M (v̇ + α v) + ∫(P + β Ṗ + added stresses):∇φ + foundations + friction - f(t, q) = 0.
    Momentum,
    /// ∫ψ (p/κ + g(J)) = 0.
    Constraint,
    /// ∫ψ (ṗ/κ + g' cof F:∇v) = 0.
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

/// Source of the pressure rate ṗ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PressureRateSource {
    /// There is no pressure, or its rate is not needed.
    None,
    /// The unknown μ of (29).
    Unknown,
    /// λ̇ of the integrator.
    Derivative,
}

/// Properties of the model that determine an equation's coefficients.
#[derive(Debug, Clone, Copy)]
pub struct Context {
    /// Mass-proportional damping α, 1/s.
    pub alpha: f64,
    /// Stiffness-proportional damping β, s.
    pub beta: f64,
    /// 1/κ, 1/Pa.
    pub inv_kappa: f64,
    /// Whether the pressure is an unknown.
    pub has_pressure: bool,
    /// Source of ṗ.
    pub pressure_rate: PressureRateSource,
    /// Whether follower pressures or contacts act on the deformed boundary.
    pub pressed: bool,
    /// Forces in addition to the law's stress.
    pub added: Added,
    /// Whether κ, α or β vary between elements.
    pub graded: bool,
    /// Whether eliminated oscillators contribute to the stiffness and the damping.
    pub coherence: bool,
}

/// Forces that act on a body in addition to the stress of its law. Absent forces add no cost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Added {
    /// Whether any foundation has stiffness, and whether any foundation has damping.
    pub foundation: [bool; 2],
    /// Whether there are active or viscous stresses, and whether any of these stresses depends on the velocity.
    pub stress: [bool; 2],
    /// Whether contacts have friction.
    pub friction: bool,
    /// Whether tensions are unknowns.
    pub tensions: bool,
    /// Number of Prony series.
    pub relaxing: usize,
}

impl Added {
    pub(crate) fn of(muscle: &Muscle) -> Self {
        let stresses = muscle.solid.added_stresses();
        Self {
            foundation: [
                muscle.foundations.iter().any(|foundation| foundation.stiffness() > 0.0),
                muscle.foundations.iter().any(|foundation| foundation.damping() > 0.0),
            ],
            stress: [!stresses.is_empty(), stresses.iter().any(AddedStress::is_viscous)],
            friction: muscle.has_friction(),
            tensions: muscle.models().next().is_some(),
            relaxing: muscle.solid.relaxation_regions().len(),
        }
    }

    /// Returns whether an added force other than friction depends on the velocity.
    pub(crate) fn is_damped(self) -> bool {
        self.foundation[1] || self.stress[1]
    }
}

/// Element integrals required by an equation. Integrals that no equation requires are not computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Needs {
    /// ∫P:∇φ.
    pub force: bool,
    /// ∫Ṗ:∇φ.
    pub force_rate: bool,
    /// ∫ψ g(J).
    pub volume_residual: bool,
    /// ∫ψ g' cof F:∇v.
    pub volume_residual_rate: bool,
    /// B(q)ᵀμ.
    pub multiplier_force: bool,
}

impl Needs {
    /// Returns the union of `self` and `other`.
    pub fn or(self, other: Self) -> Self {
        Self {
            force: self.force || other.force,
            force_rate: self.force_rate || other.force_rate,
            volume_residual: self.volume_residual || other.volume_residual,
            volume_residual_rate: self.volume_residual_rate || other.volume_residual_rate,
            multiplier_force: self.multiplier_force || other.multiplier_force,
        }
    }
}

impl Equation {
    /// Returns the element integrals that the equation requires.
    pub fn needs(self, context: &Context) -> Needs {
        let none = Needs::default();
        match self {
            Self::Kinematic | Self::PressureKinematic => none,
            Self::Activation | Self::Relaxation => none,
            Self::StabilizedKinematic => Needs { multiplier_force: true, ..none },
            Self::Momentum => Needs { force: true, force_rate: context.beta > 0.0, ..none },
            Self::Constraint => Needs { volume_residual: true, ..none },
            Self::ConstraintRate => Needs { volume_residual_rate: true, ..none },
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
            Self::Kinematic => {
                rate_residual(Field::Displacement, state.value(Field::Velocity), state, rows);
            }
            Self::StabilizedKinematic => kinematic::stabilized_residual(state, integrals, rows),
            Self::PressureKinematic => {
                rate_residual(Field::Pressure, state.value(Field::PressureRate), state, rows);
            }
            Self::Momentum => momentum::residual(context, integrals, rows),
            Self::Constraint => constraint::residual(context, state, integrals, rows),
            Self::ConstraintRate => constraint::rate_residual(context, state, integrals, rows),
            Self::Activation => {
                rate_residual(Field::Tension, integrals.tension_rates(), state, rows);
            }
            Self::Relaxation => {
                rate_residual(Field::InternalStress, integrals.internal_rates(), state, rows);
            }
        }
    }

    /// Returns the terms of the equation's Jacobian.
    pub fn terms(self, context: &Context) -> Vec<Term> {
        match self {
            Self::Kinematic => kinematic::terms(),
            Self::StabilizedKinematic => kinematic::stabilized_terms(),
            Self::PressureKinematic => kinematic::pressure_terms(),
            Self::Momentum => momentum::terms(context),
            Self::Constraint => constraint::terms(context),
            Self::ConstraintRate => constraint::rate_terms(context),
            Self::Activation => activation::terms(),
            // Eliminated at each quadrature point before the blocks are assembled.
            Self::Relaxation => Vec::new(),
        }
    }
}

/// Writes the rates of `field` minus `values` to `rows`.
fn rate_residual(field: Field, values: &[f64], state: &State<'_>, rows: &mut [f64]) {
    let rates = state.rate(field).iter();
    for ((row, rate), value) in rows.iter_mut().zip(rates).zip(values) {
        *row = rate - value;
    }
}
