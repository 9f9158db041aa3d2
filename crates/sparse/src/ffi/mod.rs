//! Interfaces to SuiteSparse, METIS and the operating system.

pub(crate) mod allocator;
#[cfg(klu)]
pub(crate) mod klu;
#[cfg(feature = "metis")]
pub(crate) mod metis;
pub(crate) mod pages;
#[cfg(klu)]
pub(crate) mod version;
