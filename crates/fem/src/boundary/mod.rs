//! Integrals over boundary facets: loads, supports and enclosed volumes.

pub(crate) mod deformed;
pub(crate) mod enclosed;
pub(crate) mod facet;
pub(crate) mod follower;
pub mod load;
pub(crate) mod robin;
