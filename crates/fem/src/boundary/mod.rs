//! Integrals over boundary facets: loads, supports, contact and enclosed volumes.

pub(crate) mod contact;
pub(crate) mod deformed;
pub(crate) mod enclosed;
pub(crate) mod facet;
pub(crate) mod follower;
pub mod load;
pub(crate) mod robin;
