//! The DAE formulations: unknowns, equations and index.
//!
//! Each entry of the list `formulations!` defines a formulation: it pairs each block of unknowns with the equation in
//! the rows of the block, and states the index of each block. The equations are in [`crate::equation`].

use std::fmt;

use myovib_dae::VariableKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::equation::Equation::{self, *};
use crate::error::ModelError;
use crate::field::Field;
use crate::muscle::parameters::Parameters;

struct Description {
    /// Name used in options, scenes and output.
    name: &'static str,
    /// Equation number in the paper.
    equation: &'static str,
    /// Blocks of unknowns, each with the equation in its rows, in the order of the integrator's vector.
    rows: &'static [(Field, Equation)],
    /// Perturbation index of each block of `rows`. Each array is indexed by `[β > 0][κ = ∞]`.
    index: &'static [[[u8; 2]; 2]],
    /// Fields whose time derivatives do not occur in the equations.
    algebraic: fn(Case) -> &'static [Field],
    /// Violated requirement on κ and β, if any.
    objection: fn(Case) -> Option<&'static str>,
}

/// Properties of κ and β that determine the index and whether a formulation is allowed.
#[derive(Clone, Copy)]
struct Case {
    damped: bool,
    incompressible: bool,
}

/// Defines [`Formulation`] and its table of properties from the list of formulations.
macro_rules! formulations {
    ($($(#[$about:meta])* $formulation:ident $description:tt)*) => {
        /// Form of the equations of motion, with the number of the paper's equation.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "kebab-case")]
        #[schemars(rename = "FormulationName")]
        pub enum Formulation {
            $($(#[$about])* $formulation,)*
        }

        impl Formulation {
            /// All formulations.
            pub const ALL: [Self; [$(stringify!($formulation)),*].len()] =
                [$(Self::$formulation),*];

            fn description(self) -> &'static Description {
                match self {
                    $(Self::$formulation => const { &Description $description },)*
                }
            }
        }
    };
}

formulations! {
    /// Displacements only, without a pressure (18); finite κ.
    Displacement {
        name: "displacement",
        equation: "18",
        rows: &[(Field::Displacement, Kinematic), (Field::Velocity, Momentum)],
        index: &[[[0, 0]; 2], [[0, 0]; 2]],
        algebraic: |_| &[],
        objection: |case| case.incompressible.then_some("requires finite κ"),
    }
    /// Pressure and volume constraint (28); β = 0.
    Position {
        name: "position",
        equation: "28",
        rows: &[
            (Field::Displacement, Kinematic),
            (Field::Velocity, Momentum),
            (Field::Pressure, Constraint),
        ],
        index: &[[[0, 1]; 2], [[0, 2]; 2], [[1, 3]; 2]],
        algebraic: |_| &[Field::Pressure],
        objection: undamped,
    }
    /// Pressure rate as an additional unknown (29); β > 0.
    Rate {
        name: "rate",
        equation: "29",
        rows: &[
            (Field::Displacement, Kinematic),
            (Field::Pressure, Constraint),
            (Field::Velocity, Momentum),
            (Field::PressureRate, PressureKinematic),
        ],
        index: &[[[0, 1]; 2], [[1, 3], [1, 2]], [[0, 2], [1, 2]], [[2, 4], [2, 3]]],
        algebraic: |_| &[Field::PressureRate],
        objection: damped,
    }
    /// Volume constraint differentiated once (31); β = 0.
    Velocity {
        name: "velocity",
        equation: "31",
        rows: &[
            (Field::Displacement, Kinematic),
            (Field::Velocity, Momentum),
            (Field::Pressure, ConstraintRate),
        ],
        index: &[[[0, 0]; 2], [[0, 1]; 2], [[0, 2]; 2]],
        algebraic: |case| if case.incompressible { &[Field::Pressure] } else { &[] },
        objection: undamped,
    }
    /// Volume constraint and its time derivative, after Gear, Gupta and Leimkuhler (33); β = 0, κ = inf.
    Stabilized {
        name: "stabilized",
        equation: "33",
        rows: &[
            (Field::Displacement, StabilizedKinematic),
            (Field::Velocity, Momentum),
            (Field::Pressure, ConstraintRate),
            (Field::GglMultiplier, Constraint),
        ],
        index: &[[[1, 1]; 2], [[1, 1]; 2], [[2, 2]; 2], [[2, 2]; 2]],
        algebraic: |_| &[Field::Pressure, Field::GglMultiplier],
        objection: |case| (case.damped || !case.incompressible).then_some(
            "requires β = 0 and κ = inf; otherwise use `position` or `implicit-rate`"
        ),
    }
    /// Pressure rate taken from the integrator (26); β > 0.
    ImplicitRate {
        name: "implicit-rate",
        equation: "26", // for the linear law; the nonlinear form is not in the paper
        rows: &[
            (Field::Displacement, Kinematic),
            (Field::Velocity, Momentum),
            (Field::Pressure, Constraint),
        ],
        index: &[[[0, 1]; 2], [[0, 2], [1, 2]], [[1, 3], [1, 2]]],
        algebraic: |case| if case.damped { &[] } else { &[Field::Pressure] },
        objection: damped,
    }
}

fn undamped(case: Case) -> Option<&'static str> {
    let allowed = "requires β = 0; for β > 0 use `rate` or `implicit-rate`";
    case.damped.then_some(allowed)
}

fn damped(case: Case) -> Option<&'static str> {
    let allowed = "requires β > 0; for β = 0 use `position`";
    (!case.damped).then_some(allowed)
}

impl Case {
    fn of(parameters: &Parameters) -> Self {
        Self { damped: parameters.is_damped(), incompressible: parameters.is_incompressible() }
    }
}

impl Formulation {
    /// Returns the name used in options, scenes and output.
    pub fn name(self) -> &'static str {
        self.description().name
    }

    /// Returns the equation number in the paper.
    pub fn equation(self) -> &'static str {
        self.description().equation
    }

    /// Returns the blocks of unknowns, each with the equation in its rows, in the order of the integrator's vector.
    pub fn rows(self) -> &'static [(Field, Equation)] {
        self.description().rows
    }

    /// Returns whether `field` is among the unknowns.
    pub fn has(self, field: Field) -> bool {
        self.rows().iter().any(|(f, _)| *f == field)
    }

    /// Returns the differentiation index for the given κ and β. Paper: Table 1.
    pub fn index(self, parameters: &Parameters) -> u8 {
        self.rows().iter().map(|(f, _)| self.variable_index(*f, parameters)).max().unwrap_or(0)
    }

    /// Returns the perturbation index of one block of unknowns. The indices were determined from the matrices (note
    /// 0002).
    ///
    /// For example, if β > 0 and κ < ∞, the force β Bᵀλ̇ transfers perturbations of the constraint to the velocity.
    /// The velocity therefore has index 1.
    pub fn variable_index(self, field: Field, parameters: &Parameters) -> u8 {
        self.index_of(field, Case::of(parameters))
    }

    /// Returns the perturbation index of one block of unknowns in the limit κ → ∞.
    pub fn limit_index(self, field: Field, damped: bool) -> u8 {
        let incompressible = true;
        self.index_of(field, Case { damped, incompressible })
    }

    fn index_of(self, field: Field, case: Case) -> u8 {
        let mut blocks = self.rows().iter().zip(self.description().index);
        blocks.find(|((f, _), _)| *f == field).map_or(0, |(_, index)| {
            index[usize::from(case.damped)][usize::from(case.incompressible)]
        })
    }

    /// Returns whether the variables of `field` are differential or algebraic, that is, whether their time derivatives
    /// occur in the equations (`id` of IDAS).
    pub fn kind(self, field: Field, parameters: &Parameters) -> VariableKind {
        let algebraic = (self.description().algebraic)(Case::of(parameters));
        match algebraic.contains(&field) {
            true => VariableKind::Algebraic,
            false => VariableKind::Differential,
        }
    }

    /// Checks that this formulation can be used with the given κ and β.
    ///
    /// # Errors
    /// Returns [`ModelError::NotAllowed`], which describes the allowed values, if κ or β is not allowed.
    pub fn check(self, parameters: &Parameters) -> Result<(), ModelError> {
        let objection = (self.description().objection)(Case::of(parameters));
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
