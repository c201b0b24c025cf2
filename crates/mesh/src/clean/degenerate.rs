//! `drop_degenerate`: removes cells without a volume and repeated cells.

use std::collections::BTreeMap;

use super::{Cleaned, CleaningStep, SimplexCells, consecutive};
use crate::Mesh;
use crate::MeshError;
use crate::check::{flat_cells, is_flat};
use crate::file::FileMesh;
use crate::topology::firsts;

pub(super) const STEP: CleaningStep = CleaningStep {
    asked: |spec| spec.drop_degenerate,
    apply: |_, file| apply(file),
    cures: |error| {
        matches!(
            error,
            MeshError::Degenerate { .. }
                | MeshError::RepeatedVertex { .. }
                | MeshError::RepeatedCell { .. }
                | MeshError::ZeroLengthEdge { .. }
        )
    },
    advice: "`drop_degenerate = true` next to `path` removes cells without a volume, an area or a length, \
             and cells that repeat another",
};

fn apply(file: &mut FileMesh) -> Result<Vec<Cleaned>, MeshError> {
    let (dimension, count) = (file.mesh.element_dimension(), file.mesh.element_count());
    let mut cleaned = Vec::new();
    for kind in SimplexCells::ALL {
        let is_element = kind.dimension() == dimension;
        let counts = of_kind(file, kind);
        let whys = [
            ["without a length", "without an area", "without a volume"][kind.dimension() - 1],
            "repeating another",
        ];
        for (count, why) in counts.into_iter().zip(whys) {
            if count > 0 || (is_element && kind != SimplexCells::Lines) {
                cleaned
                    .push(Cleaned { why, ..Cleaned::new("drop_degenerate", "dropped", count, kind.name()) });
            }
        }
    }
    for block in 0..file.mesh.blocks.len() {
        let (name, is_element) =
            (file.mesh.blocks[block].kind.plural, file.mesh.blocks[block].kind.dimension == dimension);
        for (count, why) in of_block(file, block).into_iter().zip(["without a volume", "repeating another"]) {
            if count > 0 || is_element {
                cleaned.push(Cleaned { why, ..Cleaned::new("drop_degenerate", "dropped", count, name) });
            }
        }
    }
    file.mesh.blocks.retain(|block| !block.is_empty());
    file.blocks.retain(|places| !places.is_empty());
    if file.mesh.element_dimension() != dimension {
        return Err(MeshError::NothingLeft { count });
    }
    Ok(cleaned)
}

/// Drops cells of a kind; returns the numbers of degenerate and of repeated cells.
fn of_kind(file: &mut FileMesh, kind: SimplexCells) -> [usize; 2] {
    let nodes = file.nodes(kind);
    let flat = flat(&file.mesh, kind);
    let mut keep: Vec<bool> =
        nodes.iter().zip(&flat).map(|(nodes, flat)| !flat && all_differ(nodes)).collect();
    let degenerate = keep.iter().filter(|keep| !**keep).count();
    let firsts = match kind {
        SimplexCells::Edges => firsts(&file.mesh.edges, &keep),
        SimplexCells::Lines => firsts(&file.mesh.lines, &keep),
        SimplexCells::Triangles => firsts(&file.mesh.triangles, &keep),
        SimplexCells::Tetrahedra => firsts(&file.mesh.tetrahedra, &keep),
    };
    let stays = keep.clone();
    for (cell, &first) in firsts.iter().enumerate() {
        keep[cell] &= first as usize == cell;
    }
    let repeated = stays.iter().filter(|stays| **stays).count() - keep.iter().filter(|keep| **keep).count();
    let kept = consecutive(&keep);
    let numbers = firsts.iter().map(|&first| kept[first as usize]).collect();
    file.retain_cells(kind, &keep, &numbers);
    [degenerate, repeated]
}

/// Drops cells of a block; returns the numbers of degenerate and of repeated cells.
fn of_block(file: &mut FileMesh, block: usize) -> [usize; 2] {
    let cells = &file.mesh.blocks[block];
    let flat = if cells.kind.dimension == file.mesh.dimension {
        flat_cells(&file.mesh, cells)
    } else {
        vec![false; cells.len()]
    };
    let mut firsts: BTreeMap<Vec<u32>, u32> = BTreeMap::new();
    let (mut keep, mut numbers, mut counts) = (vec![], vec![], [0, 0]);
    for (cell, flat) in cells.cells().zip(flat) {
        if flat || !all_differ(cell) {
            counts[0] += 1;
            keep.push(false);
            numbers.push(None);
            continue;
        }
        let mut key = cell.to_vec();
        key.sort_unstable();
        let next = firsts.len() as u32;
        let number = *firsts.entry(key).or_insert(next);
        counts[1] += usize::from(number != next);
        keep.push(number == next);
        numbers.push(Some(number));
    }
    file.retain_block(block, &keep, &numbers);
    counts
}

fn all_differ(nodes: &[u32]) -> bool {
    nodes.iter().enumerate().all(|(i, node)| !nodes[..i].contains(node))
}

/// True for each degenerate cell of a kind.
fn flat(mesh: &Mesh, kind: SimplexCells) -> Vec<bool> {
    let least = mesh.diagonal();
    match kind {
        SimplexCells::Edges => mesh.edges.iter().map(|cell| is_flat(mesh, least, *cell)).collect(),
        SimplexCells::Lines => mesh.lines.iter().map(|cell| is_flat(mesh, least, *cell)).collect(),
        SimplexCells::Triangles => mesh.triangles.iter().map(|cell| is_flat(mesh, least, *cell)).collect(),
        SimplexCells::Tetrahedra => mesh.tetrahedra.iter().map(|cell| is_flat(mesh, least, *cell)).collect(),
    }
}
