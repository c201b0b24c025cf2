//! `pliant`: a simulator of deformable things.
//!
//! It solves `M x'' = f(x)` with `f = -dE/dx`, where the energy `E` is a sum of terms: hyperelastic elements, springs,
//! gravity. All quantities are in SI units.

// Inside a function the symbols of the paper are clearer than words.
#![allow(non_snake_case)]
// Loops over small fixed ranges index several arrays at once; closures would lose their target features.
#![allow(clippy::needless_range_loop)]

pub mod algebra;
pub mod assembly;
pub mod constraint;
pub mod diagnostics;
pub mod element;
pub mod energy;
pub mod integrator;
pub mod lanes;
pub mod material;
pub mod mesh;
pub mod observer;
#[cfg(feature = "mcap")]
pub mod record;
pub mod run;
pub mod scalar;
pub mod scene;
pub mod simulation;
pub mod state;
pub mod system;
pub mod topology;
