//! Coarse-level matrix `P^T A P`: the structure is built once, the values whenever `A` changes.

use std::ops::Range;

use rayon::prelude::*;

use super::prolongation::Prolongation;
use crate::solver::block_matrix::{Block, BlockMatrix};

/// Coarse rows per task.
const TASK_ROWS: usize = 512;

/// Structure of the triple product `P^T A P`.
///
/// A task computes some rows of the coarse matrix from all fine rows they reach; a fine row that reaches
/// two tasks is multiplied twice. Each entry is summed in the order of the fine rows, whatever the number
/// of threads.
#[derive(Debug)]
pub struct Galerkin<const D: usize> {
    /// The columns of row `i` of `A P` are `start[i]..start[i + 1]`.
    start: Vec<u32>,
    column: Vec<u32>,
    /// The products of entry `k` of `P` with row `i` of `A P` that lie in the upper triangle go to the
    /// blocks `target[target_start[k]..target_start[k + 1]]`; they belong to the last columns of that
    /// row.
    target_start: Vec<u32>,
    target: Vec<u32>,
    /// For each block below the diagonal, in order, the block that it is the transpose of.
    mirrored: Vec<u32>,
    tasks: Vec<Task<D>>,
}

#[derive(Debug)]
struct Task<const D: usize> {
    /// Coarse rows.
    coarse: Range<usize>,
    /// Fine rows that they reach.
    fine: Vec<u32>,
    /// Position of each column in a row of `A P`.
    position: Vec<u32>,
    /// One row of `A P`.
    row: Vec<Block<D>>,
}

impl<const D: usize> Galerkin<D> {
    /// Builds the plan for matrices with the structure of `fine`, and the structure of the coarse matrix.
    pub fn new(fine: &BlockMatrix<D>, p: &Prolongation) -> (Self, BlockMatrix<D>) {
        // Columns of each row of A P.
        let coarse_rows = p.columns();
        let mut seen = vec![u32::MAX; coarse_rows];
        let (mut start, mut column) = (vec![0], vec![]);
        for i in 0..p.rows() {
            let first = column.len();
            if p.start[i] < p.start[i + 1] {
                for (j, _) in fine.row(i) {
                    for (c, _) in p.row(j) {
                        if std::mem::replace(&mut seen[c], i as u32) != i as u32 {
                            column.push(c as u32);
                        }
                    }
                }
            }
            column[first..].sort_unstable();
            start.push(column.len() as u32);
        }
        let of_row = |i: usize| &column[start[i] as usize..start[i + 1] as usize];
        // Pattern of the coarse matrix.
        seen.fill(u32::MAX);
        let (mut coarse_start, mut coarse_column) = (vec![0], vec![]);
        for c in 0..coarse_rows {
            let first = coarse_column.len();
            for &i in p.support(c) {
                for &other in of_row(i as usize) {
                    if std::mem::replace(&mut seen[other as usize], c as u32) != c as u32 {
                        coarse_column.push(other);
                    }
                }
            }
            coarse_column[first..].sort_unstable();
            coarse_start.push(coarse_column.len() as u32);
        }
        let coarse = BlockMatrix::<D>::zero(coarse_start, coarse_column);
        let blocks = |c: usize| coarse.row_start[c] as usize..coarse.row_start[c + 1] as usize;
        // Target block of each product.
        let (mut target_start, mut target) = (vec![0], vec![]);
        for i in 0..p.rows() {
            for (c, _) in p.row(i) {
                let mut at = coarse.diagonal[c];
                for &other in of_row(i).iter().filter(|other| **other >= c as u32) {
                    while coarse.column[at as usize] < other {
                        at += 1;
                    }
                    target.push(at);
                }
                target_start.push(target.len() as u32);
            }
        }
        // Source of each block below the diagonal.
        let mut next: Vec<u32> = coarse.diagonal.iter().map(|at| at + 1).collect();
        let mut mirrored = vec![];
        for c in 0..coarse_rows {
            for &other in &coarse.column[blocks(c).start..coarse.diagonal[c] as usize] {
                // Rows ascend, and so do the columns of the mirrored row.
                mirrored.push(next[other as usize]);
                next[other as usize] += 1;
            }
        }
        // Tasks, with the fine rows that each needs.
        let widest = (0..p.rows()).map(|i| of_row(i).len()).max().unwrap_or(0);
        let tasks = (0..coarse_rows).step_by(TASK_ROWS).map(|first| {
            let coarse = first..(first + TASK_ROWS).min(coarse_rows);
            let mut fine: Vec<u32> = coarse.clone().flat_map(|c| p.support(c)).copied().collect();
            fine.sort_unstable();
            fine.dedup();
            Task { coarse, fine, position: vec![0; coarse_rows], row: vec![[[0.0; D]; D]; widest] }
        });
        let tasks = tasks.collect();
        (Galerkin { start, column, target_start, target, mirrored, tasks }, coarse)
    }

    /// Computes `coarse = P^T fine P` without the diagonal entries of `fine` at constrained coordinates:
    /// bit `k` of `held[i]` marks component `k` of row `i`; an empty slice marks none.
    pub fn compute(
        &mut self,
        fine: &BlockMatrix<D>,
        p: &Prolongation,
        held: &[u8],
        coarse: &mut BlockMatrix<D>,
    ) {
        let Galerkin { start, column, target_start, target, mirrored, tasks } = self;
        let map = ProductLists { start, column, target_start, target };
        let BlockMatrix { row_start, value, diagonal, .. } = coarse;
        // Upper triangle, by tasks.
        if rayon::current_num_threads() == 1 || tasks.len() == 1 {
            tasks.iter_mut().for_each(|task| {
                let blocks = row_start[task.coarse.start] as usize..row_start[task.coarse.end] as usize;
                task.run(&map, fine, p, held, blocks.start, &mut value[blocks.clone()]);
            });
        } else {
            let mut rest = &mut value[..];
            let mut parts = Vec::with_capacity(tasks.len());
            for task in tasks.iter_mut() {
                let (first, end) = (row_start[task.coarse.start], row_start[task.coarse.end]);
                let (own, others) = rest.split_at_mut((end - first) as usize);
                parts.push((task, first as usize, own));
                rest = others;
            }
            parts.into_par_iter().for_each(|(task, first, own)| task.run(&map, fine, p, held, first, own));
        }
        // Lower triangle by symmetry.
        let mut next = mirrored.iter();
        for (row, diagonal) in diagonal.iter().enumerate() {
            for (at, from) in (row_start[row] as usize..*diagonal as usize).zip(&mut next) {
                let block = value[*from as usize];
                for k in 0..D {
                    for l in 0..D {
                        value[at][k][l] = block[l][k];
                    }
                }
            }
        }
    }
}

/// Lists of a [`Galerkin`].
struct ProductLists<'a> {
    start: &'a [u32],
    column: &'a [u32],
    target_start: &'a [u32],
    target: &'a [u32],
}

impl<const D: usize> Task<D> {
    /// Computes the task's rows of the coarse matrix, which start at block `first`.
    fn run(
        &mut self,
        map: &ProductLists<'_>,
        fine: &BlockMatrix<D>,
        p: &Prolongation,
        held: &[u8],
        first: usize,
        out: &mut [Block<D>],
    ) {
        let Task { coarse, fine: fine_rows, position, row } = self;
        out.fill([[0.0; D]; D]);
        for i in fine_rows.iter().map(|i| *i as usize) {
            // Row i of A P.
            let columns = &map.column[map.start[i] as usize..map.start[i + 1] as usize];
            columns.iter().enumerate().for_each(|(at, c)| position[*c as usize] = at as u32);
            let row = &mut row[..columns.len()];
            row.fill([[0.0; D]; D]);
            for (j, block) in fine.row(i) {
                let free;
                let mut block = block;
                if j == i && held.get(i).is_some_and(|held| *held != 0) {
                    free = without_held(block, held[i]);
                    block = &free;
                }
                for (c, weight) in p.row(j) {
                    add(&mut row[position[c] as usize], weight, block);
                }
            }
            // Add its products with the entries of row i of P to the coarse rows of this task.
            for k in p.start[i] as usize..p.start[i + 1] as usize {
                if coarse.contains(&(p.column[k] as usize)) {
                    let targets = &map.target[map.target_start[k] as usize..map.target_start[k + 1] as usize];
                    let row = &row[columns.len() - targets.len()..];
                    for (target, block) in targets.iter().zip(row) {
                        add(&mut out[*target as usize - first], p.weight[k], block);
                    }
                }
            }
        }
    }
}

/// Copies a diagonal block with zeros at constrained components.
fn without_held<const D: usize>(block: &Block<D>, held: u8) -> Block<D> {
    let mut free = *block;
    for k in (0..D).filter(|k| held >> k & 1 == 1) {
        free[k][k] = 0.0;
    }
    free
}

#[inline(always)]
fn add<const D: usize>(sum: &mut Block<D>, weight: f64, block: &Block<D>) {
    for k in 0..D {
        for l in 0..D {
            sum[k][l] += weight * block[k][l];
        }
    }
}
