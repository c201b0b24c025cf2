//! Vertex runs, for vertices numbered as on a grid: the other ends of eight springs are adjacent in
//! memory, too.

mod rings;

use std::collections::BTreeMap;
use std::ops::Range;

use self::rings::{Class, NO_RING, SpringRings};
use super::half_springs::{HalfSpring, HalfSprings};
use super::kernels::tension;
use super::neighbours::{COPIED_AT_ONCE, Neighbours};
use super::slots::Slots;
use crate::lanes::{Aligned, Columns, ColumnsView, Kernel, Lanes, WIDTH, dispatch};

/// Mask of a slot with a spring in every lane.
const ALL: u8 = u8::MAX;

/// Other ends of the springs in a slot: vertex `i` of the block has a spring to `i + offset` if bit `i`
/// of `lanes` is set.
#[derive(Clone, Copy, Debug)]
struct SpringRun {
    offset: i32,
    lanes: u8,
    /// Start of the ring buffer for its tensions, from the lower ends to the upper; [`NO_RING`] if both
    /// ends compute them.
    ring: u32,
}

impl SpringRun {
    /// True if the tensions are computed at the other ends and read here.
    fn is_read(self) -> bool {
        self.offset < 0 && self.ring != NO_RING
    }
}

/// Other ends in every slot. In each block, computed slots precede those whose tensions are read.
#[derive(Debug)]
pub(super) struct Runs {
    vertices: usize,
    runs: Vec<SpringRun>,
    /// Number of computed slots of each block.
    computed: Vec<u32>,
    rings: SpringRings,
}

/// Run with the springs in its lanes.
type Draft = (SpringRun, [Option<HalfSpring>; WIDTH]);

/// Writes the runs of a block to `drafts`, by offset; returns `false` if an offset is too large for a
/// run.
fn draft(half: &HalfSprings, block: usize, drafts: &mut Vec<Draft>) -> bool {
    drafts.clear();
    for lane in 0..WIDTH {
        let own = block * WIDTH + lane;
        for h in half.of(own) {
            let Ok(offset) = i32::try_from(i64::from(h.neighbour) - own as i64) else { return false };
            // If two springs join the same vertices, the second needs a run of its own.
            let free =
                drafts.iter_mut().find(|(run, springs)| run.offset == offset && springs[lane].is_none());
            match free {
                Some((run, springs)) => {
                    run.lanes |= 1 << lane;
                    springs[lane] = Some(*h);
                }
                None => {
                    let mut springs = [None; WIDTH];
                    springs[lane] = Some(*h);
                    drafts.push((SpringRun { offset, lanes: 1 << lane, ring: NO_RING }, springs));
                }
            }
        }
    }
    // Stable: runs of the same offset stay in the order of their springs.
    drafts.sort_by_key(|(run, _)| run.offset);
    true
}

/// Returns the class of each run of a block.
fn classes(drafts: &[Draft]) -> impl Iterator<Item = Class> {
    // Equal offsets are adjacent, in the order of their springs, at both ends.
    let ranks = drafts.chunk_by(|(a, _), (b, _)| a.offset == b.offset).flat_map(|equal| 0..equal.len());
    drafts.iter().zip(ranks).map(|((run, _), rank)| Class { offset: run.offset.unsigned_abs(), rank })
}

impl Runs {
    /// Creates the runs of these springs and their constants; `None` if less than half of the lanes would
    /// have a spring.
    pub(super) fn new(half: &HalfSprings, stiffness: &[f64], rest_length: &[f64]) -> Option<(Self, Slots)> {
        // More slots than this do not pay.
        let most = 2 * half.len() / WIDTH;
        let (mut count, mut drafts) = (0, vec![]);
        // First pass: count slots, and the blocks in which each class occurs.
        let mut frequency = BTreeMap::new();
        for block in 0..half.block_count() {
            if !draft(half, block, &mut drafts) || count + drafts.len() > most {
                return None;
            }
            count += drafts.len();
            for (class, (run, _)) in classes(&drafts).zip(&drafts) {
                if run.offset > 0 {
                    *frequency.entry(class).or_insert(0) += 1;
                }
            }
        }
        // Second pass: assign rings, and put computed slots before those that are read.
        let rings = SpringRings::new(&frequency, half.block_count());
        let mut slots = Slots::new(stiffness, count);
        let (mut runs, mut computed) = (Vec::with_capacity(count), Vec::with_capacity(half.block_count()));
        for block in 0..half.block_count() {
            draft(half, block, &mut drafts);
            let rings: Vec<u32> = classes(&drafts).map(|class| rings.of(class)).collect();
            for ((run, _), ring) in drafts.iter_mut().zip(rings) {
                run.ring = ring;
            }
            drafts.sort_by_key(|(run, _)| run.is_read());
            computed.push(drafts.partition_point(|(run, _)| !run.is_read()) as u32);
            for (run, springs) in &drafts {
                runs.push(*run);
                slots.push(springs, stiffness, rest_length);
            }
            slots.end_block();
        }
        slots.shrink();
        Some((Runs { vertices: half.vertex_count(), runs, computed, rings }, slots))
    }
}

/// Returns `own` minus eight vertices from vertex `from + offset` of a run on; zero in lanes without a
/// spring.
#[inline(always)]
fn difference<L: Lanes, const D: usize>(
    field: ColumnsView<D>,
    own: &[L; D],
    from: usize,
    run: SpringRun,
) -> [L; D] {
    let other: [L; D] = field.load(from as isize + run.offset as isize);
    let mut d = *own;
    for c in 0..D {
        d[c] = own[c] - other[c];
    }
    if run.lanes != ALL {
        let lanes = L::mask_from_bits(run.lanes);
        for c in 0..D {
            d[c] = L::select(lanes, d[c], L::zero());
        }
    }
    d
}

impl<const D: usize> Neighbours<D> for Runs {
    type Field = Columns<D>;
    type Tensions = Aligned;

    fn field(&self) -> Columns<D> {
        Columns::new(self.vertices)
    }

    fn tensions(&self) -> Aligned {
        Aligned::packs(self.rings.numbers() / WIDTH)
    }

    fn copy(&self, x: &[f64], field: &mut Columns<D>) {
        split(field.each_mut(), x.as_chunks().0);
    }

    #[inline(always)]
    fn own<L: Lanes>(&self, field: &Columns<D>, block: usize) -> [L; D] {
        field.view().load((block * WIDTH) as isize)
    }

    #[inline(always)]
    fn difference<L: Lanes>(&self, field: &Columns<D>, own: &[L; D], block: usize, slot: usize) -> [L; D] {
        difference(field.view(), own, block * WIDTH, self.runs[slot])
    }

    fn fewest_blocks(&self) -> usize {
        // At most an eighth of additional blocks.
        8 * self.rings.reach()
    }

    /// Computes a tension at the lower end of a spring and reads it at the upper end.
    #[inline(always)]
    fn gradient<L: Lanes>(
        &self,
        slots: &Slots,
        field: &Columns<D>,
        tensions: &mut Aligned,
        blocks: Range<usize>,
        out: &mut [[[f64; D]; WIDTH]],
    ) -> L {
        // Zero times a finite number is zero, times any other NaN.
        let mut zero = L::zero();
        let field = field.view();
        let mut tensions = self.rings.in_memory(tensions);
        let first = blocks.start.saturating_sub(self.rings.reach());
        // A slot needs little besides arithmetic: the more of them the processor sees at once, the better
        // it hides the latency of roots and quotients.
        for block in first..blocks.end {
            let from = block * WIDTH;
            let own: [L; D] = field.load(from as isize);
            let mut g = [L::zero(); D];
            let of_block = slots.of(block);
            let (computed, read) = self.runs[of_block.clone()].split_at(self.computed[block] as usize);
            let constants = slots.constants_of::<L>(of_block.start..of_block.start + computed.len());
            for (i, run) in computed.iter().enumerate() {
                let d = difference(field, &own, from, *run);
                let t = tension(constants.get(i), &d);
                if run.ring != NO_RING {
                    tensions.keep(run.ring, from, t);
                }
                for c in 0..D {
                    g[c] = t.mul_add(d[c], g[c]);
                }
            }
            tensions.end_block(from);
            if block < blocks.start {
                continue;
            }
            for run in read {
                let d = difference(field, &own, from, *run);
                let mut t: L = tensions.read(run.ring, from, run.offset);
                if run.lanes != ALL {
                    // Other lanes may hold older tensions, which need not be finite.
                    t = L::select(L::mask_from_bits(run.lanes), t, L::zero());
                }
                for c in 0..D {
                    g[c] = t.mul_add(d[c], g[c]);
                }
            }
            for c in 0..D {
                zero = g[c].mul_add(L::zero(), zero);
            }
            L::store_interleaved(g, &mut out[block - blocks.start]);
        }
        zero
    }

    fn neighbour(&self, block: usize, slot: usize, lane: usize) -> Option<usize> {
        let run = self.runs[slot];
        let other = (block * WIDTH + lane).wrapping_add_signed(run.offset as isize);
        (run.lanes >> lane & 1 == 1).then_some(other)
    }
}

/// Splits rows into columns, on several threads if there are many.
fn split<const D: usize>(columns: [&mut [f64]; D], rows: &[[f64; D]]) {
    if rows.len() <= COPIED_AT_ONCE || rayon::current_num_threads() == 1 {
        dispatch(Split { columns, rows });
        return;
    }
    let middle = (rows.len() / 2).next_multiple_of(WIDTH);
    let mut low: [&mut [f64]; D] = std::array::from_fn(|_| Default::default());
    let mut high: [&mut [f64]; D] = std::array::from_fn(|_| Default::default());
    for (c, column) in columns.into_iter().enumerate() {
        (low[c], high[c]) = column.split_at_mut(middle);
    }
    rayon::join(|| split(low, &rows[..middle]), || split(high, &rows[middle..]));
}

struct Split<'a, const D: usize> {
    columns: [&'a mut [f64]; D],
    rows: &'a [[f64; D]],
}

impl<const D: usize> Kernel for Split<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Split { columns, rows } = self;
        let (packs, rest) = rows.as_chunks::<WIDTH>();
        for (i, pack) in packs.iter().enumerate() {
            let v: [L; D] = L::load_interleaved(pack);
            for c in 0..D {
                v[c].store(&mut columns[c].as_chunks_mut().0[i]);
            }
        }
        for (i, row) in rest.iter().enumerate() {
            for c in 0..D {
                columns[c][packs.len() * WIDTH + i] = row[c];
            }
        }
    }
}
