//! Finite elements against exact identities and independent codes.

mod bar;
mod beam;
mod column;
mod invariance;
mod modes;
mod patch;
mod plane_stress;
mod quadratic;
mod spin;
