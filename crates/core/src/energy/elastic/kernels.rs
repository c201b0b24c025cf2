//! What is done with each pack of elements, on lanes.
//!
//! Each kernel is compiled for every material and every instruction set. To keep that small, only the stress has a version for
//! AVX-512, and only the one in closed form for two packs at once; where a pack is no register, the mathematics of a material runs lane by lane on `f64`.

use crate::algebra::{Dual, Mat};
use crate::element::{SimplexPack, edge_matrix, vertex_gradients};
use crate::energy::DeformationExtremes;
use crate::energy::patch::{PackIndex, Patch, Patches, Scratch};
use crate::lanes::{Kernel, Lanes, Pair, RowSlice, Rows, WIDTH};
use crate::material::{Material, autodiff_stress};
use crate::scalar::Scalar;

/// Deformation gradient of the elements of one pack from the vertices in `rows`; linear in them.
#[inline(always)]
fn deformation_gradient<L: Lanes, const D: usize, const N: usize>(
    rows: &RowSlice<D>,
    index: &[[u16; WIDTH]; N],
    inverse_rest: &Mat<L, D>,
) -> Mat<L, D> {
    let mut x = [[L::zero(); D]; N];
    // Written out: the compiler does not unroll a loop around so much code, and then keeps `x` in memory.
    x[0] = L::gather(rows, &index[0]);
    x[1] = L::gather(rows, &index[1]);
    x[2] = L::gather(rows, &index[2]);
    if N == 4 {
        x[3] = L::gather(rows, &index[3]);
    }
    edge_matrix(&x).mul(inverse_rest)
}

/// Adds the gradients at the vertices of one pack, given `H = w P D_m^-T`.
#[inline(always)]
fn scatter<L: Lanes, const D: usize, const N: usize>(
    rows: &mut RowSlice<D>,
    index: &[[u16; WIDTH]; N],
    h: &Mat<L, D>,
) {
    let gradients: [[L; D]; N] = vertex_gradients(h);
    // Written out, as in `deformation_gradient`.
    L::scatter_add(rows, &index[0], gradients[0]);
    L::scatter_add(rows, &index[1], gradients[1]);
    L::scatter_add(rows, &index[2], gradients[2]);
    if N == 4 {
        L::scatter_add(rows, &index[3], gradients[3]);
    }
}

pub(super) struct GradientKernel<'a, M, const D: usize, const N: usize, const AUTODIFF: bool> {
    pub(super) material: &'a M,
    pub(super) patches: &'a Patches<N>,
    pub(super) packs: &'a [SimplexPack<D>],
    pub(super) patch: &'a Patch,
    pub(super) scratch: &'a mut Scratch<D>,
}

/// What is done with one pack, or two.
struct Stress<'a, M, const D: usize, const N: usize, const AUTODIFF: bool>(&'a M);

impl<M: Material<D>, const D: usize, const N: usize, const AUTODIFF: bool> Stress<'_, M, D, N, AUTODIFF> {
    /// `H = w P D_m^-T`.
    #[inline(always)]
    fn weighted_stress<S: Scalar>(&self, f: &Mat<S, D>, inverse_rest: &Mat<S, D>, weight: S) -> Mat<S, D> {
        let p = if AUTODIFF { autodiff_stress(self.0, f) } else { self.0.pk1(f) };
        p.scale(weight).mul_transpose(inverse_rest)
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
            return scatter(gradient, index, &self.weighted_stress(&f, &rest, weight));
        }
        let mut h = [[[0.0; WIDTH]; D]; D];
        for l in 0..WIDTH {
            let of_lane = self.weighted_stress_of_lane(&lane(&f, l), &lane(&rest, l), weight.to_array()[l]);
            for i in 0..D {
                for j in 0..D {
                    h[i][j][l] = of_lane[i][j];
                }
            }
        }
        scatter(gradient, index, &load_matrix::<L, D>(&h));
    }

    #[inline(never)]
    fn weighted_stress_of_lane(
        &self,
        f: &Mat<f64, D>,
        inverse_rest: &Mat<f64, D>,
        weight: f64,
    ) -> Mat<f64, D> {
        self.weighted_stress(f, inverse_rest, weight)
    }

    /// Two packs a turn: the latency of divisions and roots in one hides behind the other. They are added one after the
    /// other, the second to the rows `into`, so that the sums are those of one pack a turn.
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
        scatter(gradient, index[0], &Mat(h_a));
        scatter(gradient, into, &Mat(h_b));
    }
}

impl<M: Material<D>, const D: usize, const N: usize, const AUTODIFF: bool> Kernel
    for GradientKernel<'_, M, D, N, AUTODIFF>
{
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let stress = Stress::<M, D, N, AUTODIFF>(self.material);
        let (position, gradient) = (&*self.scratch.position, &mut *self.scratch.gradient);
        let index = &self.patches.index[self.patch.packs.clone()];
        let packs = &self.packs[self.patch.packs.clone()];
        // One of the two loops is compiled, so that a material's stress is inlined once. Dual numbers are many registers
        // already: pairs of them only spill.
        if L::PAIRS_PAY && !AUTODIFF {
            // The last pack of an odd number goes with itself, and is added a second time where nobody looks. Not left out: around
            // a branch the compiler moves all of the second pack's work behind it, and the two no longer overlap.
            let nowhere = [[Rows::<D>::SPARE; WIDTH]; N];
            for (packs, index) in packs.chunks(2).zip(index.chunks(2)) {
                let (second, into) =
                    if let [_, second] = index { (second, second) } else { (&index[0], &nowhere) };
                let packs = [&packs[0], &packs[packs.len() - 1]];
                stress.two_packs::<L>(packs, [&index[0], second], into, position, gradient);
            }
        } else {
            for (pack, index) in packs.iter().zip(index) {
                stress.one_pack::<L>(pack, index, position, gradient);
            }
        }
    }
}

/// The matrix of pairs `(a, b)`.
#[inline(always)]
fn both<S: Scalar, const D: usize>(a: &Mat<S, D>, b: &Mat<S, D>) -> Mat<Pair<S>, D> {
    Mat(Pair::zip_rows(&a.0, &b.0))
}

/// The matrix of one lane.
#[inline(always)]
fn lane<L: Lanes, const D: usize>(m: &Mat<L, D>, lane: usize) -> Mat<f64, D> {
    let mut r = Mat::zero();
    for i in 0..D {
        for j in 0..D {
            r[i][j] = m[i][j].to_array()[lane];
        }
    }
    r
}

#[inline(always)]
fn load_matrix<L: Lanes, const D: usize>(m: &[[[f64; WIDTH]; D]; D]) -> Mat<L, D> {
    let mut r = Mat::zero();
    for i in 0..D {
        for j in 0..D {
            r[i][j] = L::load(&m[i][j]);
        }
    }
    r
}

/// `w dP D_m^-T` with `dP` the derivative of the stress along `dF`, both from dual numbers: exact, without a Hessian.
pub(super) struct HessianKernel<'a, M, const D: usize, const N: usize> {
    pub(super) material: &'a M,
    pub(super) patches: &'a Patches<N>,
    pub(super) packs: &'a [SimplexPack<D>],
    pub(super) patch: &'a Patch,
    pub(super) scratch: &'a mut Scratch<D>,
}

impl<M: Material<D>, const D: usize, const N: usize> HessianKernel<'_, M, D, N> {
    /// `dP`.
    #[inline(always)]
    fn derivative<L: Lanes>(&self, f: &Mat<L, D>, df: &Mat<L, D>) -> Mat<L, D> {
        if !L::BY_LANE {
            return Dual::parts(&self.material.pk1(&Dual::along(f, df))).1;
        }
        let mut dp = [[[0.0; WIDTH]; D]; D];
        for l in 0..WIDTH {
            let of_lane = self.derivative_of_lane(&lane(f, l), &lane(df, l));
            for i in 0..D {
                for j in 0..D {
                    dp[i][j][l] = of_lane[i][j];
                }
            }
        }
        load_matrix(&dp)
    }

    #[inline(never)]
    fn derivative_of_lane(&self, f: &Mat<f64, D>, df: &Mat<f64, D>) -> Mat<f64, D> {
        Dual::parts(&self.material.pk1(&Dual::along(f, df))).1
    }
}

impl<M: Material<D>, const D: usize, const N: usize> Kernel for HessianKernel<'_, M, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for pack in self.patch.packs.clone() {
            let index = &self.patches.index[pack];
            let rest = self.packs[pack].inverse_rest::<L>();
            let f = deformation_gradient(&self.scratch.position, index, &rest);
            let df = deformation_gradient(&self.scratch.direction, index, &rest);
            let dp = self.derivative(&f, &df);
            let h = dp.scale(self.packs[pack].weight()).mul_transpose(&rest);
            scatter(&mut self.scratch.gradient, index, &h);
        }
    }
}

pub(super) struct EnergyKernel<'a, M, const D: usize, const N: usize> {
    pub(super) material: &'a M,
    pub(super) patches: &'a Patches<N>,
    pub(super) packs: &'a [SimplexPack<D>],
    pub(super) patch: &'a Patch,
    pub(super) scratch: &'a Scratch<D>,
}

impl<M: Material<D>, const D: usize, const N: usize> EnergyKernel<'_, M, D, N> {
    #[inline(always)]
    fn density<L: Lanes>(&self, f: &Mat<L, D>) -> L {
        if !L::BY_LANE {
            return self.material.psi(f);
        }
        let mut psi = [0.0; WIDTH];
        for (l, psi) in psi.iter_mut().enumerate() {
            *psi = self.density_of_lane(&lane(f, l));
        }
        L::load(&psi)
    }

    #[inline(never)]
    fn density_of_lane(&self, f: &Mat<f64, D>) -> f64 {
        self.material.psi(f)
    }
}

impl<M: Material<D>, const D: usize, const N: usize> Kernel for EnergyKernel<'_, M, D, N> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let mut sum = L::zero();
        for pack in self.patch.packs.clone() {
            let rest = self.packs[pack].inverse_rest::<L>();
            let f = deformation_gradient(&self.scratch.position, &self.patches.index[pack], &rest);
            let weight = self.packs[pack].weight::<L>();
            let energy = weight * self.density(&f);
            // Zero times infinity in an empty lane is not zero.
            sum += L::select(L::zero().lt(weight), energy, L::zero());
        }
        sum.horizontal_sum()
    }
}

pub(super) struct DeformationKernel<'a, const D: usize, const N: usize> {
    pub(super) patches: &'a Patches<N>,
    pub(super) packs: &'a [SimplexPack<D>],
    pub(super) patch: &'a Patch,
    pub(super) scratch: &'a Scratch<D>,
}

impl<const D: usize, const N: usize> Kernel for DeformationKernel<'_, D, N> {
    type Output = DeformationExtremes;

    #[inline(always)]
    fn run<L: Lanes>(self) -> DeformationExtremes {
        let mut min_j = L::splat(f64::INFINITY);
        let mut inverted = 0;
        for pack in self.patch.packs.clone() {
            let rest = self.packs[pack].inverse_rest::<L>();
            let j =
                deformation_gradient(&self.scratch.position, &self.patches.index[pack], &rest).determinant();
            // Lanes that fill up repeat an element: they cannot change the minimum, but they must not be counted.
            let real = L::mask_to_bits(L::zero().lt(self.packs[pack].weight::<L>()));
            let upright = L::mask_to_bits(L::zero().lt(j));
            inverted += u64::from((real & !upright).count_ones());
            min_j = L::select(min_j.lt(j), min_j, j);
        }
        DeformationExtremes { min_j: min_j.horizontal_min(), inverted }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::tests::sample::Random;
    use crate::element::simplex_rest;
    use crate::lanes::{Level, dispatch_at};
    use crate::material::{Corotated, Isotropic, Model, Parameters};

    /// The gradient rows of `count` tetrahedra with vertices in common, turned and deformed.
    fn gradient<const AUTODIFF: bool>(level: Level, count: usize) -> Vec<u64> {
        let mut random = Random(8);
        let vertices = 2 * count + 4;
        let rest: Vec<[f64; 3]> = (0..vertices).map(|_| random.gaussian::<3>()[0]).collect();
        let mut elements = vec![];
        for i in 0..count as u32 {
            let mut element = [i, i + 1, 2 * i + 2, 2 * i + 3];
            if simplex_rest(&element.map(|v| rest[v as usize])).1 < 0.0 {
                element.swap(2, 3);
            }
            elements.push(element);
        }
        let order: Vec<u32> = (0..count as u32).collect();
        let patches = Patches::new::<3>(&elements, &order, vertices);
        let mut packs = vec![SimplexPack::<3>::new(); patches.index.len()];
        for (element, _, pack, lane) in patches.stencils() {
            let (inverse_rest, weight) = simplex_rest(&elements[element].map(|v| rest[v as usize]));
            packs[pack].set(lane, &inverse_rest, weight);
        }
        for (pack, stencils) in packs.iter_mut().zip(&patches.stencil) {
            pack.fill_up(stencils.iter().flatten().count());
        }
        let turn = random.rotation::<3>();
        let position: Vec<f64> =
            rest.iter().flat_map(|x| turn.mul_vec(x).map(|y| 1.1 * y + 0.1 * y * y)).collect();
        let (material, patch) = (Corotated::new(&Isotropic::example()), &patches.patches[0]);
        let mut scratch = Scratch::new();
        for (row, &v) in patches.vertices.iter().enumerate() {
            scratch.position.load(row, &position[3 * v as usize..][..3]);
        }
        let kernel = GradientKernel::<_, 3, 4, AUTODIFF> {
            material: &material,
            patches: &patches,
            packs: &packs,
            patch,
            scratch: &mut scratch,
        };
        dispatch_at(level, kernel);
        scratch.gradient.as_slice()[..4 * vertices].iter().map(|x| x.to_bits()).collect()
    }

    /// An even and an odd number of packs, the last one full or not.
    #[test]
    fn forces_have_the_same_bits_on_every_level_for_any_number_of_packs() {
        for count in [1, 8, 13, 16, 23, 24, 33] {
            let expected = gradient::<false>(Level::Portable, count);
            assert!(expected.iter().any(|&bits| f64::from_bits(bits) != 0.0));
            for level in Level::ALL {
                assert_eq!(gradient::<false>(level, count), expected, "{level:?}, {count} elements");
                let autodiff = gradient::<true>(Level::Portable, count);
                assert_eq!(gradient::<true>(level, count), autodiff, "{level:?}, {count} elements, autodiff");
            }
        }
    }
}
