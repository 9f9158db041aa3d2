//! The mesh of a scene: a file or a generator.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The mesh. Coordinates in m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Mesh {
    /// Where the elements come from: triangles make a body in plane strain, tetrahedra one in space.
    #[serde(flatten)]
    pub source: MeshSource,
    /// How many times each triangle is cut into four, each tetrahedron into eight.
    #[serde(default)]
    #[schemars(range(max = 6))]
    pub refine: u32,
}

/// Where the elements come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub enum MeshSource {
    /// A Gmsh file (MSH 4.1, ASCII) with physical groups and, for fibres, nodal data.
    File {
        /// The file, relative to the scene.
        path: PathBuf,
    },
    /// The muscle of the reproduction: a spindle of 0.2 m with 311 triangles and the groups
    /// `fixed` (both ends), `load` (middle of the top), `muscle`, `origin`.
    Muscle,
    /// The same spindle and groups, from a structured grid.
    Spindle {
        /// Cells along (a multiple of 10) and across (an even number), two triangles each.
        #[serde(default = "spindle_cells")]
        #[schemars(inner(range(min = 1, max = 1_000_000)))]
        cells: [usize; 2],
    },
    /// A rectangle, one corner at (0, 0); groups `left`, `right`, `bottom`, `top`, `body`.
    Rectangle {
        /// Width, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        width: f64,
        /// Height, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        height: f64,
        /// Cells along and across, two triangles each.
        #[schemars(inner(range(min = 1, max = 1_000_000)))]
        cells: [usize; 2],
    },
    /// A slender rectangle around the axis y = 0; groups `fixed` (left end), `load` (right end),
    /// `tip` (its upper corner), `body`.
    Beam {
        /// Length, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        length: f64,
        /// Height, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        height: f64,
        /// Cells along and across, two triangles each.
        #[schemars(inner(range(min = 1, max = 1_000_000)))]
        cells: [usize; 2],
    },
    /// Cook's membrane: (0,0), (48,44), (48,60), (0,44); groups as `beam`.
    Cook {
        /// Cells along and across, two triangles each.
        #[schemars(inner(range(min = 1, max = 1_000_000)))]
        cells: [usize; 2],
    },
    /// A box in space, one corner at (0, 0, 0); groups `left`, `right` (along x), `front`, `back`
    /// (y), `bottom`, `top` (z), `body`.
    Box {
        /// Lengths along x, y and z, m.
        size: [f64; 3],
        /// Cells along x, y and z, six tetrahedra each.
        #[schemars(inner(range(min = 1, max = 1_000_000)))]
        cells: [usize; 3],
    },
    /// A muscle in space: a spindle of 0.2 m with tendons and the nodal field `fibre`; groups
    /// `fixed` (both ends), `left`, `right`, `surface`, `load` (middle of the top), `muscle`,
    /// `tendon`, `origin`.
    Muscle3d {
        /// Cells along (a multiple of 10) and across (even numbers), six tetrahedra each.
        #[serde(default = "muscle_cells")]
        #[schemars(inner(range(min = 1, max = 1_000_000)))]
        cells: [usize; 3],
    },
    /// The left ventricle of the benchmark of Aróstica et al. (2025), with the nodal fields `f0`
    /// (fibres) and `s0` (sheets); groups `endo`, `epi`, `base`, `myocardium`.
    Ventricle {
        /// Which of its two meshes.
        resolution: Resolution,
    },
}

/// The meshes of the ventricle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Resolution {
    /// 745 vertices, 2.6 thousand tetrahedra.
    Coarse,
    /// 4576 vertices, 17.7 thousand tetrahedra: that of the benchmark.
    Fine,
}

fn spindle_cells() -> [usize; 2] {
    [20, 6]
}

fn muscle_cells() -> [usize; 3] {
    [20, 4, 4]
}

/// An ellipse (in space: an ellipsoid). The elements whose centroid lies in it leave their group
/// and become a new one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Region {
    /// Name of the new group.
    #[schemars(length(min = 1))]
    pub name: String,
    /// Centre, m.
    #[schemars(length(min = 2, max = 3))]
    pub centre: Vec<f64>,
    /// Half axes, m.
    #[schemars(length(min = 2, max = 3))]
    pub radii: Vec<f64>,
}
