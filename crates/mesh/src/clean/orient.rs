//! `orient`: gives elements a positive volume and surfaces a consistent orientation.

use super::{Cleaned, CleaningStep, surface};
use crate::Mesh;
use crate::MeshError;
use crate::file::FileMesh;
use crate::geometry::measure;
use pliant::element::{CellBlock, CellVisitor, Isoparametric};

pub(super) const STEP: CleaningStep = CleaningStep {
    asked: |spec| spec.orient,
    apply: |_, file| apply(file),
    cures: |error| matches!(error, MeshError::Inverted { .. }),
    advice: "`orient = true` next to `path` does so for every element that needs it",
};

fn apply(file: &mut FileMesh) -> Result<Vec<Cleaned>, MeshError> {
    let mesh = &mut file.mesh;
    if let Some(turned) = mesh.block().map(|block| block.kind.visit(LeftHanded { mesh, block })) {
        return Ok(vec![turn_cells(mesh, &turned)]);
    }
    let (turned, what) = match (mesh.dimension, mesh.element_dimension()) {
        (_, 3) => (left_handed(mesh, &mesh.tetrahedra), "tetrahedra"),
        (2, 2) => (left_handed(mesh, &mesh.triangles), "triangles"),
        (_, 2) => (surface::other_side_up(mesh)?, "triangles"),
        _ => return Ok(Vec::new()),
    };
    for &cell in &turned {
        if what == "tetrahedra" { turn_tetrahedron(mesh, cell) } else { turn_triangle(mesh, cell) }
    }
    let total = Some(mesh.element_count());
    Ok(vec![Cleaned { total, ..Cleaned::new("orient", "oriented", turned.len(), what) }])
}

/// Mirrors these elements of a block.
fn turn_cells(mesh: &mut Mesh, turned: &[usize]) -> Cleaned {
    let (dimension, total) = (mesh.element_dimension(), Some(mesh.element_count()));
    let mut what = "cells";
    for block in mesh.blocks.iter_mut().filter(|block| block.kind.dimension == dimension) {
        let kind = block.kind;
        what = kind.plural;
        for &i in turned {
            let cell = &mut block.vertices[i * kind.nodes..][..kind.nodes];
            let before = cell.to_vec();
            cell.iter_mut().zip(kind.mirror).for_each(|(vertex, node)| *vertex = before[*node]);
        }
    }
    Cleaned { total, ..Cleaned::new("orient", "oriented", turned.len(), what) }
}

/// Finds the cells of negative volume in a block.
struct LeftHanded<'a> {
    mesh: &'a Mesh,
    block: &'a CellBlock,
}

impl CellVisitor for LeftHanded<'_> {
    type Output = Vec<usize>;

    fn visit<const D: usize, const N: usize>(self, kind: &'static Isoparametric<D, N>) -> Vec<usize> {
        let cells = self.block.of::<N>();
        let is_left = |i: &usize| kind.volume(&self.mesh.nodes::<D, N>(&cells[*i])) < 0.0;
        (0..cells.len()).filter(is_left).collect()
    }
}

/// Indices of the cells of negative volume.
fn left_handed<const N: usize>(mesh: &Mesh, cells: &[[u32; N]]) -> Vec<usize> {
    let is_left = |cell: &[u32; N]| measure(&mesh.points, mesh.dimension, *cell).relative < 0.0;
    (0..cells.len()).filter(|&i| is_left(&cells[i])).collect()
}

/// Exchanges the last two corners and the affected mid-edge nodes.
fn turn_tetrahedron(mesh: &mut Mesh, i: usize) {
    mesh.tetrahedra[i].swap(2, 3);
    if let Some([_, m12, m02, m03, m13, _]) = mesh.tetrahedron_middles.get_mut(i) {
        std::mem::swap(m12, m13);
        std::mem::swap(m02, m03);
    }
}

fn turn_triangle(mesh: &mut Mesh, i: usize) {
    mesh.triangles[i].swap(1, 2);
    if let Some([m01, _, m20]) = mesh.triangle_middles.get_mut(i) {
        std::mem::swap(m01, m20);
    }
}
