//! Kernels over packs of elements, on lanes.

use super::packs::FibrePack;
use crate::energy::measure::gather;
use crate::energy::patch::{Patch, Patches, Scratch};
use crate::lanes::{Kernel, Lanes};

macro_rules! kernels {
    ($($(#[$doc:meta])* $name:ident($scratch:ty);)+) => {
        $(
            $(#[$doc])*
            pub(super) struct $name<'a, const D: usize, const N: usize> {
                pub(super) patches: &'a Patches<N>,
                pub(super) packs: &'a [FibrePack<N>],
                pub(super) points: usize,
                pub(super) patch: &'a Patch,
                pub(super) scratch: $scratch,
            }
        )+
    };
}

kernels! {
    /// `sum_q w_q T/2 (|F a|^2 - 1)`.
    MuscleEnergyKernel(&'a Scratch<D>);
    /// `sum_q w_q T c_i F a`.
    MuscleForceKernel(&'a mut Scratch<D>);
    /// `-sum_q w_q T F a . dF a`, `dF` that of the direction.
    MusclePowerKernel(&'a Scratch<D>);
}

impl<const D: usize, const N: usize> Kernel for MuscleEnergyKernel<'_, D, N> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let mut sum = L::zero();
        for pack in self.patch.packs.clone() {
            let x = gather::<L, D, N>(&self.scratch.position, &self.patches.index[pack]);
            for point in &self.packs[pack * self.points..][..self.points] {
                let image = point.image(&x);
                let mut longer = -L::one();
                for c in 0..D {
                    longer = image[c].mul_add(image[c], longer);
                }
                sum = point.tension::<L>().mul_add(longer, sum);
            }
        }
        0.5 * sum.horizontal_sum()
    }
}

impl<const D: usize, const N: usize> Kernel for MuscleForceKernel<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (position, out) = (&*self.scratch.position, &mut *self.scratch.gradient);
        for pack in self.patch.packs.clone() {
            let index = &self.patches.index[pack];
            let x = gather::<L, D, N>(position, index);
            let mut gradient = [[L::zero(); D]; N];
            for point in &self.packs[pack * self.points..][..self.points] {
                let image = point.image(&x);
                point.add_pull(&image, &mut gradient);
            }
            for node in 0..N {
                L::scatter_add(out, &index[node], gradient[node]);
            }
        }
    }
}

impl<const D: usize, const N: usize> Kernel for MusclePowerKernel<'_, D, N> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let mut sum = L::zero();
        for pack in self.patch.packs.clone() {
            let index = &self.patches.index[pack];
            let x = gather::<L, D, N>(&self.scratch.position, index);
            let v = gather::<L, D, N>(&self.scratch.direction, index);
            for point in &self.packs[pack * self.points..][..self.points] {
                let (image, rate) = (point.image(&x), point.image(&v));
                let mut along = L::zero();
                for c in 0..D {
                    along = image[c].mul_add(rate[c], along);
                }
                sum = point.tension::<L>().mul_add(along, sum);
            }
        }
        -sum.horizontal_sum()
    }
}
