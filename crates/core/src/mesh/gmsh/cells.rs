//! Cells of a Gmsh file by dimension, with their places and physical groups.

use std::collections::BTreeMap;

use crate::mesh::file::Place;

/// Cells with `N` vertices.
#[derive(Debug)]
pub(super) struct CellsOf<const N: usize> {
    pub vertices: Vec<[u32; N]>,
    pub places: Vec<Place>,
    /// Cells of each physical group, ascending.
    pub groups: BTreeMap<u64, Vec<u32>>,
}

impl<const N: usize> Default for CellsOf<N> {
    fn default() -> Self {
        CellsOf { vertices: Vec::new(), places: Vec::new(), groups: BTreeMap::new() }
    }
}

impl<const N: usize> CellsOf<N> {
    fn push(&mut self, vertices: [u32; N], place: Place, groups: &[u64]) {
        let cell = self.vertices.len() as u32;
        self.vertices.push(vertices);
        self.places.push(place);
        for &group in groups {
            self.groups.entry(group).or_default().push(cell);
        }
    }

    fn merge_repeated(&mut self) {
        let key = |cell: u32| {
            let mut vertices = self.vertices[cell as usize];
            vertices.sort_unstable();
            (vertices, cell)
        };
        let mut sorted: Vec<([u32; N], u32)> = (0..self.vertices.len() as u32).map(key).collect();
        sorted.sort_unstable();
        // Every cell points to the first one with the same vertices.
        let mut first: Vec<u32> = (0..self.vertices.len() as u32).collect();
        for run in sorted.chunk_by(|a, b| a.0 == b.0) {
            run.iter().for_each(|(_, cell)| first[*cell as usize] = run[0].1);
        }
        let mut kept = 0;
        let mut index = vec![0_u32; first.len()];
        for cell in 0..first.len() {
            if first[cell] as usize == cell {
                index[cell] = kept as u32;
                self.vertices[kept] = self.vertices[cell];
                self.places[kept] = self.places[cell];
                kept += 1;
            } else {
                index[cell] = index[first[cell] as usize];
            }
        }
        self.vertices.truncate(kept);
        self.places.truncate(kept);
        for cells in self.groups.values_mut() {
            cells.iter_mut().for_each(|cell| *cell = index[*cell as usize]);
            cells.sort_unstable();
            cells.dedup();
        }
    }
}

/// Cells of every dimension.
#[derive(Debug, Default)]
pub(super) struct Cells {
    pub points: CellsOf<1>,
    pub lines: CellsOf<2>,
    pub triangles: CellsOf<3>,
    pub tetrahedra: CellsOf<4>,
}

impl Cells {
    /// Enters a cell with one to four vertices.
    pub(super) fn push(&mut self, vertices: &[u32], place: Place, groups: &[u64]) {
        match *vertices {
            [a] => self.points.push([a], place, groups),
            [a, b] => self.lines.push([a, b], place, groups),
            [a, b, c] => self.triangles.push([a, b, c], place, groups),
            [a, b, c, d] => self.tetrahedra.push([a, b, c, d], place, groups),
            _ => {}
        }
    }

    /// Version 2.2 writes an element once for each physical group that it is in: the copies become one element that
    /// is in all those groups.
    pub(super) fn merge_repeated(&mut self) {
        self.points.merge_repeated();
        self.lines.merge_repeated();
        self.triangles.merge_repeated();
        self.tetrahedra.merge_repeated();
    }
}
