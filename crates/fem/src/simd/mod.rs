//! SIMD evaluation with one element per lane of a vector register.

pub(crate) mod batch;
pub(crate) mod lanes;
