//! Interaction list of a group of particles: nearby particles, and distant nodes as a whole; in packs of
//! eight.

use super::super::pair::{Block, FAR};
use super::octree::{Octree, SYMMETRIC};
use crate::lanes::WIDTH;

/// Eight particles.
#[derive(Clone, Copy)]
pub(super) struct ParticlePack<const D: usize> {
    pub(super) position: Block<D>,
    pub(super) mass: [f64; WIDTH],
    pub(super) direction: Block<D>,
}

/// Eight nodes, see [`Node`](super::octree::Node).
#[derive(Clone, Copy)]
pub(super) struct TreeCells<const D: usize> {
    pub(super) centre: Block<D>,
    pub(super) mass: [f64; WIDTH],
    pub(super) moment: [[f64; WIDTH]; SYMMETRIC],
    pub(super) direction: Block<D>,
}

impl<const D: usize> ParticlePack<D> {
    const NONE: Self = ParticlePack { position: [FAR; D], mass: [0.0; WIDTH], direction: [[0.0; WIDTH]; D] };
}

impl<const D: usize> TreeCells<D> {
    const NONE: Self = TreeCells {
        centre: [FAR; D],
        mass: [0.0; WIDTH],
        moment: [[0.0; WIDTH]; SYMMETRIC],
        direction: [[0.0; WIDTH]; D],
    };
}

/// Interaction list of one group.
#[derive(Default)]
pub(super) struct List<const D: usize> {
    /// Nearby particles, beginning with those of the group itself, in their order.
    pub(super) near: Vec<ParticlePack<D>>,
    near_count: usize,
    pub(super) far: Vec<TreeCells<D>>,
    far_count: usize,
}

impl<const D: usize> List<D> {
    /// Builds the list of the group that is node `group`, with directions if `directed`.
    pub(super) fn collect(&mut self, tree: &Octree<D>, group: usize, directed: bool) {
        self.near.clear();
        self.far.clear();
        (self.near_count, self.far_count) = (0, 0);
        let own = &tree.nodes[group];
        self.add_particles(tree, own.begin, own.end, directed);
        let mut i = 0;
        while i < tree.nodes.len() {
            let node = &tree.nodes[i];
            if i == group {
                i = node.next;
            } else if node.is_far_from(own) {
                self.add_cell(tree, i, directed);
                i = node.next;
            } else {
                if node.is_leaf(i) {
                    self.add_particles(tree, node.begin, node.end, directed);
                }
                i += 1;
            }
        }
    }

    /// Lists all particles as near: the direct sum.
    pub(super) fn collect_all(&mut self, tree: &Octree<D>) {
        self.near.clear();
        self.far.clear();
        (self.near_count, self.far_count) = (0, 0);
        self.add_particles(tree, 0, tree.order.len(), false);
    }

    fn add_particles(&mut self, tree: &Octree<D>, begin: usize, end: usize, directed: bool) {
        for j in begin..end {
            let lane = self.near_count % WIDTH;
            if lane == 0 {
                self.near.push(ParticlePack::NONE);
            }
            let pack = &mut self.near[self.near_count / WIDTH];
            pack.mass[lane] = tree.mass[j];
            for c in 0..D {
                pack.position[c][lane] = tree.position[j][c];
                if directed {
                    pack.direction[c][lane] = tree.direction[j][c];
                }
            }
            self.near_count += 1;
        }
    }

    fn add_cell(&mut self, tree: &Octree<D>, i: usize, directed: bool) {
        let lane = self.far_count % WIDTH;
        if lane == 0 {
            self.far.push(TreeCells::NONE);
        }
        let (pack, node) = (&mut self.far[self.far_count / WIDTH], &tree.nodes[i]);
        pack.mass[lane] = node.mass;
        for c in 0..D {
            pack.centre[c][lane] = node.centre[c];
            if directed {
                pack.direction[c][lane] = node.direction[c];
            }
        }
        for k in 0..SYMMETRIC {
            pack.moment[k][lane] = node.moment[k];
        }
        self.far_count += 1;
    }
}
