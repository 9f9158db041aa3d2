//! The boundary to C: the `unsafe` code of this crate.
//!
//! Each type here owns one C object and frees it once; each method is one C call whose arguments
//! the type keeps valid. No type of this module is public outside the crate.
//!
//! - [`context`], [`vector`], [`matrix`], [`linear_solver`]: the SUNDIALS objects IDAS works on;
//! - [`vector_operations`]: the arithmetic on vectors that IDAS calls; [`vector_clone`]: how it
//!   makes its own; [`vector_view`]: theirs as slices;
//! - [`call`]: how a call in C may fail;
//! - [`ida`]: the integrator's memory and every call on it;
//! - [`callbacks`]: what IDAS may ask; [`trampoline`]: what C calls for it;
//! - [`backward`]: the same for backward problems;
//! - [`pinned`]: data at an address that does not move, shared with C;
//! - [`messages`]: where IDAS' messages go;
//! - [`version`]: which SUNDIALS this is, and what its versions call differently.

pub(crate) mod backward;
pub(crate) mod call;
pub(crate) mod callbacks;
pub(crate) mod context;
pub(crate) mod ida;
pub(crate) mod linear_solver;
pub(crate) mod matrix;
mod messages;
pub(crate) mod pinned;
mod sensitivity_residual;
pub(crate) mod trampoline;
pub(crate) mod vector;
mod vector_clone;
mod vector_operations;
mod vector_view;
pub(crate) mod version;
