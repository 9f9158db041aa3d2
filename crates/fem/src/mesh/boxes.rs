//! A tree of boxes: which of many things come near a place.

use super::simplices::Point;

/// Things in one leaf.
const LEAF: usize = 8;

/// The smallest box around some points.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    low: Point,
    high: Point,
}

impl Extent {
    const NOTHING: Self = Self {
        low: [f64::INFINITY; 3],
        high: [f64::NEG_INFINITY; 3],
    };

    /// Around `points`, wider by `margin` on each side.
    pub(super) fn around(points: &[Point], margin: f64) -> Self {
        let mut extent = Self::NOTHING;
        for point in points {
            extent.include(&Self {
                low: point.map(|x| x - margin),
                high: point.map(|x| x + margin),
            });
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

    fn twice_centre(&self, axis: usize) -> f64 {
        self.low[axis] + self.high[axis]
    }
}

/// Boxes by halves of halves; built in O(n log n), whatever their sizes.
#[derive(Debug)]
pub(super) struct BoxTree {
    boxes: Vec<Extent>,
    /// The boxes in the order of the leaves.
    order: Vec<usize>,
    /// Around each node's boxes; the halves of node k are 2k + 1 and 2k + 2.
    nodes: Vec<Extent>,
}

impl BoxTree {
    pub(super) fn new(boxes: Vec<Extent>) -> Self {
        let mut tree = Self {
            order: (0..boxes.len()).collect(),
            nodes: Vec::new(),
            boxes,
        };
        let mut order = std::mem::take(&mut tree.order);
        tree.split(0, &mut order);
        tree.order = order;
        tree
    }

    fn split(&mut self, node: usize, members: &mut [usize]) {
        let mut extent = Extent::NOTHING;
        for &member in members.iter() {
            extent.include(&self.boxes[member]);
        }
        if self.nodes.len() <= node {
            self.nodes.resize(node + 1, Extent::NOTHING);
        }
        self.nodes[node] = extent;
        if members.len() <= LEAF {
            return;
        }
        let length = |axis: &usize| extent.high[*axis] - extent.low[*axis];
        let axis = (0..3)
            .max_by(|a, b| length(a).total_cmp(&length(b)))
            .expect("three axes");
        let half = members.len() / 2;
        let centre = |member: usize| self.boxes[member].twice_centre(axis);
        members.select_nth_unstable_by(half, |&a, &b| centre(a).total_cmp(&centre(b)));
        let (left, right) = members.split_at_mut(half);
        self.split(2 * node + 1, left);
        self.split(2 * node + 2, right);
    }

    /// The first of the things whose boxes meet `place` for which `found` has an answer.
    pub(super) fn find<T>(
        &self,
        place: &Extent,
        mut found: impl FnMut(usize) -> Option<T>,
    ) -> Option<T> {
        let mut waiting = vec![(0, 0..self.order.len())];
        while let Some((node, range)) = waiting.pop() {
            if !self.nodes[node].meets(place) {
                continue;
            }
            if range.len() <= LEAF {
                let near = self.order[range].iter();
                let mut near = near.filter(|&&member| self.boxes[member].meets(place));
                if let Some(answer) = near.find_map(|&member| found(member)) {
                    return Some(answer);
                }
            } else {
                let half = range.start + range.len() / 2;
                waiting.push((2 * node + 2, half..range.end));
                waiting.push((2 * node + 1, range.start..half));
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_boxes_that_meet_a_place_are_found_and_no_other() {
        // 300 points along a spiral: no order, no even spacing.
        let points: Vec<Point> = (0..300)
            .map(|i| f64::from(i) * 0.1)
            .map(|s| [s * s.cos(), s * s.sin(), s])
            .collect();
        let boxes: Vec<Extent> = points.iter().map(|p| Extent::around(&[*p], 1.0)).collect();
        let tree = BoxTree::new(boxes.clone());
        for place in &boxes {
            let mut found = Vec::new();
            assert!(
                tree.find(place, |member| {
                    found.push(member);
                    None::<()>
                })
                .is_none()
            );
            found.sort_unstable();
            let expected: Vec<usize> = (0..300).filter(|&i| boxes[i].meets(place)).collect();
            assert_eq!(found, expected);
        }
    }
}
