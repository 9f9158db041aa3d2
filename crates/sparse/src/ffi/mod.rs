//! The boundary to SuiteSparse.

pub(crate) mod klu;
pub(crate) mod version;
