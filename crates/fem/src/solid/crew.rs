//! Passes over the elements whose elements are shared out, among processes for example.
//!
//! One holds the solid that an integrator works with; its elements are the first share, and at each
//! pass its [`Crew`] has the others compute theirs ([`Solid::compute`](crate::Solid::compute)).

use std::fmt::Debug;

use crate::operators::added::AddedMotion;
use crate::operators::fields::{Fields, Inverted};

/// A pass over the elements: what it is evaluated at, and which of its results are wanted, in the
/// order of their declaration.
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

/// Those who hold the other shares of a solid's elements.
pub trait Crew: Debug + Send + Sync {
    /// Has them begin with their shares of a pass. The next call is [`end`](Self::end).
    fn begin(&self, pass: &Pass<'_>);

    /// Adds their results to `results`, those of one's own share in the order of their declaration.
    ///
    /// # Errors
    /// That of one's own share, `own`, or of another.
    fn end(&self, results: &mut [&mut [f64]], own: Result<(), Inverted>) -> Result<(), Inverted>;
}
