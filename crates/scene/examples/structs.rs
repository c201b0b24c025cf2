//! A scene made of structs, without text: a cantilever of rubber that bends under its weight. It prints the
//! same scene as TOML, and runs it.
//!
//! `cargo run --release -p pliant-scene --example structs`

#![allow(clippy::print_stdout, reason = "an example says what it found")]

use std::sync::atomic::AtomicBool;

use pliant::integrator::IntegratorSpec;
use pliant::material::{Isotropic, MaterialSpec};
use pliant::run::run;
use pliant_scene::assembly::UnstableStep;
use pliant_scene::{Body, GridSpec, HalfSpace, MassSpec, MeshSpec, OverTime, Pin, Scene, Time};

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let grid = GridSpec { cells: vec![16, 4], size: Some(vec![0.4, 0.1]), ..GridSpec::default() };
    let rubber = Isotropic { young: 1e6, poisson: 0.3, preset: None };
    let clamp = HalfSpace { normal: vec![1.0, 0.0], offset: 0.0 };
    let beam = Body {
        elastic: Some(MaterialSpec::NeoHookean(rubber)),
        order: Some(2),
        pin: vec![Pin { half_space: Some(clamp), ..Pin::default() }],
        ..Body::new(MeshSpec::Grid(grid), MassSpec::Density(1000.0.into()))
    };
    let mut scene = Scene::new(2, Time::fixed(IntegratorSpec::QuasiStatic, 1.0, 1.0), vec![beam]);
    scene.world.gravity = Some(vec![OverTime::Constant(0.0), OverTime::Constant(-1.0)]);
    println!("{}", scene.to_toml()?);

    let mut assembly = scene.assemble(UnstableStep::Refuse).map_err(|problems| format!("{problems:?}"))?;
    let summary = run(&mut assembly.simulation, &scene.plan(), &mut [], &AtomicBool::new(false));
    println!("{} increments", summary.work.steps);

    // Euler and Bernoulli's beam in plane strain, and Timoshenko's part of shear:
    // q L^4/(8 E' I) + q L^2/(2 k G A).
    let (q, length, height) = (1000.0 * 1.0 * 0.1, 0.4_f64, 0.1_f64);
    let (young, shear) = (1e6 / (1.0 - 0.09), 1e6 / 2.6);
    let bending = q * length.powi(4) / (8.0 * young * height.powi(3) / 12.0);
    let theory = bending + q * length.powi(2) / (2.0 * 5.0 / 6.0 * shear * height);
    let lowest = assembly.simulation.positions().chunks(2).map(|x| x[1]).fold(f64::INFINITY, f64::min);
    println!("the tip sinks by {:.5} m; slender beams by {theory:.5} m", -lowest);
    assert!((-lowest / theory - 1.0).abs() < 0.02, "off by {:e}", -lowest / theory - 1.0);
    Ok(())
}
