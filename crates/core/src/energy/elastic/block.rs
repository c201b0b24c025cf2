//! Materials on blocks of deformation gradients, for every kind of element.
//!
//! An element writes the `F` of its quadrature points, eight elements side by side, into a few blocks.
//! The material turns them into stresses, and the element turns these into forces. A material is thus
//! compiled once for all elements, and an element once for all materials.

use crate::algebra::{Dual, Mat, Vect};
use crate::element::{ElementState, Tangents};
use crate::lanes::{Kernel, Lanes, Pair, WIDTH, dispatch, dispatch_compact};
use crate::material::{Domain, Material, Psd, Spectrum, Stress, Tangent, autodiff_stress, stress_along};
use crate::scalar::Scalar;

/// Matrices of `WIDTH` elements side by side, `[row][column][lane]`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Block<const D: usize, const R: usize = D>([[[f64; WIDTH]; R]; D]);

impl<const D: usize, const R: usize> Block<D, R> {
    pub(crate) const ZERO: Self = Block([[[0.0; WIDTH]; R]; D]);

    /// Loads all entries of a matrix that need not be square.
    #[inline(always)]
    pub(crate) fn load_tangents<L: Lanes>(&self) -> Tangents<L, D, R> {
        let mut m = [[L::zero(); R]; D];
        for i in 0..D {
            for j in 0..R {
                m[i][j] = L::load(&self.0[i][j]);
            }
        }
        m
    }

    #[inline(always)]
    pub(crate) fn store_tangents<L: Lanes>(&mut self, m: &Tangents<L, D, R>) {
        for i in 0..D {
            for j in 0..R {
                m[i][j].store(&mut self.0[i][j]);
            }
        }
    }

    /// Returns the entries of one lane.
    pub(crate) fn tangents_of_lane(&self, lane: usize) -> Tangents<f64, D, R> {
        self.0.map(|row| row.map(|lanes| lanes[lane]))
    }
}

impl<const D: usize> Block<D> {
    #[inline(always)]
    pub(super) fn load<L: Lanes>(&self) -> Mat<L, D> {
        Mat(self.load_tangents())
    }

    #[inline(always)]
    pub(super) fn store<L: Lanes>(&mut self, m: &Mat<L, D>) {
        self.store_tangents(&m.0);
    }

    #[inline(always)]
    pub(super) fn lane(&self, lane: usize) -> Mat<f64, D> {
        Mat(self.tangents_of_lane(lane))
    }

    /// Returns one entry of all lanes.
    #[inline(always)]
    pub(super) fn entry(&self, row: usize, column: usize) -> &[f64; WIDTH] {
        &self.0[row][column]
    }

    /// Returns one entry of all lanes.
    #[inline(always)]
    pub(super) fn entry_mut(&mut self, row: usize, column: usize) -> &mut [f64; WIDTH] {
        &mut self.0[row][column]
    }

    /// Sets one entry of one lane.
    pub(super) fn set(&mut self, row: usize, column: usize, lane: usize, value: f64) {
        self.0[row][column][lane] = value;
    }

    #[inline(always)]
    pub(super) fn set_lane(&mut self, lane: usize, m: &Mat<f64, D>) {
        for i in 0..D {
            for j in 0..D {
                self.0[i][j][lane] = m[i][j];
            }
        }
    }
}

/// Eigenvalues of `dP/dF` of `WIDTH` elements side by side, see [`Spectrum`].
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct SpectrumBlock<const D: usize> {
    pub(super) scaling: Block<D>,
    pub(super) twist: Block<D>,
    pub(super) flip: Block<D>,
}

impl<const D: usize> SpectrumBlock<D> {
    pub(super) const ZERO: Self =
        SpectrumBlock { scaling: Block::ZERO, twist: Block::ZERO, flip: Block::ZERO };
}

/// Interface of a material to elements.
pub(super) trait BlockMaterial<const D: usize>: Send + Sync {
    /// Overwrites each `F` with `P` [Pa].
    fn stress(&self, how: Stress, f: &mut [Block<D>]);
    /// Overwrites each `dF` with `dP = dP/dF : dF` [Pa] at the `F` of the same index, by dual numbers:
    /// exact, without a Hessian. Also writes `P : dF` [J/m^3] to `work`, if given; returns false if it is
    /// not available.
    fn derivative(&self, f: &[Block<D>], df: &mut [Block<D>], work: Option<&mut [[f64; WIDTH]]>) -> bool;
    /// Writes the energy densities [J/m^3].
    fn density(&self, f: &[Block<D>], psi: &mut [[f64; WIDTH]]);
    /// Returns the eigenvalues of `dP/dF` at these signed singular values; `None` for a model that does
    /// not provide them.
    fn spectrum(&self, sigma: &Vect<f64, D>) -> Option<Spectrum<D>>;
    /// Computes [`BlockMaterial::spectrum`] for eight elements, `sigma[i][lane]`.
    fn spectra(&self, sigma: &[[f64; WIDTH]; D], out: &mut SpectrumBlock<D>) {
        for lane in 0..WIDTH {
            let mut of_lane = [0.0; D];
            for i in 0..D {
                of_lane[i] = sigma[i][lane];
            }
            let spectrum = self.spectrum(&of_lane).expect("models without a spectrum do not come here");
            out.scaling.set_lane(lane, &spectrum.scaling);
            out.twist.set_lane(lane, &spectrum.twist);
            out.flip.set_lane(lane, &spectrum.flip);
        }
    }
    /// Returns `dP/dF` [Pa].
    fn tangent(&self, f: &Mat<f64, D>, psd: Psd) -> Tangent<D>;
    /// Returns the domain of the model.
    fn domain(&self) -> Domain;
    /// True if energy or stress are not finite at `f`, or `f` is outside the domain.
    fn is_at_fault(&self, f: &Mat<f64, D>) -> bool;
    /// Returns `F` and `P` in 3D, and the energy density.
    fn state(&self, f: &Mat<f64, D>) -> ElementState;
}

/// Returns `P` at a few deformation gradients, side by side in the lanes of a block; unused lanes repeat
/// the last.
pub(super) fn stresses<const D: usize>(
    material: &dyn BlockMaterial<D>,
    how: Stress,
    f: &[Mat<f64, D>],
) -> Block<D> {
    let mut stress = in_lanes(f);
    material.stress(how, std::slice::from_mut(&mut stress));
    stress
}

/// Returns `dP/dF : dF` at a few deformation gradients along as many directions, in the same lanes.
pub(super) fn stress_changes<const D: usize>(
    material: &dyn BlockMaterial<D>,
    f: &[Mat<f64, D>],
    df: &[Mat<f64, D>],
) -> Block<D> {
    let (f, mut change) = (in_lanes(f), in_lanes(df));
    material.derivative(&[f], std::slice::from_mut(&mut change), None);
    change
}

/// Places matrices in the lanes of a block; unused lanes repeat the last.
fn in_lanes<const D: usize>(matrices: &[Mat<f64, D>]) -> Block<D> {
    let mut block = Block::ZERO;
    (0..WIDTH).for_each(|lane| block.set_lane(lane, &matrices[lane.min(matrices.len() - 1)]));
    block
}

impl<M: Material<D> + Material<3>, const D: usize> BlockMaterial<D> for M {
    fn stress(&self, how: Stress, f: &mut [Block<D>]) {
        match how {
            Stress::Analytic => dispatch(StressKernel::<M, D, false> { material: self, f }),
            Stress::Autodiff => dispatch(StressKernel::<M, D, true> { material: self, f }),
        }
    }

    fn derivative(&self, f: &[Block<D>], df: &mut [Block<D>], work: Option<&mut [[f64; WIDTH]]>) -> bool {
        dispatch_compact(DerivativeKernel { material: self, f, df, work });
        true
    }

    fn density(&self, f: &[Block<D>], psi: &mut [[f64; WIDTH]]) {
        dispatch_compact(DensityKernel { material: self, f, psi });
    }

    #[inline]
    fn spectrum(&self, sigma: &Vect<f64, D>) -> Option<Spectrum<D>> {
        Material::<D>::spectrum(self, sigma)
    }

    fn tangent(&self, f: &Mat<f64, D>, psd: Psd) -> Tangent<D> {
        self.hessian(f, psd)
    }

    fn domain(&self) -> Domain {
        Material::<D>::domain(self)
    }

    fn is_at_fault(&self, f: &Mat<f64, D>) -> bool {
        let j = f.determinant();
        let outside = Material::<D>::domain(self) == Domain::PositiveJ && j.is_nan() | (j <= 0.0);
        outside || !stress_of_lane(self, f).norm_squared().is_finite()
    }

    fn state(&self, f: &Mat<f64, D>) -> ElementState {
        // In plane strain the third axis is neither stretched nor rotated, but carries stress; in plane
        // stress it is stretched.
        let mut in_space = Mat::<f64, 3>::identity();
        for i in 0..D {
            in_space[i][..D].copy_from_slice(&f[i]);
        }
        if D == 2 {
            in_space[2][2] = self.out_of_plane_stretch(f);
        }
        let first_piola = Material::<3>::pk1(self, &in_space);
        let energy_density = Material::<D>::psi(self, f);
        ElementState { deformation_gradient: in_space, first_piola, energy_density, plane: D == 2 }
    }
}

struct StressKernel<'a, M, const D: usize, const AUTODIFF: bool> {
    material: &'a M,
    f: &'a mut [Block<D>],
}

/// Returns `P`, in one compiled function for all lane-by-lane callers.
#[inline(never)]
pub(super) fn stress_of_lane<M: Material<D>, const D: usize>(material: &M, f: &Mat<f64, D>) -> Mat<f64, D> {
    material.pk1(f)
}

#[inline(never)]
fn autodiff_stress_of_lane<M: Material<D>, const D: usize>(material: &M, f: &Mat<f64, D>) -> Mat<f64, D> {
    autodiff_stress(material, f)
}

impl<M: Material<D>, const D: usize, const AUTODIFF: bool> StressKernel<'_, M, D, AUTODIFF> {
    fn of_lane(material: &M, f: &Mat<f64, D>) -> Mat<f64, D> {
        if AUTODIFF { autodiff_stress_of_lane(material, f) } else { stress_of_lane(material, f) }
    }

    #[inline(always)]
    fn stress<S: Scalar>(material: &M, f: &Mat<S, D>) -> Mat<S, D> {
        if AUTODIFF { autodiff_stress(material, f) } else { material.pk1(f) }
    }
}

impl<M: Material<D>, const D: usize, const AUTODIFF: bool> Kernel for StressKernel<'_, M, D, AUTODIFF> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        if L::BY_LANE {
            for block in self.f {
                for l in 0..WIDTH {
                    block.set_lane(l, &Self::of_lane(self.material, &block.lane(l)));
                }
            }
        } else if L::PAIRS_PAY && !AUTODIFF {
            // Two blocks at a time: the latency of divisions and roots in one hides behind the other. The
            // last of an odd number is paired with itself, so that the stress is inlined once.
            for blocks in self.f.chunks_mut(2) {
                let second = blocks.len() - 1;
                let f = both(&blocks[0].load::<L>(), &blocks[second].load::<L>());
                let (first, other) = Pair::unzip_rows(&Self::stress(self.material, &f).0);
                blocks[0].store(&Mat(first));
                blocks[second].store(&Mat(other));
            }
        } else {
            for block in self.f {
                block.store(&Self::stress(self.material, &block.load::<L>()));
            }
        }
    }
}

/// Returns the matrix of the pairs `(a, b)`.
#[inline(always)]
pub(super) fn both<S: Scalar, const D: usize>(a: &Mat<S, D>, b: &Mat<S, D>) -> Mat<Pair<S>, D> {
    Mat(Pair::zip_rows(&a.0, &b.0))
}

struct DerivativeKernel<'a, M, const D: usize> {
    material: &'a M,
    f: &'a [Block<D>],
    df: &'a mut [Block<D>],
    work: Option<&'a mut [[f64; WIDTH]]>,
}

impl<M: Material<D>, const D: usize> Kernel for DerivativeKernel<'_, M, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let mut work = self.work.into_iter().flatten();
        for (f, df) in self.f.iter().zip(self.df) {
            let along = df.load::<L>();
            let stress = if L::BY_LANE {
                let mut stress = Block::ZERO;
                for l in 0..WIDTH {
                    let (p, dp) = stress_along(self.material, &f.lane(l), &df.lane(l));
                    stress.set_lane(l, &p);
                    df.set_lane(l, &dp);
                }
                stress.load::<L>()
            } else {
                let (p, dp) = Dual::parts(&self.material.pk1(&Dual::along(&f.load::<L>(), &along)));
                df.store(&dp);
                p
            };
            if let Some(work) = work.next() {
                stress.dot(&along).store(work);
            }
        }
    }
}

struct DensityKernel<'a, M, const D: usize> {
    material: &'a M,
    f: &'a [Block<D>],
    psi: &'a mut [[f64; WIDTH]],
}

impl<M: Material<D>, const D: usize> DensityKernel<'_, M, D> {
    #[inline(never)]
    fn of_lane(material: &M, f: &Mat<f64, D>) -> f64 {
        material.psi(f)
    }
}

impl<M: Material<D>, const D: usize> Kernel for DensityKernel<'_, M, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (f, psi) in self.f.iter().zip(self.psi) {
            if L::BY_LANE {
                for l in 0..WIDTH {
                    psi[l] = Self::of_lane(self.material, &f.lane(l));
                }
            } else {
                self.material.psi(&f.load::<L>()).store(psi);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::tests::sample::Random;
    use crate::lanes::{InstructionSet, dispatch_at};
    use crate::material::{Corotated, Isotropic, Model, Parameters};

    /// Returns the bits of `P` of `count` blocks, the same blocks each time.
    fn stress(level: InstructionSet, count: usize) -> Vec<u64> {
        let (mut random, material) = (Random(8), Corotated::new(&Isotropic::example()));
        let mut blocks = vec![Block::<3>::ZERO; count];
        for block in &mut blocks {
            (0..WIDTH).for_each(|lane| block.set_lane(lane, &random.rotation::<3>().scale(1.1)));
            block.0[0][1][3] += 0.2;
        }
        dispatch_at(level, StressKernel::<_, 3, false> { material: &material, f: &mut blocks });
        blocks
            .iter()
            .flat_map(|block| block.0.as_flattened().as_flattened().iter().map(|x| x.to_bits()))
            .collect()
    }

    /// An even and an odd number of blocks.
    #[test]
    fn stresses_have_the_same_bits_on_every_level_for_any_number_of_blocks() {
        for count in 1..=5 {
            let expected = stress(InstructionSet::Portable, count);
            assert!(expected.iter().any(|&bits| f64::from_bits(bits) != 0.0));
            for level in InstructionSet::ALL {
                assert_eq!(stress(level, count), expected, "{level:?}, {count} blocks");
            }
        }
    }
}
