//! Several elements at a time in the lanes of vector registers.

pub(crate) mod batch;
pub(crate) mod lanes;
