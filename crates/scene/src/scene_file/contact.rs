//! Contact with rigid obstacles.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::function::Function;

/// Contact of the boundary with a rigid obstacle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Contact {
    /// Group of edges or faces.
    pub group: String,
    /// Shape of the obstacle.
    #[serde(flatten)]
    pub obstacle: Obstacle,
    /// Displacement of the obstacle, m [default: 0].
    pub x: Option<Function>,
    /// Displacement of the obstacle, m [default: 0].
    pub y: Option<Function>,
    /// Displacement of the obstacle, m [default: 0].
    pub z: Option<Function>,
    /// Force along `direction` that presses the obstacle against the body, N (in 2D, N/m), instead of a displacement.
    /// The obstacle has no mass and no friction.
    pub force: Option<Function>,
    /// Vector of any length along which `force` acts and the obstacle is free to move; only with `force`.
    #[schemars(length(min = 2, max = 3))]
    pub direction: Option<Vec<f64>>,
    /// Coefficient of friction. It is allowed only in dynamic and quasi-static analyses.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub friction: f64,
    /// Slip velocity, m/s, at which the friction is 0.71 times `friction` times the pressure; only with `friction`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub slip_velocity: Option<f64>,
    /// Method that keeps the body out of the obstacle.
    #[serde(default)]
    pub method: Method,
    /// Slope of the contact pressure as a function of the penetration, Pa/m [default: 100 times the largest shear modulus at the group,
    /// divided by the mean facet size].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub stiffness: Option<f64>,
}

/// Method that keeps a body out of an obstacle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The contact pressure rises with the penetration. Its slope reaches `stiffness` at a penetration of a thousandth
    /// of the facet size.
    #[default]
    Penalty,
    /// Multipliers are updated after each equilibrium until the mean distance from the obstacle, weighted by the
    /// contact pressure, is at most 1e-4 of the facet size; only in static analyses with given load factors. Because of
    /// this tolerance, forces depend on the load steps, by up to 1 % where few facets touch. Contacts that converge
    /// slowly are up to 64 times stiffer during the updates.
    AugmentedLagrange,
}

/// Shape of a rigid obstacle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub enum Obstacle {
    /// Half-space behind a plane.
    Plane {
        /// Point of the plane, m.
        #[schemars(length(min = 2, max = 3))]
        point: Vec<f64>,
        /// Normal vector of any length that points from the obstacle to the body.
        #[schemars(length(min = 2, max = 3))]
        normal: Vec<f64>,
    },
    /// Ball (in 2D, a disk).
    Sphere {
        /// Center, m.
        #[schemars(length(min = 2, max = 3))]
        center: Vec<f64>,
        /// Radius, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: f64,
    },
    /// Infinite cylinder (only in 3D).
    Cylinder {
        /// Point of the axis, m.
        #[schemars(length(min = 3, max = 3))]
        point: Vec<f64>,
        /// Direction of the axis, of any length.
        #[schemars(length(min = 3, max = 3))]
        axis: Vec<f64>,
        /// Radius, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: f64,
    },
}
