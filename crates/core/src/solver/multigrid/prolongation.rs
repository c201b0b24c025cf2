//! Interpolation from a coarse multigrid level to the next finer one.

use rayon::prelude::*;

use super::smoother::{Row, TASK_ROWS};

/// Prolongation matrix `P` with one weight for all components of a vertex: `u_fine = P u_coarse`. A fine
/// row without entries takes no part in the coarse level.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prolongation {
    /// Entries of fine row `i` are `start[i]..start[i + 1]`, columns ascending.
    pub(super) start: Vec<u32>,
    pub(super) column: Vec<u32>,
    pub(super) weight: Vec<f64>,
    /// `P^T` by rows.
    transposed: Transposed,
}

#[derive(Clone, Debug, Default, PartialEq)]
struct Transposed {
    start: Vec<u32>,
    row: Vec<u32>,
    weight: Vec<f32>,
}

impl Prolongation {
    /// Builds the matrix from the entries of each fine row.
    pub(super) fn new(rows: &[Vec<(u32, f64)>], columns: usize) -> Self {
        let mut p = Prolongation { start: vec![0], ..Default::default() };
        for row in rows {
            let mut row = row.clone();
            row.sort_unstable_by_key(|(column, _)| *column);
            p.column.extend(row.iter().map(|(column, _)| *column));
            p.weight.extend(row.iter().map(|(_, weight)| *weight));
            p.start.push(p.column.len() as u32);
        }
        let mut start = vec![0u32; columns + 1];
        p.column.iter().for_each(|c| start[*c as usize + 1] += 1);
        (1..=columns).for_each(|c| start[c] += start[c - 1]);
        let (mut next, entries) = (start.clone(), p.column.len());
        let mut transposed = Transposed { start, row: vec![0; entries], weight: vec![0.0; entries] };
        for i in 0..rows.len() {
            for (column, weight) in p.row(i) {
                let at = next[column] as usize;
                (transposed.row[at], transposed.weight[at]) = (i as u32, weight as f32);
                next[column] += 1;
            }
        }
        Prolongation { transposed, ..p }
    }

    /// Returns the number of fine rows.
    pub fn rows(&self) -> usize {
        self.start.len() - 1
    }

    /// Returns the number of coarse nodes.
    pub fn columns(&self) -> usize {
        self.transposed.start.len() - 1
    }

    /// Returns the entries of fine row `i`.
    #[inline(always)]
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> {
        let range = self.start[i] as usize..self.start[i + 1] as usize;
        self.column[range.clone()].iter().map(|c| *c as usize).zip(self.weight[range].iter().copied())
    }

    /// Returns the fine rows that coarse node `c` reaches.
    pub fn support(&self, c: usize) -> &[u32] {
        let Transposed { start, row, .. } = &self.transposed;
        &row[start[c] as usize..start[c + 1] as usize]
    }

    /// Computes `coarse = P^T fine`.
    pub(super) fn restrict(&self, fine: &[Row], coarse: &mut [Row]) {
        let Transposed { start, row, weight } = &self.transposed;
        let one = |(c, out): (usize, &mut Row)| {
            let range = start[c] as usize..start[c + 1] as usize;
            let mut sum = [0.0; 4];
            for (i, w) in row[range.clone()].iter().zip(&weight[range]) {
                let fine = &fine[*i as usize];
                for k in 0..4 {
                    sum[k] += w * fine[k];
                }
            }
            *out = sum;
        };
        for_each(coarse, one);
    }

    /// Computes `fine += P coarse`.
    pub(super) fn add(&self, coarse: &[Row], fine: &mut [Row]) {
        let one = |(i, out): (usize, &mut Row)| {
            for (c, w) in self.row(i) {
                for k in 0..4 {
                    out[k] += w as f32 * coarse[c][k];
                }
            }
        };
        for_each(fine, one);
    }
}

/// Runs `one` on all rows, with their numbers.
fn for_each(rows: &mut [Row], one: impl Fn((usize, &mut Row)) + Send + Sync) {
    if rows.len() < 2 * TASK_ROWS || rayon::current_num_threads() == 1 {
        rows.iter_mut().enumerate().for_each(one);
    } else {
        rows.par_iter_mut().enumerate().with_min_len(TASK_ROWS).for_each(one);
    }
}
