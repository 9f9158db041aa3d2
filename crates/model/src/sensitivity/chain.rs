//! Dependence of a chain on a parameter.

use crate::coupling::Oscillators;

/// Dependence of a network of oscillators on one parameter. It is described by a stencil of perturbed networks, unless
/// the parameter is the initial position of the oscillators.
#[derive(Debug, Clone)]
pub struct ChainDependence {
    pub(super) network: usize,
    pub(super) own_weight: f64,
    pub(super) perturbed: Vec<(f64, Oscillators)>,
    /// Whether the parameter is the initial position of all oscillators.
    pub(super) is_start: bool,
}

impl ChainDependence {
    /// Creates the dependence of the network with index `network`. The derivative of a quantity is `own_weight` times
    /// the value for the network itself plus, for each pair in `perturbed`, the weight times the value for the
    /// perturbed network.
    pub fn new(network: usize, own_weight: f64, perturbed: Vec<(f64, Oscillators)>) -> Self {
        Self { network, own_weight, perturbed, is_start: false }
    }

    /// Creates the dependence of the network with index `network` on the common initial position of its oscillators.
    pub fn of_start(network: usize) -> Self {
        Self { is_start: true, ..Self::new(network, 0.0, Vec::new()) }
    }
}
