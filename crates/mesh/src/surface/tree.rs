//! Bounding box tree: queries for overlaps with a box, and for the nearest item to a point.

use std::ops::Range;

/// Maximum number of items in a leaf.
const LEAF: usize = 4;

/// Lower and upper corner of a box [m].
pub(super) type BoxCorners = [[f64; 3]; 2];

/// Binary tree of boxes, split at the median of the items' centres along the longest side.
pub(super) struct BoxTree {
    nodes: Vec<TreeNode>,
    items: Vec<u32>,
}

/// A box and its items. The children of an inner node are at `first` and `first + 1`.
struct TreeNode {
    bounds: BoxCorners,
    first: u32,
    /// Number of items of a leaf; 0 in inner nodes.
    count: u32,
}

/// Bounding box of points.
pub(super) fn around(points: impl IntoIterator<Item = [f64; 3]>) -> BoxCorners {
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for point in points {
        for c in 0..3 {
            bounds[0][c] = bounds[0][c].min(point[c]);
            bounds[1][c] = bounds[1][c].max(point[c]);
        }
    }
    bounds
}

/// Squared distance of a point from a box [m^2]; 0 inside.
pub(super) fn squared_distance(point: &[f64; 3], bounds: &BoxCorners) -> f64 {
    (0..3).fold(0.0, |sum, c| {
        let outside = (bounds[0][c] - point[c]).max(point[c] - bounds[1][c]).max(0.0);
        sum + outside * outside
    })
}

fn overlap(a: &BoxCorners, b: &BoxCorners) -> bool {
    (0..3).all(|c| a[0][c] <= b[1][c] && b[0][c] <= a[1][c])
}

impl BoxTree {
    /// Builds the tree over these boxes.
    pub(super) fn new(boxes: &[BoxCorners]) -> BoxTree {
        let mut tree = BoxTree { nodes: vec![], items: (0..boxes.len() as u32).collect() };
        tree.nodes.push(TreeNode { bounds: around([]), first: 0, count: 0 });
        let mut open = vec![(0, 0..boxes.len())];
        while let Some((node, range)) = open.pop() {
            open.extend(tree.split(node, range, boxes).into_iter().flatten());
        }
        tree
    }

    /// Fills in a node; returns its children, if any.
    fn split(
        &mut self,
        node: usize,
        range: Range<usize>,
        boxes: &[BoxCorners],
    ) -> Option<[(usize, Range<usize>); 2]> {
        let items = &mut self.items[range.clone()];
        let bounds = around(items.iter().flat_map(|i| boxes[*i as usize]));
        if items.len() <= LEAF {
            self.nodes[node] = TreeNode { bounds, first: range.start as u32, count: items.len() as u32 };
            return None;
        }
        let side = |c: usize| bounds[1][c] - bounds[0][c];
        let axis = (1..3).fold(0, |longest, c| if side(c) > side(longest) { c } else { longest });
        let middle = |i: &u32| boxes[*i as usize][0][axis] + boxes[*i as usize][1][axis];
        let half = items.len() / 2;
        items.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)).then(a.cmp(b)));
        let first = self.nodes.len();
        self.nodes[node] = TreeNode { bounds, first: first as u32, count: 0 };
        self.nodes.extend((0..2).map(|_| TreeNode { bounds: around([]), first: 0, count: 0 }));
        let cut = range.start + half;
        Some([(first, range.start..cut), (first + 1, cut..range.end)])
    }

    /// Bounding box of all items.
    pub(super) fn bounds(&self) -> BoxCorners {
        self.nodes[0].bounds
    }

    /// Calls `visit` with every item whose box may overlap this one.
    pub(super) fn overlapping(&self, bounds: &BoxCorners, mut visit: impl FnMut(u32)) {
        let mut open = vec![0];
        while let Some(node) = open.pop() {
            let TreeNode { bounds: own, first, count } = &self.nodes[node];
            if !overlap(own, bounds) {
                continue;
            }
            if *count > 0 {
                self.items[*first as usize..(first + count) as usize].iter().for_each(|item| visit(*item));
            } else if self.nodes.len() > 1 {
                open.extend([*first as usize, *first as usize + 1]);
            }
        }
    }

    /// Item nearest to a point by its squared `distance`, the first of equal ones, with that distance;
    /// `None` without items. The distance of an item must not be less than that of its box.
    pub(super) fn nearest(&self, point: &[f64; 3], distance: impl Fn(u32) -> f64) -> Option<(u32, f64)> {
        let mut best: Option<(u32, f64)> = None;
        let mut open = vec![(0, 0.0)];
        while let Some((node, least)) = open.pop() {
            if best.is_some_and(|(_, found)| least > found) {
                continue;
            }
            let TreeNode { first, count, .. } = self.nodes[node];
            if count > 0 {
                for &item in &self.items[first as usize..(first + count) as usize] {
                    let own = distance(item);
                    if best.is_none_or(|(other, found)| own < found || (own == found && item < other)) {
                        best = Some((item, own));
                    }
                }
            } else if self.nodes.len() > 1 {
                let child = |i: u32| (i as usize, squared_distance(point, &self.nodes[i as usize].bounds));
                let (a, b) = (child(first), child(first + 1));
                // The nearer child is visited first.
                open.extend(if a.1 <= b.1 { [b, a] } else { [a, b] });
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudo-random points.
    fn points(count: usize) -> Vec<[f64; 3]> {
        let mut state = 7u64;
        let mut number = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        (0..count).map(|_| [number(), number(), number()]).collect()
    }

    #[test]
    fn answers_are_those_of_looking_at_every_item() {
        for count in [1, 4, 5, 300] {
            let items = points(count);
            let boxes: Vec<BoxCorners> = items.iter().map(|x| [*x, x.map(|c| c + 0.01)]).collect();
            let tree = BoxTree::new(&boxes);
            for point in points(50) {
                let distance = |i: u32| squared_distance(&point, &boxes[i as usize]);
                let all = (0..count as u32).min_by(|a, b| distance(*a).total_cmp(&distance(*b))).unwrap();
                assert_eq!(tree.nearest(&point, distance), Some((all, distance(all))));
                let asked = [point, point.map(|c| c + 0.2)];
                let mut found = vec![];
                tree.overlapping(&asked, |i| found.push(i));
                found.sort_unstable();
                let expected: Vec<u32> =
                    (0..count as u32).filter(|i| overlap(&boxes[*i as usize], &asked)).collect();
                assert!(expected.iter().all(|i| found.binary_search(i).is_ok()));
                assert!(found.len() <= expected.len() + LEAF * count.div_ceil(LEAF) / 2 + LEAF);
            }
        }
    }

    #[test]
    fn an_empty_tree_has_no_answers() {
        let tree = BoxTree::new(&[]);
        assert_eq!(tree.nearest(&[0.0; 3], |_| 0.0), None);
        tree.overlapping(&[[0.0; 3], [1.0; 3]], |_| panic!("an item of nothing"));
    }
}
