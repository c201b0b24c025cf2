//! Energies, forces and viscous forces of bending of packs of cells, on lanes.

use super::super::super::kernels::{gather, scatter};
use super::super::kernels::{PackScalar, with_change};
use super::{BendingMode, BendingPair, COUPLED, CellBending, MOST_PAIRS, axes, dot, weighted};
use crate::algebra::Dual;
use crate::energy::patch::PackIndex;
use crate::lanes::{Kernel, Lanes, RowSlice, WIDTH};
use crate::scalar::Scalar;

/// A pack of cells that bend.
#[derive(Clone, Copy)]
pub(crate) struct BendingPack<'a, const D: usize, const N: usize> {
    pub(crate) bending: &'a CellBending<D, N>,
    pub(crate) index: &'a PackIndex<N>,
    /// Its number.
    pub(crate) pack: usize,
    /// Directions `f_k` are those of now, not of rest.
    pub(crate) turns: bool,
}

impl<'a, const D: usize, const N: usize> BendingPack<'a, D, N> {
    #[inline(always)]
    fn pairs(&self) -> &'a [BendingPair<N>] {
        &self.bending.pairs[self.pack * axes(D).len()..][..axes(D).len()]
    }

    /// `f_k` of all axes.
    #[inline(always)]
    fn directions<S: Scalar>(&self, x: &[[S; D]; N]) -> [[S; D]; D] {
        let mut f = [[S::zero(); D]; D];
        for k in 0..D {
            f[k] = weighted(x, &self.bending.slopes(k));
        }
        f
    }

    /// `f_k` at rest.
    #[inline(always)]
    fn at_rest<L: Lanes, S: PackScalar<L>>(&self) -> [[S; D]; D] {
        let mut f = [[S::zero(); D]; D];
        for k in 0..D {
            for i in 0..D {
                f[k][i] = S::constant(<L as Lanes>::load(&self.bending.common[self.pack].rest[k][i]));
            }
        }
        f
    }

    /// `q` of all pairs.
    #[inline(always)]
    fn hourglass<L: Lanes, S: PackScalar<L>>(&self, x: &[[S; D]; N]) -> [[S; D]; MOST_PAIRS] {
        let mut q = [[S::zero(); D]; MOST_PAIRS];
        for (q, pair) in q.iter_mut().zip(self.pairs()) {
            let mut weight = [S::zero(); N];
            for a in 0..N {
                weight[a] = S::constant(<L as Lanes>::load(&pair.weight[a]));
            }
            *q = weighted(x, &weight);
        }
        q
    }

    /// The modes of all pairs, and their `s`.
    #[inline(always)]
    fn modes<L: Lanes, S: PackScalar<L>>(
        &self,
        x: &[[S; D]; N],
    ) -> ([[BendingMode<S, D>; 2]; MOST_PAIRS], [[S; 2]; MOST_PAIRS]) {
        let f = if self.turns { self.directions(x) } else { self.at_rest::<L, S>() };
        let q = self.hourglass::<L, S>(x);
        let (mut modes, mut s) = ([[BendingMode::zero(); 2]; MOST_PAIRS], [[S::zero(); 2]; MOST_PAIRS]);
        for p in 0..axes(D).len() {
            for side in 0..2 {
                modes[p][side] = BendingMode::new(&q[p], &f[axes(D)[p][side]], self.turns);
                s[p][side] = modes[p][side].s;
            }
        }
        (modes, s)
    }

    /// Forces of displacements, or of rates, of the modes.
    #[inline(always)]
    fn forces<L: Lanes, S: PackScalar<L>>(&self, s: &[[S; 2]; MOST_PAIRS]) -> [[S; 2]; MOST_PAIRS] {
        let mut forces = [[S::zero(); 2]; MOST_PAIRS];
        for (p, pair) in self.pairs().iter().enumerate() {
            for side in 0..2 {
                forces[p][side] = s[p][side] * S::constant(<L as Lanes>::load(&pair.stiffness[side]));
            }
        }
        if D == 3 {
            for l in 0..3 {
                let [one, other] = COUPLED[l];
                let coupling = &self.bending.common[self.pack].coupling[l];
                let coupling = S::constant(<L as Lanes>::load(coupling));
                forces[one.0][one.1] += coupling * s[other.0][other.1];
                forces[other.0][other.1] += coupling * s[one.0][one.1];
            }
        }
        forces
    }

    /// Adds to the nodes these `q` times their weights and `f` times their slopes.
    #[inline(always)]
    fn spread<L: Lanes>(&self, q: &[[L; D]; MOST_PAIRS], f: &[[L; D]; D], gradients: &mut [[L; D]; N]) {
        for (q, pair) in q.iter().zip(self.pairs()) {
            for a in 0..N {
                let weight = L::load(&pair.weight[a]);
                for i in 0..D {
                    gradients[a][i] = q[i].mul_add(weight, gradients[a][i]);
                }
            }
        }
        for k in 0..D {
            for a in 0..N {
                let slope = L::splat(self.bending.slopes[a][k]);
                for i in 0..D {
                    gradients[a][i] = f[k][i].mul_add(slope, gradients[a][i]);
                }
            }
        }
    }

    /// Adds viscous forces to the nodes; gives their power. With the stiffnesses of a solid of the
    /// viscosities `R` is of the rates of `q . f` over `|f|` at rest what the energy is of `s`: like Green's
    /// strain `q . f` is quadratic in the positions.
    #[inline(always)]
    pub(crate) fn add_viscous<L: Lanes>(
        &self,
        x: &[[L; D]; N],
        v: &[[L; D]; N],
        gradients: &mut [[L; D]; N],
    ) -> L {
        let (f, rates_of_f, rest) = (self.directions(x), self.directions(v), self.at_rest::<L, L>());
        let (q, rates_of_q) = (self.hourglass::<L, L>(x), self.hourglass::<L, L>(v));
        let (mut of_q, mut of_f) = ([[L::zero(); D]; MOST_PAIRS], [[L::zero(); D]; D]);
        let mut rates = [[L::zero(); 2]; MOST_PAIRS];
        let mut inverse = [L::zero(); D];
        for k in 0..D {
            inverse[k] = L::one() / dot(&rest[k], &rest[k]).sqrt();
        }
        for p in 0..axes(D).len() {
            for side in 0..2 {
                let k = axes(D)[p][side];
                rates[p][side] = (dot(&rates_of_q[p], &f[k]) + dot(&q[p], &rates_of_f[k])) * inverse[k];
            }
        }
        let forces = self.forces::<L, L>(&rates);
        let mut power = L::zero();
        for p in 0..axes(D).len() {
            for side in 0..2 {
                let k = axes(D)[p][side];
                power = forces[p][side].mul_add(rates[p][side], power);
                let force = forces[p][side] * inverse[k];
                for i in 0..D {
                    of_q[p][i] = force.mul_add(f[k][i], of_q[p][i]);
                    of_f[k][i] = force.mul_add(q[p][i], of_f[k][i]);
                }
            }
        }
        self.spread(&of_q, &of_f, gradients);
        power
    }
}

/// Adds the energy in bending of a pack to one sum per lane.
pub(in super::super) struct BendingEnergyKernel<'a, const D: usize, const N: usize> {
    pub(in super::super) pack: BendingPack<'a, D, N>,
    pub(in super::super) position: &'a RowSlice<D>,
    pub(in super::super) sum: &'a mut [f64; WIDTH],
}

impl<const D: usize, const N: usize> Kernel for BendingEnergyKernel<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let x = gather::<L, D, N>(self.position, self.pack.index);
        let (_, s) = self.pack.modes::<L, L>(&x);
        let forces = self.pack.forces::<L, L>(&s);
        let mut sum = <L as Lanes>::load(self.sum);
        for p in 0..axes(D).len() {
            for side in 0..2 {
                sum = (L::splat(0.5) * forces[p][side]).mul_add(s[p][side], sum);
            }
        }
        <L as Lanes>::store(sum, self.sum);
    }
}

/// Adds the gradients of the energy in bending at the vertices of a pack, or their change `ALONG` a
/// direction.
pub(in super::super) struct BendingForceKernel<'a, const D: usize, const N: usize, const ALONG: bool> {
    pub(in super::super) pack: BendingPack<'a, D, N>,
    pub(in super::super) position: &'a RowSlice<D>,
    pub(in super::super) direction: &'a RowSlice<D>,
    pub(in super::super) gradient: &'a mut RowSlice<D>,
}

impl<const D: usize, const N: usize, const ALONG: bool> BendingForceKernel<'_, D, N, ALONG> {
    #[inline(always)]
    fn add<L: Lanes, S: PackScalar<L>>(self, x: &[[S; D]; N]) {
        let (modes, s) = self.pack.modes::<L, S>(x);
        let forces = self.pack.forces::<L, S>(&s);
        let (mut of_q, mut of_f) = ([[L::zero(); D]; MOST_PAIRS], [[L::zero(); D]; D]);
        for p in 0..axes(D).len() {
            for side in 0..2 {
                let (mode, force, k) = (&modes[p][side], forces[p][side], axes(D)[p][side]);
                for i in 0..D {
                    of_q[p][i] += (force * mode.of_q[i]).last();
                    of_f[k][i] += (force * mode.of_f[i]).last();
                }
            }
        }
        let mut gradients = [[L::zero(); D]; N];
        self.pack.spread(&of_q, &of_f, &mut gradients);
        scatter(self.gradient, self.pack.index, gradients);
    }
}

impl<const D: usize, const N: usize, const ALONG: bool> Kernel for BendingForceKernel<'_, D, N, ALONG> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let x = gather::<L, D, N>(self.position, self.pack.index);
        if !ALONG {
            return self.add::<L, L>(&x);
        }
        let dx = gather::<L, D, N>(self.direction, self.pack.index);
        self.add::<L, Dual<L>>(&with_change(&x, &dx));
    }
}
