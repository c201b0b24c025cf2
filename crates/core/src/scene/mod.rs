//! Scenes: what a user writes. Text to plain data here; plain data to a simulation in [`crate::simulation`].

mod schema;

pub use schema::*;
