//! State of a body at one point in time, from which quantities are computed.

use myovib_fem::output::{PointState, StressContext};
use myovib_fem::{ElementPoint, Fields, Pressure, Solid};

/// State of a body at one point in time.
///
/// # Shapes
/// `displacement`, `velocity`, `acceleration`: all nodal components.
#[derive(Debug, Clone, Copy)]
pub struct Snapshot<'a> {
    /// Operators of the body.
    pub solid: &'a Solid,
    /// Displacement, m.
    pub displacement: &'a [f64],
    /// Velocity, m/s.
    pub velocity: &'a [f64],
    /// Acceleration, m/s²; zero for a body at rest.
    pub acceleration: &'a [f64],
    /// Pressure, or κ for a formulation without pressure.
    pub pressure: Pressure<'a>,
    /// Factors of the law's energy, if any.
    pub factors: Option<&'a [f64]>,
    /// Pressure rate, Pa/s; required for the damping stress if the pressure is an unknown.
    pub p_rate: Option<&'a [f64]>,
    /// Tensions, damping and internal stresses, on which the stress also depends.
    pub stress_context: StressContext<'a>,
}

impl<'a> Snapshot<'a> {
    /// Returns the displacement, the pressure and their rates as arguments of the solid's operators.
    pub fn fields(&self) -> Fields<'a> {
        Fields {
            v: Some(self.velocity),
            p_rate: self.p_rate,
            factors: self.factors,
            ..Fields::new(self.displacement, self.pressure)
        }
    }

    /// Interpolates a nodal field at a point.
    pub(super) fn vector_at(&self, field: &[f64], place: &ElementPoint) -> Vec<f64> {
        let space = self.solid.space();
        match space.dimension() {
            2 => space.displacement_at::<2>(field, place).to_vec(),
            _ => space.displacement_at::<3>(field, place).to_vec(),
        }
    }

    /// Returns strain and stress at a point, by the material law.
    pub(super) fn state_at(&self, place: &ElementPoint) -> PointState {
        self.solid.state_at(&self.fields(), place)
    }

    /// Returns the strain and the total stress at a point.
    pub(super) fn dynamic_state_at(&self, place: &ElementPoint) -> PointState {
        let fields = self.fields();
        self.solid.dynamic_state_at(&fields, &self.stress_context, place)
    }
}
