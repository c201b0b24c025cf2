//! A bar of 1 x 1 x 4 cubic cells, clamped at z = 0, twisted by its initial velocity: every vertex against an
//! independent code.

use std::f64::consts::PI;

use crate::support::reference::bar as references;
use crate::support::solid::{Solid, at_zero, isotropic};
use crate::support::{advance, assert_relative, displacements, largest_difference, method};

/// At rest shape, with `v = 5 sin(pi z / 8) (-(y - 1/2), x - 1/2, 0)`.
fn bar(material: &str, steps: usize) -> pliant::simulation::Simulation {
    let mut solid = Solid::grid(&[1, 1, 4], &[1.0, 1.0, 4.0], isotropic(material, 1e6, 0.45));
    solid.pin = at_zero(3, 2);
    let mut simulation = solid.simulation(method("rk4"), 1.0 / steps as f64);
    let x = simulation.state().x().to_vec();
    for (v, x) in simulation.state_mut().v_mut().chunks_exact_mut(3).zip(x.chunks_exact(3)) {
        let w = 5.0 * (PI * x[2] / 8.0).sin();
        v.copy_from_slice(&[-w * (x[1] - 0.5), w * (x[0] - 0.5), 0.0]);
    }
    simulation
}

// lecture 16, 18, 19; C13 W2
#[test]
fn every_vertex_is_where_an_independent_code_finds_it_after_one_second() {
    for case in references() {
        let name = &case.material;
        let mut simulation = bar(name, 8000);
        let limit = simulation.stability_limit(1.0).unwrap();
        assert_relative(limit.frequency, 211.994_694_964, 1e-11, "largest frequency");
        let start = simulation.diagnostics();
        assert_relative(start.total, 12_500.0, 1e-12, "energy at the start");
        let rest = simulation.state().x().to_vec();
        advance(&mut simulation, 8000);
        let u = displacements(simulation.state().x(), &rest);
        let (u, v) = (largest_difference(&u, &case.u), largest_difference(simulation.state().v(), &case.v));
        assert!(u < 2e-9, "{name}: displacements off by {u:e} m");
        assert!(v < 2e-7, "{name}: velocities off by {v:e} m/s");
        let end = simulation.diagnostics();
        assert_relative(end.kinetic, case.kinetic, 1e-8, name);
        assert_relative(end.elastic, case.elastic, 1e-7, name);
    }
}

// C13 W2: the corner, tests/verification.md.
#[test]
fn the_corner_is_where_the_plan_has_it() {
    let rows = [
        ("stable-neo-hookean", 0.5, [0.109_916_558_45, -0.225_045_393_044, -0.018_373_719_421]),
        ("stable-neo-hookean", 1.0, [0.070_522_510_312, -0.079_217_193_69, 1.652_013e-5]),
        ("neo-hookean", 1.0, [0.071_540_109_654_9, -0.080_518_308_318_5, 1.635_22e-4]),
    ];
    for (material, time, expected) in rows {
        let mut simulation = bar(material, 8000);
        let rest = simulation.state().x().to_vec();
        advance(&mut simulation, (time * 8000.0) as usize);
        let u = displacements(simulation.state().x(), &rest);
        let error = largest_difference(&u[u.len() - 3..], &expected);
        assert!(error < 2e-9, "{material} at t = {time}: off by {error:e} m");
    }
}
