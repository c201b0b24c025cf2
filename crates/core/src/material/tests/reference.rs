//! Models against independent values with 50 digits, see the note in the data files.

use std::collections::BTreeMap;

use super::{Probe, eigenvalues, flat, named};
use crate::algebra::Mat;
use crate::material::{Domain, MaterialSpec, Psd};

/// Singular values 1.309, 1.179, 0.728; determinant 1.1245.
const F3: Mat<f64, 3> = Mat([[1.2, 0.3, -0.1], [0.05, 0.9, 0.2], [-0.15, 0.1, 1.1]]);
/// Singular values 1.130, 0.909, -0.708; determinant -0.7275.
const F3_INVERTED: Mat<f64, 3> = Mat([[1.1, 0.2, 0.1], [-0.1, 0.9, 0.15], [0.05, 0.1, -0.7]]);
/// Singular values 1.246, 0.843; determinant 1.05.
const F2: Mat<f64, 2> = Mat([[1.2, 0.3], [-0.1, 0.85]]);

#[derive(serde::Deserialize)]
struct Point {
    psi: f64,
    #[serde(rename = "P")]
    stress: Vec<f64>,
    #[serde(rename = "H")]
    tangent: Vec<f64>,
}

fn read<T: serde::de::DeserializeOwned>(text: &str) -> BTreeMap<String, BTreeMap<String, T>> {
    let mut table: serde_json::Map<String, serde_json::Value> = serde_json::from_str(text).unwrap();
    table.remove("note");
    // The example formula is that of this model.
    let known = table["stable-neo-hookean"].clone();
    table.insert("expression".to_owned(), known);
    table.into_iter().map(|(name, value)| (name, serde_json::from_value(value).unwrap())).collect()
}

/// Checks that every model of a real material is in the data, except `without`.
fn covers_the_registry<'a>(names: impl Iterator<Item = &'a String>, without: &[&str]) {
    let names: Vec<&str> = names.map(String::as_str).collect();
    for spec in MaterialSpec::examples().iter().filter(|spec| spec.lame().is_some()) {
        let name = spec.name();
        assert!(names.contains(&name) != without.contains(&name), "{name} has no reference values");
    }
}

fn compare<const D: usize>(name: &str, model: &dyn Probe<D>, f: &Mat<f64, D>, point: &Point) {
    const TOLERANCE: f64 = 1e-11;
    assert!((model.psi(f) / point.psi - 1.0).abs() < TOLERANCE, "{name}: psi {}", model.psi(f));
    let p = model.pk1(f);
    let largest = point.stress.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    for (i, expected) in point.stress.iter().enumerate() {
        assert!((p[i / D][i % D] - expected).abs() < TOLERANCE * largest, "{name}: P {p:?}");
    }
    let h = flat(&model.hessian(f, Psd::Exact));
    let largest = h.amax();
    for (k, expected) in point.tangent.iter().enumerate() {
        let (i, j) = (k / (D * D), k % (D * D));
        assert!((h[(i, j)] - expected).abs() < TOLERANCE * largest, "{name}: H_{i}{j} {}", h[(i, j)]);
    }
}

// lecture 16
#[test]
fn energy_stress_and_tangent() {
    let data = read::<Point>(include_str!("../../../tests-data/constitutive.json"));
    covers_the_registry(data.keys(), &[]);
    for (name, points) in &data {
        compare(name, &*named::<2>(name), &F2, &points["F2"]);
        let model = named::<3>(name);
        compare(name, &*model, &F3, &points["F3"]);
        match points.get("F3inv") {
            Some(point) => compare(name, &*model, &F3_INVERTED, point),
            None => assert_eq!(model.domain(), Domain::PositiveJ),
        }
    }
}

/// The smallest and the largest eigenvalue in the same state, from a numerical eigensolution.
#[test]
fn extreme_eigenvalues() {
    for (name, smallest, largest) in [
        ("stvk", 207_026.923_404_3, 3_606_695.073_619),
        ("corotated", 93_839.998_248_07, 2.5e6),
        ("fixed-corotated", 56_754.932_815_95, 3_241_041.097_257),
        ("arap", -37_282.847_007_84, 769_230.769_230_8),
        ("neo-hookean", 15_633.172_790_25, 2_680_872.790_116),
        ("stable-neo-hookean", 37_795.995_840_9, 3_733_377.507_613),
        ("stable-neo-hookean-log", 44_911.594_503_47, 3_605_072.107_048),
        ("neo-hookean-j", 30_855.012_536_88, 3_400_244.678_601),
        ("isochoric-neo-hookean", -10_248.269_667_92, 4_109_608.057_396),
        ("mooney-rivlin", -17_560.644_338_06, 4_201_726.320_725),
        ("ogden", -12_049.558_739_01, 4_141_999.107_963),
        ("hencky", -40_249.088_251_91, 3_250_556.464_022),
    ] {
        let eigenvalues = eigenvalues(&named::<3>(name).hessian(&F3, Psd::Exact));
        assert!((eigenvalues[0] - smallest).abs() < 1e-5, "{name}: {eigenvalues:?}");
        assert!((eigenvalues[8] - largest).abs() < 1e-5, "{name}: {eigenvalues:?}");
    }
}

/// Returns the lateral stretch at which `stress` vanishes, by bisection.
fn free_lateral(stress: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.3, 1.7);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if stress(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

// lecture 16, 17
#[test]
fn responses_to_simple_loading() {
    let data = read::<Vec<f64>>(include_str!("../../../tests-data/responses.json"));
    // The linear model has no entry: its responses are its two constants.
    covers_the_registry(data.keys(), &["linear"]);
    for (name, responses) in &data {
        let (plane, solid) = (named::<2>(name), named::<3>(name));
        for (test, expected) in responses {
            let (kind, amount) = test.split_once(' ').unwrap();
            let s: f64 = amount.parse().unwrap();
            let got = match kind {
                "uniaxial" => {
                    let f = |t| Mat::diagonal(&[s, t, t]);
                    let t = free_lateral(|t| solid.pk1(&f(t))[1][1]);
                    vec![t, solid.pk1(&f(t))[0][0]]
                }
                "equibiaxial" => {
                    let f = |t| Mat::diagonal(&[s, s, t]);
                    let t = free_lateral(|t| solid.pk1(&f(t))[2][2]);
                    vec![t, solid.pk1(&f(t))[0][0]]
                }
                "plane-strain" => {
                    let f = |t| Mat::diagonal(&[s, t]);
                    let t = free_lateral(|t| plane.pk1(&f(t))[1][1]);
                    vec![t, plane.pk1(&f(t))[0][0]]
                }
                "shear" => {
                    let p = plane.pk1(&Mat([[1.0, s], [0.0, 1.0]]));
                    vec![p[0][1], p[1][0], p[0][0], p[1][1]]
                }
                "volumetric" => vec![solid.pk1(&Mat::scalar(s))[0][0]],
                _ => panic!("unknown test {test}"),
            };
            let scale = expected.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            for (i, (a, b)) in got.iter().zip(expected).enumerate() {
                // Stretches are compared relative to themselves, a vanishing stress relative to its
                // neighbours.
                let scale = if got.len() == 2 && i == 0 { *b } else { scale };
                assert!((a - b).abs() <= 1e-9 * scale, "{name} {test}: {got:?} {expected:?}");
            }
        }
    }
}
