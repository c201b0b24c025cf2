//! Plane stress for every material, from the stretch across the sheet that leaves its faces free.

use crate::algebra::{Mat, Vect, signed_svd};
use crate::element::ElementState;
use crate::energy::elastic::block::{Block, BlockMaterial, SpectrumBlock};
use crate::energy::elastic::kinematics::BLOCKS;
use crate::lanes::{Kernel, Lanes, WIDTH, dispatch};
use crate::material::Stress;
use crate::material::{Domain, Psd, Spectrum, Tangent};
use crate::scalar::{Mask, Scalar};

/// Relative change of the thickness below which one more Newton step is exact to rounding.
const CLOSE: f64 = 1e-8;

/// Iteration limit; from the first guess Newton takes two to four steps at strains of a few tenths.
const MOST_STEPS: usize = 40;

/// A three-dimensional material as that of a sheet: `psi(G) = min psi_3(G + s e_3 e_3^T)` over the
/// stretch `s` across it, where `P_33 = 0`. Stress and derivative are those of the minimum:
/// `dP = dP_3 : (dG + ds e_3 e_3^T)`, with `ds` such that `dP_33 = 0`.
///
/// If there is no such stretch, the sheet bears no load at any thickness, and all results are not finite.
pub(super) struct PlaneStress {
    solid: Box<dyn BlockMaterial<3>>,
    /// Ratio `nu / (1 - nu)`: the stretch across of a Hencky material is `det G` to the power of minus
    /// this.
    narrowing: f64,
}

/// Solid state of up to `B` blocks.
struct Solved<const B: usize> {
    /// `F` with the stretch across.
    f: [Block<3>; B],
    /// `P` at `f`.
    stress: [Block<3>; B],
}

impl PlaneStress {
    /// Creates the material of a sheet from `solid`. The closer `narrowing` is to the ratio
    /// `lambda / (lambda + 2 mu)` of its Lame parameters, the better is the first guess.
    pub(super) fn new(solid: Box<dyn BlockMaterial<3>>, narrowing: f64) -> Self {
        PlaneStress { solid, narrowing }
    }

    /// Solves `P_33 = 0` by Newton's method, lane by lane: lanes do not depend on their neighbours.
    fn solve<const B: usize>(&self, how: Stress, sheet: &[Block<2>]) -> Solved<B> {
        let n = sheet.len();
        let mut f = [Block::ZERO; B];
        dispatch(GuessKernel { sheet, narrowing: self.narrowing, solid: &mut f[..n] });
        let (mut stress, mut slope) = ([Block::ZERO; B], [Block::ZERO; B]);
        for round in 0..MOST_STEPS {
            stress[..n].copy_from_slice(&f[..n]);
            self.solid.stress(how, &mut stress[..n]);
            slope[..n].fill(across());
            self.solid.derivative(&f[..n], &mut slope[..n], None);
            let (f, stress, slope) = (&mut f[..n], &stress[..n], &slope[..n]);
            if round + 1 == MOST_STEPS || dispatch(AcrossKernel { f, stress, slope }) {
                break;
            }
        }
        dispatch(LastStepKernel { f: &mut f[..n], stress: &mut stress[..n], slope: &slope[..n] });
        Solved { f, stress }
    }

    /// Returns the state of one sheet.
    fn one(&self, g: &Mat<f64, 2>) -> Mat<f64, 3> {
        let mut block = Block::ZERO;
        for l in 0..WIDTH {
            block.set_lane(l, g);
        }
        self.solve::<1>(Stress::Analytic, &[block]).f[0].lane(0)
    }
}

/// Writes the states of sheets with the stretch across of a Hencky material.
struct GuessKernel<'a> {
    sheet: &'a [Block<2>],
    narrowing: f64,
    solid: &'a mut [Block<3>],
}

impl Kernel for GuessKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (solid, sheet) in self.solid.iter_mut().zip(self.sheet) {
            let g = sheet.load::<L>();
            solid.store(&in_space(&g, g.determinant().powf(L::splat(-self.narrowing))));
        }
    }
}

/// Returns the step `-P_33 / C_3333` of the stretch across, and whether it is the last.
#[inline(always)]
fn step_across<L: Lanes>(old: L, stress: &Block<3>, slope: &Block<3>) -> (L, L::Mask) {
    let (p, k) = (L::load(stress.entry(2, 2)), L::load(slope.entry(2, 2)));
    let step = -p / k;
    // Where the energy is not convex, go downhill.
    let downhill = -old.copysign(p);
    let is_convex = L::zero().lt(k);
    let close = step.abs().lt(L::splat(CLOSE) * old) & is_convex;
    (L::select(is_convex, step, downhill), close)
}

/// Changes the stretches across of the lanes that are not close yet; returns true if all are.
struct AcrossKernel<'a> {
    f: &'a mut [Block<3>],
    stress: &'a [Block<3>],
    slope: &'a [Block<3>],
}

impl Kernel for AcrossKernel<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let mut all_close = true;
        for (f, (stress, slope)) in self.f.iter_mut().zip(self.stress.iter().zip(self.slope)) {
            let old = L::load(f.entry(2, 2));
            let (step, close) = step_across(old, stress, slope);
            let (new, least, most) = (old + step, L::splat(0.5) * old, L::splat(2.0) * old);
            // The stretch stays positive and changes by at most a factor of two at once.
            let new = L::select(new.lt(least), least, new);
            let new = L::select(most.lt(new), most, new);
            L::select(close, old, new).store(f.entry_mut(2, 2));
            all_close &= !L::zero().lt(L::select(close, L::zero(), L::one())).any();
        }
        all_close
    }
}

/// Takes the last step, to first order; the result is not finite if the step is not small.
struct LastStepKernel<'a> {
    f: &'a mut [Block<3>],
    stress: &'a mut [Block<3>],
    slope: &'a [Block<3>],
}

impl Kernel for LastStepKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (f, (stress, slope)) in self.f.iter_mut().zip(self.stress.iter_mut().zip(self.slope)) {
            let old = L::load(f.entry(2, 2));
            let (step, close) = step_across(old, stress, slope);
            let step = L::select(close, step, L::splat(f64::NAN));
            (old + step).store(f.entry_mut(2, 2));
            stress.store(&slope.load::<L>().scale_add(step, &stress.load()));
        }
    }
}

impl BlockMaterial<2> for PlaneStress {
    /// Eliminates the stretch across from the solid's spectrum: it follows the others by `P_33 = 0`.
    fn spectrum(&self, sigma: &Vect<f64, 2>) -> Option<Spectrum<2>> {
        let across = self.one(&Mat::diagonal(sigma))[2][2];
        let solid = self.solid.spectrum(&[sigma[0], sigma[1], across])?;
        let mut flat = Spectrum { scaling: Mat::zero(), twist: Mat::zero(), flip: Mat::zero() };
        flat.scaling = eliminated(&solid.scaling);
        flat.twist[0][1] = solid.twist[0][1];
        flat.flip[0][1] = solid.flip[0][1];
        Some(flat)
    }

    fn spectra(&self, sigma: &[[f64; WIDTH]; 2], out: &mut SpectrumBlock<2>) {
        let mut sheet = Block::ZERO;
        for i in 0..2 {
            *sheet.entry_mut(i, i) = sigma[i];
        }
        let across = *self.solve::<1>(Stress::Analytic, &[sheet]).f[0].entry(2, 2);
        let mut solid = SpectrumBlock::ZERO;
        self.solid.spectra(&[sigma[0], sigma[1], across], &mut solid);
        for lane in 0..WIDTH {
            out.scaling.set_lane(lane, &eliminated(&solid.scaling.lane(lane)));
        }
        *out.twist.entry_mut(0, 1) = *solid.twist.entry(0, 1);
        *out.flip.entry_mut(0, 1) = *solid.flip.entry(0, 1);
    }

    /// Returns `C_ijkl - C_ij33 C_33kl / C_3333` of the solid's tangent, from `ds` such that `dP_33 = 0`.
    fn tangent(&self, f: &Mat<f64, 2>, psd: Psd) -> Tangent<2> {
        let svd = signed_svd(f);
        if let Some(spectrum) = self.spectrum(&svd.sigma) {
            return spectrum.tangent(&svd, psd);
        }
        let solid = self.solid.tangent(&self.one(f), Psd::Exact).0;
        let mut flat = Tangent::zero();
        for i in 0..2 {
            for j in 0..2 {
                for k in 0..2 {
                    for l in 0..2 {
                        let follows = solid[i][j][2][2] * solid[2][2][k][l] / solid[2][2][2][2];
                        flat.0[i][j][k][l] = solid[i][j][k][l] - follows;
                    }
                }
            }
        }
        if psd == Psd::Projected { flat.projected() } else { flat }
    }

    fn domain(&self) -> Domain {
        self.solid.domain()
    }

    fn stress(&self, how: Stress, f: &mut [Block<2>]) {
        for f in f.chunks_mut(BLOCKS) {
            let Solved { stress, .. } = self.solve::<BLOCKS>(how, f);
            for (f, p) in f.iter_mut().zip(&stress) {
                flatten(p, f);
            }
        }
    }

    fn derivative(&self, f: &[Block<2>], df: &mut [Block<2>], _: Option<&mut [[f64; WIDTH]]>) -> bool {
        for (f, df) in f.chunks(BLOCKS).zip(df.chunks_mut(BLOCKS)) {
            let n = f.len();
            let Solved { f, .. } = self.solve::<BLOCKS>(Stress::Analytic, f);
            let (mut along, mut slope) = ([Block::ZERO; BLOCKS], [across(); BLOCKS]);
            for (along, df) in along.iter_mut().zip(&*df) {
                for l in 0..WIDTH {
                    along.set_lane(l, &in_space(&df.lane(l), 0.0));
                }
            }
            self.solid.derivative(&f[..n], &mut along[..n], None);
            self.solid.derivative(&f[..n], &mut slope[..n], None);
            for b in 0..n {
                for l in 0..WIDTH {
                    let (p, k) = (along[b].lane(l), slope[b].lane(l));
                    along[b].set_lane(l, &k.scale_add(-p[2][2] / k[2][2], &p));
                }
                flatten(&along[b], &mut df[b]);
            }
        }
        false
    }

    fn density(&self, f: &[Block<2>], psi: &mut [[f64; WIDTH]]) {
        for (f, psi) in f.chunks(BLOCKS).zip(psi.chunks_mut(BLOCKS)) {
            let Solved { f, .. } = self.solve::<BLOCKS>(Stress::Analytic, f);
            self.solid.density(&f[..psi.len()], psi);
        }
    }

    fn is_at_fault(&self, f: &Mat<f64, 2>) -> bool {
        let solved = self.one(f);
        !solved[2][2].is_finite() || self.solid.is_at_fault(&solved)
    }

    fn state(&self, f: &Mat<f64, 2>) -> ElementState {
        self.solid.state(&self.one(f))
    }
}

/// Returns second derivatives by two stretches if the third follows them: `C_ij - C_i3 C_3j / C_33`.
fn eliminated(solid: &Mat<f64, 3>) -> Mat<f64, 2> {
    let mut flat = Mat::zero();
    for i in 0..2 {
        for j in 0..2 {
            flat[i][j] = solid[i][j] - solid[i][2] * solid[2][j] / solid[2][2];
        }
    }
    flat
}

/// Returns `G + s e_3 e_3^T`.
#[inline(always)]
fn in_space<S: Scalar>(g: &Mat<S, 2>, s: S) -> Mat<S, 3> {
    let mut f = Mat::zero();
    for i in 0..2 {
        f[i][..2].copy_from_slice(&g[i]);
    }
    f[2][2] = s;
    f
}

/// Returns `e_3 e_3^T` in every lane.
fn across() -> Block<3> {
    let mut block = Block::ZERO;
    for l in 0..WIDTH {
        block.set(2, 2, l, 1.0);
    }
    block
}

/// Copies the part in the plane.
fn flatten(solid: &Block<3>, sheet: &mut Block<2>) {
    for i in 0..2 {
        for j in 0..2 {
            *sheet.entry_mut(i, j) = *solid.entry(i, j);
        }
    }
}
