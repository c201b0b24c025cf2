use super::sample::{Random, categories, largest, not_finite};
use crate::algebra::{Dual, Mat, rotation, signed_svd};
use crate::scalar::Scalar;

/// `R(F)` and its derivative in the direction `d`.
fn directional<const D: usize>(f: &Mat<f64, D>, d: &Mat<f64, D>) -> (Mat<f64, D>, Mat<f64, D>) {
    Dual::parts(&Scalar::rotation(&Dual::along(f, d)))
}

#[test]
fn rotation_derivative_matches_differences() {
    fn check<const D: usize>() {
        for (name, generate) in categories::<D>() {
            let mut random = Random(11);
            for _ in 0..200 {
                let f = generate(&mut random);
                let f = f.scale(1.0 / f.norm_squared().sqrt());
                let d = random.gaussian::<D>();
                let (r, dr) = directional(&f, &d);
                assert_eq!(r, rotation(&f));
                assert!(largest(&dr).is_finite(), "{name}");
                // R^T dR is antisymmetric: R stays a rotation.
                assert!(largest(&r.transpose_mul(&dr).symmetric()) <= 1e-11 * largest(&dr), "{name}");
                let sigma = signed_svd(&f).sigma;
                let gap = sigma[D - 2] + sigma[D - 1];
                if gap > 0.05 {
                    let h = 1e-5 * gap;
                    let central =
                        (rotation(&d.scale_add(h, &f)) - rotation(&d.scale_add(-h, &f))).scale(0.5 / h);
                    let error = largest(&(central - dr)) / largest(&dr).max(1.0);
                    assert!(error < 1e-6, "{name}: {error:e} {sigma:?}");
                }
            }
        }
    }
    check::<2>();
    check::<3>();
}

#[test]
fn rotation_derivative_is_safe_where_it_is_undefined() {
    fn check<const D: usize>() {
        let mut reflection = Mat::<f64, D>::identity();
        reflection[D - 1][D - 1] = -1.0;
        let d = Random(1).gaussian();
        for f in [Mat::zero(), reflection] {
            assert!(largest(&directional(&f, &d).1).is_finite(), "{f:?}");
        }
        for f in not_finite::<D>() {
            assert!(largest(&directional(&f, &d).1).is_nan(), "{f:?}");
        }
    }
    check::<2>();
    check::<3>();
}

/// Every primitive against central differences, first and second derivatives.
#[test]
fn primitives() {
    type Two = Dual<Dual<f64>>;
    fn all<S: Scalar>(x: S) -> [S; 12] {
        let c = S::splat(-0.7);
        [
            x * x * x - x,
            c / x,
            x.sqrt(),
            x.ln(),
            (-x).abs() * x,
            (x * x).max(c),
            x.mul_add(x, c * x),
            (x * x).copysign(c),
            S::select(x.lt(S::splat(9.0)), x * x, c),
            (c * x).exp(),
            x.powf(c),
            x.powf(x),
        ]
    }
    let (x, h) = (1.3, 1e-4);
    let outer = Dual { value: x, derivative: 1.0 };
    let exact: [Two; 12] = all(Dual { value: outer, derivative: Dual::constant(1.0) });
    let (minus, at, plus) = (all(x - h), all(x), all(x + h));
    for i in 0..12 {
        assert_eq!(exact[i].value.value, at[i]);
        let first = (plus[i] - minus[i]) / (2.0 * h);
        let second = (plus[i] - 2.0 * at[i] + minus[i]) / (h * h);
        assert!((exact[i].value.derivative - first).abs() < 1e-7, "{i}");
        assert!((exact[i].derivative.value - first).abs() < 1e-7, "{i}");
        assert!((exact[i].derivative.derivative - second).abs() < 1e-6, "{i}");
    }
}
