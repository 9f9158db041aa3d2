//! Pictures of a deformed body; all pictures of a motion have the same scale.

use myovib_fem::{Space, bounds};

use myovib_report::outline::outline;
use myovib_report::plot::{Axis, EdgeGroup, Field, MeshPlot};

/// Size at which the largest displacement is drawn, as a fraction of the body's height.
const REACH: f64 = 0.3;

/// Margin above and below the moving body, as a fraction of the body's height.
const MARGIN: f64 = 0.08;

/// Settings shared by all pictures of a motion.
pub(in crate::commands) struct Drawing<'a> {
    space: &'a Space,
    groups: Vec<EdgeGroup>,
    /// Largest displacement, m.
    pub(super) largest: f64,
    /// Scale factor of displacements.
    pub(super) scale: f64,
}

impl<'a> Drawing<'a> {
    /// Chooses the scale for all given nodal displacements. The edges in `groups` are highlighted.
    pub(in crate::commands) fn of<'s>(
        space: &'a Space,
        groups: Vec<EdgeGroup>,
        displacements: impl IntoIterator<Item = &'s [[f64; 2]]>,
    ) -> Self {
        let all = displacements.into_iter().flatten().map(norm);
        let largest = all.fold(0.0, f64::max);
        Self {
            space,
            groups,
            largest,
            scale: if largest > 0.0 {
                round_down(REACH * height(space) / largest)
            } else {
                // The run was interrupted while the body was at rest.
                1.0
            },
        }
    }

    /// Draws the body at time `t`, colored by a field.
    pub(in crate::commands) fn panel(&self, t: f64, u: &[[f64; 2]], field: Field) -> MeshPlot {
        let reach = self.scale * self.largest + MARGIN * height(self.space);
        let [bottom, top] = bounds(self.space.coordinates(), 2).map(|corner| corner[1]);
        let outline = outline(self.space);
        MeshPlot {
            title: format!("*t* = {t:.4} s"),
            y: outline.y.clone().between(bottom - reach, top + reach),
            groups: self.groups.clone(),
            displacement: u.to_vec(),
            scale: self.scale,
            field: Some(field),
            ..outline
        }
    }

    /// Returns the magnitude of the displacement as a field.
    pub(super) fn size(&self, u: &[[f64; 2]]) -> Field {
        Field {
            axis: Axis::new("|*u*|", "m").between(0.0, self.largest),
            values: u.iter().map(norm).collect(),
        }
    }
}

fn norm(u: &[f64; 2]) -> f64 {
    u[0].hypot(u[1])
}

fn height(space: &Space) -> f64 {
    let [bottom, top] = bounds(space.coordinates(), 2).map(|corner| corner[1]);
    top - bottom
}

/// Rounds down to 1, 2 or 5 times a power of ten.
fn round_down(value: f64) -> f64 {
    let power = 10_f64.powf(value.log10().floor());
    [5.0, 2.0, 1.0].map(|m| m * power).into_iter().find(|n| *n <= value).unwrap_or(power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_round() {
        assert_eq!([1.0, 1.99, 27.0, 0.6, 999.0].map(round_down), [1.0, 1.0, 20.0, 0.5, 500.0]);
    }
}
