//! The structure of a differential-algebraic system, computed from its matrices.
//!
//! Owns the questions one asks of F(t, y, ẏ) = 0 before integrating it, answered without a word
//! of which model or formulation the matrices came from:
//!
//! - [`Pencil`]: the linearisation E ẋ + A x = f, from two matrices or from any
//!   [`Problem`](myovib_dae::Problem) at a state;
//! - [`PencilStructure`]: its index, or that it has none, with every rank decision ([`RankDecision`])
//!   that the answer rests on, and the perturbation index of every variable;
//! - [`Vibration`]: small free vibrations with or without a constraint, and their lowest [`modes`];
//! - [`RigidBodies`]: the motions as rigid bodies that supports leave;
//! - [`InfSup`]: how well the multipliers of a mixed method are held, or how many are not at all.
//!
//! The rank decisions are made on singular values after a scaling that does not depend on the
//! units of equations and variables. An answer that rests on a decision without a clear gap is
//! called undecided.
//!
//! # References
//! - E. Griepentrog, R. März, *Differential-Algebraic Equations and Their Numerical Treatment*,
//!   Teubner 1986 (matrix pencils, Kronecker index).
//! - P. Kunkel, V. Mehrmann, *Differential-Algebraic Equations*, EMS 2006, chapter 2.
//! - E. Hairer, G. Wanner, *Solving Ordinary Differential Equations II*, section VII.1
//!   (perturbation index).
#![forbid(unsafe_code)]

mod deflation;
mod error;
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
pub use inf_sup::InfSup;
pub use modes::{Mode, modes};
pub use pencil::Pencil;
pub use rank::{RankDecision, Verdict};
pub use rigid::{FreeMotions, Motion, MovingBody, RigidBodies};
pub use structure::{Index, PencilStructure, VariableIndex};
pub use vibration::{Constraint, Vibration};
