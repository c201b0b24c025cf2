//! The engine of `pliant`, a simulator of deformable things: from arrays to motion.
//!
//! It solves `M x'' = f(x)` with `f = -dE/dx`, where the energy `E` is a sum of terms: hyperelastic
//! elements, springs, gravity. A new model is an energy; everything else follows. All quantities are in SI
//! units; arrays of positions and velocities are flat, `(n, dimension)`, in `f64`; [`algebra::columns`]
//! shows them as matrices of nalgebra, which poses of pins are values of, and into which `F` and stresses
//! convert.
//!
//! A square of two triangles, thrown, turning and pulled down:
//!
//! ```
//! use pliant::energy::{elastic::Elastic, gravity::UniformGravity};
//! use pliant::integrator::IntegratorSpec;
//! use pliant::material::{Isotropic, Model, NeoHookean, Stress};
//! use pliant::{simulation::Simulation, state::State, system::System};
//!
//! let rest = vec![0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0];
//! let triangles = [[0, 1, 2], [0, 2, 3]];
//! let rubber = NeoHookean::new(&Isotropic { young: 1e5, poisson: 0.4, preset: None });
//! let mut system = System::new(2, vec![0.25; 4]);
//! system.add_term(Box::new(Elastic::<2, 3>::linear("square", rubber, Stress::Analytic, &triangles, &rest)));
//! system.add_term(Box::new(UniformGravity::new(&[0.0, -10.0], &[0.25; 4])));
//! let velocity = vec![1.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0, 0.0];
//! let state = State::new(rest, velocity);
//! let mut simulation = Simulation::new(system, state, IntegratorSpec::VelocityVerlet.method(), 1e-4);
//! for _ in 0..1000 {
//!     simulation.step()?;
//! }
//! // The middle flies as a mass would: 0.5 m + 0.5 m/s t - g t^2 / 2.
//! let height = pliant::algebra::columns(&simulation.positions(), 2).row(1).mean();
//! assert!((height - (0.5 + 0.5 * 0.1 - 5.0 * 0.1 * 0.1)).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The way through
//! [`system::System`] holds the equations, made of [`energy`] and [`dissipation`] terms; [`integrator`] has
//! the schemes, [`control`] step sizes that follow the error, [`material`] the energy densities, [`element`]
//! the shape functions, [`solver`] the equations of implicit steps. [`simulation::Simulation`] takes steps,
//! [`run::run`] drives a whole run and shows frames to [`observer::Observer`]s. [`scalar`], [`lanes`] and
//! [`algebra`] are what kernels are written in.
//!
//! The folder `examples` has a system from arrays, a term of one's own and an observer, each to run by
//! `cargo run --release --example NAME`.
//!
//! Scenes as text, meshes, recordings and studies are crates above this one: `pliant-scene`, `pliant-mesh`,
//! `pliant-record`, `pliant-lab`.

// Inside a function the symbols of the paper are clearer than words.
#![allow(non_snake_case)]
// Loops over small fixed ranges index several arrays at once; closures would lose their target features.
#![allow(clippy::needless_range_loop)]

pub mod algebra;
pub mod available_memory;
pub mod constraint;
pub mod control;
pub mod deadline;
pub mod diagnostics;
pub mod dissipation;
pub mod element;
pub mod energy;
pub mod expression;
pub mod integrator;
pub mod lanes;
pub mod material;
pub mod modes;
pub mod numbering;
pub mod observer;
mod pass;
pub mod probe;
pub mod quantity;
pub mod run;
pub mod scalar;
pub mod simulation;
pub mod solver;
pub mod state;
pub mod system;
pub mod topology;
pub mod value;
