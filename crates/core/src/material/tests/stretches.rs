//! Models given in principal stretches only, against the same models in closed form.

use super::lanes::same_bits;
use super::{LAMBDA, MU, Probe, difference, gap, named, samples, stress_scale};
use crate::algebra::{IsotropicFunction, Vect};
use crate::material::{Domain, Psd, Stretches};
use crate::scalar::Scalar;

/// `mu sum (sigma_i - 1)^2 + lambda/2 (sum sigma_i - d)^2`.
struct Corotated;
impl<const D: usize> IsotropicFunction<D> for Corotated {
    #[inline(always)]
    fn in_stretches<S: Scalar>(&self, sigma: &Vect<S, D>) -> S {
        let (mut squares, mut trace) = (S::zero(), S::splat(-(D as f64)));
        for i in 0..D {
            let e = sigma[i] - S::one();
            squares = e.mul_add(e, squares);
            trace += sigma[i];
        }
        S::splat(MU).mul_add(squares, S::splat(0.5 * LAMBDA) * trace * trace)
    }
}
impl<const D: usize> Stretches<D> for Corotated {}

/// The neo-Hookean energy with `sigma_i^2` as a power, to take the code path of Ogden's.
struct NeoHookean;
impl<const D: usize> IsotropicFunction<D> for NeoHookean {
    #[inline(always)]
    fn in_stretches<S: Scalar>(&self, sigma: &Vect<S, D>) -> S {
        let (mut squares, mut ln) = (S::splat(-(D as f64)), S::zero());
        for i in 0..D {
            squares += sigma[i].powf(S::splat(2.0));
            ln += sigma[i].ln();
        }
        let volumetric = S::splat(0.5 * LAMBDA).mul_add(ln, S::splat(-MU)) * ln;
        S::splat(0.5 * MU).mul_add(squares, volumetric)
    }
}
impl<const D: usize> Stretches<D> for NeoHookean {
    fn domain(&self) -> Domain {
        Domain::PositiveJ
    }
}

/// Compares energy, stress and tangent of `model`, and its derivatives by dual numbers, with the
/// registered `name`.
fn agrees<const D: usize>(model: &dyn Probe<D>, name: &str) {
    let exact = named::<D>(name);
    assert_eq!(model.domain(), exact.domain());
    for f in samples::<D>(exact.domain() == Domain::Everywhere) {
        // The rotation of the closed form is orthonormal to 4e-12 only where F is inverted and nearly
        // ambiguous.
        let tolerance = if f.determinant() > 0.0 { 1e-13 } else { 1e-13 / gap(&f).powi(2) };
        let error = (model.psi(&f) - exact.psi(&f)).abs() / (LAMBDA * (1.0 + f.norm_squared()));
        assert!(error < tolerance, "{name}: energy {error:e} {f:?}");
        let scale = stress_scale(&*exact, &f);
        for p in [model.pk1(&f), model.derived_pk1(&f)] {
            let error = (p - exact.pk1(&f)).norm_squared().sqrt() / scale;
            assert!(error < tolerance, "{name}: stress {error:e} {f:?}");
        }
        // The quotients of nearly equal stretches keep about ten digits.
        for (what, tangent) in [
            ("tangent", model.hessian(&f, Psd::Exact)),
            ("derivative of the stress", model.derived_hessian(&f)),
            ("second derivative", model.second_derivative(&f)),
        ] {
            let error = difference(&exact.hessian(&f, Psd::Exact), &tangent);
            assert!(error < 1e-9, "{name}: {what} {error:e} {f:?}");
        }
    }
}

#[test]
fn models_in_stretches_are_those_in_closed_form() {
    agrees::<2>(&Corotated, "corotated");
    agrees::<3>(&Corotated, "corotated");
    agrees::<2>(&NeoHookean, "neo-hookean");
    agrees::<3>(&NeoHookean, "neo-hookean");
}

#[test]
fn models_in_stretches_have_the_same_bits_everywhere() {
    same_bits::<_, 2>("corotated", &Corotated);
    same_bits::<_, 3>("corotated", &Corotated);
    same_bits::<_, 2>("neo-Hookean", &NeoHookean);
    same_bits::<_, 3>("neo-Hookean", &NeoHookean);
}
