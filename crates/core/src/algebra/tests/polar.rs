use super::double_double::DoubleDouble;
use super::sample::{Random, all_nan, categories, largest, not_finite, orthogonality};
use crate::algebra::{Mat, rotation, signed_svd};
use crate::scalar::Scalar;

/// The rotation to about 30 digits: Newton's method on `tr(R^T F)` over SO(D), then orthonormalised.
fn reference<const D: usize>(f: &Mat<f64, D>) -> Mat<f64, D> {
    type Number = DoubleDouble;
    let scale = Number::splat(1.0 / f.norm_squared().sqrt());
    let f = Mat::<Number, D>::splat(f).scale(scale);
    let svd = signed_svd(&Mat(f.0.map(|row| row.map(|x| x.0))));
    let mut r = Mat::<Number, D>::splat(&svd.u.mul_transpose(&svd.v));
    let half = Number::splat(0.5);
    for _ in 0..6 {
        let a = r.transpose_mul(&f);
        let s = a.symmetric();
        // (tr S I - S) w = axial(A - A^T), R <- R exp([w]); in 2D tr S w = A_10 - A_01.
        let mut w = Mat::zero();
        if D == 2 {
            w[1][0] = (a[1][0] - a[0][1]) / s.trace();
            w[0][1] = -w[1][0];
        } else {
            let m = (Mat::scalar(s.trace()) - s).inverse();
            let axial: [Number; D] =
                std::array::from_fn(|i| a[(i + 2) % D][(i + 1) % D] - a[(i + 1) % D][(i + 2) % D]);
            let v = m.mul_vec(&axial);
            for i in 0..D {
                let (p, q) = ((i + 1) % D, (i + 2) % D);
                w[q][p] = v[i];
                w[p][q] = -v[i];
            }
        }
        r = r.mul(&(Mat::identity() + w + w.mul(&w).scale(half)));
        for _ in 0..3 {
            let e = Mat::scalar(Number::splat(3.0)) - r.transpose_mul(&r);
            r = r.mul(&e).scale(half);
        }
    }
    Mat(r.0.map(|row| row.map(|x| x.0)))
}

/// In three dimensions, by category: the error in `R` times `(s2 + s3) / |F|`, and the largest entry of `R^T
/// R - I`.
const BARS: [(&str, f64, f64); 13] = [
    ("identity", 1e-15, 2e-15),
    ("rotation", 1e-15, 2e-15),
    ("near identity", 2.4e-15, 6e-15),
    ("clustered", 2e-15, 6e-15),
    ("moderate", 3e-15, 4e-14),
    ("inverted", 6e-14, 2e-12),
    ("flat", 8e-15, 1e-13),
    ("singular", 8e-15, 1e-13),
    ("rank one", 1e-15, 3e-15),
    ("ambiguous", 1e-15, 3e-15),
    ("gaussian", 6e-14, 3e-12),
    ("scaled gaussian", 6e-14, 3e-12),
    ("independent", 7e-14, 3e-12),
];

/// Error against the reference, times what conditioning allows, and orthogonality, worst of each category.
fn accuracy<const D: usize>(conditioned: f64, orthonormal: f64) {
    for (name, generate) in categories::<D>() {
        let mut random = Random(2);
        let (mut worst, mut worst_plain, mut worst_orthogonality) = (0.0f64, 0.0f64, 0.0f64);
        for _ in 0..3000 {
            let f = generate(&mut random);
            let r = rotation(&f);
            let sigma = signed_svd(&f).sigma;
            let error = largest(&(r - reference(&f)));
            // Where it is below rounding, so is all information about R.
            let gap = (sigma[D - 2] + sigma[D - 1]) / f.norm_squared().sqrt();
            if gap > 1e-13 {
                worst = worst.max(error * gap);
                worst_plain = worst_plain.max(error);
            }
            worst_orthogonality = worst_orthogonality.max(orthogonality(&r));
            assert!(r.determinant() > 0.0, "{name}: {r:?}");
        }
        assert!(worst < conditioned, "{name}: {worst:e}");
        if D == 3 {
            let (_, conditioned, orthonormal) = BARS.into_iter().find(|bar| bar.0 == name).expect("a bar");
            assert!(worst < conditioned, "{name}: {worst:e}");
            assert!(worst_orthogonality < orthonormal, "{name}: {worst_orthogonality:e}");
        }
        assert!(worst_orthogonality < orthonormal, "{name}: {worst_orthogonality:e}");
        if ["identity", "rotation", "near identity", "clustered", "moderate"].contains(&name) {
            assert!(worst_plain < 3e-14, "{name}: {worst_plain:e}");
        }
    }
}

// lecture 15
#[test]
fn two_dimensions() {
    accuracy::<2>(2e-15, 2e-15);
}

// lecture 15: a rotation also where det F < 0
#[test]
fn three_dimensions() {
    accuracy::<3>(1e-13, 4e-12);
}

#[test]
fn extremes() {
    fn check<const D: usize>() {
        assert_eq!(rotation(&Mat::<f64, D>::zero()), Mat::identity());
        for f in not_finite::<D>() {
            assert!(all_nan(&rotation(&f)), "{f:?} {:?}", rotation(&f));
        }
        for scale in [1e-140, 1e-70, 1e70, 1e150] {
            let g = Random(3).gaussian::<D>();
            assert!(largest(&(rotation(&g) - rotation(&g.scale(scale)))) < 1e-14, "{scale:e}");
        }
        // A reflection: singular values 1, ..., -1 leave R undetermined, but it is a rotation.
        let mut reflection = Mat::<f64, D>::identity();
        reflection[0][0] = -1.0;
        let r = rotation(&reflection);
        assert!(orthogonality(&r) < 1e-15 && r.determinant() > 0.0);
    }
    check::<2>();
    check::<3>();
}
