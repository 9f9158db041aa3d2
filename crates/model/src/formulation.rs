//! The DAE formulations: which unknowns, which equations, which index.
//!
//! A formulation is a short list that pairs each block of unknowns with the equation in its rows.
//! The equations themselves are in [`crate::equation`].

use std::fmt;
use std::str::FromStr;

use myovib_dae::VariableKind;

use crate::equation::Equation;
use crate::error::ModelError;
use crate::field::Field;
use crate::muscle::parameters::Parameters;

/// A way to write the semi-discretised equations of motion as a first-order DAE.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Formulation {
    /// (11), (16), (18): no pressure, volumetric energy κ/2 (J-1)². An ODE.
    Displacement,
    /// (28): q̇ = v, momentum, constraint; β = 0.
    Position,
    /// (29): as (28) with λ̇ = μ and the damping force β f_b(q, λ, v, μ).
    Rate,
    /// (31): the constraint differentiated once; β = 0.
    Velocity,
    /// (33), Gear–Gupta–Leimkuhler: both constraints, a multiplier in the kinematic equation.
    Stabilized,
    /// (26) for the linear law, ours for the nonlinear: λ̇ taken from the integrator, no μ.
    ImplicitRate,
}

use Formulation::{Displacement, ImplicitRate, Position, Rate, Stabilized, Velocity};

impl Formulation {
    /// All formulations.
    pub const ALL: [Self; 6] = [
        Displacement,
        Position,
        Rate,
        Velocity,
        Stabilized,
        ImplicitRate,
    ];

    /// The name used in options, scenes and output.
    pub fn name(self) -> &'static str {
        match self {
            Displacement => "displacement",
            Position => "position",
            Rate => "rate",
            Velocity => "velocity",
            Stabilized => "stabilized",
            ImplicitRate => "implicit-rate",
        }
    }

    /// The number of the paper's equation.
    pub fn equation(self) -> &'static str {
        match self {
            Displacement => "18",
            Position => "28",
            Rate => "29",
            Velocity => "31",
            Stabilized => "33",
            ImplicitRate => "26",
        }
    }

    /// Each block of unknowns with the equation in its rows, in the order of the vector.
    pub fn rows(self) -> &'static [(Field, Equation)] {
        use Equation::*;
        use Field as U;
        match self {
            Displacement => &[(U::Displacement, Kinematic), (U::Velocity, Momentum)],
            Position | ImplicitRate => &[
                (U::Displacement, Kinematic),
                (U::Velocity, Momentum),
                (U::Pressure, Constraint),
            ],
            Rate => &[
                (U::Displacement, Kinematic),
                (U::Pressure, Constraint),
                (U::Velocity, Momentum),
                (U::PressureRate, PressureKinematic),
            ],
            Velocity => &[
                (U::Displacement, Kinematic),
                (U::Velocity, Momentum),
                (U::Pressure, ConstraintRate),
            ],
            Stabilized => &[
                (U::Displacement, StabilizedKinematic),
                (U::Velocity, Momentum),
                (U::Pressure, ConstraintRate),
                (U::GglMultiplier, Constraint),
            ],
        }
    }

    /// Whether `field` is among the unknowns.
    pub fn has(self, field: Field) -> bool {
        self.rows().iter().any(|(f, _)| *f == field)
    }

    /// Differentiation index for the given κ and β. Paper: Table 1.
    pub fn index(self, parameters: &Parameters) -> u8 {
        self.rows()
            .iter()
            .map(|(f, _)| self.variable_index(*f, parameters))
            .max()
            .unwrap_or(0)
    }

    /// Perturbation index of one block of unknowns.
    ///
    /// As the matrices have it (note 0002). With β > 0 and κ < ∞, for instance, the force
    /// β Bᵀλ̇ hands the perturbation of the constraint on to the velocity, which has index 1.
    pub fn variable_index(self, field: Field, parameters: &Parameters) -> u8 {
        self.index_of(
            field,
            parameters.is_damped(),
            parameters.is_incompressible(),
        )
    }

    /// Perturbation index of one block of unknowns in the limit κ → ∞.
    pub fn limit_index(self, field: Field, damped: bool) -> u8 {
        self.index_of(field, damped, true)
    }

    fn index_of(self, field: Field, damped: bool, incompressible: bool) -> u8 {
        use Field as U;
        let damped = u8::from(damped);
        if incompressible {
            match (self, field) {
                (Position | ImplicitRate | Rate, U::Displacement) => 1,
                (Position | ImplicitRate | Rate, U::Velocity) => 2,
                (Position, U::Pressure) => 3,
                (ImplicitRate | Rate, U::Pressure) => 3 - damped,
                (Rate, U::PressureRate) => 4 - damped,
                (Velocity, U::Velocity) => 1,
                (Velocity, U::Pressure) => 2,
                (Stabilized, U::Displacement | U::Velocity) => 1,
                (Stabilized, U::Pressure | U::GglMultiplier) => 2,
                _ => 0,
            }
        } else {
            match (self, field) {
                (ImplicitRate | Rate, U::Velocity) => damped,
                (Position | ImplicitRate | Rate, U::Pressure) => 1,
                (Rate, U::PressureRate) => 2,
                (Stabilized, U::Displacement | U::Velocity) => 1,
                (Stabilized, U::Pressure | U::GglMultiplier) => 2,
                _ => 0,
            }
        }
    }

    /// Whether the derivative of `field` occurs in the equations (IDAS' `id`).
    pub fn kind(self, field: Field, parameters: &Parameters) -> VariableKind {
        let algebraic = match (self, field) {
            (_, Field::Displacement | Field::Velocity) => false,
            (_, Field::Tension | Field::InternalStress) => false,
            (Position, Field::Pressure) => true,
            (Rate, Field::PressureRate) => true,
            (Velocity, Field::Pressure) => parameters.is_incompressible(),
            (Stabilized, _) => true,
            (ImplicitRate, _) => !parameters.is_damped(),
            _ => false,
        };
        if algebraic {
            VariableKind::Algebraic
        } else {
            VariableKind::Differential
        }
    }

    /// Whether this formulation can be run with the given κ and β.
    ///
    /// # Errors
    /// [`ModelError::NotAllowed`], saying what is.
    pub fn check(self, parameters: &Parameters) -> Result<(), ModelError> {
        let incompressible = parameters.is_incompressible();
        let damped = parameters.is_damped();
        let objection = match self {
            Displacement if incompressible => Some("it needs a finite kappa"),
            Position | Velocity if damped => {
                Some("it needs beta = 0; for beta > 0 take `rate` or `implicit-rate`")
            }
            Rate if !damped => Some("it needs beta > 0; for beta = 0 take `position`"),
            Stabilized if damped || !incompressible => {
                Some("it needs beta = 0 and kappa = inf; else take `position` or `implicit-rate`")
            }
            ImplicitRate if !damped => Some("it needs beta > 0; for beta = 0 take `position`"),
            _ => None,
        };
        objection.map_or(Ok(()), |allowed| {
            Err(ModelError::NotAllowed {
                formulation: self.name(),
                kappa: parameters.kappa(),
                beta: parameters.beta,
                allowed,
            })
        })
    }
}

impl fmt::Display for Formulation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Formulation {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|f| f.name() == name)
            .ok_or_else(|| {
                let names: Vec<_> = Self::ALL.iter().map(|f| f.name()).collect();
                format!("unknown formulation `{name}`; one of {}", names.join(", "))
            })
    }
}
