//! Names, scene syntax, checks of parameters.

use super::models;
use crate::material::{Isotropic, MaterialSpec, Stiffness};

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
            "neo-hookean",
            "stable-neo-hookean",
            "stable-neo-hookean-log",
            "displacement-gradient",
            "dirichlet"
        ]
    );
}

#[test]
fn scene_syntax() {
    let text = "elastic = { corotated = { young = 3e6, poisson = 0.0 } }";
    let expected = MaterialSpec::Corotated(Isotropic { young: 3e6, poisson: 0.0 });
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
        let error = MaterialSpec::Stvk(Isotropic { young, poisson }).check().expect_err("impossible");
        (error.field, error.to_string())
    };
    for spec in MaterialSpec::examples() {
        assert_eq!(spec.check(), Ok(()));
    }
    for (young, poisson) in [(1e-3, 0.4999), (1e12, -0.99), (1.0, 0.0)] {
        assert_eq!(MaterialSpec::Stvk(Isotropic { young, poisson }).check(), Ok(()));
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
