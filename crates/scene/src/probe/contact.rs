//! Contact of a group with rigid obstacles.

use myovib_fem::Solid;
use myovib_model::ModelError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::column::ColumnKind;
use super::kind::{InvalidPlace, Kind, Reading, StateAt, Wrong};
use super::moment::{self, Arms, MOMENT};
use crate::scene_file::SceneFile;
use crate::system::{System, muscle_of};
use crate::{InputError, Scene};

/// Force of the obstacles on the body, N; undeformed contact area, m² (accurate to about a quarter of a facet along its edge);
/// largest penetration, m; displacement of the first moving obstacle, m; with `about`, the moment of the force, N·m. The
/// displacement is measured along the force on the obstacle, along the only axis of its motion (positive toward the body), or
/// along the direction to the body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Contact {
    /// Group of a `[[contact]]`.
    pub group: String,
    /// Fixed point about which the moment on the deformed body is computed, in m.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 2, max = 3))]
    pub about: Option<Vec<f64>>,
}

/// Contact force, contact area, penetration, displacement of a moving obstacle, and moment.
const COLUMNS: &[ColumnKind] = &[
    ColumnKind::new("F", ["N/m", "N"]),
    ColumnKind::new("area", ["m", "m²"]),
    ColumnKind::new("penetration", ["m"; 2]),
    ColumnKind::new("displacement", ["m"; 2]),
    MOMENT,
];

impl Kind for Contact {
    fn columns() -> &'static [ColumnKind] {
        COLUMNS
    }

    fn check_part(&self, file: &SceneFile) -> Result<(), Wrong<InputError>> {
        let groups: Vec<&str> = file.contact.iter().map(|contact| &*contact.group).collect();
        match groups.contains(&&*self.group) {
            true => Ok(()),
            false => Err((
                ".group",
                InputError::new(format!("no [[contact]] has the group `{}`", self.group))
                    .allowed(groups.join(", ")),
            )),
        }
    }

    fn check_place(&self, solid: &Solid) -> Result<(), Wrong<InvalidPlace>> {
        moment::check(self.about.as_deref(), solid)
    }

    fn reading(&self, of: &Scene) -> Result<Box<dyn Reading>, ModelError> {
        let muscle = &of.expect_body()?.muscle;
        let moves =
            |contact: &myovib_model::Contact| contact.group() == self.group && contact.moves();
        let space = muscle.solid.space();
        Ok(Box::new(Sums {
            group: self.group.clone(),
            dimension: space.dimension(),
            arms: self.about.as_ref().map(|point| Arms::about(point, space)),
            moving: muscle.contacts.iter().position(moves),
        }))
    }
}

/// Sums over all contacts of a group.
struct Sums {
    group: String,
    dimension: usize,
    /// Index of the first contact whose obstacle moves.
    moving: Option<usize>,
    arms: Option<Arms>,
}

impl Reading for Sums {
    fn names(&self) -> Vec<String> {
        let forces = COLUMNS[0].components(self.dimension);
        let others = COLUMNS[1..].iter().take(2 + usize::from(self.moving.is_some()));
        let moments = self.arms.iter().flat_map(Arms::names);
        forces.chain(others.map(|column| column.name.to_owned())).chain(moments).collect()
    }

    fn values(&self, system: &mut dyn System, at: StateAt<'_>) -> Result<Vec<f64>, ModelError> {
        let StateAt { t, y, .. } = at;
        let (dae, range) = muscle_of(system, y)?;
        let (u, v) = dae.nodal_motion(t, &y[range]);
        let (u, v) = (u.to_vec(), v.to_vec());
        let mut values = vec![0.0; self.dimension + 2];
        let mut force = vec![0.0; u.len()];
        let contacts = dae.muscle().contacts.iter();
        for contact in contacts.filter(|contact| contact.group() == self.group) {
            let sums = contact.sums(t, 1.0, &u);
            let friction = contact.friction_sums(t, [&u, &v]).force;
            let forces = sums.force.iter().zip(friction);
            for (value, (normal, friction)) in values[..self.dimension].iter_mut().zip(forces) {
                *value += normal - friction;
            }
            values[self.dimension] += contact.area(t, 1.0, &u);
            if self.arms.is_some() {
                contact.add_total_force(t, [&u, &v], &mut force);
            }
            let deepest = &mut values[self.dimension + 1];
            *deepest = deepest.max(sums.penetration);
        }
        if let Some(moving) = self.moving {
            // In the unloaded state of a loading path, an obstacle at rest has zero displacement.
            let contact = &dae.muscle().contacts[moving];
            values.push(contact.distance(t, 1.0, &u).unwrap_or(0.0));
        }
        if let Some(arms) = &self.arms {
            values.extend(arms.moment(0..u.len() / self.dimension, &u, &force));
        }
        Ok(values)
    }

    fn has_indicator(&self) -> bool {
        false
    }
}
