//! Loads and prescribed displacements of the muscle.

use std::sync::Arc;

use myovib_fem::{
    ContactSums, DrivenSlope, FemError, FollowerPressure, Friction, FrictionSums, Obstacle,
    RigidContact, Sliding, Solid, SurfaceOperator,
};

use crate::signal::Signal;

/// Cosine of the angle between the motion of an obstacle and the direction to the body below which the motion counts as
/// tangential, up to rounding.
const TANGENTIAL: f64 = 1e-12;

/// A force on the nodes: a constant vector times a function of time.
#[derive(Debug, Clone)]
pub struct Load {
    /// Number of nodal components of the body.
    length: usize,
    entries: Vec<(usize, f64)>,
    signal: Signal,
}

impl Load {
    /// Creates a load `vector · signal(t)`, in N, or in N per m of thickness in 2D.
    ///
    /// # Shapes
    /// `vector`: all nodal components of the body. Analyses of a body with a different number of components panic.
    pub fn new(vector: &[f64], signal: Signal) -> Self {
        let entries =
            vector.iter().copied().enumerate().filter(|(_, value)| *value != 0.0).collect();
        Self { length: vector.len(), entries, signal }
    }

    /// Returns the function of time.
    pub fn signal(&self) -> &Signal {
        &self.signal
    }

    /// Returns the load scaled by `part`.
    #[must_use]
    pub fn scaled(&self, part: f64) -> Self {
        Self { signal: self.signal.scaled(part), ..self.clone() }
    }

    /// Returns the sum of the absolute nodal force components, N, for a signal equal to 1.
    pub(crate) fn magnitude(&self) -> f64 {
        self.entries.iter().map(|(_, value)| value.abs()).sum()
    }

    /// Adds the load at time `t` to `total`.
    ///
    /// # Panics
    /// Panics if the load and `total` differ in the number of components.
    pub fn add_at(&self, t: f64, total: &mut [f64]) {
        assert_eq!(self.length, total.len(), "components of a load and of its body");
        let factor = self.signal.at(t).value;
        for &(i, value) in &self.entries {
            total[i] += factor * value;
        }
    }
}

/// A force on the deformed boundary.
pub(crate) trait BoundaryForce {
    /// Adds to `total` the force at time `t` and nodal displacements `u`, multiplied by `sign`. All loads and motions
    /// are scaled by `part`.
    fn add_force(&self, t: f64, part: f64, sign: f64, u: &[f64], total: &mut [f64]);

    /// Adds to `values` the derivative of the force with respect to the free components of `u`, with obstacles driven
    /// by a force kept in place.
    fn add_stiffness(&self, t: f64, part: f64, u: &[f64], values: &mut [f64]);
}

/// Returns the forces that depend on the displacement of the boundary.
pub(crate) fn boundary_forces<'a>(
    surface_loads: &'a [SurfaceLoad],
    contacts: &'a [Contact],
) -> impl Iterator<Item = &'a dyn BoundaryForce> {
    let loads = surface_loads.iter().map(|own| own as &dyn BoundaryForce);
    loads.chain(contacts.iter().map(|own| own as &dyn BoundaryForce))
}

/// A load on the deformed boundary, such as a pressure, whose size follows a function of time.
#[derive(Debug, Clone)]
pub struct SurfaceLoad {
    operator: Arc<dyn SurfaceOperator>,
    signal: Signal,
}

impl SurfaceLoad {
    /// Creates a load whose size follows `signal`.
    pub fn new(operator: Arc<dyn SurfaceOperator>, signal: Signal) -> Self {
        Self { operator, signal }
    }

    /// Creates the pressure `signal` (Pa) on a group of the boundary, positive toward the body.
    ///
    /// # Errors
    /// [`FemError`] for a group that contains no parts of the boundary.
    pub fn pressure(solid: &Solid, group: &str, signal: Signal) -> Result<Self, FemError> {
        let operator = Arc::new(FollowerPressure::new(solid, group)?);
        Ok(Self { operator, signal })
    }

    /// Returns the function of time.
    pub fn signal(&self) -> &Signal {
        &self.signal
    }

    /// Returns the load scaled by `part`.
    #[must_use]
    pub fn scaled(&self, part: f64) -> Self {
        Self { operator: Arc::clone(&self.operator), signal: self.signal.scaled(part) }
    }

    /// Returns the sum of the absolute nodal force components, N, on the undeformed body for a signal equal to 1. `n`:
    /// number of nodal components.
    pub(crate) fn magnitude(&self, n: usize) -> f64 {
        let mut force = vec![0.0; n];
        self.operator.add_force(1.0, &vec![0.0; n], &mut force);
        force.iter().map(|f| f.abs()).sum()
    }

    /// Adds to `total` the nodal forces at time `t` and nodal displacements `u`, multiplied by `factor`.
    pub fn add_at(&self, t: f64, factor: f64, u: &[f64], total: &mut [f64]) {
        let size = factor * self.signal.at(t).value;
        self.operator.add_force(size, u, total);
    }
}

impl BoundaryForce for SurfaceLoad {
    fn add_force(&self, t: f64, part: f64, sign: f64, u: &[f64], total: &mut [f64]) {
        self.add_at(t, part * sign, u, total);
    }

    fn add_stiffness(&self, t: f64, part: f64, u: &[f64], values: &mut [f64]) {
        let size = part * self.signal.at(t).value;
        self.operator.add_stiffness(size, u, values);
    }
}

/// Displacement of an obstacle.
#[derive(Debug, Clone)]
pub enum ObstacleMotion {
    /// Displacement along each axis, m.
    Given(Vec<Signal>),
    /// The obstacle moves along a direction until the contact balances a force, without inertia.
    Driven {
        /// Unit vector.
        direction: Vec<f64>,
        /// Force along the direction, N (N/m in 2D).
        force: Signal,
    },
}

/// Contact of the boundary with a rigid obstacle.
#[derive(Debug, Clone)]
pub struct Contact {
    group: String,
    operator: RigidContact,
    /// Unit vector from the obstacle to the undeformed group.
    toward_body: [f64; 3],
    motion: ObstacleMotion,
    friction: Option<Friction>,
}

/// Returns whether a displacement is always zero.
fn rests(own: &Signal) -> bool {
    own.constant_over(0.0, f64::MAX) == Some(0.0)
}

impl Contact {
    /// Creates the contact of a group of the boundary with an obstacle. The default `stiffness` (Pa/m) depends on the
    /// body: see [`RigidContact::new`].
    ///
    /// # Shapes
    /// `motion`: one component per axis.
    ///
    /// # Errors
    /// [`FemError`] for a group that contains no parts of the boundary.
    pub fn new(
        solid: &Solid,
        group: &str,
        obstacle: Obstacle,
        stiffness: Option<f64>,
        motion: ObstacleMotion,
    ) -> Result<Self, FemError> {
        let operator = RigidContact::new(solid, group, obstacle, stiffness)?;
        Ok(Self {
            group: group.to_owned(),
            toward_body: operator.toward_body(),
            operator,
            motion,
            friction: None,
        })
    }

    /// Adds friction, which acts only in motions: equilibria have no slip velocity.
    #[must_use]
    pub fn with_friction(self, friction: Friction) -> Self {
        Self { friction: Some(friction), ..self }
    }

    /// Adds augmented Lagrange multipliers, which loading paths adjust until the penetration vanishes. Elsewhere they
    /// are constant.
    #[must_use]
    pub fn augmented(mut self) -> Self {
        self.set_depths(vec![0.0; self.operator.n_points()]);
        self
    }

    /// Sets the [`depths`](RigidContact::depths) of multipliers.
    pub(crate) fn set_depths(&mut self, depths: Vec<f64>) {
        self.operator.set_depths(depths);
    }

    /// Returns the depths of the multipliers; empty without multipliers.
    pub(crate) fn depths(&self) -> &[f64] {
        self.operator.depths()
    }

    /// Returns the mean distance of the body from the obstacle in units of the accepted distance: see
    /// [`RigidContact::distance`].
    pub(crate) fn mean_distance(&self, t: f64, part: f64, u: &[f64]) -> f64 {
        self.operator.distance(&self.offset(t, part, u), u)
    }

    /// Updates the multipliers, as [`RigidContact::update_multipliers`] does.
    pub(crate) fn update_multipliers(&mut self, t: f64, part: f64, u: &[f64]) {
        let offset = self.offset(t, part, u);
        self.operator.update_multipliers(&offset, u);
    }

    /// Multiplies the stiffness by `factor` at the same pressures, as [`RigidContact::scale_stiffness`] does.
    pub(crate) fn scale_stiffness(&mut self, factor: f64, t: f64, part: f64, u: &[f64]) {
        let offset = self.offset(t, part, u);
        self.operator.scale_stiffness(factor, &offset, u);
    }

    /// Returns the friction.
    pub fn friction(&self) -> Option<&Friction> {
        self.friction.as_ref()
    }

    /// Returns the name of the group.
    pub fn group(&self) -> &str {
        &self.group
    }

    /// Returns the contact stiffness, Pa/m.
    pub fn stiffness(&self) -> f64 {
        self.operator.stiffness()
    }

    /// Returns the mean size of the facets of the group, m: see [`RigidContact::facet_size`].
    pub fn facet_size(&self) -> f64 {
        self.operator.facet_size()
    }

    /// Returns the displacements of the obstacle, or its force.
    pub fn signals(&self) -> &[Signal] {
        match &self.motion {
            ObstacleMotion::Given(motion) => motion,
            ObstacleMotion::Driven { force, .. } => std::slice::from_ref(force),
        }
    }

    /// Returns whether the undeformed group faces away from the obstacle at t = 0: see [`RigidContact::faces_away`].
    pub fn faces_away(&self) -> bool {
        let offset = match &self.motion {
            ObstacleMotion::Given(motion) => motion.iter().map(|own| own.at(0.0).value).collect(),
            ObstacleMotion::Driven { direction, .. } => vec![0.0; direction.len()],
        };
        self.operator.faces_away(&offset)
    }

    /// Returns whether a force drives the obstacle.
    pub fn is_driven(&self) -> bool {
        matches!(self.motion, ObstacleMotion::Driven { .. })
    }

    /// Returns the contact with the motion or force of the obstacle scaled by `part`.
    #[must_use]
    pub fn scaled(&self, part: f64) -> Self {
        let motion = match &self.motion {
            ObstacleMotion::Given(motion) => {
                ObstacleMotion::Given(motion.iter().map(|own| own.scaled(part)).collect())
            }
            ObstacleMotion::Driven { direction, force } => {
                ObstacleMotion::Driven { direction: direction.clone(), force: force.scaled(part) }
            }
        };
        Self { motion, ..self.clone() }
    }

    /// Returns the displacement of the obstacle, for the arguments of [`sums`](Self::sums).
    fn offset(&self, t: f64, part: f64, u: &[f64]) -> Vec<f64> {
        match &self.motion {
            ObstacleMotion::Given(motion) => {
                motion.iter().map(|own| part * own.at(t).value).collect()
            }
            ObstacleMotion::Driven { direction, force } => {
                let force = part * force.at(t).value;
                let distance = self.operator.displacement_under(force, direction, u);
                direction.iter().map(|e| distance * e).collect()
            }
        }
    }

    /// Returns the displacement of a driven obstacle along its direction, for the arguments of [`sums`](Self::sums).
    pub fn driven_distance(&self, t: f64, part: f64, u: &[f64]) -> Option<f64> {
        let ObstacleMotion::Driven { direction, force } = &self.motion else {
            return None;
        };
        let force = part * force.at(t).value;
        Some(self.operator.displacement_under(force, direction, u))
    }

    /// Returns the displacement of the obstacle as one number, for the arguments of [`sums`](Self::sums); `None` for an
    /// obstacle at rest. If a force drives the obstacle, this is the displacement along the direction of the force. A
    /// prescribed motion along one axis is positive toward the body or, if it is tangential, along the axis. A motion
    /// along several axes is projected onto the direction to the nearest point of the undeformed body.
    pub fn distance(&self, t: f64, part: f64, u: &[f64]) -> Option<f64> {
        let ObstacleMotion::Given(motion) = &self.motion else {
            return self.driven_distance(t, part, u);
        };
        let mut along: Vec<_> =
            motion.iter().zip(self.toward_body).filter(|(own, _)| !rests(own)).collect();
        if let [(_, e)] = &mut along[..] {
            *e = if e.abs() > TANGENTIAL { e.signum() } else { 1.0 };
        }
        self.moves().then(|| along.iter().map(|(own, e)| part * e * own.at(t).value).sum())
    }

    /// Returns whether the obstacle moves, or is driven by a force.
    pub fn moves(&self) -> bool {
        self.is_driven() || !self.signals().iter().all(rests)
    }

    /// Returns the derivatives of the contact force of a driven obstacle, for the arguments of [`sums`](Self::sums),
    /// and the force under the full load; `None` if the obstacle is not driven by a force or not in contact.
    pub(crate) fn driven_slope(&self, t: f64, part: f64, u: &[f64]) -> Option<(DrivenSlope, f64)> {
        let ObstacleMotion::Driven { direction, force } = &self.motion else {
            return None;
        };
        let force = force.at(t).value;
        let distance = self.driven_distance(t, part, u)?;
        let slope = self.operator.driven_slope(direction, distance, u);
        (part * force > 0.0 && slope.by_obstacle > 0.0).then_some((slope, force))
    }

    /// Returns the [`ContactSums`] at time `t` and nodal displacements `u`, with all loads and motions scaled by
    /// `part`.
    pub fn sums(&self, t: f64, part: f64, u: &[f64]) -> ContactSums {
        self.operator.sums(&self.offset(t, part, u), u)
    }

    /// Returns the undeformed area in contact, m² (length in 2D, m), for the arguments of [`sums`](Self::sums).
    pub fn area(&self, t: f64, part: f64, u: &[f64]) -> f64 {
        self.operator.area(&self.offset(t, part, u), u)
    }

    /// Calls `action` with the friction, the motion of the obstacle at time `t`, and the motion of the body. Does
    /// nothing without friction.
    fn slide<R>(
        &self,
        t: f64,
        [u, v]: [&[f64]; 2],
        action: impl FnOnce(&Friction, &Sliding<'_>) -> R,
    ) -> Option<R> {
        let friction = self.friction.as_ref()?;
        let offset = self.offset(t, 1.0, u);
        let velocity = match &self.motion {
            ObstacleMotion::Given(motion) => motion.iter().map(|own| own.at(t).d1).collect(),
            ObstacleMotion::Driven { .. } => vec![0.0; offset.len()],
        };
        let (offset, velocity) = (&offset[..], &velocity[..]);
        Some(action(friction, &Sliding { offset, velocity, u, v }))
    }

    /// Adds the force of the obstacle on the body, for the displacement and velocity `motion` of all nodes, to `total`.
    pub fn add_total_force(&self, t: f64, motion: [&[f64]; 2], total: &mut [f64]) {
        let mut friction = vec![0.0; total.len()];
        self.add_friction(t, motion, &mut friction);
        total.iter_mut().zip(friction).for_each(|(total, friction)| *total -= friction);
        self.add_force(t, 1.0, 1.0, motion[0], total);
    }

    /// Adds the friction force of the body on the obstacle to `total`, for the displacement and velocity `motion` of
    /// all nodes.
    pub(crate) fn add_friction(&self, t: f64, motion: [&[f64]; 2], total: &mut [f64]) {
        self.slide(t, motion, |friction, sliding| {
            self.operator.add_friction(friction, sliding, total);
        });
    }

    /// Adds the derivatives of [`add_friction`](Self::add_friction) with respect to the free components of `motion` to
    /// `values`.
    pub(crate) fn add_friction_slopes(&self, t: f64, motion: [&[f64]; 2], values: [&mut [f64]; 2]) {
        self.slide(t, motion, |friction, sliding| {
            self.operator.add_friction_slopes(friction, sliding, values);
        });
    }

    /// Returns the [`FrictionSums`] for the displacement and velocity `motion` of all nodes; zero without friction.
    pub fn friction_sums(&self, t: f64, motion: [&[f64]; 2]) -> FrictionSums {
        let sums = self
            .slide(t, motion, |friction, sliding| self.operator.friction_sums(friction, sliding));
        sums.unwrap_or_default()
    }

    /// Returns the dissipation by friction, and the power of the obstacle: the power of friction on the body plus this
    /// dissipation.
    pub(crate) fn friction_powers(&self, t: f64, motion: [&[f64]; 2]) -> [f64; 2] {
        let sums = self.friction_sums(t, motion);
        let components = sums.force.iter().zip(self.signals());
        let obstacle: f64 = components.map(|(f, own)| -f * own.at(t).d1).sum();
        [sums.dissipation, obstacle]
    }

    /// Returns the stored energy and its rate at time `t`, for the displacement `u` and velocity `v` of all nodes. The
    /// rate is the power of the obstacle minus the power of the contact force on the body.
    pub(crate) fn stored_energy(&self, t: f64, u: &[f64], v: &[f64]) -> [f64; 2] {
        let sums = self.sums(t, 1.0, u);
        let obstacle: f64 = match &self.motion {
            ObstacleMotion::Given(motion) => {
                let components = sums.force.iter().zip(motion);
                components.map(|(f, own)| f * own.at(t).d1).sum()
            }
            ObstacleMotion::Driven { force, .. } => {
                let slope = self.driven_slope(t, 1.0, u);
                slope.map_or(0.0, |(slope, value)| {
                    let by_body: f64 = slope.by_nodes.iter().zip(v).map(|(c, v)| c * v).sum();
                    value * (force.at(t).d1 - by_body) / slope.by_obstacle
                })
            }
        };
        let mut force = vec![0.0; u.len()];
        self.add_force(t, 1.0, 1.0, u, &mut force);
        let on_body: f64 = force.iter().zip(v).map(|(f, v)| f * v).sum();
        [sums.energy, obstacle - on_body]
    }

    /// Adds the derivative of the force on the body with respect to the load factor, for the displacement of all nodes
    /// and its derivative, to `total`. Does nothing if a force drives the obstacle.
    pub(crate) fn add_force_rate(
        &self,
        (t, factor): (f64, f64),
        [u, rate]: [&[f64]; 2],
        total: &mut [f64],
    ) {
        if !self.is_driven() {
            let motions = [self.offset(t, factor, u), self.offset(t, 1.0, u)];
            self.operator.add_force_rate([&motions[0], &motions[1]], [u, rate], total);
        }
    }
}

impl BoundaryForce for Contact {
    fn add_force(&self, t: f64, part: f64, sign: f64, u: &[f64], total: &mut [f64]) {
        let offset = self.offset(t, part, u);
        self.operator.add_force(&offset, sign, u, total);
    }

    fn add_stiffness(&self, t: f64, part: f64, u: &[f64], values: &mut [f64]) {
        self.operator.add_stiffness(&self.offset(t, part, u), u, values);
    }
}

/// Sets the depths of the multipliers of each contact; the lists of contacts without multipliers are empty.
pub(crate) fn set_multipliers(contacts: &mut [Contact], depths: Vec<Vec<f64>>) {
    let augmented = contacts.iter_mut().zip(depths).filter(|(_, depths)| !depths.is_empty());
    augmented.for_each(|(contact, depths)| contact.set_depths(depths));
}

/// A displacement component that follows a function of time instead of an equation of motion.
#[derive(Debug, Clone)]
pub struct Prescribed {
    /// Index of the component in a nodal array.
    pub component: usize,
    /// Its displacement, m; its derivatives are the prescribed velocity and acceleration.
    pub signal: Signal,
}
