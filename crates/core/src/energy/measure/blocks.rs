//! Second derivatives, stencil by stencil, for implicit schemes.

use std::ops::Range;

use super::{MeasuredStencils, ScalarStrain};
use crate::algebra::{Dual, PackedMatrix, project_positive_packed};
use crate::lanes::{Kernel, Lanes, WIDTH, dispatch, spread};
use crate::material::Psd;

/// Output for each stencil.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MatrixOutput {
    /// `k (grad s grad s^T + (s - s_0) grad grad s)`, by dual numbers; projected without its negative
    /// eigenvalues, or by what bounds it in closed form. What is left of it by `k grad s grad s^T` alone
    /// would not do: a joint that is bent resists being turned out of its plane by the second part only.
    Hessian(Psd),
    /// `k grad s grad s^T`: the damping matrix of a dashpot.
    Rate,
}

/// Writes the blocks of the pairs `a <= b` of these stencils, by rows.
pub(crate) fn fill<Q: ScalarStrain<D, N>, const D: usize, const N: usize>(
    stencils: &MeasuredStencils<Q, D, N>,
    range: Range<usize>,
    x: &[f64],
    blocks: MatrixOutput,
    out: &mut [f64],
) {
    dispatch(StencilBlocksKernel { stencils, range, x, blocks, out });
}

/// The blocks of a range of lanes, pack by pack.
struct StencilBlocksKernel<'a, Q, const D: usize, const N: usize> {
    stencils: &'a MeasuredStencils<Q, D, N>,
    range: Range<usize>,
    x: &'a [f64],
    blocks: MatrixOutput,
    out: &'a mut [f64],
}

/// `M` and its inverse, `M` the symmetric root of `I + 1 1^T` of `n x n`: `I + alpha 1 1^T` and
/// `I - beta 1 1^T`; `(alpha, beta)`.
#[inline(always)]
fn root_constants(n: usize) -> (f64, f64) {
    let n = n as f64;
    let alpha = ((1.0 + n).sqrt() - 1.0) / n;
    (alpha, alpha / (1.0 + alpha * n))
}

/// `(I + factor 1 1^T) A (I + factor 1 1^T)`, where `1 1^T` adds up the coordinates of `n` points: rows and
/// columns `D a + i` with the same `i`.
#[inline(always)]
fn congruent<L: Lanes, const D: usize>(matrix: &mut PackedMatrix<L>, n: usize, factor: f64) {
    let factor = L::splat(factor);
    for row in 0..n * D {
        for i in 0..D {
            let mut sum = L::zero();
            for a in 0..n {
                sum += matrix[row][a * D + i];
            }
            for a in 0..n {
                matrix[row][a * D + i] = factor.mul_add(sum, matrix[row][a * D + i]);
            }
        }
    }
    for column in 0..n * D {
        for i in 0..D {
            let mut sum = L::zero();
            for a in 0..n {
                sum += matrix[a * D + i][column];
            }
            for a in 0..n {
                matrix[a * D + i][column] = factor.mul_add(sum, matrix[a * D + i][column]);
            }
        }
    }
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize> StencilBlocksKernel<'_, Q, D, N> {
    /// Writes `grad s grad s^T + (s - s_0) grad grad s` by the places of all points but the first, or its
    /// first part alone. The rest follows, for translations change nothing.
    #[inline(always)]
    fn write_matrix<L: Lanes>(&self, x: &[[L; D]; N], rest: &[L; 2], matrix: &mut PackedMatrix<L>) {
        if self.blocks == MatrixOutput::Rate {
            let (_, gradient) = Q::deviation(x, rest);
            for row in 0..(N - 1) * D {
                for column in 0..(N - 1) * D {
                    matrix[row][column] =
                        gradient[1 + row / D][row % D] * gradient[1 + column / D][column % D];
                }
            }
            return;
        }
        if self.blocks == MatrixOutput::Hessian(Psd::Projected)
            && let Some(parts) = Q::positive_parts(x, rest)
        {
            for row in 0..(N - 1) * D {
                for column in row..(N - 1) * D {
                    let mut sum = L::zero();
                    for part in &parts {
                        sum = part[1 + row / D][row % D].mul_add(part[1 + column / D][column % D], sum);
                    }
                    (matrix[row][column], matrix[column][row]) = (sum, sum);
                }
            }
            return;
        }
        let mut along = [[Dual::constant(L::zero()); D]; N];
        for node in 0..N {
            for c in 0..D {
                along[node][c] = Dual::constant(x[node][c]);
            }
        }
        let rest = [Dual::constant(rest[0]), Dual::constant(rest[1])];
        for column in 0..(N - 1) * D {
            let (b, l) = (1 + column / D, column % D);
            along[b][l].derivative = L::one();
            let (s, gradient) = Q::deviation(&along, &rest);
            along[b][l].derivative = L::zero();
            for row in 0..(N - 1) * D {
                let g = gradient[1 + row / D][row % D];
                matrix[row][column] = s.derivative.mul_add(g.value, s.value * g.derivative);
            }
        }
        if self.blocks == MatrixOutput::Hessian(Psd::Projected) {
            // An orthonormal basis of what is no translation is `B^T M^-1`, `B` the differences to the first
            // point: the eigenvalues of `M A M` are those of the whole matrix but for zeros.
            let (there, back) = root_constants(N - 1);
            congruent::<L, D>(matrix, N - 1, there);
            project_positive_packed(matrix, (N - 1) * D);
            congruent::<L, D>(matrix, N - 1, -back);
        }
    }

    /// Writes the blocks of the pairs `a <= b` of all points by rows, times `stiffness`, one entry after the
    /// other.
    #[inline(always)]
    fn write_blocks<L: Lanes>(matrix: &PackedMatrix<L>, stiffness: L, entries: &mut [L]) {
        // Lanes that fill up have no stiffness.
        let counts = L::zero().lt(stiffness.abs());
        let mut next = 0;
        for a in 0..N {
            for b in a..N {
                for i in 0..D {
                    for l in 0..D {
                        let value = Self::entry(matrix, a, b, i, l);
                        entries[next] = L::select(counts, stiffness * value, L::zero());
                        next += 1;
                    }
                }
            }
        }
    }

    /// Entry `(i, l)` of the block of the points `a <= b`; those of the first make translations change
    /// nothing.
    #[inline(always)]
    fn entry<L: Lanes>(matrix: &PackedMatrix<L>, a: usize, b: usize, i: usize, l: usize) -> L {
        if a > 0 {
            return matrix[(a - 1) * D + i][(b - 1) * D + l];
        }
        if b > 0 {
            return -Self::sum_over_rows(matrix, b, i, l);
        }
        let mut sum = Self::sum_over_rows(matrix, 1, i, l);
        for b in 2..N {
            sum += Self::sum_over_rows(matrix, b, i, l);
        }
        sum
    }

    #[inline(always)]
    fn sum_over_rows<L: Lanes>(matrix: &PackedMatrix<L>, b: usize, i: usize, l: usize) -> L {
        let mut sum = matrix[i][(b - 1) * D + l];
        for a in 2..N {
            sum += matrix[(a - 1) * D + i][(b - 1) * D + l];
        }
        sum
    }
}

/// Rows of the largest matrix.
const MOST: usize = PackedMatrix::<f64>::ROWS;
/// Entries of the blocks of all pairs of points, at most: of four points in space.
const MOST_ENTRIES: usize = 10 * 9;

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize> Kernel for StencilBlocksKernel<'_, Q, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        const { assert!((N - 1) * D <= MOST && N * (N + 1) / 2 * D * D <= MOST_ENTRIES) };
        let per_stencil = N * (N + 1) / 2 * D * D;
        let packs = self.range.start / WIDTH..self.range.end.div_ceil(WIDTH);
        let mut lanes = self.stencils.patches.lanes_in(packs.start * WIDTH..packs.end * WIDTH);
        // Made once: every pack writes all entries anew.
        let (mut matrix, mut entries) = (PackedMatrix::<L>::default(), [L::zero(); MOST_ENTRIES]);
        let entries = &mut entries[..per_stencil];
        for pack in packs {
            let mut points = [[[0.0; WIDTH]; D]; N];
            for lane in 0..WIDTH {
                let Some((vertices, ..)) = lanes.next() else { break };
                for node in 0..N {
                    for c in 0..D {
                        points[node][c][lane] = self.x[vertices[node] as usize * D + c];
                    }
                }
            }
            let mut x = [[L::zero(); D]; N];
            for node in 0..N {
                for c in 0..D {
                    x[node][c] = L::load(&points[node][c]);
                }
            }
            let constants = &self.stencils.packs[pack];
            self.write_matrix::<L>(&x, &constants.rest(), &mut matrix);
            Self::write_blocks(&matrix, constants.stiffness(), entries);
            let first = pack * WIDTH;
            let stencils = self.range.start.max(first)..self.range.end.min(first + WIDTH);
            let out = &mut self.out[(stencils.start - self.range.start) * per_stencil..];
            spread(entries, stencils.start - first..stencils.end - first, out);
        }
    }
}
