//! What is done with pairs of blocks of eight particles, on lanes.
//!
//! Every pair is computed once and acts on both its particles. Blocks of targets are dealt out to groups round robin, because
//! the first block has all the others to attend to and the last none.

use crate::lanes::{Kernel, Lanes, WIDTH};

/// `WIDTH` vectors, `v[component][lane]`.
pub(super) type Block<const D: usize> = [[f64; WIDTH]; D];

/// Targets whose sums stay in registers while they meet the blocks of sources.
const TARGETS: usize = 4;

/// Particles in blocks. Lanes that fill up the last block have mass zero.
#[derive(Clone, Copy)]
pub(super) struct Particles<'a, const D: usize> {
    pub(super) position: &'a [Block<D>],
    pub(super) mass: &'a [[f64; WIDTH]],
    pub(super) softening2: f64,
}

/// Sums over pairs into `out`, a block for each block of particles, without the constant and the mass of the particle itself:
/// `sum_j m_j d / r^3` with `d = x_i - x_j`, or its derivative along `direction`,
/// `sum_j m_j (dp - 3 (d . dp) / r^2 d) / r^3` with `dp = p_i - p_j`.
pub(super) struct PairKernel<'a, const D: usize, const DERIVATIVE: bool> {
    pub(super) particles: Particles<'a, D>,
    /// Read only for the derivative.
    pub(super) direction: &'a [Block<D>],
    pub(super) group: usize,
    pub(super) groups: usize,
    pub(super) out: &'a mut [Block<D>],
}

#[inline(always)]
fn load<L: Lanes, const D: usize>(block: &Block<D>) -> [L; D] {
    let mut v = [L::zero(); D];
    for c in 0..D {
        v[c] = L::load(&block[c]);
    }
    v
}

/// One lane in every lane.
#[inline(always)]
fn splat<L: Lanes, const D: usize>(block: &Block<D>, lane: usize) -> [L; D] {
    let mut v = [L::zero(); D];
    for c in 0..D {
        v[c] = L::splat(block[c][lane]);
    }
    v
}

/// `a - b` and its softened squared length.
#[inline(always)]
fn separation<L: Lanes, const D: usize>(a: &[L; D], b: &[L; D], softening2: L) -> ([L; D], L) {
    let (mut d, mut r2) = (*a, softening2);
    for c in 0..D {
        d[c] = a[c] - b[c];
        r2 = d[c].mul_add(d[c], r2);
    }
    (d, r2)
}

/// The vector of a pair, without masses.
#[inline(always)]
fn pair_vector<L: Lanes, const D: usize, const DERIVATIVE: bool>(
    target: &[[L; D]; 2],
    source: &[[L; D]; 2],
    softening2: L,
) -> [L; D] {
    let (mut d, r2) = separation(&target[0], &source[0], softening2);
    let s = L::one() / (r2 * r2.sqrt());
    if DERIVATIVE {
        let (dp, along) = separation_dot(&target[1], &source[1], &d);
        let k = L::splat(-3.0) * along / r2;
        for c in 0..D {
            d[c] = k.mul_add(d[c], dp[c]);
        }
    }
    for c in 0..D {
        d[c] *= s;
    }
    d
}

/// `a - b` and its product with `d`.
#[inline(always)]
fn separation_dot<L: Lanes, const D: usize>(a: &[L; D], b: &[L; D], d: &[L; D]) -> ([L; D], L) {
    let (mut difference, mut dot) = (*a, L::zero());
    for c in 0..D {
        difference[c] = a[c] - b[c];
        dot = difference[c].mul_add(d[c], dot);
    }
    (difference, dot)
}

impl<const D: usize, const DERIVATIVE: bool> PairKernel<'_, D, DERIVATIVE> {
    /// Positions and, for the derivative, directions of a block.
    #[inline(always)]
    fn block<L: Lanes>(&self, i: usize) -> [[L; D]; 2] {
        let position = load(&self.particles.position[i]);
        [position, if DERIVATIVE { load(&self.direction[i]) } else { position }]
    }

    #[inline(always)]
    fn target<L: Lanes>(&self, i: usize, lane: usize) -> [[L; D]; 2] {
        let position = splat(&self.particles.position[i], lane);
        [position, if DERIVATIVE { splat(&self.direction[i], lane) } else { position }]
    }

    /// All pairs within block `i`, each from both sides.
    #[inline(always)]
    fn diagonal<L: Lanes>(&mut self, i: usize, softening2: L) {
        let source = self.block::<L>(i);
        let mass = L::load(&self.particles.mass[i]);
        for lane in 0..WIDTH {
            let w = pair_vector::<L, D, DERIVATIVE>(&self.target(i, lane), &source, softening2);
            // A particle does not meet itself, nor the lanes that fill up.
            let others = L::mask_from_bits(!(1 << lane)) & L::zero().lt(mass);
            for c in 0..D {
                self.out[i][c][lane] += L::select(others, mass * w[c], L::zero()).horizontal_sum();
            }
        }
    }

    /// `TARGETS` particles of block `i` from `first` on, and all later blocks.
    #[inline(always)]
    fn off_diagonal<L: Lanes>(&mut self, i: usize, first: usize, softening2: L) {
        let mut targets = [[[L::zero(); D]; 2]; TARGETS];
        let mut own_mass = [L::zero(); TARGETS];
        for t in 0..TARGETS {
            targets[t] = self.target(i, first + t);
            own_mass[t] = L::splat(self.particles.mass[i][first + t]);
        }
        let mut sums = [[L::zero(); D]; TARGETS];
        for j in i + 1..self.particles.position.len() {
            let source = self.block::<L>(j);
            let mass = L::load(&self.particles.mass[j]);
            let filled = L::zero().lt(mass);
            let mut on_source: [L; D] = load(&self.out[j]);
            for t in 0..TARGETS {
                let w = pair_vector::<L, D, DERIVATIVE>(&targets[t], &source, softening2);
                for c in 0..D {
                    sums[t][c] += L::select(filled, mass * w[c], L::zero());
                    on_source[c] = (-own_mass[t]).mul_add(w[c], on_source[c]);
                }
            }
            for c in 0..D {
                on_source[c].store(&mut self.out[j][c]);
            }
        }
        for t in 0..TARGETS {
            for c in 0..D {
                self.out[i][c][first + t] += sums[t][c].horizontal_sum();
            }
        }
    }
}

impl<const D: usize, const DERIVATIVE: bool> Kernel for PairKernel<'_, D, DERIVATIVE> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        let softening2 = L::splat(self.particles.softening2);
        for block in self.out.iter_mut() {
            *block = [[0.0; WIDTH]; D];
        }
        for i in (self.group..self.particles.position.len()).step_by(self.groups) {
            self.diagonal(i, softening2);
            for first in (0..WIDTH).step_by(TARGETS) {
                self.off_diagonal(i, first, softening2);
            }
        }
    }
}

/// `sum_{i<j} m_i m_j / r` over the pairs of one group.
pub(super) struct EnergyKernel<'a, const D: usize> {
    pub(super) particles: Particles<'a, D>,
    pub(super) group: usize,
    pub(super) groups: usize,
}

impl<const D: usize> Kernel for EnergyKernel<'_, D> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let Particles { position, mass, softening2 } = self.particles;
        let softening2 = L::splat(softening2);
        let mut sum = L::zero();
        for i in (self.group..position.len()).step_by(self.groups) {
            for lane in 0..WIDTH {
                let target: [L; D] = splat(&position[i], lane);
                let mut own = L::zero();
                for j in i..position.len() {
                    let (_, r2) = separation(&target, &load(&position[j]), softening2);
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
