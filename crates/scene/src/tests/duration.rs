//! Runs that take hours are told, with what takes them.

use super::*;
use crate::assembly::UnstableStep;

fn warnings(time: &str, body: &str) -> Vec<String> {
    let text = format!("dimension = 2\ntime = {time}\n{body}\n");
    let scene = Scene::from_toml(&text).unwrap_or_else(|error| panic!("{error}"));
    let report = scene.assemble(UnstableStep::Accept).map_err(|e| format!("{e:?}")).unwrap().report;
    report.warnings.into_iter().filter(|text| text.starts_with("all ")).collect()
}

const BEAM: &str = "[[body]]\nmesh = { grid = { cells = [50, 20], size = [1.0, 0.4] } }\n\
                    elastic = { corotated = { young = 1e4, poisson = 0.3 } }\nmass = { density = 1000 }";
const STARS: &str = "world = { nbody = { constant = 1.0, softening = 0.1 } }\n[[body]]\nmass = { total = \
                     1.0 }\n\
                     mesh = { disk = { count = 2000, radius = 1.0, seed = 1 } }";

#[test]
fn runs_of_hours_are_told_with_their_steps() {
    // 2,000 triangles 4e8 times, 2,142 coordinates solved for a million times, 2 million pairs as often.
    let cases = [
        (
            "{ integrator = 'velocity-verlet', step = 1e-5, duration = 4e3 }",
            BEAM,
            "2000 elements;",
            "about 4 h",
        ),
        (
            "{ integrator = 'implicit-euler', step = 1e-3, duration = 1e3 }",
            BEAM,
            "2142 unknowns",
            "about 12 h",
        ),
        (
            "{ integrator = 'velocity-verlet', step = 1e-4, duration = 1e3 }",
            STARS,
            "2000000 pairs of masses",
            "about 6 h",
        ),
    ];
    for (time, body, what, long) in cases {
        let said = warnings(time, body).concat();
        assert!(said.contains(what) && said.contains(long), "{said}");
        let short = time.replace("e3 }", "e2 }");
        assert_eq!(warnings(&short, body), [""; 0], "{short}");
    }
}
