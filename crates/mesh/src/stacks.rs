//! Stacks of quadrilaterals or hexahedra through a solid, side by opposite side, and what lies beside them.

use super::Mesh;
use super::facets::for_each_equal;
use pliant::element::{CellBlock, CellVisitor, Isoparametric};

/// Cells from a side of the surface, through opposite sides, to where they leave the solid.
#[derive(Clone, Debug, PartialEq)]
pub struct CellStack {
    /// Length [m] or area [m^2] of the side in the middle of its cell.
    pub face: f64,
    /// Height of each cell along the stack [m].
    pub heights: Vec<f64>,
    /// Directions across it.
    pub across: Vec<CellRun>,
}

/// A direction across a stack.
#[derive(Clone, Debug, PartialEq)]
pub struct CellRun {
    /// Length of the run of cells, side by opposite side, that the first cell of the stack lies in [m]. One
    /// that closes has its circumference.
    pub length: f64,
    /// Width of each cell of the stack this way [m].
    pub widths: Vec<f64>,
}

/// No cell.
const NONE: u32 = u32::MAX;

/// Most nodes of a side.
const SIDE: usize = 4;

impl Mesh {
    /// Stacks from the sides of the surface of a solid of quadrilaterals in 2D, hexahedra in 3D, at most
    /// about `most` of them, evenly chosen. Empty for other solids.
    pub fn stacks(&self, most: usize) -> Vec<CellStack> {
        match self.block() {
            Some(block) if block.kind.dimension == self.dimension => {
                block.kind.visit(Stacks { mesh: self, block, most })
            }
            _ => vec![],
        }
    }
}

/// Looks for stacks.
struct Stacks<'a> {
    mesh: &'a Mesh,
    block: &'a CellBlock,
    most: usize,
}

impl CellVisitor for Stacks<'_> {
    type Output = Vec<CellStack>;

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Vec<CellStack> {
        let cells = self.block.of::<N>();
        let neighbours = neighbours(cell, cells);
        let open = || (0..neighbours.len()).filter(|i| neighbours[*i] == NONE);
        let stride = open().count().div_ceil(self.most.max(1)).max(1);
        let passage = Passage { mesh: self.mesh, cell, cells, neighbours: &neighbours };
        open().step_by(stride).filter_map(|facet| passage.stack(facet)).collect()
    }
}

/// The nodes of a side: side `2 k` has coordinate `k` of -1, side `2 k + 1` of 1, so that `side ^ 1` is the
/// opposite one.
fn side_nodes<const D: usize, const N: usize>(
    cell: &Isoparametric<D, N>,
    side: usize,
) -> impl Iterator<Item = usize> {
    (0..N).filter(move |a| (cell.nodes[*a][side / 2] > 0.0) == (side % 2 == 1))
}

/// The facet, `2 D cell + side`, behind each facet.
fn neighbours<const D: usize, const N: usize>(cell: &Isoparametric<D, N>, cells: &[[u32; N]]) -> Vec<u32> {
    let key = |i: usize| {
        // Last after sorting, in the plane: no vertex has this number.
        let mut key = [NONE; SIDE];
        let nodes = side_nodes(cell, i % (2 * D));
        key.iter_mut().zip(nodes).for_each(|(vertex, a)| *vertex = cells[i / (2 * D)][a]);
        key.sort_unstable();
        key
    };
    let mut behind = vec![NONE; 2 * D * cells.len()];
    for_each_equal(behind.len(), key, |run| {
        for pair in run.windows(2) {
            (behind[pair[0] as usize], behind[pair[1] as usize]) = (pair[1], pair[0]);
        }
    });
    behind
}

/// Ways through the cells of a mesh.
struct Passage<'a, const D: usize, const N: usize> {
    mesh: &'a Mesh,
    cell: &'a Isoparametric<D, N>,
    cells: &'a [[u32; N]],
    neighbours: &'a [u32],
}

impl<const D: usize, const N: usize> Passage<'_, D, N> {
    /// From this side of the surface. `None` if cells share a side as they may not.
    fn stack(&self, facet: usize) -> Option<CellStack> {
        let (mut element, mut side) = (facet / (2 * D), facet % (2 * D));
        let mut axes: Vec<usize> = (0..D).filter(|k| *k != side / 2).collect();
        let lengths = self.lengths(element);
        let run = |k: &usize| CellRun { length: self.run(element, *k), widths: vec![] };
        let mut stack = CellStack {
            face: axes.iter().map(|k| lengths[*k]).product(),
            heights: vec![],
            across: axes.iter().map(run).collect(),
        };
        for _ in 0..self.cells.len() {
            let lengths = self.lengths(element);
            stack.heights.push(lengths[side / 2]);
            stack.across.iter_mut().zip(&axes).for_each(|(run, k)| run.widths.push(lengths[*k]));
            let Some((next, entry)) = self.beyond(element, side ^ 1) else { return Some(stack) };
            for k in &mut axes {
                *k = self.turned(element, side ^ 1, *k, next)?;
            }
            (element, side) = (next, entry);
        }
        None
    }

    /// Length of the run of cells along axis `k` of this one [m].
    fn run(&self, element: usize, k: usize) -> f64 {
        let mut length = self.lengths(element)[k];
        for start in [2 * k, 2 * k + 1] {
            let (mut at, mut side) = (element, start);
            for _ in 0..self.cells.len() {
                let Some((next, entry)) = self.beyond(at, side) else { break };
                (at, side) = (next, entry ^ 1);
                if (at, side) == (element, start) {
                    return length;
                }
                length += self.lengths(at)[side / 2];
            }
        }
        length
    }

    /// The cell beyond a side, and its side there.
    fn beyond(&self, element: usize, side: usize) -> Option<(usize, usize)> {
        let facet = self.neighbours[2 * D * element + side];
        (facet != NONE).then_some((facet as usize / (2 * D), facet as usize % (2 * D)))
    }

    /// The axis of the cell behind `side` along which axis `k` of this cell runs.
    fn turned(&self, element: usize, side: usize, k: usize, next: usize) -> Option<usize> {
        let nodes = self.cell.nodes;
        let first = side_nodes(self.cell, side).next()?;
        let is_beside = |a: &usize| (0..D).all(|c| (nodes[*a][c] == nodes[first][c]) == (c != k));
        let second = side_nodes(self.cell, side).find(is_beside)?;
        let there = |a: usize| self.cells[next].iter().position(|v| *v == self.cells[element][a]);
        let (a, b) = (there(first)?, there(second)?);
        (0..D).find(|c| nodes[a][*c] != nodes[b][*c])
    }

    /// Lengths of a cell along its axes in its middle [m].
    fn lengths(&self, element: usize) -> [f64; D] {
        let j = self.cell.jacobian(&self.mesh.nodes::<D, N>(&self.cells[element]), &[0.0; D]);
        let mut lengths = [0.0; D];
        for (k, length) in lengths.iter_mut().enumerate() {
            *length = 2.0 * (0..D).map(|i| j[i][k] * j[i][k]).sum::<f64>().sqrt();
        }
        lengths
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build;

    fn mesh(dimension: usize, spec: serde_json::Value) -> Mesh {
        build(&serde_json::from_value(spec).unwrap(), dimension, ".".as_ref()).unwrap()
    }

    fn close(a: &[f64], b: &[f64]) -> bool {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
    }

    /// In a grid every stack has the cells along an edge of the box, and runs as long as the others.
    #[test]
    fn stacks_of_boxes_are_their_columns_of_cells() {
        for (cells, size, element) in [
            (vec![5, 3], vec![2.0, 0.3], "quadrilateral"),
            (vec![3, 4, 2], vec![1.0, 0.2, 0.5], "hexahedron"),
        ] {
            let grid = serde_json::json!({ "cells": cells, "size": size, "element": element });
            let mesh = mesh(cells.len(), serde_json::json!({ "grid": grid }));
            let stacks = mesh.stacks(usize::MAX);
            let (volume, width) = (size.iter().product::<f64>(), |k: usize| size[k] / cells[k] as f64);
            for axis in 0..cells.len() {
                let along = |stack: &&CellStack| close(&stack.heights, &vec![width(axis); cells[axis]]);
                let along: Vec<&CellStack> = stacks.iter().filter(along).collect();
                let faces: f64 = along.iter().map(|stack| stack.face).sum();
                assert!((faces - 2.0 * volume / size[axis]).abs() < 1e-12, "axis {axis}: {faces}");
                let others: Vec<usize> = (0..cells.len()).filter(|k| *k != axis).collect();
                for stack in along {
                    assert_eq!(stack.across.len(), others.len());
                    for (run, k) in stack.across.iter().zip(&others) {
                        assert!((run.length - size[*k]).abs() < 1e-12, "{run:?}");
                        assert!(close(&run.widths, &vec![width(*k); cells[axis]]), "{run:?}");
                    }
                }
            }
            assert!((1..=7).contains(&mesh.stacks(7).len()));
        }
    }

    /// Runs around a ring close; cells whose nodes are turned have other axes, which are followed.
    #[test]
    fn runs_close_and_axes_that_turn_are_followed() {
        let place = |i: usize| {
            let (turn, radius) = ((i / 3) as f64 * std::f64::consts::TAU / 96.0, 0.9 + 0.1 * (i % 3) as f64);
            [radius * turn.cos(), radius * turn.sin()]
        };
        let points: Vec<[f64; 2]> = (0..3 * 96).map(place).collect();
        let cell = |i: usize| {
            let (a, b) = (3 * (i / 2) + i % 2, 3 * ((i / 2 + 1) % 96) + i % 2);
            [a, a + 1, b + 1, b]
        };
        let cells: Vec<[usize; 4]> = (0..2 * 96).map(cell).collect();
        let ring = serde_json::json!({ "inline": { "points": points, "quadrilaterals": cells } });
        let ring = mesh(2, ring).stacks(usize::MAX);
        assert_eq!(ring.len(), 2 * 96);
        for stack in ring {
            assert!(stack.heights.len() == 2 && stack.across.len() == 1, "{stack:?}");
            // Along the middle of the cells of one of the two rows.
            let radius = stack.across[0].length / std::f64::consts::TAU;
            assert!((radius - 0.95).abs() < 1e-3 || (radius - 1.05).abs() < 1e-3, "{radius}");
        }
        let grid =
            serde_json::json!({ "cells": [3, 2, 4], "size": [1.0, 0.2, 0.5], "element": "hexahedron" });
        let straight = mesh(3, serde_json::json!({ "grid": grid }));
        let mut turned = straight.clone();
        // A third of a turn about the diagonal from node 0 to node 6 in every other cell.
        for cell in turned.blocks[0].vertices.as_chunks_mut::<8>().0.iter_mut().step_by(2) {
            *cell = [0, 3, 7, 4, 1, 2, 6, 5].map(|a| cell[a]);
        }
        let known = |mesh: &Mesh| {
            let mut rows: Vec<String> = vec![];
            for mut stack in mesh.stacks(usize::MAX) {
                stack.across.sort_by(|a, b| a.length.total_cmp(&b.length));
                rows.push(format!("{:.6?}", stack));
            }
            rows.sort();
            rows
        };
        assert_eq!(known(&straight), known(&turned));
        assert_ne!(straight.blocks, turned.blocks);
    }

    #[test]
    fn simplices_have_no_stacks() {
        let grid = serde_json::json!({ "grid": { "cells": [2, 2], "size": [1.0, 1.0] } });
        assert!(mesh(2, grid).stacks(9).is_empty());
    }
}
