//! The boundary to C: the only `unsafe` code of the project.
//!
//! Each type here owns one C object and frees it once; each method is one C call whose arguments
//! the type keeps valid. No type of this module is public outside the crate.
//!
//! - [`klu`]: symbolic and numeric factorisations of KLU;

pub(crate) mod klu;
