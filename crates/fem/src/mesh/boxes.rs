//! Bounding-box tree that finds the items near a point.

use super::simplices::Point;

/// Number of items in a leaf.
const LEAF: usize = 8;

/// Returns the smallest and the largest coordinates of points in `dimension` dimensions.
pub fn bounds(coordinates: &[f64], dimension: usize) -> [Vec<f64>; 2] {
    let (mut low, mut high) = (vec![f64::INFINITY; dimension], vec![f64::NEG_INFINITY; dimension]);
    for (i, &x) in coordinates.iter().enumerate() {
        let axis = i % dimension;
        (low[axis], high[axis]) = (low[axis].min(x), high[axis].max(x));
    }
    [low, high]
}

/// Axis-aligned bounding box.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    low: Point,
    high: Point,
}

impl Extent {
    const EMPTY: Self = Self { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };

    /// Returns the bounding box of `points`, enlarged by `margin` on each side.
    pub(super) fn around(points: &[Point], margin: f64) -> Self {
        let mut extent = Self::EMPTY;
        for point in points {
            extent
                .include(&Self { low: point.map(|x| x - margin), high: point.map(|x| x + margin) });
        }
        extent
    }

    fn include(&mut self, other: &Self) {
        for axis in 0..3 {
            self.low[axis] = self.low[axis].min(other.low[axis]);
            self.high[axis] = self.high[axis].max(other.high[axis]);
        }
    }

    fn meets(&self, other: &Self) -> bool {
        (0..3).all(|axis| self.low[axis] <= other.high[axis] && other.low[axis] <= self.high[axis])
    }

    fn twice_center(&self, axis: usize) -> f64 {
        self.low[axis] + self.high[axis]
    }
}

/// Binary tree of boxes, which are split in halves. It is built in O(n log n) operations for boxes of any size.
#[derive(Debug)]
pub(super) struct BoxTree {
    boxes: Vec<Extent>,
    /// Box indices in the order in which the leaves hold them.
    order: Vec<usize>,
    /// Bounding box of each tree node. The children of node k are 2k + 1 and 2k + 2.
    nodes: Vec<Extent>,
}

impl BoxTree {
    pub(super) fn new(boxes: Vec<Extent>) -> Self {
        let mut tree = Self { order: (0..boxes.len()).collect(), nodes: Vec::new(), boxes };
        let mut order = std::mem::take(&mut tree.order);
        tree.split(0, &mut order);
        tree.order = order;
        tree
    }

    fn split(&mut self, node: usize, members: &mut [usize]) {
        let mut extent = Extent::EMPTY;
        for &member in members.iter() {
            extent.include(&self.boxes[member]);
        }
        if self.nodes.len() <= node {
            self.nodes.resize(node + 1, Extent::EMPTY);
        }
        self.nodes[node] = extent;
        if members.len() <= LEAF {
            return;
        }
        let length = |axis: &usize| extent.high[*axis] - extent.low[*axis];
        let axis = (0..3).max_by(|a, b| length(a).total_cmp(&length(b))).expect("three axes");
        let half = members.len() / 2;
        let center = |member: usize| self.boxes[member].twice_center(axis);
        members.select_nth_unstable_by(half, |&a, &b| center(a).total_cmp(&center(b)));
        let (left, right) = members.split_at_mut(half);
        self.split(2 * node + 1, left);
        self.split(2 * node + 2, right);
    }

    /// Calls `found` for the items whose boxes intersect `target`, and returns the first result other than `None`.
    pub(super) fn find<T>(
        &self,
        target: &Extent,
        mut found: impl FnMut(usize) -> Option<T>,
    ) -> Option<T> {
        let mut stack = vec![(0, 0..self.order.len())];
        while let Some((node, range)) = stack.pop() {
            if !self.nodes[node].meets(target) {
                continue;
            }
            if range.len() <= LEAF {
                let near = self.order[range].iter();
                let mut near = near.filter(|&&member| self.boxes[member].meets(target));
                if let Some(answer) = near.find_map(|&member| found(member)) {
                    return Some(answer);
                }
            } else {
                let half = range.start + range.len() / 2;
                stack.push((2 * node + 2, half..range.end));
                stack.push((2 * node + 1, range.start..half));
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn find_visits_exactly_the_intersecting_boxes() {
        // 300 points along a spiral, in no particular order and unevenly spaced.
        let points: Vec<Point> =
            (0..300).map(|i| f64::from(i) * 0.1).map(|s| [s * s.cos(), s * s.sin(), s]).collect();
        let boxes: Vec<Extent> = points.iter().map(|p| Extent::around(&[*p], 1.0)).collect();
        let tree = BoxTree::new(boxes.clone());
        for target in &boxes {
            let mut found = Vec::new();
            assert!(
                tree.find(target, |member| {
                    found.push(member);
                    None::<()>
                })
                .is_none()
            );
            found.sort_unstable();
            let expected: Vec<usize> = (0..300).filter(|&i| boxes[i].meets(target)).collect();
            assert_eq!(found, expected);
        }
    }
}
