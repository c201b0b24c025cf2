//! Collapsed, inverted, enormous and undefined deformations.

use super::{LAMBDA, MU, models, named};
use crate::algebra::Mat;
use crate::algebra::tests::sample::{Random, not_finite};
use crate::material::{Domain, Psd};

/// `psi / mu` in the principal stretches below, nu = 0.3.
const STRETCHES: [[f64; 3]; 6] = [
    [0.1, 1.0, 1.0],
    [1e-6, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
    [-1.0, -1.0, -1.0],
    [0.0, 0.0, 0.0],
    [10.0, 10.0, 10.0],
];
const INFINITE: f64 = f64::INFINITY;
#[rustfmt::skip]
const ENERGIES: [(&str, [f64; 6]); 12] = [
    ("stvk", [0.42879375, 0.437499999999125, 0.0, 0.0, 2.4375, 23889.9375]),
    // -I in space has the stretches (1, 1, -1): |F - R|^2 = 6 - 2 tr(-R) = 4 and tr(S - I) = -2, with tr R >=
    // -1.
    ("corotated", [1.4175, 1.74999650000175, 7.0, 7.0, 9.75, 789.75]),
    ("neo-hookean", [5.784008675852844, 156.46675954088152, INFINITE, INFINITE, INFINITE, 177.38005696674705]),
    ("stable-neo-hookean", [1.4175, 1.74999650000175, 7.0, 7.0, 0.75, 1246650.75]),
    ("stable-neo-hookean-log", [1.3745695215727375, 1.6917847149694651, 6.666666666666667, 6.666666666666667,
                                1.0908629074132604, 1163530.6194560642]),
    ("fixed-corotated", [1.4175, 1.74999650000175, 7.0, 7.0, 3.75, 748743.75]),
    ("arap", [0.81, 0.999998000001, 4.0, 4.0, 3.0, 243.0]),
    ("neo-hookean-j", [2.4150850929940457, 14.065509057965524, INFINITE, INFINITE, INFINITE, 748642.342244721]),
    ("isochoric-neo-hookean", [4.042296777780843, 9999.583331171667, INFINITE, INFINITE, INFINITE, 1081167.75]),
    ("mooney-rivlin", [5.306860806057196, 10007999.58335117, INFINITE, INFINITE, INFINITE, 1081167.75]),
    ("ogden", [4.090007203772657, 12545289.576010589, INFINITE, INFINITE, INFINITE, 1081167.75]),
    ("hencky", [9.278321693337196, 334.0195809601391, INFINITE, INFINITE, INFINITE, 51.69350657716438]),
];

// lecture 15, 16
#[test]
fn energies_of_collapsed_and_inverted_states() {
    for (name, energies) in ENERGIES {
        let model = named::<3>(name);
        for (stretches, expected) in STRETCHES.iter().zip(energies) {
            let mut random = Random(4);
            let (u, v) = (random.rotation::<3>(), random.rotation::<3>());
            for f in [Mat::diagonal(stretches), u.mul(&Mat::diagonal(stretches)).mul_transpose(&v)] {
                let psi = model.psi(&f) / MU;
                if expected.is_infinite() {
                    // Rounding may put a rotated zero on either side of the barrier.
                    assert!(psi == INFINITE || (psi > 1e3 && stretches[0] == 0.0), "{name}: {psi}");
                } else {
                    // Logarithms and powers of J = 1e-6 inherit the rounding of J, 1e-10 of it.
                    let tolerance = if model.domain() == Domain::PositiveJ { 1e-9 } else { 2e-14 };
                    let error = (psi - expected).abs();
                    assert!(error < tolerance * expected.max(1.0), "{name} {stretches:?}: {psi} {expected}");
                }
            }
        }
    }
}

/// In 2D `-I` is a rotation by half a turn, not an inversion.
#[test]
fn half_turn_in_the_plane_costs_nothing() {
    let half_turn = Mat::<f64, 2>::scalar(-1.0);
    for (spec, model) in models::<2>() {
        let about = spec.about();
        if about.frame_indifferent && about.has_rest_shape {
            assert!(model.psi(&half_turn).abs() < 1e-9, "{}", spec.name());
        }
    }
    let psi = named::<2>("linear").psi(&half_turn);
    assert!((psi - (8.0 * MU + 8.0 * LAMBDA)).abs() < 1e-14 * psi);
}

fn is_finite<const D: usize>(m: &Mat<f64, D>) -> bool {
    m.0.iter().flatten().all(|x| x.is_finite())
}

#[test]
fn everything_is_finite_where_the_model_is_defined() {
    fn check<const D: usize>() {
        let mut reflection = Mat::<f64, D>::identity();
        reflection[0][0] = -1.0;
        let mut flat = Mat::<f64, D>::identity();
        flat[D - 1][D - 1] = 0.0;
        let mut line = Mat::<f64, D>::zero();
        line[0][D - 1] = 2.0;
        let states = [Mat::zero(), reflection, flat, line, Mat::scalar(-1.0), Mat::scalar(100.0)];
        for (spec, model) in models::<D>() {
            for f in &states {
                let name = spec.name();
                if model.domain() == Domain::PositiveJ && f.determinant() <= 0.0 {
                    assert_eq!(model.psi(f), f64::INFINITY, "{name}");
                    // The stress must not be finite.
                    assert!(!is_finite(&model.pk1(f)) && !is_finite(&model.derived_pk1(f)), "{name} {f:?}");
                    continue;
                }
                assert!(model.psi(f).is_finite() && is_finite(&model.pk1(f)), "{name} {f:?}");
                assert!(is_finite(&model.derived_pk1(f)), "{name} {f:?}");
                for psd in [Psd::Exact, Psd::Projected] {
                    let h = model.hessian(f, psd);
                    assert!(h.0.iter().flatten().all(is_finite), "{name} {f:?}");
                    let lambda = super::eigenvalues(&h);
                    let largest = lambda.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                    assert!(psd == Psd::Exact || lambda[0] >= -1e-12 * largest, "{name} {lambda:?}");
                }
            }
        }
    }
    check::<2>();
    check::<3>();
}

#[test]
fn input_that_is_not_finite_is_seen_in_the_output() {
    fn check<const D: usize>() {
        for (spec, model) in models::<D>() {
            // The first is finite but large.
            for f in not_finite::<D>().iter().skip(1) {
                assert!(!model.psi(f).is_finite(), "{} {f:?}", spec.name());
                assert!(!is_finite(&model.pk1(f)), "{} {f:?}", spec.name());
                assert!(!is_finite(&model.derived_pk1(f)), "{} {f:?}", spec.name());
            }
        }
    }
    check::<2>();
    check::<3>();
}
