//! Superconvergent patch recovery.
//!
//! A patch consists of the cells around a corner inside the body. A polynomial is fitted to the samples of
//! these cells and gives the value at the corner. Values elsewhere are means of patches:
//! - a node in the middle of an edge, a face or a cell: of the patches of its corners inside the body;
//! - a node of the boundary without such corners: of the patches of all inner corners of its cells;
//! - a node whose cells have no inner corner: of patches about its corners, each of the cells there and of
//!   their neighbours.

use super::cells::{Cells, NodalRows, Point, TENSOR, Tensor, row_of};
use super::fit::{AXES, FitFrame, TensorPolynomial};
use crate::algebra::cross;

/// Recovers the tensor at all nodes.
pub(super) fn patched(cells: &Cells) -> NodalRows {
    let patches = RecoveryPatches::new(cells);
    let own = patches.fitted(|row| !patches.is_on_boundary[row]);
    let has_inner = |row: usize| patches.inner_around(&[row]).next().is_some();
    let fallback = patches.fitted(|row| patches.is_on_boundary[row] && !has_inner(row));
    let element = &cells.element;
    let parents: Vec<Vec<usize>> = (0..element.nodes.len()).map(|node| element.parents(node)).collect();
    let mut values: Vec<Option<Tensor>> = vec![None; patches.vertices.len()];
    for nodes in cells.cells() {
        for (vertex, parents) in nodes.iter().zip(&parents) {
            let row = row_of(&patches.vertices, *vertex);
            if values[row].is_some() {
                continue;
            }
            let at = cells.at.rest_point(*vertex);
            let corners: Vec<usize> =
                parents.iter().map(|parent| row_of(&patches.vertices, nodes[*parent])).collect();
            let inner = mean(corners.iter().filter_map(|corner| own[*corner].as_ref()).map(value_at(&at)));
            let around = || {
                mean(
                    patches.inner_around(&corners).filter_map(|inner| own[inner].as_ref()).map(value_at(&at)),
                )
            };
            let alone =
                || mean(corners.iter().filter_map(|corner| fallback[*corner].as_ref()).map(value_at(&at)));
            values[row] = inner.or_else(around).or_else(alone);
        }
    }
    let lowered = own.iter().chain(&fallback).flatten().filter(|(_, skipped)| *skipped > 0).count();
    let values = values.into_iter().map(|value| value.unwrap_or([f64::NAN; TENSOR])).collect();
    NodalRows { vertices: patches.vertices, values, lowered }
}

/// Returns the value of a fitted polynomial at a point.
fn value_at(at: &Point) -> impl Fn(&(TensorPolynomial, usize)) -> Tensor {
    move |(polynomial, _)| polynomial.at(at)
}

/// Returns the mean of tensors; `None` without any.
fn mean(values: impl Iterator<Item = Tensor>) -> Option<Tensor> {
    let (mut sum, mut count) = ([0.0; TENSOR], 0.0);
    for value in values {
        sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += value);
        count += 1.0;
    }
    (count > 0.0).then(|| sum.map(|entry| entry / count))
}

/// Cells around every corner.
struct RecoveryPatches<'a> {
    cells: &'a Cells<'a>,
    /// Vertices in ascending order; the row of a vertex is its place here.
    vertices: Vec<u32>,
    /// Cells around each row that is a corner; empty for others.
    around: Vec<Vec<u32>>,
    /// True for corners of a side that only one cell has.
    is_on_boundary: Vec<bool>,
}

impl<'a> RecoveryPatches<'a> {
    fn new(cells: &'a Cells<'a>) -> Self {
        let vertices = cells.distinct_vertices();
        let mut around = vec![vec![]; vertices.len()];
        let mut sides = vec![];
        for (cell, nodes) in cells.cells().enumerate() {
            for vertex in &nodes[..cells.element.corners] {
                around[row_of(&vertices, *vertex)].push(cell as u32);
            }
            sides.extend(cells.element.sides.iter().map(|side| {
                let mut corners = [u32::MAX; 4];
                corners.iter_mut().zip(*side).for_each(|(corner, node)| *corner = nodes[*node]);
                corners.sort_unstable();
                corners
            }));
        }
        sides.sort_unstable();
        let mut is_on_boundary = vec![false; vertices.len()];
        for same in sides.chunk_by(|a, b| a == b).filter(|same| same.len() == 1) {
            for vertex in same[0].iter().filter(|vertex| **vertex != u32::MAX) {
                is_on_boundary[row_of(&vertices, *vertex)] = true;
            }
        }
        RecoveryPatches { cells, vertices, around, is_on_boundary }
    }

    /// Returns the rows of the corners of these cells, in ascending order.
    fn corners(&self, cells: &[u32]) -> Vec<usize> {
        let element = &self.cells.element;
        let nodes =
            |cell: &u32| &self.cells.vertices[*cell as usize * element.nodes.len()..][..element.corners];
        let mut rows: Vec<usize> =
            cells.iter().flat_map(nodes).map(|vertex| row_of(&self.vertices, *vertex)).collect();
        rows.sort_unstable();
        rows.dedup();
        rows
    }

    /// Returns the rows of the corners inside the body of the cells that have all these corners.
    fn inner_around(&self, corners: &[usize]) -> impl Iterator<Item = usize> {
        let mut cells = corners.first().map_or(vec![], |corner| self.around[*corner].clone());
        cells.retain(|cell| corners.iter().all(|corner| self.around[*corner].contains(cell)));
        self.corners(&cells).into_iter().filter(|row| !self.is_on_boundary[*row])
    }

    /// Fits polynomials at the corners that `is_wanted` selects: inside the body to the cells around the
    /// corner, on the boundary to these and their neighbours. The number beside is that of the better
    /// polynomials that the samples do not determine.
    fn fitted(&self, is_wanted: impl Fn(usize) -> bool) -> Vec<Option<(TensorPolynomial, usize)>> {
        let fit = |row: usize| {
            if self.around[row].is_empty() || !is_wanted(row) {
                return None;
            }
            let mut members = self.around[row].clone();
            if self.is_on_boundary[row] {
                members =
                    self.corners(&members).into_iter().flat_map(|row| &self.around[row]).copied().collect();
                members.sort_unstable();
                members.dedup();
            }
            self.fit(self.cells.at.rest_point(self.vertices[row]), &members)
        };
        (0..self.vertices.len()).map(fit).collect()
    }

    /// Fits a polynomial about `origin` to the samples of some cells.
    fn fit(&self, origin: Point, members: &[u32]) -> Option<(TensorPolynomial, usize)> {
        let element = &self.cells.element;
        let (mut points, mut values) = (vec![], vec![]);
        for cell in members {
            let (of_cell, tensors) = self.cells.patch_samples().of_cell(*cell as usize);
            points.extend(of_cell);
            values.extend(tensors);
        }
        let axes = if element.is_sheet { self.axes_of_sheet(members) } else { AXES };
        let frame = FitFrame::new(origin, axes, &points);
        TensorPolynomial::fitted(frame, element.dimension, element.polynomials(), (&points, &values))
    }

    /// Returns two axes in the mean plane of some triangles, and their mean normal.
    fn axes_of_sheet(&self, members: &[u32]) -> [Point; 3] {
        let mut normal = [0.0; 3];
        for cell in members {
            let corner = |i: usize| self.cells.at.rest_point(self.cells.vertices[*cell as usize * 3 + i]);
            let edge = |i: usize| [0, 1, 2].map(|c| corner(i)[c] - corner(0)[c]);
            let area = cross(&edge(1), &edge(2));
            (0..3).for_each(|c| normal[c] += area[c]);
        }
        let normal = unit(normal);
        // The axis of space that is farthest from the normal.
        let least = (0..3).min_by(|a, b| normal[*a].abs().total_cmp(&normal[*b].abs())).unwrap_or(0);
        let first = unit(cross(&AXES[least], &normal));
        [first, cross(&normal, &first), normal]
    }
}

/// Returns a vector of length 1; zero stays zero.
fn unit(vector: Point) -> Point {
    let length = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
    vector.map(|x| if length > 0.0 { x / length } else { 0.0 })
}
