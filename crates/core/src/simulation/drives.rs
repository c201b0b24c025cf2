//! Pins that are steered while a simulation runs.

use super::Simulation;
use crate::constraint::{Drive, Waypoint};

/// A pin cannot be steered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MoveError {
    /// There is none of this name, or it has let go.
    #[error("there is no pin `{name}` that holds; there are {pins:?}")]
    NoPin {
        /// The name.
        name: String,
        /// Names of the pins that hold.
        pins: Vec<String>,
    },
    /// A pose or a velocity is not finite.
    #[error("the way of pin `{name}` is not finite")]
    NotFinite {
        /// Name of the pin.
        name: String,
    },
    /// The time that the way takes is no positive number.
    #[error("the way of pin `{name}` takes {over} s; it is a positive time")]
    Time {
        /// Name of the pin.
        name: String,
        /// The time [s].
        over: f64,
    },
}

impl Simulation {
    /// Pose and velocities of a pin now, from where its vertices started; `None` without such a pin.
    pub fn pin_waypoint(&self, name: &str) -> Option<Waypoint> {
        let d = self.system.dimension();
        let hold = self.system.pins().named(name)?;
        Some(hold.pose(self.state.time, d, self.state.x()).1)
    }

    /// Steers a pin: from where it is, with the velocity that it has, to `target` within `over` [s], and on
    /// with the velocities of `target`, until it is steered anew or lets go. Positions and velocities are
    /// continuous.
    ///
    /// The pose is that of a rigid body from where the vertices of the pin started: in the scene, or, of a
    /// pin that was still or deforms, where they are when it is steered first. In two dimensions it lies in
    /// the plane. Coordinates that the pin does not hold are not moved.
    ///
    /// # Errors
    /// [`MoveError`]; nothing has changed then.
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
        // The state is where it was: memories of schemes and the balance of energy go on, once it is about
        // motion.
        if !was_steered {
            self.changed();
        }
        Ok(())
    }

    /// Motions of the pins that are steered, by their names.
    pub fn drives(&self) -> Vec<(String, Drive)> {
        let holds = self.system.constraints().iter();
        holds.filter_map(|hold| Some((hold.name().to_owned(), hold.drive()?.clone()))).collect()
    }

    /// Goes on with steering that [`drives`](Self::drives) gave, where there are such pins.
    pub fn set_drives(&mut self, drives: &[(String, Drive)]) {
        for (name, drive) in drives {
            self.system.change_pins(|pins| pins.set_drive(name, drive));
        }
        if !drives.is_empty() {
            self.changed();
        }
    }
}
