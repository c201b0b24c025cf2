//! Sparse Hessian of all terms, assembled from the small dense Hessians of their stencils (elements).
//!
//! Stencils are processed in groups that fit the cache. The term writes their Hessians, which are summed
//! block by block within the group; then each row of the matrix adds the few groups that touch it, in a
//! fixed order. Groups depend on the mesh alone, so that the matrix is bit-identical on any number of
//! threads.

mod changing;
#[cfg(test)]
mod tests;

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::ops::Range;

use rayon::prelude::*;

use super::block_matrix::{Block, BlockMatrix};
use crate::energy::Stencils;
use crate::lanes::{Kernel, Lanes, dispatch, prefetch};
use crate::material::Psd;
use crate::system::System;
use changing::Changing;

/// Stencils per group.
const GROUP: usize = 512;
/// Most tasks that groups are distributed to.
const MAX_TASKS: usize = 32;
/// Rows per task.
const TASK_ROWS: usize = 512;
/// Prefetch distance, in sums.
const SOURCES_AHEAD: usize = 24;
/// Slot of a block that belongs to a constrained vertex.
const NOWHERE: u32 = u32::MAX;

/// Numbers of vertex pairs by key. The standard hasher resists attacks, but would take most of the time
/// of building a structure.
type PairNumbers = HashMap<u64, usize, BuildHasherDefault<PairHasher>>;

/// Fibonacci hashing: Knuth 1998, *The Art of Computer Programming*, volume 3, section 6.4.
#[derive(Clone, Copy, Debug, Default)]
struct PairHasher(u64);

impl Hasher for PairHasher {
    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.write_u64(u64::from(*byte)));
    }

    fn write_u64(&mut self, number: u64) {
        let product = (self.0 ^ number).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        self.0 = product ^ (product >> 32);
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

/// Factors in `A = inertia M + stiffness d2E/dx2 + damping d2R/dv2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// Factor of the mass.
    pub inertia: f64,
    /// Factor of the Hessian of the energy.
    pub stiffness: f64,
    /// Factor of the damping matrix.
    pub damping: f64,
}

/// Configuration at which the matrix is assembled.
#[derive(Clone, Copy, Debug)]
pub struct At<'a> {
    /// Positions, flat [m].
    pub x: &'a [f64],
    /// Velocities, flat [m/s]; used only with dissipation.
    pub v: &'a [f64],
    /// Form of the element Hessians, exact or projected.
    pub psd: Psd,
    /// Positions from which pressures are predicted, with exact Hessians: see
    /// [`predicted_hessians`](crate::energy::PredictedStresses::predicted_hessians).
    pub predicted_from: Option<&'a [f64]>,
}

/// Assembles the matrix of one system. Rows and columns of constrained coordinates are zero except for
/// the diagonal.
pub struct Assembler<const D: usize> {
    matrix: BlockMatrix<D>,
    terms: Vec<TermPlan<D>>,
    /// Sums of all groups, one block after another.
    sums: Vec<Block<D>>,
    /// For each stored block, the block of the upper triangle that it equals or is the transpose of.
    upper: Vec<u32>,
    /// The sums of block `i` of the upper triangle are `source[source_start[i]..source_start[i + 1]]`,
    /// doubled; odd values are transposed.
    source_start: Vec<u32>,
    source: Vec<u32>,
    /// True for each coordinate that was constrained when the structure was built.
    held: Vec<bool>,
    /// Structure version of the system.
    structure: u64,
    /// Version of the matrix entries.
    entries: u64,
    /// For each row, the block for its next transpose while the matrix is filled.
    next_transpose: Vec<u32>,
    /// Matrix with the blocks of changing stencils.
    changing: Changing<D>,
}

/// Assembly plan of one term.
struct TermPlan<const D: usize> {
    /// Index of the term in the system.
    term: usize,
    /// True for a dissipative term.
    dissipative: bool,
    /// Vertex pairs `a <= b` per stencil.
    pairs: usize,
    groups: Vec<StencilGroup>,
    /// Pairs of different positions in a stencil with the same vertex, by their number among all pairs,
    /// ascending. Their block and its transpose both add to the diagonal.
    repeated: Vec<usize>,
    /// For each pair of each stencil, its sum within the group, doubled; odd values are transposed. Sums
    /// have the orientation of the first stencil of the group, so that few are transposed.
    slot: Vec<u32>,
    /// Scratch memory for the Hessians of a group, one per task.
    scratch: Vec<Vec<Block<D>>>,
}

/// A few hundred stencils.
struct StencilGroup {
    stencils: Range<usize>,
    sums: Range<usize>,
}

impl<const D: usize> Assembler<D> {
    /// Builds the structure for `system` with its current constraints.
    pub fn new(system: &mut System) -> Self {
        let held: Vec<bool> = system.inverse_mass().iter().map(|w| *w == 0.0).collect();
        let is_held = |v: u32| held[v as usize * D..][..D].iter().all(|held| *held);
        let vertices = system.mass().len();
        // Assembly plans; `keys` collects the vertex pairs of all groups.
        let (mut terms, mut keys) = (vec![], vec![]);
        let (energy, dissipation) = system.stencils();
        for (dissipative, stencils) in [(false, energy), (true, dissipation)] {
            for (term, stencils) in stencils.into_iter().enumerate().filter(|(_, s)| !s.vertices.is_empty()) {
                terms.push(TermPlan::new((term, dissipative), &stencils, is_held, &mut keys));
            }
        }
        // Upper triangle: each pair of any group once, and the diagonal.
        let mut upper: Vec<u64> = keys.iter().map(|(a, b)| key(*a, *b)).collect();
        upper.extend((0..vertices as u32).map(|v| key(v, v)));
        upper.sort_unstable();
        upper.dedup();
        let index_of = |key: u64| upper.binary_search(&key).expect("every key was added");
        let mut source_start = vec![0u32; upper.len() + 1];
        let position: Vec<u32> = keys.iter().map(|(a, b)| index_of(key(*a, *b)) as u32).collect();
        position.iter().for_each(|p| source_start[*p as usize + 1] += 1);
        accumulate(&mut source_start);
        let mut next = source_start.clone();
        let mut source = vec![0; keys.len()];
        for (slot, (p, (a, b))) in position.iter().zip(&keys).enumerate() {
            source[next[*p as usize] as usize] = 2 * slot as u32 + u32::from(a > b);
            next[*p as usize] += 1;
        }
        // Both triangles by rows: the lower blocks of a row come from the columns above it.
        let mut row_start = vec![0u32; vertices + 1];
        for key in &upper {
            let (r, c) = vertices_of(*key);
            row_start[r as usize + 1] += 1;
            if r != c {
                row_start[c as usize + 1] += 1;
            }
        }
        accumulate(&mut row_start);
        let mut next = row_start.clone();
        let count = row_start[vertices] as usize;
        let (mut column, mut upper_of) = (vec![0; count], vec![0; count]);
        let mut put = |row: u32, col: u32, index: usize| {
            let at = next[row as usize] as usize;
            (column[at], upper_of[at]) = (col, index as u32);
            next[row as usize] += 1;
        };
        // Sorted by row, then column: row `c` gets its lower blocks, columns ascending, before its own
        // upper ones.
        for (index, key) in upper.iter().enumerate() {
            let (r, c) = vertices_of(*key);
            if r != c {
                put(c, r, index);
            }
        }
        for (index, key) in upper.iter().enumerate() {
            let (r, c) = vertices_of(*key);
            put(r, c, index);
        }
        Assembler {
            matrix: BlockMatrix::zero(row_start, column),
            terms,
            sums: vec![[[0.0; D]; D]; keys.len()],
            upper: upper_of,
            source_start,
            source,
            held,
            structure: system.structure(),
            entries: 0,
            next_transpose: vec![0; vertices],
            changing: Changing::default(),
        }
    }

    /// True if the structure still fits `system`.
    pub fn fits(&self, system: &System) -> bool {
        self.structure == system.structure()
    }

    /// True if no changing stencils have occurred: the pattern is that of the mesh.
    pub(crate) fn is_fixed(&self) -> bool {
        self.changing.pattern() == 0
    }

    /// Returns for each coordinate whether it is constrained: its row and column are zero except for the
    /// diagonal.
    pub fn held(&self) -> &[bool] {
        &self.held
    }

    /// Returns the matrix last assembled.
    pub fn matrix(&self) -> &BlockMatrix<D> {
        self.changing.matrix().unwrap_or(&self.matrix)
    }

    /// Returns its part of fixed structure, without the blocks of changing stencils.
    pub fn fixed(&self) -> &BlockMatrix<D> {
        &self.matrix
    }

    /// Returns the pattern version of [`matrix`](Self::matrix), for this assembler. A factor of another
    /// version does not fit.
    pub fn pattern(&self) -> u64 {
        self.changing.pattern()
    }

    /// Returns the entry version of [`matrix`](Self::matrix), for this assembler. Equal versions mean
    /// equal entries.
    pub(crate) fn entries(&self) -> u64 {
        self.entries
    }

    /// Extends the pattern by the stencils that terms have found last.
    pub(crate) fn include_stencils(&mut self, system: &System) {
        self.changing.include(system, &self.matrix, &self.held);
    }

    /// Extends the pattern by stencils likely to be found from `x` on, flat [m], for memory predictions.
    pub(crate) fn expect_stencils(&mut self, system: &System, x: &[f64]) {
        self.changing.expect(system, x, &self.matrix, &self.held);
    }

    /// Assembles `A = inertia M + stiffness d2E/dx2 + damping d2R/dv2`, with the changing stencils that
    /// terms have found last.
    pub fn assemble(&mut self, system: &System, at: At<'_>, weights: Weights) {
        self.entries += 1;
        self.assemble_fixed(system, at, weights);
        self.changing.assemble(system, at, weights, &self.matrix, &self.held);
    }

    fn assemble_fixed(&mut self, system: &System, at: At<'_>, weights: Weights) {
        // Sums of all groups, then the rows of the matrix from them.
        for plan in &mut self.terms {
            plan.sum(system, at, weights, &mut self.sums);
        }
        let Assembler { matrix, sums, upper, source_start, source, held, next_transpose, .. } = self;
        let BlockMatrix { row_start, column, value, .. } = matrix;
        let (row_start, column, mass) = (&*row_start, &*column, system.mass());
        let (sums, upper, source_start, source, held) = (&*sums, &*upper, &*source_start, &*source, &*held);
        let is_alone = rayon::current_num_threads() == 1;
        // A task takes a range of rows with all their blocks.
        let most = if is_alone { next_transpose.len().max(1) } else { TASK_ROWS };
        let starts: Vec<u32> = row_start.iter().copied().step_by(most).collect();
        let end = row_start[row_start.len() - 1];
        let task = |(task, (blocks, next_transpose)): (usize, (&mut [Block<D>], &mut [u32]))| {
            let rows = task * most..task * most + next_transpose.len();
            let inertia = weights.inertia;
            dispatch(AddGroups {
                rows,
                row_start,
                column,
                upper,
                source_start,
                source,
                sums,
                held,
                mass,
                inertia,
                next_transpose,
                blocks,
            });
        };
        let tasks = split(&starts, end, value).into_iter();
        if is_alone {
            tasks.zip(next_transpose.chunks_mut(most)).enumerate().for_each(task);
        } else {
            let tasks: Vec<_> = tasks.zip(next_transpose.chunks_mut(most)).collect();
            tasks.into_par_iter().enumerate().for_each(task);
        }
    }

    /// Writes `d2E/dx2 p` [N] to `y` for a displacement `p` of constrained coordinates, flat [m]. Fixed
    /// stencils contribute exact Hessians at `x`, changing ones their Hessians in the matrix last
    /// assembled.
    ///
    /// Projected Hessians are stiffer than exact ones. Mixing both in a contact would let a free
    /// vertex follow its pusher only in part, and close the gap.
    pub(crate) fn held_product(&self, system: &mut System, x: &[f64], p: &[f64], y: &mut [f64]) {
        system.fixed_hessian_product(x, p, y);
        self.changing.add_held_product(p, y);
    }

    /// Adds `part` times the largest diagonal entry to the diagonal of the free coordinates.
    pub fn shift(&mut self, part: f64) {
        self.entries += 1;
        let matrix = self.matrix();
        let entries = |at: &u32| (0..D).fold(0.0, |m: f64, k| m.max(matrix.value[*at as usize][k][k]));
        let largest = matrix.diagonal.iter().fold(0.0, |m: f64, at| m.max(entries(at)));
        shift(&mut self.matrix, &self.held, part * largest);
        if let Some(whole) = self.changing.matrix_mut() {
            shift(whole, &self.held, part * largest);
        }
    }

    /// Estimates the memory held, in bytes: the matrix, the matrix with the stencils that change, blocks of
    /// stencils, their sums and places.
    pub fn bytes(&self) -> usize {
        let places = self.terms.iter().map(|term| term.slot.len()).sum::<usize>() + self.source.len();
        let matrices = self.matrix.bytes() + self.changing.matrix().map_or(0, BlockMatrix::bytes);
        let scratch = self.terms.iter().flat_map(|term| &term.scratch).map(Vec::len).sum::<usize>();
        matrices + size_of::<Block<D>>() * (self.sums.len() + scratch) + 4 * places
    }
}

/// Adds `by` to the diagonal of the free coordinates.
fn shift<const D: usize>(matrix: &mut BlockMatrix<D>, held: &[bool], by: f64) {
    let BlockMatrix { diagonal, value, .. } = matrix;
    for (row, at) in diagonal.iter().enumerate() {
        for k in (0..D).filter(|k| !held[row * D + k]) {
            value[*at as usize][k][k] += by;
        }
    }
}

/// Splits `value` at the given starts; the first is 0.
fn split<'a, B>(starts: &[u32], end: u32, mut value: &'a mut [B]) -> Vec<&'a mut [B]> {
    let mut parts = Vec::with_capacity(starts.len());
    for (i, start) in starts.iter().enumerate() {
        let next = starts.get(i + 1).copied().unwrap_or(end);
        let (part, rest) = value.split_at_mut((next - start) as usize);
        parts.push(part);
        value = rest;
    }
    parts
}

/// Turns counts, shifted by one, into starts.
fn accumulate(start: &mut [u32]) {
    for i in 1..start.len() {
        start[i] += start[i - 1];
    }
}

/// Key of the pair `a <= b`; keys sort by `a`, then `b`.
fn key(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

fn vertices_of(key: u64) -> (u32, u32) {
    ((key >> 32) as u32, key as u32)
}

impl<const D: usize> TermPlan<D> {
    /// Groups the stencils of a term; appends the pairs of each group to `keys`, in order of first
    /// occurrence.
    fn new(
        (term, dissipative): (usize, bool),
        Stencils { size, vertices }: &Stencils,
        is_held: impl Fn(u32) -> bool,
        keys: &mut Vec<(u32, u32)>,
    ) -> Self {
        let size = *size;
        let pairs = size * (size + 1) / 2;
        let count = vertices.len() / size;
        let mut groups = vec![];
        let mut slot = Vec::with_capacity(count * pairs);
        for first in (0..count).step_by(GROUP) {
            let stencils = first..(first + GROUP).min(count);
            let of_stencil = |s: usize| &vertices[s * size..(s + 1) * size];
            let start = keys.len();
            let (mut own, mut number) = (vec![], PairNumbers::default());
            for s in stencils.clone() {
                for_pairs(of_stencil(s), |a, b| {
                    if is_held(a) || is_held(b) {
                        slot.push(NOWHERE);
                        return;
                    }
                    let at = *number.entry(key(a, b)).or_insert_with(|| {
                        own.push((a, b));
                        own.len() - 1
                    });
                    slot.push(2 * at as u32 + u32::from(own[at] != (a, b)));
                });
            }
            keys.extend(own);
            groups.push(StencilGroup { stencils, sums: start..keys.len() });
        }
        let tasks = groups.len().min(MAX_TASKS);
        TermPlan {
            term,
            dissipative,
            pairs,
            groups,
            repeated: repeated_pairs(vertices, size),
            slot,
            scratch: vec![vec![[[0.0; D]; D]; GROUP.min(count) * pairs]; tasks],
        }
    }

    /// Computes the sums of all groups, each entry times its factor.
    fn sum(&mut self, system: &System, at: At<'_>, weights: Weights, sums: &mut [Block<D>]) {
        let TermPlan { term, dissipative, pairs, groups, repeated, slot, scratch } = self;
        let (repeated, pairs, term, dissipative) = (&repeated[..], *pairs, *term, *dissipative);
        let factor = if dissipative { weights.damping } else { weights.stiffness };
        let (first, last) = match &groups[..] {
            [first, .., last] => (first.sums.start, last.sums.end),
            [only] => (only.sums.start, only.sums.end),
            [] => return,
        };
        // Hessians of the stencils of some groups, and their sums.
        let run = |groups: &[StencilGroup], scratch: &mut Vec<Block<D>>, sums: &mut [Block<D>]| {
            let base = groups[0].sums.start;
            for group in groups {
                let hessians = &mut scratch[..group.stencils.len() * pairs];
                let (stencils, out) =
                    (group.stencils.clone(), hessians.as_flattened_mut().as_flattened_mut());
                if dissipative {
                    system.dissipation()[term].stencil_dampings(stencils, at.x, at.v, out);
                } else {
                    let term = &system.terms()[term];
                    let from = at.predicted_from.filter(|_| at.psd == Psd::Exact);
                    match from.zip(term.predicted()) {
                        Some((from, term)) => term.predicted_hessians(stencils, from, at.x, out),
                        None => term.stencil_hessians(stencils, at.x, at.psd, out),
                    }
                }
                add_transposes(repeated, group.stencils.start * pairs, hessians);
                let sums = &mut sums[group.sums.start - base..group.sums.end - base];
                sums.fill([[0.0; D]; D]);
                let slots = &slot[group.stencils.start * pairs..group.stencils.end * pairs];
                dispatch(AddBlocks { slots, hessians, sums, factor });
            }
        };
        // One task on one thread, or a range of groups per task.
        let sums = &mut sums[first..last];
        let per_task = groups.len().div_ceil(scratch.len());
        if groups.len() == 1 || rayon::current_num_threads() == 1 {
            return run(groups, &mut scratch[0], sums);
        }
        let starts: Vec<u32> =
            groups.chunks(per_task).map(|task| (task[0].sums.start - first) as u32).collect();
        let sums = split(&starts, (last - first) as u32, sums);
        let tasks = groups.par_chunks(per_task).zip(sums).zip(scratch);
        tasks.for_each(|((groups, sums), scratch)| run(groups, scratch, sums));
    }
}

/// Adds the transpose to each block of a `repeated` pair among `hessians`, which start at pair `first`.
fn add_transposes<const D: usize>(repeated: &[usize], first: usize, hessians: &mut [Block<D>]) {
    let range = |end: usize| repeated.partition_point(|pair| *pair < end);
    for pair in &repeated[range(first)..range(first + hessians.len())] {
        let block = hessians[pair - first];
        add(&mut hessians[pair - first], &block, true);
    }
}

/// Adds the sums of groups to rows of the matrix.
///
/// Groups are read for the blocks from the diagonal on; a block below it is the transpose of one in an
/// earlier row. Blocks whose transpose lies before the first row of the task are summed here as well.
struct AddGroups<'a, const D: usize> {
    rows: Range<usize>,
    row_start: &'a [u32],
    column: &'a [u32],
    upper: &'a [u32],
    source_start: &'a [u32],
    source: &'a [u32],
    sums: &'a [Block<D>],
    held: &'a [bool],
    mass: &'a [f64],
    inertia: f64,
    /// One entry per row, overwritten.
    next_transpose: &'a mut [u32],
    /// Blocks of these rows.
    blocks: &'a mut [Block<D>],
}

impl<const D: usize> AddGroups<'_, D> {
    /// Sums block `at` in row `row`, which may have constrained coordinates; without inertia.
    #[inline(always)]
    fn sum(&self, (row, is_row_held): (usize, bool), at: usize) -> Block<D> {
        let (col, upper) = (self.column[at] as usize, self.upper[at] as usize);
        let sources = self.source_start[upper] as usize..self.source_start[upper + 1] as usize;
        let mut block = [[0.0; D]; D];
        for at in sources {
            // Prefetches the sums of blocks to come, in the order of the upper triangle.
            if let Some(s) = self.source.get(at + SOURCES_AHEAD) {
                prefetch(self.sums, (s / 2) as usize);
            }
            let s = self.source[at];
            add(&mut block, &self.sums[(s / 2) as usize], (s % 2 == 1) != (col < row));
        }
        let (held, others) = (&self.held[row * D..][..D], &self.held[col * D..][..D]);
        if is_row_held || others.contains(&true) {
            for k in 0..D {
                for l in 0..D {
                    if held[k] || others[l] {
                        block[k][l] = 0.0;
                    }
                }
            }
        }
        block
    }
}

impl<const D: usize> Kernel for AddGroups<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (start, end) = (self.rows.start, self.rows.end);
        let first = self.row_start[start] as usize;
        for row in start..end {
            let blocks = self.row_start[row] as usize..self.row_start[row + 1] as usize;
            let before = self.column[blocks.clone()].partition_point(|col| (*col as usize) < start);
            let held = self.held[row * D..][..D].contains(&true);
            for at in blocks.start..blocks.start + before {
                self.blocks[at - first] = self.sum((row, held), at);
            }
            self.next_transpose[row - start] = (blocks.start + before) as u32;
        }
        for row in start..end {
            // All blocks below the diagonal are complete here.
            let diagonal = self.next_transpose[row - start] as usize;
            let held = self.held[row * D..][..D].contains(&true);
            for at in diagonal..self.row_start[row + 1] as usize {
                let col = self.column[at] as usize;
                let mut block = self.sum((row, held), at);
                if col > row && col < end {
                    let next = &mut self.next_transpose[col - start];
                    let transpose = &mut self.blocks[*next as usize - first];
                    for k in 0..D {
                        for l in 0..D {
                            transpose[k][l] = block[l][k];
                        }
                    }
                    *next += 1;
                }
                if row == col {
                    for k in 0..D {
                        // Any positive value would do at a constrained coordinate.
                        let held = self.held[row * D + k];
                        block[k][k] += if held { 1.0 } else { self.inertia * self.mass[row] };
                    }
                }
                self.blocks[at - first] = block;
            }
        }
    }
}

/// Adds blocks to the sums given by their slots, then multiplies by a factor.
struct AddBlocks<'a, const D: usize> {
    slots: &'a [u32],
    hessians: &'a [Block<D>],
    sums: &'a mut [Block<D>],
    factor: f64,
}

impl<const D: usize> Kernel for AddBlocks<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (slot, block) in self.slots.iter().zip(self.hessians) {
            if *slot != NOWHERE {
                add(&mut self.sums[(slot / 2) as usize], block, slot % 2 == 1);
            }
        }
        for entry in self.sums.as_flattened_mut().as_flattened_mut() {
            *entry *= self.factor;
        }
    }
}

/// Visits the vertex pairs `a <= b` of a stencil in the block order of its Hessian.
fn for_pairs(vertices: &[u32], mut visit: impl FnMut(u32, u32)) {
    for (i, a) in vertices.iter().enumerate() {
        for b in &vertices[i..] {
            visit(*a, *b);
        }
    }
}

/// Returns the numbers, among all pairs, of those with the same vertex at two positions.
fn repeated_pairs(vertices: &[u32], size: usize) -> Vec<usize> {
    let (mut repeated, mut number) = (vec![], 0);
    for stencil in vertices.chunks_exact(size) {
        for i in 0..size {
            repeated.extend((i + 1..size).filter(|j| stencil[*j] == stencil[i]).map(|j| number + j - i));
            number += size - i;
        }
    }
    repeated
}

#[inline(always)]
fn add<const D: usize>(sum: &mut Block<D>, block: &Block<D>, transposed: bool) {
    // Index loops: calls to iterators may stay calls in a single code generation unit.
    if transposed {
        for k in 0..D {
            for l in 0..D {
                sum[k][l] += block[l][k];
            }
        }
    } else {
        for k in 0..D {
            for l in 0..D {
                sum[k][l] += block[k][l];
            }
        }
    }
}
