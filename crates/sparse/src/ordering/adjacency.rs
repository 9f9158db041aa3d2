//! Lists of indices stored in one array.

use nalgebra_sparse::pattern::SparsityPattern;

/// Lists of indices stored one after the other, for example the neighbors of each node of a graph.
#[derive(Debug, Clone)]
pub(crate) struct AdjacencyList {
    offsets: Vec<usize>,
    indices: Vec<u32>,
}

impl AdjacencyList {
    /// Creates an empty collection with capacity for `n` lists.
    pub(crate) fn with_capacity(n: usize) -> Self {
        let mut offsets = Vec::with_capacity(n + 1);
        offsets.push(0);
        let indices = Vec::new();
        Self { offsets, indices }
    }

    pub(crate) fn push(&mut self, lane: impl IntoIterator<Item = u32>) {
        self.indices.extend(lane);
        self.offsets.push(self.indices.len());
    }

    /// Groups (list, item) pairs into `n` lists. The iterator is traversed twice.
    pub(crate) fn group(n: usize, pairs: impl Iterator<Item = (usize, u32)> + Clone) -> Self {
        let mut offsets = vec![0; n + 1];
        for (list, _) in pairs.clone() {
            offsets[list + 1] += 1;
        }
        for k in 0..n {
            offsets[k + 1] += offsets[k];
        }
        let mut next = offsets.clone();
        let mut indices = vec![0; offsets[n]];
        for (list, item) in pairs {
            indices[next[list]] = item;
            next[list] += 1;
        }
        Self { offsets, indices }
    }

    /// Returns the pattern of A + Aᵀ without the diagonal. Each list is ascending.
    ///
    /// # Panics
    /// Panics if the pattern has 2³² rows or more.
    pub(crate) fn symmetrized(pattern: &SparsityPattern) -> Self {
        let n = pattern.major_dim();
        assert!(u32::try_from(n).is_ok(), "fewer than 2^32 rows");
        let transposed = Self::group(n, pattern.entries().map(|(c, r)| (r, c as u32)));
        let mut lanes = Self::with_capacity(n);
        lanes.indices.reserve(pattern.nnz());
        for column in 0..n {
            let own = pattern.lane(column).iter().map(|&row| row as u32);
            let merged = union(own, transposed.lane(column).iter().copied());
            lanes.push(merged.filter(|&row| row as usize != column));
        }
        lanes
    }

    /// Returns the number of lists.
    pub(crate) fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    pub(crate) fn lane(&self, k: usize) -> &[u32] {
        &self.indices[self.offsets[k]..self.offsets[k + 1]]
    }

    /// Returns the start of each list, followed by the end of the last list.
    pub(crate) fn offsets(&self) -> &[usize] {
        &self.offsets
    }

    /// Returns the items of all lists, one list after the other.
    pub(crate) fn indices(&self) -> &[u32] {
        &self.indices
    }
}

/// Merges two ascending sequences and removes duplicates.
fn union(a: impl Iterator<Item = u32>, b: impl Iterator<Item = u32>) -> impl Iterator<Item = u32> {
    let (mut a, mut b) = (a.peekable(), b.peekable());
    std::iter::from_fn(move || match (a.peek(), b.peek()) {
        (Some(x), Some(y)) if x == y => {
            b.next();
            a.next()
        }
        (Some(x), Some(y)) if x < y => a.next(),
        (Some(_), None) => a.next(),
        _ => b.next(),
    })
}
