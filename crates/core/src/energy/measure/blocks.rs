//! Second derivatives, stencil by stencil, for implicit integrators.

use std::marker::PhantomData;
use std::ops::Range;

use super::kernels::{moving, rate};
use super::{MeasuredStencils, RateLaw, ScalarLaw, ScalarStrain};
use crate::algebra::{Dual, PackedMatrix, project_positive_packed};
use crate::lanes::{Kernel, Lanes, WIDTH, dispatch, spread};
use crate::material::Psd;

/// Matrix of one stencil with respect to the positions of all points but the first, which translation
/// invariance determines.
pub(crate) trait StencilMatrix<const D: usize, const N: usize> {
    /// True if the matrix depends on velocities.
    const BY_RATE: bool;

    /// Writes the matrix for stiffness 1, at `x` and the velocities `v`.
    fn write<L: Lanes>(&self, x: &[[L; D]; N], v: &[[L; D]; N], rest: &[L; 2], matrix: &mut PackedMatrix<L>);
}

/// Hessian `psi'' grad s grad s^T + psi' grad grad s`, by dual numbers; projected to its positive part, or to
/// a closed-form upper bound. The first term alone would not suffice: a bent joint resists being turned out
/// of its plane by the second term only.
pub(crate) struct HessianMatrix<'a, Q, W> {
    pub(crate) law: &'a W,
    pub(crate) psd: Psd,
    pub(crate) measure: PhantomData<Q>,
}

/// Damping matrix `R'' grad s grad s^T` of a dashpot.
pub(crate) struct DampingMatrix<'a, Q, R> {
    pub(crate) law: &'a R,
    pub(crate) measure: PhantomData<Q>,
}

/// Writes the blocks of the pairs `a <= b` of these stencils, by rows, at positions `x` and velocities `v`,
/// flat; `v` may be empty if the matrix does not depend on velocities.
pub(crate) fn fill<Q: ScalarStrain<D, N>, B: StencilMatrix<D, N>, const D: usize, const N: usize>(
    stencils: &MeasuredStencils<Q, D, N>,
    range: Range<usize>,
    (x, v): (&[f64], &[f64]),
    matrix: B,
    out: &mut [f64],
) {
    dispatch(StencilBlocksKernel { stencils, range, x, v, matrix, out });
}

/// Writes the blocks of a range of lanes, pack by pack.
struct StencilBlocksKernel<'a, Q, B, const D: usize, const N: usize> {
    stencils: &'a MeasuredStencils<Q, D, N>,
    range: Range<usize>,
    x: &'a [f64],
    v: &'a [f64],
    matrix: B,
    out: &'a mut [f64],
}

/// Returns `(alpha, beta)`: `M = I + alpha 1 1^T` is the symmetric square root of the `n x n` matrix
/// `I + 1 1^T`, and `I - beta 1 1^T` is the inverse of `M`.
#[inline(always)]
fn root_constants(n: usize) -> (f64, f64) {
    let n = n as f64;
    let alpha = ((1.0 + n).sqrt() - 1.0) / n;
    (alpha, alpha / (1.0 + alpha * n))
}

/// Replaces `A` by `(I + factor 1 1^T) A (I + factor 1 1^T)`, where `1 1^T` adds up the coordinates of
/// `n` points: rows and columns `D a + i` with the same `i`.
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

impl<Q: ScalarStrain<D, N>, R: RateLaw, const D: usize, const N: usize> StencilMatrix<D, N>
    for DampingMatrix<'_, Q, R>
{
    const BY_RATE: bool = !R::IS_SQUARE;

    #[inline(always)]
    fn write<L: Lanes>(&self, x: &[[L; D]; N], v: &[[L; D]; N], rest: &[L; 2], matrix: &mut PackedMatrix<L>) {
        let (s, gradient) = Q::deviation(x, &R::origin(rest));
        let constant = self.law.constant(rate(&gradient, v), s, rest);
        for row in 0..(N - 1) * D {
            for column in 0..(N - 1) * D {
                matrix[row][column] =
                    constant * (gradient[1 + row / D][row % D] * gradient[1 + column / D][column % D]);
            }
        }
    }
}

impl<Q: ScalarStrain<D, N>, W: ScalarLaw, const D: usize, const N: usize> StencilMatrix<D, N>
    for HessianMatrix<'_, Q, W>
{
    const BY_RATE: bool = false;

    #[inline(always)]
    fn write<L: Lanes>(&self, x: &[[L; D]; N], _: &[[L; D]; N], rest: &[L; 2], matrix: &mut PackedMatrix<L>) {
        if W::IS_SQUARE
            && self.psd == Psd::Projected
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
        let mut along = moving(x, &[[L::zero(); D]; N]);
        let rest = [Dual::constant(rest[0]), Dual::constant(rest[1])];
        let origin = W::origin(&rest);
        for column in 0..(N - 1) * D {
            let (b, l) = (1 + column / D, column % D);
            along[b][l].derivative = L::one();
            let (s, gradient) = Q::deviation(&along, &origin);
            let force = self.law.force(s, &rest);
            along[b][l].derivative = L::zero();
            for row in 0..(N - 1) * D {
                let g = gradient[1 + row / D][row % D];
                matrix[row][column] = force.derivative.mul_add(g.value, force.value * g.derivative);
            }
        }
        if self.psd == Psd::Projected {
            // `B^T M^-1` is an orthonormal basis of the complement of translations, with `B` the
            // differences to the first point: `M A M` has the eigenvalues of the whole matrix without its
            // zeros.
            let (there, back) = root_constants(N - 1);
            congruent::<L, D>(matrix, N - 1, there);
            project_positive_packed(matrix, (N - 1) * D);
            congruent::<L, D>(matrix, N - 1, -back);
        }
    }
}

impl<Q: ScalarStrain<D, N>, B: StencilMatrix<D, N>, const D: usize, const N: usize>
    StencilBlocksKernel<'_, Q, B, D, N>
{
    /// Writes the blocks of the pairs `a <= b` of all points by rows, times `stiffness`, one entry after
    /// the other.
    #[inline(always)]
    fn write_blocks<L: Lanes>(matrix: &PackedMatrix<L>, stiffness: L, entries: &mut [L]) {
        // Padding lanes have no stiffness.
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

    /// Returns entry `(i, l)` of the block of the points `a <= b`; translation invariance gives those of
    /// the first point.
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

/// Number of rows of the largest matrix.
const MOST: usize = PackedMatrix::<f64>::ROWS;
/// Maximum number of entries of the blocks of all pairs of points: four points in 3D.
const MOST_ENTRIES: usize = 10 * 9;

impl<Q: ScalarStrain<D, N>, B: StencilMatrix<D, N>, const D: usize, const N: usize> Kernel
    for StencilBlocksKernel<'_, Q, B, D, N>
{
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        const { assert!((N - 1) * D <= MOST && N * (N + 1) / 2 * D * D <= MOST_ENTRIES) };
        let per_stencil = N * (N + 1) / 2 * D * D;
        let packs = self.range.start / WIDTH..self.range.end.div_ceil(WIDTH);
        let mut lanes = self.stencils.patches.lanes_in(packs.start * WIDTH..packs.end * WIDTH);
        // Allocated once: every pack overwrites all entries.
        let (mut matrix, mut entries) = (PackedMatrix::<L>::default(), [L::zero(); MOST_ENTRIES]);
        let entries = &mut entries[..per_stencil];
        for pack in packs {
            let mut points = [[[[0.0; WIDTH]; D]; N]; 2];
            for lane in 0..WIDTH {
                let Some((vertices, ..)) = lanes.next() else { break };
                let rows = [self.x, self.v];
                for (points, rows) in points.iter_mut().zip(rows).take(1 + usize::from(B::BY_RATE)) {
                    for node in 0..N {
                        for c in 0..D {
                            points[node][c][lane] = rows[vertices[node] as usize * D + c];
                        }
                    }
                }
            }
            let mut places = [[[L::zero(); D]; N]; 2];
            for node in 0..N {
                for c in 0..D {
                    places[0][node][c] = L::load(&points[0][node][c]);
                    places[1][node][c] = L::load(&points[1][node][c]);
                }
            }
            let constants = &self.stencils.packs[pack];
            self.matrix.write::<L>(&places[0], &places[1], &constants.rest(), &mut matrix);
            Self::write_blocks(&matrix, constants.stiffness(), entries);
            let first = pack * WIDTH;
            let stencils = self.range.start.max(first)..self.range.end.min(first + WIDTH);
            let out = &mut self.out[(stencils.start - self.range.start) * per_stencil..];
            spread(entries, stencils.start - first..stencils.end - first, out);
        }
    }
}
