//! The derivative of the rotation in the corotated tangent.

use super::{LAMBDA, MU, difference, eigenvalues, models, named};
use crate::algebra::{Mat, rotation};
use crate::material::{Psd, Tangent};

/// Returns the tangent with `R` held constant: `2 mu dF + lambda (R : dF) R`.
fn without_rotation_derivative<const D: usize>(f: &Mat<f64, D>) -> Tangent<D> {
    let r = rotation(f);
    let mut t = Tangent::identity().scale(2.0 * MU);
    for i in 0..D {
        for j in 0..D {
            t.0[i][j] += r.scale(LAMBDA * r[i][j]);
        }
    }
    t
}

// lecture 16
#[test]
fn dropping_the_rotation_derivative_is_a_large_error() {
    let f2 = Mat([[1.2, 0.3], [-0.1, 0.85]]);
    let f3 = Mat([[1.2, 0.3, -0.1], [0.05, 0.9, 0.2], [-0.15, 0.1, 1.1]]);
    let (plane, solid) = (named::<2>("corotated"), named::<3>("corotated"));
    let error2 = |f| difference(&plane.hessian(f, Psd::Exact), &without_rotation_derivative(f));
    let error3 = |f| difference(&solid.hessian(f, Psd::Exact), &without_rotation_derivative(f));
    for (error, percent) in [
        (error2(&Mat::identity()), 34.8),
        (error3(&Mat::identity()), 43.9),
        (error2(&f2), 31.1),
        (error3(&f3), 34.8),
    ] {
        assert!((100.0 * error - percent).abs() < 0.05, "{error}");
    }
    assert!((eigenvalues(&without_rotation_derivative(&f3))[0] - 769_230.769_230_8).abs() < 1e-6);
    assert!((eigenvalues(&solid.hessian(&f3, Psd::Exact))[0] - 93_839.998_248_07).abs() < 1e-6);
}

/// In the reference configuration infinitesimal rotations cost no energy, in all models with a rest shape
/// but one.
#[test]
fn infinitesimal_rotations_are_free_at_rest() {
    fn check<const D: usize>() {
        for (spec, model) in models::<D>().into_iter().filter(|(spec, _)| spec.about().has_rest_shape) {
            let mut spin = Mat::<f64, D>::zero();
            spin[0][D - 1] = -1.0;
            spin[D - 1][0] = 1.0;
            let resistance = model.hessian(&Mat::identity(), Psd::Exact).apply(&spin).norm_squared().sqrt();
            if spec.name() == "displacement-gradient" {
                assert!((resistance - 1e6 * 2f64.sqrt()).abs() < 1e-9);
            } else {
                assert!(resistance < 1e-9, "{} {D}D: {resistance}", spec.name());
            }
        }
    }
    check::<2>();
    check::<3>();
}
