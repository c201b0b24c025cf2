//! Dashpots beside springs, hinges and ties, whose directions turn: against differences of runs.

use pliant_scene::Scene;

use crate::differences::{compare_number, compare_starts};
use crate::support::method;
use crate::tangents::compare_with_tangents;

/// A chain that swings, its springs damped.
fn chain(scheme: &str, stiffness: f64, damping: &str, further: &str) -> Scene {
    let solves = method(scheme).documentation.solves > 0;
    let solver = if solves { "solver = { tolerance = 1e-14 }" } else { "" };
    let text = format!(
        "dimension = 2
         [time]
         integrator = \"{scheme}\"
         step = 0.01
         duration = 1.0
         {solver}
         [world]
         gravity = [0.5, -9.81]
         [[body]]
         name = \"chain\"
         mesh = {{ strand = {{ segments = 4, start = [0, 0], end = [0.9, 0.3] }} }}
         springs = {{ stiffness = {stiffness:?} }}
         damping = {{ {damping} }}
         mass = {{ per_vertex = 0.25 }}
         velocity = {{ rigid = {{ linear = [0.5, 0.4], angular = 2.0 }} }}
         pin = [{{ vertices = [0] }}]
         {further}"
    );
    Scene::from_toml(&text).unwrap()
}

#[test]
fn the_rate_of_damping_by_masses_has_a_derivative_of_springs_too() {
    for scheme in ["velocity-verlet", "implicit-euler"] {
        let of_rate = |alpha: f64| chain(scheme, 60.0, &format!("mass_proportional = {alpha:?}"), "");
        compare_number(scheme, of_rate, ("body.chain.damping.mass_proportional", 1.5, 1.5), (30, 1e-7));
    }
}

#[test]
fn damped_springs_and_joints_have_derivatives() {
    for scheme in ["symplectic-euler", "velocity-verlet", "rk4", "implicit-euler", "bdf2", "gauss2"] {
        let both = "dashpot = 0.8, stiffness_proportional = 0.004";
        compare_starts(scheme, &chain(scheme, 60.0, both, ""), (30, 1e-7), |_| true);
        let bent = chain(scheme, 60.0, both, "bending = { stiffness = 0.5 }");
        compare_starts(&format!("{scheme}, joints"), &bent, (30, 1e-7), |_| true);
        let tied = "[[body]]
                    name = \"buoy\"
                    mesh = { strand = { segments = 1, start = [1.2, 0.5], end = [1.2, 0.8] } }
                    springs = { stiffness = 30.0 }
                    mass = { per_vertex = 0.5 }
                    [[attachment]]
                    body = \"chain\"
                    vertices = [4]
                    stiffness = 20.0
                    rest_length = 0.2
                    target = { body = \"buoy\", vertices = [0] }
                    dashpot = 1.5";
        let tied = chain(scheme, 60.0, both, tied);
        compare_starts(&format!("{scheme}, tied"), &tied, (30, 1e-7), |_| true);
        if scheme != "gauss2" {
            compare_with_tangents(&format!("{scheme}, joints"), &bent, 30);
            compare_with_tangents(&format!("{scheme}, tied"), &tied, 30);
        }
    }
}

#[test]
fn numbers_of_dashpots_have_derivatives() {
    for scheme in ["velocity-verlet", "implicit-euler", "bdf2"] {
        let of_dashpot = |c: f64| chain(scheme, 60.0, &format!("dashpot = {c:?}"), "");
        compare_number(scheme, of_dashpot, ("body.chain.damping.dashpot", 0.8, 0.8), (30, 1e-7));
        let of_stiffness = |k| chain(scheme, k, "dashpot = 0.3, stiffness_proportional = 0.01", "");
        compare_number(scheme, of_stiffness, ("body.chain.springs.stiffness", 60.0, 60.0), (30, 1e-7));
    }
}

/// The chain with dashpots by a formula of their rate and length.
fn expressed(scheme: &str, c: f64, d: f64) -> Scene {
    let formula = format!(
        "expression = {{ dissipation = \"c/2*rate^2 + d*l/l0*rate^4\", parameters = {{ c = {c:?}, d = {d:?} \
         }} }}"
    );
    chain(scheme, 60.0, &formula, "")
}

#[test]
fn dashpots_by_a_formula_have_derivatives() {
    let name = |number: &str| format!("body.chain.damping.expression.parameters.{number}");
    for scheme in ["symplectic-euler", "velocity-verlet", "rk4", "implicit-euler", "bdf2", "gauss2"] {
        compare_starts(scheme, &expressed(scheme, 0.8, 0.3), (30, 1e-7), |_| true);
        compare_number(scheme, |c| expressed(scheme, c, 0.3), (&name("c"), 0.8, 0.8), (30, 1e-7));
        compare_number(scheme, |d| expressed(scheme, 0.8, d), (&name("d"), 0.3, 0.3), (30, 1e-7));
        if scheme != "gauss2" {
            compare_with_tangents(scheme, &expressed(scheme, 0.8, 0.3), 30);
        }
    }
}
