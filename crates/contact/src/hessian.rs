//! Second derivatives of pairs: exact, or projected to the nearest positive semidefinite matrix.
//!
//! With `alpha = E''(D)`, `beta = E'(D)`, the derivatives `c~_b` of the coefficients along the
//! orthonormal tangents `e_b`, and `P` the projector on the complement of normal and tangents (envelope
//! theorem):
//! ```text
//! H = (4 alpha d^2 + 2 beta) (c n)(c n)^T - 2 beta d sum_b [ d (c~_b n)(c~_b n)^T
//!       + (c~_b n)(c e_b)^T + (c e_b)(c~_b n)^T ] + 2 beta c c^T (x) P .
//! ```
//! All but the last term lives in the span of `c n`, `c~_b n`, `c e_b`: five dimensions for
//! point-triangle and edge-edge pairs instead of twelve.

use crate::barrier::EnergyOfDistance;
use crate::eigen::positive_part;
use crate::pair::PairGeometry;
use crate::vector::{along, dot, inverse_or_zero, scaled};
use pliant::algebra::Mat;
use pliant::material::Psd;
use pliant::scalar::Scalar;

/// Largest dimension of the span: `c n`, two `c~_b n`, two `c e_b`.
const SPAN: usize = 5;

/// Blocks `d2E / dx_i dx_j` [N/m] of a pair of `N` vertices.
pub type PairBlocks<S, const D: usize, const N: usize> = [[Mat<S, D>; N]; N];

/// Factors of a Hessian: `sum_ij A_ij n n^T + sum_b (u_b,i g_j n e_b^T + g_i u_b,j e_b n^T) + sum Y_bc
/// g_i g_j e_b e_c^T + p g_i g_j P`.
struct Factors<S, const N: usize, const P: usize> {
    normal: [[S; N]; N],
    mixed: [[S; N]; P],
    tangential: [[S; P]; P],
    coefficients: [S; N],
    remainder: S,
}

impl<S: Scalar, const D: usize, const N: usize, const P: usize> PairGeometry<S, D, N, P> {
    /// Blocks of the Hessian of an energy of the distance; for [`Psd::Projected`] the nearest positive
    /// semidefinite ones.
    #[inline(always)]
    pub fn hessian(&self, law: &EnergyOfDistance<S>, psd: Psd) -> PairBlocks<S, D, N> {
        match psd {
            Psd::Exact => self.exact_hessian(law),
            Psd::Projected => self.projected_hessian(law),
        }
    }

    /// Blocks of the exact Hessian.
    #[inline(always)]
    pub fn exact_hessian(&self, law: &EnergyOfDistance<S>) -> PairBlocks<S, D, N> {
        let c = &self.coefficients;
        let (along_normal, twice_slope) = self.stiffnesses(law);
        let lever = twice_slope * self.distance;
        let mut f = Factors {
            normal: [[S::zero(); N]; N],
            mixed: [[S::zero(); N]; P],
            tangential: [[S::zero(); P]; P],
            coefficients: *c,
            remainder: twice_slope,
        };
        for i in 0..N {
            f.normal[i] = scaled(along_normal * c[i], c);
            for b in 0..P {
                let part = -(lever * self.distance * self.slopes[b][i]);
                f.normal[i] = along(&f.normal[i], part, &self.slopes[b]);
            }
        }
        for b in 0..P {
            f.mixed[b] = scaled(-lever, &self.slopes[b]);
        }
        self.expand(&f)
    }

    /// Blocks of the nearest positive semidefinite matrix in the Frobenius norm.
    #[inline(always)]
    pub fn projected_hessian(&self, law: &EnergyOfDistance<S>) -> PairBlocks<S, D, N> {
        let (along_normal, twice_slope) = self.stiffnesses(law);
        let lever = twice_slope * self.distance;
        // Orthonormal basis of the coefficients c, c~_b: rows of q; `components` is their triangular
        // factor.
        let mut q = [[S::zero(); N]; 3];
        let mut components = [[S::zero(); 3]; 3];
        for a in 0..=P {
            let vector = if a == 0 { &self.coefficients } else { &self.slopes[a - 1] };
            let mut rest = *vector;
            for k in 0..a {
                for _ in 0..2 {
                    let part = dot(&rest, &q[k]);
                    components[a][k] += part;
                    rest = along(&rest, -part, &q[k]);
                }
            }
            let length = dot(&rest, &rest).sqrt();
            components[a][a] = length;
            q[a] = scaled(inverse_or_zero(length), &rest);
        }
        // Matrix in the span, projected.
        let length = components[0][0];
        let mut s = [[S::zero(); SPAN]; SPAN];
        s[0][0] = along_normal * length * length;
        for b in 0..P {
            let slope = components[b + 1];
            let tangent = P + 1 + b;
            for i in 0..=b + 1 {
                for j in 0..=b + 1 {
                    s[i][j] -= lever * self.distance * slope[i] * slope[j];
                }
                s[i][tangent] = -(lever * length * slope[i]);
                s[tangent][i] = s[i][tangent];
            }
        }
        positive_part(&mut s, 2 * P + 1);
        self.expand(&projected_factors(&s, &q, twice_slope.max(S::zero()) * length * length))
    }

    /// `4 alpha d^2 + 2 beta`, and `2 beta` [N/m].
    #[inline(always)]
    fn stiffnesses(&self, law: &EnergyOfDistance<S>) -> (S, S) {
        let twice_slope = law.slope + law.slope;
        (S::splat(4.0) * law.curvature * self.squared_distance + twice_slope, twice_slope)
    }

    #[inline(always)]
    fn expand(&self, f: &Factors<S, N, P>) -> PairBlocks<S, D, N> {
        let n = &self.normal;
        let normal = outer(n, n);
        // T = sum_bc Y_bc e_b e_c^T + p P, shared by all blocks.
        let mut tangential = Mat::<S, D>::identity().scale(f.remainder);
        let mut remainder = normal;
        for b in 0..P {
            remainder = sum(&remainder, &outer(&self.tangents[b], &self.tangents[b]));
        }
        for k in 0..D {
            tangential[k] = along(&tangential[k], -f.remainder, &remainder[k]);
        }
        for b in 0..P {
            for c in 0..P {
                for k in 0..D {
                    let part = f.tangential[b][c] * self.tangents[b][k];
                    tangential[k] = along(&tangential[k], part, &self.tangents[c]);
                }
            }
        }
        let mut blocks = [[Mat::zero(); N]; N];
        for i in 0..N {
            // w = sum_b u_b,i e_b.
            let wi = self.mixed_vector(f, i);
            for j in i..N {
                let wj = self.mixed_vector(f, j);
                let both = f.coefficients[i] * f.coefficients[j];
                for k in 0..D {
                    let mut row = scaled(both, &tangential[k]);
                    row = along(&row, f.normal[i][j], &normal[k]);
                    row = along(&row, f.coefficients[j] * n[k], &wi);
                    blocks[i][j][k] = along(&row, f.coefficients[i] * wj[k], n);
                }
                blocks[j][i] = blocks[i][j].transpose();
            }
        }
        blocks
    }

    #[inline(always)]
    fn mixed_vector(&self, f: &Factors<S, N, P>, i: usize) -> [S; D] {
        let mut w = [S::zero(); D];
        for b in 0..P {
            w = along(&w, f.mixed[b][i], &self.tangents[b]);
        }
        w
    }
}

/// Factors of a matrix `s` in the basis `q_a n`, `q_0 e_b`, with `s` projected.
#[inline(always)]
fn projected_factors<S: Scalar, const N: usize, const P: usize>(
    s: &[[S; SPAN]; SPAN],
    q: &[[S; N]; 3],
    remainder: S,
) -> Factors<S, N, P> {
    let mut f = Factors {
        normal: [[S::zero(); N]; N],
        mixed: [[S::zero(); N]; P],
        tangential: [[S::zero(); P]; P],
        coefficients: q[0],
        remainder,
    };
    for a in 0..=P {
        for i in 0..N {
            for b in 0..=P {
                f.normal[i] = along(&f.normal[i], s[a][b] * q[a][i], &q[b]);
            }
        }
        for b in 0..P {
            f.mixed[b] = along(&f.mixed[b], s[a][P + 1 + b], &q[a]);
        }
    }
    for b in 0..P {
        for c in 0..P {
            f.tangential[b][c] = s[P + 1 + b][P + 1 + c];
        }
    }
    f
}

#[inline(always)]
fn outer<S: Scalar, const D: usize>(a: &[S; D], b: &[S; D]) -> Mat<S, D> {
    let mut m = Mat::zero();
    for k in 0..D {
        m[k] = scaled(a[k], b);
    }
    m
}

#[inline(always)]
fn sum<S: Scalar, const D: usize>(a: &Mat<S, D>, b: &Mat<S, D>) -> Mat<S, D> {
    let mut m = *a;
    for k in 0..D {
        m[k] = along(&m[k], S::one(), &b[k]);
    }
    m
}
