//! Octree of particles with the mass moments of its nodes, ordered along a space-filling curve.

/// Maximum number of particles in a leaf, unless they are all at one position.
const LEAF: usize = 16;
/// Maximum number of particles that share an interaction list.
pub(super) const GROUP: usize = 48;

/// Number of independent components of a symmetric matrix in 3D; 2D uses the first three.
pub(super) const SYMMETRIC: usize = 6;

/// Returns the index of the component in row `a` and column `b`.
#[inline(always)]
pub(super) const fn symmetric_index(a: usize, b: usize) -> usize {
    // 00 01 11 02 12 22: those of 2D come first.
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    high * (high + 1) / 2 + low
}

/// A node: a box and the moments of its particles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node<const D: usize> {
    /// Range of the node's particles, in the order of the tree.
    pub(super) begin: usize,
    pub(super) end: usize,
    /// Index of the node after this one and all its descendants, which follow it.
    pub(super) next: usize,
    pub(super) mass: f64,
    /// Centre of mass.
    pub(super) centre: [f64; D],
    /// `sum_j m_j d d^T` with `d` from the centre of mass.
    pub(super) moment: [f64; SYMMETRIC],
    /// Mass-weighted mean of the directions, for products with the Hessian.
    pub(super) direction: [f64; D],
    /// Smallest box around the particles.
    low: [f64; D],
    high: [f64; D],
    /// Squared distance from the centre of mass beyond which the node acts as a whole.
    reach2: f64,
}

impl<const D: usize> Node<D> {
    pub(super) fn is_leaf(&self, index: usize) -> bool {
        self.next == index + 1
    }

    /// True if all particles of `group` are far enough away for this node to act as a whole. False if a
    /// coordinate is NaN.
    pub(super) fn is_far_from(&self, group: &Self) -> bool {
        let mut distance2 = 0.0;
        for c in 0..D {
            let outside = (group.low[c] - self.centre[c]).max(self.centre[c] - group.high[c]).max(0.0);
            distance2 += outside * outside;
        }
        distance2 > self.reach2
    }
}

/// Octree of particles in depth-first order.
#[derive(Default)]
pub(super) struct Octree<const D: usize> {
    /// Particle at each position of the order.
    pub(super) order: Vec<u32>,
    /// Positions, masses and directions in the order of the tree.
    pub(super) position: Vec<[f64; D]>,
    pub(super) mass: Vec<f64>,
    pub(super) direction: Vec<[f64; D]>,
    /// Nodes in depth-first order, the root first.
    pub(super) nodes: Vec<Node<D>>,
    /// Nodes of at most `GROUP` particles (more only at one position) that together contain all particles, in
    /// order.
    pub(super) groups: Vec<usize>,
    keys: Vec<(u64, u32)>,
}

/// Returns the smallest box around `points`.
fn bounds<const D: usize>(points: impl Iterator<Item = [f64; D]>) -> ([f64; D], [f64; D]) {
    let (mut low, mut high) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    for p in points {
        for c in 0..D {
            low[c] = low[c].min(p[c]);
            high[c] = high[c].max(p[c]);
        }
    }
    (low, high)
}

fn longest_edge<const D: usize>(low: &[f64; D], high: &[f64; D]) -> f64 {
    (0..D).map(|c| high[c] - low[c]).fold(0.0, f64::max)
}

impl<const D: usize> Octree<D> {
    /// Bits of a key for each component.
    const LEVELS: u32 = 63 / D as u32;

    /// Builds the tree of particles at `position` of masses `mass`. A node of longest edge `s`, whose
    /// centre of mass is `a` from its middle, acts as a whole from the distance `s / opening_angle + a`
    /// on (Barnes, in: Greengard et al., eds., 1994). The result does not depend on the previous tree.
    pub(super) fn build(&mut self, position: &[[f64; D]], mass: &[f64], opening_angle: f64) {
        // The order of the last step is nearly sorted, and is sorted faster.
        if self.keys.len() != position.len() {
            self.keys = (0..position.len() as u32).map(|i| (0, i)).collect();
        }
        self.nodes.clear();
        self.split_box(position, 0, position.len());
        self.order.clear();
        self.order.extend(self.keys.iter().map(|(_, i)| *i));
        self.position.clear();
        self.position.extend(self.order.iter().map(|&i| position[i as usize]));
        self.mass.clear();
        self.mass.extend(self.order.iter().map(|&i| mass[i as usize]));
        for i in (0..self.nodes.len()).rev() {
            self.measure(i, opening_angle);
        }
        self.groups.clear();
        let mut i = 0;
        while i < self.nodes.len() {
            let node = &self.nodes[i];
            let whole = node.is_leaf(i) || node.end - node.begin <= GROUP;
            if whole {
                self.groups.push(i);
            }
            i = if whole { node.next } else { i + 1 };
        }
    }

    /// Sorts the particles `begin..end` along the curve through the smallest box around them, and creates
    /// their nodes.
    fn split_box(&mut self, position: &[[f64; D]], begin: usize, end: usize) {
        let keys = &mut self.keys[begin..end];
        let (low, high) = bounds(keys.iter().map(|(_, i)| position[*i as usize]));
        let size = longest_edge(&low, &high);
        let cells = (1u64 << Self::LEVELS) as f64;
        let scale = if size > 0.0 && size.is_finite() { cells / size } else { 0.0 };
        for (key, i) in keys.iter_mut() {
            *key = 0;
            for c in 0..D {
                // A conversion to an integer saturates, and takes NaN to zero.
                let cell = ((position[*i as usize][c] - low[c]) * scale).min(cells - 1.0) as u64;
                for bit in 0..Self::LEVELS {
                    *key |= (cell >> bit & 1) << (bit as usize * D + c);
                }
            }
        }
        // Equal keys are sorted by index, so that the order is unique.
        keys.sort_unstable();
        self.split_key(position, begin, end, Self::LEVELS);
    }

    /// Creates the nodes of the particles `begin..end`, whose keys agree above the lowest `levels` digits.
    fn split_key(&mut self, position: &[[f64; D]], begin: usize, end: usize, levels: u32) {
        let mut levels = levels;
        let keys = &self.keys[begin..end];
        let (first, last) = (keys.first().map_or(0, |k| k.0), keys.last().map_or(0, |k| k.0));
        // A box that contains a single smaller box gets no node.
        let digit = |key: u64, levels: u32| key >> ((levels - 1) as usize * D);
        while levels > 0 && digit(first, levels) == digit(last, levels) {
            levels -= 1;
        }
        let crowded = end - begin > LEAF;
        if crowded && levels == 0 {
            // Outliers have made the finest cells too coarse: subdivide this cell, unless all particles
            // are at one position.
            let (low, high) = bounds(self.keys[begin..end].iter().map(|(_, i)| position[*i as usize]));
            let size = longest_edge(&low, &high);
            if size > 0.0 && size.is_finite() {
                return self.split_box(position, begin, end);
            }
        }
        let index = self.nodes.len();
        self.nodes.push(Node {
            begin,
            end,
            next: 0,
            mass: 0.0,
            centre: [0.0; D],
            moment: [0.0; SYMMETRIC],
            direction: [0.0; D],
            low: [0.0; D],
            high: [0.0; D],
            reach2: 0.0,
        });
        if crowded && levels > 0 {
            let mut from = begin;
            while from < end {
                let child = digit(self.keys[from].0, levels);
                let to = from + self.keys[from..end].partition_point(|k| digit(k.0, levels) == child);
                self.split_key(position, from, to, levels - 1);
                from = to;
            }
        }
        self.nodes[index].next = self.nodes.len();
    }

    /// Returns the indices of the children of node `i`.
    fn children(&self, i: usize) -> impl Iterator<Item = usize> {
        let end = self.nodes[i].next;
        std::iter::successors(Some(i + 1), |c| self.nodes.get(*c).map(|n| n.next))
            .take_while(move |c| *c < end)
    }

    /// Computes box and moments of node `i`, from its particles or its children.
    fn measure(&mut self, i: usize, opening_angle: f64) {
        let mut node = self.nodes[i];
        let leaf = node.is_leaf(i);
        // Box around the particles.
        (node.low, node.high) = if leaf {
            bounds(self.position[node.begin..node.end].iter().copied())
        } else {
            bounds(self.children(i).flat_map(|c| [self.nodes[c].low, self.nodes[c].high]))
        };
        // Mass and centre of mass.
        let mut weighted = [0.0; D];
        let mut weigh = |mass: f64, place: &[f64; D]| {
            node.mass += mass;
            for c in 0..D {
                weighted[c] += mass * place[c];
            }
        };
        if leaf {
            (node.begin..node.end).for_each(|j| weigh(self.mass[j], &self.position[j]));
        } else {
            self.children(i).for_each(|c| weigh(self.nodes[c].mass, &self.nodes[c].centre));
        }
        node.centre = weighted.map(|w| w / node.mass);
        // Second moments about the centre of mass; those of children are moved there (parallel axes).
        let (centre, moment) = (node.centre, &mut node.moment);
        let mut add = |mass: f64, place: &[f64; D]| {
            for a in 0..D {
                for b in 0..=a {
                    let product = (place[a] - centre[a]) * (place[b] - centre[b]);
                    moment[symmetric_index(a, b)] += mass * product;
                }
            }
        };
        if leaf {
            (node.begin..node.end).for_each(|j| add(self.mass[j], &self.position[j]));
        } else {
            for c in self.children(i) {
                add(self.nodes[c].mass, &self.nodes[c].centre);
            }
            for c in self.children(i) {
                for k in 0..SYMMETRIC {
                    node.moment[k] += self.nodes[c].moment[k];
                }
            }
        }
        // Distance beyond which the node acts as a whole, see `build`.
        let mut off2 = 0.0;
        for c in 0..D {
            let off = node.centre[c] - 0.5 * (node.low[c] + node.high[c]);
            off2 += off * off;
        }
        let reach = longest_edge(&node.low, &node.high) / opening_angle + f64::sqrt(off2);
        node.reach2 = reach * reach;
        self.nodes[i] = node;
    }

    /// Sets the directions of the particles, by index, and their means over the nodes.
    pub(super) fn set_direction(&mut self, direction: &[[f64; D]]) {
        self.direction.clear();
        self.direction.extend(self.order.iter().map(|&i| direction[i as usize]));
        for i in (0..self.nodes.len()).rev() {
            let node = self.nodes[i];
            let mut sum = [0.0; D];
            let mut add = |mass: f64, direction: &[f64; D]| {
                for c in 0..D {
                    sum[c] += mass * direction[c];
                }
            };
            if node.is_leaf(i) {
                (node.begin..node.end).for_each(|j| add(self.mass[j], &self.direction[j]));
            } else {
                self.children(i).for_each(|c| add(self.nodes[c].mass, &self.nodes[c].direction));
            }
            self.nodes[i].direction = sum.map(|s| s / node.mass);
        }
    }
}
