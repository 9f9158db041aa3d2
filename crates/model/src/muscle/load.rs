//! Loads and prescribed displacements of the muscle.

use myovib_fem::{FemError, FollowerPressure, Solid};

use crate::signal::Signal;

/// A force on the nodes: a constant vector times a function of time.
#[derive(Debug, Clone)]
pub struct Load {
    entries: Vec<(usize, f64)>,
    signal: Signal,
}

impl Load {
    /// Creates a load `vector · signal(t)`.
    ///
    /// # Shapes
    /// `vector`: all nodal components.
    pub fn new(vector: &[f64], signal: Signal) -> Self {
        let entries = vector
            .iter()
            .copied()
            .enumerate()
            .filter(|(_, value)| *value != 0.0)
            .collect();
        Self { entries, signal }
    }

    /// Returns the function of time.
    pub fn signal(&self) -> &Signal {
        &self.signal
    }

    /// Returns the load scaled by `part`.
    #[must_use]
    pub fn scaled(&self, part: f64) -> Self {
        Self {
            entries: self.entries.clone(),
            signal: self.signal.scaled(part),
        }
    }

    /// Returns the sum of the magnitudes of its nodal forces where the function of time is 1, N.
    pub(crate) fn magnitude(&self) -> f64 {
        self.entries.iter().map(|(_, value)| value.abs()).sum()
    }

    /// Adds the load at time `t` to `total`.
    pub fn add_at(&self, t: f64, total: &mut [f64]) {
        let factor = self.signal.at(t).value;
        for &(i, value) in &self.entries {
            total[i] += factor * value;
        }
    }
}

/// A pressure on the deformed boundary that follows a function of time.
#[derive(Debug, Clone)]
pub struct PressureLoad {
    operator: FollowerPressure,
    signal: Signal,
}

impl PressureLoad {
    /// Creates the pressure `signal` (Pa) on a group of the boundary, positive toward the body.
    ///
    /// # Errors
    /// [`FemError`] for a group that contains no parts of the boundary.
    pub fn new(solid: &Solid, group: &str, signal: Signal) -> Result<Self, FemError> {
        let operator = FollowerPressure::new(solid, group)?;
        Ok(Self { operator, signal })
    }

    /// Returns the function of time.
    pub fn signal(&self) -> &Signal {
        &self.signal
    }

    /// Returns the pressure scaled by `part`.
    #[must_use]
    pub fn scaled(&self, part: f64) -> Self {
        Self {
            operator: self.operator.clone(),
            signal: self.signal.scaled(part),
        }
    }

    /// Returns the sum of the magnitudes of the nodal forces of 1 Pa on the undeformed body with `n` nodal components, N.
    pub(crate) fn magnitude(&self, n: usize) -> f64 {
        let mut force = vec![0.0; n];
        self.operator.add_force(1.0, &vec![0.0; n], &mut force);
        force.iter().map(|f| f.abs()).sum()
    }

    /// Adds `factor` times the load at time `t` and the displacement `u` of all nodes to `total`.
    pub fn add_at(&self, t: f64, factor: f64, u: &[f64], total: &mut [f64]) {
        let pressure = factor * self.signal.at(t).value;
        self.operator.add_force(pressure, u, total);
    }

    /// Adds `factor` times the derivative of the load with respect to the free components of u, at
    /// `u`, to `values`.
    pub(crate) fn add_stiffness_at(&self, t: f64, factor: f64, u: &[f64], values: &mut [f64]) {
        let pressure = factor * self.signal.at(t).value;
        self.operator.add_stiffness(pressure, u, values);
    }
}

/// A displacement component that follows a function of time instead of an equation of motion.
#[derive(Debug, Clone)]
pub struct Prescribed {
    /// Index of the component in a nodal array.
    pub component: usize,
    /// Its displacement, m; its derivatives are the prescribed velocity and acceleration.
    pub signal: Signal,
}
