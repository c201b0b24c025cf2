//! The engine, seen through scenes.

mod batch_material;
mod element_state;
mod expression;
mod hessian;
mod increments;
mod modes;
mod multigrid;
mod nodal_stress;
mod paths;
mod presets;
mod rayleigh;
mod simulation;
mod statics;
mod stops;
