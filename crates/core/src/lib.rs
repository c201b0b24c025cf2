//! The core of `pliant`, a simulator of deformable bodies: from arrays to motion.
//!
//! The crate solves `M x'' = f(x)` with `f = -dE/dx`, where the energy `E` is a sum of terms: hyperelastic
//! elements, springs, gravity. A new model is a new energy term; forces and Hessians are its derivatives. All
//! quantities are in SI units. Arrays of positions and velocities are flat, `(n, dimension)`, in `f64`;
//! [`algebra::columns`] shows them as matrices of nalgebra, which are also the type of poses of pins and to
//! which `F` and stresses convert.
//!
//! A square of two triangles, thrown, rotating and falling under gravity:
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
//! [`system::System`] holds the equations of motion, made of [`energy`] and [`dissipation`] terms.
//! [`integrator`] has the time integrators, [`control`] adaptive step sizes, [`material`] the energy
//! densities, [`element`] the shape functions, [`solver`] the solvers of implicit steps.
//! [`simulation::Simulation`] computes steps; [`run::run`] drives a whole run and passes frames to
//! [`observer::Observer`]s. Kernels are written in [`scalar`], [`lanes`] and [`algebra`].
//!
//! The folder `examples` has a system from arrays, a custom energy term and an observer. Run each by `cargo
//! run --release --example NAME`.
//!
//! Scenes as text, meshes, recordings and studies are crates that depend on this one: `pliant-scene`,
//! `pliant-mesh`, `pliant-record`, `pliant-lab`.

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
