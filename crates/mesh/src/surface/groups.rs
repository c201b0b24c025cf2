//! Named groups of the boundary.

use super::closed::ClosedSurface;
use crate::{Group, Mesh};
use pliant::element::{CellBlock, QUADRILATERAL};

/// Adds the boundary as group `surface`, and for each group of the file the boundary faces whose nearest
/// triangle belongs to it.
pub(super) fn add(surface: &ClosedSurface, mesh: &mut Mesh) {
    let faces: Vec<Vec<u32>> = match mesh.block().cloned() {
        Some(block) => {
            let quadrilaterals = mesh.quadrilaterals(&block);
            mesh.blocks.push(CellBlock { kind: QUADRILATERAL.kind, vertices: quadrilaterals.concat() });
            quadrilaterals.iter().map(|face| face.to_vec()).collect()
        }
        None => {
            mesh.triangles = mesh.surface_triangles();
            mesh.triangles.iter().map(|face| face.to_vec()).collect()
        }
    };
    let mut insert = |name: &str, cells: Vec<u32>| {
        let mut vertices: Vec<u32> = cells.iter().flat_map(|cell| &faces[*cell as usize]).copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        mesh.groups.insert(name.to_owned(), Group { topological_dimension: 2, cells, vertices });
    };
    insert("surface", (0..faces.len() as u32).collect());
    if surface.groups.is_empty() {
        return;
    }
    let points = mesh.points.as_chunks::<3>().0;
    let nearest = |face: &Vec<u32>| {
        let middle = face.iter().fold([0.0; 3], |sum, v| [0, 1, 2].map(|c| sum[c] + points[*v as usize][c]));
        surface.nearest(&middle.map(|x| x / face.len() as f64)).map(|(triangle, _)| triangle)
    };
    let nearest: Vec<Option<u32>> = faces.iter().map(nearest).collect();
    for (name, members) in &surface.groups {
        let is_member = |found: Option<u32>| found.is_some_and(|found| members.binary_search(&found).is_ok());
        let cells: Vec<u32> =
            (0u32..).zip(&nearest).filter(|(_, found)| is_member(**found)).map(|(i, _)| i).collect();
        if !cells.is_empty() {
            insert(name, cells);
        }
    }
}
