use super::double_double::DoubleDouble;
use super::sample::{Random, all_nan, categories, largest, not_finite, orthogonality};
use crate::algebra::{Mat, signed_svd};

/// Orthogonality and reconstruction relative to `|F|`, order and sign, in every category.
fn decomposes<const D: usize>() {
    for (name, generate) in categories::<D>() {
        let mut random = Random(1);
        for _ in 0..5000 {
            let f = generate(&mut random);
            let s = signed_svd(&f);
            let norm = f.norm_squared().sqrt();
            assert!(orthogonality(&s.u) < 3e-15, "{name}: U {:e} {f:?}", orthogonality(&s.u));
            assert!(orthogonality(&s.v) < 3e-15, "{name}: V {:e}", orthogonality(&s.v));
            assert!(s.u.determinant() > 0.0 && s.v.determinant() > 0.0, "{name}: not rotations");
            let back = s.u.mul(&Mat::diagonal(&s.sigma)).mul_transpose(&s.v);
            let error = largest(&(back - f)) / norm;
            assert!(error < 2e-15, "{name}: reconstruction {error:e} {f:?}");
            for i in 1..D {
                assert!(s.sigma[i - 1] >= s.sigma[i].abs(), "{name}: order {:?}", s.sigma);
            }
            let j = f.determinant();
            let product: f64 = s.sigma.iter().product();
            assert!((j - product).abs() < 1e-14 * norm.powi(D as i32), "{name}: sign of J");
        }
    }
}

#[test]
fn two_dimensions() {
    decomposes::<2>();
}

#[test]
fn three_dimensions() {
    decomposes::<3>();
}

/// The singular values to about 30 digits: what is left after decomposing once is decomposed again.
fn reference<const D: usize>(f: &Mat<f64, D>) -> [f64; D] {
    let f = Mat::<DoubleDouble, D>::splat(f);
    let once = signed_svd(&f);
    signed_svd(&once.u.transpose_mul(&f).mul(&once.v)).sigma.map(|x| x.0)
}

/// The absolute error of every singular value is a few roundings of `|F|`; where they are of one size that
/// is a relative error.
#[test]
fn singular_values_agree_with_twice_the_precision() {
    fn check<const D: usize>() {
        for (name, generate) in categories::<D>() {
            let mut random = Random(13);
            let (mut worst, mut worst_relative) = (0.0f64, 0.0f64);
            for _ in 0..1000 {
                let f = generate(&mut random);
                let norm = f.norm_squared().sqrt();
                for (x, exact) in signed_svd(&f).sigma.iter().zip(reference(&f)) {
                    worst = worst.max((x - exact).abs() / norm);
                    worst_relative = worst_relative.max(((x - exact) / exact).abs());
                }
            }
            assert!(worst < 8e-16, "{name}: {worst:e} of |F|");
            if ["identity", "rotation", "near identity", "clustered", "moderate"].contains(&name) {
                assert!(worst_relative < 3e-15, "{name}: {worst_relative:e}");
            }
        }
    }
    check::<2>();
    check::<3>();
}

#[test]
fn extremes() {
    fn check<const D: usize>() {
        let zero = signed_svd(&Mat::<f64, D>::zero());
        assert_eq!((zero.u, zero.sigma, zero.v), (Mat::identity(), [0.0; D], Mat::identity()));
        for scale in [1e-140, 1e-70, 1e70, 1e150] {
            let mut random = Random(3);
            let g = random.gaussian::<D>();
            let (s, scaled) = (signed_svd(&g), signed_svd(&g.scale(scale)));
            for i in 0..D {
                assert!((scaled.sigma[i] / scale - s.sigma[i]).abs() < 3e-15 * s.sigma[0], "{scale:e}");
            }
        }
        for f in not_finite::<D>() {
            let s = signed_svd(&f);
            assert!(all_nan(&s.u) && all_nan(&s.v) && s.sigma.iter().all(|x| x.is_nan()), "{f:?} {s:?}");
        }
        // One column or row only: the other directions are arbitrary but orthonormal.
        for k in 0..D {
            let mut f = Mat::<f64, D>::zero();
            f[k][D - 1 - k] = -2.0;
            let s = signed_svd(&f);
            assert_eq!(s.sigma[0], 2.0);
            assert!(orthogonality(&s.u) < 1e-15 && orthogonality(&s.v) < 1e-15);
        }
    }
    check::<2>();
    check::<3>();
}
