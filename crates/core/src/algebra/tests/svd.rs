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
