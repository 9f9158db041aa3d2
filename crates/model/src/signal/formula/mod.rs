//! Functions of time that scenes select by `type`, one file each.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Signal;

/// Makes [`Formula`] of a list of files, each with the type of the same name.
macro_rules! formulas {
    ($($file:ident $name:ident)*) => {
        $(mod $file; pub use $file::$name;)*

        /// A function of time as text: the name of a formula, and its numbers.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(tag = "type", rename_all = "kebab-case")]
        #[allow(missing_docs)] // the types of the same name have them
        pub enum Formula {
            $($name($name),)*
        }

        impl Formula {
            /// The function.
            pub fn signal(&self) -> Signal {
                match self {
                    $(Self::$name(function) => function.clone().into(),)*
                }
            }
        }
    };
}

formulas! {
    sine Sine
    chirp Chirp
    ramped_sine RampedSine
    step Step
    ramp Ramp
}
