//! Volumes shared out to vertices: what lumped masses are made of.

use super::Mesh;
use super::geometry::measure;

impl Mesh {
    /// Volume of the elements [m^3], or area [m^2], that falls to each vertex: every element gives equal shares to its
    /// vertices. Zero for vertices without elements.
    pub fn lumped_measure(&self) -> Vec<f64> {
        let mut shares = vec![0.0; self.vertex_count()];
        match self.element_dimension() {
            3 => self.tetrahedra.iter().for_each(|cell| self.share(*cell, &mut shares)),
            2 => self.triangles.iter().for_each(|cell| self.share(*cell, &mut shares)),
            _ => {}
        }
        shares
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
