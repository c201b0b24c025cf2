//! Static equilibrium, by the quasi-static scheme.

use pliant::simulation::{Simulation, StepError};
use pliant::solver::{SolverOptions, Verdict};
use serde_json::json;

use crate::support::{largest_difference, method};

use crate::support::solid::{Solid, at_zero, isotropic};

/// The beam of W1: 4 m x 1 m, 8 x 2 cells, clamped at x = 0, under gravity.
fn beam(material: &str) -> Solid {
    let mut solid = Solid::grid(&[8, 2], &[4.0, 1.0], isotropic(material, 1e6, 0.3));
    solid.pin = at_zero(2, 0);
    solid.gravity = Some(vec![0.0, -9.81]);
    solid
}

fn tip(simulation: &Simulation) -> [f64; 2] {
    let x = simulation.state().x();
    [x[x.len() - 2] - 4.0, x[x.len() - 1] - 1.0]
}

// C13 W1, static equilibrium
#[test]
fn a_beam_hangs_where_the_plan_has_it() {
    let rows = [
        ("neo-hookean", [-0.158_125_211_285, -1.900_663_540_57]),
        ("stable-neo-hookean", [-0.169_116_128_200, -1.905_800_605_502]),
        ("fixed-corotated", [-0.162_785_870_113, -1.873_119_779_89]),
        ("stvk", [-0.173_098_852_093, -1.779_916_283_52]),
    ];
    for (material, expected) in rows {
        let mut simulation = beam(material).simulation(method("quasi-static"), 1.0);
        simulation.set_solver(SolverOptions { tolerance: Some(1e-12), ..SolverOptions::default() });
        simulation.step().unwrap();
        let error = largest_difference(&tip(&simulation), &expected);
        assert!(error < 1e-10, "{material}: tip off by {error:e} m");
        assert!(simulation.state().v().iter().all(|v| *v == 0.0));
        // In equilibrium already, the next step finds it at once.
        let before = simulation.work().solver.unwrap().newton_iterations;
        simulation.step().unwrap();
        assert!(simulation.work().solver.unwrap().newton_iterations <= before + 2, "{material}");
    }
}

/// The message of a step that is not solved, and the state, which is what it was.
fn unsolved(mut simulation: Simulation) -> (StepError, Verdict) {
    let before = simulation.state().x().to_vec();
    let error = simulation.step().unwrap_err();
    assert_eq!(simulation.state().x(), before);
    let StepError::Unsolved { verdict, .. } = error else { panic!("{error}") };
    (error, verdict)
}

#[test]
fn a_body_that_nothing_holds_has_no_equilibrium() {
    let mut solid = beam("stable-neo-hookean");
    solid.pin = json!([]);
    let (error, verdict) = unsolved(solid.simulation(method("quasi-static"), 1.0));
    assert_eq!(verdict, Verdict::Indefinite, "{error}");
    assert!(error.to_string().contains("without stiffness or mass"), "{error}");
}
