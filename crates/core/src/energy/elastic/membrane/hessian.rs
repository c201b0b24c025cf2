//! The Hessians of triangles in space.
//!
//! With `F = U diag(sigma) V^T`, `U` of two columns in space and `n` normal to both, a change `dF` within
//! the plane of the triangle meets the tangent of the plane material, and one along the normal only turns
//! the triangle: `n v_j^T` is an eigenvector of `dP/dF` with eigenvalue `psi_j / sigma_j`, the tension. The
//! frame is that of the solid elements (`elastic/hessian.rs`).

use std::ops::Range;

use super::Membrane;
use super::kernels::factors;
use crate::algebra::{Dual, Mat, Svd, Vect, project_positive, signed_svd, symmetric_eigen};
use crate::element::{Tangents, cross};
use crate::energy::elastic::block::{Block, BlockMaterial, SpectrumBlock};
use crate::lanes::WIDTH;
use crate::material::Stress;
use crate::material::{Psd, Spectrum};

/// Blocks of the three pairs of two vertices after the first, and more.
const PAIRS: usize = 6;
const BLOCK: usize = 9;

/// Stretches of a sheet that every model of it has a state at.
const REST: Vect<f64, 2> = [1.0, 1.0];

/// Writes the Hessians of `stencils`: spectra of as many at a time as a pack has lanes.
pub(super) fn fill(sheet: &Membrane, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
    let has_spectrum = sheet.material.spectrum(&REST).is_some();
    let mut lanes = sheet.patches.lanes_in(stencils);
    for out in out.chunks_mut(WIDTH * PAIRS * BLOCK) {
        let mut states = [None; WIDTH];
        // Sheets that fill up are at rest.
        let mut sigma = [[1.0; WIDTH]; 2];
        // Lanes of the mesh last: none is taken for which there is no room.
        let room = states.iter_mut().take(out.len() / (PAIRS * BLOCK)).enumerate();
        for ((slot, state), (vertices, pack, lane)) in room.zip(lanes.by_ref()) {
            let f = sheet.deformation_gradient(x, &vertices, pack, lane);
            let (q, g) = factors(&f);
            let svd = signed_svd(&g);
            (sigma[0][slot], sigma[1][slot]) = (svd.sigma[0], svd.sigma[1]);
            *state = Some((sheet.rest[pack].lane(lane), f, q, svd));
        }
        let mut spectra = SpectrumBlock::ZERO;
        if has_spectrum {
            sheet.material.spectra(&sigma, &mut spectra);
        }
        let states = states.iter().flatten().enumerate();
        for ((lane, ((inverse_rest, weight), f, q, svd)), out) in
            states.zip(out.chunks_exact_mut(PAIRS * BLOCK))
        {
            if has_spectrum {
                let spectrum = Spectrum {
                    scaling: spectra.scaling.lane(lane),
                    twist: spectra.twist.lane(lane),
                    flip: spectra.flip.lane(lane),
                };
                let frame = TangentFrame::new(&spectrum, &svd.sigma, psd);
                write_in_frame(&frame, q, svd, inverse_rest, *weight, out);
            } else {
                let tangent = tangent(sheet.material.as_ref(), f, psd);
                write_blocks(&tangent, *weight, &gradients(inverse_rest), out);
            }
        }
    }
}

/// Writes the blocks of one triangle by its tangent in the frame of `U`, `n` and `V`.
fn write_in_frame(
    frame: &TangentFrame,
    q: &Tangents<f64, 3, 2>,
    svd: &Svd<f64, 2>,
    inverse_rest: &Mat<f64, 2>,
    weight: f64,
    out: &mut [f64],
) {
    // The columns of U = Q U_2, and the normal.
    let column = |j: usize| [0, 1, 2].map(|i| q[i][0] * svd.u[0][j] + q[i][1] * svd.u[1][j]);
    let (u, v) = (column(0), column(1));
    let axes = [u, v, cross(u, v)];
    // In the frame of V.
    let gradient = gradients(&inverse_rest.mul(&svd.v));
    let mut blocks = out.chunks_exact_mut(BLOCK);
    for a in 0..3 {
        for b in a..3 {
            let block = blocks.next().expect("a block for each pair");
            let local = frame.block(&gradient[a], &gradient[b]);
            for i in 0..3 {
                for k in 0..3 {
                    let mut sum = 0.0;
                    for (r, row) in axes.iter().enumerate() {
                        for (c, col) in axes.iter().enumerate() {
                            sum += local[r][c] * row[i] * col[k];
                        }
                    }
                    block[3 * i + k] = weight * sum;
                }
            }
        }
    }
}

/// Rows: `grad N_a`, that of the first vertex minus the sum of the others.
fn gradients(others: &Mat<f64, 2>) -> [[f64; 2]; 3] {
    let mut gradient = [[0.0; 2]; 3];
    for j in 0..2 {
        (gradient[1][j], gradient[2][j]) = (others[0][j], others[1][j]);
        gradient[0][j] = -others[0][j] - others[1][j];
    }
    gradient
}

/// Numbers of `F`, 3 x 2.
const ENTRIES: usize = 6;

/// `dP_ij / dF_kl` of a material without a spectrum, `(2 i + j, 2 k + l)` by rows: `dP = dQ P_2 + Q dP_2`
/// along each entry of `F = Q G`.
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

/// `P_2(G)`.
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
struct TangentFrame {
    scaling: Mat<f64, 2>,
    same: f64,
    swapped: f64,
    /// Tension along the two stretches.
    tension: [f64; 2],
}

impl TangentFrame {
    fn new(spectrum: &Spectrum<2>, sigma: &Vect<f64, 2>, psd: Psd) -> Self {
        let clamp = |e: f64| if psd == Psd::Projected && e < 0.0 { 0.0 } else { e };
        // twist = (psi_0 + psi_1)/(sigma_0 + sigma_1), flip = (psi_0 - psi_1)/(sigma_0 - sigma_1)
        let (sum, difference) =
            (spectrum.twist[0][1] * (sigma[0] + sigma[1]), spectrum.flip[0][1] * (sigma[0] - sigma[1]));
        let slopes = [0.5 * (sum + difference), 0.5 * (sum - difference)];
        let (twist, flip) = (clamp(spectrum.twist[0][1]), clamp(spectrum.flip[0][1]));
        let mut scaling = spectrum.scaling;
        if psd == Psd::Projected {
            let (lambda, vectors) = symmetric_eigen(&scaling);
            if lambda.iter().any(|e| *e < 0.0) {
                scaling = vectors.transpose_mul(&Mat::diagonal(&lambda.map(clamp))).mul(&vectors);
            }
        }
        TangentFrame {
            scaling,
            same: 0.5 * (flip + twist),
            swapped: 0.5 * (flip - twist),
            tension: [0, 1].map(|j| clamp(slopes[j] / sigma[j])),
        }
    }

    fn block(&self, a: &[f64; 2], b: &[f64; 2]) -> [[f64; 3]; 3] {
        let mut k = [[0.0; 3]; 3];
        for i in 0..2 {
            let j = 1 - i;
            k[i][i] = self.scaling[i][i] * a[i] * b[i] + self.same * a[j] * b[j];
            k[i][j] = self.scaling[i][j] * a[i] * b[j] + self.swapped * a[j] * b[i];
            k[2][2] += self.tension[i] * a[i] * b[i];
        }
        k
    }
}
