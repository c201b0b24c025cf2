//! Domain boundary of the models that are defined for `J > 0` only.

use crate::scalar::Scalar;

/// Returns `J` inside the domain and NaN outside, so that a stress computed from it is not finite there.
#[inline(always)]
pub(super) fn admissible<S: Scalar>(j: S) -> S {
    S::select(j.lt(S::splat(f64::MIN_POSITIVE)), S::splat(f64::NAN) * j, j)
}

/// Returns `psi` inside the domain and `+inf` outside; `stretch` is `F : F`.
#[inline(always)]
pub(super) fn infinite_outside<S: Scalar>(j: S, stretch: S, psi: S) -> S {
    // The value depends on `F`: the derivative of a constant would be a plausible zero. NaN stays NaN.
    let outside = S::splat(f64::INFINITY) * (stretch + S::one());
    S::select(j.lt(S::splat(f64::MIN_POSITIVE)), outside, psi)
}
