//! States of pins.

use super::System;
use crate::constraint::{Drive, Hold};

/// Change of a pin while a simulation runs.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct PinState {
    name: String,
    /// True if it has let go by its time.
    is_released: bool,
    /// Where each moving vertex started [m]; empty without a motion.
    starts: Vec<[f64; 3]>,
    /// How it is steered from outside.
    drive: Option<Drive>,
}

impl PinState {
    /// True if it is one of `hold`.
    fn is_of(&self, hold: &Hold) -> bool {
        self.name == hold.name() && self.starts.len() == hold.starts().len()
    }
}

impl System {
    /// All holds, those that have let go last.
    pub(super) fn all_holds(&self) -> impl Iterator<Item = &Hold> {
        self.holds.iter().chain(&self.released)
    }

    /// States of all pins, in the order in which they were added.
    pub(crate) fn pin_states(&self) -> Vec<PinState> {
        let state = |hold: &Hold, is_released| {
            let (name, starts) = (hold.name().to_owned(), hold.starts().to_vec());
            (hold.rank(), PinState { name, is_released, starts, drive: hold.drive().cloned() })
        };
        let held = self.holds.iter().map(|hold| state(hold, false));
        let mut states: Vec<_> = held.chain(self.released.iter().map(|hold| state(hold, true))).collect();
        states.sort_by_key(|(rank, _)| *rank);
        states.into_iter().map(|(_, state)| state).collect()
    }

    /// Goes on with these states; false, and nothing has changed, where they are of other pins.
    pub(crate) fn set_pin_states(&mut self, states: &[PinState]) -> bool {
        let mut order: Vec<&Hold> = self.all_holds().collect();
        order.sort_by_key(|hold| hold.rank());
        let fits =
            order.len() == states.len() && order.iter().zip(states).all(|(hold, state)| state.is_of(hold));
        if !fits {
            return false;
        }
        let mut holds = std::mem::take(&mut self.holds);
        holds.append(&mut self.released);
        holds.sort_by_key(Hold::rank);
        for (mut hold, state) in holds.into_iter().zip(states) {
            hold.set_starts(&state.starts);
            hold.set_drive(state.drive.clone());
            if state.is_released { self.released.push(hold) } else { self.holds.push(hold) }
        }
        self.holds_changed();
        true
    }
}
