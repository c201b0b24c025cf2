//! Deformation of a node by its elements: one deformation gradient, the mean of theirs.
//!
//! With the shape functions `N_b` of the linear elements `e` around node `a`, `w_e = V_e / (D + 1)` and `V_a
//! = sum_e w_e`,
//!
//! ```text
//! F_a = sum_e w_e F_e / V_a = sum_b x_b c_ab^T / V_a,   c_ab = sum_e w_e grad N_b
//! ```
//!
//! with `b` running over `a` and its neighbours. Where `E = sum_a V_a psi(F_a)`, the gradient at vertex `a`
//! is `sum_b P(F_b) c_ba`. `sum_b c_ab = 0`, so that differences of positions are enough.

use std::ops::Range;

use crate::algebra::Mat;
use crate::element::quadrature_points;
use crate::energy::elastic::block::Block;
use crate::energy::elastic::points_of;
use crate::lanes::{Kernel, Lanes, WIDTH};

/// A neighbour `b` of a node `a`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Neighbour<const D: usize> {
    /// Its number among the nodes.
    pub(super) node: u32,
    /// Its vertex in the system.
    pub(super) vertex: u32,
    /// `c_ab` [m^(D - 1)]: what its position does to `F_a`.
    pub(super) toward: [f64; D],
    /// `c_ba`: what the position of `a` does to `F_b`.
    pub(super) from: [f64; D],
}

/// The nodes of a body with their neighbours.
#[derive(Debug)]
pub(super) struct NodeRings<const D: usize> {
    /// Vertices in the system, ascending.
    pub(super) vertices: Vec<u32>,
    /// `V_a` [m^D].
    pub(super) volume: Vec<f64>,
    /// `c_aa`.
    pub(super) own: Vec<[f64; D]>,
    /// Neighbours of node `i` are `neighbours[start[i]..start[i + 1]]`, by their numbers.
    start: Vec<u32>,
    neighbours: Vec<Neighbour<D>>,
}

impl<const D: usize> NodeRings<D> {
    /// Of the linear elements `elements` (vertices of the system) at rest at `rest`, flat [m].
    pub(super) fn new<const N: usize>(elements: &[[u32; N]], rest: &[f64]) -> Self {
        let mut vertices = elements.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let mut number = vec![u32::MAX; rest.len() / D];
        for (node, v) in vertices.iter().enumerate() {
            number[*v as usize] = node as u32;
        }
        // The elements around every node.
        let mut first = vec![0u32; vertices.len() + 1];
        elements.as_flattened().iter().for_each(|v| first[number[*v as usize] as usize + 1] += 1);
        (1..first.len()).for_each(|i| first[i] += first[i - 1]);
        let (mut next, mut around) = (first.clone(), vec![0u32; N * elements.len()]);
        for (e, element) in elements.iter().enumerate() {
            for v in element {
                let next = &mut next[number[*v as usize] as usize];
                around[*next as usize] = e as u32;
                *next += 1;
            }
        }
        let mut rings = NodeRings {
            volume: vec![0.0; vertices.len()],
            own: vec![[0.0; D]; vertices.len()],
            start: vec![0],
            neighbours: vec![],
            vertices,
        };
        for a in 0..rings.vertices.len() {
            rings.push(a, &around[first[a] as usize..first[a + 1] as usize], elements, &number, rest);
        }
        rings.neighbours.shrink_to_fit();
        rings
    }

    /// Adds what node `a` has of the elements `around` it.
    fn push<const N: usize>(
        &mut self,
        a: usize,
        around: &[u32],
        elements: &[[u32; N]],
        number: &[u32],
        rest: &[f64],
    ) {
        let vertex = self.vertices[a];
        let mut others: Vec<u32> = around.iter().flat_map(|e| elements[*e as usize]).collect();
        others.sort_unstable();
        others.dedup();
        let begin = self.neighbours.len();
        self.neighbours.extend(others.into_iter().filter(|v| *v != vertex).map(|vertex| Neighbour {
            node: number[vertex as usize],
            vertex,
            toward: [0.0; D],
            from: [0.0; D],
        }));
        let ring = &mut self.neighbours[begin..];
        for e in around {
            let element = &elements[*e as usize];
            for point in quadrature_points(&points_of::<D, N>(rest, element)) {
                let share = point.weight / (D + 1) as f64;
                let gradient = |i: usize| point.gradients[i].map(|g| share * g);
                let Some(here) = element.iter().position(|v| *v == vertex) else { continue };
                let of_node = gradient(here);
                self.volume[a] += share;
                add(&mut self.own[a], &of_node);
                for (i, v) in element.iter().enumerate() {
                    if let Ok(at) = ring.binary_search_by_key(v, |neighbour| neighbour.vertex) {
                        add(&mut ring[at].toward, &gradient(i));
                        add(&mut ring[at].from, &of_node);
                    }
                }
            }
        }
        self.start.push(self.neighbours.len() as u32);
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.vertices.len()
    }

    /// The neighbours of a node.
    #[inline(always)]
    pub(super) fn ring(&self, node: usize) -> &[Neighbour<D>] {
        &self.neighbours[self.start[node] as usize..self.start[node + 1] as usize]
    }

    /// `F_a` of a node from positions, or its change from a direction.
    #[inline(always)]
    pub(super) fn deformation_gradient(&self, node: usize, x: &[[f64; D]]) -> Mat<f64, D> {
        let origin = &x[self.vertices[node] as usize];
        let mut f = [[0.0; D]; D];
        for Neighbour { vertex, toward, .. } in self.ring(node) {
            let at = &x[*vertex as usize];
            for i in 0..D {
                let difference = at[i] - origin[i];
                for j in 0..D {
                    f[i][j] += difference * toward[j];
                }
            }
        }
        Mat(f).scale(1.0 / self.volume[node])
    }

    /// The gradient at a node from the stresses at all.
    #[inline(always)]
    fn gradient(&self, node: usize, stress: &[Mat<f64, D>]) -> [f64; D] {
        let mut sum = times(&stress[node], &self.own[node]);
        for Neighbour { node, from, .. } in self.ring(node) {
            add(&mut sum, &times(&stress[*node as usize], from));
        }
        sum
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.neighbours[..]) + self.count() * (size_of::<u32>() * 2 + size_of::<f64>() * (D + 1))
    }
}

#[inline(always)]
fn add<const D: usize>(sum: &mut [f64; D], more: &[f64; D]) {
    for i in 0..D {
        sum[i] += more[i];
    }
}

#[inline(always)]
fn times<const D: usize>(m: &Mat<f64, D>, v: &[f64; D]) -> [f64; D] {
    let mut product = [0.0; D];
    for i in 0..D {
        for j in 0..D {
            product[i] += m[i][j] * v[j];
        }
    }
    product
}

/// Writes the deformation gradients of some nodes, eight side by side; the last block is filled up by
/// identities.
pub(super) struct Deform<'a, const D: usize> {
    pub(super) rings: &'a NodeRings<D>,
    pub(super) nodes: Range<usize>,
    pub(super) x: &'a [[f64; D]],
    pub(super) f: &'a mut [Block<D>],
}

impl<const D: usize> Kernel for Deform<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (block, first) in self.f.iter_mut().zip(self.nodes.clone().step_by(WIDTH)) {
            for lane in 0..WIDTH {
                let node = first + lane;
                let f = if node < self.nodes.end {
                    self.rings.deformation_gradient(node, self.x)
                } else {
                    Mat::identity()
                };
                block.set_lane(lane, &f);
            }
        }
    }
}

/// Writes the gradients of some nodes; gives whether all are finite.
pub(super) struct Gather<'a, const D: usize> {
    pub(super) rings: &'a NodeRings<D>,
    pub(super) first: usize,
    pub(super) stress: &'a [Mat<f64, D>],
    pub(super) gradient: &'a mut [[f64; D]],
}

impl<const D: usize> Kernel for Gather<'_, D> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let mut zero = 0.0;
        for (i, gradient) in self.gradient.iter_mut().enumerate() {
            *gradient = self.rings.gradient(self.first + i, self.stress);
            for g in gradient {
                zero += 0.0 * *g;
            }
        }
        zero == 0.0
    }
}
