//! Conformance: every scheme of the registry is what its documentation says.

use super::splitting::Stage;
use super::{IntegratorSpec, Method, Scheme, amplification};

fn methods() -> impl Iterator<Item = Method> {
    IntegratorSpec::ALL.iter().map(|spec| spec.method())
}

#[test]
fn names_in_scenes_are_the_documented_names() {
    for spec in IntegratorSpec::ALL {
        let name = serde_json::to_value(spec).unwrap();
        assert_eq!(name, spec.method().documentation.name);
    }
}

/// verification.md A1b; lecture 7.
#[test]
fn the_stability_limit_is_where_the_spectral_radius_leaves_one() {
    for method in methods() {
        let limit = method.documentation.stability_limit;
        let radius = |z: f64| amplification(&method, z, 0.0, 0.0).spectral_radius();
        if limit == 0.0 {
            assert!(radius(1e-2) > 1.0 + 1e-12, "{} should grow at any step", method.documentation.name);
            continue;
        }
        for z in [0.1 * limit, 0.5 * limit, 0.9 * limit, (1.0 - 1e-9) * limit] {
            assert!(radius(z) <= 1.0 + 1e-14, "{} at z = {z}", method.documentation.name);
        }
        assert!(radius((1.0 + 1e-9) * limit) > 1.0 + 1e-10, "{}", method.documentation.name);
    }
}

/// Consistency: the parts of a step add up to the step.
#[test]
fn coefficients_sum_to_one() {
    for method in methods() {
        let name = method.documentation.name;
        match method.scheme {
            Scheme::Splitting(stages) => {
                let part = |drift: bool| {
                    let parts = stages.iter().map(|stage| match stage {
                        Stage::Drift(c) if drift => *c,
                        Stage::Kick(c) if !drift => *c,
                        _ => 0.0,
                    });
                    parts.sum::<f64>()
                };
                assert!((part(true) - 1.0).abs() < 1e-15 && (part(false) - 1.0).abs() < 1e-15, "{name}");
            }
            Scheme::RungeKutta(tableau) => {
                assert_eq!(tableau.a.len(), tableau.b.len(), "{name}");
                assert!((tableau.b.iter().sum::<f64>() - 1.0).abs() < 1e-15, "{name}");
                for (stage, row) in tableau.a.iter().enumerate() {
                    assert_eq!(row.len(), stage, "{name} is explicit");
                }
            }
        }
    }
}

/// A symplectic scheme preserves area, det A = 1 at any step; the others do not.
#[test]
fn exactly_the_schemes_that_say_so_are_symplectic() {
    for method in methods() {
        for z in [0.3, 1.0] {
            let [[a, b], [c, d]] = amplification(&method, z, 0.0, 0.0).0;
            let defect = (a * d - b * c - 1.0).abs();
            if method.documentation.symplectic {
                assert!(defect < 1e-14, "{} at z = {z}: {defect}", method.documentation.name);
            } else {
                assert!(defect > 1e-8, "{} at z = {z}: {defect}", method.documentation.name);
            }
        }
    }
}
