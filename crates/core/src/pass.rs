//! One pass over all vertices: the force is added up, and kick, drift, drag and walls follow while the rows are in the cache.
//!
//! Vertices come in blocks of fixed size. For each block the terms of the energy add their rows to a gradient on the stack,
//! so that no array of forces is written or read, and the old state is read and the new one written once. A block does not
//! depend on any other: the bits are the same on any number of threads.

use rayon::prelude::*;

use crate::constraint::Wall;
use crate::dissipation::DissipativeTerm;
use crate::energy::EnergyTerm;
use crate::lanes::{Kernel, Lanes, WIDTH, dispatch};
use crate::scalar::Scalar;

/// Vertices in a block: its rows of position, velocity, gradient and inverse mass together fit the first cache.
const BLOCK: usize = 128;
/// Numbers in the rows of a block.
const BLOCK_NUMBERS: usize = 3 * BLOCK;
/// Blocks that a thread takes at once: below twice as many the hand-over costs more than it saves.
const TASK_BLOCKS: usize = 32;

/// What a pass does to each row, in this order:
/// `v <- drag_before v`, `v <- v + kick a`, `x <- x + drift v`, `v <- drag_after v`, walls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pass {
    /// Factor of the velocities before the kick.
    pub(crate) drag_before: f64,
    /// Time [s] for which the acceleration acts; 0: forces are not looked at.
    pub(crate) kick: f64,
    /// Time [s] for which the velocity acts.
    pub(crate) drift: f64,
    /// Factor of the velocities after all.
    pub(crate) drag_after: f64,
    /// Whether walls put vertices back.
    pub(crate) walls: bool,
}

impl Pass {
    /// A pass that leaves everything as it is.
    pub(crate) const NOTHING: Pass =
        Pass { drag_before: 1.0, kick: 0.0, drift: 0.0, drag_after: 1.0, walls: false };
}

/// What a pass came upon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Passed {
    /// Whether all positions and velocities are finite.
    pub(crate) finite: bool,
    /// Whether a wall moved a vertex.
    pub(crate) put_back: bool,
}

impl Passed {
    const NOTHING: Passed = Passed { finite: true, put_back: false };

    fn and(self, other: Self) -> Self {
        Passed { finite: self.finite & other.finite, put_back: self.put_back | other.put_back }
    }
}

/// What a pass reads.
#[derive(Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    pub(crate) dimension: usize,
    pub(crate) terms: &'a [Box<dyn EnergyTerm>],
    pub(crate) dissipation: &'a [Box<dyn DissipativeTerm>],
    /// Of every coordinate, zero where it is held [1/kg].
    pub(crate) inverse_mass: &'a [f64],
    pub(crate) walls: &'a [Wall],
}

impl Surroundings<'_> {
    /// Runs `pass` on the rows `x` and `v`, which are overwritten; they are taken `from` elsewhere where that is given.
    pub(crate) fn run(
        &self,
        pass: &Pass,
        from: Option<(&[f64], &[f64])>,
        x: &mut [f64],
        v: &mut [f64],
    ) -> Passed {
        let per_block = BLOCK * self.dimension;
        let block = |(i, (x, v)): (usize, (&mut [f64], &mut [f64]))| {
            let start = i * per_block;
            let range = start..start + x.len();
            self.block(pass, start, from.map(|(x, v)| (&x[range.clone()], &v[range])), x, v)
        };
        let blocks = x.len().div_ceil(per_block);
        if blocks < 2 * TASK_BLOCKS || rayon::current_num_threads() == 1 {
            let rows = x.chunks_mut(per_block).zip(v.chunks_mut(per_block));
            return rows.enumerate().map(block).fold(Passed::NOTHING, Passed::and);
        }
        let rows = x.par_chunks_mut(per_block).zip(v.par_chunks_mut(per_block));
        let rows = rows.enumerate().with_min_len(TASK_BLOCKS);
        rows.map(block).reduce(|| Passed::NOTHING, Passed::and)
    }

    /// The rows of one block, from number `start` of the flat arrays on.
    fn block(
        &self,
        pass: &Pass,
        start: usize,
        from: Option<(&[f64], &[f64])>,
        x: &mut [f64],
        v: &mut [f64],
    ) -> Passed {
        let inverse_mass = &self.inverse_mass[start..start + x.len()];
        let mut gradient = [0.0; BLOCK_NUMBERS];
        let gradient = &mut gradient[..x.len()];
        if pass.kick != 0.0 {
            self.add_rows(start, gradient);
        }
        let finite = dispatch(Update { pass, gradient, inverse_mass, from, x, v });
        let mut put_back = false;
        if pass.walls {
            for wall in self.walls {
                put_back |= wall.apply(inverse_mass, x, v);
            }
        }
        Passed { finite, put_back }
    }

    /// Writes the acceleration `-M^-1 (dE/dx + dR/dv)` [m/s^2] that belongs to the forces the terms hold over `a`.
    pub(crate) fn accelerations(&self, a: &mut [f64]) {
        let per_block = BLOCK * self.dimension;
        let block = |(i, a): (usize, &mut [f64])| {
            let start = i * per_block;
            a.fill(0.0);
            self.add_rows(start, a);
            for (a, w) in a.iter_mut().zip(&self.inverse_mass[start..]) {
                // A held coordinate stays at rest even where its force is not finite.
                *a = if *w == 0.0 { 0.0 } else { -(w * *a) };
            }
        };
        if a.len() < 2 * TASK_BLOCKS * per_block {
            a.chunks_mut(per_block).enumerate().for_each(block);
        } else {
            a.par_chunks_mut(per_block).enumerate().with_min_len(TASK_BLOCKS).for_each(block);
        }
    }

    /// Shows the row of the gradient [N] that the terms hold of each of these `vertices`, ascending, of `count` there are.
    pub(crate) fn visit_gradient(
        &self,
        vertices: &[u32],
        count: usize,
        mut visit: impl FnMut(usize, &[f64]),
    ) {
        let d = self.dimension;
        for vertices in vertices.chunk_by(|a, b| a / BLOCK as u32 == b / BLOCK as u32) {
            let first = vertices[0] as usize / BLOCK * BLOCK;
            let mut gradient = [0.0; BLOCK_NUMBERS];
            let gradient = &mut gradient[..BLOCK.min(count - first) * d];
            self.add_rows(first * d, gradient);
            for &vertex in vertices {
                let row = (vertex as usize - first) * d;
                visit(vertex as usize, &gradient[row..row + d]);
            }
        }
    }

    fn add_rows(&self, start: usize, gradient: &mut [f64]) {
        for term in self.terms {
            term.add_rows(start / self.dimension, gradient);
        }
        for term in self.dissipation {
            term.add_rows(start / self.dimension, gradient);
        }
    }
}

/// Kick, drift and drag of the rows of a block; whether all that came out is finite.
struct Update<'a> {
    pass: &'a Pass,
    gradient: &'a [f64],
    inverse_mass: &'a [f64],
    /// Where the old rows are, if not in `x` and `v`.
    from: Option<(&'a [f64], &'a [f64])>,
    x: &'a mut [f64],
    v: &'a mut [f64],
}

/// The new position and velocity.
#[inline(always)]
fn update<S: Scalar>(pass: &[S; 4], g: S, w: S, x: S, v: S) -> (S, S) {
    let [drag_before, kick, drift, drag_after] = *pass;
    // A held coordinate stays at rest even where its force is not finite.
    let a = S::select(S::zero().lt(w), -(w * g), S::zero());
    let v = drag_before * v + kick * a;
    (x + drift * v, drag_after * v)
}

impl Kernel for Update<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let Pass { drag_before, kick, drift, drag_after, .. } = *self.pass;
        let numbers = [drag_before, kick, drift, drag_after];
        let mut packs = [L::zero(); 4];
        for i in 0..4 {
            packs[i] = L::splat(numbers[i]);
        }
        let (xs, x_rest) = self.x.as_chunks_mut::<WIDTH>();
        let (vs, v_rest) = self.v.as_chunks_mut::<WIDTH>();
        let (gs, g_rest) = self.gradient.as_chunks::<WIDTH>();
        let (ws, w_rest) = self.inverse_mass.as_chunks::<WIDTH>();
        // Zero times a finite number is zero, times anything else NaN.
        let mut sum = L::zero();
        let from = self.from.map(|(x, v)| (x.as_chunks::<WIDTH>(), v.as_chunks::<WIDTH>()));
        for i in 0..xs.len().min(vs.len()).min(gs.len()).min(ws.len()) {
            let (x, v) = match from {
                Some(((x, _), (v, _))) => (&x[i], &v[i]),
                None => (&xs[i], &vs[i]),
            };
            let (x, v) = update(&packs, L::load(&gs[i]), L::load(&ws[i]), L::load(x), L::load(v));
            x.store(&mut xs[i]);
            v.store(&mut vs[i]);
            sum += L::zero() * x + L::zero() * v;
        }
        let mut sum = sum.horizontal_sum();
        for i in 0..x_rest.len().min(v_rest.len()).min(g_rest.len()).min(w_rest.len()) {
            let (x, v) = match from {
                Some(((_, x), (_, v))) => (x[i], v[i]),
                None => (x_rest[i], v_rest[i]),
            };
            let (x, v) = update(&numbers, g_rest[i], w_rest[i], x, v);
            (x_rest[i], v_rest[i]) = (x, v);
            sum += 0.0 * x + 0.0 * v;
        }
        sum == 0.0
    }
}
