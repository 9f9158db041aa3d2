//! Order of elimination, supernodes, and the position of each matrix entry in its front.

use nalgebra_sparse::pattern::SparsityPattern;

use super::child::Child;
use super::partition::{Shape, partition};
use super::update::Layout;
use crate::ordering::{AdjacencyList, Graph, Tree, least_work};
use crate::{Kind, SparseError};

/// Supernode: columns eliminated together.
#[derive(Debug, Clone)]
pub(super) struct Supernode {
    /// Columns of the supernode, and the rows below them.
    pub(super) shape: Shape,
    /// Matrix entries in the factors of the supernode, as pairs (index in the values, position in the factors).
    pub(super) entries: Vec<(u32, u32)>,
    /// Supernodes whose first row is one of the columns of this supernode.
    pub(super) children: Vec<Child>,
    /// Whether the number of ancestors of the supernode is odd.
    pub(super) is_odd: bool,
    /// Start of the factors of the supernode.
    pub(super) start: usize,
}

impl Supernode {
    pub(super) fn n_columns(&self) -> usize {
        self.shape.columns.len()
    }

    /// Returns the number of rows below the columns.
    pub(super) fn n_rows(&self) -> usize {
        self.shape.rows.len()
    }

    /// Returns the order of the front.
    pub(super) fn size(&self) -> usize {
        self.n_columns() + self.n_rows()
    }

    /// Returns the storage layout of the update of the supernode.
    #[inline(always)]
    pub(super) fn layout(&self, kind: Kind) -> Layout {
        let r = self.n_rows();
        Layout { r, kind }
    }

    pub(super) fn n_entries(&self, kind: Kind) -> usize {
        let n_upper = match kind {
            Kind::General => self.n_rows(),
            Kind::Symmetric => 0,
        };
        self.n_columns() * (self.size() + n_upper)
    }

    pub(super) fn n_multiplications(&self, kind: Kind) -> f64 {
        let rows = (0..self.n_columns()).map(|p| (self.size() - p - 1) as f64);
        match kind {
            Kind::General => rows.map(|r| r * r).sum(),
            Kind::Symmetric => rows.map(|r| r * (r + 1.0) / 2.0).sum(),
        }
    }
}

/// Symbolic factorization, computed from the pattern alone.
#[derive(Debug, Clone)]
pub struct Analysis {
    pub(super) kind: Kind,
    /// Original index of each position in the order of elimination.
    pub(super) order: Vec<u32>,
    /// Supernodes. Children come before their parents, and each supernode directly follows its subtree.
    pub(super) supernodes: Vec<Supernode>,
}

impl Analysis {
    /// Analyzes a compressed-column pattern, which is symmetrized. Unknowns that have no diagonal entry or are listed
    /// in `constraints` are eliminated after the unknowns on which they act.
    ///
    /// # Errors
    /// Returns [`SparseError::NotSquare`], or [`SparseError::EmptyColumn`] if an unknown does not occur in any
    /// equation.
    ///
    /// # Panics
    /// Panics if the pattern has 2³² entries or more.
    pub fn new(
        pattern: &SparsityPattern,
        kind: Kind,
        constraints: std::ops::Range<usize>,
    ) -> Result<Self, SparseError> {
        let neighbors = Self::neighbors(pattern)?;
        let is_constraint: Vec<bool> = (0..pattern.major_dim())
            .map(|k| constraints.contains(&k) || pattern.lane(k).binary_search(&k).is_err())
            .collect();
        let graph = Graph::new(&neighbors, &is_constraint);
        Ok(Self::from_tree(pattern, kind, &graph, least_work(&graph)))
    }

    /// Analyzes `pattern` with the given order of elimination.
    ///
    /// # Errors
    /// Returns the same errors as [`new`](Self::new).
    ///
    /// # Panics
    /// Panics if `order` is not a permutation.
    #[cfg(test)]
    pub(crate) fn with_order(
        pattern: &SparsityPattern,
        kind: Kind,
        order: &[usize],
    ) -> Result<Self, SparseError> {
        let neighbors = Self::neighbors(pattern)?;
        let graph = Graph::uncompressed(neighbors);
        let tree = Tree::new(&graph, order.iter().map(|&k| k as u32).collect());
        Ok(Self::from_tree(pattern, kind, &graph, tree))
    }

    fn neighbors(pattern: &SparsityPattern) -> Result<AdjacencyList, SparseError> {
        let (columns, rows) = (pattern.major_dim(), pattern.minor_dim());
        if rows != columns || columns == 0 {
            return Err(SparseError::NotSquare { rows, columns });
        }
        match (0..columns).find(|&column| pattern.lane(column).is_empty()) {
            Some(column) => Err(SparseError::EmptyColumn { column }),
            None => Ok(AdjacencyList::symmetrized(pattern)),
        }
    }

    fn from_tree(pattern: &SparsityPattern, kind: Kind, graph: &Graph, tree: Tree) -> Self {
        let (order, shapes) = partition(graph, tree);
        let mut start = 0;
        let mut supernodes: Vec<Supernode> = shapes
            .into_iter()
            .map(|shape| {
                let node = Supernode {
                    shape,
                    entries: Vec::new(),
                    children: Vec::new(),
                    is_odd: false,
                    start,
                };
                start += node.n_entries(kind);
                node
            })
            .collect();
        connect(&mut supernodes);
        enter(pattern, kind, &order, &mut supernodes);
        Self { kind, order, supernodes }
    }

    /// Returns the order of the matrix.
    pub fn n(&self) -> usize {
        self.order.len()
    }

    /// Returns the number of entries of L and U, or of L and D, including explicit zeros.
    pub fn n_entries(&self) -> usize {
        self.supernodes.last().map_or(0, |node| node.start + node.n_entries(self.kind))
    }

    /// Returns the number of columns of each supernode, and the number of rows below them.
    pub fn supernodes(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let supernodes = self.supernodes.iter();
        supernodes.map(|node| (node.n_columns(), node.n_rows()))
    }

    pub(super) fn largest_front(&self) -> usize {
        self.supernodes.iter().map(Supernode::size).max().unwrap_or(0)
    }

    pub(crate) fn n_multiplications(&self) -> f64 {
        let nodes = self.supernodes.iter();
        nodes.map(|node| node.n_multiplications(self.kind)).sum()
    }

    /// Returns the size of the analysis in bytes: order, rows, and positions of entries and updates.
    pub fn n_bytes(&self) -> usize {
        let of_node = |node: &Supernode| {
            let children = node.children.iter();
            size_of::<Supernode>()
                + size_of_val(&node.shape.rows[..])
                + size_of_val(&node.entries[..])
                + children.map(|child| size_of::<Child>() + child.n_bytes()).sum::<usize>()
        };
        size_of_val(&self.order[..]) + self.supernodes.iter().map(of_node).sum::<usize>()
    }
}

/// Returns the position of `index` among the columns and rows of the front.
fn local(shape: &Shape, index: usize) -> usize {
    if index < shape.columns.end {
        index - shape.columns.start
    } else {
        let below = shape.rows.binary_search(&(index as u32));
        shape.columns.len() + below.expect("a front has all rows of its columns")
    }
}

/// Returns the supernode of each column.
fn owners(supernodes: &[Supernode]) -> Vec<u32> {
    let columns = |(node, s): (&Supernode, u32)| std::iter::repeat_n(s, node.n_columns());
    supernodes.iter().zip(0..).flat_map(columns).collect()
}

/// Connects each supernode to its parent and determines whether its depth is odd.
fn connect(supernodes: &mut [Supernode]) {
    let owner = owners(supernodes);
    let parent = |node: &Supernode| {
        let first = node.shape.rows.first();
        first.map(|&row| owner[row as usize] as usize)
    };
    for s in (0..supernodes.len()).rev() {
        if let Some(parent) = parent(&supernodes[s]) {
            supernodes[s].is_odd = !supernodes[parent].is_odd;
        }
    }
    for s in 0..supernodes.len() {
        if let Some(parent) = parent(&supernodes[s]) {
            let shape = &supernodes[parent].shape;
            let rows = supernodes[s].shape.rows.iter();
            let places = rows.map(|&row| local(shape, row as usize) as u32).collect();
            let child = Child::new(s as u32, places, shape.columns.len());
            supernodes[parent].children.push(child);
        }
    }
}

/// Computes the positions of the matrix entries in the factors. For a symmetric matrix, only entries on and below the
/// diagonal are used.
fn enter(pattern: &SparsityPattern, kind: Kind, order: &[u32], supernodes: &mut [Supernode]) {
    assert!(u32::try_from(pattern.nnz()).is_ok(), "fewer than 2^32 entries");
    let mut place = vec![0; order.len()];
    for (k, &original) in order.iter().enumerate() {
        place[original as usize] = k;
    }
    let owner = owners(supernodes);
    for (index, (column, row)) in pattern.entries().enumerate() {
        let (row, column) = (place[row], place[column]);
        if kind == Kind::Symmetric && row < column {
            continue;
        }
        let node = &mut supernodes[owner[row.min(column)] as usize];
        let (row, column) = (local(&node.shape, row), local(&node.shape, column));
        let (m, k) = (node.size(), node.n_columns());
        let position =
            if column < k { column * m + row } else { m * k + row * node.n_rows() + (column - k) };
        node.entries.push((index as u32, position as u32));
    }
}
