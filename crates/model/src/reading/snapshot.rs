//! A body at one time, of which quantities are read.

use myovib_fem::output::{Beside, PointState};
use myovib_fem::{Fields, Located, Pressure, Solid};

/// A body at one time.
///
/// # Shapes
/// `displacement`, `velocity`: all nodal components.
#[derive(Debug, Clone, Copy)]
pub struct Snapshot<'a> {
    /// The operators.
    pub solid: &'a Solid,
    /// Displacement, m.
    pub displacement: &'a [f64],
    /// Velocity, m/s.
    pub velocity: &'a [f64],
    /// Pressure, or κ in its place.
    pub pressure: Pressure<'a>,
    /// Factors of the law's energy, if it has any.
    pub factors: Option<&'a [f64]>,
    /// Its rate, where it is a field and β > 0.
    pub p_rate: Option<&'a [f64]>,
    /// What the stress depends on beside.
    pub beside: Beside<'a>,
}

impl<'a> Snapshot<'a> {
    /// Displacement, pressure and their rates for the operators of the solid.
    pub fn fields(&self) -> Fields<'a> {
        Fields {
            v: Some(self.velocity),
            p_rate: self.p_rate,
            factors: self.factors,
            ..Fields::new(self.displacement, self.pressure)
        }
    }

    /// A nodal field at a place.
    pub(super) fn vector_at(&self, field: &[f64], place: &Located) -> Vec<f64> {
        let space = self.solid.space();
        match space.dimension() {
            2 => space.displacement_at::<2>(field, place).to_vec(),
            _ => space.displacement_at::<3>(field, place).to_vec(),
        }
    }

    /// Strain at a place, and the stress of the law.
    pub(super) fn state_at(&self, place: &Located) -> PointState {
        self.solid.state_at(&self.fields(), place)
    }

    /// Strain and all stress at a place.
    pub(super) fn state_in_motion_at(&self, place: &Located) -> PointState {
        let fields = self.fields();
        self.solid.state_in_motion_at(&fields, &self.beside, place)
    }
}
