//! Names, scene syntax, checks of parameters.

use super::models;
use crate::material::{Isotropic, MaterialSpec, OgdenTerms, Stiffness, TwoConstants, WithoutPoisson};

#[derive(Debug, PartialEq, serde::Serialize, serde::Deserialize)]
struct Body {
    elastic: MaterialSpec,
}

// lecture 14, 16
#[test]
fn names() {
    let names: Vec<_> = MaterialSpec::examples().iter().map(MaterialSpec::name).collect();
    assert_eq!(
        names,
        [
            "linear",
            "stvk",
            "corotated",
            "fixed-corotated",
            "arap",
            "neo-hookean",
            "stable-neo-hookean",
            "stable-neo-hookean-log",
            "neo-hookean-j",
            "isochoric-neo-hookean",
            "mooney-rivlin",
            "ogden",
            "holzapfel-gasser-ogden",
            "hencky",
            "displacement-gradient",
            "dirichlet",
            "expression"
        ]
    );
}

#[test]
fn scene_syntax() {
    let text = "elastic = { corotated = { young = 3e6, poisson = 0.0 } }";
    let expected = MaterialSpec::Corotated(Isotropic::new(3e6, 0.0));
    assert_eq!(toml::from_str::<Body>(text).unwrap().elastic, expected);
    for elastic in MaterialSpec::examples() {
        let text = toml::to_string(&Body { elastic: elastic.clone() }).unwrap();
        assert!(text.contains(elastic.name()), "{text}");
        assert_eq!(toml::from_str::<Body>(&text).unwrap().elastic, elastic);
    }
    let misspelt = "elastic = { corotated = { young = 3e6, poison = 0.0 } }";
    let error = toml::from_str::<Body>(misspelt).unwrap_err().to_string();
    assert!(error.contains("poison") && error.contains("poisson"), "{error}");
}

#[test]
fn schema_describes_models_and_fields() {
    let schema = serde_json::to_string(&schemars::schema_for!(MaterialSpec)).unwrap();
    for spec in MaterialSpec::examples() {
        assert!(schema.contains(spec.name()) && schema.contains(spec.about().summary), "{schema}");
    }
    assert!(schema.contains("Young's modulus E [Pa], positive."), "{schema}");
}

#[test]
fn descriptions_are_complete() {
    for (spec, model) in models::<2>() {
        let about = spec.about();
        assert_eq!(about.domain, model.domain(), "{}", spec.name());
        for text in [about.summary, about.formula, about.source] {
            assert!(!text.is_empty() && !text.contains('\n'), "{}", spec.name());
        }
    }
}

#[test]
fn impossible_parameters() {
    let field = |young, poisson| {
        let error = MaterialSpec::Stvk(Isotropic::new(young, poisson)).check().expect_err("impossible");
        (error.field, error.to_string())
    };
    for spec in MaterialSpec::examples() {
        assert_eq!(spec.check(), Ok(()));
    }
    for (young, poisson) in [(1e-3, 0.4999), (1e12, -0.99), (1.0, 0.0)] {
        assert_eq!(MaterialSpec::Stvk(Isotropic::new(young, poisson)).check(), Ok(()));
    }
    let (name, message) = field(1e6, 0.5);
    assert_eq!(name, "poisson");
    let expected = "poisson = 0.5: makes the bulk modulus infinite; use at most 0.4999, or 0.45 for rubber";
    assert_eq!(message, expected);
    for poisson in [0.51, 3.0, -1.0, -2.0, f64::NAN, f64::INFINITY] {
        assert_eq!(field(1e6, poisson).0, "poisson", "{poisson}");
    }
    for young in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(field(young, 0.3).0, "young", "{young}");
        let error = MaterialSpec::Dirichlet(Stiffness { stiffness: young }).check().expect_err("impossible");
        assert_eq!(error.field, "stiffness");
    }
}

#[test]
fn impossible_constants_of_rubber() {
    let message = |spec: MaterialSpec| spec.check().expect_err("impossible").to_string();
    let mooney = |young, c10, c01| {
        MaterialSpec::MooneyRivlin(TwoConstants { young, poisson: 0.45, c10, c01, d1: None })
    };
    assert_eq!(mooney(None, 4e5, -1e5).check(), Ok(()));
    assert!(message(mooney(None, 1e5, -1e5)).starts_with("c01 = -100000: makes the shear modulus"));
    assert!(message(mooney(None, f64::NAN, 1e5)).starts_with("c10 = NaN: must be a finite number"));
    assert!(message(mooney(Some(0.0), 4.0, 1.0)).starts_with("young = 0: must be positive"));
    let ogden = |mu: &[f64], alpha: &[f64]| {
        MaterialSpec::Ogden(OgdenTerms { young: None, poisson: 0.45, mu: mu.into(), alpha: alpha.into() })
    };
    assert_eq!(ogden(&[1e5], &[2.0]).check(), Ok(()));
    assert_eq!(ogden(&[1e5, -2e3, 5.0, 1.0], &[2.0, -2.0, 7.5, 0.1]).check(), Ok(()));
    assert!(message(ogden(&[], &[])).starts_with("mu = 0: is the number of terms"));
    assert!(message(ogden(&[1.0, 2.0], &[2.0])).starts_with("alpha = 1: is the number of exponents"));
    assert!(message(ogden(&[1.0, 2.0], &[2.0, 0.0])).starts_with("alpha[1] = 0: must be a finite number"));
    assert!(message(ogden(&[f64::INFINITY], &[2.0])).starts_with("mu[0] = inf: must be a finite number"));
    assert!(message(ogden(&[1.0], &[-2.0])).starts_with("mu = -1: is the shear modulus"));
    let arap = MaterialSpec::Arap(WithoutPoisson { young: 1e6, poisson: 0.3 });
    assert!(message(arap).starts_with("poisson = 0.3: the model knows no Poisson effect"));
}
