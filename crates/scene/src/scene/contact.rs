//! Contacts of the body with rigid obstacles.

use myovib_fem as fem;
use myovib_fem::Solid;
use myovib_model::{Contact, Signal};

use super::builder::Builder;
use crate::InputError;
use crate::scene::supports::NAMES;
use crate::scene_file::SceneFile;
use crate::scene_file::contact::Obstacle;

impl Builder<'_> {
    /// Returns the contacts of the body.
    pub(super) fn contacts(
        &self,
        file: &SceneFile,
        solid: &Solid,
    ) -> Result<Vec<Contact>, InputError> {
        let dimension = solid.space().dimension();
        let given = file.contact.iter().enumerate();
        given
            .map(|(i, contact)| {
                let path = format!("contact[{i}]");
                let mut motion = vec![Signal::constant(0.0); dimension];
                for (axis, function) in [&contact.x, &contact.y, &contact.z].into_iter().enumerate()
                {
                    let Some(function) = function else { continue };
                    let path = format!("{path}.{}", NAMES[axis]);
                    self.component(axis, dimension, &path)?;
                    motion[axis] = self.signal(function, &path)?;
                }
                let obstacle = self.obstacle(&contact.obstacle, dimension, &path)?;
                let contact =
                    Contact::new(solid, &contact.group, obstacle, contact.stiffness, motion);
                self.at(&format!("{path}.group"), contact)
            })
            .collect()
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
            Obstacle::Sphere { center, radius } => fem::Obstacle::Sphere {
                center: vector("center", center)?,
                radius: *radius,
            },
            Obstacle::Cylinder {
                point,
                axis,
                radius,
            } => {
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
