//! Kernels over packs of stencils, on lanes.

use super::{MeasuredStencils, ScalarStrain};
use crate::algebra::Dual;
use crate::energy::patch::{Patch, Scratch};
use crate::lanes::{Kernel, Lanes, RowSlice, WIDTH};
use crate::scalar::Scalar;

/// The rows of one pack.
#[inline(always)]
pub(crate) fn gather<L: Lanes, const D: usize, const N: usize>(
    rows: &RowSlice<D>,
    index: &[[u16; WIDTH]; N],
) -> [[L; D]; N] {
    let mut x = [[L::zero(); D]; N];
    for node in 0..N {
        x[node] = L::gather(rows, &index[node]);
    }
    x
}

/// Adds `factor` times `gradient` to the rows of one pack.
#[inline(always)]
pub(crate) fn scatter<L: Lanes, const D: usize, const N: usize>(
    rows: &mut RowSlice<D>,
    index: &[[u16; WIDTH]; N],
    factor: L,
    gradient: &[[L; D]; N],
) {
    for node in 0..N {
        let mut row = gradient[node];
        for c in 0..D {
            row[c] *= factor;
        }
        L::scatter_add(rows, &index[node], row);
    }
}

/// `ds/dx . v`.
#[inline(always)]
fn rate<S: Scalar, const D: usize, const N: usize>(gradient: &[[S; D]; N], v: &[[S; D]; N]) -> S {
    let mut sum = S::zero();
    for node in 0..N {
        for c in 0..D {
            sum = gradient[node][c].mul_add(v[node][c], sum);
        }
    }
    sum
}

macro_rules! kernels {
    ($($(#[$doc:meta])* $name:ident($scratch:ty);)+) => {
        $(
            $(#[$doc])*
            pub(crate) struct $name<'a, Q, const D: usize, const N: usize> {
                pub(crate) stencils: &'a MeasuredStencils<Q, D, N>,
                pub(crate) patch: &'a Patch,
                pub(crate) scratch: $scratch,
            }
        )+
    };
}

kernels! {
    /// The energy.
    StencilEnergyKernel(&'a Scratch<D>);
    /// `k (s - s_0) ds/dx`.
    StencilGradientKernel(&'a mut Scratch<D>);
    /// The derivative of that along the direction, by dual numbers: exact.
    StencilHessianKernel(&'a mut Scratch<D>);
    /// `k (ds/dx . v) ds/dx`, `v` the direction.
    RateKernel(&'a mut Scratch<D>);
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize> Kernel for StencilEnergyKernel<'_, Q, D, N> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let mut sum = L::zero();
        for pack in self.patch.packs.clone() {
            let constants = &self.stencils.packs[pack];
            let x = gather::<L, D, N>(&self.scratch.position, &self.stencils.patches.index[pack]);
            let s = Q::deviation(&x, &constants.rest()).0;
            sum = (constants.stiffness::<L>() * s).mul_add(s, sum);
        }
        0.5 * sum.horizontal_sum()
    }
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize> Kernel for StencilGradientKernel<'_, Q, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (position, out) = (&*self.scratch.position, &mut *self.scratch.gradient);
        for pack in self.patch.packs.clone() {
            let constants = &self.stencils.packs[pack];
            let index = &self.stencils.patches.index[pack];
            let x = gather::<L, D, N>(position, index);
            let (s, gradient) = Q::deviation(&x, &constants.rest());
            scatter(out, index, constants.stiffness::<L>() * s, &gradient);
        }
    }
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize> Kernel for StencilHessianKernel<'_, Q, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Scratch { position, direction, gradient: out } = self.scratch;
        for pack in self.patch.packs.clone() {
            let constants = &self.stencils.packs[pack];
            let index = &self.stencils.patches.index[pack];
            let (x, p) = (gather::<L, D, N>(position, index), gather::<L, D, N>(direction, index));
            let mut along = [[Dual::constant(L::zero()); D]; N];
            for node in 0..N {
                for c in 0..D {
                    along[node][c] = Dual { value: x[node][c], derivative: p[node][c] };
                }
            }
            let [a, b] = constants.rest::<L>();
            let (s, gradient) = Q::deviation(&along, &[Dual::constant(a), Dual::constant(b)]);
            let mut product = [[L::zero(); D]; N];
            for node in 0..N {
                for c in 0..D {
                    product[node][c] = (s * gradient[node][c]).derivative;
                }
            }
            scatter(out, index, constants.stiffness::<L>(), &product);
        }
    }
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize> Kernel for RateKernel<'_, Q, D, N> {
    /// Twice the dissipation function.
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let Scratch { position, direction, gradient: out } = self.scratch;
        let mut power = L::zero();
        for pack in self.patch.packs.clone() {
            let constants = &self.stencils.packs[pack];
            let index = &self.stencils.patches.index[pack];
            let (x, v) = (gather::<L, D, N>(position, index), gather::<L, D, N>(direction, index));
            let gradient = Q::deviation(&x, &constants.rest()).1;
            let rate = rate(&gradient, &v);
            let force = constants.stiffness::<L>() * rate;
            power = force.mul_add(rate, power);
            scatter(out, index, force, &gradient);
        }
        power.horizontal_sum()
    }
}
