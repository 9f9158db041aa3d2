//! Loads on the deformed boundary, one per file. Each file defines the keys of the load in a scene and its operator.

use std::sync::Arc;

use myovib_fem::{FemError, Solid, SurfaceOperator};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::function::Function;
use super::response::Amplitude;

/// Parts of a surface load that do not depend on its kind.
#[derive(Clone, Copy)]
pub struct SurfaceLoad<'a> {
    /// Group of edges or faces.
    pub group: &'a str,
    /// Size of the load.
    pub value: &'a Function,
    /// Harmonic part of the size in a response.
    pub response: Option<Amplitude>,
    /// Kind of the load, which creates the operator of size 1.
    pub(crate) kind: &'a dyn SurfaceLoadKind,
}

/// Kind of load on the deformed boundary.
pub(crate) trait SurfaceLoadKind {
    /// Creates the operator of size 1.
    ///
    /// # Errors
    /// Returns a [`FemError`] if the group contains no parts of the boundary.
    fn operator(&self, solid: &Solid) -> Result<Arc<dyn SurfaceOperator>, FemError>;
}

/// Defines [`SurfaceLoads`] from a list of file names (which are also the keys), types, and descriptions of the keys.
macro_rules! surface_loads {
    ($($key:ident $kind:ident $about:literal)+) => {
        $(mod $key; pub use $key::$kind;)+

        /// Loads on the deformed boundary.
        #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(default)]
        pub struct SurfaceLoads {
            $(#[doc = $about]
            #[serde(skip_serializing_if = "Vec::is_empty")]
            pub $key: Vec<$kind>,)+
        }

        impl SurfaceLoads {
            /// Keys of the tables.
            pub(crate) const KEYS: &[&str] = &[$(stringify!($key)),+];

            /// Examples of the tables, from which the sections of the scene reference are made.
            pub(super) const SECTIONS: &[&str] = &[$($kind::EXAMPLE),+];

            /// Returns all loads with their paths in the scene.
            pub fn all(&self) -> Vec<(String, SurfaceLoad<'_>)> {
                let mut all = Vec::new();
                $(for (i, load) in self.$key.iter().enumerate() {
                    let path = format!("{}[{i}]", stringify!($key));
                    all.push((path, SurfaceLoad {
                        group: &load.group,
                        value: &load.value,
                        response: load.response,
                        kind: load,
                    }));
                })+
                all
            }
        }
    };
}

surface_loads! {
    pressure Pressure "Pressures normal to the deformed boundary."
}
