//! Constants of rubber models: absolute or in proportion, and models that contain one another.

use super::{difference, probe, samples, stress_scale};
use crate::algebra::tests::sample::largest;
use crate::material::{Isotropic, MaterialSpec, OgdenTerms, Psd, TwoConstants};

/// Checks that energy, stress and tangent agree in two and three dimensions.
fn same(a: &MaterialSpec, b: &MaterialSpec) {
    fn check<const D: usize>(a: &MaterialSpec, b: &MaterialSpec) {
        let (one, other) = (probe::<D>(a), probe::<D>(b));
        for f in samples::<D>(false) {
            let scale = stress_scale(&*one, &f);
            assert!((one.psi(&f) - other.psi(&f)).abs() < 1e-13 * (one.psi(&f) + scale), "{a:?} {b:?} {f:?}");
            assert!(largest(&(one.pk1(&f) - other.pk1(&f))) < 1e-13 * scale, "{a:?} {b:?} {f:?}");
            let error = difference(&one.hessian(&f, Psd::Exact), &other.hessian(&f, Psd::Exact));
            assert!(error < 1e-9, "{a:?} {b:?} {error:e} {f:?}");
        }
    }
    check::<2>(a, b);
    check::<3>(a, b);
}

fn ogden(young: Option<f64>, mu: &[f64], alpha: &[f64]) -> MaterialSpec {
    MaterialSpec::Ogden(OgdenTerms { young, poisson: 0.3, mu: mu.into(), alpha: alpha.into() })
}

fn mooney(young: Option<f64>, c10: f64, c01: f64) -> MaterialSpec {
    MaterialSpec::MooneyRivlin(TwoConstants { young, poisson: 0.3, c10, c01, d1: None })
}

/// The shear modulus of E = 1e6, nu = 0.3.
const MU: f64 = 1e6 / 2.6;

#[test]
fn rubber_models_contain_one_another() {
    let neo = MaterialSpec::IsochoricNeoHookean(Isotropic::new(1e6, 0.3));
    same(&neo, &mooney(Some(1e6), 1.0, 0.0));
    same(&neo, &ogden(Some(1e6), &[1.0], &[2.0]));
    // mu_p = 2 C10, -2 C01 of alpha_p = 2, -2.
    same(&mooney(Some(1e6), 4.0, 1.0), &ogden(Some(1e6), &[8.0, -2.0], &[2.0, -2.0]));
    // A term may be split into several.
    same(
        &ogden(Some(1e6), &[3.0, 1.0], &[1.3, 2.0]),
        &ogden(Some(1e6), &[1.0, 0.5, 2.0, 0.5], &[1.3, 2.0, 1.3, 2.0]),
    );
}

#[test]
fn young_scales_the_constants_and_without_it_they_are_pascals() {
    same(&mooney(Some(1e6), 0.4, 0.1), &mooney(None, 0.4 * MU, 0.1 * MU));
    same(&mooney(Some(1e6), 0.4, 0.1), &mooney(Some(1e6), 4e7, 1e7));
    let mu = [0.5 * MU, -0.5 * MU];
    same(&ogden(Some(1e6), &[1.0, -1.0], &[2.0, -2.0]), &ogden(None, &mu, &[2.0, -2.0]));
    for (absolute, young) in
        [(mooney(None, 4e5, 1e5), 2.6e6), (ogden(None, &[5e5, 1e5], &[2.0, 4.0]), 1.82e6)]
    {
        let lame = absolute.lame().unwrap();
        let (lambda, mu) = (lame.lambda, lame.mu);
        assert!((mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu) / young - 1.0).abs() < 1e-14, "{absolute:?}");
        assert!((0.5 * lambda / (lambda + mu) - 0.3).abs() < 1e-14, "{absolute:?}");
    }
}
