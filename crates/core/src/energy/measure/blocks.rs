//! Second derivatives, stencil by stencil, for implicit schemes.

use std::ops::Range;

use super::{MeasuredStencils, ScalarStrain};
use crate::algebra::{Dual, project_positive};
use crate::energy::elastic::points_of;
use crate::material::Psd;

/// Output for each stencil.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MatrixOutput {
    /// `k (grad s grad s^T + (s - s_0) grad grad s)`, by dual numbers; projected without its negative
    /// eigenvalues. What is left of it by `k grad s grad s^T` alone would not do: a joint that is bent
    /// resists being turned out of its plane by the second part only.
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
    let pairs = N * (N + 1) / 2;
    let lanes = stencils.patches.lanes_in(range).zip(out.chunks_exact_mut(pairs * D * D));
    for ((vertices, pack, lane), out) in lanes {
        let (stiffness, rest) = stencils.constants(pack, lane);
        let points = points_of::<D, N>(x, &vertices);
        // Column (b, l) of the matrix: the gradient of the energy along that coordinate.
        let mut columns = [[[[0.0; D]; N]; D]; N];
        if blocks != MatrixOutput::Rate {
            let rest = rest.map(Dual::constant);
            for b in 0..N {
                for l in 0..D {
                    let mut along = points.map(|point| point.map(Dual::constant));
                    along[b][l].derivative = 1.0;
                    let (s, gradient) = Q::deviation(&along, &rest);
                    for a in 0..N {
                        for i in 0..D {
                            let g = gradient[a][i];
                            columns[b][l][a][i] = s.derivative * g.value + s.value * g.derivative;
                        }
                    }
                }
            }
        } else {
            let (_, g) = Q::deviation(&points, &rest);
            for b in 0..N {
                for l in 0..D {
                    columns[b][l] = g.map(|row| row.map(|entry| entry * g[b][l]));
                }
            }
        }
        if blocks == MatrixOutput::Hessian(Psd::Projected) {
            project_positive(columns.as_flattened_mut().as_flattened_mut().as_flattened_mut(), N * D);
        }
        let mut blocks = out.chunks_exact_mut(D * D);
        for a in 0..N {
            for b in a..N {
                let block = blocks.next().expect("a block for each pair");
                for i in 0..D {
                    for l in 0..D {
                        // Lanes that fill up have no stiffness.
                        let entry = if stiffness == 0.0 { 0.0 } else { columns[b][l][a][i] };
                        block[i * D + l] = stiffness * entry;
                    }
                }
            }
        }
    }
}
