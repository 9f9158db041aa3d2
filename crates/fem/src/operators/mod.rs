//! Sums over the quadrature points of all elements: residual, tangents, products, energies, masses.

pub(crate) mod added;
pub(crate) mod constitutive;
pub(crate) mod energy;
pub(crate) mod fields;
pub(crate) mod mass;
pub(crate) mod pass;
pub(crate) mod power;
pub(crate) mod product;
pub(crate) mod relaxation;
pub(crate) mod residual;
pub(crate) mod tangent;
