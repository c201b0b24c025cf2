//! D9: invariance under changes of units: `u -> s u`, `v -> v` under `L -> s L`, `t -> s t`,
//! `g -> g / s`; no change under `E -> r E`, `rho -> r rho`.

use super::CaseDescription;
use crate::stress::scenes::{self, Solid, beam};
use crate::stress::{Case, CaseResult, CaseVerdict};

pub(super) fn add(cases: &mut Vec<Case>) {
    for integrator in ["velocity-verlet", "implicit-euler", "tr-bdf2", "quasi-static"] {
        for (what, length, stiffness) in [
            ("lengths", 1e-9, 1.0),
            ("lengths", 1e6, 1.0),
            ("stiffness and density", 1.0, 1e-9),
            ("stiffness and density", 1.0, 1e9),
        ] {
            let factor = length * stiffness;
            let about = CaseDescription {
                row: "D9",
                name: &format!("{what} times {factor:e}"),
                dimension: 2,
                material: "neo-hookean",
                poisson: Some(0.3),
                integrator,
                quick: true,
            };
            cases.push(about.case(move || scaled(integrator, length, stiffness)));
        }
    }
}

fn scaled(integrator: &str, length: f64, stiffness: f64) -> CaseResult {
    let scheme = scenes::scheme(integrator);
    let run = |s: f64, r: f64| {
        let world = format!("gravity = [0, {:?}]", -9.81 / s);
        let solid = Solid {
            integrator: &scheme,
            material: "neo-hookean",
            step: 5e-3 * s,
            size: &[4.0 * s, s],
            young: 1e6 * r,
            density: 1000.0 * r,
            world: &world,
            ..beam()
        };
        let mut simulation = solid.assemble().simulation;
        let rest = simulation.positions().into_owned();
        let end = (0..100).try_for_each(|_| simulation.step());
        let moved: Vec<f64> =
            simulation.positions().iter().zip(&rest).map(|(x, rest)| (x - rest) / s).collect();
        end.map(|()| moved)
    };
    let mut findings = CaseResult::default();
    match (run(1.0, 1.0), run(length, stiffness)) {
        (Ok(as_it_is), Ok(scaled)) => {
            let largest = as_it_is.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
            let apart = scenes::largest_difference(&as_it_is, &scaled) / largest;
            // Implicit integrators solve to 1e-9 of the size.
            let tolerance = if integrator == "velocity-verlet" { 1e-9 } else { 1e-8 };
            findings.measure("displacement, relative", apart, tolerance);
        }
        (a, b) => findings.note(CaseVerdict::Fail, format!("{:?} {:?}", a.err(), b.err())),
    }
    findings
}
