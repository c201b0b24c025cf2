//! Cleaning of mesh files: each step is a key next to `path`, and a file here with one line in [`STEPS`].
//!
//! The steps run in the order of the list. Merging vertices comes first; it makes cells degenerate and
//! repeats them. These cells are dropped, then vertices that no cell uses. The remaining cells are oriented.
//!
//! # How to add a step
//! 1. Write a file in this folder with its `STEP`: whether the scene asks for it, what it does, which errors
//!    it cures, its advice. Add it to `STEPS`, whose order is the order of the steps.
//! 2. Add its key to `FileSpec` in `spec/mod.rs`. Messages about errors that it cures name the key from then
//!    on.
//! 3. Add it to `cleaned` in `fuzz_tests.rs` and test it in `tests.rs` beside this file.

mod degenerate;
mod merge;
mod orient;
mod surface;
#[cfg(test)]
mod tests;
mod unused;

use serde::Serialize;

use super::MeshError;
use super::file::{FileMesh, Place};
use crate::spec::FileSpec;
use pliant::element::CellBlock;

/// Cleaning steps, in the order in which they run.
pub(super) const STEPS: &[CleaningStep] = &[merge::STEP, degenerate::STEP, unused::STEP, orient::STEP];

/// A cleaning step.
pub(super) struct CleaningStep {
    /// True if the scene requests the step.
    pub asked: fn(&FileSpec) -> bool,
    /// Runs the step and returns its counts.
    pub apply: fn(&FileSpec, &mut FileMesh) -> Result<Vec<Cleaned>, MeshError>,
    /// True if the step repairs this error.
    pub cures: fn(&MeshError) -> bool,
    /// Key of the step, and its effect.
    pub advice: &'static str,
}

/// Number of vertices or cells that a step of cleaning changed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Cleaned {
    /// The key of the step: `merge`, `drop_degenerate`, `drop_unused`, `orient`.
    pub key: &'static str,
    /// `merged`, `dropped` or `oriented`.
    pub verb: &'static str,
    /// Number of vertices or cells changed.
    pub count: usize,
    /// Number of vertices or cells examined, where it is informative.
    pub total: Option<usize>,
    /// `vertices`, `triangles`, ...
    pub what: &'static str,
    /// Reason, as the end of the sentence; may be empty.
    pub why: &'static str,
    /// Index of the first removed vertex: from it on the vertices are renumbered.
    pub first_vertex: Option<usize>,
}

impl Cleaned {
    fn new(key: &'static str, verb: &'static str, count: usize, what: &'static str) -> Cleaned {
        Cleaned { key, verb, count, total: None, what, why: "", first_vertex: None }
    }

    /// Noun of the last count in the message: `vertices`, or `vertex` for one.
    pub fn noun(&self) -> String {
        match (self.total.unwrap_or(self.count), self.what) {
            (1, "vertices") => "vertex".into(),
            (1, what) if what.ends_with("hedra") => what.replace("hedra", "hedron"),
            (1, what) => what.strip_suffix('s').unwrap_or(what).into(),
            (_, what) => what.into(),
        }
    }
}

/// Runs the steps that the scene requests; [`Mesh::cleaned`](super::Mesh::cleaned) keeps their counts.
pub(super) fn clean(spec: &FileSpec, file: &mut FileMesh) -> Result<(), MeshError> {
    for step in STEPS.iter().filter(|step| (step.asked)(spec)) {
        let cleaned = (step.apply)(spec, file)?;
        file.mesh.cleaned.extend(cleaned);
    }
    Ok(())
}

/// Advice on the steps that would repair this error and are not requested.
pub(super) fn cures(spec: &FileSpec, error: &MeshError) -> Vec<&'static str> {
    let offered = STEPS.iter().filter(|step| !(step.asked)(spec) && (step.cures)(error));
    offered.map(|step| step.advice).collect()
}

/// Kinds of simplices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SimplexCells {
    Edges,
    Lines,
    Triangles,
    Tetrahedra,
}

impl SimplexCells {
    const ALL: [SimplexCells; 4] =
        [SimplexCells::Edges, SimplexCells::Lines, SimplexCells::Triangles, SimplexCells::Tetrahedra];

    fn name(self) -> &'static str {
        match self {
            SimplexCells::Edges => "edges",
            SimplexCells::Lines => "lines",
            SimplexCells::Triangles => "triangles",
            SimplexCells::Tetrahedra => "tetrahedra",
        }
    }

    fn dimension(self) -> usize {
        match self {
            SimplexCells::Edges | SimplexCells::Lines => 1,
            SimplexCells::Triangles => 2,
            SimplexCells::Tetrahedra => 3,
        }
    }
}

/// New index of each item; `None` for a removed one.
type Numbers = Vec<Option<u32>>;

/// Consecutive numbers for the items that `keep` marks.
fn consecutive(keep: &[bool]) -> Numbers {
    let mut next = 0;
    let number = |&keep: &bool| {
        keep.then(|| {
            next += 1;
            next - 1
        })
    };
    keep.iter().map(number).collect()
}

/// Retains the items that `keep` marks; an empty list stays empty.
fn retain<T>(items: &mut Vec<T>, keep: &[bool]) {
    let mut keep = keep.iter();
    items.retain(|_| keep.next().is_none_or(|&keep| keep));
}

impl FileMesh {
    /// All nodes of each cell of a kind: corners, then mid-edge nodes.
    fn nodes(&self, kind: SimplexCells) -> Vec<Vec<u32>> {
        fn joined<const N: usize, const M: usize>(
            corners: &[[u32; N]],
            middles: &[[u32; M]],
        ) -> Vec<Vec<u32>> {
            let nodes = |(i, cell): (usize, &[u32; N])| {
                let middles = middles.get(i).map_or(&[][..], |m| m);
                [cell, middles].concat()
            };
            corners.iter().enumerate().map(nodes).collect()
        }
        match kind {
            SimplexCells::Edges => joined::<2, 0>(&self.mesh.edges, &[]),
            SimplexCells::Lines => joined::<2, 0>(&self.mesh.lines, &[]),
            SimplexCells::Triangles => joined(&self.mesh.triangles, &self.mesh.triangle_middles),
            SimplexCells::Tetrahedra => joined(&self.mesh.tetrahedra, &self.mesh.tetrahedron_middles),
        }
    }

    /// Removes the cells that `keep` does not mark. `numbers` maps old to new indices; a removed repeated
    /// cell maps to the cell that represents it, so that the latter joins its groups.
    fn retain_cells(&mut self, kind: SimplexCells, keep: &[bool], numbers: &Numbers) {
        if keep.is_empty() {
            // Groups of edges and of lines look alike, and a file has only one of them.
            return;
        }
        let mesh = &mut self.mesh;
        let places: &mut Vec<Place> = match kind {
            SimplexCells::Edges => {
                retain(&mut mesh.edges, keep);
                &mut self.edges
            }
            SimplexCells::Lines => {
                retain(&mut mesh.lines, keep);
                &mut self.lines
            }
            SimplexCells::Triangles => {
                retain(&mut mesh.triangles, keep);
                retain(&mut mesh.triangle_middles, keep);
                &mut self.triangles
            }
            SimplexCells::Tetrahedra => {
                retain(&mut mesh.tetrahedra, keep);
                retain(&mut mesh.tetrahedron_middles, keep);
                &mut self.tetrahedra
            }
        };
        retain(places, keep);
        for group in mesh.groups.values_mut().filter(|g| g.topological_dimension == kind.dimension()) {
            renumber(&mut group.cells, numbers);
        }
    }

    /// Removes the cells of a block that `keep` does not mark; `numbers` as in `retain_cells`.
    fn retain_block(&mut self, block: usize, keep: &[bool], numbers: &Numbers) {
        let CellBlock { kind, vertices } = &mut self.mesh.blocks[block];
        let mut kept = keep.iter().flat_map(|&keep| std::iter::repeat_n(keep, kind.nodes));
        vertices.retain(|_| kept.next().is_none_or(|keep| keep));
        let dimension = kind.dimension;
        if let Some(places) = self.blocks.get_mut(block) {
            retain(places, keep);
        }
        let groups = self.mesh.groups.values_mut();
        for group in groups.filter(|group| group.topological_dimension == dimension) {
            renumber(&mut group.cells, numbers);
        }
    }

    /// Removes the vertices that `keep` does not mark; `numbers` as in `retain_cells`. Cells must not use
    /// a vertex without a new number.
    fn retain_vertices(&mut self, keep: &[bool], numbers: &Numbers) {
        let mesh = &mut self.mesh;
        let mut kept = keep.iter().flat_map(|&keep| std::iter::repeat_n(keep, mesh.dimension));
        mesh.points.retain(|_| kept.next().is_none_or(|keep| keep));
        retain(&mut self.vertices, keep);
        let cells = mesh.edges.as_flattened_mut().iter_mut();
        let cells = cells.chain(mesh.lines.as_flattened_mut());
        let cells =
            cells.chain(mesh.triangles.as_flattened_mut()).chain(mesh.triangle_middles.as_flattened_mut());
        let cells = cells.chain(mesh.tetrahedra.as_flattened_mut());
        let cells = cells.chain(mesh.blocks.iter_mut().flat_map(|block| &mut block.vertices));
        for vertex in cells.chain(mesh.tetrahedron_middles.as_flattened_mut()) {
            if let Some(number) = numbers[*vertex as usize] {
                *vertex = number;
            }
        }
        for group in mesh.groups.values_mut() {
            renumber(&mut group.vertices, numbers);
            if group.topological_dimension == 0 {
                renumber(&mut group.cells, numbers);
            }
        }
    }
}

/// Replaces old indices by new ones: ascending, each once.
fn renumber(list: &mut Vec<u32>, numbers: &Numbers) {
    *list = list.iter().filter_map(|&i| numbers[i as usize]).collect();
    list.sort_unstable();
    list.dedup();
}
