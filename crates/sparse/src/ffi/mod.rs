//! The boundaries to SuiteSparse and to METIS.

#[cfg(feature = "klu")]
pub(crate) mod klu;
#[cfg(feature = "metis")]
pub(crate) mod metis;
#[cfg(feature = "klu")]
pub(crate) mod version;
