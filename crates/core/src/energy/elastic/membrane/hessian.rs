//! Hessians of triangles in space.
//!
//! With `F = U diag(sigma) V^T`, two columns of `U` in space and `n` normal to both, a change `dF` in the
//! plane of the triangle is governed by the tangent of the plane material. A change along the normal only
//! rotates the triangle: `n v_j^T` is an eigenvector of `dP/dF` with the tension `psi_j / sigma_j` as
//! eigenvalue. The frame is that of the solid elements (`elastic/hessian.rs`).

use std::ops::Range;

use super::Membrane;
use super::kernels::factors;
use crate::algebra::{Dual, Mat, Vect, project_positive, signed_svd, symmetric_eigen_of_lanes};
use crate::element::Tangents;
use crate::energy::elastic::block::{Block, BlockMaterial, SpectrumBlock};
use crate::lanes::{Kernel, Lanes, WIDTH, dispatch};
use crate::material::{Psd, Stress};
use crate::scalar::Scalar;

/// Number of pairs of vertices of a triangle, and numbers in the block of a pair.
const PAIRS: usize = 6;
const BLOCK: usize = 9;

/// Stretches of a sheet at which every model has a state.
const REST: Vect<f64, 2> = [1.0, 1.0];

/// Writes the Hessians of `stencils`, as many at a time as a pack has lanes.
pub(super) fn fill(sheet: &Membrane, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
    let has_spectrum = sheet.material.spectrum(&REST).is_some();
    let mut lanes = sheet.elements.patches.lanes_in(stencils);
    for out in out.chunks_mut(WIDTH * PAIRS * BLOCK) {
        let mut triangles = Triangles::AT_REST;
        // The lanes of the mesh come second in `zip`: no lane is consumed without room for it.
        let room = out.chunks_exact_mut(PAIRS * BLOCK).enumerate();
        for ((slot, out), (vertices, pack, lane)) in room.zip(lanes.by_ref()) {
            let Some((f, inverse_rest, weight)) = sheet.elements.at_points(x, &vertices, (pack, lane)).next()
            else {
                continue;
            };
            if has_spectrum {
                triangles.set(slot, &f, &inverse_rest, weight);
            } else {
                let tangent = tangent(sheet.material.as_ref(), &f, psd);
                write_blocks(&tangent, weight, &gradients(&inverse_rest), out);
            }
        }
        if has_spectrum {
            let (mut frames, mut spectra) = (StretchFrames::ZERO, SpectrumBlock::ZERO);
            dispatch(StretchKernel { triangles: &triangles, frames: &mut frames });
            sheet.material.spectra(&frames.sigma, &mut spectra);
            dispatch(BlocksKernel { triangles: &triangles, frames: &frames, spectra: &spectra, psd, out });
        }
    }
}

/// Triangles, one in each lane; padding lanes are undeformed and have no weight.
struct Triangles {
    /// `F`, `[row][column][lane]`.
    f: [[[f64; WIDTH]; 2]; 3],
    inverse_rest: Block<2>,
    weight: [f64; WIDTH],
}

impl Triangles {
    const AT_REST: Self = Triangles {
        f: [[[1.0; WIDTH], [0.0; WIDTH]], [[0.0; WIDTH], [1.0; WIDTH]], [[0.0; WIDTH]; 2]],
        inverse_rest: Block::ZERO,
        weight: [0.0; WIDTH],
    };

    fn set(&mut self, lane: usize, f: &Tangents<f64, 3, 2>, inverse_rest: &Mat<f64, 2>, weight: f64) {
        for i in 0..3 {
            for j in 0..2 {
                self.f[i][j][lane] = f[i][j];
            }
        }
        self.inverse_rest.set_lane(lane, inverse_rest);
        self.weight[lane] = weight;
    }
}

/// Decomposition of the `F` of each lane.
struct StretchFrames {
    /// Columns of `U`, and the normal, `[axis][row][lane]`.
    axes: [[[f64; WIDTH]; 3]; 3],
    sigma: [[f64; WIDTH]; 2],
    v: Block<2>,
}

impl StretchFrames {
    const ZERO: Self =
        StretchFrames { axes: [[[0.0; WIDTH]; 3]; 3], sigma: [[0.0; WIDTH]; 2], v: Block::ZERO };
}

/// Decomposes `F = Q G` of packs of triangles, by the decomposition of `G`.
struct StretchKernel<'a> {
    triangles: &'a Triangles,
    frames: &'a mut StretchFrames,
}

impl Kernel for StretchKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let mut f = [[L::zero(); 2]; 3];
        for i in 0..3 {
            for j in 0..2 {
                f[i][j] = L::load(&self.triangles.f[i][j]);
            }
        }
        let (q, g) = factors(&f);
        let svd = signed_svd(&g);
        let mut columns = [[L::zero(); 3]; 2];
        for j in 0..2 {
            for i in 0..3 {
                columns[j][i] = q[i][0] * svd.u[0][j] + q[i][1] * svd.u[1][j];
            }
            svd.sigma[j].store(&mut self.frames.sigma[j]);
        }
        let [u, v] = columns;
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        for (axis, out) in [columns[0], columns[1], normal].iter().zip(&mut self.frames.axes) {
            for i in 0..3 {
                axis[i].store(&mut out[i]);
            }
        }
        self.frames.v.store(&svd.v);
    }
}

/// Writes the blocks of packs of triangles from their tangents in the frame of `U`, `n` and `V`.
struct BlocksKernel<'a> {
    triangles: &'a Triangles,
    frames: &'a StretchFrames,
    spectra: &'a SpectrumBlock<2>,
    psd: Psd,
    /// Room for the blocks, possibly of fewer triangles than lanes.
    out: &'a mut [f64],
}

impl Kernel for BlocksKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let BlocksKernel { triangles, frames, spectra, psd, out } = self;
        let sigma = [L::load(&frames.sigma[0]), L::load(&frames.sigma[1])];
        let frame = TangentFrame::new(spectra, &sigma, psd);
        // Axes of the frame: the columns of U, and the normal.
        let mut axes = [[L::zero(); 3]; 3];
        for (axis, from) in axes.iter_mut().zip(&frames.axes) {
            for i in 0..3 {
                axis[i] = L::load(&from[i]);
            }
        }
        // In the frame of V.
        let gradient = gradients(&triangles.inverse_rest.load::<L>().mul(&frames.v.load::<L>()));
        let weight = L::load(&triangles.weight);
        let mut entries = [[0.0; WIDTH]; PAIRS * BLOCK];
        let mut blocks = entries.as_chunks_mut::<BLOCK>().0.iter_mut();
        // Blocks in the frame, rotated to space.
        for a in 0..3 {
            for b in a..3 {
                let Some(block) = blocks.next() else { return };
                let (plane, tension) = frame.block(&gradient[a], &gradient[b]);
                for i in 0..3 {
                    let mut along = [L::zero(); 2];
                    for c in 0..2 {
                        along[c] = weight * plane[1][c].mul_add(axes[1][i], plane[0][c] * axes[0][i]);
                    }
                    let across = weight * (tension * axes[2][i]);
                    for k in 0..3 {
                        let sum = along[1].mul_add(axes[1][k], along[0] * axes[0][k]);
                        across.mul_add(axes[2][k], sum).store(&mut block[3 * i + k]);
                    }
                }
            }
        }
        // One triangle after another, as many as there is room for.
        for (lane, out) in out.chunks_exact_mut(PAIRS * BLOCK).enumerate() {
            for (out, entry) in out.iter_mut().zip(&entries) {
                *out = entry[lane];
            }
        }
    }
}

/// Returns `grad N_a` in rows; that of the first vertex is minus the sum of the others.
#[inline(always)]
fn gradients<S: Scalar>(others: &Mat<S, 2>) -> [[S; 2]; 3] {
    let mut gradient = [[S::zero(); 2]; 3];
    for j in 0..2 {
        (gradient[1][j], gradient[2][j]) = (others[0][j], others[1][j]);
        gradient[0][j] = -others[0][j] - others[1][j];
    }
    gradient
}

/// Number of entries of `F`, 3 x 2.
const ENTRIES: usize = 6;

/// Returns `dP_ij / dF_kl` of a material without a spectrum, `(2 i + j, 2 k + l)` by rows:
/// `dP = dQ P_2 + Q dP_2` along each entry of `F = Q G`.
fn tangent(material: &dyn BlockMaterial<2>, f: &Tangents<f64, 3, 2>, psd: Psd) -> Vec<f64> {
    let g = factors(f).1;
    let (stress, plane) = (stress_at(material, &g), material.tangent(&g, Psd::Exact));
    let mut matrix = vec![0.0; ENTRIES * ENTRIES];
    for kl in 0..ENTRIES {
        let mut along = f.map(|row| row.map(Dual::constant));
        along[kl / 2][kl % 2].derivative = 1.0;
        let (q, g) = factors(&along);
        let change = plane.apply(&Dual::parts(&g).1);
        for ij in 0..ENTRIES {
            let (row, j) = (&q[ij / 2], ij % 2);
            let along = (0..2).map(|m| row[m].derivative * stress[m][j] + row[m].value * change[m][j]);
            matrix[ij * ENTRIES + kl] = along.sum();
        }
    }
    if psd == Psd::Projected {
        project_positive(&mut matrix, ENTRIES);
    }
    matrix
}

/// Returns `P_2(G)`.
fn stress_at(material: &dyn BlockMaterial<2>, g: &Mat<f64, 2>) -> Mat<f64, 2> {
    let mut block = [Block::ZERO];
    (0..WIDTH).for_each(|lane| block[0].set_lane(lane, g));
    material.stress(Stress::Analytic, &mut block);
    block[0].lane(0)
}

/// Writes the blocks `w C_ijkl (grad N_a)_j (grad N_b)_l`.
fn write_blocks(tangent: &[f64], weight: f64, gradient: &[[f64; 2]; 3], out: &mut [f64]) {
    let pairs = (0..3).flat_map(|a| (a..3).map(move |b| (a, b)));
    for ((a, b), block) in pairs.zip(out.chunks_exact_mut(BLOCK)) {
        for (ik, entry) in block.iter_mut().enumerate() {
            let of = |j: usize, l: usize| tangent[(2 * (ik / 3) + j) * ENTRIES + 2 * (ik % 3) + l];
            let terms = (0..4).map(|jl| of(jl / 2, jl % 2) * gradient[a][jl / 2] * gradient[b][jl % 2]);
            *entry = weight * terms.sum::<f64>();
        }
    }
}

/// `dP/dF` in the frame of `U`, `n` and `V`.
struct TangentFrame<S> {
    scaling: Mat<S, 2>,
    same: S,
    swapped: S,
    /// Tension along the two stretches.
    tension: [S; 2],
}

/// Returns an eigenvalue, or zero instead of a negative one if `projected`. This is no closure, because
/// closures on lanes are outlined without the instructions of their caller.
#[inline(always)]
fn clamp<L: Lanes>(eigenvalue: L, projected: bool) -> L {
    if projected { L::select(eigenvalue.lt(L::zero()), L::zero(), eigenvalue) } else { eigenvalue }
}

impl<L: Lanes> TangentFrame<L> {
    #[inline(always)]
    fn new(spectra: &SpectrumBlock<2>, sigma: &[L; 2], psd: Psd) -> Self {
        let projected = psd == Psd::Projected;
        let (twist, flip) = (L::load(spectra.twist.entry(0, 1)), L::load(spectra.flip.entry(0, 1)));
        // twist = (psi_0 + psi_1)/(sigma_0 + sigma_1), flip = (psi_0 - psi_1)/(sigma_0 - sigma_1)
        let (sum, difference) = (twist * (sigma[0] + sigma[1]), flip * (sigma[0] - sigma[1]));
        let half = L::splat(0.5);
        let slopes = [half * (sum + difference), half * (sum - difference)];
        let (twist, flip) = (clamp(twist, projected), clamp(flip, projected));
        let mut scaling = spectra.scaling.load::<L>();
        if projected {
            let (lambda, vectors) = symmetric_eigen_of_lanes(&scaling);
            let diagonal = Mat::diagonal(&[clamp(lambda[0], projected), clamp(lambda[1], projected)]);
            scaling = vectors.transpose_mul(&diagonal).mul(&vectors);
        }
        TangentFrame {
            scaling,
            same: half * (flip + twist),
            swapped: half * (flip - twist),
            tension: [clamp(slopes[0] / sigma[0], projected), clamp(slopes[1] / sigma[1], projected)],
        }
    }

    /// Returns the block in the plane and the entry along the normal.
    #[inline(always)]
    fn block(&self, a: &[L; 2], b: &[L; 2]) -> ([[L; 2]; 2], L) {
        let mut plane = [[L::zero(); 2]; 2];
        for i in 0..2 {
            let j = 1 - i;
            plane[i][i] = self.scaling[i][i] * a[i] * b[i] + self.same * a[j] * b[j];
            plane[i][j] = self.scaling[i][j] * a[i] * b[j] + self.swapped * a[j] * b[i];
        }
        (plane, self.tension[0] * a[0] * b[0] + self.tension[1] * a[1] * b[1])
    }
}
