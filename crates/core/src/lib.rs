//! `pliant`: a simulator of deformable things.
//!
//! It solves `M x'' = f(x)` with `f = -dE/dx`, where the energy `E` is a sum of terms: hyperelastic elements, springs,
//! gravity. Whoever adds a model writes an energy; everything else follows. All quantities are in SI units; arrays of positions
//! and velocities are flat, `(n, dimension)`, in `f64`.
//!
//! ```
//! use pliant::assembly::UnstableStep;
//! use pliant::scene::{Scene, SceneError};
//!
//! let scene = Scene::from_toml(
//!     "dimension = 2
//!      time = { integrator = 'velocity-verlet', step = 1e-3, duration = 1.0 }
//!      [[body]]
//!      mesh = { grid = { cells = [4, 1], spacing = 0.1 } }
//!      elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }
//!      mass = { density = 1000.0 }
//!      velocity = { rigid = { linear = [1.0, 0.0] } }",
//! )?;
//! let mut simulation = scene.assemble(UnstableStep::Refuse).map_err(SceneError::new)?.simulation;
//! for _ in 0..1000 {
//!     simulation.step()?;
//! }
//! assert!((simulation.state().x()[0] - 1.0).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The way through
//! [`scene`] turns text into plain data, [`assembly`] builds meshes and energies from it, [`simulation::Simulation`] takes steps,
//! [`run::run`] drives a whole run and shows frames to [`observer::Observer`]s; [`record`] is one that writes MCAP files.
//! [`system::System`] holds the equations, made of [`energy`] and [`dissipation`] terms; [`integrator`] the schemes, [`control`] step sizes that follow the error, [`material`] the energy densities,
//! [`element`] and [`mesh`] the geometry. [`scalar`], [`lanes`] and [`algebra`] are what kernels are written in.

// Inside a function the symbols of the paper are clearer than words.
#![allow(non_snake_case)]
// Loops over small fixed ranges index several arrays at once; closures would lose their target features.
#![allow(clippy::needless_range_loop)]

pub mod algebra;
pub mod assembly;
pub mod available_memory;
mod base64;
pub mod benchmark;
pub mod checkpoint;
pub mod constraint;
pub mod control;
mod deadline;
pub mod diagnostics;
pub mod dissipation;
mod durable_file;
pub mod element;
pub mod energy;
#[cfg(feature = "mcap")]
pub mod export;
pub mod expression;
mod fnv;
pub mod integrator;
pub mod lanes;
pub mod material;
pub mod mesh;
pub mod modes;
pub mod numbering;
pub mod observer;
mod pass;
pub mod probe;
pub mod quantity;
#[cfg(feature = "mcap")]
pub mod record;
mod regular_file;
pub mod run;
pub mod scalar;
pub mod scene;
pub mod simulation;
pub mod solver;
pub mod stability;
pub mod state;
pub mod statistics;
pub mod stress;
#[cfg(feature = "study")]
pub mod study;
pub mod system;
pub mod topology;
pub mod value;
