//! Bounding volume hierarchy: an eight-wide tree of boxes over primitives in Morton order.
//!
//! The tree is implicit: node `i` of a level holds the boxes of nodes `8 i .. 8 i + 8` of the level
//! below, at the bottom those of as many primitives. It depends on positions only, not on the number of
//! threads.

use std::ops::Range;

use pliant::lanes::{Kernel, Lanes, WIDTH, dispatch};
use rayon::prelude::*;

/// Children of a node: one pack.
const WIDE: usize = WIDTH;

/// Tree cost relative to its cost after the last sort above which the tree is sorted again.
const OUT_OF_DATE: f64 = 1.5;

/// Number of levels of a tree of `u32::MAX` primitives.
const MAX_LEVELS: usize = 11;

/// Axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds<const D: usize> {
    /// Least coordinates [m].
    pub low: [f64; D],
    /// Largest coordinates [m].
    pub high: [f64; D],
}

impl<const D: usize> Bounds<D> {
    /// Empty box.
    pub const EMPTY: Self = Bounds { low: [f64::INFINITY; D], high: [f64::NEG_INFINITY; D] };

    /// Bounding box of the vertices at `x`, flat `(n, D)`, and, if they move, of their end positions:
    /// displacement `dx` minus a common `shift`.
    #[inline]
    pub fn of_vertices(vertices: &[u32], x: &[f64], way: Option<(&[f64], &[f64; D])>) -> Self {
        let mut bounds = Self::EMPTY;
        for &v in vertices {
            let at = v as usize * D;
            for k in 0..D {
                let from = x[at + k];
                let to = way.map_or(from, |(dx, shift)| from + (dx[at + k] - shift[k]));
                bounds.low[k] = bounds.low[k].min(from.min(to));
                bounds.high[k] = bounds.high[k].max(from.max(to));
            }
        }
        bounds
    }

    /// Box grown by `distance` on every side.
    #[inline]
    pub fn grown(mut self, distance: f64) -> Self {
        for k in 0..D {
            self.low[k] -= distance;
            self.high[k] += distance;
        }
        self
    }

    /// True if the boxes have a point in common.
    #[inline]
    pub fn meets(&self, other: &Self) -> bool {
        (0..D).all(|k| self.low[k] <= other.high[k] && other.low[k] <= self.high[k])
    }

    /// Distance between the boxes [m]; zero if they intersect, infinite if one is empty.
    pub(crate) fn distance(&self, other: &Self) -> f64 {
        self.squared_distance(other).sqrt()
    }

    /// Squared distance between the boxes [m^2].
    #[inline]
    pub(crate) fn squared_distance(&self, other: &Self) -> f64 {
        let along = |k: usize| (other.low[k] - self.high[k]).max(self.low[k] - other.high[k]).max(0.0);
        (0..D).map(|k| along(k) * along(k)).sum::<f64>()
    }

    /// Grows the box to contain the other.
    pub(crate) fn include(&mut self, other: &Self) {
        for k in 0..D {
            self.low[k] = self.low[k].min(other.low[k]);
            self.high[k] = self.high[k].max(other.high[k]);
        }
    }
}

/// Boxes of eight children, stored by coordinate.
#[derive(Clone, Copy, Debug)]
struct BoundsNode<const D: usize> {
    low: [[f64; WIDE]; D],
    high: [[f64; WIDE]; D],
}

impl<const D: usize> BoundsNode<D> {
    const EMPTY: Self = BoundsNode { low: [[f64::INFINITY; WIDE]; D], high: [[f64::NEG_INFINITY; WIDE]; D] };

    fn set(&mut self, child: usize, bounds: &Bounds<D>) {
        for k in 0..D {
            self.low[k][child] = bounds.low[k];
            self.high[k][child] = bounds.high[k];
        }
    }

    #[inline(always)]
    fn bounds(&self) -> Bounds<D> {
        let mut all = Bounds::EMPTY;
        for child in 0..WIDE {
            for k in 0..D {
                all.low[k] = all.low[k].min(self.low[k][child]);
                all.high[k] = all.high[k].max(self.high[k][child]);
            }
        }
        all
    }

    /// Node with all boxes grown by `distance` on every side.
    #[inline(always)]
    fn grown(mut self, distance: f64) -> Self {
        for k in 0..D {
            for child in 0..WIDE {
                self.low[k][child] -= distance;
                self.high[k][child] += distance;
            }
        }
        self
    }

    #[inline(always)]
    fn child(&self, child: usize) -> Bounds<D> {
        let mut bounds = Bounds::EMPTY;
        for k in 0..D {
            (bounds.low[k], bounds.high[k]) = (self.low[k][child], self.high[k][child]);
        }
        bounds
    }

    /// Bit mask of the children whose boxes intersect the other box.
    #[inline(always)]
    fn meets<L: Lanes>(&self, other: &Bounds<D>) -> u8 {
        let mut apart = 0;
        for k in 0..D {
            apart |= L::mask_to_bits(L::splat(other.high[k]).lt(L::load(&self.low[k])));
            apart |= L::mask_to_bits(L::load(&self.high[k]).lt(L::splat(other.low[k])));
        }
        !apart
    }
}

/// Tree of axis-aligned boxes.
#[derive(Clone, Debug, Default)]
pub struct BoundsTree<const D: usize> {
    /// Primitives in Morton order.
    order: Vec<u32>,
    /// Levels from the bottom up; the top one has one node.
    levels: Vec<Vec<BoundsNode<D>>>,
    /// [`cost`](Self::cost) after the last sort.
    first_cost: f64,
}

impl<const D: usize> BoundsTree<D> {
    /// Sorts these boxes and builds their tree.
    pub fn new(bounds: &[Bounds<D>]) -> Self {
        let mut tree = BoundsTree { order: morton_order(bounds), levels: vec![], first_cost: 0.0 };
        tree.refit(bounds);
        tree.first_cost = tree.cost();
        tree
    }

    /// Updates the tree to these boxes; sorts again if their number has changed or the order is out of
    /// date.
    pub fn follow(&mut self, bounds: &[Bounds<D>]) {
        if self.order.len() == bounds.len() {
            self.refit(bounds);
        }
        if self.order.len() != bounds.len() || self.cost() > OUT_OF_DATE * self.first_cost {
            *self = Self::new(bounds);
        }
    }

    /// Updates the boxes and keeps the order.
    ///
    /// # Panics
    /// If there are fewer boxes than at construction.
    pub fn refit(&mut self, bounds: &[Bounds<D>]) {
        self.levels.clear();
        let mut children: Vec<Bounds<D>> = self.order.iter().map(|&i| bounds[i as usize]).collect();
        loop {
            let nodes: Vec<BoundsNode<D>> = children.chunks(WIDE).map(node).collect();
            children = nodes.iter().map(BoundsNode::bounds).collect();
            self.levels.push(nodes);
            if children.len() <= 1 {
                return;
            }
        }
    }

    /// Sum of the boxes' half perimeters (in 3D half surfaces) over all nodes; grows as the order goes
    /// out of date.
    pub fn cost(&self) -> f64 {
        self.levels.iter().flatten().map(|node| spread(&node.bounds())).sum()
    }

    /// Number of primitives.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// True if there are no primitives.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// Appends the primitives whose boxes intersect `query` to `found`, in ascending order.
    pub fn find(&self, query: &Bounds<D>, found: &mut Vec<u32>) {
        let first = found.len();
        dispatch(Find { tree: self, query, found });
        found[first..].sort_unstable();
    }

    /// Visits the pairs of a primitive of this tree and one of `other` whose boxes come within `reach`
    /// [m].
    ///
    /// Only primitives at `places` of this tree's order are taken, a range that begins at a multiple of
    /// eight. Pairs come in the order of the trees. If both are the same tree, each pair is visited once
    /// and no primitive is paired with itself.
    pub fn join(&self, places: Range<usize>, reach: f64, other: &Self, visit: impl FnMut(u32, u32)) {
        debug_assert_eq!(places.start % WIDE, 0, "begins within a node");
        let nodes = places.start / WIDE..places.end.div_ceil(WIDE);
        dispatch(Join { queries: self, nodes, reach, tree: other, visit });
    }

    /// Box of node `i` of a level.
    #[inline(always)]
    fn bounds_of(&self, level: usize, i: usize) -> Bounds<D> {
        match self.levels.get(level + 1) {
            Some(parents) => parents[i / WIDE].child(i % WIDE),
            None => self.levels[level][i].bounds(),
        }
    }

    #[inline(always)]
    fn find_one<L: Lanes>(&self, query: &Bounds<D>, found: &mut Vec<u32>) {
        let mut stack = [(0usize, 0usize); MAX_LEVELS * WIDE];
        let mut depth = 1;
        stack[0] = (self.levels.len() - 1, 0);
        while depth > 0 {
            depth -= 1;
            let (level, i) = stack[depth];
            let Some(node) = self.levels[level].get(i) else { continue };
            let mut bits = node.meets::<L>(query);
            while bits != 0 {
                let child = WIDE * i + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                if level == 0 {
                    found.push(self.order[child]);
                } else {
                    stack[depth] = (level - 1, child);
                    depth += 1;
                }
            }
        }
    }
}

/// Query of a tree.
struct Find<'a, const D: usize> {
    tree: &'a BoundsTree<D>,
    query: &'a Bounds<D>,
    found: &'a mut Vec<u32>,
}

impl<const D: usize> Kernel for Find<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.tree.find_one::<L>(self.query, self.found);
    }
}

/// Join of two trees: eight primitives of one descend the other together.
struct Join<'a, V, const D: usize> {
    queries: &'a BoundsTree<D>,
    nodes: Range<usize>,
    reach: f64,
    tree: &'a BoundsTree<D>,
    visit: V,
}

impl<V: FnMut(u32, u32), const D: usize> Kernel for Join<'_, V, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        for i in self.nodes.clone() {
            self.descend::<L>(i);
        }
    }
}

impl<V: FnMut(u32, u32), const D: usize> Join<'_, V, D> {
    /// Pairs of the primitives of bottom node `i`; within one tree only with those that follow them.
    #[inline(always)]
    fn descend<L: Lanes>(&mut self, i: usize) {
        let tree = self.tree;
        let is_one = std::ptr::eq(self.queries, tree);
        let Some(node) = self.queries.levels[0].get(i) else { return };
        let grown = node.grown(self.reach);
        let around = grown.bounds();
        let mut stack = [(0usize, 0usize); MAX_LEVELS * WIDE];
        let mut depth = 1;
        stack[0] = (tree.levels.len() - 1, 0);
        while depth > 0 {
            depth -= 1;
            let (level, j) = stack[depth];
            if level == 0 {
                self.leaves::<L>(&grown, i, j, is_one);
                continue;
            }
            let Some(other) = tree.levels[level].get(j) else { continue };
            let mut bits = other.meets::<L>(&around);
            while bits != 0 {
                let child = WIDE * j + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                // One past the last node at the bottom that is below the child.
                let end = (child + 1) << (WIDE.trailing_zeros() as usize * (level - 1));
                if !is_one || end > i {
                    stack[depth] = (level - 1, child);
                    depth += 1;
                }
            }
        }
    }

    /// Pairs of two bottom nodes, the boxes of the first grown by the reach.
    #[inline(always)]
    fn leaves<L: Lanes>(&mut self, grown: &BoundsNode<D>, i: usize, j: usize, is_one: bool) {
        let Some(other) = self.tree.levels[0].get(j) else { return };
        let mut rows = grown.meets::<L>(&self.tree.bounds_of(0, j));
        while rows != 0 {
            let row = rows.trailing_zeros() as usize;
            rows &= rows - 1;
            let mut bits = other.meets::<L>(&grown.child(row));
            if is_one && i == j {
                bits &= !(u8::MAX >> (WIDE - 1 - row));
            }
            while bits != 0 {
                let column = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                (self.visit)(self.queries.order[WIDE * i + row], self.tree.order[WIDE * j + column]);
            }
        }
    }
}

fn node<const D: usize>(children: &[Bounds<D>]) -> BoundsNode<D> {
    let mut node = BoundsNode::EMPTY;
    for (child, bounds) in children.iter().enumerate() {
        node.set(child, bounds);
    }
    node
}

/// Half perimeter of a box in 2D, half its surface in 3D.
fn spread<const D: usize>(bounds: &Bounds<D>) -> f64 {
    let side = |k: usize| (bounds.high[k] - bounds.low[k]).max(0.0);
    if D == 2 { side(0) + side(1) } else { side(0) * side(1) + side(1) * side(2) + side(2) * side(0) }
}

/// Primitives sorted by the Morton code of their boxes' centres; equal codes by index.
fn morton_order<const D: usize>(bounds: &[Bounds<D>]) -> Vec<u32> {
    let mut all = Bounds::EMPTY;
    bounds.iter().for_each(|bounds| all.include(bounds));
    let mut keyed: Vec<(u64, u32)> =
        bounds.par_iter().zip(0..bounds.len() as u32).map(|(bounds, i)| (morton(bounds, &all), i)).collect();
    keyed.par_sort_unstable();
    keyed.into_iter().map(|(_, i)| i).collect()
}

/// Morton code of a box's centre within `all`: `64 / D` bits of each coordinate, interleaved.
fn morton<const D: usize>(bounds: &Bounds<D>, all: &Bounds<D>) -> u64 {
    let bits = 64 / D as u32;
    let extent = (0..D).fold(0.0f64, |extent, k| extent.max(all.high[k] - all.low[k]));
    let scale = if extent > 0.0 { ((1u64 << bits) - 1) as f64 / extent } else { 0.0 };
    let cell: [u64; D] = std::array::from_fn(|k| {
        let middle = 0.5 * (bounds.low[k] + bounds.high[k]);
        // The cast saturates: a NaN coordinate lies in cell 0.
        ((middle - all.low[k]) * scale) as u64
    });
    let mut code = 0;
    for bit in (0..bits).rev() {
        for component in cell {
            code = code << 1 | (component >> bit & 1);
        }
    }
    code
}

#[cfg(test)]
mod tests {
    use super::*;

    fn around<const D: usize>(middle: [f64; D], half: f64) -> Bounds<D> {
        Bounds { low: middle.map(|c| c - half), high: middle.map(|c| c + half) }
    }

    /// Vertices of a wire at 1 and 3 move by 5 and -1, minus the common motion.
    #[test]
    fn boxes_of_ways_are_without_the_common_motion() {
        let (x, dx) = ([1.0, 0.0, 3.0, 2.0], [5.0, -4.0, -1.0, 2.0]);
        let still = Bounds::<2>::of_vertices(&[0, 1], &x, None);
        assert_eq!(still, Bounds { low: [1.0, 0.0], high: [3.0, 2.0] });
        let whole = Bounds::<2>::of_vertices(&[0, 1], &x, Some((&dx, &[0.0; 2])));
        assert_eq!(whole, Bounds { low: [1.0, -4.0], high: [6.0, 4.0] });
        let apart = Bounds::<2>::of_vertices(&[0, 1], &x, Some((&dx, &[2.0, -1.0])));
        assert_eq!(apart, Bounds { low: [0.0, -3.0], high: [4.0, 5.0] });
    }

    /// A drifting lattice keeps its order, a shuffled one is sorted again.
    #[test]
    fn trees_are_ordered_anew_where_their_order_is_out_of_date() {
        let lattice: Vec<_> =
            (0..4096).map(|i| around([f64::from(i / 64), f64::from(i % 64)], 0.1)).collect();
        let mut tree = BoundsTree::new(&lattice);
        let first = tree.order.clone();
        let drifted: Vec<_> = lattice.iter().map(|b| around([b.low[0] + 3.1, 1.2 * b.low[1]], 0.1)).collect();
        tree.follow(&drifted);
        assert_eq!(tree.order, first);
        let shuffled: Vec<_> = (0..4096usize).map(|i| lattice[i * 1021 % 4096]).collect();
        tree.follow(&shuffled);
        assert_ne!(tree.order, first);
        assert_eq!(tree.order, BoundsTree::new(&shuffled).order);
        tree.follow(&shuffled[..100]);
        assert_eq!(tree.len(), 100);
    }

    /// All lattice boxes that intersect a query are appended to `found`.
    #[test]
    fn primitives_that_meet_a_query_are_found_ascending() {
        let at = |i: u32| around([f64::from(i / 40), f64::from(i % 40)], 0.4);
        let bounds: Vec<_> = (0..1600).map(at).collect();
        let tree = BoundsTree::new(&bounds);
        for (middle, half) in
            [([7.3, 12.0], 2.2), ([39.0, 39.0], 0.1), ([-3.0, 5.0], 1.0), ([20.0, 20.0], 99.0)]
        {
            let query = around(middle, half);
            let mut found = vec![9999];
            tree.find(&query, &mut found);
            let expected = (0..1600).filter(|i| bounds[*i as usize].meets(&query));
            assert_eq!(found, std::iter::once(9999).chain(expected).collect::<Vec<_>>(), "{middle:?}");
        }
        assert!(!tree.is_empty() && BoundsTree::<2>::new(&[]).is_empty());
    }

    #[test]
    fn spread_is_half_of_what_surrounds_a_box() {
        let flat = Bounds { low: [1.0, -2.0], high: [4.0, 3.0] };
        assert_eq!(spread(&flat), 3.0 + 5.0);
        let solid = Bounds { low: [1.0, -2.0, 0.5], high: [4.0, 3.0, 7.5] };
        assert_eq!(spread(&solid), 15.0 + 35.0 + 21.0);
        assert_eq!(spread(&Bounds::<3>::EMPTY), 0.0);
    }

    /// Cells 0 and 1 of each axis, `x` before `y` before `z` in every triple of bits.
    #[test]
    fn corners_of_a_cube_are_in_the_order_of_their_bits() {
        let all = Bounds { low: [2.0; 3], high: [3.0; 3] };
        let corner = |i: u32| {
            let bit = |k: u32| 2.0 + f64::from(i >> (2 - k) & 1);
            morton(&around([bit(0), bit(1), bit(2)], 0.25), &all)
        };
        // 21 bits of each coordinate: the first cell has none of them set, the last all.
        assert_eq!((corner(0), corner(7)), (0, (1 << 63) - 1));
        assert!((0..7).all(|i| corner(i) < corner(i + 1)));
        assert_eq!(corner(4) | corner(2) | corner(1), corner(7));
        let quarter = morton(&around([2.25, 2.0, 2.0], 0.125), &all);
        assert!(0 < quarter && quarter < corner(4), "{quarter:x}");
    }

    #[test]
    fn a_place_without_extent_has_one_code() {
        let all = Bounds { low: [1.0; 2], high: [1.0; 2] };
        assert_eq!(morton(&all, &all), 0);
    }

    /// Z-order: the quarters of a square one after the other; equal codes by index.
    #[test]
    fn a_lattice_is_gone_through_quarter_by_quarter() {
        let at = |x: u32, y: u32| around([f64::from(x), f64::from(y)], 0.1);
        let bounds: Vec<_> = (0..16).map(|i| at(i / 4, i % 4)).chain([at(0, 0)]).collect();
        let order = morton_order(&bounds);
        assert_eq!(order[..3], [0, 16, 1]);
        let quarter = |i: &u32| (i / 8, i % 4 / 2);
        let quarters: Vec<_> = order[1..].iter().filter(|i| **i < 16).map(quarter).collect();
        assert!(quarters.windows(2).filter(|pair| pair[0] != pair[1]).count() <= 3, "{order:?}");
    }
}
