//! Map between all displacement components and the free components.

use crate::error::FemError;
use crate::space::Space;

/// Value in [`DofMap::full_to_free`] that marks a constrained component.
pub(crate) const CONSTRAINED: u32 = u32::MAX;

/// Free displacement components, in the same order as in the full nodal array.
///
/// # Shapes
/// A full array has [`n_full`](DofMap::n_full) entries, the components of all nodes (x0, y0, x1, …). A free array
/// has [`n_free`](DofMap::n_free) entries.
///
/// # Examples
/// ```
/// use myovib_fem::{dofs::DofMap, generate, space::Space};
/// let space = Space::taylor_hood(&generate::rectangle([0.0, 0.0], [1.0, 1.0], [1, 1])?);
/// let dofs = DofMap::clamped(&space, &space.nodes_of("left")?)?;
/// assert_eq!(dofs.n_free(), 2 * (9 - 3));
/// let mut full = vec![7.0; 18];
/// dofs.expand(&vec![1.0; 12], &mut full); // keeps the constrained entries
/// assert_eq!(full.iter().sum::<f64>(), 6.0 * 7.0 + 12.0);
/// # Ok::<(), myovib_fem::FemError>(())
/// ```
#[derive(Debug, Clone)]
pub struct DofMap {
    free_to_full: Vec<usize>,
    full_to_free: Vec<u32>,
}

impl DofMap {
    /// Creates a map in which all components are free except the listed pairs (node, component).
    ///
    /// # Errors
    /// Returns [`FemError::OutOfRange`] if a node or component does not exist.
    pub fn new(space: &Space, constrained: &[(usize, usize)]) -> Result<Self, FemError> {
        let dimension = space.dimension();
        let mut full_to_free = vec![0; space.n_components()];
        for &(node, component) in constrained {
            let indices = [("node", node, space.n_nodes()), ("component", component, dimension)];
            for (what, index, count) in indices {
                if index >= count {
                    return Err(FemError::OutOfRange { what, index, count });
                }
            }
            full_to_free[dimension * node + component] = CONSTRAINED;
        }
        let mut free_to_full = Vec::new();
        for (full, free) in full_to_free.iter_mut().enumerate() {
            if *free != CONSTRAINED {
                *free = u32::try_from(free_to_full.len()).expect("fewer than 2^32 unknowns");
                free_to_full.push(full);
            }
        }
        Ok(Self { free_to_full, full_to_free })
    }

    /// Creates a map in which all components of the listed nodes are constrained.
    ///
    /// # Errors
    /// Returns [`FemError::OutOfRange`] if a node does not exist.
    pub fn clamped(space: &Space, nodes: &[usize]) -> Result<Self, FemError> {
        let components = 0..space.dimension();
        let pairs: Vec<_> = nodes
            .iter()
            .flat_map(|&node| components.clone().map(move |component| (node, component)))
            .collect();
        Self::new(space, &pairs)
    }

    /// Returns the number of free components.
    pub fn n_free(&self) -> usize {
        self.free_to_full.len()
    }

    /// Returns the length of the full nodal array.
    pub fn n_full(&self) -> usize {
        self.full_to_free.len()
    }

    /// Returns the indices of the free components in the full array, in ascending order.
    pub fn free_to_full(&self) -> &[usize] {
        &self.free_to_full
    }

    /// Returns the index in the free array of each component of the full array, or [`CONSTRAINED`].
    pub(crate) fn full_to_free(&self) -> &[u32] {
        &self.full_to_free
    }

    /// Writes the free components into the full array and keeps its other entries.
    ///
    /// # Panics
    /// Panics if a length is wrong.
    pub fn expand(&self, free: &[f64], full: &mut [f64]) {
        assert_eq!((free.len(), full.len()), (self.n_free(), self.n_full()));
        for (&component, &value) in self.free_to_full.iter().zip(free) {
            full[component] = value;
        }
    }

    /// Copies the free components from the full array.
    ///
    /// # Panics
    /// Panics if a length is wrong.
    pub fn restrict(&self, full: &[f64], free: &mut [f64]) {
        assert_eq!((free.len(), full.len()), (self.n_free(), self.n_full()));
        for (&component, value) in self.free_to_full.iter().zip(free) {
            *value = full[component];
        }
    }
}
