//! Interface to C, which contains the `unsafe` code of this crate.
//!
//! Each type in this module owns one C object and frees it once. Each method is one C call whose arguments are kept
//! valid by the type. No type of this module is public outside the crate.
//!
//! - [`context`], [`vector`], [`matrix`], [`linear_solver`], [`nonlinear_solver`]: the SUNDIALS objects used by IDAS;
//! - [`vector_operations`]: vector arithmetic called by IDAS; [`vector_clone`]: cloning of vectors by IDAS;
//!   [`vector_view`]: access to vectors as slices;
//! - [`call`]: failures of C calls;
//! - [`ida`]: the memory block of the integrator and all calls that use it;
//! - [`callbacks`]: callbacks of IDAS; [`trampoline`]: the corresponding C functions;
//! - [`backward`]: callbacks of backward problems;
//! - [`pinned`]: data at a fixed address, shared with C;
//! - [`messages`]: redirection of IDAS messages;
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
