//! The boundary to C: the `unsafe` code of this crate.
//!
//! Each type here owns one C object and frees it once; each method is one C call whose arguments
//! the type keeps valid. No type of this module is public outside the crate.
//!
//! - [`context`], [`vector`], [`matrix`], [`linear_solver`], [`nonlinear_solver`]: the SUNDIALS objects IDAS works on;
//! - [`vector_operations`]: the arithmetic on vectors that IDAS calls; [`vector_clone`]: cloning of vectors by IDAS;
//!   [`vector_view`]: vectors as slices;
//! - [`call`]: failures of C calls;
//! - [`ida`]: the integrator's memory and all calls that use it;
//! - [`callbacks`]: callbacks of IDAS; [`trampoline`]: their C functions;
//! - [`backward`]: callbacks of backward problems;
//! - [`pinned`]: data at an address that does not move, shared with C;
//! - [`messages`]: redirection of IDAS' messages;
//! - [`version`]: version of SUNDIALS, and names that differ between versions.

pub(crate) mod backward;
pub(crate) mod call;
pub(crate) mod callbacks;
pub(crate) mod context;
pub(crate) mod ida;
pub(crate) mod linear_solver;
pub(crate) mod matrix;
mod messages;
mod nonlinear_solver;
pub(crate) mod pinned;
mod sensitivity_residual;
pub(crate) mod trampoline;
pub(crate) mod vector;
mod vector_clone;
mod vector_operations;
mod vector_view;
pub(crate) mod version;
