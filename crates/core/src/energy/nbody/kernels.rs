//! Direct sum over pairs of blocks of eight particles, on lanes.
//!
//! Every pair is computed once and acts on both its particles. Blocks of targets are distributed to groups
//! round robin, because the first block pairs with all the others and the last with none.

use super::pair::{Block, TARGETS, by_newton, difference, dot, interaction, lane_of, load, splat};
use crate::lanes::{Kernel, Lanes, WIDTH};

/// Blocks of sources that are processed with all targets of a group before the next ones: with their
/// sums, 112 kB, which fits a cache near the core.
const TILE: usize = 256;

/// Particles in blocks. Padding lanes of the last block have mass zero and are far away.
#[derive(Clone, Copy)]
pub(super) struct Particles<'a, const D: usize> {
    pub(super) position: &'a [Block<D>],
    pub(super) mass: &'a [[f64; WIDTH]],
    pub(super) softening2: f64,
}

/// Sums over pairs into `out`, one block per block of particles, without the constant and the mass of the
/// target: `sum_j m_j d / r^3` with `d = x_i - x_j`, or its derivative along `direction`, see
/// [`interaction`]. `ENERGY`, which is not available for derivatives, also sums `sum_{i<j} m_i m_j / r`;
/// the other sums are bit-identical.
pub(super) struct PairKernel<'a, const D: usize, const DERIVATIVE: bool, const ENERGY: bool> {
    pub(super) particles: Particles<'a, D>,
    /// Direction of the derivative; otherwise any slice of the same length, which is not read.
    pub(super) direction: &'a [Block<D>],
    pub(super) group: usize,
    pub(super) groups: usize,
    pub(super) out: &'a mut [Block<D>],
}

impl<const D: usize, const DERIVATIVE: bool, const ENERGY: bool> PairKernel<'_, D, DERIVATIVE, ENERGY> {
    /// Returns position and, for the derivative, direction of one particle, in every lane.
    #[inline(always)]
    fn target<L: Lanes>(&self, i: usize, lane: usize) -> [[L; D]; 2] {
        let position = splat(&lane_of(&self.particles.position[i], lane));
        [position, if DERIVATIVE { splat(&lane_of(&self.direction[i], lane)) } else { position }]
    }

    /// Adds all pairs within block `i`, each from both sides.
    #[inline(always)]
    fn diagonal<L: Lanes>(&mut self, i: usize, softening2: L, energy: &mut L) {
        let position = load(&self.particles.position[i]);
        let source = [position, if DERIVATIVE { load(&self.direction[i]) } else { position }];
        let mass = L::load(&self.particles.mass[i]);
        for lane in 0..WIDTH {
            let (s, v) = interaction::<L, D, DERIVATIVE>(&self.target(i, lane), &source, softening2, false);
            // A particle does not act on itself.
            let others = L::mask_from_bits(!(1 << lane));
            for c in 0..D {
                self.out[i][c][lane] += L::select(others, mass * s * v[c], L::zero()).horizontal_sum();
            }
            if ENERGY {
                let potential = L::select(others, mass * s * dot(&v, &v, softening2), L::zero());
                *energy = potential.mul_add(L::splat(0.5 * self.particles.mass[i][lane]), *energy);
            }
        }
    }

    /// Adds the pairs of `TARGETS` particles of block `i`, from `first` on, with the later blocks
    /// `sources`.
    #[inline(always)]
    fn off_diagonal<L: Lanes>(
        &mut self,
        i: usize,
        first: usize,
        sources: std::ops::Range<usize>,
        softening2: L,
        energy: &mut L,
    ) {
        // Targets in every lane, and the factors of their reactions.
        let mut targets = [[[L::zero(); D]; 2]; TARGETS];
        let mut reaction = [L::zero(); TARGETS];
        for t in 0..TARGETS {
            targets[t] = self.target(i, first + t);
            reaction[t] = L::splat(-self.particles.mass[i][first + t]);
        }
        let mut sums = [[L::zero(); D]; TARGETS];
        let mut potential = [L::zero(); TARGETS];
        let positions = &self.particles.position[sources.clone()];
        let masses = &self.particles.mass[sources.clone()];
        let directions = &self.direction[sources.clone()];
        let out = &mut self.out[sources];
        // Sum the action of each pack on the targets, and add their reaction to it.
        for (((position, mass), direction), out) in positions.iter().zip(masses).zip(directions).zip(out) {
            let position = load(position);
            let source = [position, if DERIVATIVE { load(direction) } else { position }];
            let mass = L::load(mass);
            let mut on_source: [L; D] = load(out);
            for t in 0..TARGETS {
                let (s, v) = interaction::<L, D, DERIVATIVE>(&targets[t], &source, softening2, by_newton(t));
                let (on, back) = (mass * s, reaction[t] * s);
                if ENERGY {
                    potential[t] = on.mul_add(dot(&v, &v, softening2), potential[t]);
                }
                for c in 0..D {
                    sums[t][c] = on.mul_add(v[c], sums[t][c]);
                    on_source[c] = back.mul_add(v[c], on_source[c]);
                }
            }
            for c in 0..D {
                on_source[c].store(&mut out[c]);
            }
        }
        for t in 0..TARGETS {
            for c in 0..D {
                self.out[i][c][first + t] += sums[t][c].horizontal_sum();
            }
            if ENERGY {
                *energy -= reaction[t] * potential[t];
            }
        }
    }
}

impl<const D: usize, const DERIVATIVE: bool, const ENERGY: bool> Kernel
    for PairKernel<'_, D, DERIVATIVE, ENERGY>
{
    /// True if all sums are finite; and the energy, or zero.
    type Output = (bool, f64);

    #[inline(always)]
    fn run<L: Lanes>(mut self) -> (bool, f64) {
        let mut energy = L::zero();
        let softening2 = L::splat(self.particles.softening2);
        let blocks = self.particles.position.len();
        for block in self.out.iter_mut() {
            *block = [[0.0; WIDTH]; D];
        }
        for i in (self.group..blocks).step_by(self.groups) {
            self.diagonal(i, softening2, &mut energy);
        }
        for tile in (0..blocks).step_by(TILE) {
            let end = (tile + TILE).min(blocks);
            for i in (self.group..end).step_by(self.groups) {
                for first in (0..WIDTH).step_by(TARGETS) {
                    let sources = tile.max(i + 1).min(end)..end;
                    self.off_diagonal(i, first, sources, softening2, &mut energy);
                }
            }
        }
        // Zero times a finite number is zero, times any other NaN.
        let mut zero = L::zero();
        for block in self.out.iter().flatten() {
            zero = L::load(block).mul_add(L::zero(), zero);
        }
        (zero.horizontal_sum() == 0.0, energy.horizontal_sum())
    }
}

/// Sums `sum_{i<j} m_i m_j / r` over the pairs of one group.
pub(super) struct NBodyEnergyKernel<'a, const D: usize> {
    pub(super) particles: Particles<'a, D>,
    pub(super) group: usize,
    pub(super) groups: usize,
}

impl<const D: usize> Kernel for NBodyEnergyKernel<'_, D> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let Particles { position, mass, softening2 } = self.particles;
        let softening2 = L::splat(softening2);
        let mut sum = L::zero();
        for i in (self.group..position.len()).step_by(self.groups) {
            for lane in 0..WIDTH {
                let target: [L; D] = splat(&lane_of(&position[i], lane));
                let mut own = L::zero();
                for j in i..position.len() {
                    let d = difference(&target, &load(&position[j]));
                    let r2 = dot(&d, &d, softening2);
                    let m = L::load(&mass[j]);
                    // Within the block, only the lanes after this one.
                    let bits = if i == j { 0xfe_u8 << lane } else { 0xff };
                    let others = L::mask_from_bits(bits) & L::zero().lt(m);
                    own += L::select(others, m / r2.sqrt(), L::zero());
                }
                let m = mass[i][lane];
                sum = L::select(L::zero().lt(L::splat(m)), own.mul_add(L::splat(m), sum), sum);
            }
        }
        sum.horizontal_sum()
    }
}
