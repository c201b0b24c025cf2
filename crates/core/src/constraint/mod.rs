//! Constraints of vertices.
//!
//! A [`Hold`] keeps coordinates of a set of vertices: where they are, or on a prescribed [`Motion`]; for
//! ever, or until it lets go. A [`Wall`] is a half-space that vertices do not enter.
//!
//! The part of holds that a scheme, explicit or implicit, has to know is in
//! [`System`](crate::system::System):
//!
//! - `inverse_mass()` is zero exactly at the coordinates that are held now. No force moves these.
//! - `has_prescribed_motion()`: whether any held coordinate moves. If not, nothing below has to be called.
//! - `prescribe(time, x, v)` writes positions and velocities of the moving coordinates at any time, stages
//!   included. A scheme calls it before it evaluates the force at a stage, with the time of that stage, and
//!   once more at the end of the step. A potential of free coordinates and prescribed ones is one that
//!   changes with time: a scheme that has its order for those has it here.
//! - A hold may be steered from outside between steps: its [`Drive`] is then its motion.
//! - Holds are let go between steps only, by [`Simulation::step`](crate::simulation::Simulation::step);
//!   `structure()` is then another number, and whatever was built for the old set (masks, factorisations,
//!   the history of a multistep scheme) is out of date. Velocities go on as they were prescribed.

mod drive;
mod hold;
mod keyframes;
mod motion;
mod wall;

pub use drive::{Drive, Waypoint};
pub use hold::Hold;
pub(crate) use hold::Jump;
pub use keyframes::{Interpolation, Keyframes};
pub use motion::{Motion, Path, Rotation};
pub use wall::Wall;
