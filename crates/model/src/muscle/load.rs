//! Loads and prescribed displacements of the muscle.

use std::sync::Arc;

use myovib_fem::{
    ContactSums, DrivenSlope, FemError, FollowerPressure, Friction, FrictionSums, Obstacle,
    RigidContact, Sliding, Solid, SurfaceOperator,
};

use crate::signal::Signal;

/// The motion of an obstacle is considered tangential if the cosine of its angle with the direction toward the body is
/// below this value, which allows for rounding errors.
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
    /// Creates the load `vector · signal(t)` (N; in 2D, N per meter of thickness).
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

    /// Returns the sum of the absolute values of the nodal force components (N) for a signal equal to 1.
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

    /// Adds to `values` the derivative of the force with respect to the free components of `u`. Obstacles driven by a
    /// force are held fixed.
    fn add_stiffness(&self, t: f64, part: f64, u: &[f64], values: &mut [f64]);
}

/// Returns all forces that depend on the displacement of the boundary.
pub(crate) fn boundary_forces<'a>(
    surface_loads: &'a [SurfaceLoad],
    contacts: &'a [Contact],
) -> impl Iterator<Item = &'a dyn BoundaryForce> {
    let loads = surface_loads.iter().map(|own| own as &dyn BoundaryForce);
    loads.chain(contacts.iter().map(|own| own as &dyn BoundaryForce))
}

/// A load on the deformed boundary, such as a pressure. Its magnitude is a function of time.
#[derive(Debug, Clone)]
pub struct SurfaceLoad {
    operator: Arc<dyn SurfaceOperator>,
    signal: Signal,
}

impl SurfaceLoad {
    /// Creates a load with the magnitude `signal`.
    pub fn new(operator: Arc<dyn SurfaceOperator>, signal: Signal) -> Self {
        Self { operator, signal }
    }

    /// Creates a pressure on a boundary group. `signal` is the pressure in Pa, positive toward the body.
    ///
    /// # Errors
    /// [`FemError`] if the group contains no part of the boundary.
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

    /// Returns the sum of the absolute values of the nodal force components (N) on the undeformed body for a signal
    /// equal to 1. `n` is the number of nodal components.
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
    /// The obstacle has no inertia. It moves along a direction until the contact force balances a given force.
    Driven {
        /// Unit vector of the direction.
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

/// Returns whether a displacement is zero at all times.
fn rests(own: &Signal) -> bool {
    own.constant_over(0.0, f64::MAX) == Some(0.0)
}

impl Contact {
    /// Creates the contact between a boundary group and an obstacle. The default `stiffness` (Pa/m) depends on the
    /// body; see [`RigidContact::new`].
    ///
    /// # Shapes
    /// `motion`: one component per axis.
    ///
    /// # Errors
    /// [`FemError`] if the group contains no part of the boundary.
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

    /// Adds friction. It acts only during motions, because the slip velocity is zero in equilibrium.
    #[must_use]
    pub fn with_friction(self, friction: Friction) -> Self {
        Self { friction: Some(friction), ..self }
    }

    /// Adds augmented Lagrange multipliers. On loading paths, they are adjusted until the penetration vanishes; in
    /// other analyses, they are constant.
    #[must_use]
    pub fn augmented(mut self) -> Self {
        self.set_depths(vec![0.0; self.operator.n_points()]);
        self
    }

    /// Sets the [`depths`](RigidContact::depths) of the multipliers.
    pub(crate) fn set_depths(&mut self, depths: Vec<f64>) {
        self.operator.set_depths(depths);
    }

    /// Returns the depths of the multipliers, or an empty slice without multipliers.
    pub(crate) fn depths(&self) -> &[f64] {
        self.operator.depths()
    }

    /// Returns the mean distance between the body and the obstacle, relative to the accepted distance; see
    /// [`RigidContact::distance`].
    pub(crate) fn mean_distance(&self, t: f64, part: f64, u: &[f64]) -> f64 {
        self.operator.distance(&self.offset(t, part, u), u)
    }

    /// Updates the multipliers with [`RigidContact::update_multipliers`].
    pub(crate) fn update_multipliers(&mut self, t: f64, part: f64, u: &[f64]) {
        let offset = self.offset(t, part, u);
        self.operator.update_multipliers(&offset, u);
    }

    /// Multiplies the stiffness by `factor` without changing the pressures; see [`RigidContact::scale_stiffness`].
    pub(crate) fn scale_stiffness(&mut self, factor: f64, t: f64, part: f64, u: &[f64]) {
        let offset = self.offset(t, part, u);
        self.operator.scale_stiffness(factor, &offset, u);
    }

    /// Returns the friction, if any.
    pub fn friction(&self) -> Option<&Friction> {
        self.friction.as_ref()
    }

    /// Returns the name of the boundary group.
    pub fn group(&self) -> &str {
        &self.group
    }

    /// Returns the contact stiffness, Pa/m.
    pub fn stiffness(&self) -> f64 {
        self.operator.stiffness()
    }

    /// Returns the mean facet size of the group (m); see [`RigidContact::facet_size`].
    pub fn facet_size(&self) -> f64 {
        self.operator.facet_size()
    }

    /// Returns the prescribed displacements of the obstacle or, if a force drives the obstacle, this force.
    pub fn signals(&self) -> &[Signal] {
        match &self.motion {
            ObstacleMotion::Given(motion) => motion,
            ObstacleMotion::Driven { force, .. } => std::slice::from_ref(force),
        }
    }

    /// Returns whether the undeformed group faces away from the obstacle at t = 0; see [`RigidContact::faces_away`].
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

    /// Returns the displacement vector of the obstacle. The arguments are the same as for [`sums`](Self::sums).
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

    /// Returns the displacement of an obstacle driven by a force along its direction; `None` for other obstacles. The
    /// arguments are the same as for [`sums`](Self::sums).
    pub fn driven_distance(&self, t: f64, part: f64, u: &[f64]) -> Option<f64> {
        let ObstacleMotion::Driven { direction, force } = &self.motion else {
            return None;
        };
        let force = part * force.at(t).value;
        Some(self.operator.displacement_under(force, direction, u))
    }

    /// Returns the displacement of the obstacle as a scalar, or `None` for an obstacle at rest. The arguments are the
    /// same as for [`sums`](Self::sums).
    ///
    /// If a force drives the obstacle, the scalar is the displacement along the direction of the force. For a
    /// prescribed motion along one axis, the scalar is positive toward the body or, if the motion is tangential, in the
    /// direction of the axis. A motion along several axes is projected onto the direction to the nearest point of the
    /// undeformed body.
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

    /// Returns whether the obstacle moves or is driven by a force.
    pub fn moves(&self) -> bool {
        self.is_driven() || !self.signals().iter().all(rests)
    }

    /// Returns the derivatives of the contact force of an obstacle driven by a force, and the driving force under the
    /// full load. Returns `None` if no force drives the obstacle or if it is not in contact. The arguments are the same
    /// as for [`sums`](Self::sums).
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

    /// Returns the area in contact, m² (length in 2D, m), measured on the undeformed body. The arguments are the same
    /// as for [`sums`](Self::sums).
    pub fn area(&self, t: f64, part: f64, u: &[f64]) -> f64 {
        self.operator.area(&self.offset(t, part, u), u)
    }

    /// Calls `action` with the friction and the motions of the obstacle and the body at time `t`. Returns `None`
    /// without friction.
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

    /// Adds to `total` the force of the obstacle on the body. `motion` contains the displacement and velocity of all
    /// nodes.
    pub fn add_total_force(&self, t: f64, motion: [&[f64]; 2], total: &mut [f64]) {
        let mut friction = vec![0.0; total.len()];
        self.add_friction(t, motion, &mut friction);
        total.iter_mut().zip(friction).for_each(|(total, friction)| *total -= friction);
        self.add_force(t, 1.0, 1.0, motion[0], total);
    }

    /// Adds to `total` the friction force of the body on the obstacle. `motion` contains the displacement and velocity
    /// of all nodes.
    pub(crate) fn add_friction(&self, t: f64, motion: [&[f64]; 2], total: &mut [f64]) {
        self.slide(t, motion, |friction, sliding| {
            self.operator.add_friction(friction, sliding, total);
        });
    }

    /// Adds to `values` the derivatives of [`add_friction`](Self::add_friction) with respect to the free components of
    /// the displacement and velocity in `motion`.
    pub(crate) fn add_friction_slopes(&self, t: f64, motion: [&[f64]; 2], values: [&mut [f64]; 2]) {
        self.slide(t, motion, |friction, sliding| {
            self.operator.add_friction_slopes(friction, sliding, values);
        });
    }

    /// Returns the [`FrictionSums`], which are zero without friction. `motion` contains the displacement and velocity
    /// of all nodes.
    pub fn friction_sums(&self, t: f64, motion: [&[f64]; 2]) -> FrictionSums {
        let sums = self
            .slide(t, motion, |friction, sliding| self.operator.friction_sums(friction, sliding));
        sums.unwrap_or_default()
    }

    /// Returns the power dissipated by friction and the power supplied by the obstacle. The latter is the sum of the
    /// power of friction on the body and the dissipated power.
    pub(crate) fn friction_powers(&self, t: f64, motion: [&[f64]; 2]) -> [f64; 2] {
        let sums = self.friction_sums(t, motion);
        let components = sums.force.iter().zip(self.signals());
        let obstacle: f64 = components.map(|(f, own)| -f * own.at(t).d1).sum();
        [sums.dissipation, obstacle]
    }

    /// Returns the stored energy and its rate at time `t` for the displacement `u` and velocity `v` of all nodes. The
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

    /// Adds to `total` the derivative of the force on the body with respect to the load factor. `u` is the displacement
    /// of all nodes, and `rate` its derivative. Does nothing if a force drives the obstacle.
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

/// Sets the depths of the multipliers of each contact. `depths` contains an empty list for each contact without
/// multipliers.
pub(crate) fn set_multipliers(contacts: &mut [Contact], depths: Vec<Vec<f64>>) {
    let augmented = contacts.iter_mut().zip(depths).filter(|(_, depths)| !depths.is_empty());
    augmented.for_each(|(contact, depths)| contact.set_depths(depths));
}

/// A displacement component prescribed as a function of time instead of determined by an equation of motion.
#[derive(Debug, Clone)]
pub struct Prescribed {
    /// Index of the component in a nodal array.
    pub component: usize,
    /// Prescribed displacement, m. Its derivatives are the prescribed velocity and acceleration.
    pub signal: Signal,
}
