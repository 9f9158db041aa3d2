//! Functions of time that scenes select by `type`, each defined in its own file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Signal;

/// Dependence of a function of time on a constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The function is proportional to the constant.
    Factor,
    /// The function has continuous derivatives with respect to the constant.
    Smooth,
    /// The constant shifts a discontinuity of a time derivative.
    Break,
}

/// Constants of a function of time given by a formula.
trait Constants {
    /// Names and roles of the constants with respect to which the function can be differentiated.
    const ROLES: &[(&str, Role)];
}

/// Defines [`Formula`] from a list of files, types, and names in scenes.
macro_rules! formulas {
    ($($file:ident $name:ident $tag:tt)*) => {
        $(mod $file; pub use $file::$name;)*

        /// A function of time as text: the name of a formula, and its numbers.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(tag = "type")]
        #[allow(missing_docs)] // the types have them
        pub enum Formula {
            $(#[serde(rename = $tag)] $name($name),)*
        }

        impl Formula {
            /// Returns the role of a constant; `None` if the function has no derivative with respect to it.
            pub fn role(&self, constant: &str) -> Option<Role> {
                let roles = match self {
                    $(Self::$name(_) => $name::ROLES,)*
                };
                let (_, role) = roles.iter().find(|(name, _)| *name == constant)?;
                Some(*role)
            }

            /// Returns the function of time.
            pub fn signal(&self) -> Signal {
                match self {
                    $(Self::$name(function) => function.clone().into(),)*
                }
            }
        }
    };
}

formulas! {
    sine Sine "sine"
    chirp Chirp "chirp"
    ramped_sine RampedSine "ramped-sine"
    step StepFunction "step"
    ramp Ramp "ramp"
}
