//! Kernels over packs of stencils, on lanes.

use super::{MeasuredStencils, RateLaw, ScalarLaw, ScalarStrain};
use crate::algebra::Dual;
use crate::energy::patch::{Patch, Scratch};
use crate::lanes::{Kernel, Lanes, RowSlice, WIDTH};
use crate::scalar::Scalar;

/// Gathers the rows of one pack.
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
fn scatter<L: Lanes, const D: usize, const N: usize>(
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

/// Returns `ds/dx . v`.
#[inline(always)]
pub(crate) fn rate<S: Scalar, const D: usize, const N: usize>(gradient: &[[S; D]; N], v: &[[S; D]; N]) -> S {
    let mut sum = S::zero();
    for node in 0..N {
        for c in 0..D {
            sum = gradient[node][c].mul_add(v[node][c], sum);
        }
    }
    sum
}

/// Returns `value` in lanes with a stencil of their own, zero in padding lanes.
#[inline(always)]
fn own<L: Lanes>(stiffness: L, value: L) -> L {
    L::select(L::zero().lt(stiffness.abs()), value, L::zero())
}

/// Returns positions as dual numbers along directions.
#[inline(always)]
pub(crate) fn moving<S: Scalar, const D: usize, const N: usize>(
    x: &[[S; D]; N],
    directions: &[[S; D]; N],
) -> [[Dual<S>; D]; N] {
    let mut along = [[Dual::constant(S::zero()); D]; N];
    for node in 0..N {
        for c in 0..D {
            along[node][c] = Dual { value: x[node][c], derivative: directions[node][c] };
        }
    }
    along
}

macro_rules! kernels {
    ($($(#[$doc:meta])* $name:ident($scratch:ty);)+) => {
        $(
            $(#[$doc])*
            pub(crate) struct $name<'a, Q, W, const D: usize, const N: usize> {
                pub(crate) stencils: &'a MeasuredStencils<Q, D, N>,
                pub(crate) law: &'a W,
                pub(crate) patch: &'a Patch,
                pub(crate) scratch: $scratch,
            }
        )+
    };
}

kernels! {
    /// Sums the energy.
    StencilEnergyKernel(&'a Scratch<D>);
    /// Adds the gradient `k psi' ds/dx`.
    StencilGradientKernel(&'a mut Scratch<D>);
    /// Adds the derivative of the gradient along the direction, by dual numbers: exact.
    StencilHessianKernel(&'a mut Scratch<D>);
    /// Adds `k R' ds/dx` at the rate `ds/dx . v`, with the direction as `v`; returns the power.
    RateKernel(&'a mut Scratch<D>);
    /// Sums the dissipation function.
    DissipationKernel(&'a mut Scratch<D>);
}

impl<Q: ScalarStrain<D, N>, W: ScalarLaw, const D: usize, const N: usize> Kernel
    for StencilEnergyKernel<'_, Q, W, D, N>
{
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let mut sum = L::zero();
        for pack in self.patch.packs.clone() {
            let constants = &self.stencils.packs[pack];
            let x = gather::<L, D, N>(&self.scratch.position, &self.stencils.patches.index[pack]);
            let (rest, stiffness) = (constants.rest(), constants.stiffness::<L>());
            let s = Q::deviation(&x, &W::origin(&rest)).0;
            sum += own(stiffness, stiffness * self.law.energy(s, &rest));
        }
        sum.horizontal_sum()
    }
}

impl<Q: ScalarStrain<D, N>, W: ScalarLaw, const D: usize, const N: usize> Kernel
    for StencilGradientKernel<'_, Q, W, D, N>
{
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (position, out) = (&*self.scratch.position, &mut *self.scratch.gradient);
        for pack in self.patch.packs.clone() {
            let constants = &self.stencils.packs[pack];
            let index = &self.stencils.patches.index[pack];
            let x = gather::<L, D, N>(position, index);
            let (rest, stiffness) = (constants.rest(), constants.stiffness::<L>());
            let (s, gradient) = Q::deviation(&x, &W::origin(&rest));
            scatter(out, index, own(stiffness, stiffness * self.law.force(s, &rest)), &gradient);
        }
    }
}

impl<Q: ScalarStrain<D, N>, W: ScalarLaw, const D: usize, const N: usize> Kernel
    for StencilHessianKernel<'_, Q, W, D, N>
{
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Scratch { position, direction, gradient: out } = self.scratch;
        for pack in self.patch.packs.clone() {
            let constants = &self.stencils.packs[pack];
            let index = &self.stencils.patches.index[pack];
            let along = moving(&gather::<L, D, N>(position, index), &gather::<L, D, N>(direction, index));
            let [a, b] = constants.rest::<L>();
            let rest = [Dual::constant(a), Dual::constant(b)];
            let (s, gradient) = Q::deviation(&along, &W::origin(&rest));
            let (force, stiffness) = (self.law.force(s, &rest), constants.stiffness::<L>());
            let mut product = [[L::zero(); D]; N];
            for node in 0..N {
                for c in 0..D {
                    product[node][c] = own(stiffness, (force * gradient[node][c]).derivative);
                }
            }
            scatter(out, index, stiffness, &product);
        }
    }
}

/// Stencils of one pack with their rates.
struct PackInMotion<L, const D: usize, const N: usize> {
    stiffness: L,
    rest: [L; 2],
    s: L,
    gradient: [[L; D]; N],
    rate: L,
}

impl<L: Lanes, const D: usize, const N: usize> PackInMotion<L, D, N> {
    #[inline(always)]
    fn new<Q: ScalarStrain<D, N>, R: RateLaw>(
        stencils: &MeasuredStencils<Q, D, N>,
        pack: usize,
        (position, direction): (&RowSlice<D>, &RowSlice<D>),
    ) -> Self {
        let (constants, index) = (&stencils.packs[pack], &stencils.patches.index[pack]);
        let (x, v) = (gather(position, index), gather(direction, index));
        let rest = constants.rest();
        let (s, gradient) = Q::deviation(&x, &R::origin(&rest));
        PackInMotion { stiffness: constants.stiffness(), rest, s, rate: rate(&gradient, &v), gradient }
    }
}

impl<Q: ScalarStrain<D, N>, R: RateLaw, const D: usize, const N: usize> Kernel
    for RateKernel<'_, Q, R, D, N>
{
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let Scratch { position, direction, gradient: out } = self.scratch;
        let mut power = L::zero();
        for pack in self.patch.packs.clone() {
            let PackInMotion { stiffness, rest, s, gradient, rate } =
                PackInMotion::<L, D, N>::new::<Q, R>(self.stencils, pack, (position, direction));
            let force = own(stiffness, stiffness * self.law.force(rate, s, &rest));
            power = force.mul_add(rate, power);
            scatter(out, &self.stencils.patches.index[pack], force, &gradient);
        }
        power.horizontal_sum()
    }
}

impl<Q: ScalarStrain<D, N>, R: RateLaw, const D: usize, const N: usize> Kernel
    for DissipationKernel<'_, Q, R, D, N>
{
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let Scratch { position, direction, .. } = self.scratch;
        let mut sum = L::zero();
        for pack in self.patch.packs.clone() {
            let PackInMotion { stiffness, rest, s, rate, .. } =
                PackInMotion::<L, D, N>::new::<Q, R>(self.stencils, pack, (position, direction));
            sum += own(stiffness, stiffness * self.law.dissipation(rate, s, &rest));
        }
        sum.horizontal_sum()
    }
}
