//! Constraints of vertices: pins, prescribed motion and walls.
//!
//! A [`Hold`] is a pin: it fixes coordinates of a set of vertices, or gives them a prescribed [`Motion`],
//! permanently or until it is released. A [`Wall`] is a half-space that vertices cannot enter.
//!
//! [`System`](crate::system::System) has what an integrator, explicit or implicit, must know about pins:
//!
//! - `inverse_mass()` is zero exactly at the currently constrained coordinates. No force moves these.
//! - `has_prescribed_motion()` is true if any constrained coordinate moves. If not, nothing below needs
//!   to be called.
//! - `prescribe(time, x, v)` writes positions and velocities of the moving coordinates at any time,
//!   stages included. An integrator calls it before it evaluates the force at a stage, with the time of
//!   that stage, and once more at the end of the step. A potential of free and prescribed coordinates is
//!   a time-dependent potential: an integrator keeps its order here if it does for those.
//! - A pin may be steered from outside between steps: its [`Drive`] then replaces its motion.
//! - Pins are released between steps only, by [`Simulation::step`](crate::simulation::Simulation::step).
//!   `structure()` then changes, and everything built for the old constraints (masks, factorisations, the
//!   history of a multistep method) is invalid. Released vertices keep their velocities.

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
