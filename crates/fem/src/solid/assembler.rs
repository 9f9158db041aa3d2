//! Distribution of element passes, for example among processes.
//!
//! The integrator works with one solid, which owns the first partition of the elements. In each pass, the
//! [`ParallelAssembler`] of this solid makes the workers compute the other partitions
//! ([`Solid::compute`](crate::Solid::compute)).

use std::fmt::Debug;

use crate::operators::added::AddedMotion;
use crate::operators::fields::{Fields, Inverted};

/// Element pass, described by its input fields and by flags for the requested results, in the order in which the
/// results are declared.
#[derive(Debug, Clone, Copy)]
pub enum Pass<'a> {
    /// A pass of [`Solid::evaluate`](crate::Solid::evaluate).
    Vectors(Fields<'a>, [bool; 5]),
    /// A pass of [`Solid::tangents`](crate::Solid::tangents).
    Tangents(Fields<'a>, [bool; 6]),
    /// A pass of [`Solid::added_force`](crate::Solid::added_force).
    AddedForce(AddedMotion<'a>),
    /// A pass of [`Solid::active_force`](crate::Solid::active_force).
    ActiveForce(AddedMotion<'a>),
    /// A pass of [`Solid::added_tangents`](crate::Solid::added_tangents).
    AddedTangents(AddedMotion<'a>, [bool; 2]),
}

/// Workers that assemble the other element partitions.
pub trait ParallelAssembler: Debug + Send + Sync {
    /// Starts a pass on the other partitions. The next call must be [`end`](Self::end).
    fn begin(&self, pass: &Pass<'_>);

    /// Adds the results of the other partitions to `results`. Initially, `results` holds the results of the local
    /// partition, in the order in which they are declared.
    ///
    /// # Errors
    /// Returns the error `local` of the local partition, or the error of another partition.
    fn end(&self, results: &mut [&mut [f64]], local: Result<(), Inverted>) -> Result<(), Inverted>;
}
