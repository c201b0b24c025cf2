//! Steering of pins during a simulation.

use super::Simulation;
use crate::constraint::{Drive, Waypoint};

/// Error if a pin cannot be steered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MoveError {
    /// No active pin has this name.
    #[error("there is no pin `{name}` that holds; there are {pins:?}")]
    NoPin {
        /// The name.
        name: String,
        /// Names of the active pins.
        pins: Vec<String>,
    },
    /// A pose or a velocity is not finite.
    #[error("the way of pin `{name}` is not finite")]
    NotFinite {
        /// Name of the pin.
        name: String,
    },
    /// The duration is not positive.
    #[error("the way of pin `{name}` takes {over} s; it is a positive time")]
    Time {
        /// Name of the pin.
        name: String,
        /// The time [s].
        over: f64,
    },
}

impl Simulation {
    /// Returns the current pose and velocities of a pin relative to the start of its vertices; `None`
    /// without such a pin.
    pub fn pin_waypoint(&self, name: &str) -> Option<Waypoint> {
        let d = self.system.dimension();
        let hold = self.system.pins().named(name)?;
        Some(hold.pose(self.state.time, d, self.state.x()).1)
    }

    /// Steers a pin from its current position and velocity to `target` within `over` [s]. It continues
    /// with the velocities of `target` until it is steered again or released. Positions and velocities
    /// are continuous.
    ///
    /// The pose is a rigid-body pose relative to the start of the pin's vertices: their positions in the
    /// scene or, for a pin that was fixed or deforms, those at the first steering. In 2D it lies in the
    /// plane. Coordinates that the pin does not constrain are not moved.
    ///
    /// # Errors
    /// [`MoveError`]; nothing is changed then.
    pub fn move_pin(&mut self, name: &str, target: Waypoint, over: f64) -> Result<(), MoveError> {
        let named = || name.to_owned();
        if !target.is_finite() {
            return Err(MoveError::NotFinite { name: named() });
        }
        if !(over.is_finite() && over > 0.0) {
            return Err(MoveError::Time { name: named(), over });
        }
        let Some(hold) = self.system.pins().named(name) else {
            return Err(MoveError::NoPin { name: named(), pins: self.pin_names() });
        };
        let time = self.state.time;
        let was_steered = hold.drive().is_some();
        let (starts, begin) = hold.pose(time, self.system.dimension(), self.state.x());
        let drive = Drive::new(time, over, starts, [begin, target]);
        self.system.change_pins(|pins| pins.set_drive(name, &drive));
        // The state is unchanged: integrator history and energy balance continue, once they include
        // motion.
        if !was_steered {
            self.changed();
        }
        Ok(())
    }

    /// Returns the motions of the steered pins by name.
    pub fn drives(&self) -> Vec<(String, Drive)> {
        let holds = self.system.constraints().iter();
        holds.filter_map(|hold| Some((hold.name().to_owned(), hold.drive()?.clone()))).collect()
    }

    /// Continues with steering returned by [`drives`](Self::drives), for pins that exist.
    pub fn set_drives(&mut self, drives: &[(String, Drive)]) {
        for (name, drive) in drives {
            self.system.change_pins(|pins| pins.set_drive(name, drive));
        }
        if !drives.is_empty() {
            self.changed();
        }
    }
}
