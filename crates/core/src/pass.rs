//! One fused pass over all vertices: the force is added up, and drag, kick, drift and walls follow while the
//! rows are in the cache.
//!
//! Vertices are processed in blocks of fixed size. For each block the energy terms add their rows to a
//! gradient on the stack. No array of forces is written or read; the old state is read once and the new one
//! written once. Blocks are independent of each other: the result is bit-identical on any number of threads.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use crate::constraint::Wall;
use crate::dissipation::DissipativeTerm;
use crate::energy::{EnergyTerm, ForceLayout};
use crate::lanes::{Kernel, Lanes, Numbers, WIDTH, dispatch};
use crate::scalar::Scalar;
use crate::system::WallStop;

/// Vertices in a block: its rows of position, velocity, gradient and inverse mass together fit the
/// first-level cache.
const BLOCK: usize = 128;
/// Numbers in the rows of a block.
const BLOCK_NUMBERS: usize = 3 * BLOCK;
/// Numbers in the rows of the only block of a small scene: clearing more would cost noticeable time.
const SMALL_BLOCK_NUMBERS: usize = 192;
/// Number of packs after which components repeat in the same order, in two dimensions as in three.
const PERIOD: usize = 3;
/// Blocks per task: below twice as many, other threads cost more than they save.
const TASK_BLOCKS: usize = 32;

/// Inverse masses `1 / m` of every coordinate [1/kg], zero if it is fixed. If all of a block are equal, a
/// pass reads only that number.
#[derive(Clone, Debug)]
pub(crate) struct InverseMass {
    numbers: Numbers,
    /// Common value of a block; zero if its values differ.
    of_block: Vec<f64>,
    /// Numbers of a block.
    per_block: usize,
}

impl InverseMass {
    /// Inverse masses of free vertices of these masses [kg] in `dimension` dimensions.
    pub(crate) fn free(mass: &[f64], dimension: usize) -> Self {
        let mut numbers = Numbers::zeros(mass.len() * dimension);
        for (rows, m) in numbers.chunks_exact_mut(dimension).zip(mass) {
            rows.fill(1.0 / m);
        }
        let common = |block: &[f64]| if block.iter().all(|w| *w == block[0]) { block[0] } else { 0.0 };
        let per_block = BLOCK * dimension;
        let of_block = numbers.chunks(per_block).map(common).collect();
        InverseMass { numbers, of_block, per_block }
    }

    /// Fixes a coordinate.
    pub(crate) fn hold(&mut self, coordinate: usize) {
        self.numbers[coordinate] = 0.0;
        self.of_block[coordinate / self.per_block] = 0.0;
    }

    /// The number of every coordinate.
    pub(crate) fn numbers(&self) -> &[f64] {
        &self.numbers
    }
}

/// Rows of the gradient of a block.
#[repr(align(64))]
struct Gradient<const NUMBERS: usize>([f64; NUMBERS]);

/// Work of a pass on each row, in this order:
/// `v <- drag v`, `v <- v + kick a`, `x <- x + drift v`, walls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct KickDrift {
    /// Factor of the velocities before the kick.
    pub(crate) drag: f64,
    /// Time [s] for which the acceleration acts; 0: forces are not evaluated.
    pub(crate) kick: f64,
    /// Time [s] for which the velocity acts.
    pub(crate) drift: f64,
    /// True if walls correct positions.
    pub(crate) walls: bool,
}

impl KickDrift {
    /// A pass without an effect.
    pub(crate) const NOTHING: KickDrift = KickDrift { drag: 1.0, kick: 0.0, drift: 0.0, walls: false };
}

/// Result of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PassResult {
    /// True if all positions and velocities are finite.
    pub(crate) finite: bool,
    /// True if a wall moved a vertex.
    pub(crate) put_back: bool,
}

impl PassResult {
    const NOTHING: PassResult = PassResult { finite: true, put_back: false };

    fn and(self, other: Self) -> Self {
        PassResult { finite: self.finite & other.finite, put_back: self.put_back | other.put_back }
    }
}

/// Inputs of a pass.
#[derive(Clone, Copy)]
pub(crate) struct StepInputs<'a> {
    pub(crate) dimension: usize,
    pub(crate) terms: &'a [Box<dyn EnergyTerm>],
    pub(crate) dissipation: &'a [Box<dyn DissipativeTerm>],
    pub(crate) inverse_mass: &'a InverseMass,
    pub(crate) walls: &'a [Wall],
    /// Receives the vertices that walls stop, in any order.
    pub(crate) stops: &'a Mutex<Vec<WallStop>>,
}

impl StepInputs<'_> {
    /// Runs `pass` on the rows `x` and `v`, which are overwritten. If `from` is given, the old rows are read
    /// there.
    pub(crate) fn run(
        &self,
        pass: &KickDrift,
        from: Option<(&[f64], &[f64])>,
        x: &mut [f64],
        v: &mut [f64],
    ) -> PassResult {
        let per_block = BLOCK * self.dimension;
        let forces = if pass.kick == 0.0 { Forces::NONE } else { self.forces() };
        let forces = &forces;
        let block = |(i, (x, v)): (usize, (&mut [f64], &mut [f64]))| {
            let start = i * per_block;
            let range = start..start + x.len();
            let from = from.map(|(x, v)| (&x[range.clone()], &v[range]));
            if x.len() <= SMALL_BLOCK_NUMBERS {
                self.block::<SMALL_BLOCK_NUMBERS>(pass, forces, start, from, x, v)
            } else {
                self.block::<BLOCK_NUMBERS>(pass, forces, start, from, x, v)
            }
        };
        let blocks = x.len().div_ceil(per_block);
        if blocks < 2 * TASK_BLOCKS || rayon::current_num_threads() == 1 {
            let rows = x.chunks_mut(per_block).zip(v.chunks_mut(per_block));
            return rows.enumerate().map(block).fold(PassResult::NOTHING, PassResult::and);
        }
        let rows = x.par_chunks_mut(per_block).zip(v.par_chunks_mut(per_block));
        let rows = rows.enumerate().with_min_len(TASK_BLOCKS);
        rows.map(block).reduce(|| PassResult::NOTHING, PassResult::and)
    }

    /// Processes one block, from number `start` of the flat arrays on, `NUMBERS` of them at most.
    fn block<const NUMBERS: usize>(
        &self,
        pass: &KickDrift,
        forces: &Forces<'_>,
        start: usize,
        from: Option<(&[f64], &[f64])>,
        x: &mut [f64],
        v: &mut [f64],
    ) -> PassResult {
        let inverse_mass = &self.inverse_mass.numbers[start..start + x.len()];
        let same = self.inverse_mass.of_block[start / (BLOCK * self.dimension)];
        let (first, count) = (start / self.dimension, x.len() / self.dimension);
        let mut sums;
        let gradient = match forces.contiguous.and_then(|term| term.rows(first, count)) {
            Some(rows) => rows,
            None => {
                sums = Gradient([0.0; NUMBERS]);
                let sums = &mut sums.0[..x.len()];
                if pass.kick != 0.0 {
                    self.add_forces(start, sums);
                }
                &*sums
            }
        };
        let uniform = self.in_packs(&forces.uniform);
        let finite = dispatch(Update { pass, uniform, gradient, inverse_mass, same, from, x, v });
        let mut put_back = false;
        if pass.walls {
            // Once a block, and only where a vertex is stopped.
            let mut stops = None;
            for (number, wall) in self.walls.iter().enumerate() {
                put_back |= wall.apply(inverse_mass, x, v, |vertex, speed| {
                    let lock = || self.stops.lock().unwrap_or_else(PoisonError::into_inner);
                    let stops = stops.get_or_insert_with(lock);
                    stops.push(WallStop { vertex: first + vertex, wall: number, speed });
                });
            }
        }
        PassResult { finite, put_back }
    }

    /// Overwrites `a` with the acceleration `-M^-1 (dE/dx + dR/dv)` [m/s^2] of the forces last evaluated.
    pub(crate) fn accelerations(&self, a: &mut [f64]) {
        let per_block = BLOCK * self.dimension;
        let uniform = self.forces().uniform;
        let block = |(i, a): (usize, &mut [f64])| {
            let start = i * per_block;
            a.fill(0.0);
            self.add_forces(start, a);
            let uniform = uniform[..self.dimension].iter().cycle();
            for ((a, w), uniform) in a.iter_mut().zip(&self.inverse_mass.numbers[start..]).zip(uniform) {
                *a = acceleration(*a, *w, *uniform);
            }
        };
        if a.len() < 2 * TASK_BLOCKS * per_block {
            a.chunks_mut(per_block).enumerate().for_each(block);
        } else {
            a.par_chunks_mut(per_block).enumerate().with_min_len(TASK_BLOCKS).for_each(block);
        }
    }

    /// Passes the row of the gradient [N] last evaluated of each of these `vertices`, ascending, of `count`
    /// in all, to the visitor.
    pub(crate) fn visit_gradient(
        &self,
        vertices: &[u32],
        count: usize,
        mut visit: impl FnMut(usize, &[f64]),
    ) {
        let d = self.dimension;
        for vertices in vertices.chunk_by(|a, b| a / BLOCK as u32 == b / BLOCK as u32) {
            let first = vertices[0] as usize / BLOCK * BLOCK;
            let mut gradient = Gradient([0.0; BLOCK_NUMBERS]);
            let gradient = &mut gradient.0[..BLOCK.min(count - first) * d];
            self.add_rows(first * d, gradient);
            for &vertex in vertices {
                let row = (vertex as usize - first) * d;
                visit(vertex as usize, &gradient[row..row + d]);
            }
        }
    }

    /// Form of the forces of all blocks of a pass.
    fn forces(&self) -> Forces<'_> {
        let (mut others, mut contiguous, mut uniform) = (0, None, [0.0; 3]);
        for term in self.terms {
            match uniform_acceleration(term.as_ref()) {
                Some(acceleration) => add(&mut uniform, acceleration),
                None => {
                    others += 1;
                    contiguous = term.layout();
                }
            }
        }
        let alone = others == 1 && self.dissipation.is_empty();
        Forces { uniform, contiguous: contiguous.filter(|_| alone) }
    }

    /// Adds the rows of a block, from number `start` on, except for uniform accelerations.
    fn add_forces(&self, start: usize, gradient: &mut [f64]) {
        for term in self.terms.iter().filter(|term| uniform_acceleration(term.as_ref()).is_none()) {
            term.add_rows(start / self.dimension, gradient);
        }
        self.add_dissipation(start, gradient);
    }

    /// `uniform` in the order of the numbers of a block.
    fn in_packs(&self, uniform: &[f64; 3]) -> [[f64; WIDTH]; PERIOD] {
        let mut packs = [[0.0; WIDTH]; PERIOD];
        let components = uniform[..self.dimension].iter().cycle();
        packs.as_flattened_mut().iter_mut().zip(components).for_each(|(number, a)| *number = *a);
        packs
    }

    /// Adds all rows of a block, from number `start` on.
    fn add_rows(&self, start: usize, gradient: &mut [f64]) {
        for term in self.terms {
            term.add_rows(start / self.dimension, gradient);
        }
        self.add_dissipation(start, gradient);
    }

    fn add_dissipation(&self, start: usize, gradient: &mut [f64]) {
        for term in self.dissipation {
            term.add_rows(start / self.dimension, gradient);
        }
    }
}

/// Forces of a pass that are read in place.
struct Forces<'a> {
    /// Uniform acceleration [m/s^2].
    uniform: [f64; 3],
    /// The only term with other forces, if its rows may be read in place.
    contiguous: Option<&'a dyn ForceLayout>,
}

impl Forces<'_> {
    const NONE: Self = Forces { uniform: [0.0; 3], contiguous: None };
}

/// Uniform acceleration [m/s^2] of a term, if it has one.
fn uniform_acceleration(term: &dyn EnergyTerm) -> Option<&[f64]> {
    term.layout().and_then(|layout| layout.acceleration())
}

fn add(sum: &mut [f64; 3], acceleration: &[f64]) {
    sum.iter_mut().zip(acceleration).for_each(|(sum, a)| *sum += a);
}

/// Kick, drift and drag of the rows of a block; returns whether all results are finite.
struct Update<'a> {
    pass: &'a KickDrift,
    /// Acceleration in addition to that of the gradient [m/s^2].
    uniform: [[f64; WIDTH]; PERIOD],
    gradient: &'a [f64],
    inverse_mass: &'a [f64],
    /// Common value of `inverse_mass`; zero if its values differ.
    same: f64,
    /// Source of the old rows, if not `x` and `v`.
    from: Option<(&'a [f64], &'a [f64])>,
    x: &'a mut [f64],
    v: &'a mut [f64],
}

/// The acceleration by the gradient `g` and what is `uniform`, at inverse mass `w`.
#[inline(always)]
fn acceleration<S: Scalar>(g: S, w: S, uniform: S) -> S {
    // A fixed coordinate does not accelerate even if its force is not finite.
    S::select(S::zero().lt(w), uniform - w * g, S::zero())
}

/// The new position and velocity.
#[inline(always)]
fn update<S: Scalar>(pass: &[S; 3], a: S, x: S, v: S) -> (S, S) {
    let [drag, kick, drift] = *pass;
    let v = drag * v + kick * a;
    (x + drift * v, v)
}

/// The whole packs of each array, and the numbers after them.
type Packs<'a> = (&'a [[f64; WIDTH]], &'a [f64]);

impl Kernel for Update<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let KickDrift { drag, kick, drift, .. } = *self.pass;
        let numbers = [drag, kick, drift];
        let mut packs = [L::zero(); 3];
        for i in 0..3 {
            packs[i] = L::splat(numbers[i]);
        }
        let mut uniform = [L::zero(); PERIOD];
        for i in 0..PERIOD {
            uniform[i] = L::load(&self.uniform[i]);
        }
        let (xs, x_rest) = self.x.as_chunks_mut::<WIDTH>();
        let (vs, v_rest) = self.v.as_chunks_mut::<WIDTH>();
        let (gs, g_rest): Packs = self.gradient.as_chunks::<WIDTH>();
        let (ws, w_rest): Packs = self.inverse_mass.as_chunks::<WIDTH>();
        let from: Option<(Packs, Packs)> = self.from.map(|(x, v)| (x.as_chunks(), v.as_chunks()));
        // Of one length, so that the loop need not test for each.
        let count = xs.len();
        let (vs, gs, ws) = (&mut vs[..count], &gs[..count], &ws[..count]);
        let from_packs = from.map(|((x, _), (v, _))| (&x[..count], &v[..count]));
        let same = if self.same == 0.0 { None } else { Some(L::splat(self.same)) };
        // Zero times a finite number is zero, times anything else NaN.
        let mut sum = L::zero();
        let mut period = 0;
        for i in 0..count {
            let (x, v) = match from_packs {
                Some((x, v)) => (&x[i], &v[i]),
                None => (&xs[i], &vs[i]),
            };
            let w = match same {
                Some(w) => w,
                None => L::load(&ws[i]),
            };
            let a = acceleration(L::load(&gs[i]), w, uniform[0]);
            let (x, v) = update(&packs, a, L::load(x), L::load(v));
            x.store(&mut xs[i]);
            v.store(&mut vs[i]);
            sum += L::zero().mul_add(x, L::zero() * v);
            uniform = [uniform[1], uniform[2], uniform[0]];
            period = (period + 1) % PERIOD;
        }
        let mut sum = sum.horizontal_sum();
        for i in 0..x_rest.len().min(v_rest.len()).min(g_rest.len()).min(w_rest.len()) {
            let (x, v) = match from {
                Some(((_, x), (_, v))) => (x[i], v[i]),
                None => (x_rest[i], v_rest[i]),
            };
            let a = acceleration(g_rest[i], w_rest[i], self.uniform[period][i]);
            let (x, v) = update(&numbers, a, x, v);
            (x_rest[i], v_rest[i]) = (x, v);
            sum += 0.0 * x + 0.0 * v;
        }
        sum == 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::BLOCK;
    use crate::energy::EnergyTerm;
    use crate::energy::gravity::UniformGravity;
    use crate::energy::spring::Springs;
    use crate::integrator::symplectic_euler::METHOD;
    use crate::simulation::Simulation;
    use crate::state::State;
    use crate::system::System;

    // The same acceleration of all vertices is added in the order of their components, to the last of them.
    #[test]
    fn every_component_falls_by_its_own_acceleration_whatever_its_mass() {
        let gravity = [1.5, -9.75, 0.375];
        for d in [2, 3] {
            for n in [1, 2, 3, 5, 8, 13, 128, 131, 300] {
                let mass: Vec<f64> = (0..n).map(|i| 0.1 + 0.7 * i as f64).collect();
                let mut system = System::new(d, mass.clone());
                system.add_term(Box::new(UniformGravity::new(&gravity[..d], &mass)));
                system.pin(&[0]);
                let state = State::new(vec![2.0; n * d], vec![0.0; n * d]);
                let mut simulation = Simulation::new(system, state, METHOD, 0.5);
                simulation.step().unwrap();
                let (x, v) = (simulation.state().x(), simulation.state().v());
                for i in 0..n * d {
                    let speed = if i < d { 0.0 } else { 0.5 * gravity[i % d] };
                    assert_eq!(
                        (v[i], x[i]),
                        (speed, 2.0 + 0.5 * speed),
                        "number {i} of {n} vertices in {d}D"
                    );
                }
            }
        }
    }

    // Blocks in which all masses are the same, some, or none, held or not.
    #[test]
    fn forces_move_masses_that_are_the_same_as_they_move_others() {
        let n = 3 * BLOCK + 40;
        let edges: Vec<[u32; 2]> = (1..n as u32).map(|i| [i - 1, i]).collect();
        let strand = || Springs::<3>::new("strand", &edges, &vec![3.0; n - 1], &vec![0.25; n - 1], n);
        let x: Vec<f64> = (0..3 * n).map(|i| (0.7 * i as f64).sin()).collect();
        let mut gradient = vec![0.0; 3 * n];
        strand().add_gradient(&x, &mut gradient);
        for odd in [None, Some(5), Some(n - 1)] {
            let mut mass = vec![0.5; n];
            if let Some(odd) = odd {
                mass[odd] = 4.0;
            }
            let mut system = System::new(3, mass.clone());
            system.add_term(Box::new(strand()));
            system.pin(&[0, 2 * BLOCK as u32 + 7]);
            let state = State::new(x.clone(), vec![0.0; 3 * n]);
            let mut simulation = Simulation::new(system, state, METHOD, 0.5);
            simulation.step().unwrap();
            for i in 0..3 * n {
                let held = [0, 2 * BLOCK + 7].contains(&(i / 3));
                let expected = if held { 0.0 } else { -0.5 * gradient[i] / mass[i / 3] };
                let speed = simulation.state().v()[i];
                assert!(
                    (speed - expected).abs() < 1e-14 * (1.0 + expected.abs()),
                    "{i}: {speed}, {expected}"
                );
            }
        }
    }
}
