//! Values along a line.

use myovib_fem::Solid;
use myovib_model::{Measurement, ModelError, Probe, Quantity};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kind::{InvalidPlace, Kind, Reading, Wrong, at};
use super::places::{Places, displacement_and_pressure};
use crate::Scene;

/// Values at equidistant points of a line, numbered from 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Line {
    /// First point, m.
    #[schemars(length(min = 2, max = 3))]
    pub from: Vec<f64>,
    /// Last point, m.
    #[schemars(length(min = 2, max = 3))]
    pub to: Vec<f64>,
    /// Number of points.
    #[schemars(range(min = 2, max = 1000))]
    pub points: usize,
    /// Quantities to write.
    #[serde(default = "displacement_and_pressure")]
    #[schemars(length(min = 1), extend("uniqueItems" = true))]
    pub quantities: Vec<Quantity>,
}

impl Kind for Line {
    fn check_place(&self, solid: &Solid) -> Result<(), Wrong<InvalidPlace>> {
        at(".from", Probe::at(solid.space(), &self.from))?;
        at(".to", Probe::at(solid.space(), &self.to)).map(drop)
    }

    fn reading(&self, of: &Scene) -> Result<Box<dyn Reading>, ModelError> {
        let space = of.expect_body()?.muscle.solid.space();
        let place = |i: usize| -> Vec<f64> {
            let s = i as f64 / (self.points - 1) as f64;
            let ends = self.from.iter().zip(&self.to);
            ends.map(|(a, b)| (1.0 - s) * a + s * b).collect()
        };
        let measure = |i| Measurement::at(space, place(i), &self.quantities);
        let measurements = (0..self.points).map(measure);
        Ok(Box::new(Places(measurements.collect::<Result<_, _>>()?)))
    }
}
