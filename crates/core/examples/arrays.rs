//! A bar that hangs from its top and is stretched by its own weight, from arrays alone: no scene, no file.
//!
//! `cargo run --release -p pliant --example arrays`

#![allow(clippy::print_stdout, reason = "an example says what it found")]

use pliant::energy::elastic::Elastic;
use pliant::energy::gravity::UniformGravity;
use pliant::integrator::IntegratorSpec;
use pliant::material::{Isotropic, Linear, Model, PlaneIsotropic, Stress};
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;

/// Size [m] and cells along each axis.
const SIZE: [f64; 2] = [0.1, 1.0];
const CELLS: [u32; 2] = [2, 20];
/// Young's modulus [Pa] and density [kg/m^3]; gravity [m/s^2].
const YOUNG: f64 = 1e6;
const DENSITY: f64 = 1000.0;
const G: f64 = 9.81;

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Vertices row by row from the bottom, two triangles in each cell, a quarter of its mass at each corner.
    let [columns, rows] = CELLS.map(|cells| cells + 1);
    let cell = [SIZE[0] / f64::from(CELLS[0]), SIZE[1] / f64::from(CELLS[1])];
    let place = |i: u32| [f64::from(i % columns) * cell[0], f64::from(i / columns) * cell[1]];
    let rest: Vec<f64> = (0..columns * rows).flat_map(place).collect();
    let mut triangles = vec![];
    let mut mass = vec![0.0; rest.len() / 2];
    for corner in (0..columns * CELLS[1]).filter(|i| i % columns != CELLS[0]) {
        let above = corner + columns;
        triangles.extend([[corner, corner + 1, above + 1], [corner, above + 1, above]]);
        for vertex in [corner, corner + 1, above, above + 1] {
            mass[vertex as usize] += DENSITY * cell[0] * cell[1] / 4.0;
        }
    }

    let solid = Isotropic { young: YOUNG, poisson: 0.0, preset: None };
    let material = Linear::new(&PlaneIsotropic { solid, plane: None });
    let mut system = System::new(2, mass.clone());
    system.add_term(Box::new(Elastic::<2, 3>::linear("bar", material, Stress::Analytic, &triangles, &rest)));
    system.add_term(Box::new(UniformGravity::new(&[0.0, -G], &mass)));
    system.pin(&(columns * CELLS[1]..columns * rows).collect::<Vec<_>>());

    let still = State::new(rest.clone(), vec![0.0; rest.len()]);
    let mut simulation = Simulation::new(system, still, IntegratorSpec::QuasiStatic.method(), 1.0);
    simulation.step()?;

    // Without contraction across, linear elements are exact at their vertices: rho g L^2 / (2 E).
    let sagged = -(simulation.positions()[1] - rest[1]);
    let theory = DENSITY * G * SIZE[1] * SIZE[1] / (2.0 * YOUNG);
    println!("the lower end sinks by {sagged:.9} m; in theory {theory:.9} m");
    assert!((sagged / theory - 1.0).abs() < 1e-9, "off by {:e}", sagged / theory - 1.0);
    Ok(())
}
