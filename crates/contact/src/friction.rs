//! Smooth Coulomb friction of a pair as a dissipation function, with normal force, coefficients and
//! normal lagged.
//!
//! `R(v) = mu lambda f0(|v_T|)` [W] with `v_T = (I - n n^T) sum_i c_i v_i`. Below the friction
//! regularisation velocity `e` the force grows smoothly from zero; above, it is `mu lambda` (Li et al.
//! 2020, *Incremental potential contact*, ACM Transactions on Graphics 39(4)). `R` is convex.

use crate::vector::{along, dot, inverse_or_zero, mixture, scaled, smaller};
use pliant::algebra::Mat;
use pliant::scalar::Scalar;

/// Dissipation function of the slip speed: `f0(y) = y^2/e - y^3/(3 e^2) + e/3` for `y < e`, `y` above.
#[inline(always)]
pub fn f0<S: Scalar>(y: S, threshold: f64) -> S {
    let e = S::splat(threshold);
    let s = y / e;
    let below = e * (s * s * (S::one() - s * S::splat(1.0 / 3.0)) + S::splat(1.0 / 3.0));
    S::select(y.lt(e), below, y)
}

/// Fraction of the full friction force: `f1 = f0'`, `2 y/e - y^2/e^2` for `y < e`, 1 above.
#[inline(always)]
pub fn f1<S: Scalar>(y: S, threshold: f64) -> S {
    let s = smaller(y / S::splat(threshold), S::one());
    s * (S::splat(2.0) - s)
}

/// `f1(y) / y` [s/m], finite at zero: `2/e`.
#[inline(always)]
pub fn f1_over_y<S: Scalar>(y: S, threshold: f64) -> S {
    let e = S::splat(threshold);
    let slides = e.lt(y);
    let below = (S::splat(2.0) - y / e) / e;
    S::select(slides, S::one() / S::select(slides, y, e), below)
}

/// `f1'(y)` [s/m]: `2/e - 2 y/e^2` for `y < e`, 0 above.
#[inline(always)]
pub fn f1_slope<S: Scalar>(y: S, threshold: f64) -> S {
    let e = S::splat(threshold);
    let s = smaller(y / e, S::one());
    (S::splat(2.0) - (s + s)) / e
}

/// Derivative of `f1(y) / y` [s^2/m^2]: `-1/e^2` for `y < e`, `-1/y^2` above.
#[inline(always)]
pub fn f1_over_y_slope<S: Scalar>(y: S, threshold: f64) -> S {
    let inverse = S::one() / y.max(S::splat(threshold));
    -(inverse * inverse)
}

/// Friction of one pair with lagged normal force and normal.
#[derive(Clone, Copy, Debug)]
pub struct PairFriction<S, const D: usize, const N: usize> {
    /// Coefficients `c`.
    pub coefficients: [S; N],
    /// Unit normal.
    pub normal: [S; D],
    /// Friction limit `mu lambda` [N], `lambda = -dE/dd` the normal force.
    pub limit: S,
    /// Regularisation velocity `e` [m/s].
    pub threshold: f64,
}

impl<S: Scalar, const D: usize, const N: usize> PairFriction<S, D, N> {
    /// Slip velocity `v_T` [m/s].
    #[inline(always)]
    pub fn slip(&self, v: &[[S; D]; N]) -> [S; D] {
        self.in_plane(&mixture(&self.coefficients, v))
    }

    /// Dissipation function `R` [W].
    #[inline(always)]
    pub fn value(&self, v: &[[S; D]; N]) -> S {
        let slip = self.slip(v);
        self.limit * f0(dot(&slip, &slip).sqrt(), self.threshold)
    }

    /// Dissipated power `v . dR/dv` [W].
    #[inline(always)]
    pub fn power(&self, v: &[[S; D]; N]) -> S {
        let slip = self.slip(v);
        let squared = dot(&slip, &slip);
        self.limit * f1_over_y(squared.sqrt(), self.threshold) * squared
    }

    /// Friction force on the first primitive: `-mu lambda f1(|v_T|) v_T / |v_T|` [N].
    #[inline(always)]
    pub fn force(&self, v: &[[S; D]; N]) -> [S; D] {
        let slip = self.slip(v);
        scaled(-(self.limit * f1_over_y(dot(&slip, &slip).sqrt(), self.threshold)), &slip)
    }

    /// Gradient `dR/dv_i` [N].
    #[inline(always)]
    pub fn gradient(&self, v: &[[S; D]; N]) -> [[S; D]; N] {
        let force = scaled(-S::one(), &self.force(v));
        let mut gradient = *v;
        for i in 0..N {
            gradient[i] = scaled(self.coefficients[i], &force);
        }
        gradient
    }

    /// Tangential component of a vector, `w - n (n . w)`; force fractions must be tangential.
    #[inline(always)]
    pub fn in_plane(&self, w: &[S; D]) -> [S; D] {
        along(w, -dot(w, &self.normal), &self.normal)
    }

    /// Friction force as a fraction of the limit, `w = f1(y) t`, `|w| <= 1`; `y` and `t` are magnitude
    /// and direction of the slip.
    #[inline(always)]
    pub fn part_of_limit(&self, v: &[[S; D]; N]) -> [S; D] {
        let slip = self.slip(v);
        scaled(f1_over_y(dot(&slip, &slip).sqrt(), self.threshold), &slip)
    }

    /// Force fraction after a step from `v` along `dv` [m/s], previously `w`: solves `g(y) w = v_T`,
    /// `g(y) = y / f1(y)`, to first order in both, then scales the result back to the unit ball.
    #[inline(always)]
    pub fn part_after(&self, w: &[S; D], v: &[[S; D]; N], dv: &[[S; D]; N]) -> [S; D] {
        let (slip, change) = (self.slip(v), self.slip(dv));
        let y = dot(&slip, &slip).sqrt();
        let growth = self.g_slope(y) * inverse_or_zero(y) * dot(&slip, &change);
        let over_g = f1_over_y(y, self.threshold);
        let mut after = slip;
        for k in 0..D {
            after[k] = over_g * (slip[k] + change[k] - growth * w[k]);
        }
        // Rounding along the normal would grow by `growth / g` from step to step, and a normal component
        // makes matrices indefinite.
        let after = self.in_plane(&after);
        let length = dot(&after, &after).sqrt();
        scaled(S::one() / length.max(S::one()), &after)
    }

    /// `g'(y)` of `g(y) = y / f1(y)`: `1 / (2 - y/e)^2` for `y < e`, 1 above.
    #[inline(always)]
    fn g_slope(&self, y: S) -> S {
        let left = S::splat(2.0) - smaller(y / S::splat(self.threshold), S::one());
        S::one() / (left * left)
    }

    /// Primal-dual variant of [`hessian`](Self::hessian) with an independent force fraction `w`: `mu
    /// lambda / g [I - n n^T - g' (w t^T + t w^T) / 2]`, positive semidefinite for `|w| <= 1`, and equal
    /// to the Hessian for `w = f1 t`.
    ///
    /// The force turns within the regularisation velocity, and steps are many times longer: with the
    /// Hessian alone, Newton's method either overshoots the state of rest or misses it. Treating the
    /// force as an unknown, `g(y) w = v_T`, and eliminating it gives this matrix (Chan, Golub, Mulet
    /// 1999, *A nonlinear primal-dual method for total variation-based image restoration*, SIAM Journal
    /// on Scientific Computing 20(6), for the same function of gradients).
    #[inline(always)]
    pub fn hessian_with(&self, w: &[S; D], v: &[[S; D]; N]) -> Mat<S, D> {
        let slip = self.slip(v);
        let y = dot(&slip, &slip).sqrt();
        let across = self.limit * f1_over_y(y, self.threshold);
        let direction = scaled(inverse_or_zero(y), &slip);
        let half = S::splat(-0.5) * across * self.g_slope(y);
        // Entry by entry, each with its mirror image: filling row after row was compiled to a matrix that
        // is not symmetric in loops over contacts (rustc 1.95 without link-time optimisation).
        let mut m = Mat::scalar(across);
        for k in 0..D {
            for l in k..D {
                let turned = half * (direction[k] * w[l] + w[k] * direction[l]);
                m[k][l] += turned - across * self.normal[k] * self.normal[l];
                m[l][k] = m[k][l];
            }
        }
        m
    }

    /// Hessian `M` with `d2R/dv_i dv_j = c_i c_j M` [N s/m]: `mu lambda [(f1/y)(I - n n^T - t t^T) + f1'
    /// t t^T]`, positive semidefinite without projection.
    #[inline(always)]
    pub fn hessian(&self, v: &[[S; D]; N]) -> Mat<S, D> {
        let slip = self.slip(v);
        let y = dot(&slip, &slip).sqrt();
        let (across, ahead) = (f1_over_y(y, self.threshold), f1_slope(y, self.threshold));
        let direction = scaled(inverse_or_zero(y), &slip);
        let mut m = Mat::scalar(self.limit * across);
        for k in 0..D {
            let turned = self.limit * (ahead - across) * direction[k];
            m[k] = along(&m[k], -(self.limit * across) * self.normal[k], &self.normal);
            m[k] = along(&m[k], turned, &direction);
        }
        m
    }
}
