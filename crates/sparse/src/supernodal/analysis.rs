//! Order of elimination, supernodes, and the place of each entry in its front.

use std::collections::BTreeSet;
use std::ops::Range;

use nalgebra_sparse::pattern::SparsityPattern;

/// A supernode is merged into its parent while the merged front has at most this part of zeros
/// that neither had: dense arithmetic on a few zeros is cheaper than another front. Measured on the
/// muscle: fastest between 0.1 and 0.2.
const ZEROS_ALLOWED: f64 = 0.15;

/// Columns eliminated together.
#[derive(Debug, Clone)]
pub(super) struct Supernode {
    /// The columns, in the order of elimination.
    pub(super) columns: Range<usize>,
    /// The rows below them, ascending.
    pub(super) rows: Vec<u32>,
    /// Entries of the matrix in its factors: (index among the values, place in the factors).
    pub(super) entries: Vec<(u32, u32)>,
    /// The supernodes whose first row is among the columns of this one.
    pub(super) children: Vec<Child>,
    /// Whether the number of supernodes above it is odd.
    pub(super) is_odd: bool,
}

/// Where the update of a supernode goes in that of its parent.
#[derive(Debug, Clone)]
pub(super) struct Child {
    /// The places of its rows among the columns and rows of the parent, ascending.
    pub(super) places: Vec<u32>,
    /// How many of these are columns.
    pub(super) n_columns: usize,
    /// The places that are columns, as few runs of neighbours.
    pub(super) column_runs: Vec<Run>,
    /// The places that are rows, likewise, counted from the first row of the parent.
    pub(super) row_runs: Vec<Run>,
}

/// Neighbours in a child's rows that are neighbours in its parent's, too.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    /// The first of them in the child.
    pub(super) from: usize,
    /// The first of them in the parent.
    pub(super) to: usize,
    pub(super) len: usize,
}

impl Child {
    /// `places` of which all below `k` are columns of the parent.
    fn new(places: Vec<u32>, k: usize) -> Self {
        let n_columns = places.partition_point(|&place| (place as usize) < k);
        Self {
            column_runs: runs(&places[..n_columns], 0, 0),
            row_runs: runs(&places[n_columns..], n_columns, k),
            places,
            n_columns,
        }
    }

    /// Entries of its update.
    pub(super) fn n_entries(&self) -> usize {
        self.places.len().pow(2)
    }
}

/// The runs in `places`, the first of which is number `first` of the child; places of the parent
/// count from `origin`.
fn runs(places: &[u32], first: usize, origin: usize) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (i, &place) in places.iter().enumerate() {
        let to = place as usize - origin;
        match runs.last_mut() {
            Some(run) if run.to + run.len == to => run.len += 1,
            _ => runs.push(Run {
                from: first + i,
                to,
                len: 1,
            }),
        }
    }
    runs
}

impl Supernode {
    /// Rows and columns of the front.
    pub(super) fn size(&self) -> usize {
        self.columns.len() + self.rows.len()
    }

    /// Entries of its columns of L and rows of U.
    pub(super) fn n_entries(&self) -> usize {
        self.columns.len() * (self.size() + self.rows.len())
    }

    /// Entries of the updates of all children.
    pub(super) fn n_child_entries(&self) -> usize {
        self.children.iter().map(Child::n_entries).sum()
    }
}

/// What is known of the factors from the pattern alone.
#[derive(Debug, Clone)]
pub struct Analysis {
    /// The original index at each place of the order.
    pub(super) order: Vec<usize>,
    /// Children before parents, each after the whole of its subtree.
    pub(super) supernodes: Vec<Supernode>,
}

impl Analysis {
    /// Analyses a compressed-column pattern, symmetrised, in the given order of elimination.
    /// Columns without a diagonal entry are put off until `n_before` of their neighbours are
    /// eliminated.
    ///
    /// # Panics
    /// If the pattern is not square or `order` is not a permutation.
    pub fn new(pattern: &SparsityPattern, order: &[usize], n_before: usize) -> Self {
        let order = put_off(pattern, order, n_before);
        let n = order.len();
        let mut place = vec![0; n];
        for (k, &column) in order.iter().enumerate() {
            place[column] = k;
        }
        let structure = fill(pattern, &place);
        // A postorder makes the columns of a supernode adjacent.
        let post = postorder(&parents(&structure));
        let order: Vec<usize> = post.iter().map(|&k| order[k]).collect();
        for (k, &column) in order.iter().enumerate() {
            place[column] = k;
        }
        let structure = fill(pattern, &place);
        let mut supernodes = partition(&structure);
        connect(&mut supernodes);
        enter(pattern, &place, &mut supernodes);
        Self { order, supernodes }
    }

    /// Order of the matrix.
    pub fn n(&self) -> usize {
        self.order.len()
    }

    /// Entries of L and U, zeros of the fronts included.
    pub fn n_entries(&self) -> usize {
        self.supernodes.iter().map(Supernode::n_entries).sum()
    }

    /// Columns of each supernode, and rows below them.
    pub fn supernodes(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let supernodes = self.supernodes.iter();
        supernodes.map(|node| (node.columns.len(), node.rows.len()))
    }

    /// Multiplications of one factorisation.
    pub fn n_multiplications(&self) -> usize {
        let of_node = |node: &Supernode| -> usize {
            let k = node.columns.len();
            (0..k).map(|p| (node.size() - p - 1).pow(2)).sum()
        };
        self.supernodes.iter().map(of_node).sum()
    }
}

/// Moves columns without a diagonal entry behind the `n_before`-th of their neighbours that have.
fn put_off(pattern: &SparsityPattern, order: &[usize], n_before: usize) -> Vec<usize> {
    let n = order.len();
    let lane = |column: usize| pattern.lane(column).iter().copied();
    let lacks: Vec<bool> = (0..n)
        .map(|column| pattern.lane(column).binary_search(&column).is_err())
        .collect();
    let mut waiting = vec![0usize; n];
    for column in (0..n).filter(|&column| lacks[column]) {
        waiting[column] = lane(column)
            .filter(|&row| !lacks[row])
            .count()
            .min(n_before);
    }
    let mut result = Vec::with_capacity(n);
    let mut due = vec![false; n];
    for &column in order {
        due[column] = true;
        if waiting[column] > 0 {
            continue;
        }
        result.push(column);
        if !lacks[column] {
            for row in lane(column).filter(|&row| lacks[row]) {
                if waiting[row] == 1 && due[row] {
                    result.push(row);
                }
                waiting[row] = waiting[row].saturating_sub(1);
            }
        }
    }
    result
}

/// The rows below the diagonal of each column of L.
fn fill(pattern: &SparsityPattern, place: &[usize]) -> Vec<Vec<u32>> {
    let n = place.len();
    let mut structure: Vec<BTreeSet<u32>> = vec![BTreeSet::new(); n];
    for (column, row) in pattern.entries().map(|(c, r)| (place[c], place[r])) {
        if row != column {
            structure[row.min(column)].insert(row.max(column) as u32);
        }
    }
    for k in 0..n {
        if let Some(&parent) = structure[k].first() {
            let rows: Vec<u32> = structure[k].iter().copied().skip(1).collect();
            structure[parent as usize].extend(rows);
        }
    }
    structure
        .into_iter()
        .map(|rows| rows.into_iter().collect())
        .collect()
}

fn parents(structure: &[Vec<u32>]) -> Vec<Option<usize>> {
    structure
        .iter()
        .map(|rows| rows.first().map(|&row| row as usize))
        .collect()
}

fn postorder(parents: &[Option<usize>]) -> Vec<usize> {
    let n = parents.len();
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); n];
    for (k, parent) in parents.iter().enumerate() {
        if let Some(parent) = parent {
            children[*parent].push(k);
        }
    }
    let mut order = Vec::with_capacity(n);
    let mut stack: Vec<(usize, bool)> = (0..n)
        .rev()
        .filter(|&k| parents[k].is_none())
        .map(|k| (k, false))
        .collect();
    while let Some((k, visited)) = stack.pop() {
        if visited {
            order.push(k);
        } else {
            stack.push((k, true));
            stack.extend(children[k].iter().rev().map(|&child| (child, false)));
        }
    }
    order
}

/// Supernodes from left to right: a column joins the one before it when that is its only child
/// worth the name, or when joining brings few zeros.
fn partition(structure: &[Vec<u32>]) -> Vec<Supernode> {
    let mut nodes: Vec<(Range<usize>, usize)> = Vec::new();
    // (columns, entries of L that are not zeros by pattern)
    for (k, rows) in structure.iter().enumerate() {
        let mut node = (k..k + 1, rows.len());
        while let Some((last, entries)) = nodes.last() {
            let is_child = structure[last.end - 1].first() == Some(&(node.0.start as u32));
            // The parent's rows contain the child's but for its own columns.
            let below = structure[node.0.end - 1].len();
            let width = node.0.end - last.start;
            let dense = width * below + width * (width - 1) / 2;
            let present = entries + node.1;
            if !is_child || (dense - present) as f64 > ZEROS_ALLOWED * dense as f64 {
                break;
            }
            node = (last.start..node.0.end, present);
            nodes.pop();
        }
        nodes.push(node);
    }
    nodes
        .into_iter()
        .map(|(columns, _)| Supernode {
            rows: structure[columns.end - 1].clone(),
            columns,
            entries: Vec::new(),
            children: Vec::new(),
            is_odd: false,
        })
        .collect()
}

/// The place of `index` among the columns and rows of a front.
fn local(node: &Supernode, index: usize) -> usize {
    if index < node.columns.end {
        index - node.columns.start
    } else {
        let below = node.rows.binary_search(&(index as u32));
        node.columns.len() + below.expect("a front has all rows of its columns")
    }
}

fn owners(supernodes: &[Supernode]) -> Vec<usize> {
    supernodes
        .iter()
        .enumerate()
        .flat_map(|(s, node)| node.columns.clone().map(move |_| s))
        .collect()
}

/// Hangs each supernode on its parent, and counts how deep it is.
fn connect(supernodes: &mut [Supernode]) {
    let owner = owners(supernodes);
    for s in (0..supernodes.len()).rev() {
        if let Some(&first) = supernodes[s].rows.first() {
            supernodes[s].is_odd = !supernodes[owner[first as usize]].is_odd;
        }
    }
    for s in 0..supernodes.len() {
        if let Some(&first) = supernodes[s].rows.first() {
            let parent = owner[first as usize];
            let rows = &supernodes[s].rows;
            let places = rows
                .iter()
                .map(|&row| local(&supernodes[parent], row as usize) as u32)
                .collect();
            let child = Child::new(places, supernodes[parent].columns.len());
            supernodes[parent].children.push(child);
        }
    }
}

fn enter(pattern: &SparsityPattern, place: &[usize], supernodes: &mut [Supernode]) {
    let owner = owners(supernodes);
    for (index, (column, row)) in pattern.entries().enumerate() {
        let (row, column) = (place[row], place[column]);
        let node = &mut supernodes[owner[row.min(column)]];
        let (row, column) = (local(node, row), local(node, column));
        let (m, k) = (node.size(), node.columns.len());
        let position = if column < k {
            column * m + row
        } else {
            m * k + row * node.rows.len() + (column - k)
        };
        node.entries.push((index as u32, position as u32));
    }
}
