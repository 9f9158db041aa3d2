//! Displacement at a point of a body as a function of the vector of unknowns.

use crate::signal::Signal;

/// `u(ξ, t) = Σ w_i y_i + Σ w_k s_k(t)`: a linear combination of a few unknowns and prescribed displacements.
#[derive(Debug, Clone, Default)]
pub struct Displacement {
    /// Unknowns (index in y) with their weights.
    pub unknowns: Vec<(usize, f64)>,
    /// Prescribed displacements with their weights.
    pub prescribed: Vec<(Signal, f64)>,
}

impl Displacement {
    /// Creates a displacement that depends only on unknowns.
    pub(crate) fn of_unknowns(unknowns: Vec<(usize, f64)>) -> Self {
        Self { unknowns, prescribed: Vec::new() }
    }

    /// Returns the value at time `t` for the unknowns `y`.
    pub fn at(&self, t: f64, y: &[f64]) -> f64 {
        self.of(y) + self.prescribed_at(t)
    }

    /// Returns the part that depends on the unknowns.
    pub fn of(&self, y: &[f64]) -> f64 {
        self.unknowns.iter().map(|&(i, w)| w * y[i]).sum()
    }

    pub(crate) fn prescribed_at(&self, t: f64) -> f64 {
        let parts = self.prescribed.iter();
        parts.map(|(signal, w)| w * signal.at(t).value).sum()
    }
}
