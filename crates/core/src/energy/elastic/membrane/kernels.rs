//! Kernels over packs of a membrane, on lanes.

use crate::algebra::{Dual, Mat};
use crate::element::{SimplexPack, Tangents, scatter_stress, tangents, times};
use crate::energy::DeformationExtremes;
use crate::energy::elastic::block::Block;
use crate::energy::patch::{PackIndex, Patch, Patches, Scratch};
use crate::lanes::{Kernel, Lanes, RowSlice, WIDTH};
use crate::scalar::Scalar;

/// The frames `Q` of `WIDTH` triangles, `[row][column][lane]`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Frames([[[f64; WIDTH]; 2]; 3]);

impl Frames {
    pub(super) const ZERO: Self = Frames([[[0.0; WIDTH]; 2]; 3]);

    #[inline(always)]
    fn load<L: Lanes>(&self) -> Tangents<L, 3, 2> {
        let mut q = [[L::zero(); 2]; 3];
        for i in 0..3 {
            for j in 0..2 {
                q[i][j] = L::load(&self.0[i][j]);
            }
        }
        q
    }

    #[inline(always)]
    fn store<L: Lanes>(&mut self, q: &Tangents<L, 3, 2>) {
        for i in 0..3 {
            for j in 0..2 {
                q[i][j].store(&mut self.0[i][j]);
            }
        }
    }
}

/// `F = Q G` with the columns of `Q` of unit length and perpendicular, and `G` upper triangular with a
/// positive diagonal: the method of Gram and Schmidt. Not finite where the triangle has no area.
#[inline(always)]
pub(super) fn factors<S: Scalar>(f: &Tangents<S, 3, 2>) -> (Tangents<S, 3, 2>, Mat<S, 2>) {
    let column = |j: usize| [f[0][j], f[1][j], f[2][j]];
    let (first, second) = (column(0), column(1));
    let length = dot(&first, &first).sqrt();
    let inverse = S::one() / length;
    let e = [inverse * first[0], inverse * first[1], inverse * first[2]];
    let along = dot(&e, &second);
    let rest = [second[0] - along * e[0], second[1] - along * e[1], second[2] - along * e[2]];
    let height = dot(&rest, &rest).sqrt();
    let inverse = S::one() / height;
    let mut q = [[S::zero(); 2]; 3];
    for i in 0..3 {
        q[i] = [e[i], inverse * rest[i]];
    }
    (q, Mat([[length, along], [S::zero(), height]]))
}

#[inline(always)]
fn dot<S: Scalar>(a: &[S; 3], b: &[S; 3]) -> S {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

/// Writes the factors of some packs.
pub(super) struct FactorKernel<'a> {
    pub(super) rest: &'a [SimplexPack<2>],
    pub(super) index: &'a [PackIndex<3>],
    pub(super) position: &'a RowSlice<3>,
    pub(super) q: &'a mut [Frames],
    pub(super) g: &'a mut [Block<2>],
}

impl Kernel for FactorKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let out = self.q.iter_mut().zip(self.g);
        for ((rest, index), (q, g)) in self.rest.iter().zip(self.index).zip(out) {
            let f = tangents::<L, 3, 2, 3>(self.position, index, &rest.inverse_rest());
            let factors = factors(&f);
            q.store(&factors.0);
            g.store(&factors.1);
        }
    }
}

/// Writes the factors of some packs and their derivatives along the direction.
pub(super) struct FactorRateKernel<'a> {
    pub(super) rest: &'a [SimplexPack<2>],
    pub(super) index: &'a [PackIndex<3>],
    pub(super) position: &'a RowSlice<3>,
    pub(super) direction: &'a RowSlice<3>,
    pub(super) q: &'a mut [Frames],
    pub(super) dq: &'a mut [Frames],
    pub(super) g: &'a mut [Block<2>],
    pub(super) dg: &'a mut [Block<2>],
}

impl Kernel for FactorRateKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (pack, (rest, index)) in self.rest.iter().zip(self.index).enumerate() {
            let inverse = rest.inverse_rest();
            let f = tangents::<L, 3, 2, 3>(self.position, index, &inverse);
            let df = tangents::<L, 3, 2, 3>(self.direction, index, &inverse);
            let mut along = [[Dual::constant(L::zero()); 2]; 3];
            for i in 0..3 {
                for j in 0..2 {
                    along[i][j] = Dual { value: f[i][j], derivative: df[i][j] };
                }
            }
            let (frame, g) = factors(&along);
            let (mut q, mut dq) = ([[L::zero(); 2]; 3], [[L::zero(); 2]; 3]);
            for i in 0..3 {
                for j in 0..2 {
                    (q[i][j], dq[i][j]) = (frame[i][j].value, frame[i][j].derivative);
                }
            }
            self.q[pack].store(&q);
            self.dq[pack].store(&dq);
            let (g, dg) = Dual::parts(&g);
            self.g[pack].store(&g);
            self.dg[pack].store(&dg);
        }
    }
}

/// Adds the gradients at the vertices of some packs for the stress `Q P`.
pub(super) struct SheetForceKernel<'a> {
    pub(super) rest: &'a [SimplexPack<2>],
    pub(super) index: &'a [PackIndex<3>],
    pub(super) q: &'a [Frames],
    pub(super) stress: &'a [Block<2>],
    pub(super) gradient: &'a mut RowSlice<3>,
}

impl Kernel for SheetForceKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let stresses = self.q.iter().zip(self.stress);
        for ((rest, index), (q, stress)) in self.rest.iter().zip(self.index).zip(stresses) {
            let p = times(&q.load::<L>(), &stress.load::<L>());
            scatter_stress(self.gradient, index, &p, rest);
        }
    }
}

/// The smallest ratio of areas in a patch.
pub(super) struct AreaKernel<'a> {
    pub(super) patches: &'a Patches<3>,
    pub(super) rest: &'a [SimplexPack<2>],
    pub(super) patch: &'a Patch,
    pub(super) scratch: &'a Scratch<3>,
}

impl Kernel for AreaKernel<'_> {
    type Output = DeformationExtremes;

    #[inline(always)]
    fn run<L: Lanes>(self) -> DeformationExtremes {
        let mut min_j = L::splat(f64::INFINITY);
        for pack in self.patch.packs.clone() {
            let (index, rest) = (&self.patches.index[pack], &self.rest[pack]);
            let f = tangents::<L, 3, 2, 3>(&self.scratch.position, index, &rest.inverse_rest());
            let normal = |i: usize, j: usize| f[i][0] * f[j][1] - f[j][0] * f[i][1];
            let normal = [normal(1, 2), normal(2, 0), normal(0, 1)];
            let j = dot(&normal, &normal).sqrt();
            min_j = L::select(min_j.lt(j), min_j, j);
        }
        DeformationExtremes { min_j: -(-min_j).horizontal_max(), inverted: 0 }
    }
}
