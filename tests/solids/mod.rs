//! Finite elements against exact identities and independent codes.

mod axes;
mod axial;
mod bar;
mod beam;
mod benchmarks;
mod cells;
mod column;
mod energy_alone;
mod falling;
mod impossible;
mod invariance;
mod loads;
mod locking;
mod manufactured;
mod modes;
mod muscles;
mod one_point;
mod patch;
mod plane_stress;
mod quadratic;
mod reactions;
mod second_order;
mod spin;
mod statics;
