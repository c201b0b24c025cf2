//! The Hessian of pressure as blocks of faces, for the matrices of implicit steps.

use std::ops::Range;

use super::{Pressure, nodes};
use crate::element::area_rate;
use crate::energy::Stencils;
use crate::material::Psd;

impl<const D: usize, const N: usize> Pressure<D, N> {
    pub(super) fn face_stencils(&self) -> Stencils {
        let vertices = self.faces.as_flattened().iter().map(|slot| self.vertices[*slot as usize]);
        Stencils { size: N, vertices: vertices.collect() }
    }

    /// Writes the symmetric part of the Hessian of these faces: block `(i, j)` is half of
    /// `P_i da/dx_j + (P_j da/dx_i)^T`. Over a closed surface under uniform pressure the antisymmetric
    /// part cancels, and the sum is exact.
    ///
    /// A face alone has as much negative as positive curvature. With the projection nothing is written:
    /// Newton's method then treats pressure as a dead load.
    pub(super) fn face_hessians(&self, faces: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        out.fill(0.0);
        if psd == Psd::Projected {
            return;
        }
        let per_face = N * (N + 1) / 2 * D * D;
        let (uniform, count) = (!self.pressure.varies, self.areas.len());
        for (face, out) in faces.zip(out.chunks_exact_mut(per_face)) {
            let at = nodes::<D, N>(x, self.faces[face].map(|slot| self.vertices[slot as usize]));
            let now = &self.now[if uniform { 0 } else { face * count }..][..count];
            for (point, pressure) in self.areas.iter().zip(now) {
                // Columns of da/dx_j: a quarter turn, or a cross product, so the transpose is the
                // negative.
                let rates: [[[f64; D]; D]; N] = std::array::from_fn(|j| {
                    std::array::from_fn(|c| {
                        let mut unit = [0.0; D];
                        unit[c] = 1.0;
                        area_rate(&at, point, j, unit, false)
                    })
                });
                let mut block = out.chunks_exact_mut(D * D);
                for i in 0..N {
                    for j in i..N {
                        let Some(block) = block.next() else { return };
                        for r in 0..D {
                            for c in 0..D {
                                block[r * D + c] +=
                                    0.5 * (pressure[i] * rates[j][c][r] + pressure[j] * rates[i][r][c]);
                            }
                        }
                    }
                }
            }
        }
    }
}
