//! Contacts of the body with rigid obstacles.

use myovib_fem as fem;
use myovib_fem::{Friction, Solid};
use myovib_model::{Contact, ObstacleMotion, Signal};

use super::builder::Builder;
use crate::InputError;
use crate::scene::supports::NAMES;
use crate::scene_file::contact::{Method, Obstacle};
use crate::scene_file::function::Function;
use crate::scene_file::loading::PathMethod;
use crate::scene_file::{self, Analysis};
use crate::spacing::times;

/// Distance, relative to the size of the coordinates, within which an obstacle counts as touching the body. Coordinates
/// with six digits reproduce positions within this distance.
const ROUNDING: f64 = 1e-6;
/// Number of intervals between the times at which a force is sampled.
const FORCE_TIMES: u32 = 97;

impl Builder<'_> {
    pub(super) fn contacts(&self, solid: &Solid) -> Result<Vec<Contact>, InputError> {
        let dimension = solid.space().dimension();
        let contacts = self.file.contact.iter().enumerate();
        contacts
            .map(|(i, contact)| {
                let path = format!("contact[{i}]");
                let is_second = |other: &scene_file::contact::Contact| {
                    other.force.is_some() && other.group == contact.group
                };
                if contact.force.is_some() && self.file.contact[..i].iter().any(is_second) {
                    let error = InputError::new("two forces press obstacles against this group")
                        .next("select a separate group for each obstacle");
                    return Err(self.wrong(&format!("{path}.group"), error));
                }
                let motion = match &contact.force {
                    Some(force) => self.driven_obstacle(contact, force, dimension, &path)?,
                    None => self.given_motion(contact, dimension, &path)?,
                };
                let obstacle = self.obstacle(&contact.obstacle, dimension, &path)?;
                let side_key = match obstacle {
                    fem::Obstacle::Plane { .. } => format!("{path}.normal"),
                    _ => format!("{path}.group"),
                };
                let contact =
                    Contact::new(solid, &contact.group, obstacle, contact.stiffness, motion);
                let contact = self.at(&format!("{path}.group"), contact)?;
                if contact.faces_away() {
                    let error = "the obstacle is on the wrong side of the group and cannot press against it";
                    let error = InputError::new(error)
                        .next("the normal of a plane points from the obstacle to the body; the group must face the obstacle");
                    return Err(self.wrong(&side_key, error));
                }
                let contact = match self.friction(i)? {
                    Some(friction) => contact.with_friction(friction),
                    None => contact,
                };
                let contact = match self.is_augmented(i)? {
                    true => contact.augmented(),
                    false => contact,
                };
                let rest = vec![0.0; solid.space().n_components()];
                let distance = contact.driven_distance(self.t_end, 0.0, &rest);
                let coordinates = solid.space().mesh().coordinates().iter();
                let size = coordinates.fold(0.0_f64, |size, x| size.max(x.abs()));
                // If a sphere moves away from the body, its far side would touch the body from the inside.
                let is_behind = |s: f64| s.is_nan() || s < -ROUNDING * size;
                if distance.is_some_and(is_behind) {
                    let error = InputError::new("the obstacle does not reach the group")
                        .next("reverse the direction, or move the obstacle in front of the body");
                    return Err(self.wrong(&format!("{path}.direction"), error));
                }
                Ok(contact)
            })
            .collect()
    }

    fn friction(&self, i: usize) -> Result<Option<Friction>, InputError> {
        let contact = &self.file.contact[i];
        let path = |key: &str| format!("contact[{i}].{key}");
        match (contact.friction, contact.slip_velocity) {
            (0.0, None) => Ok(None),
            (0.0, Some(_)) => {
                let error = InputError::new("a slip velocity requires friction");
                let error = error.next("add `friction`, or remove `slip_velocity`");
                Err(self.wrong(&path("slip_velocity"), error))
            }
            _ if !self.file.analysis.is_in_time() => {
                let error = InputError::new("this analysis does not support friction");
                let error = error.next("use analysis = \"quasi-static\" or \"dynamic\"");
                Err(self.wrong(&path("friction"), error))
            }
            (_, None) => {
                let error = InputError::new("friction requires a slip velocity")
                    .next("set `slip_velocity` to about a hundredth of the expected velocities");
                Err(self.wrong(&path("friction"), error))
            }
            (coefficient, Some(slip_velocity)) => Ok(Some(Friction { coefficient, slip_velocity })),
        }
    }

    /// Returns whether contact `i` uses augmented Lagrange multipliers.
    fn is_augmented(&self, i: usize) -> Result<bool, InputError> {
        let path = self.file.loading_path.as_ref();
        let is_by_arc = path.is_some_and(|path| path.method == PathMethod::ArcLength);
        let wrong = |what: &str| {
            let error =
                InputError::new(what).next("use method = \"penalty\" and raise `stiffness`");
            Err(self.wrong(&format!("contact[{i}].method"), error))
        };
        match self.file.contact[i].method {
            Method::Penalty => Ok(false),
            _ if self.file.analysis != Analysis::Static => {
                wrong("augmented Lagrange multipliers require analysis = \"static\"")
            }
            _ if is_by_arc => wrong(
                "augmented Lagrange multipliers require given load factors, which an arc-length path does not have",
            ),
            Method::AugmentedLagrange => Ok(true),
        }
    }

    fn given_motion(
        &self,
        contact: &scene_file::contact::Contact,
        dimension: usize,
        path: &str,
    ) -> Result<ObstacleMotion, InputError> {
        if contact.direction.is_some() {
            let error = InputError::new("the direction of an obstacle requires a force")
                .next("add `force`, or give the displacement as x, y, z");
            return Err(self.wrong(&format!("{path}.direction"), error));
        }
        let mut motion = vec![Signal::constant(0.0); dimension];
        for (axis, function) in [&contact.x, &contact.y, &contact.z].into_iter().enumerate() {
            let Some(function) = function else { continue };
            let path = format!("{path}.{}", NAMES[axis]);
            self.component(axis, dimension, &path)?;
            let signal = self.signal(function, &path)?;
            if contact.friction > 0.0
                && let Some(objection) = signal.unfit_for_motion()
            {
                let error = "an obstacle with friction cannot follow this displacement";
                let error = InputError::new(format!("{error}: {objection}"));
                return Err(self.wrong(&path, error));
            }
            motion[axis] = signal;
        }
        Ok(ObstacleMotion::Given(motion))
    }

    fn driven_obstacle(
        &self,
        contact: &scene_file::contact::Contact,
        force: &Function,
        dimension: usize,
        path: &str,
    ) -> Result<ObstacleMotion, InputError> {
        let of_force = format!("{path}.force");
        if self.file.analysis != Analysis::Static && !self.file.analysis.is_in_time() {
            let error =
                InputError::new("this analysis does not support obstacles driven by a force")
                    .next("give the displacement of the obstacle as x, y, z");
            return Err(self.wrong(&of_force, error));
        }
        if contact.friction > 0.0 {
            let error = InputError::new("an obstacle driven by a force cannot have friction")
                .next("remove `friction`, or give the displacement of the obstacle as x, y, z");
            return Err(self.wrong(&format!("{path}.friction"), error));
        }
        let moved = [&contact.x, &contact.y, &contact.z];
        if let Some(axis) = moved.iter().position(|displacement| displacement.is_some()) {
            let error = InputError::new("an obstacle follows a force or a displacement, not both")
                .next(format!("remove `{}` or `force`", NAMES[axis]));
            return Err(self.wrong(&format!("{path}.{}", NAMES[axis]), error));
        }
        let Some(direction) = &contact.direction else {
            let error = InputError::new("the force on an obstacle requires a direction")
                .next("add `direction`, for example [0.0, -1.0]");
            return Err(self.wrong(path, error));
        };
        let direction = self.unit_vector(direction, dimension, &format!("{path}.direction"))?
            [..dimension]
            .to_vec();
        let signal = self.signal(force, &of_force)?;
        if self.file.analysis == Analysis::Dynamic && signal.lowest_jump() == 0 {
            let error = InputError::new("the force on a massless obstacle must not jump")
                .next("give the step a `rise`");
            return Err(self.wrong(&of_force, error));
        }
        let value = match self.file.analysis.is_in_time() {
            // The integrator also checks the force at all times, but only this check can report the key.
            true => times(0.0, self.t_end, FORCE_TIMES)
                .map(|t| signal.at(t).value)
                .fold(f64::INFINITY, f64::min),
            false => signal.at(self.t_end).value,
        };
        if value < 0.0 {
            let error = InputError::new("an obstacle can only press, not pull")
                .found(format!("{value} N"))
                .allowed("0 or greater; reverse `direction` if necessary");
            return Err(self.wrong(&of_force, error));
        }
        Ok(ObstacleMotion::Driven { direction, force: signal })
    }

    fn obstacle(
        &self,
        obstacle: &Obstacle,
        dimension: usize,
        path: &str,
    ) -> Result<fem::Obstacle, InputError> {
        let vector = |key, values| self.coordinates(values, dimension, &format!("{path}.{key}"));
        let direction = |key, values| self.unit_vector(values, dimension, &format!("{path}.{key}"));
        Ok(match obstacle {
            Obstacle::Plane { point, normal } => fem::Obstacle::Plane {
                point: vector("point", point)?,
                normal: direction("normal", normal)?,
            },
            Obstacle::Sphere { center, radius } => {
                fem::Obstacle::Sphere { center: vector("center", center)?, radius: *radius }
            }
            Obstacle::Cylinder { point, axis, radius } => {
                if dimension == 2 {
                    let error = InputError::new("a body in the plane cannot touch a cylinder")
                        .next("use type = \"sphere\", which is a disk in the plane");
                    return Err(self.wrong(&format!("{path}.type"), error));
                }
                fem::Obstacle::Cylinder {
                    point: vector("point", point)?,
                    axis: direction("axis", axis)?,
                    radius: *radius,
                }
            }
        })
    }
}
