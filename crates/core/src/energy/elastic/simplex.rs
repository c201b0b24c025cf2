//! Fused forces of linear elements: positions, stress in closed form and forces in one kernel, two packs
//! at a time.
//!
//! This overrides the [kinematics](super::kinematics) with a law behind a pointer. A row of
//! `pliant bench` justifies it: explicit steps of 98,304 tetrahedra take a sixth to a fifth less time
//! with it. It is compiled for every material and instruction set, as no other element kernel is.

use super::block::{Block, both, stress_of_lane};
use super::kinematics::{gather, scatter, vertex_gradients};
use crate::algebra::Mat;
use crate::element::{SimplexPack, edges};
use crate::energy::patch::{PackIndex, Patch, Patches, Scratch};
use crate::lanes::{Kernel, Lanes, Pair, RowSlice, Rows, WIDTH, dispatch, prefetch, prefetch_early};
use crate::material::Material;
use crate::scalar::Scalar;

/// Forces of linear elements of some material.
pub(super) trait SimplexForces<const D: usize, const N: usize>: Send + Sync {
    /// Adds the gradient rows of `patch` in `scratch`, which holds its positions.
    fn add(&self, patches: &Patches<N>, packs: &[SimplexPack<D>], patch: &Patch, scratch: &mut Scratch<D>);
}

/// Fused forces of the material `M`.
pub(super) struct Fused<M>(pub(super) M);

impl<M: Material<D>, const D: usize, const N: usize> SimplexForces<D, N> for Fused<M> {
    fn add(&self, patches: &Patches<N>, packs: &[SimplexPack<D>], patch: &Patch, scratch: &mut Scratch<D>) {
        dispatch(GradientKernel { material: &self.0, patches, packs, patch, scratch });
    }
}

/// Returns the deformation gradients of one pack from the vertices in `rows`; linear in them.
#[inline(always)]
fn deformation_gradient<L: Lanes, const D: usize, const N: usize>(
    rows: &RowSlice<D>,
    index: &PackIndex<N>,
    inverse_rest: &Mat<L, D>,
) -> Mat<L, D> {
    Mat(edges(&gather::<L, D, N>(rows, index))).mul(inverse_rest)
}

/// Adds the gradients at the vertices of one pack, given `H = w P D_m^-T`.
#[inline(always)]
fn add_gradients<L: Lanes, const D: usize, const N: usize>(
    rows: &mut RowSlice<D>,
    index: &PackIndex<N>,
    h: &Mat<L, D>,
) {
    scatter(rows, index, vertex_gradients::<L, D, D, N>(&h.0));
}

/// Packs prefetched ahead into the L1 cache: the L2 cache takes about as long as these take to compute.
const AHEAD: usize = 4;
/// Packs prefetched ahead into the L2 cache: memory, when it is busy, takes about as long as these.
const FAR_AHEAD: usize = 12;

pub(super) struct GradientKernel<'a, M, const D: usize, const N: usize> {
    pub(super) material: &'a M,
    pub(super) patches: &'a Patches<N>,
    pub(super) packs: &'a [SimplexPack<D>],
    pub(super) patch: &'a Patch,
    pub(super) scratch: &'a mut Scratch<D>,
}

/// Operation on one pack, or two.
struct PackStress<'a, M, const D: usize, const N: usize>(&'a M);

impl<M: Material<D>, const D: usize, const N: usize> PackStress<'_, M, D, N> {
    /// Returns `H = w P D_m^-T`.
    #[inline(always)]
    fn weighted_stress<S: Scalar>(&self, f: &Mat<S, D>, inverse_rest: &Mat<S, D>, weight: S) -> Mat<S, D> {
        self.0.pk1(f).scale(weight).mul_transpose(inverse_rest)
    }

    #[inline(always)]
    fn one_pack<L: Lanes>(
        &self,
        pack: &SimplexPack<D>,
        index: &PackIndex<N>,
        position: &RowSlice<D>,
        gradient: &mut RowSlice<D>,
    ) {
        let rest = pack.inverse_rest::<L>();
        let f = deformation_gradient(position, index, &rest);
        let weight = pack.weight::<L>();
        if !L::BY_LANE {
            return add_gradients(gradient, index, &self.weighted_stress(&f, &rest, weight));
        }
        let mut stress = Block::ZERO;
        stress.store(&f);
        for l in 0..WIDTH {
            stress.set_lane(l, &stress_of_lane(self.0, &stress.lane(l)));
        }
        let p = stress.load::<L>();
        add_gradients(gradient, index, &p.scale(weight).mul_transpose(&rest));
    }

    /// Processes two packs at a time: the latency of divisions and roots in one hides behind the other.
    /// They are added one after the other, the second to the rows `into`, so that the sums are those of
    /// one pack at a time.
    #[inline(always)]
    fn two_packs<L: Lanes>(
        &self,
        packs: [&SimplexPack<D>; 2],
        index: [&PackIndex<N>; 2],
        into: &PackIndex<N>,
        position: &RowSlice<D>,
        gradient: &mut RowSlice<D>,
    ) {
        let rest = both(&packs[0].inverse_rest::<L>(), &packs[1].inverse_rest::<L>());
        let (rest_a, rest_b) = Pair::unzip_rows(&rest.0);
        let f_a = deformation_gradient(position, index[0], &Mat(rest_a));
        let f_b = deformation_gradient(position, index[1], &Mat(rest_b));
        let weight = Pair(packs[0].weight::<L>(), packs[1].weight::<L>());
        let h = self.weighted_stress(&both(&f_a, &f_b), &rest, weight);
        let (h_a, h_b) = Pair::unzip_rows(&h.0);
        add_gradients(gradient, index[0], &Mat(h_a));
        add_gradients(gradient, into, &Mat(h_b));
    }
}

impl<M: Material<D>, const D: usize, const N: usize> Kernel for GradientKernel<'_, M, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let stress = PackStress::<M, D, N>(self.material);
        let (position, gradient) = (&*self.scratch.position, &mut *self.scratch.gradient);
        let index = &self.patches.index[self.patch.packs.clone()];
        let packs = &self.packs[self.patch.packs.clone()];
        // Only one of the two loops is compiled, so that a material's stress is inlined once.
        if L::PAIRS_PAY {
            // The last pack of an odd number is paired with itself, and added a second time to rows that
            // nothing reads. With a branch instead, the compiler moves all of the second pack's work
            // behind it, and the two no longer overlap.
            let nowhere = [[Rows::<D>::SPARE; WIDTH]; N];
            // A number beyond the end has nothing to prefetch.
            let mut ahead =
                if self.patches.exceed_caches() { self.patch.packs.start + AHEAD } else { self.packs.len() };
            // In 2D a pack is little work and a scene may have few: a superfluous pack costs more than
            // compiling a second loop for the odd one.
            let in_pairs = if D == 2 { packs.len() / 2 * 2 } else { packs.len() };
            let ((packs, odd), (index, odd_index)) = (packs.split_at(in_pairs), index.split_at(in_pairs));
            for (packs, index) in packs.chunks(2).zip(index.chunks(2)) {
                for pack in [ahead, ahead + 1] {
                    prefetch(self.packs, pack);
                    prefetch(&self.patches.index, pack);
                    prefetch_early(self.packs, pack + FAR_AHEAD - AHEAD);
                    prefetch_early(&self.patches.index, pack + FAR_AHEAD - AHEAD);
                }
                ahead += 2;
                let (second, into) =
                    if let [_, second] = index { (second, second) } else { (&index[0], &nowhere) };
                let packs = [&packs[0], &packs[packs.len() - 1]];
                stress.two_packs::<L>(packs, [&index[0], second], into, position, gradient);
            }
            if D == 2 {
                for (pack, index) in odd.iter().zip(odd_index) {
                    stress.one_pack::<L>(pack, index, position, gradient);
                }
            }
        } else {
            for (pack, index) in packs.iter().zip(index) {
                stress.one_pack::<L>(pack, index, position, gradient);
            }
        }
    }
}
