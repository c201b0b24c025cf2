//! Attraction of a group's particles by the entries of its list, on lanes: entries side by side, four
//! particles at a time.

use super::super::pair::{TARGETS, by_newton, difference, dot, interaction, inverse_root, load, splat};
use super::list::{List, ParticlePack, TreeCells};
use super::octree::symmetric_index;
use crate::lanes::{Kernel, Lanes, WIDTH};

/// Law that sums over a list: `N` numbers for each particle, without `G` and the mass of the particle.
pub(super) trait Law<const D: usize, const N: usize> {
    /// True if the law uses directions.
    const DIRECTED: bool;

    /// Adds the contributions of the particles of a pack to a target `[position, direction]`, omitting
    /// lanes where `others` is false.
    fn add_near<L: Lanes>(
        target: &[[L; D]; 2],
        pack: &ParticlePack<D>,
        others: Option<L::Mask>,
        softening2: L,
        newton: bool,
        sums: &mut [L; N],
    );
    /// Adds the contributions of the nodes of a pack.
    fn add_far<L: Lanes>(
        target: &[[L; D]; 2],
        pack: &TreeCells<D>,
        softening2: L,
        newton: bool,
        sums: &mut [L; N],
    );
}

/// Returns `mass w`, or zero where the mask is false: zero times an infinite `w` would not be zero.
#[inline(always)]
fn weight<L: Lanes>(mass: L, w: L, others: Option<L::Mask>) -> L {
    match others {
        Some(others) => L::select(others, mass * w, L::zero()),
        None => mass * w,
    }
}

/// Returns `S d`, and the trace of `S`.
#[inline(always)]
fn moment_times<L: Lanes, const D: usize>(pack: &TreeCells<D>, d: &[L; D]) -> ([L; D], L) {
    let (mut product, mut trace) = ([L::zero(); D], L::zero());
    for a in 0..D {
        for b in 0..D {
            product[a] = L::load(&pack.moment[symmetric_index(a, b)]).mul_add(d[b], product[a]);
        }
        trace += L::load(&pack.moment[symmetric_index(a, a)]);
    }
    (product, trace)
}

/// Gradient of the potential, `sum m d / r^3`. A node of mass `M` and second moment `S` about its centre
/// of mass adds the gradient of its potential's expansion to second order, `M d / r^3 + (15/2 d.S d / r^7 -
/// 3/2 tr S / r^5) d - 3 S d / r^5`, with `r^2 = d^2 + softening^2`.
pub(super) struct Force;

impl<const D: usize> Law<D, D> for Force {
    const DIRECTED: bool = false;

    #[inline(always)]
    fn add_near<L: Lanes>(
        target: &[[L; D]; 2],
        pack: &ParticlePack<D>,
        others: Option<L::Mask>,
        softening2: L,
        newton: bool,
        sums: &mut [L; D],
    ) {
        let position = load(&pack.position);
        let (s, v) = interaction::<L, D, false>(target, &[position, position], softening2, newton);
        let w = weight(L::load(&pack.mass), s, others);
        for c in 0..D {
            sums[c] = w.mul_add(v[c], sums[c]);
        }
    }

    #[inline(always)]
    fn add_far<L: Lanes>(
        target: &[[L; D]; 2],
        pack: &TreeCells<D>,
        softening2: L,
        newton: bool,
        sums: &mut [L; D],
    ) {
        let d = difference(&target[0], &load(&pack.centre));
        let q = inverse_root(dot(&d, &d, softening2), newton);
        let q2 = q * q;
        let q3 = q2 * q;
        let q5 = q3 * q2;
        let (sd, trace) = moment_times(pack, &d);
        let bracket = (L::splat(7.5) * q2).mul_add(dot(&sd, &d, L::zero()), L::splat(-1.5) * trace);
        let along = q5.mul_add(bracket, L::load(&pack.mass) * q3);
        let across = L::splat(-3.0) * q5;
        for c in 0..D {
            sums[c] = across.mul_add(sd[c], along.mul_add(d[c], sums[c]));
        }
    }
}

/// Derivative of the force along a direction. A node counts as its mass at its centre, moving with the
/// mean of its particles' directions.
pub(super) struct Derivative;

impl<const D: usize> Law<D, D> for Derivative {
    const DIRECTED: bool = true;

    #[inline(always)]
    fn add_near<L: Lanes>(
        target: &[[L; D]; 2],
        pack: &ParticlePack<D>,
        others: Option<L::Mask>,
        softening2: L,
        newton: bool,
        sums: &mut [L; D],
    ) {
        let source = [load(&pack.position), load(&pack.direction)];
        let (s, v) = interaction::<L, D, true>(target, &source, softening2, newton);
        let mass = L::load(&pack.mass);
        for c in 0..D {
            sums[c] += weight(mass, s * v[c], others);
        }
    }

    #[inline(always)]
    fn add_far<L: Lanes>(
        target: &[[L; D]; 2],
        pack: &TreeCells<D>,
        softening2: L,
        newton: bool,
        sums: &mut [L; D],
    ) {
        let source = [load(&pack.centre), load(&pack.direction)];
        let (s, v) = interaction::<L, D, true>(target, &source, softening2, newton);
        let w = L::load(&pack.mass) * s;
        for c in 0..D {
            sums[c] = w.mul_add(v[c], sums[c]);
        }
    }
}

/// Potential with opposite sign, `sum m / r`. A node adds `M / r + 3/2 d.S d / r^5 - 1/2 tr S / r^3`.
pub(super) struct Potential;

impl<const D: usize> Law<D, 1> for Potential {
    const DIRECTED: bool = false;

    #[inline(always)]
    fn add_near<L: Lanes>(
        target: &[[L; D]; 2],
        pack: &ParticlePack<D>,
        others: Option<L::Mask>,
        softening2: L,
        newton: bool,
        sums: &mut [L; 1],
    ) {
        let d = difference(&target[0], &load(&pack.position));
        let q = inverse_root(dot(&d, &d, softening2), newton);
        sums[0] += weight(L::load(&pack.mass), q, others);
    }

    #[inline(always)]
    fn add_far<L: Lanes>(
        target: &[[L; D]; 2],
        pack: &TreeCells<D>,
        softening2: L,
        newton: bool,
        sums: &mut [L; 1],
    ) {
        let d = difference(&target[0], &load(&pack.centre));
        let q = inverse_root(dot(&d, &d, softening2), newton);
        let q2 = q * q;
        let (sd, trace) = moment_times(pack, &d);
        let bracket = (L::splat(1.5) * q2).mul_add(dot(&sd, &d, L::zero()), L::splat(-0.5) * trace);
        sums[0] += (q2 * q).mul_add(bracket, L::load(&pack.mass) * q);
    }
}

/// Sums for the particles at `position`, which are the entries of the list from `first` on.
pub(super) struct ListKernel<'a, Quantity, const D: usize, const N: usize> {
    pub(super) law: std::marker::PhantomData<Quantity>,
    pub(super) position: &'a [[f64; D]],
    /// Directions of the particles; read only by laws that use them.
    pub(super) direction: &'a [[f64; D]],
    pub(super) list: &'a List<D>,
    /// Index of the first particle in the list, a multiple of [`WIDTH`].
    pub(super) first: usize,
    pub(super) softening2: f64,
    pub(super) out: &'a mut [[f64; N]],
}

impl<Q: Law<D, N>, const D: usize, const N: usize> Kernel for ListKernel<'_, Q, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let softening2 = L::splat(self.softening2);
        let count = self.position.len();
        for begin in (0..count).step_by(TARGETS) {
            let mut targets = [[[L::zero(); D]; 2]; TARGETS];
            for t in 0..TARGETS {
                // The last round is padded with the last particle.
                let i = (begin + t).min(count - 1);
                let position = splat(&self.position[i]);
                targets[t] = [position, if Q::DIRECTED { splat(&self.direction[i]) } else { position }];
            }
            let mut sums = [[L::zero(); N]; TARGETS];
            // These particles are in one pack, in which each omits itself.
            let own = (self.first + begin) / WIDTH;
            for t in 0..TARGETS {
                let others = L::mask_from_bits(!(1 << ((begin + t) % WIDTH)));
                let pack = &self.list.near[own];
                Q::add_near(&targets[t], pack, Some(others), softening2, by_newton(t), &mut sums[t]);
            }
            let (before, after) = (&self.list.near[..own], &self.list.near[own + 1..]);
            for packs in [before, after] {
                for pack in packs {
                    for t in 0..TARGETS {
                        Q::add_near(&targets[t], pack, None, softening2, by_newton(t), &mut sums[t]);
                    }
                }
            }
            for pack in &self.list.far {
                for t in 0..TARGETS {
                    Q::add_far(&targets[t], pack, softening2, by_newton(t), &mut sums[t]);
                }
            }
            for t in 0..TARGETS.min(count - begin) {
                for c in 0..N {
                    self.out[begin + t][c] = sums[t][c].horizontal_sum();
                }
            }
        }
    }
}
