//! A planet about a held sun: the whole derivative of the flow, row by row.

use pliant::energy::nbody::{NBody, TreeGravity};
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;
use pliant_gradient::{LossFrame, Parameter, TermFactor, UNLIMITED, gradient};

use crate::support::{case, method, numbers, solve_exactly};

const STEPS: u64 = 400;

fn planet(scheme: &str) -> Simulation {
    let mut system = System::new(2, vec![1.0; 2]);
    system.add_term(Box::new(NBody::<2>::new(vec![0, 1], vec![1.0; 2], 1.0, 0.0)));
    system.pin(&[0]);
    let state = State::new(vec![0.0, 0.0, 0.4, 0.0], vec![0.0, 0.0, 0.0, 2.0]);
    let mut simulation = Simulation::new(system, state, method(scheme), 0.01);
    solve_exactly(&mut simulation);
    simulation
}

/// Derivatives of a component of the last state, `x`, `y`, `u` or `v`, by all of the first, and by the
/// gravitational parameter of the sun, 1.
fn row(scheme: &str, component: usize) -> [f64; 5] {
    let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], v_bar: &mut [f64]| {
        if frame.step < STEPS {
            return 0.0;
        }
        let (rows, bar) = if component < 2 { (frame.x, x_bar) } else { (frame.v, v_bar) };
        bar[2 + component % 2] = 1.0;
        rows[2 + component % 2]
    };
    let attraction = TermFactor::new(vec![(1.0, "mutual gravity of 2 particles".into())]);
    let parameters = &mut [Box::new(attraction) as Box<dyn Parameter>];
    let found = gradient(&mut planet(scheme), STEPS, &mut loss, parameters, UNLIMITED).unwrap();
    let by_sun = found.parameters[0][0];
    [found.position[2], found.position[3], found.velocity[2], found.velocity[3], by_sun]
}

// That of ias15 is the exact flow, to rounding. Relative to the largest entry; the flow has stretched some
// directions by 50 and more after most of an orbit.
#[test]
fn schemes_have_the_derivative_of_their_flow() {
    for (scheme, expected) in case("kepler").as_object().unwrap() {
        let expected: Vec<f64> = numbers(expected);
        let largest = expected.iter().fold(0.0, |largest: f64, e| largest.max(e.abs()));
        for (component, expected) in expected.chunks_exact(5).enumerate() {
            for (found, expected) in row(scheme, component).iter().zip(expected) {
                let error = (found - expected).abs() / largest;
                assert!(error < 1e-10, "{scheme} {component}: {found}, expected {expected}: {error:e}");
            }
        }
    }
}

// S^T J S = J with J = [0 1; -1 0]: by columns, s_i^T J s_j.
#[test]
fn symplectic_schemes_keep_areas() {
    for scheme in ["symplectic-euler", "velocity-verlet", "yoshida4", "implicit-midpoint", "gauss2"] {
        let rows: Vec<[f64; 5]> = (0..4).map(|component| row(scheme, component)).collect();
        let area = |i: usize, j: usize| {
            (0..2).map(|k| rows[k][i] * rows[k + 2][j] - rows[k + 2][i] * rows[k][j]).sum::<f64>()
        };
        let size = rows.iter().flat_map(|row| &row[..4]).fold(0.0, |size: f64, e| size.max(e.abs()));
        for i in 0..4 {
            for j in 0..4 {
                let exact = f64::from(i8::from(j == i + 2) - i8::from(i == j + 2));
                assert!((area(i, j) - exact).abs() < 1e-12 * size * size, "{scheme} {i} {j}: {}", area(i, j));
            }
        }
    }
}

#[test]
fn gravity_by_a_tree_is_refused_with_a_way_to_do_without() {
    let mut system = System::new(2, vec![1.0; 2]);
    system.add_term(Box::new(TreeGravity::<2>::new(vec![0, 1], vec![1.0; 2], 1.0, 0.1, 0.5)));
    let state = State::new(vec![0.0, 0.0, 0.4, 0.0], vec![0.0; 4]);
    let mut simulation = Simulation::new(system, state, method("velocity-verlet"), 0.01);
    let mut nothing = |_: &LossFrame<'_>, _: &mut [f64], _: &mut [f64]| 0.0;
    let refused = gradient(&mut simulation, 1, &mut nothing, &mut [], UNLIMITED).unwrap_err();
    let expected = "there is no derivative of mutual gravity of 2 particles by a tree: the force of a tree \
                    jumps if a particle changes its cell, and it is not the gradient of an energy; use the \
                    direct sum, without `tree`";
    assert_eq!(refused.to_string(), expected);
}
