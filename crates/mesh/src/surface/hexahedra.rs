//! Whole cubes of the lattice whose centre is inside.

use std::collections::HashMap;

use super::lattice::{CubicLattice, for_each};
use pliant::element::{CellBlock, HEXAHEDRON};

/// Cubes whose centres are `inside`, and the positions of their corners [m].
pub(super) fn cubes(lattice: &CubicLattice, inside: &[bool]) -> (Vec<[f64; 3]>, CellBlock) {
    let mut cells: Vec<[u32; 8]> = vec![];
    for_each(lattice.cubes, |at| {
        if inside[lattice.middle(at) as usize] {
            cells.push(lattice.corners_of(at));
        }
    });
    let mut used = cells.as_flattened().to_vec();
    used.sort_unstable();
    used.dedup();
    let number: HashMap<u32, u32> = used.iter().copied().zip(0..).collect();
    let vertices = cells.as_flattened().iter().map(|corner| number[corner]).collect();
    let points = used.iter().map(|corner| lattice.place(*corner)).collect();
    (points, CellBlock { kind: HEXAHEDRON.kind, vertices })
}
