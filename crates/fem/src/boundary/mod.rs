//! Integrals over boundary facets: loads, supports, contact and enclosed volumes.

pub(crate) mod contact;
pub(crate) mod deformed;
pub(crate) mod enclosed;
pub(crate) mod facet;
pub(crate) mod follower;
pub mod load;
pub(crate) mod robin;

/// Force on the deformed boundary, proportional to a scalar `size` such as a pressure.
///
/// # Shapes
/// Forces and displacements have length `n_components`.
///
/// # Panics
/// Methods panic if an array is too short.
pub trait SurfaceOperator: std::fmt::Debug + Send + Sync {
    /// Adds the force for the given `size` at displacement `u` to `total`.
    fn add_force(&self, size: f64, u: &[f64], total: &mut [f64]);

    /// Adds the derivative of the force with respect to the free components of `u` to `values`, which holds the
    /// entries of [`Solid::displacement_pattern`](crate::Solid::displacement_pattern).
    fn add_stiffness(&self, size: f64, u: &[f64], values: &mut [f64]);
}
