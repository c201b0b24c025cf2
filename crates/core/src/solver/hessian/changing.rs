//! Blocks of changing stencils, such as contacts. The matrix of all other stencils is kept unchanged; a
//! second one, whose pattern has room for both, is filled from it.

use std::ops::Range;

use rayon::prelude::*;

use super::{At, GROUP, NOWHERE, Weights, add, for_pairs};
use crate::energy::{ChangingStencils, Stencils, add_stencil_product};
use crate::lanes::prefetch;
use crate::solver::block_matrix::{Block, BlockMatrix};
use crate::system::System;

/// The pattern drops earlier stencils when it exceeds this many times the blocks needed.
const SPARE: usize = 8;
/// How many earlier stencils are searched for a match.
const STENCILS_AHEAD: usize = 64;
/// Prefetch distance, in blocks.
const SLOTS_AHEAD: usize = 12;

/// Matrix of a system with changing stencils.
#[derive(Default)]
pub(super) struct Changing<const D: usize> {
    /// Stencil version of the plans.
    version: Option<u64>,
    /// The whole matrix; `None` until stencils are found.
    whole: Option<ExtendedMatrix<D>>,
    /// One plan per list of each term.
    plans: Vec<ListPlan<D>>,
    /// How often the pattern of the whole matrix was built.
    patterns: u64,
}

/// A matrix with the blocks of the fixed one and of changing stencils.
struct ExtendedMatrix<const D: usize> {
    matrix: BlockMatrix<D>,
    /// Position of each block of the fixed matrix.
    place: Vec<u32>,
}

/// Assembly plan of one stencil list.
struct ListPlan<const D: usize> {
    /// Index of the term in the system; true for a dissipative term.
    term: (usize, bool),
    list: usize,
    stencils: Stencils,
    /// For each pair `a <= b` of each stencil, the positions of its block and of the transposed one.
    slot: Vec<[u32; 2]>,
    /// Block values.
    blocks: Vec<Block<D>>,
}

/// Returns the changing-stencil view of a term.
fn term(system: &System, (index, dissipative): (usize, bool)) -> Option<&dyn ChangingStencils> {
    if dissipative { system.dissipation()[index].changing() } else { system.terms()[index].changing() }
}

impl<const D: usize> Changing<D> {
    /// Returns the whole matrix, if it has more blocks than the fixed one.
    pub(super) fn matrix(&self) -> Option<&BlockMatrix<D>> {
        self.whole.as_ref().map(|whole| &whole.matrix)
    }

    /// Returns the whole matrix for modification.
    pub(super) fn matrix_mut(&mut self) -> Option<&mut BlockMatrix<D>> {
        self.whole.as_mut().map(|whole| &mut whole.matrix)
    }

    /// Returns the pattern version of the whole matrix; zero if it is the fixed one.
    pub(super) fn pattern(&self) -> u64 {
        self.patterns
    }

    /// Extends the pattern by the stencils that terms have found last, if they changed.
    pub(super) fn include(&mut self, system: &System, fixed: &BlockMatrix<D>, held: &[bool]) {
        let version = system.changing_structure();
        if self.version == version {
            return;
        }
        self.version = version;
        let mut before = std::mem::replace(&mut self.plans, plans(system));
        if self.whole.is_none() && self.plans.is_empty() {
            return;
        }
        let is_held = |v: u32| held[v as usize * D..][..D].iter().all(|held| *held);
        let mut slots = self.whole.as_ref().and_then(|whole| self.place_all(&whole.matrix, &before, is_held));
        if slots.is_none() {
            self.make_room(vec![], fixed, is_held);
            slots = self.whole.as_ref().and_then(|whole| self.place_all(&whole.matrix, &[], is_held));
        }
        let slots = slots.expect("the pattern was made for them");
        for (plan, slot) in self.plans.iter_mut().zip(slots) {
            plan.slot = slot;
            // Keeps the block memory: megabytes allocated anew would have to be zeroed.
            if let Some(before) = before.iter_mut().find(|before| before.is_of(plan)) {
                plan.blocks = std::mem::take(&mut before.blocks);
            }
        }
    }

    /// Positions of all blocks in `matrix`, plan by plan; stencils found in `before` keep theirs. `None`
    /// if the pattern lacks one.
    fn place_all(
        &self,
        matrix: &BlockMatrix<D>,
        before: &[ListPlan<D>],
        is_held: impl Fn(u32) -> bool,
    ) -> Option<Vec<Vec<[u32; 2]>>> {
        let place = |plan: &ListPlan<D>| {
            let before = before.iter().find(|before| before.is_of(plan));
            place(&plan.stencils, matrix, before, &is_held)
        };
        self.plans.iter().map(place).collect()
    }

    /// Builds the matrix that the system is likely to have later: with room for the current stencils and
    /// for the [pairs](ChangingStencils::likely_pairs) expected from `x` on.
    pub(super) fn expect(&mut self, system: &System, x: &[f64], fixed: &BlockMatrix<D>, held: &[bool]) {
        let energies = system.terms().iter().filter_map(|term| term.changing());
        let terms = energies.chain(system.dissipation().iter().filter_map(|term| term.changing()));
        let pairs = terms.flat_map(|term| term.likely_pairs(x)).collect();
        if system.changing_structure().is_some() {
            self.plans = plans(system);
            self.make_room(pairs, fixed, |v| held[v as usize * D..][..D].iter().all(|held| *held));
        }
    }

    /// Builds a matrix with room for the blocks of the fixed one, of `pairs`, of all current stencils,
    /// and of earlier ones unless these are too many.
    fn make_room(&mut self, mut pairs: Vec<[u32; 2]>, fixed: &BlockMatrix<D>, is_held: impl Fn(u32) -> bool) {
        for plan in &self.plans {
            for stencil in plan.stencils.vertices.chunks_exact(plan.stencils.size) {
                for_pairs(stencil, |a, b| pairs.push([a, b]));
            }
        }
        // Sorted pairs of free vertices, in both orders.
        let free = pairs.iter().filter(|pair| !pair.iter().any(|v| is_held(*v)));
        let mut keys: Vec<(u32, u32)> = free.flat_map(|[a, b]| [(*a, *b), (*b, *a)]).collect();
        keys.sort_unstable();
        keys.dedup();
        let earlier = self.matrix().filter(|m| m.column.len() < fixed.column.len() + SPARE * keys.len());
        // Pattern: blocks of the fixed matrix, new pairs and earlier blocks, row by row.
        let (mut row_start, mut column, mut rest) = (vec![0], vec![], &keys[..]);
        for row in 0..fixed.rows() {
            let first = column.len();
            let (own, after) = rest.split_at(rest.partition_point(|(a, _)| *a as usize <= row));
            rest = after;
            column.extend_from_slice(&fixed.column[blocks_of(fixed, row)]);
            column.extend(own.iter().map(|(_, b)| *b));
            column.extend(earlier.iter().flat_map(|m| &m.column[blocks_of(m, row)]));
            column[first..].sort_unstable();
            dedup_from(&mut column, first);
            row_start.push(column.len() as u32);
        }
        // Freed first, so that two such matrices never coexist.
        self.whole = None;
        let matrix = BlockMatrix::zero(row_start, column);
        // Positions of the blocks of the fixed matrix.
        let mut place = Vec::with_capacity(fixed.column.len());
        for row in 0..fixed.rows() {
            let columns = fixed.column[blocks_of(fixed, row)].iter();
            place.extend(columns.map(|c| find(&matrix, row as u32, *c).expect("all blocks of it are there")));
        }
        self.whole = Some(ExtendedMatrix { matrix, place });
        self.patterns += 1;
    }

    /// Fills the whole matrix: the fixed one plus the blocks of all stencils times their factors.
    pub(super) fn assemble(
        &mut self,
        system: &System,
        at: At<'_>,
        weights: Weights,
        fixed: &BlockMatrix<D>,
        held: &[bool],
    ) {
        self.include(system, fixed, held);
        let Some(ExtendedMatrix { matrix, place }) = &mut self.whole else { return };
        let mut next = 0;
        for (place, block) in place.iter().zip(&fixed.value) {
            // Few positions lie between those of the fixed matrix.
            while next < *place as usize {
                matrix.value[next] = [[0.0; D]; D];
                next += 1;
            }
            matrix.value[next] = *block;
            next += 1;
        }
        matrix.value[next..].fill([[0.0; D]; D]);
        for plan in &mut self.plans {
            let factor = if plan.term.1 { weights.damping } else { weights.stiffness };
            plan.fill(system, at);
            plan.add(matrix, factor, held);
        }
    }

    /// Adds the products of the energies' Hessians, as last assembled, with a displacement `p` of
    /// constrained coordinates, flat [m].
    pub(super) fn add_held_product(&self, p: &[f64], y: &mut [f64]) {
        for plan in self.plans.iter().filter(|plan| !plan.term.1) {
            let stencils = plan.stencils.vertices.chunks_exact(plan.stencils.size);
            for (stencil, blocks) in stencils.zip(plan.blocks.chunks_exact(plan.pairs())) {
                add_stencil_product::<D>(stencil, blocks.as_flattened().as_flattened(), p, y);
            }
        }
    }
}

/// Returns plans for all stencil lists that are not empty, energies first.
fn plans<const D: usize>(system: &System) -> Vec<ListPlan<D>> {
    let energies = (0..system.terms().len()).map(|index| (index, false));
    let dissipative = (0..system.dissipation().len()).map(|index| (index, true));
    let mut plans = vec![];
    for at in energies.chain(dissipative) {
        let lists = term(system, at).map_or(&[][..], |term| term.lists());
        for (list, stencils) in lists.iter().enumerate().filter(|(_, list)| !list.vertices.is_empty()) {
            let stencils = stencils.clone();
            plans.push(ListPlan { term: at, list, stencils, slot: vec![], blocks: vec![] });
        }
    }
    plans
}

/// Positions of all blocks in `matrix`; stencils found in `before` keep theirs. `None` if the pattern
/// lacks one.
fn place<const D: usize>(
    stencils: &Stencils,
    matrix: &BlockMatrix<D>,
    before: Option<&ListPlan<D>>,
    is_held: impl Fn(u32) -> bool,
) -> Option<Vec<[u32; 2]>> {
    let (mut slot, mut fits) = (Vec::with_capacity(before.map_or(0, |before| before.slot.len())), true);
    let mut known = KnownSlots::new(before);
    for stencil in stencils.vertices.chunks_exact(stencils.size) {
        if let Some(known) = known.of(stencil) {
            slot.extend_from_slice(known);
            continue;
        }
        for_pairs(stencil, |a, b| {
            let places = if is_held(a) || is_held(b) {
                Some([NOWHERE; 2])
            } else {
                find(matrix, a, b).and_then(|one| Some([one, find(matrix, b, a)?]))
            };
            fits &= places.is_some();
            slot.push(places.unwrap_or([NOWHERE; 2]));
        });
    }
    fits.then_some(slot)
}

/// Positions of earlier stencils, searched in order.
struct KnownSlots<'a> {
    /// Vertices and positions of the remaining stencils, flat.
    vertices: &'a [u32],
    slot: &'a [[u32; 2]],
    size: usize,
}

impl<'a> KnownSlots<'a> {
    fn new<const D: usize>(plan: Option<&'a ListPlan<D>>) -> Self {
        // Expected stencils have no positions yet.
        match plan.filter(|plan| !plan.slot.is_empty()) {
            Some(plan) => {
                KnownSlots { vertices: &plan.stencils.vertices, slot: &plan.slot, size: plan.stencils.size }
            }
            None => KnownSlots { vertices: &[], slot: &[], size: 1 },
        }
    }

    /// Returns the positions of this stencil if it is among the next ones: most stencils stay, and all
    /// keep their order.
    fn of(&mut self, stencil: &[u32]) -> Option<&'a [[u32; 2]]> {
        let mut next = self.vertices.chunks_exact(self.size).take(STENCILS_AHEAD);
        let skipped = next.position(|known| known == stencil)?;
        let pairs = self.size * (self.size + 1) / 2;
        self.vertices = &self.vertices[(skipped + 1) * self.size..];
        let (own, rest) = self.slot[skipped * pairs..].split_at(pairs);
        self.slot = rest;
        Some(own)
    }
}

/// Blocks of a row.
fn blocks_of<const D: usize>(matrix: &BlockMatrix<D>, row: usize) -> Range<usize> {
    matrix.row_start[row] as usize..matrix.row_start[row + 1] as usize
}

/// Index of the block in `row` and `column`.
fn find<const D: usize>(matrix: &BlockMatrix<D>, row: u32, column: u32) -> Option<u32> {
    let range = blocks_of(matrix, row as usize);
    let at = matrix.column[range.clone()].binary_search(&column).ok()?;
    Some((range.start + at) as u32)
}

/// Removes duplicates from the sorted values from `first` on.
fn dedup_from(numbers: &mut Vec<u32>, first: usize) {
    let mut kept = first;
    for i in first..numbers.len() {
        if i == first || numbers[i] != numbers[kept - 1] {
            numbers[kept] = numbers[i];
            kept += 1;
        }
    }
    numbers.truncate(kept);
}

impl<const D: usize> ListPlan<D> {
    /// True if both belong to the same list.
    fn is_of(&self, other: &Self) -> bool {
        (self.term, self.list) == (other.term, other.list)
    }

    /// Vertex pairs per stencil.
    fn pairs(&self) -> usize {
        self.stencils.size * (self.stencils.size + 1) / 2
    }

    /// Computes the blocks, group by group.
    fn fill(&mut self, system: &System, at: At<'_>) {
        let pairs = self.pairs();
        let ListPlan { term: index, list, slot, blocks, .. } = self;
        let Some(term) = term(system, *index) else { return };
        blocks.resize(slot.len(), [[0.0; D]; D]);
        let group = |(group, out): (usize, &mut [Block<D>])| {
            let first = group * GROUP;
            let stencils = first..first + out.len() / pairs;
            term.blocks(*list, stencils, (at.x, at.v), at.psd, out.as_flattened_mut().as_flattened_mut());
        };
        blocks.par_chunks_mut(GROUP * pairs).enumerate().for_each(group);
    }

    /// Adds the blocks in stencil order, without rows and columns of constrained coordinates.
    fn add(&self, matrix: &mut BlockMatrix<D>, factor: f64, held: &[bool]) {
        let of_vertex = |v: u32| &held[v as usize * D..][..D];
        let pairs = self.pairs();
        let numbered = self.stencils.vertices.chunks_exact(self.stencils.size).enumerate();
        for (number, stencil) in numbered {
            let is_free = !stencil.iter().any(|v| of_vertex(*v).contains(&true));
            let mut at = number * pairs;
            for_pairs(stencil, |a, b| {
                if let Some(slot) = self.slot.get(at + SLOTS_AHEAD) {
                    slot.iter().for_each(|place| prefetch(&matrix.value, *place as usize));
                }
                let (slot, mut block) = (self.slot[at], self.blocks[at]);
                at += 1;
                if slot[0] == NOWHERE {
                    return;
                }
                block.as_flattened_mut().iter_mut().for_each(|entry| *entry *= factor);
                if !is_free {
                    let (rows, columns) = (of_vertex(a), of_vertex(b));
                    for k in 0..D {
                        (0..D).filter(|l| rows[k] || columns[*l]).for_each(|l| block[k][l] = 0.0);
                    }
                }
                add(&mut matrix.value[slot[0] as usize], &block, false);
                if a != b {
                    add(&mut matrix.value[slot[1] as usize], &block, true);
                }
            });
        }
    }
}
