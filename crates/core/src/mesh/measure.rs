//! Volumes shared out to vertices: what lumped masses are made of.

use super::Mesh;
use super::geometry::measure;
use crate::element::MassMatrix;

impl Mesh {
    /// Volume of the elements [m^3], or area [m^2], that falls to each vertex: every element gives equal shares to its
    /// vertices, one of second order those of [`MassMatrix::lumped`]. Zero for vertices without elements.
    pub fn lumped_measure(&self) -> Vec<f64> {
        let mut shares = vec![0.0; self.vertex_count()];
        match (self.element_dimension(), self.dimension, self.order()) {
            (3, 3, 2) => self.share_lumped::<3, 10>(&mut shares),
            (2, 2, 2) => self.share_lumped::<2, 6>(&mut shares),
            _ => self.share_equally(&mut shares),
        }
        shares
    }

    fn share_equally(&self, shares: &mut [f64]) {
        match self.element_dimension() {
            3 => self.tetrahedra.iter().for_each(|cell| self.share(*cell, shares)),
            2 => self.triangles.iter().for_each(|cell| self.share(*cell, shares)),
            _ => {}
        }
    }

    fn share_lumped<const D: usize, const N: usize>(&self, shares: &mut [f64]) {
        let mass = MassMatrix::<D, N>::new();
        for cell in self.elements::<N>() {
            for (v, m) in cell.into_iter().zip(mass.lumped(&self.nodes::<D, N>(&cell))) {
                shares[v as usize] += m;
            }
        }
    }

    /// Positions of the nodes of an element in `D` dimensions [m].
    pub(crate) fn nodes<const D: usize, const N: usize>(&self, cell: &[u32; N]) -> [[f64; D]; N] {
        let mut nodes = [[0.0; D]; N];
        for (node, &v) in nodes.iter_mut().zip(cell) {
            node.copy_from_slice(self.point(v as usize));
        }
        nodes
    }

    /// The edges that springs run along: those of the mesh if it names any, otherwise every edge of its elements, once,
    /// ascending.
    pub fn spring_edges(&self) -> Vec<[u32; 2]> {
        if self.edges.is_empty() { self.unique_edges() } else { self.edges.clone() }
    }

    fn share<const N: usize>(&self, cell: [u32; N], shares: &mut [f64]) {
        let volume = measure(&self.points, self.dimension, cell).volume;
        for v in cell {
            shares[v as usize] += volume / N as f64;
        }
    }
}
