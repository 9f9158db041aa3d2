//! Finite elements for nearly and fully incompressible soft tissue in 2D and 3D, and a damped rod.
//!
//! The crate provides operators; the crate `myovib-model` combines them into equations of motion.
//!
//! - [`element`]: simplices, shape functions and quadrature rules on the reference element.
//! - [`mesh`]: meshes, mesh checks and refinement, mesh generators and the Gmsh reader.
//! - [`space`]: displacement and pressure spaces, free components and sparsity patterns.
//! - [`material`]: hyperelastic laws, active and viscous stresses, Prony series and fiber fields.
//! - `operators`: element integrals (residual, tangents, products, energy, power, mass, relaxation).
//! - `boundary`: facet integrals (tractions, follower pressures, Robin supports, enclosed volumes).
//! - `simd`: batches of elements, one element per lane of a vector register.
//! - [`solid`]: a body, which consists of a space and its material, and all its operators.
//! - [`output`]: stresses, strains and other quantities at points of a body.
//! - [`rod`]: the damped one-dimensional rod.
//!
//! References: Simeon, Serban, Petzold, M2AN 43 (2009) 805–823, section 2 (equation numbers refer to this paper);
//! the notes in `notes/`.
#![forbid(unsafe_code)]
// Loops over several indices of tensors at a time resemble the formulas.
#![allow(clippy::needless_range_loop)]

/// Evaluates an expression in which the constant `$D` is the dimension.
macro_rules! in_dimension {
    ($dimension:expr, |$D:ident| $body:expr) => {
        match $dimension {
            2 => {
                const $D: usize = 2;
                $body
            }
            _ => {
                const $D: usize = 3;
                $body
            }
        }
    };
}

mod boundary;
pub mod element;
mod error;
pub mod material;
pub mod mesh;
mod operators;
pub mod output;
pub mod rod;
mod simd;
pub mod solid;
pub mod space;

pub use boundary::SurfaceOperator;
pub use boundary::contact::{
    ContactSums, DrivenSlope, Friction, FrictionSums, Obstacle, RigidContact, Sliding,
};
pub use boundary::deformed::DeformedFacets;
pub use boundary::enclosed::EnclosedVolume;
pub use boundary::facet::{FacetPoint, area_vector};
pub use boundary::follower::FollowerPressure;
pub use boundary::load;
pub use boundary::robin::{RobinMatrix, SupportDirection};
pub use element::{Barycentric, Shape, quadrature};
pub use error::{FemError, MshProblem};
pub use material::Law;
pub use material::fibers::Fibers;
pub use mesh::{Group, Mesh, bounds, generate};
pub use operators::added::{AddedMotion, AddedStress, AddedTangents};
pub use operators::relaxation::{Overstress, RelaxationRegion};
pub use solid::assembler::{ParallelAssembler, Pass};
pub use solid::element_material::ElementScale;
pub use solid::{Change, Fields, Inverted, Pressure, Solid, TangentProduct, Tangents, Vectors};
pub use space::dofs::{self, DofMap};
pub use space::{ElementPoint, HeldPressures, Near, Space};

/// Design notes.
pub mod notes {
    #[doc = include_str!("../notes/0001-kinematics-without-cancellation.md")]
    pub mod kinematics_without_cancellation {}
    #[doc = include_str!("../notes/0002-batches-of-elements.md")]
    pub mod batches_of_elements {}
    #[doc = include_str!("../notes/0003-elements-of-either-dimension.md")]
    pub mod elements_of_either_dimension {}
}
