//! The Holzapfel-Gasser-Ogden model against closed-form solutions.

use super::{Probe, eigenvalues, flat, probe, samples, stress_scale};
use crate::algebra::Mat;
use crate::algebra::tests::sample::{Random, largest};
use crate::material::{DispersedFibres, Isotropic, MaterialSpec, Parameters, Psd};

/// Shear and bulk modulus of the matrix, `k1` [kPa], and `k2`, for the middle layer of an artery: those of
/// Holzapfel, Gasser and Ogden 2000, and a bulk modulus.
const C: f64 = 3.0;
const BULK: f64 = 100.0;
const K1: f64 = 2.3632;
const K2: f64 = 0.8393;

fn parameters(dispersion: f64, fibres: &[[f64; 3]]) -> DispersedFibres {
    let fibres = fibres.iter().map(|fibre| fibre.to_vec()).collect();
    DispersedFibres { shear: C, bulk: BULK, k1: K1, k2: K2, dispersion, fibres }
}

fn tissue<const D: usize>(dispersion: f64, fibres: &[[f64; 3]]) -> Box<dyn Probe<D>> {
    let spec = MaterialSpec::HolzapfelGasserOgden(parameters(dispersion, fibres));
    assert_eq!(spec.check(), Ok(()));
    probe(&spec)
}

/// The matrix alone: `E = 9 K G / (3 K + G)`, `nu = (3 K - 2 G) / (6 K + 2 G)`.
fn matrix<const D: usize>() -> Box<dyn Probe<D>> {
    let young = 9.0 * BULK * C / (3.0 * BULK + C);
    let poisson = (3.0 * BULK - 2.0 * C) / (6.0 * BULK + 2.0 * C);
    probe(&MaterialSpec::IsochoricNeoHookean(Isotropic::new(young, poisson)))
}

/// Isochoric tension, with stretch `l` along the fibres and `l^(-1/2)` across. With `I1 = l^2 + 2/l`,
/// `I4 = l^2` and `E = kappa (I1 - 3) + (1 - 3 kappa) (l^2 - 1)`,
///
/// ```text
/// psi(l)            = c/2 (I1 - 3) + k1/(2 k2) (exp(k2 E^2) - 1)
/// sigma_1 - sigma_2 = l dpsi/dl
///                   = c (l^2 - 1/l) + k1 E exp(k2 E^2) (2 kappa (l^2 - 1/l) + 2 (1 - 3 kappa) l^2)
/// ```
///
/// for any pressure, which here is `tr sigma = 3 K (J - 1) = 0`.
#[test]
fn tension_along_the_fibres_has_its_closed_form() {
    for kappa in [0.0, 0.1, 0.226, 1.0 / 3.0] {
        for l in [1.01, 1.1, 1.4, 1.8f64] {
            let model = tissue::<3>(kappa, &[[2.0, 0.0, 0.0]]);
            let across = l.powf(-0.5);
            let f = Mat::diagonal(&[l, across, across]);
            let shape = l * l - 1.0 / l;
            let e = kappa * (l * l + 2.0 / l - 3.0) + (1.0 - 3.0 * kappa) * (l * l - 1.0);
            let stiffened = (K2 * e * e).exp();
            let psi = 0.5 * C * (l * l + 2.0 / l - 3.0) + K1 / (2.0 * K2) * (stiffened - 1.0);
            let fibres = K1 * e * stiffened * (2.0 * kappa * shape + 2.0 * (1.0 - 3.0 * kappa) * l * l);
            let expected = C * shape + fibres;
            let p = model.pk1(&f);
            let found = p[0][0] * l - p[1][1] * across;
            assert!((model.psi(&f) / psi - 1.0).abs() < 1e-11, "kappa {kappa}, l {l}");
            assert!((found / expected - 1.0).abs() < 1e-11, "kappa {kappa}, l {l}: {found} {expected}");
            let trace = p[0][0] * l + 2.0 * p[1][1] * across;
            assert!(trace.abs() < 1e-12 * (BULK + expected), "kappa {kappa}, l {l}: {trace}");
        }
    }
}

/// Biaxial tension of two families at angles `b` and `-b` to the first axis, with stretches `l1` and `l2`
/// along the axes and `1/(l1 l2)` across: both have `I4 = l1^2 cos^2 b + l2^2 sin^2 b`, and with
/// `m = 1/(l1 l2)^2`
///
/// ```text
/// sigma_1 - sigma_3 = c (l1^2 - m) + 2 k1 E exp(k2 E^2) (2 kappa (l1^2 - m) + 2 (1 - 3 kappa) l1^2 cos^2 b)
/// sigma_2 - sigma_3 = c (l2^2 - m) + 2 k1 E exp(k2 E^2) (2 kappa (l2^2 - m) + 2 (1 - 3 kappa) l2^2 sin^2 b)
/// ```
#[test]
fn biaxial_tension_of_a_pair_of_families_has_its_closed_form() {
    for (kappa, angle) in [(0.0, 29f64), (0.15, 29.0), (0.226, 49.98)] {
        let b = angle.to_radians();
        let (sin, cos) = b.sin_cos();
        let mut parameters = parameters(kappa, &[]);
        parameters.fibres = DispersedFibres::pair(b);
        let model = probe::<3>(&MaterialSpec::HolzapfelGasserOgden(parameters));
        for [l1, l2] in [[1.2, 1.2], [1.3, 1.05], [1.02, 1.4f64]] {
            let l3 = 1.0 / (l1 * l2);
            let (m, i4) = (l3 * l3, l1 * l1 * cos * cos + l2 * l2 * sin * sin);
            let e = kappa * (l1 * l1 + l2 * l2 + m - 3.0) + (1.0 - 3.0 * kappa) * (i4 - 1.0);
            assert!(e > 0.0);
            let tension = 2.0 * K1 * e * (K2 * e * e).exp();
            let expected = |l: f64, share: f64| {
                C * (l * l - m)
                    + tension * (2.0 * kappa * (l * l - m) + 2.0 * (1.0 - 3.0 * kappa) * l * l * share)
            };
            let p = model.pk1(&Mat::diagonal(&[l1, l2, l3]));
            let third = p[2][2] * l3;
            for (found, expected) in [
                (p[0][0] * l1 - third, expected(l1, cos * cos)),
                (p[1][1] * l2 - third, expected(l2, sin * sin)),
            ] {
                assert!((found / expected - 1.0).abs() < 1e-11, "{kappa} {l1} {l2}: {found} {expected}");
            }
            // The shear stresses of the two families cancel.
            assert!(p[0][1].abs() < 1e-13 * third.abs().max(C), "{p:?}");
        }
    }
}

/// Fibre and shape terms do not depend on volume: the pressure is `K (J - 1)`, and the remaining stress
/// is that at `J^(-1/3) F`, divided by `J`.
#[test]
fn volume_is_apart_from_fibres() {
    let model = tissue::<3>(0.1, &[[1.0, 0.5, 0.0], [0.3, -1.0, 0.4]]);
    for f in samples::<3>(false) {
        let j = f.determinant();
        let unimodular = f.scale(j.powf(-1.0 / 3.0));
        let stress = |f: &Mat<f64, 3>| model.pk1(f).mul_transpose(f).scale(1.0 / f.determinant());
        let scale = largest(&stress(&unimodular)) + BULK;
        if !scale.is_finite() {
            continue;
        }
        let expected = stress(&unimodular).scale(1.0 / j) + Mat::scalar(BULK * (j - 1.0));
        let error = largest(&(stress(&f) - expected)) / (scale * (1.0 + 1.0 / j));
        assert!(error < 1e-11, "{error:e} {f:?}");
    }
}

#[test]
fn slack_fibres_are_not_there() {
    // Fibres are shortened; a shear along them changes neither their length nor the volume.
    let shorter = Mat([[0.8, 0.1, 0.0], [0.0, 1.1, 0.2], [0.1, 0.0, 1.2]]);
    let model = tissue::<3>(0.0, &[[1.0, 0.0, 0.0]]);
    let matrix = matrix::<3>();
    assert!((model.psi(&shorter) / matrix.psi(&shorter) - 1.0).abs() < 1e-13);
    assert!(largest(&(model.pk1(&shorter) - matrix.pk1(&shorter))) < 1e-12 * BULK);
    let same = super::difference(&model.hessian(&shorter, Psd::Exact), &matrix.hessian(&shorter, Psd::Exact));
    assert!(same < 1e-12, "{same:e}");
    // Of two families only the stretched one acts.
    let two = tissue::<3>(0.0, &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let one = tissue::<3>(0.0, &[[0.0, 1.0, 0.0]]);
    assert_eq!(two.pk1(&shorter), one.pk1(&shorter));
    assert!(largest(&(one.pk1(&shorter) - matrix.pk1(&shorter))) > 0.1 * C);
}

#[test]
fn families_that_change_places_are_the_same_material() {
    let (a, b) = ([1.0, 0.5, 0.2], [-0.3, 1.0, 0.4]);
    // A direction and its opposite are equivalent.
    let back = b.map(|x| -x);
    let (first, second) = (tissue::<3>(0.1, &[a, b]), tissue::<3>(0.1, &[back, a]));
    let mut random = Random(8);
    for _ in 0..50 {
        let f = random.gaussian::<3>().scale_add(0.15, &Mat::identity());
        if f.determinant() < 0.1 {
            continue;
        }
        let error = largest(&(first.pk1(&f) - second.pk1(&f))) / stress_scale(&*first, &f);
        assert!(error < 1e-14, "{error:e}");
    }
}

#[test]
fn only_fibres_in_all_directions_alike_are_isotropic() {
    let mut random = Random(9);
    let (f, q) = (random.gaussian::<3>().scale_add(0.1, &Mat::identity()), random.rotation::<3>());
    let effect = |kappa: f64| {
        let model = tissue::<3>(kappa, &[[1.0, 0.0, 0.0]]);
        let p = model.pk1(&f);
        largest(&(model.pk1(&f.mul(&q)) - p.mul(&q))) / largest(&p)
    };
    assert!(effect(1.0 / 3.0) < 1e-13, "{:e}", effect(1.0 / 3.0));
    assert!(effect(0.1) > 1e-3, "{:e}", effect(0.1));
}

/// In 2D `F_33 = 1`, also for a direction that points out of the plane.
#[test]
fn the_plane_is_one_of_plane_strain() {
    let fibres = [[1.0, 0.5, 0.7], [-0.2, 1.0, 0.0]];
    let (plane, solid) = (tissue::<2>(0.1, &fibres), tissue::<3>(0.1, &fibres));
    let f = Mat([[1.2, 0.3], [-0.1, 1.05]]);
    let in_space = Mat([[1.2, 0.3, 0.0], [-0.1, 1.05, 0.0], [0.0, 0.0, 1.0]]);
    assert!((plane.psi(&f) / solid.psi(&in_space) - 1.0).abs() < 1e-14);
    let (p, q) = (plane.pk1(&f), solid.pk1(&in_space));
    for i in 0..2 {
        for j in 0..2 {
            assert!((p[i][j] - q[i][j]).abs() < 1e-13 * largest(&q), "{p:?} {q:?}");
        }
    }
}

/// Compares the compliance of the full initial stiffness, from its eigenvectors, with the Woodbury
/// formula.
#[test]
fn the_modulus_along_fibres_is_that_of_the_stiffness_at_rest() {
    for (kappa, fibres) in [
        (0.0, vec![[0.0, 0.0, 1.0]]),
        (0.2, vec![[1.0, 1.0, 0.0]]),
        (0.05, vec![[0.8, 0.6, 0.0], [0.8, -0.6, 0.0]]),
    ] {
        let parameters = parameters(kappa, &fibres);
        let model = probe::<3>(&MaterialSpec::HolzapfelGasserOgden(parameters.clone()));
        let stiffness = flat(&model.hessian(&Mat::identity(), Psd::Exact));
        // Rotations have no stiffness: the pseudo-inverse omits them.
        let compliance = stiffness.pseudo_inverse(1e-9 * BULK).unwrap();
        for (index, fibre) in fibres.iter().enumerate() {
            let length = fibre.iter().map(|x| x * x).sum::<f64>().sqrt();
            let pull = nalgebra::DVector::from_fn(9, |k, _| fibre[k % 3] * fibre[k / 3] / (length * length));
            let expected = 1.0 / (pull.transpose() * &compliance * &pull)[(0, 0)];
            let found = parameters.young_along(index);
            assert!((found / expected - 1.0).abs() < 1e-10, "{kappa}: {found} {expected}");
            assert!(found > parameters.matrix().young_and_poisson().0);
        }
    }
    // Stretched fibres stiffen, and nothing at rest is soft.
    let model = tissue::<3>(0.0, &[[1.0, 0.0, 0.0]]);
    assert!(eigenvalues(&model.hessian(&Mat::identity(), Psd::Exact))[0] > -1e-10 * BULK);
}

#[test]
fn impossible_constants_of_fibres_are_named() {
    let message = |change: fn(&mut DispersedFibres)| {
        let mut fibres = parameters(0.1, &[[1.0, 0.0, 0.0]]);
        change(&mut fibres);
        fibres.check().expect_err("impossible").to_string()
    };
    for (found, expected) in [
        (message(|p| p.shear = 0.0), "shear = 0: must be positive"),
        (message(|p| p.bulk = -1.0), "bulk = -1: must be positive"),
        (message(|p| p.k1 = f64::NAN), "k1 = NaN: must be a finite number"),
        (message(|p| p.k2 = 0.0), "k2 = 0: must be positive"),
        (message(|p| p.dispersion = 0.34), "dispersion = 0.34: must be between 0"),
        (message(|p| p.dispersion = -0.1), "dispersion = -0.1: must be between 0"),
        (message(|p| p.fibres.clear()), "fibres = 0: is the number of families"),
        (message(|p| p.fibres = vec![vec![1.0, 0.0]; 3]), "fibres = 3: is the number of families"),
        (message(|p| p.fibres = vec![vec![1.0]]), "fibres[0] = 1: is the number of components"),
        (message(|p| p.fibres.push(vec![0.0; 3])), "fibres[1] = 0: is the length of the direction"),
    ] {
        assert!(found.starts_with(expected), "{found}");
    }
    let read = |text: &str| {
        let table =
            format!("m = {{ holzapfel-gasser-ogden = {{ {text} }} }}").parse::<toml::Table>().unwrap();
        <MaterialSpec as serde::Deserialize>::deserialize(table["m"].clone())
            .map_err(|error| error.to_string())
    };
    let constants = "shear = '3 kPa', bulk = '100 kPa', k1 = '2.3632 kPa', k2 = 0.8393";
    let Ok(MaterialSpec::HolzapfelGasserOgden(pair)) = read(&format!("{constants}, angle = '30 deg'")) else {
        panic!("a pair by its angle");
    };
    let (sin, cos) = (30f64).to_radians().sin_cos();
    assert_eq!(pair.fibres, [vec![cos, sin, 0.0], vec![cos, -sin, 0.0]]);
    assert_eq!((pair.shear, pair.dispersion), (3e3, 0.0));
    let both = read(&format!("{constants}, angle = 0.1, fibres = [[1, 0]]")).unwrap_err();
    assert!(both.contains("`fibres` and `angle`"), "{both}");
}
