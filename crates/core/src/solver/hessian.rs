//! The Hessian of all terms together, assembled from the small dense Hessians of their stencils.
//!
//! Stencils go through in groups that fit the cache: the term writes their Hessians, which are added up
//! block by block within the group; afterwards every row of the matrix adds the few groups that touch it, in
//! a fixed order. Groups depend on the mesh alone, so the matrix has the same bits on any number of threads.

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

/// Stencils in a group.
const GROUP: usize = 512;
/// Groups are dealt out to this many tasks at most.
const MAX_TASKS: usize = 32;
/// Rows of the matrix that a thread takes at once.
const TASK_ROWS: usize = 512;
/// Sums that are asked for before they are added.
const SOURCES_AHEAD: usize = 24;
/// A block that belongs to a held vertex.
const NOWHERE: u32 = u32::MAX;

/// Numbers of pairs by their keys: that of the standard library is against attacks, and takes the greater
/// part of making a structure.
type PairNumbers = HashMap<u64, usize, BuildHasherDefault<PairHasher>>;

/// Fibonacci's: Knuth 1998, *The Art of Computer Programming*, volume 3, section 6.4.
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

/// The factors in `A = inertia M + stiffness d2E/dx2 + damping d2R/dv2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// Factor of the mass.
    pub inertia: f64,
    /// Factor of the Hessian of the energy.
    pub stiffness: f64,
    /// Factor of the damping matrix.
    pub damping: f64,
}

/// Where the matrix is assembled.
#[derive(Clone, Copy, Debug)]
pub struct At<'a> {
    /// Positions, flat [m].
    pub x: &'a [f64],
    /// Velocities, flat [m/s]; looked at only where something dissipates.
    pub v: &'a [f64],
    /// Form of the element Hessians, exact or projected.
    pub psd: Psd,
    /// Positions from which pressures here are predicted, where Hessians are exact: see
    /// [`predicted_hessians`](crate::energy::PredictedStresses::predicted_hessians).
    pub predicted_from: Option<&'a [f64]>,
}

/// Assembles the matrix of one system. Held coordinates have a row and a column of zeros, but for the
/// diagonal.
pub struct Assembler<const D: usize> {
    matrix: BlockMatrix<D>,
    terms: Vec<TermPlan<D>>,
    /// Sums of every group, one block after another.
    sums: Vec<Block<D>>,
    /// For every stored block the block of the upper triangle that it is, or is the transpose of.
    upper: Vec<u32>,
    /// The sums of block `i` of the upper triangle are `source[source_start[i]..source_start[i + 1]]`,
    /// doubled; odd where transposed.
    source_start: Vec<u32>,
    source: Vec<u32>,
    /// True for each coordinate that is held, as it was when the structure was made.
    held: Vec<bool>,
    /// Version of the structure of the system.
    structure: u64,
    /// Version of the entries of the matrix.
    entries: u64,
    /// For every row, the block that its next transpose goes to, while the matrix is filled.
    next_transpose: Vec<u32>,
    /// The matrix with the blocks of stencils that change.
    changing: Changing<D>,
}

/// The stencils of one term.
struct TermPlan<const D: usize> {
    /// Its index in the system.
    term: usize,
    /// True if it is one of the dissipative terms.
    dissipative: bool,
    /// Pairs of vertices `a <= b` of a stencil.
    pairs: usize,
    groups: Vec<StencilGroup>,
    /// Pairs of different places of a stencil that name one vertex, by their number among all pairs,
    /// ascending: their block and its transpose both belong to the diagonal.
    repeated: Vec<usize>,
    /// For each pair of each stencil, where in the sums of its group its block goes, doubled; odd where
    /// transposed. A sum is of blocks as the first stencil of the group has them, so few are.
    slot: Vec<u32>,
    /// Memory for the Hessians of a group, one for each task.
    scratch: Vec<Vec<Block<D>>>,
}

/// A few hundred stencils.
struct StencilGroup {
    stencils: Range<usize>,
    sums: Range<usize>,
}

impl<const D: usize> Assembler<D> {
    /// The structure for `system`, with the coordinates that it holds now.
    pub fn new(system: &mut System) -> Self {
        let held: Vec<bool> = system.inverse_mass().iter().map(|w| *w == 0.0).collect();
        let is_held = |v: u32| held[v as usize * D..][..D].iter().all(|held| *held);
        let vertices = system.mass().len();
        let (mut terms, mut keys) = (vec![], vec![]);
        let (energy, dissipation) = system.stencils();
        for (dissipative, stencils) in [(false, energy), (true, dissipation)] {
            for (term, stencils) in stencils.into_iter().enumerate().filter(|(_, s)| !s.vertices.is_empty()) {
                terms.push(TermPlan::new((term, dissipative), &stencils, is_held, &mut keys));
            }
        }
        // The upper triangle: every pair of any group once, and the diagonal.
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
        // Sorted by row, then column: row `c` gets its lower blocks, columns ascending, before its own upper
        // ones.
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

    /// True if the structure is that of `system` still.
    pub fn fits(&self, system: &System) -> bool {
        self.structure == system.structure()
    }

    /// True if no stencils that change have been met: the pattern is that of the mesh.
    pub(crate) fn is_fixed(&self) -> bool {
        self.changing.pattern() == 0
    }

    /// Whether each coordinate is held: its row and column are zero but for the diagonal.
    pub fn held(&self) -> &[bool] {
        &self.held
    }

    /// The matrix last assembled.
    pub fn matrix(&self) -> &BlockMatrix<D> {
        self.changing.matrix().unwrap_or(&self.matrix)
    }

    /// The part of it whose structure stays: without the blocks of stencils that change.
    pub fn fixed(&self) -> &BlockMatrix<D> {
        &self.matrix
    }

    /// Version of the pattern of [`matrix`](Self::matrix), for this assembler: a factor of another version
    /// does not fit.
    pub fn pattern(&self) -> u64 {
        self.changing.pattern()
    }

    /// Version of the entries of [`matrix`](Self::matrix), for this assembler: those of one version are the
    /// same.
    pub(crate) fn entries(&self) -> u64 {
        self.entries
    }

    /// Makes room in the matrix for the stencils that terms have found last.
    pub(crate) fn include_stencils(&mut self, system: &System) {
        self.changing.include(system, &self.matrix, &self.held);
    }

    /// Makes room in the matrix for stencils that are likely to be found from `x` on, flat [m], for a
    /// prediction of what it takes.
    pub(crate) fn expect_stencils(&mut self, system: &System, x: &[f64]) {
        self.changing.expect(system, x, &self.matrix, &self.held);
    }

    /// Assembles `A = inertia M + stiffness d2E/dx2 + damping d2R/dv2`; of stencils that change, those that
    /// terms have found last.
    pub fn assemble(&mut self, system: &System, at: At<'_>, weights: Weights) {
        self.entries += 1;
        self.assemble_fixed(system, at, weights);
        self.changing.assemble(system, at, weights, &self.matrix, &self.held);
    }

    fn assemble_fixed(&mut self, system: &System, at: At<'_>, weights: Weights) {
        for plan in &mut self.terms {
            plan.sum(system, at, weights, &mut self.sums);
        }
        let Assembler { matrix, sums, upper, source_start, source, held, next_transpose, .. } = self;
        let BlockMatrix { row_start, column, value, .. } = matrix;
        let (row_start, column, mass) = (&*row_start, &*column, system.mass());
        let (sums, upper, source_start, source, held) = (&*sums, &*upper, &*source_start, &*source, &*held);
        let is_alone = rayon::current_num_threads() == 1;
        // A task takes so many rows, and all their blocks.
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

    /// `d2E/dx2 p` [N] of a motion `p` of held coordinates, flat [m], written over `y`: of the free
    /// coordinates, and those of stencils that change by their Hessians in the matrix last assembled.
    ///
    /// Projected Hessians hold more stiffness than exact ones: a free vertex between both would follow what
    /// pushes it by a part of the way only, and the gap between them close.
    pub(crate) fn held_product(&self, system: &mut System, x: &[f64], p: &[f64], y: &mut [f64]) {
        system.fixed_hessian_product(x, p, y);
        self.changing.add_held_product(p, y);
    }

    /// Adds `part` of the largest diagonal entry to the diagonal of the free coordinates.
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

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let plans = self.terms.iter().map(|t| {
            4 * t.slot.len()
                + size_of_val(&t.repeated[..])
                + t.scratch.iter().map(|s| size_of_val(&s[..])).sum::<usize>()
        });
        let lists = self.upper.len() + self.source_start.len() + self.source.len();
        self.matrix.bytes()
            + self.changing.bytes()
            + size_of_val(&self.sums[..])
            + 4 * (lists + self.next_transpose.len())
            + self.held.len()
            + plans.sum::<usize>()
    }
}

/// Adds a number to the diagonal of the free coordinates.
fn shift<const D: usize>(matrix: &mut BlockMatrix<D>, held: &[bool], by: f64) {
    let BlockMatrix { diagonal, value, .. } = matrix;
    for (row, at) in diagonal.iter().enumerate() {
        for k in (0..D).filter(|k| !held[row * D + k]) {
            value[*at as usize][k][k] += by;
        }
    }
}

/// Splits at the given starts; the first is 0.
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

/// Counts, shifted by one, become starts.
fn accumulate(start: &mut [u32]) {
    for i in 1..start.len() {
        start[i] += start[i - 1];
    }
}

/// The pair `a <= b`, sorted by `a`, then `b`.
fn key(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

fn vertices_of(key: u64) -> (u32, u32) {
    ((key >> 32) as u32, key as u32)
}

impl<const D: usize> TermPlan<D> {
    /// Groups the stencils of a term; `keys` gains the pairs of each group, in the order in which they are
    /// first met.
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

    /// Fills the sums of every group, each entry times its factor.
    fn sum(&mut self, system: &System, at: At<'_>, weights: Weights, sums: &mut [Block<D>]) {
        let TermPlan { term, dissipative, pairs, groups, repeated, slot, scratch } = self;
        let (repeated, pairs, term, dissipative) = (&repeated[..], *pairs, *term, *dissipative);
        let factor = if dissipative { weights.damping } else { weights.stiffness };
        let (first, last) = match &groups[..] {
            [first, .., last] => (first.sums.start, last.sums.end),
            [only] => (only.sums.start, only.sums.end),
            [] => return,
        };
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

/// Adds its transpose to each block of `repeated` pairs that is among `hessians`, those from pair `first`
/// on.
fn add_transposes<const D: usize>(repeated: &[usize], first: usize, hessians: &mut [Block<D>]) {
    let range = |end: usize| repeated.partition_point(|pair| *pair < end);
    for pair in &repeated[range(first)..range(first + hessians.len())] {
        let block = hessians[pair - first];
        add(&mut hessians[pair - first], &block, true);
    }
}

/// Rows of the matrix from the sums of groups.
///
/// The groups are looked up for the blocks from the diagonal on: a block below it is the transpose of one of
/// a row before. Columns before the first of the rows have theirs elsewhere, and are summed here as well.
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
    /// For each of these rows, overwritten.
    next_transpose: &'a mut [u32],
    /// The blocks of these rows.
    blocks: &'a mut [Block<D>],
}

impl<const D: usize> AddGroups<'_, D> {
    /// Block `at` of the matrix, in row `row`, of which a coordinate may be held, without inertia.
    #[inline(always)]
    fn sum(&self, (row, is_row_held): (usize, bool), at: usize) -> Block<D> {
        let (col, upper) = (self.column[at] as usize, self.upper[at] as usize);
        let sources = self.source_start[upper] as usize..self.source_start[upper + 1] as usize;
        let mut block = [[0.0; D]; D];
        for at in sources {
            // The sums of the blocks to come, in the order of the upper triangle.
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
            // All blocks below the diagonal are there.
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
                        // Any positive number would do for a held coordinate.
                        let held = self.held[row * D + k];
                        block[k][k] += if held { 1.0 } else { self.inertia * self.mass[row] };
                    }
                }
                self.blocks[at - first] = block;
            }
        }
    }
}

/// Adds blocks to where their slots say, and multiplies by a factor.
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

/// The pairs `a <= b` of the vertices of a stencil, in the order of the blocks of its Hessian.
fn for_pairs(vertices: &[u32], mut visit: impl FnMut(u32, u32)) {
    for (i, a) in vertices.iter().enumerate() {
        for b in &vertices[i..] {
            visit(*a, *b);
        }
    }
}

/// Numbers, among all pairs of stencils of this size, of those that name one vertex at two places.
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
    // Numbered loops: calls to iterators stay calls where the compiler keeps to one unit of code.
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
