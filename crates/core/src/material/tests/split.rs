//! Every model in two parts, of which one does not resist changes of volume much: what nodal integration is
//! made of.

use super::{probe, samples, stress_scale};
use crate::algebra::Mat;
use crate::material::{Domain, Isotropic, MaterialSpec, OgdenTerms, Plane, PlaneIsotropic, TwoConstants};

/// Every model, nearly incompressible where it can be, and in the ways in which it can be given.
fn specs() -> Vec<MaterialSpec> {
    let mut specs = MaterialSpec::examples();
    for poisson in [-0.4, 0.3, 0.45, 0.4999] {
        for spec in MaterialSpec::examples() {
            let mut value = serde_json::to_value(&spec).unwrap();
            let table = &mut value[spec.name()];
            if table.get("poisson").is_some() && spec.name() != "arap" {
                table["poisson"] = poisson.into();
                specs.push(serde_json::from_value(value).unwrap());
            }
        }
    }
    let solid = Isotropic::new(1e6, 0.4999);
    specs.push(MaterialSpec::Linear(PlaneIsotropic { solid, plane: Some(Plane::Stress) }));
    specs.push(MaterialSpec::MooneyRivlin(TwoConstants {
        young: None,
        poisson: 0.49,
        c10: 1e5,
        c01: 4e4,
        d1: None,
    }));
    let (mu, alpha) = (vec![6e5, 1e3, -1e4], vec![1.3, 5.0, -2.0]);
    specs.push(MaterialSpec::Ogden(OgdenTerms { young: None, poisson: 0.49, mu, alpha }));
    specs
}

fn parts_add_up<const D: usize>(spec: &MaterialSpec, part: f64) {
    let whole = probe::<D>(spec);
    let Some(specs) = spec.split(part) else {
        // Of a formula nobody knows what could be split off.
        return assert!(spec.lame().is_none() || spec.name() == "expression", "{}", spec.name());
    };
    let parts = specs.each_ref().map(|spec| probe::<D>(spec));
    for spec in &specs {
        assert_eq!(spec.check(), Ok(()), "{spec:?}");
    }
    for f in samples::<D>(whole.domain() == Domain::Everywhere) {
        // Young's modulus and Poisson's ratio lose digits where the bulk modulus is thousands of times the
        // shear modulus.
        let lame = spec.lame().unwrap();
        let scale = (1.0 + lame.lambda.abs() / lame.mu) * stress_scale(whole.as_ref(), &f);
        let stress = parts.iter().fold(Mat::zero(), |sum, part| sum + part.pk1(&f));
        let error = (stress - whole.pk1(&f)).norm_squared().sqrt();
        assert!(error < 1e-12 * scale, "{spec:?} at {f:?}: stress off by {error:e}");
        let psi: f64 = parts.iter().map(|part| part.psi(&f)).sum();
        let error = (psi - whole.psi(&f)).abs();
        assert!(error < 1e-12 * scale, "{spec:?} at {f:?}: energy off by {error:e}");
    }
}

#[test]
fn the_two_parts_of_every_model_add_up_to_it() {
    for spec in specs() {
        for part in [0.2, 0.7] {
            parts_add_up::<2>(&spec, part);
            parts_add_up::<3>(&spec, part);
        }
    }
}

#[test]
fn the_second_part_has_its_share_of_the_shear_modulus_and_no_large_bulk_modulus() {
    for spec in specs() {
        let (Some(whole), Some(parts)) = (spec.lame(), spec.split(0.2)) else { continue };
        let [rest, stabiliser] = parts.map(|part| part.lame().unwrap());
        assert!((stabiliser.mu / (0.2 * whole.mu) - 1.0).abs() < 1e-12, "{spec:?}");
        assert!((rest.mu / (0.8 * whole.mu) - 1.0).abs() < 1e-9, "{spec:?}");
        // lambda = 2 mu nu / (1 - 2 nu) is 2 mu for nu = 1/3; in plane stress nothing locks.
        if spec.plane() != Some(Plane::Stress) {
            let most = 0.2 * whole.lambda.min(2.0 * whole.mu);
            assert!((stabiliser.lambda - most).abs() < 1e-12 * (whole.mu + most.abs()), "{spec:?}");
        }
    }
}
