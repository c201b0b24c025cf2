//! `D x D` matrices over any scalar, row-major, on the stack.
//!
//! The code uses loops, never closures: a closure that the compiler declines to inline loses the target
//! features of its caller and turns every lane operation in it into a call.

use std::ops::{Add, AddAssign, Index, IndexMut, Mul, Neg, Sub};

use crate::scalar::Scalar;

/// A vector of `D` components.
pub type Vect<S, const D: usize> = [S; D];

/// A `D x D` matrix, `m[row][column]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mat<S, const D: usize>(pub [[S; D]; D]);

impl<S, const D: usize> Index<usize> for Mat<S, D> {
    type Output = [S; D];
    #[inline(always)]
    fn index(&self, row: usize) -> &[S; D] {
        &self.0[row]
    }
}

impl<S, const D: usize> IndexMut<usize> for Mat<S, D> {
    #[inline(always)]
    fn index_mut(&mut self, row: usize) -> &mut [S; D] {
        &mut self.0[row]
    }
}

impl<S: Scalar, const D: usize> Mat<S, D> {
    /// The zero matrix.
    #[inline(always)]
    pub fn zero() -> Self {
        Mat([[S::zero(); D]; D])
    }

    /// `d` on the diagonal, zero elsewhere.
    #[inline(always)]
    pub fn scalar(d: S) -> Self {
        let mut m = Self::zero();
        for i in 0..D {
            m[i][i] = d;
        }
        m
    }

    /// The identity.
    #[inline(always)]
    pub fn identity() -> Self {
        Self::scalar(S::one())
    }

    /// A matrix of constants.
    #[inline(always)]
    pub fn splat(m: &Mat<f64, D>) -> Self {
        let mut r = Self::zero();
        for i in 0..D {
            for j in 0..D {
                r[i][j] = S::splat(m[i][j]);
            }
        }
        r
    }

    /// The matrix with these rows on its diagonal.
    #[inline(always)]
    pub fn diagonal(d: &Vect<S, D>) -> Self {
        let mut m = Self::zero();
        for i in 0..D {
            m[i][i] = d[i];
        }
        m
    }

    /// `mask ? a : b`, lane by lane.
    #[inline(always)]
    pub fn select(mask: S::Mask, a: &Self, b: &Self) -> Self {
        let mut r = *a;
        for i in 0..D {
            for j in 0..D {
                r[i][j] = S::select(mask, a[i][j], b[i][j]);
            }
        }
        r
    }

    /// `A^T`.
    #[inline(always)]
    pub fn transpose(&self) -> Self {
        let mut r = *self;
        for i in 0..D {
            for j in 0..D {
                r[i][j] = self[j][i];
            }
        }
        r
    }

    /// `s A`.
    #[inline(always)]
    pub fn scale(&self, s: S) -> Self {
        let mut r = *self;
        for i in 0..D {
            for j in 0..D {
                r[i][j] = self[i][j] * s;
            }
        }
        r
    }

    /// `s A + B`.
    #[inline(always)]
    pub fn scale_add(&self, s: S, b: &Self) -> Self {
        let mut r = *b;
        for i in 0..D {
            for j in 0..D {
                r[i][j] = self[i][j].mul_add(s, b[i][j]);
            }
        }
        r
    }

    /// `A B`.
    #[inline(always)]
    pub fn mul(&self, b: &Self) -> Self {
        let mut r = Self::zero();
        for i in 0..D {
            for j in 0..D {
                let mut s = self[i][0] * b[0][j];
                for k in 1..D {
                    s = self[i][k].mul_add(b[k][j], s);
                }
                r[i][j] = s;
            }
        }
        r
    }

    /// `A B^T`.
    #[inline(always)]
    pub fn mul_transpose(&self, b: &Self) -> Self {
        let mut r = Self::zero();
        for i in 0..D {
            for j in 0..D {
                let mut s = self[i][0] * b[j][0];
                for k in 1..D {
                    s = self[i][k].mul_add(b[j][k], s);
                }
                r[i][j] = s;
            }
        }
        r
    }

    /// `A^T B`.
    #[inline(always)]
    pub fn transpose_mul(&self, b: &Self) -> Self {
        let mut r = Self::zero();
        for i in 0..D {
            for j in 0..D {
                let mut s = self[0][i] * b[0][j];
                for k in 1..D {
                    s = self[k][i].mul_add(b[k][j], s);
                }
                r[i][j] = s;
            }
        }
        r
    }

    /// `A v`.
    #[inline(always)]
    pub fn mul_vec(&self, v: &Vect<S, D>) -> Vect<S, D> {
        let mut r = [S::zero(); D];
        for i in 0..D {
            let mut s = self[i][0] * v[0];
            for k in 1..D {
                s = self[i][k].mul_add(v[k], s);
            }
            r[i] = s;
        }
        r
    }

    /// `A : B = sum A_ij B_ij = tr(A^T B)` (lecture 16).
    ///
    /// ```
    /// use pliant::algebra::Mat;
    ///
    /// let (a, b) = (Mat([[1.0, 2.0], [3.0, 4.0]]), Mat([[5.0, 6.0], [7.0, 8.0]]));
    /// assert_eq!(a.dot(&b), 70.0);
    /// assert_eq!(a.transpose_mul(&b).trace(), 70.0);
    /// ```
    #[inline(always)]
    pub fn dot(&self, b: &Self) -> S {
        let mut rows = [S::zero(); D];
        for i in 0..D {
            rows[i] = self[i][0] * b[i][0];
            for j in 1..D {
                rows[i] = self[i][j].mul_add(b[i][j], rows[i]);
            }
        }
        let mut s = rows[0];
        for i in 1..D {
            s += rows[i];
        }
        s
    }

    /// Squared Frobenius norm `A : A`.
    #[inline(always)]
    pub fn norm_squared(&self) -> S {
        self.dot(self)
    }

    /// Trace.
    #[inline(always)]
    pub fn trace(&self) -> S {
        let mut s = self[0][0];
        for i in 1..D {
            s += self[i][i];
        }
        s
    }

    /// The first `E` rows and columns.
    ///
    /// # Panics
    /// If there are fewer.
    #[inline(always)]
    pub fn leading<const E: usize>(&self) -> Mat<S, E> {
        let mut part = Mat::zero();
        for i in 0..E {
            part[i].copy_from_slice(&self[i][..E]);
        }
        part
    }

    /// Symmetric part `(A + A^T) / 2`.
    #[inline(always)]
    pub fn symmetric(&self) -> Self {
        let half = S::splat(0.5);
        let mut r = *self;
        for i in 0..D {
            for j in 0..i {
                let s = (self[i][j] + self[j][i]) * half;
                r[i][j] = s;
                r[j][i] = s;
            }
        }
        r
    }

    /// Cofactor matrix `cof A = det(A) A^-T`, also where `A` is singular.
    ///
    /// # Panics
    /// If `D` is neither 2 nor 3.
    #[inline(always)]
    pub fn cofactor(&self) -> Self {
        let m = self;
        let mut c = Self::zero();
        match D {
            2 => {
                c[0][0] = m[1][1];
                c[0][1] = -m[1][0];
                c[1][0] = -m[0][1];
                c[1][1] = m[0][0];
            }
            3 => {
                for i in 0..3 {
                    let (p, q) = ((i + 1) % 3, (i + 2) % 3);
                    for j in 0..3 {
                        let (r, s) = ((j + 1) % 3, (j + 2) % 3);
                        c[i][j] = m[p][r].mul_add(m[q][s], -(m[p][s] * m[q][r]));
                    }
                }
            }
            _ => unreachable!("dimension is 2 or 3"),
        }
        c
    }

    /// Determinant.
    #[inline(always)]
    pub fn determinant(&self) -> S {
        self.determinant_with(&self.cofactor())
    }

    /// Determinant, given the cofactor matrix.
    #[inline(always)]
    pub fn determinant_with(&self, cofactor: &Self) -> S {
        let mut s = self[0][0] * cofactor[0][0];
        for j in 1..D {
            s = self[0][j].mul_add(cofactor[0][j], s);
        }
        s
    }

    /// Inverse; not finite where `A` is singular.
    #[inline(always)]
    pub fn inverse(&self) -> Self {
        let c = self.cofactor();
        c.transpose().scale(S::one() / self.determinant_with(&c))
    }

    /// The derivative of the cofactor matrix in the direction `d`: `d/dt cof(A + t d)` at `t = 0`.
    #[inline(always)]
    pub fn cofactor_derivative(&self, d: &Self) -> Self {
        if D == 2 {
            return d.cofactor();
        }
        let mut c = Self::zero();
        for i in 0..D {
            let (p, q) = ((i + 1) % 3, (i + 2) % 3);
            for j in 0..D {
                let (r, s) = ((j + 1) % 3, (j + 2) % 3);
                c[i][j] = self[p][r].mul_add(d[q][s], d[p][r] * self[q][s])
                    - self[p][s].mul_add(d[q][r], d[p][s] * self[q][r]);
            }
        }
        c
    }
}

impl<S: Scalar, const D: usize> Add for Mat<S, D> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, b: Self) -> Self {
        self += b;
        self
    }
}

impl<S: Scalar, const D: usize> AddAssign for Mat<S, D> {
    #[inline(always)]
    fn add_assign(&mut self, b: Self) {
        for i in 0..D {
            for j in 0..D {
                self[i][j] += b[i][j];
            }
        }
    }
}

impl<S: Scalar, const D: usize> Sub for Mat<S, D> {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, b: Self) -> Self {
        for i in 0..D {
            for j in 0..D {
                self[i][j] -= b[i][j];
            }
        }
        self
    }
}

impl<S: Scalar, const D: usize> Neg for Mat<S, D> {
    type Output = Self;
    #[inline(always)]
    fn neg(mut self) -> Self {
        for i in 0..D {
            for j in 0..D {
                self[i][j] = -self[i][j];
            }
        }
        self
    }
}

impl<S: Scalar, const D: usize> Mul for Mat<S, D> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Mat::mul(&self, &b)
    }
}

/// `(i, k, m)` with the permutation symbol `e_ikm`.
pub(crate) const TURNS: [(usize, usize, usize, f64); 6] =
    [(0, 1, 2, 1.0), (1, 2, 0, 1.0), (2, 0, 1, 1.0), (1, 0, 2, -1.0), (2, 1, 0, -1.0), (0, 2, 1, -1.0)];
