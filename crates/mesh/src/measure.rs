//! Volumes distributed to vertices, for lumped masses.

use super::Mesh;
use super::geometry::measure;
use pliant::element::{CellBlock, CellVisitor, Isoparametric, MassRule};

impl Mesh {
    /// Volume [m^3] or area [m^2] of the elements, distributed to the vertices: equal shares in a
    /// first-order element, those of [`MassRule::lumped`] in a second-order element. Zero for vertices
    /// without elements.
    pub fn lumped_measure(&self) -> Vec<f64> {
        let mut shares = vec![0.0; self.vertex_count()];
        if let Some(block) = self.block() {
            match block.kind.order() {
                1 => block.kind.visit_first(Lumped { mesh: self, block, shares: &mut shares }),
                _ => block.kind.visit_second(SecondOrderLumped { mesh: self, block, shares: &mut shares }),
            }
            return shares;
        }
        match (self.element_dimension(), self.dimension, self.order()) {
            (3, 3, 2) => self.share_lumped::<3, 10>(&self.elements(), &mut shares),
            (2, 2, 2) => self.share_lumped::<2, 6>(&self.elements(), &mut shares),
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

    fn share_lumped<const D: usize, const N: usize>(&self, cells: &[[u32; N]], shares: &mut [f64]) {
        let mass = MassRule::<D, N>::new();
        for cell in cells {
            for (v, m) in cell.iter().zip(mass.lumped(&self.nodes::<D, N>(cell))) {
                shares[*v as usize] += m;
            }
        }
    }

    /// Consistent mass matrix for unit density, `M_ab = integral of N_a N_b` over the elements [m^3 or
    /// m^2], as rows with ascending columns: see [`MassRule::consistent`]. Row sums are the integrals of
    /// the shape functions. Rows of vertices without elements are empty.
    pub fn consistent_measure(&self) -> Vec<Vec<(u32, f64)>> {
        let mut rows = vec![vec![]; self.vertex_count()];
        if let Some(block) = self.block() {
            match block.kind.order() {
                1 => block.kind.visit_first(Consistent { mesh: self, block, rows: &mut rows }),
                _ => block.kind.visit_second(SecondOrderConsistent { mesh: self, block, rows: &mut rows }),
            }
            return rows;
        }
        match (self.element_dimension(), self.dimension, self.order()) {
            (3, _, 2) => self.add_products(&self.elements::<10>(), consistent::<3, 10>(self), &mut rows),
            (3, _, _) => self.add_products(&self.tetrahedra, consistent::<3, 4>(self), &mut rows),
            (2, 2, 2) => self.add_products(&self.elements::<6>(), consistent::<2, 6>(self), &mut rows),
            (2, 2, _) => self.add_products(&self.triangles, consistent::<2, 3>(self), &mut rows),
            (2, ..) => {
                let straight = MassRule::<2, 3>::new().of_straight();
                let area = |cell: &[u32; 3]| measure(&self.points, self.dimension, *cell).volume;
                let scaled = |cell: &[u32; 3]| straight.map(|row| row.map(|m| area(cell) * m));
                self.add_products(&self.triangles, scaled, &mut rows);
            }
            _ => {}
        }
        rows
    }

    /// Adds the matrices of the elements to the rows of their vertices, then merges the entries of each
    /// column.
    fn add_products<const N: usize>(
        &self,
        cells: &[[u32; N]],
        matrix: impl Fn(&[u32; N]) -> [[f64; N]; N],
        rows: &mut [Vec<(u32, f64)>],
    ) {
        for cell in cells {
            for (row, products) in cell.iter().zip(matrix(cell)) {
                rows[*row as usize].extend(cell.iter().copied().zip(products));
            }
        }
        for row in rows {
            row.sort_by_key(|(column, _)| *column);
            row.dedup_by(|next, first| {
                let same = next.0 == first.0;
                first.1 += if same { next.1 } else { 0.0 };
                same
            });
        }
    }

    /// Node positions of an element in `D` dimensions [m].
    pub fn nodes<const D: usize, const N: usize>(&self, cell: &[u32; N]) -> [[f64; D]; N] {
        let mut nodes = [[0.0; D]; N];
        for (node, &v) in nodes.iter_mut().zip(cell) {
            node.copy_from_slice(self.point(v as usize));
        }
        nodes
    }

    /// Edges that become springs: those of the mesh, if it has any, otherwise every edge of its elements,
    /// once, ascending.
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

/// Adds the lumped masses of cells to their vertices, for unit density.
struct Lumped<'a> {
    mesh: &'a Mesh,
    block: &'a CellBlock,
    shares: &'a mut [f64],
}

impl CellVisitor for Lumped<'_> {
    type Output = ();

    fn visit<const D: usize, const N: usize>(self, kind: &'static Isoparametric<D, N>) {
        for cell in self.block.of::<N>() {
            for (v, m) in cell.iter().zip(kind.lumped(&self.mesh.nodes::<D, N>(cell))) {
                self.shares[*v as usize] += m;
            }
        }
    }
}

/// Adds the consistent mass matrices of cells to the rows of their vertices, for unit density.
struct Consistent<'a> {
    mesh: &'a Mesh,
    block: &'a CellBlock,
    rows: &'a mut [Vec<(u32, f64)>],
}

impl CellVisitor for Consistent<'_> {
    type Output = ();

    fn visit<const D: usize, const N: usize>(self, kind: &'static Isoparametric<D, N>) {
        let matrix = |cell: &[u32; N]| kind.consistent(&self.mesh.nodes::<D, N>(cell));
        self.mesh.add_products(self.block.of::<N>(), matrix, self.rows);
    }
}

/// Adds the lumped masses of second-order cells.
struct SecondOrderLumped<'a> {
    mesh: &'a Mesh,
    block: &'a CellBlock,
    shares: &'a mut [f64],
}

impl CellVisitor for SecondOrderLumped<'_> {
    type Output = ();

    fn visit<const D: usize, const N: usize>(self, _: &'static Isoparametric<D, N>) {
        self.mesh.share_lumped::<D, N>(self.block.of(), self.shares);
    }
}

/// Adds the consistent mass matrices of second-order cells.
struct SecondOrderConsistent<'a> {
    mesh: &'a Mesh,
    block: &'a CellBlock,
    rows: &'a mut [Vec<(u32, f64)>],
}

impl CellVisitor for SecondOrderConsistent<'_> {
    type Output = ();

    fn visit<const D: usize, const N: usize>(self, _: &'static Isoparametric<D, N>) {
        self.mesh.add_products(self.block.of::<N>(), consistent::<D, N>(self.mesh), self.rows);
    }
}

/// Consistent mass matrix of an element for unit density.
fn consistent<const D: usize, const N: usize>(mesh: &Mesh) -> impl Fn(&[u32; N]) -> [[f64; N]; N] {
    let mass = MassRule::<D, N>::new();
    move |cell| mass.consistent(&mesh.nodes::<D, N>(cell))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::Mesh;
    use crate::build;
    use crate::spec::MeshSpec;

    fn grid(dimension: usize) -> Mesh {
        let spec =
            serde_json::json!({ "grid": { "cells": vec![2; dimension], "size": vec![1.5; dimension] } });
        build(&serde_json::from_value::<MeshSpec>(spec).unwrap(), dimension, Path::new(".")).unwrap()
    }

    /// The product of the matrix with nodal values of x gives the `integral of x^2` over the cube; rows
    /// are symmetric and sum to the volume.
    #[test]
    fn the_products_of_shape_functions_integrate_squares() {
        for d in [2, 3] {
            for mesh in [grid(d), grid(d).promoted_to_quadratic().unwrap()] {
                let rows = mesh.consistent_measure();
                let value = |v: usize| mesh.point(v)[0];
                let (mut total, mut square) = (0.0, 0.0);
                for (a, row) in rows.iter().enumerate() {
                    assert!(row.is_sorted_by(|a, b| a.0 < b.0), "one entry for each neighbour");
                    for (b, m) in row {
                        let back = rows[*b as usize].iter().find(|(c, _)| *c as usize == a).unwrap().1;
                        assert!((back - m).abs() < 1e-15);
                        total += m;
                        square += value(a) * m * value(*b as usize);
                    }
                }
                let volume = 1.5f64.powi(d as i32);
                assert!((total - volume).abs() < 1e-13 && (square - volume * 1.5 * 1.5 / 3.0).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn linear_elements_share_their_volume_equally_and_quadratic_ones_give_corners_nothing_or_less() {
        for d in [2, 3] {
            let sums = |mesh: &Mesh| -> Vec<f64> {
                mesh.consistent_measure().iter().map(|row| row.iter().map(|(_, m)| m).sum()).collect()
            };
            let mesh = grid(d);
            let lumped = mesh.lumped_measure();
            assert!(sums(&mesh).iter().zip(&lumped).all(|(a, b)| (a - b).abs() < 1e-14));
            // A corner has -V/20 of every tetrahedron, where the lumped share of first order is V/4.
            let part = if d == 2 { 0.0 } else { -0.2 };
            let quadratic = sums(&mesh.promoted_to_quadratic().unwrap());
            assert!(quadratic.iter().zip(&lumped).all(|(sum, volume)| (sum - part * volume).abs() < 1e-14));
        }
    }

    /// Triangles in space have the masses of triangles in the plane.
    #[test]
    fn sheets_have_the_products_of_triangles_in_the_plane() {
        let flat = grid(2);
        let points = flat.points.chunks_exact(2).flat_map(|x| [0.6 * x[0], x[1], 0.8 * x[0]]).collect();
        let sheet = Mesh { dimension: 3, points, ..flat.clone() };
        let both = flat.consistent_measure().concat().into_iter().zip(sheet.consistent_measure().concat());
        both.for_each(|((a, m), (b, n))| assert!(a == b && (m - n).abs() < 1e-15));
    }
}
