//! Vertex runs, for vertices numbered as on a grid: the other ends of eight springs lie side by side in memory, too.

use super::half_springs::{HalfSpring, HalfSprings};
use super::neighbours::{COPIED_AT_ONCE, Neighbours};
use super::slots::Slots;
use crate::lanes::{Aligned, Kernel, Lanes, WIDTH, dispatch};

/// The other ends of the springs in a slot: vertex `i` of the block has a spring to `i + offset` if bit `i` of `lanes` is set.
#[derive(Clone, Copy, Debug)]
struct Run {
    offset: i32,
    lanes: u8,
}

/// The other ends in every slot.
#[derive(Debug)]
pub(super) struct Runs {
    vertices: usize,
    runs: Vec<Run>,
}

/// A run with the springs in its lanes.
type Draft = (Run, [Option<HalfSpring>; WIDTH]);

/// Writes the runs of a block over `drafts`, by offset; `false` if an offset is too large for a run.
fn draft(half: &HalfSprings, block: usize, drafts: &mut Vec<Draft>) -> bool {
    drafts.clear();
    for lane in 0..WIDTH {
        let own = block * WIDTH + lane;
        for h in half.of(own) {
            let Ok(offset) = i32::try_from(i64::from(h.neighbour) - own as i64) else { return false };
            // Where two springs join the same vertices, the second needs a run of its own.
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
                    drafts.push((Run { offset, lanes: 1 << lane }, springs));
                }
            }
        }
    }
    // Stable: runs of the same offset stay in the order of their springs.
    drafts.sort_by_key(|(run, _)| run.offset);
    true
}

impl Runs {
    /// Runs of these springs and their constants; `None` if less than half of the lanes would have a spring.
    pub(super) fn new(half: &HalfSprings, stiffness: &[f64], rest_length: &[f64]) -> Option<(Self, Slots)> {
        // More slots than this are no gain.
        let most = 2 * half.len() / WIDTH;
        let mut slots = Slots::new(stiffness);
        let (mut runs, mut drafts) = (vec![], vec![]);
        for block in 0..half.block_count() {
            if !draft(half, block, &mut drafts) || runs.len() + drafts.len() > most {
                return None;
            }
            for (run, springs) in &drafts {
                runs.push(*run);
                slots.push(springs, stiffness, rest_length);
            }
            slots.end_block();
        }
        runs.shrink_to_fit();
        slots.shrink();
        Some((Runs { vertices: half.vertex_count(), runs }, slots))
    }
}

/// One column of numbers per component, with a pack of zeros before the first vertex and at least one after the last: a run may
/// reach that far in lanes without a spring.
#[derive(Debug)]
pub(super) struct Columns {
    numbers: Aligned,
    /// Numbers in a column.
    length: usize,
}

impl Columns {
    /// Component `c` of `WIDTH` vertices from `from` on, which may lie a pack before the first or end a pack after the last.
    #[inline(always)]
    fn load<L: Lanes>(&self, c: usize, from: isize) -> L {
        let at = (c * self.length + WIDTH).wrapping_add_signed(from);
        L::load(&self.numbers[at..].as_chunks::<WIDTH>().0[0])
    }
}

impl<const D: usize> Neighbours<D> for Runs {
    type Field = Columns;

    fn field(&self) -> Columns {
        let packs = self.vertices.div_ceil(WIDTH) + 2;
        Columns { numbers: Aligned::packs(D * packs), length: packs * WIDTH }
    }

    fn copy(&self, x: &[f64], field: &mut Columns) {
        let mut columns: [&mut [f64]; D] = std::array::from_fn(|_| Default::default());
        for (column, numbers) in columns.iter_mut().zip(field.numbers.chunks_exact_mut(field.length)) {
            *column = &mut numbers[WIDTH..WIDTH + self.vertices];
        }
        split(columns, x.as_chunks().0);
    }

    #[inline(always)]
    fn own<L: Lanes>(&self, field: &Columns, block: usize) -> [L; D] {
        let mut own = [L::zero(); D];
        for c in 0..D {
            own[c] = field.load(c, (block * WIDTH) as isize);
        }
        own
    }

    #[inline(always)]
    fn difference<L: Lanes>(&self, field: &Columns, own: &[L; D], block: usize, slot: usize) -> [L; D] {
        let run = self.runs[slot];
        let lanes = L::mask_from_bits(run.lanes);
        let mut d = *own;
        for c in 0..D {
            let other = field.load(c, (block * WIDTH) as isize + run.offset as isize);
            d[c] = L::select(lanes, own[c] - other, L::zero());
        }
        d
    }

    fn neighbour(&self, block: usize, slot: usize, lane: usize) -> Option<usize> {
        let run = self.runs[slot];
        let other = (block * WIDTH + lane).wrapping_add_signed(run.offset as isize);
        (run.lanes >> lane & 1 == 1).then_some(other)
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.runs[..])
    }

    fn field_bytes(&self) -> usize {
        8 * D * (self.vertices.div_ceil(WIDTH) + 2) * WIDTH
    }
}

/// Splits rows into columns, on several threads where there are many.
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
