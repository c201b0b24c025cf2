//! `drop_unused`: removes vertices without an element or an edge.

use super::{Cleaned, CleaningStep, SimplexCells, consecutive};
use crate::MeshError;
use crate::check::used_vertices;
use crate::file::FileMesh;

pub(super) const STEP: CleaningStep = CleaningStep {
    asked: |spec| spec.drop_unused,
    apply: |_, file| Ok(apply(file)),
    cures: |error| matches!(error, MeshError::Unreferenced { .. }),
    advice: "`drop_unused = true` next to `path` removes them",
};

/// Removes the vertices. Cells of lower dimension are removed with them: they are sides of no element.
fn apply(file: &mut FileMesh) -> Vec<Cleaned> {
    let Some(used) = used_vertices(&file.mesh) else { return Vec::new() };
    let first_vertex = used.iter().position(|used| !used);
    let count = used.iter().filter(|used| !**used).count();
    let vertices = Cleaned::new("drop_unused", "dropped", count, "vertices");
    let mut cleaned = vec![Cleaned { first_vertex, why: "that no element and no edge uses", ..vertices }];
    for kind in SimplexCells::ALL {
        let keep: Vec<bool> =
            file.nodes(kind).iter().map(|cell| cell.iter().all(|&v| used[v as usize])).collect();
        let count = keep.iter().filter(|keep| !**keep).count();
        if count > 0 {
            file.retain_cells(kind, &keep, &consecutive(&keep));
            let cells = Cleaned::new("drop_unused", "dropped", count, kind.name());
            cleaned.push(Cleaned { why: "between them", ..cells });
        }
    }
    for block in 0..file.mesh.blocks.len() {
        let cells = &file.mesh.blocks[block];
        let name = cells.kind.plural;
        let keep: Vec<bool> = cells.cells().map(|cell| cell.iter().all(|&v| used[v as usize])).collect();
        let count = keep.iter().filter(|keep| !**keep).count();
        if count > 0 {
            file.retain_block(block, &keep, &consecutive(&keep));
            let cells = Cleaned::new("drop_unused", "dropped", count, name);
            cleaned.push(Cleaned { why: "between them", ..cells });
        }
    }
    file.retain_vertices(&used, &consecutive(&used));
    cleaned
}
