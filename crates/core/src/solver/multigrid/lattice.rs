//! Coarse levels from vertex positions: nodes of a regular lattice, split where the mesh is not
//! connected.
//!
//! Space is divided into cubes and each cube into Kuhn simplices. Each vertex gets the barycentric
//! weights of its simplex, so that affine fields, and with them small rotations, are reproduced. Kuhn
//! 1960, "Some combinatorial lemmas in topology".

use super::prolongation::Prolongation;
use crate::solver::block_matrix::BlockMatrix;

/// Smaller weights are dropped: they would make nodes nearly linearly dependent.
const SMALLEST_WEIGHT: f64 = 1e-5;
/// A vertex without neighbours within this fraction of the lattice spacing is carried over: the lattice
/// would have more nodes than there are vertices.
const CARRIED_OVER: f64 = 0.9;

/// A coarse level.
pub struct Coarsening<const D: usize> {
    /// Interpolation from its nodes to the rows of the finer level.
    pub prolongation: Prolongation,
    /// Positions of its nodes.
    pub positions: Vec<[f64; D]>,
}

/// Mean edge length; zero without edges.
pub(super) fn mean_edge<const D: usize>(matrix: &BlockMatrix<D>, x: &[[f64; D]]) -> f64 {
    let (mut sum, mut count) = (0.0, 0u64);
    for i in 0..matrix.rows() {
        for (j, _) in matrix.row(i).filter(|(j, _)| *j > i) {
            sum += distance(&x[i], &x[j]);
            count += 1;
        }
    }
    if count == 0 { 0.0 } else { sum / count as f64 }
}

/// Builds the coarse level for the rows of `matrix` at `x` from a lattice of this `spacing`. Rows without
/// neighbours take no part: the smoother solves them.
pub fn coarsen<const D: usize>(matrix: &BlockMatrix<D>, x: &[[f64; D]], spacing: f64) -> Coarsening<D> {
    let rows = matrix.rows();
    let mut origin = [f64::INFINITY; D];
    for x in x {
        for k in 0..D {
            origin[k] = origin[k].min(x[k]);
        }
    }
    // Shifted off the vertices: in a regular mesh they would lie between two cubes, assigned by rounding.
    (0..D).for_each(|k| origin[k] -= (0.37 + 0.1 * k as f64) * spacing);
    let piece = pieces(matrix);
    let alone = |i: usize| matrix.row_start[i + 1] - matrix.row_start[i] == 1;
    let far_off =
        |i: usize| matrix.row(i).all(|(j, _)| j == i || distance(&x[i], &x[j]) > CARRIED_OVER * spacing);
    let mut carried: Vec<bool> = (0..rows).map(|i| !alone(i) && far_off(i)).collect();
    // Lattice corners of each row, with their weights.
    let mut corners = vec![];
    let mut start = vec![0];
    for i in 0..rows {
        if !alone(i) && !carried[i] {
            barycentric(&x[i], &origin, spacing, &mut corners);
        }
        start.push(corners.len());
    }
    let mut keys: Vec<[i64; D]> = corners.iter().map(|(key, _)| *key).collect();
    keys.sort_unstable();
    keys.dedup();
    let lattice: Vec<u32> =
        corners.iter().map(|(key, _)| keys.partition_point(|other| other < key) as u32).collect();
    let (node, owner) = split(matrix, &start, &lattice, keys.len());
    // A connected piece with no fewer nodes than vertices is carried over.
    let count = piece.iter().map(|p| *p as usize + 1).max().unwrap_or(0);
    let (mut vertices, mut nodes) = (vec![0u32; count], vec![0u32; count]);
    piece.iter().for_each(|p| vertices[*p as usize] += 1);
    carried.iter().zip(&piece).filter(|(carried, _)| **carried).for_each(|(_, p)| nodes[*p as usize] += 1);
    owner.iter().for_each(|i| nodes[piece[*i as usize] as usize] += 1);
    let stays = |i: usize| nodes[piece[i] as usize] >= vertices[piece[i] as usize];
    (0..rows).filter(|i| !alone(*i) && stays(*i)).for_each(|i| carried[i] = true);
    // Numbers of the remaining nodes.
    let mut number = vec![u32::MAX; owner.len()];
    let mut positions: Vec<[f64; D]> = vec![];
    for (n, i) in owner.iter().enumerate().filter(|(_, i)| !stays(**i as usize)) {
        number[n] = positions.len() as u32;
        let corner = (start[*i as usize]..start[*i as usize + 1]).find(|c| node[*c] == n as u32);
        let key = corner.map_or([0; D], |c| corners[c].0);
        positions.push(std::array::from_fn(|k| origin[k] + spacing * key[k] as f64));
    }
    let mut entries: Vec<Vec<(u32, f64)>> = Vec::with_capacity(rows);
    for i in 0..rows {
        if carried[i] {
            entries.push(vec![(positions.len() as u32, 1.0)]);
            positions.push(x[i]);
        } else {
            let own = start[i]..start[i + 1];
            let entry = |(node, (_, weight)): (&u32, &(_, f64))| (number[*node as usize], *weight);
            entries.push(node[own.clone()].iter().zip(&corners[own]).map(entry).collect());
        }
    }
    Coarsening { prolongation: Prolongation::new(&entries, positions.len()), positions }
}

/// Appends the corners of the Kuhn simplex around `x` with its barycentric coordinates.
fn barycentric<const D: usize>(
    x: &[f64; D],
    origin: &[f64; D],
    spacing: f64,
    corners: &mut Vec<([i64; D], f64)>,
) {
    let mut corner = [0i64; D];
    let mut part = [0.0; D];
    for k in 0..D {
        let u = (x[k] - origin[k]) / spacing;
        corner[k] = u.floor() as i64;
        part[k] = u - u.floor();
    }
    // From the lowest corner of the cube to the highest, first along the axis of the largest coordinate.
    let mut axes: [usize; D] = std::array::from_fn(|k| k);
    axes.sort_by(|a, b| part[*b].total_cmp(&part[*a]));
    let first = corners.len();
    let mut before = 1.0;
    for step in 0..=D {
        let after = if step < D { part[axes[step]] } else { 0.0 };
        if before - after >= SMALLEST_WEIGHT {
            corners.push((corner, before - after));
        }
        if step < D {
            corner[axes[step]] += 1;
            before = after;
        }
    }
    // Renormalised after dropped weights: constants are reproduced exactly.
    let sum: f64 = corners[first..].iter().map(|(_, weight)| weight).sum();
    corners[first..].iter_mut().for_each(|(_, weight)| *weight /= sum);
}

/// Assigns one node to each connected piece of the rows that a lattice corner reaches. Returns the node
/// of each entry and one row of each node. Without this the two prongs of a fork would move together.
fn split<const D: usize>(
    matrix: &BlockMatrix<D>,
    start: &[usize],
    lattice: &[u32],
    count: usize,
) -> (Vec<u32>, Vec<u32>) {
    // Rows that each lattice corner reaches.
    let mut support: Vec<Vec<(u32, u32)>> = vec![vec![]; count];
    for i in 0..matrix.rows() {
        for entry in start[i]..start[i + 1] {
            support[lattice[entry] as usize].push((i as u32, entry as u32));
        }
    }
    let (mut node, mut owner) = (vec![0; lattice.len()], vec![]);
    // The corner that last reached each row, and its piece there.
    let mut mark = vec![(u32::MAX, u32::MAX); matrix.rows()];
    let mut stack = vec![];
    for (corner, support) in support.iter().enumerate() {
        let corner = corner as u32;
        support.iter().for_each(|(i, _)| mark[*i as usize] = (corner, u32::MAX));
        for (i, entry) in support {
            if mark[*i as usize].1 == u32::MAX {
                let piece = owner.len() as u32;
                owner.push(*i);
                mark[*i as usize].1 = piece;
                stack.push(*i);
                while let Some(from) = stack.pop() {
                    for (j, _) in matrix.row(from as usize) {
                        if mark[j] == (corner, u32::MAX) {
                            mark[j].1 = piece;
                            stack.push(j as u32);
                        }
                    }
                }
            }
            node[*entry as usize] = mark[*i as usize].1;
        }
    }
    (node, owner)
}

/// Returns the connected piece of the mesh of each row.
fn pieces<const D: usize>(matrix: &BlockMatrix<D>) -> Vec<u32> {
    let mut piece = vec![u32::MAX; matrix.rows()];
    let (mut count, mut stack) = (0, vec![]);
    for i in 0..matrix.rows() {
        if piece[i] != u32::MAX {
            continue;
        }
        piece[i] = count;
        stack.push(i);
        while let Some(from) = stack.pop() {
            for (j, _) in matrix.row(from) {
                if piece[j] == u32::MAX {
                    piece[j] = count;
                    stack.push(j);
                }
            }
        }
        count += 1;
    }
    piece
}

fn distance<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (0..D).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each edge counts once, and diagonal blocks are no edges.
    #[test]
    fn the_mean_edge_is_that_of_the_neighbours() {
        // A triangle of sides 3, 4, 5, and a vertex by itself.
        let row_start = vec![0, 3, 6, 9, 10];
        let matrix = BlockMatrix::<2>::zero(row_start, vec![0, 1, 2, 0, 1, 2, 0, 1, 2, 3]);
        let x = [[0.0, 0.0], [3.0, 0.0], [3.0, 4.0], [100.0, 0.0]];
        assert_eq!(mean_edge(&matrix, &x), 4.0);
        assert_eq!(mean_edge(&BlockMatrix::<2>::zero(vec![0, 1], vec![0]), &x[..1]), 0.0);
    }
}
