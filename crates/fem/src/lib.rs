//! Finite elements of the muscle and of the rod: operators without equations of motion.
//!
//! A [`mesh`] carries a [`space`] (P2 displacement, P1 pressure); a [`solid`] gives the mass
//! matrices, the internal force, the volume defect, their rates and all tangents of these as sparse
//! blocks over the free components ([`dofs`]). How the blocks make up a differential-algebraic
//! system is the business of the crate above. There is no C library below.
//!
//! References: Simeon, Serban, Petzold, M2AN 43 (2009) 805–823, section 2, whose equation numbers
//! are used; the notes in `notes/`.
#![forbid(unsafe_code)]
// Loops over the indices of tensors, several at a time, read like their formulas.
#![allow(clippy::needless_range_loop)]

mod added;
mod batch;
mod constitutive;
mod deformed;
pub mod dofs;
pub mod element;
mod enclosed;
mod energy;
mod error;
mod facet;
mod fibres;
mod fields;
mod follower;
pub mod generate;
mod kind;
mod lanes;
pub mod load;
mod mass;
pub mod material;
pub mod mesh;
mod msh;
pub mod output;
mod power;
mod product;
pub mod quadrature;
mod refine;
mod relaxation;
mod residual;
mod robin;
pub mod rod;
mod shared;
pub mod solid;
pub mod space;
mod sparsity;
mod tangent;

pub use added::{AddedMotion, AddedStress, AddedTangents};
pub use dofs::DofMap;
pub use element::{Barycentric, Shape};
pub use enclosed::EnclosedVolume;
pub use error::{FemError, MshProblem};
pub use fibres::Fibres;
pub use follower::FollowerPressure;
pub use kind::Ratios;
pub use material::Law;
pub use mesh::{Group, Mesh};
pub use relaxation::{Overstress, RelaxingPart};
pub use robin::{Along, Robin};
pub use shared::{Crew, Pass};
pub use solid::{Change, Fields, Inverted, Linearized, Pressure, Solid, Tangents, Vectors};
pub use space::{Located, Space};

/// Design notes.
pub mod notes {
    #[doc = include_str!("../notes/0001-kinematics-without-cancellation.md")]
    pub mod kinematics_without_cancellation {}
    #[doc = include_str!("../notes/0002-batches-of-elements.md")]
    pub mod batches_of_elements {}
    #[doc = include_str!("../notes/0003-elements-of-either-dimension.md")]
    pub mod elements_of_either_dimension {}
}
