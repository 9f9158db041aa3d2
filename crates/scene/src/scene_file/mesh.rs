//! Mesh of a scene: a file or a generator.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::number::one;

/// Mesh of the body: triangles for plane strain, or tetrahedra in 3D.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Mesh {
    /// Origin of the elements.
    #[serde(flatten)]
    pub source: MeshSource,
    /// Unit of the coordinates, m: 0.001 for a mesh in mm.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: f64,
    /// Uniform refinements; each halves the element size.
    #[serde(default)]
    #[schemars(range(max = 6))]
    pub refine: u32,
}

/// Origin of the elements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub enum MeshSource {
    /// Gmsh file (MSH 4.1 or 2.2). An unnamed physical group is addressed by dimension and tag: `surface 3`. Groups of
    /// several dimensions that share a name are addressed by dimension and name: `surface skin`, or by the name alone
    /// where a key requires facets or elements.
    File {
        /// File name, relative to the scene.
        path: PathBuf,
    },
    /// 2D spindle, 0.2 m long, with 311 triangles. Groups: `fixed` (both ends), `load` (middle of the top), `muscle`,
    /// `origin`.
    Muscle,
    /// `muscle` with a structured grid.
    Spindle {
        /// Cells along the spindle (multiple of 10) and across it (even).
        #[serde(default = "spindle_cells")]
        #[schemars(inner(range(min = 1, max = 1_000_000)))]
        cells: [usize; 2],
    },
    /// Rectangle with a corner at (0, 0). Groups: `left`, `right`, `bottom`, `top`, `body`.
    Rectangle {
        /// Width, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        width: f64,
        /// Height, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        height: f64,
        /// Cells along and across.
        #[schemars(inner(range(min = 1, max = 1_000_000)))]
        cells: [usize; 2],
    },
    /// Rectangle around the axis y = 0. Groups: `fixed` (left end), `load` (right end), `tip` (upper right corner), `body`.
    Beam {
        /// Length, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        length: f64,
        /// Height, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        height: f64,
        /// Cells along and across.
        #[schemars(inner(range(min = 1, max = 1_000_000)))]
        cells: [usize; 2],
    },
    /// Cook's membrane: corners (0,0), (48,44), (48,60), (0,44) m. Groups as for `beam`.
    Cook {
        /// Cells along and across.
        #[schemars(inner(range(min = 1, max = 1_000_000)))]
        cells: [usize; 2],
    },
    /// Box with a corner at (0, 0, 0). Groups: `left`, `right` (x), `front`, `back` (y), `bottom`, `top` (z), `body`.
    Box {
        /// Edge lengths, m.
        size: [f64; 3],
        /// Cells along x, y and z.
        #[schemars(inner(range(min = 1, max = 1_000_000)))]
        cells: [usize; 3],
    },
    /// 3D spindle with tendons and the nodal field `fiber`. Groups: `fixed` (both ends), `left`, `right`, `surface`,
    /// `load` (middle of the top), `muscle`, `tendon`, `origin`.
    Muscle3d {
        /// Cells along the spindle (multiple of 10) and across it (even).
        #[serde(default = "muscle_cells")]
        #[schemars(inner(range(min = 1, max = 1_000_000)))]
        cells: [usize; 3],
    },
    /// Left ventricle (Aróstica et al. 2025) with nodal fields `f0` (fibers), `s0` (sheets). Groups: `endo`, `epi`,
    /// `base`, `myocardium`.
    Ventricle {
        /// Mesh size.
        resolution: Resolution,
    },
}

/// Resolution of the ventricle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Resolution {
    /// 745 vertices, 2600 tetrahedra.
    Coarse,
    /// 4576 vertices, 17 700 tetrahedra.
    Fine,
}

fn spindle_cells() -> [usize; 2] {
    [20, 6]
}

fn muscle_cells() -> [usize; 3] {
    [20, 4, 4]
}

/// Ellipse or ellipsoid. The elements whose centroid is inside form a group.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Region {
    /// Name of the new group.
    #[schemars(length(min = 1))]
    pub name: String,
    /// Center, m.
    #[schemars(length(min = 2, max = 3))]
    pub center: Vec<f64>,
    /// Semi-axes, m.
    #[schemars(length(min = 2, max = 3))]
    pub radii: Vec<f64>,
}
