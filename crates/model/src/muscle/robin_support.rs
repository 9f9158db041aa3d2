//! Elastic and viscous support of the boundary.

use myovib_fem::{RobinMatrix, Solid, SupportDirection};

use crate::error::ModelError;
use crate::reading::probe::Probe;

/// Elastic foundation of a boundary group, or a spring at a point. The foundation is the Robin boundary condition
/// `P N + k u + c u̇ = 0`, which may be restricted to its normal component.
#[derive(Debug, Clone)]
pub struct RobinSupport {
    operator: RobinMatrix,
    stiffness: f64,
    damping: f64,
}

impl RobinSupport {
    /// Creates the elastic foundation of a boundary group with stiffness k and damping c.
    ///
    /// # Units
    /// k in Pa/m, c in Pa·s/m.
    ///
    /// # Errors
    /// [`ModelError::Fem`] if the group is not on the boundary; [`ModelError::OutOfRange`] if k or c is negative or not
    /// finite.
    pub fn new(
        solid: &Solid,
        group: &str,
        along: SupportDirection,
        [stiffness, damping]: [f64; 2],
    ) -> Result<Self, ModelError> {
        check([stiffness, damping])?;
        Ok(Self { operator: RobinMatrix::new(solid.space(), group, along)?, stiffness, damping })
    }

    /// Creates a spring and a damper between the body at `point` and the ground. They act in all directions or along a
    /// unit vector.
    ///
    /// # Units
    /// k in N/m, c in N·s/m; in 2D, both are per meter of depth.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] if k or c is negative or not finite.
    pub fn spring(
        solid: &Solid,
        point: &Probe,
        direction: Option<[f64; 3]>,
        [stiffness, damping]: [f64; 2],
    ) -> Result<Self, ModelError> {
        check([stiffness, damping])?;
        Ok(Self {
            operator: RobinMatrix::of_point(solid.space(), point.node_weights(), direction),
            stiffness,
            damping,
        })
    }

    /// Returns the stiffness k, in Pa/m for a foundation and in N/m for a spring.
    pub fn stiffness(&self) -> f64 {
        self.stiffness
    }

    /// Returns the damping c, in Pa·s/m for a foundation and in N·s/m for a spring.
    pub fn damping(&self) -> f64 {
        self.damping
    }

    /// Returns the support matrix for unit stiffness, integrated over the group or concentrated at the point of the
    /// spring.
    pub fn operator(&self) -> &RobinMatrix {
        &self.operator
    }

    /// Adds to `total` the force of the body on the foundation for the displacement `u` and velocity `v` of all nodes.
    pub(crate) fn add_force(&self, u: &[f64], v: &[f64], total: &mut [f64]) {
        if self.stiffness > 0.0 {
            self.operator.add_product(self.stiffness, u, total);
        }
        if self.damping > 0.0 {
            self.operator.add_product(self.damping, v, total);
        }
    }

    /// Returns the stored energy, J.
    pub(crate) fn energy(&self, u: &[f64]) -> f64 {
        0.5 * self.stiffness * self.operator.square(u)
    }

    /// Returns the dissipated power, W.
    pub(crate) fn dissipation(&self, v: &[f64]) -> f64 {
        self.damping * self.operator.square(v)
    }
}

fn check([stiffness, damping]: [f64; 2]) -> Result<(), ModelError> {
    for (name, value) in [("support stiffness", stiffness), ("support damping", damping)] {
        if !(0.0..f64::INFINITY).contains(&value) {
            return Err(ModelError::OutOfRange { name, value, allowed: "0 or greater, finite" });
        }
    }
    Ok(())
}
