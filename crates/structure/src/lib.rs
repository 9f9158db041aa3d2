//! The structure of a differential-algebraic system, computed from its matrices.
//!
//! The crate analyzes F(t, y, ẏ) = 0 before integration, independently of the model and the formulation that
//! define the matrices:
//!
//! - [`Pencil`]: the linearization E ẋ + A x = f, from two matrices or from any [`Problem`](myovib_dae::Problem)
//!   at a state;
//! - [`PencilStructure`]: the index of a pencil, or the result that the pencil is singular, with all rank
//!   decisions ([`RankDecision`]) and the perturbation index of every variable;
//! - [`Vibration`]: small free vibrations with or without a constraint, and their lowest [`modes`];
//! - [`harmonic_response`]: the response of any problem to harmonic loads;
//! - [`RigidBodies`]: the rigid-body motions that the supports do not prevent;
//! - [`InfSup`]: inf–sup constants of a mixed method, and the number of uncontrolled multipliers.
//!
//! Rank decisions are based on singular values. A scaling first removes the influence of the units of equations
//! and variables. If a decision has no clear gap, the result is reported as undecided.
//!
//! # References
//! - E. Griepentrog, R. März, *Differential-Algebraic Equations and Their Numerical Treatment*, Teubner 1986
//!   (matrix pencils, Kronecker index).
//! - P. Kunkel, V. Mehrmann, *Differential-Algebraic Equations*, EMS 2006, chapter 2.
//! - E. Hairer, G. Wanner, *Solving Ordinary Differential Equations II*, section VII.1 (perturbation index).
#![forbid(unsafe_code)]

mod deflation;
mod eigen;
mod error;
mod harmonic;
mod inf_sup;
mod jacobi;
mod modes;
mod pencil;
mod perturbation;
mod rank;
mod rigid;
mod scaling;
mod structure;
mod vibration;

pub use error::StructureError;
pub use harmonic::harmonic_response;
pub use inf_sup::InfSup;
pub use modes::{Mode, modes, modes_below};
pub use pencil::Pencil;
pub use rank::{RankDecision, Verdict};
pub use rigid::{FreeMotions, Motion, MovingBody, RigidBodies};
pub use structure::{Index, PencilStructure, VariableIndex};
pub use vibration::{Constraint, Vibration};
