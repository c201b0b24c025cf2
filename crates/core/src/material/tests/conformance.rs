//! Energy, stress and tangent of a model agree with each other, and initially with linear elasticity.

use super::{difference, eigenvalues, flat, gap, models, samples, stress_scale};
use crate::algebra::tests::sample::largest;
use crate::algebra::{Mat, signed_svd};
use crate::material::{Domain, Isotropic, Lame, MaterialSpec, Psd, Spectrum};

// lecture 20
#[test]
fn stress_is_the_derivative_of_the_energy() {
    fn check<const D: usize>() {
        for (spec, model) in models::<D>() {
            for f in samples::<D>(model.domain() == Domain::Everywhere) {
                let error = largest(&(model.pk1(&f) - model.derived_pk1(&f))) / stress_scale(&*model, &f);
                // The derivative of R cancels only as well as R is orthonormal.
                let tolerance = if f.determinant() > 0.0 { 1e-13 } else { 1e-13 / gap(&f).powi(2) };
                assert!(error < tolerance, "{} {D}D: {error:e} {f:?}", spec.name());
            }
        }
    }
    check::<2>();
    check::<3>();
}

#[test]
fn tangent_is_the_derivative_of_the_stress() {
    fn check<const D: usize>() {
        for (spec, model) in models::<D>() {
            for f in samples::<D>(model.domain() == Domain::Everywhere) {
                let exact = model.hessian(&f, Psd::Exact);
                let error = difference(&exact, &model.derived_hessian(&f));
                assert!(error < 1e-10, "{} {D}D: {error:e} {f:?}", spec.name());
                let error = difference(&exact, &model.second_derivative(&f));
                assert!(error < 1e-9, "{} {D}D, from psi: {error:e} {f:?}", spec.name());
                let h = flat(&exact);
                assert!((&h - h.transpose()).norm() < 1e-14 * h.norm(), "{}", spec.name());
            }
        }
    }
    check::<2>();
    check::<3>();
}

#[test]
fn projection_clamps_the_eigenvalues_and_nothing_else() {
    fn check<const D: usize>() {
        for (spec, model) in models::<D>() {
            for f in samples::<D>(model.domain() == Domain::Everywhere) {
                let exact = eigenvalues(&model.hessian(&f, Psd::Exact));
                let projected = eigenvalues(&model.hessian(&f, Psd::Projected));
                let largest = exact.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                assert!(projected[0] >= -1e-12 * largest, "{} {D}D: {projected:?}", spec.name());
                for (e, p) in exact.iter().zip(&projected) {
                    assert!((e.max(0.0) - p).abs() < 1e-12 * largest, "{}: {exact:?} {f:?}", spec.name());
                }
            }
        }
    }
    check::<2>();
    check::<3>();
}

/// Passes the derivatives `psi_i = P_ii` and `psi_ij = H_iijj` at `diag(sigma)` to the eigensystem in
/// principal stretches.
#[test]
fn eigensystem_from_stretches_alone() {
    fn check<const D: usize>() {
        for (spec, model) in models::<D>()
            .into_iter()
            .filter(|(spec, _)| spec.about().frame_indifferent && spec.is_isotropic())
        {
            for f in samples::<D>(model.domain() == Domain::Everywhere) {
                let svd = signed_svd(&f);
                let diagonal = Mat::diagonal(&svd.sigma);
                let (p, h) = (model.pk1(&diagonal), model.derived_hessian(&diagonal));
                let (mut first, mut second) = ([0.0; D], Mat::zero());
                for i in 0..D {
                    first[i] = p[i][i];
                    for j in 0..D {
                        second[i][j] = h.0[i][i][j][j];
                    }
                }
                let tangent = Spectrum::from_stretches(&svd.sigma, &first, &second).tangent(&svd, Psd::Exact);
                let error = difference(&model.hessian(&f, Psd::Exact), &tangent);
                assert!(error < 1e-9, "{} {D}D: {error:e} {f:?}", spec.name());
            }
        }
    }
    check::<2>();
    check::<3>();
}

/// `young` and `poisson` mean the same in every model. lecture 17
#[test]
fn rest_state_is_linear_elasticity() {
    fn check<const D: usize>() {
        for (spec, model) in models::<D>() {
            let about = spec.about();
            let identity = Mat::identity();
            assert_eq!(about.has_rest_shape, model.psi(&identity).abs() < 1e-9, "{}", spec.name());
            assert_eq!(about.has_rest_shape, largest(&model.pk1(&identity)) < 1e-9, "{}", spec.name());
            let Some(lame) = spec.lame() else { continue };
            // ARAP has no Poisson effect.
            let poisson = if spec.name() == "arap" { 0.0 } else { 0.3 };
            let reference = MaterialSpec::Linear(Isotropic::new(1e6, poisson).into());
            let reference = super::probe::<D>(&reference).hessian(&identity, Psd::Exact);
            // Lame parameters of a formula are computed, not given.
            let tolerance = if spec.name() == "expression" { 1e-15 } else { 0.0 };
            for (expected, found) in
                [(reference.0[0][0][1][1], lame.lambda), (reference.0[0][1][0][1], lame.mu)]
            {
                assert!((expected - found).abs() <= tolerance * 1e6, "{}: {found}", spec.name());
            }
            let error = difference(&reference, &model.hessian(&identity, Psd::Exact));
            assert!(error < 1e-13, "{} {D}D: {error:e}", spec.name());
        }
    }
    check::<2>();
    check::<3>();
}

/// Uniaxial tension, small: stress over strain is E, contraction over extension is nu. lecture 17
#[test]
fn young_and_poisson_are_what_a_tensile_test_measures() {
    let mut without_poisson = vec![];
    for (young, poisson) in [(1e6, 0.3), (3e6, 0.0), (2e9, -0.2), (1e5, 0.45), (1.0, 0.4999)] {
        for spec in MaterialSpec::examples().iter().filter(|spec| spec.lame().is_some()) {
            let mut table = serde_json::to_value(spec).unwrap();
            let parameters = table.get_mut(spec.name()).unwrap();
            if spec.name() == "expression" {
                let Lame { lambda, mu } = Lame::new(young, poisson);
                parameters["parameters"] = serde_json::json!({ "mu": mu, "lambda": lambda });
            } else {
                parameters["young"] = young.into();
                parameters["poisson"] = poisson.into();
            }
            let spec: MaterialSpec = serde_json::from_value(table).unwrap();
            if spec.check().is_err() {
                assert!(poisson != 0.0, "{}: every model takes 0", spec.name());
                without_poisson.push(spec.name());
                continue;
            }
            let model = super::probe::<3>(&spec);
            let strain = 1e-7;
            let f = Mat::diagonal(&[1.0 + strain, 1.0 - poisson * strain, 1.0 - poisson * strain]);
            let p = model.pk1(&f);
            // Second order in the strain, times the bulk modulus.
            let tolerance = 100.0 * strain / (1.0 - 2.0 * poisson);
            assert!((p[0][0] / strain / young - 1.0).abs() < tolerance, "{}", spec.name());
            assert!((p[1][1] / strain / young).abs() < tolerance, "{}", spec.name());
        }
    }
    assert_eq!(without_poisson, ["arap"; 4]);
}
