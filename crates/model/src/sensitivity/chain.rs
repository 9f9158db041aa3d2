//! How a chain depends on a parameter.

use crate::coupling::Oscillators;

/// How a network of oscillators depends on one parameter: a stencil of networks that differ in it, or its start.
#[derive(Debug, Clone)]
pub struct ChainDependence {
    pub(super) network: usize,
    pub(super) own_weight: f64,
    pub(super) twins: Vec<(f64, Oscillators)>,
    /// Whether it is the position of all oscillators at the start.
    pub(super) is_start: bool,
}

impl ChainDependence {
    /// On a parameter that network number `network` has a derivative by: `own_weight` times what the network itself
    /// gives, and of each twin its weight times what it gives.
    pub fn new(network: usize, own_weight: f64, twins: Vec<(f64, Oscillators)>) -> Self {
        Self {
            network,
            own_weight,
            twins,
            is_start: false,
        }
    }

    /// On the position of all its oscillators at the start.
    pub fn of_start(network: usize) -> Self {
        Self {
            is_start: true,
            ..Self::new(network, 0.0, Vec::new())
        }
    }
}
