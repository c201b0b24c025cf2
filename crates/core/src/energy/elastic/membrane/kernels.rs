//! Kernels over blocks of a membrane, on lanes.

use crate::algebra::{Dual, Mat, fused_dot};
use crate::element::{Tangents, times};
use crate::energy::DeformationExtremes;
use crate::energy::elastic::block::Block;
use crate::energy::elastic::kinematics::Kinematics;
use crate::energy::patch::{Patch, Scratch};
use crate::lanes::{Kernel, Lanes};
use crate::scalar::Scalar;

/// Returns `F = Q G` with orthonormal columns of `Q` and an upper triangular `G` with a positive
/// diagonal, by the method of Gram and Schmidt. Not finite if the triangle has no area.
#[inline(always)]
pub(super) fn factors<S: Scalar>(f: &Tangents<S, 3, 2>) -> (Tangents<S, 3, 2>, Mat<S, 2>) {
    let column = |j: usize| [f[0][j], f[1][j], f[2][j]];
    let (first, second) = (column(0), column(1));
    let length = fused_dot(&first, &first).sqrt();
    let inverse = S::one() / length;
    let e = [inverse * first[0], inverse * first[1], inverse * first[2]];
    let along = fused_dot(&e, &second);
    let rest = [second[0] - along * e[0], second[1] - along * e[1], second[2] - along * e[2]];
    let height = fused_dot(&rest, &rest).sqrt();
    let inverse = S::one() / height;
    let mut q = [[S::zero(); 2]; 3];
    for i in 0..3 {
        q[i] = [e[i], inverse * rest[i]];
    }
    (q, Mat([[length, along], [S::zero(), height]]))
}

/// Overwrites each `F` with its `Q`, and writes `G`.
pub(super) struct FactorKernel<'a> {
    pub(super) f: &'a mut [Block<3, 2>],
    pub(super) g: &'a mut [Block<2>],
}

impl Kernel for FactorKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (f, g) in self.f.iter_mut().zip(self.g) {
            let factors = factors(&f.load_tangents::<L>());
            f.store_tangents(&factors.0);
            g.store(&factors.1);
        }
    }
}

/// Overwrites each `F` with its `Q` and each change `dF` with `dQ`, and writes `G` and `dG`.
pub(super) struct FactorRateKernel<'a> {
    pub(super) f: &'a mut [Block<3, 2>],
    pub(super) df: &'a mut [Block<3, 2>],
    pub(super) g: &'a mut [Block<2>],
    pub(super) dg: &'a mut [Block<2>],
}

impl Kernel for FactorRateKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let blocks = self.f.iter_mut().zip(self.df).zip(self.g.iter_mut().zip(self.dg));
        for ((f, df), (g, dg)) in blocks {
            let (mut q, mut dq) = (f.load_tangents::<L>(), df.load_tangents::<L>());
            let mut along = [[Dual::constant(L::zero()); 2]; 3];
            for i in 0..3 {
                for j in 0..2 {
                    along[i][j] = Dual { value: q[i][j], derivative: dq[i][j] };
                }
            }
            let (frame, factor) = factors(&along);
            for i in 0..3 {
                for j in 0..2 {
                    (q[i][j], dq[i][j]) = (frame[i][j].value, frame[i][j].derivative);
                }
            }
            f.store_tangents(&q);
            df.store_tangents(&dq);
            let (value, change) = Dual::parts(&factor);
            g.store(&value);
            dg.store(&change);
        }
    }
}

/// Overwrites each `Q` with the stress `Q P`.
pub(super) struct FrameKernel<'a> {
    pub(super) q: &'a mut [Block<3, 2>],
    pub(super) stress: &'a [Block<2>],
}

impl Kernel for FrameKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (q, stress) in self.q.iter_mut().zip(self.stress) {
            let p = times(&q.load_tangents::<L>(), &stress.load::<L>());
            q.store_tangents(&p);
        }
    }
}

/// Overwrites each `dQ` with the change of the stress, `dQ P + Q dP`.
pub(super) struct FrameRateKernel<'a> {
    pub(super) q: &'a [Block<3, 2>],
    pub(super) dq: &'a mut [Block<3, 2>],
    pub(super) stress: &'a [Block<2>],
    pub(super) change: &'a [Block<2>],
}

impl Kernel for FrameRateKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let frames = self.q.iter().zip(self.dq);
        for ((q, dq), (stress, change)) in frames.zip(self.stress.iter().zip(self.change)) {
            let mut sum = times(&dq.load_tangents::<L>(), &stress.load::<L>());
            let other = times(&q.load_tangents::<L>(), &change.load::<L>());
            for i in 0..3 {
                for j in 0..2 {
                    sum[i][j] += other[i][j];
                }
            }
            dq.store_tangents(&sum);
        }
    }
}

/// Finds the smallest area ratio in a patch.
pub(super) struct AreaKernel<'a> {
    pub(super) elements: &'a Kinematics<3, 2, 3>,
    pub(super) patch: &'a Patch,
    pub(super) scratch: &'a Scratch<3>,
}

impl Kernel for AreaKernel<'_> {
    type Output = DeformationExtremes;

    #[inline(always)]
    fn run<L: Lanes>(self) -> DeformationExtremes {
        let mut min_j = L::splat(f64::INFINITY);
        let mut block = [Block::ZERO];
        for pack in self.patch.packs.clone() {
            self.elements.deform_pack::<L>(pack, &self.scratch.position, &mut block);
            let f = block[0].load_tangents::<L>();
            let normal = |i: usize, j: usize| f[i][0] * f[j][1] - f[j][0] * f[i][1];
            let normal = [normal(1, 2), normal(2, 0), normal(0, 1)];
            let j = fused_dot(&normal, &normal).sqrt();
            min_j = L::select(min_j.lt(j), min_j, j);
        }
        DeformationExtremes { min_j: -(-min_j).horizontal_max(), inverted: 0 }
    }
}
