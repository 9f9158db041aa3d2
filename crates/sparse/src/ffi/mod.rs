//! The boundaries to SuiteSparse and to METIS.

#[cfg(klu)]
pub(crate) mod klu;
#[cfg(feature = "metis")]
pub(crate) mod metis;
#[cfg(klu)]
pub(crate) mod version;
