//! Boundary of the domain of the models that are defined for `J > 0`.

use crate::scalar::Scalar;

/// Returns `J` where the model is defined, NaN elsewhere, so that nothing computed with it can pass for a
/// stress.
#[inline(always)]
pub(super) fn admissible<S: Scalar>(j: S) -> S {
    S::select(j.lt(S::splat(f64::MIN_POSITIVE)), S::splat(f64::NAN) * j, j)
}

/// Returns `psi` where the model is defined, `+inf` elsewhere; `stretch` is `F : F`.
#[inline(always)]
pub(super) fn infinite_outside<S: Scalar>(j: S, stretch: S, psi: S) -> S {
    // Not a constant: its derivative must not be a plausible zero. NaN is neither inside nor outside and
    // stays.
    let outside = S::splat(f64::INFINITY) * (stretch + S::one());
    S::select(j.lt(S::splat(f64::MIN_POSITIVE)), outside, psi)
}
