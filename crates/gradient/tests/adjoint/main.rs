//! Gradients against derivatives by complex steps of other programs of the same schemes, in 64-bit mantissas.

#![allow(clippy::unwrap_used, reason = "a panic is what a test fails by")]

mod adaptive;
mod axes;
mod by_parameters;
mod cell_shapes;
mod cells;
mod chain;
mod chaos;
mod constants;
mod contact;
mod dashpots;
mod differences;
mod each_step;
mod fit;
mod frequencies;
mod hessians;
mod history;
mod identities;
mod kepler;
mod linearised;
mod loads;
mod muscle;
mod oscillator;
mod pins;
mod pressure;
mod proportional;
mod scenes;
mod shapes;
mod solid;
mod support;
mod table;
mod tangents;
mod walls;
