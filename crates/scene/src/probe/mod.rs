//! Kinds of probes, one per file. Each file defines the keys of its probe in a scene and the corresponding reading.

mod balance;
mod column;
mod kind;
mod moment;
mod places;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use column::ColumnKind;

pub(crate) use balance::{EnergyBalance, nan_of_null};
pub(crate) use kind::{HarmonicMotion, InvalidPlace, Kind, Reading, StateAt, expect_chain};

/// Wraps the difference of two angles to at most half a `turn`. A full turn is 2π or 360°.
pub(crate) fn within_half_a_turn(difference: f64, turn: f64) -> f64 {
    difference - turn * (difference / turn).round()
}

#[cfg(test)]
#[test]
fn angles_differ_by_half_a_turn_at_most() {
    use std::f64::consts::TAU;
    for (difference, within) in [(0.5, 0.5), (TAU - 0.5, -0.5), (0.5 - TAU, 0.5), (3.0, 3.0)] {
        assert!((within_half_a_turn(difference, TAU) - within).abs() < 1e-15);
    }
}

/// Defines [`ProbeKind`] from a list of files. Each file contains the type with the same name.
macro_rules! probes {
    ($($file:ident $name:ident)*) => {
        $(mod $file; pub use $file::$name;)*

        /// Kind of a probe.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(tag = "type", rename_all = "kebab-case")]
        #[allow(missing_docs)] // the types of the same name have them
        pub enum ProbeKind {
            $($name($name),)*
        }

        impl ProbeKind {
            /// Returns the descriptions of the columns that the probes define.
            fn columns() -> impl Iterator<Item = ColumnKind> {
                let lists = [$(<$name as Kind>::columns()),*];
                lists.into_iter().flatten().copied()
            }

            /// Returns whether the probe measures a chain.
            pub(crate) fn reads_chain(&self) -> bool {
                matches!(self, Self::Coherence(_) | Self::Oscillators(_))
            }

            pub(crate) fn kind(&self) -> &dyn Kind {
                match self {
                    $(Self::$name(kind) => kind,)*
                }
            }
        }
    };
}

probes! {
    point Point
    line Line
    average Average
    reaction Reaction
    volume Volume
    contact Contact
    energy Energy
    coherence Coherence
    oscillators Oscillators
    feedback Feedback
    rod Rod
}
