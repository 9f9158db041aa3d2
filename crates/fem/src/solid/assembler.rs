//! Distribution of element passes, for example among processes.
//!
//! The integrator works with one solid, which owns the first partition of the elements. In each
//! pass its [`ParallelAssembler`] makes the workers compute the other partitions
//! ([`Solid::compute`](crate::Solid::compute)).

use std::fmt::Debug;

use crate::operators::added::AddedMotion;
use crate::operators::fields::{Fields, Inverted};

/// Element pass: its input fields, and flags for the requested results in the order of their declaration.
#[derive(Debug, Clone, Copy)]
pub enum Pass<'a> {
    /// [`Solid::evaluate`](crate::Solid::evaluate).
    Vectors(Fields<'a>, [bool; 5]),
    /// [`Solid::tangents`](crate::Solid::tangents).
    Tangents(Fields<'a>, [bool; 6]),
    /// [`Solid::added_force`](crate::Solid::added_force).
    AddedForce(AddedMotion<'a>),
    /// [`Solid::active_force`](crate::Solid::active_force).
    ActiveForce(AddedMotion<'a>),
    /// [`Solid::added_tangents`](crate::Solid::added_tangents).
    AddedTangents(AddedMotion<'a>, [bool; 2]),
}

/// Workers that assemble the other element partitions.
pub trait ParallelAssembler: Debug + Send + Sync {
    /// Starts a pass on the other partitions. The next call is [`end`](Self::end).
    fn begin(&self, pass: &Pass<'_>);

    /// Adds the results of the other partitions to `results`, which initially holds the results of
    /// the local partition in the order of their declaration.
    ///
    /// # Errors
    /// The error of the local partition, `local`, or of another partition.
    fn end(&self, results: &mut [&mut [f64]], local: Result<(), Inverted>) -> Result<(), Inverted>;
}
