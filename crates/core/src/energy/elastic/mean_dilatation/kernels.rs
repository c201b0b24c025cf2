//! Kernels over packs of cells, on lanes: positions to `Fb`, stresses to forces, and the same
//! along a direction, on dual numbers.

use super::super::block::Block;
use super::super::kernels::{gather, scatter};
use super::{Dilatation, PointPack};
use crate::algebra::{Dual, Mat};
use crate::energy::DeformationExtremes;
use crate::energy::patch::PackIndex;
use crate::lanes::{Kernel, Lanes, RowSlice, WIDTH};
use crate::scalar::Scalar;

/// Quadrature points of a cell at most.
pub(super) const MOST_POINTS: usize = 8;

/// A pack of cells at its quadrature points.
#[derive(Clone, Copy)]
pub(super) struct Points<'a, const D: usize, const N: usize> {
    /// Rest data at every point.
    pub(super) rest: &'a [PointPack<D, N>],
    /// Volumes, zero in lanes that fill up.
    pub(super) volume: &'a [f64; WIDTH],
    pub(super) index: &'a PackIndex<N>,
    pub(super) dilatation: Dilatation,
}

/// Deformation and stress of a pack at its quadrature points, or their change along a direction.
#[repr(align(64))]
pub(super) struct PointWork<const D: usize> {
    /// `Fb`.
    pub(super) f: [Block<D>; MOST_POINTS],
    /// `P(Fb)`.
    pub(super) p: [Block<D>; MOST_POINTS],
    /// `(theta / J)^(1/D)`; NaN where `J` or `theta` is not positive.
    scale: [[f64; WIDTH]; MOST_POINTS],
    /// `J`.
    j: [[f64; WIDTH]; MOST_POINTS],
    theta: [f64; WIDTH],
}

impl<const D: usize> PointWork<D> {
    pub(super) const ZERO: Self = PointWork {
        f: [Block::ZERO; MOST_POINTS],
        p: [Block::ZERO; MOST_POINTS],
        scale: [[0.0; WIDTH]; MOST_POINTS],
        j: [[0.0; WIDTH]; MOST_POINTS],
        theta: [0.0; WIDTH],
    };

    /// The extremes of `J` over the real cells of a pack.
    pub(super) fn extremes<const N: usize>(&self, points: &Points<'_, D, N>) -> DeformationExtremes {
        let mut extremes = DeformationExtremes::NONE;
        for lane in (0..WIDTH).filter(|lane| points.volume[*lane] > 0.0) {
            let at_points = self.j[..points.rest.len()].iter().map(|j| j[lane]);
            // NaN counts as the least.
            let least = at_points.fold(f64::INFINITY, |least, j| if least < j { least } else { j });
            let inverted = u64::from(least.is_nan() || least <= 0.0);
            extremes = extremes.merge(DeformationExtremes { min_j: least, inverted });
        }
        extremes
    }
}

/// A pack of numbers, or of numbers with their change along a direction.
pub(super) trait PackScalar<L: Lanes>: Scalar {
    fn load(value: &[f64; WIDTH], change: &[f64; WIDTH]) -> Self;
    fn store(self, value: &mut [f64; WIDTH], change: &mut [f64; WIDTH]);
    /// The change of a dual number, otherwise the value.
    fn last(self) -> L;
    fn constant(value: L) -> Self;
}

impl<L: Lanes> PackScalar<L> for L {
    #[inline(always)]
    fn load(value: &[f64; WIDTH], _: &[f64; WIDTH]) -> L {
        <L as Lanes>::load(value)
    }
    #[inline(always)]
    fn store(self, value: &mut [f64; WIDTH], _: &mut [f64; WIDTH]) {
        <L as Lanes>::store(self, value);
    }
    #[inline(always)]
    fn last(self) -> L {
        self
    }
    #[inline(always)]
    fn constant(value: L) -> L {
        value
    }
}

impl<L: Lanes> PackScalar<L> for Dual<L> {
    #[inline(always)]
    fn load(value: &[f64; WIDTH], change: &[f64; WIDTH]) -> Self {
        Dual { value: L::load(value), derivative: L::load(change) }
    }
    #[inline(always)]
    fn store(self, value: &mut [f64; WIDTH], change: &mut [f64; WIDTH]) {
        self.value.store(value);
        self.derivative.store(change);
    }
    #[inline(always)]
    fn last(self) -> L {
        self.derivative
    }
    #[inline(always)]
    fn constant(value: L) -> Self {
        Dual { value, derivative: L::zero() }
    }
}

/// Positions with their change along a direction.
#[inline(always)]
pub(super) fn with_change<L: Lanes, const D: usize, const N: usize>(
    x: &[[L; D]; N],
    dx: &[[L; D]; N],
) -> [[Dual<L>; D]; N] {
    let mut both = [[Dual::constant(L::zero()); D]; N];
    for a in 0..N {
        for c in 0..D {
            both[a][c] = Dual { value: x[a][c], derivative: dx[a][c] };
        }
    }
    both
}

/// `F = sum_a x_a b_a^T` at a point.
#[inline(always)]
fn deformation<L: Lanes, S: PackScalar<L>, const D: usize, const N: usize>(
    x: &[[S; D]; N],
    point: &PointPack<D, N>,
) -> Mat<S, D> {
    let mut f = Mat::zero();
    for a in 1..N {
        for i in 0..D {
            // Measured from the first node: what is far from the origin loses no digits.
            let from_first = x[a][i] - x[0][i];
            for k in 0..D {
                f[i][k] = from_first.mul_add(S::constant(point.gradient::<L>(a, k)), f[i][k]);
            }
        }
    }
    f
}

/// The same of positions, or of velocities, in lanes.
#[inline(always)]
pub(crate) fn cell_gradient<L: Lanes, const D: usize, const N: usize>(
    x: &[[L; D]; N],
    point: &PointPack<D, N>,
) -> Mat<L, D> {
    deformation::<L, L, D, N>(x, point)
}

/// The same of one cell, from the gradients of its nodes.
pub(crate) fn gradient_of_lane<const D: usize, const N: usize>(
    x: &[[f64; D]; N],
    gradient: &[[f64; D]; N],
) -> Mat<f64, D> {
    let mut f = Mat::zero();
    for (at, gradient) in x.iter().zip(gradient).skip(1) {
        for i in 0..D {
            (0..D).for_each(|k| f[i][k] += (at[i] - x[0][i]) * gradient[k]);
        }
    }
    f
}

/// `(theta / j)^(1/D)`; NaN where one of them is not positive.
#[inline(always)]
pub(super) fn root<S: Scalar, const D: usize>(theta: S, j: S) -> S {
    let ratio = theta / j;
    let root = if D == 2 { ratio.sqrt() } else { ratio.powf(S::splat(1.0 / 3.0)) };
    let valid = S::zero().lt(j) & S::zero().lt(theta);
    S::select(valid, root, S::splat(f64::NAN))
}

#[inline(always)]
fn load<L: Lanes, S: PackScalar<L>, const D: usize>(value: &Block<D>, change: &Block<D>) -> Mat<S, D> {
    let mut m = Mat::zero();
    for i in 0..D {
        for j in 0..D {
            m[i][j] = S::load(value.entry(i, j), change.entry(i, j));
        }
    }
    m
}

#[inline(always)]
fn store<L: Lanes, S: PackScalar<L>, const D: usize>(
    m: &Mat<S, D>,
    value: &mut Block<D>,
    change: &mut Block<D>,
) {
    for i in 0..D {
        for j in 0..D {
            m[i][j].store(value.entry_mut(i, j), change.entry_mut(i, j));
        }
    }
}

/// `m + s I`.
#[inline(always)]
fn add_scalar<S: Scalar, const D: usize>(m: &Mat<S, D>, s: S) -> Mat<S, D> {
    let mut sum = *m;
    for i in 0..D {
        sum[i][i] += s;
    }
    sum
}

/// Writes `Fb` of a pack, and along a direction its change.
pub(super) struct CellDeformationKernel<'a, const D: usize, const N: usize, const ALONG: bool> {
    pub(super) points: Points<'a, D, N>,
    pub(super) position: &'a RowSlice<D>,
    pub(super) direction: &'a RowSlice<D>,
    pub(super) work: &'a mut PointWork<D>,
    pub(super) change: &'a mut PointWork<D>,
}

impl<const D: usize, const N: usize, const ALONG: bool> CellDeformationKernel<'_, D, N, ALONG> {
    #[inline(always)]
    fn fill<L: Lanes, S: PackScalar<L>>(self, x: &[[S; D]; N]) {
        let CellDeformationKernel { points, work, change, .. } = self;
        let mut mean = S::zero();
        for (q, rest) in points.rest.iter().enumerate() {
            let f = deformation::<L, S, D, N>(x, rest);
            store(&f, &mut work.f[q], &mut change.f[q]);
            let j = f.determinant();
            j.store(&mut work.j[q], &mut change.j[q]);
            let averaged = if points.dilatation == Dilatation::Small { f.trace() } else { j };
            mean = S::constant(rest.part::<L>()).mul_add(averaged, mean);
        }
        mean.store(&mut work.theta, &mut change.theta);
        for q in 0..points.rest.len() {
            let f: Mat<S, D> = load(&work.f[q], &change.f[q]);
            let dilated = match points.dilatation {
                Dilatation::Finite => {
                    let scale = root::<S, D>(mean, S::load(&work.j[q], &change.j[q]));
                    scale.store(&mut work.scale[q], &mut change.scale[q]);
                    f.scale(scale)
                }
                Dilatation::Small => add_scalar(&f, (mean - f.trace()) * S::splat(1.0 / D as f64)),
                Dilatation::Own => f,
            };
            store(&dilated, &mut work.f[q], &mut change.f[q]);
        }
    }
}

impl<const D: usize, const N: usize, const ALONG: bool> Kernel for CellDeformationKernel<'_, D, N, ALONG> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let x = gather::<L, D, N>(self.position, self.points.index);
        if !ALONG {
            return self.fill::<L, L>(&x);
        }
        let dx = gather::<L, D, N>(self.direction, self.points.index);
        self.fill::<L, Dual<L>>(&with_change(&x, &dx));
    }
}

/// Adds the gradients at the vertices of a pack, or their change along a direction, from `P(Fb)`.
pub(super) struct CellForceKernel<'a, const D: usize, const N: usize, const ALONG: bool> {
    pub(super) points: Points<'a, D, N>,
    pub(super) work: &'a PointWork<D>,
    pub(super) change: &'a PointWork<D>,
    pub(super) gradient: &'a mut RowSlice<D>,
}

impl<const D: usize, const N: usize, const ALONG: bool> CellForceKernel<'_, D, N, ALONG> {
    /// `P : Fb / D` at a point, or `tr P / D`.
    #[inline(always)]
    fn pressure<L: Lanes, S: PackScalar<L>>(&self, q: usize) -> S {
        let p: Mat<S, D> = load(&self.work.p[q], &self.change.p[q]);
        let f: Mat<S, D> = load(&self.work.f[q], &self.change.f[q]);
        let sum = if self.points.dilatation == Dilatation::Small { p.trace() } else { p.dot(&f) };
        sum * S::splat(1.0 / D as f64)
    }

    /// `P*` at a point, given the mean of the pressures.
    #[inline(always)]
    fn working_stress<L: Lanes, S: PackScalar<L>>(&self, q: usize, mean: S) -> Mat<S, D> {
        let p: Mat<S, D> = load(&self.work.p[q], &self.change.p[q]);
        let pressure = self.pressure::<L, S>(q);
        match self.points.dilatation {
            Dilatation::Finite => {}
            Dilatation::Small => return add_scalar(&p, mean - pressure),
            Dilatation::Own => return p,
        }
        let f: Mat<S, D> = load(&self.work.f[q], &self.change.f[q]);
        let scale = S::load(&self.work.scale[q], &self.change.scale[q]);
        let theta = S::load(&self.work.theta, &self.change.theta);
        let j = S::load(&self.work.j[q], &self.change.j[q]);
        // cof F = s^(1 - D) cof Fb, 1/J = s^D / theta.
        f.cofactor().scale((mean * (j / theta) - pressure) / theta).scale_add(S::one(), &p).scale(scale)
    }

    #[inline(always)]
    fn add<L: Lanes, S: PackScalar<L>>(self) {
        let mut mean = S::zero();
        for (q, rest) in self.points.rest.iter().enumerate() {
            mean = S::constant(rest.part::<L>()).mul_add(self.pressure::<L, S>(q), mean);
        }
        let volume = <L as Lanes>::load(self.points.volume);
        let mut gradients = [[L::zero(); D]; N];
        for (q, rest) in self.points.rest.iter().enumerate() {
            let stress = self.working_stress::<L, S>(q, mean);
            let mut last = Mat::<L, D>::zero();
            for i in 0..D {
                for j in 0..D {
                    last[i][j] = stress[i][j].last();
                }
            }
            let h = last.scale(volume * rest.part::<L>());
            for a in 1..N {
                for i in 0..D {
                    for k in 0..D {
                        gradients[a][i] = h[i][k].mul_add(rest.gradient(a, k), gradients[a][i]);
                    }
                }
            }
        }
        // The gradients of shape functions add up to zero.
        for a in 1..N {
            for i in 0..D {
                gradients[0][i] -= gradients[a][i];
            }
        }
        scatter(self.gradient, self.points.index, gradients);
    }
}

impl<const D: usize, const N: usize, const ALONG: bool> Kernel for CellForceKernel<'_, D, N, ALONG> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        if ALONG { self.add::<L, Dual<L>>() } else { self.add::<L, L>() }
    }
}

/// Adds `w psi` of the points of a pack to one sum per lane; infinite where `J` is not positive.
pub(super) struct CellEnergyKernel<'a, const D: usize, const N: usize> {
    pub(super) points: Points<'a, D, N>,
    pub(super) work: &'a PointWork<D>,
    pub(super) psi: &'a [[f64; WIDTH]],
    pub(super) sum: &'a mut [f64; WIDTH],
}

impl<const D: usize, const N: usize> Kernel for CellEnergyKernel<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let volume = L::load(self.points.volume);
        let mut sum = L::load(self.sum);
        for (q, psi) in self.psi.iter().enumerate() {
            let weight = volume * self.points.rest[q].part::<L>();
            let mut psi = L::load(psi);
            if self.points.dilatation == Dilatation::Finite {
                let infinite = L::splat(f64::INFINITY);
                psi = L::select(L::load(&self.work.scale[q]).lt(infinite), psi, infinite);
            }
            // Zero times infinity in an empty lane is not zero.
            sum += L::select(L::zero().lt(weight), weight * psi, L::zero());
        }
        sum.store(self.sum);
    }
}
