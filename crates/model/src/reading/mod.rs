//! What is read off a body: values at points, measurements over groups, energies.

pub(crate) mod displacement;
pub(crate) mod energy;
pub(crate) mod measure;
pub(crate) mod probe;
