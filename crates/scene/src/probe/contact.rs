//! Contact of a group with rigid obstacles.

use myovib_model::ModelError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::column::ColumnKind;
use super::kind::{Kind, Parts, Reading, StateAt, Systems, Wrong};
use crate::InputError;
use crate::system::{System, muscle_of};

/// Force of the obstacles on the body, N; undeformed area in contact, m²; largest penetration, m; displacement of the
/// first obstacle that moves, along its force or toward the body, m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Contact {
    /// Group of a `[[contact]]`.
    pub group: String,
}

/// Contact force, area in contact and penetration; the displacement of an obstacle that moves.
const COLUMNS: &[ColumnKind] = &[
    ColumnKind::new("F", ["N/m", "N"]),
    ColumnKind::new("area", ["m", "m²"]),
    ColumnKind::new("penetration", ["m"; 2]),
    ColumnKind::new("displacement", ["m"; 2]),
];

impl Kind for Contact {
    fn columns() -> &'static [ColumnKind] {
        COLUMNS
    }

    fn check_part(&self, parts: &Parts<'_>) -> Result<(), Wrong<InputError>> {
        match parts.contacts.contains(&&*self.group) {
            true => Ok(()),
            false => Err((
                ".group",
                InputError::new(format!("no [[contact]] has the group `{}`", self.group))
                    .allowed(parts.contacts.join(", ")),
            )),
        }
    }

    fn reading(&self, of: &Systems<'_>) -> Result<Box<dyn Reading>, ModelError> {
        let mut contacts = of.muscle.iter().flat_map(|muscle| &muscle.contacts);
        let moves =
            |contact: &myovib_model::Contact| contact.group() == self.group && contact.moves();
        Ok(Box::new(Sums {
            group: self.group.clone(),
            dimension: of.solid()?.space().dimension(),
            moving: contacts.position(moves),
        }))
    }
}

/// Sums over all contacts of a group.
struct Sums {
    group: String,
    dimension: usize,
    /// Index of the first contact whose obstacle moves.
    moving: Option<usize>,
}

impl Reading for Sums {
    fn names(&self) -> Vec<String> {
        let forces = COLUMNS[0].components(self.dimension);
        let others = COLUMNS[1..].iter().take(2 + usize::from(self.moving.is_some()));
        forces.chain(others.map(|column| column.name.to_owned())).collect()
    }

    fn values(&self, system: &mut dyn System, at: StateAt<'_>) -> Result<Vec<f64>, ModelError> {
        let StateAt { t, y, .. } = at;
        let (dae, range) = muscle_of(system, y)?;
        let (u, v) = dae.nodal_motion(t, &y[range]);
        let (u, v) = (u.to_vec(), v.to_vec());
        let mut values = vec![0.0; self.dimension + 2];
        let contacts = dae.muscle().contacts.iter();
        for contact in contacts.filter(|contact| contact.group() == self.group) {
            let sums = contact.sums(t, 1.0, &u);
            let friction = contact.friction_sums(t, [&u, &v]).force;
            let forces = sums.force.iter().zip(friction);
            for (value, (normal, friction)) in values[..self.dimension].iter_mut().zip(forces) {
                *value += normal - friction;
            }
            values[self.dimension] += sums.area;
            let deepest = &mut values[self.dimension + 1];
            *deepest = deepest.max(sums.penetration);
        }
        if let Some(moving) = self.moving {
            // An obstacle at rest in the unloaded state of a loading path has the displacement 0.
            let contact = &dae.muscle().contacts[moving];
            values.push(contact.distance(t, 1.0, &u).unwrap_or(0.0));
        }
        Ok(values)
    }

    fn has_indicator(&self) -> bool {
        false
    }
}
