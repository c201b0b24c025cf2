//! Pins of a system: active and released ones, and their steering.

use super::System;
use crate::constraint::{Drive, Hold, Jump};
use crate::pass::InverseMass;

/// Pins of a system, with its dimension.
#[derive(Debug)]
pub(crate) struct Pins {
    dimension: usize,
    /// Active pins.
    acting: Vec<Hold>,
    /// Pins released at their time; active again if a simulation goes back in time.
    released: Vec<Hold>,
    /// True if any constrained coordinate moves.
    moves: bool,
    /// Number of pins added so far.
    added: u32,
    /// Number of changes of the constrained coordinates, without added pins.
    changes: u64,
}

/// State of a pin that changes during a simulation.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct PinState {
    name: String,
    /// True if it was released at its time.
    is_released: bool,
    /// Start of each moving vertex [m]; empty without a motion.
    starts: Vec<[f64; 3]>,
    /// Steering from outside.
    drive: Option<Drive>,
}

impl PinState {
    /// True if the state fits `hold`.
    fn is_of(&self, hold: &Hold) -> bool {
        self.name == hold.name() && self.starts.len() == hold.starts().len()
    }
}

impl Pins {
    /// Creates an empty set in `dimension` dimensions.
    pub(super) fn new(dimension: usize) -> Self {
        Pins { dimension, acting: vec![], released: vec![], moves: false, added: 0, changes: 0 }
    }

    /// Adds an active pin.
    pub(super) fn add(&mut self, hold: Hold) {
        self.moves |= hold.moves();
        self.acting.push(hold.ranked(self.added));
        self.added += 1;
    }

    /// Returns the active pins.
    pub(crate) fn acting(&self) -> &[Hold] {
        &self.acting
    }

    /// Iterates over all pins, released ones last.
    fn all(&self) -> impl Iterator<Item = &Hold> {
        self.acting.iter().chain(&self.released)
    }

    /// Returns the active pin of this name.
    pub(crate) fn named(&self, name: &str) -> Option<&Hold> {
        self.acting.iter().find(|hold| hold.name() == name)
    }

    /// True if any constrained coordinate moves.
    pub(super) fn move_any(&self) -> bool {
        self.moves
    }

    /// Releases the pins that end at or before `time` [s]; returns whether there were any.
    pub(crate) fn release(&mut self, time: f64) -> bool {
        if self.acting.iter().all(|hold| hold.end() > time) {
            return false;
        }
        let (acting, ended) =
            std::mem::take(&mut self.acting).into_iter().partition(|hold| hold.end() > time);
        self.acting = acting;
        self.released.extend::<Vec<Hold>>(ended);
        self.changed();
        true
    }

    /// Reactivates released pins, except those that end at or before `time` [s].
    pub(crate) fn act_as_at(&mut self, time: f64) {
        let ended = std::mem::take(&mut self.released);
        let (mut back, gone): (Vec<Hold>, _) = ended.into_iter().partition(|hold| hold.end() > time);
        self.released = gone;
        if !back.is_empty() {
            self.acting.append(&mut back);
            self.acting.sort_by_key(Hold::rank);
            self.changed();
        }
        self.release(time);
    }

    /// Removes the pins of this name; returns whether there were any.
    pub(crate) fn end(&mut self, name: &str) -> bool {
        let count = self.all().count();
        self.released.retain(|hold| hold.name() != name);
        self.acting.retain(|hold| hold.name() != name);
        let found = self.all().count() < count;
        if found {
            self.changed();
        }
        found
    }

    /// Steers the pins of this name, released ones included.
    pub(crate) fn set_drive(&mut self, name: &str, drive: &Drive) {
        let holds = self.acting.iter_mut().chain(&mut self.released);
        holds.filter(|hold| hold.name() == name).for_each(|hold| hold.set_drive(Some(drive.clone())));
        self.moves = self.acting.iter().any(Hold::moves);
    }

    /// Ends all steering: pins return to their own motions, or stay.
    pub(crate) fn end_drives(&mut self) {
        self.acting.iter_mut().chain(&mut self.released).for_each(|hold| hold.set_drive(None));
        self.moves = self.acting.iter().any(Hold::moves);
    }

    /// Continues all prescribed motions from the vertex positions in `x` at `time` [s], flat [m].
    pub(crate) fn go_on_from(&mut self, time: f64, x: &[f64]) {
        let d = self.dimension;
        self.acting.iter_mut().chain(&mut self.released).for_each(|hold| hold.go_on_from(time, d, x));
    }

    /// Returns the first time after `time` [s] at which a pin is released or its motion has a kink.
    pub(crate) fn next_break(&self, time: f64) -> Option<f64> {
        let of_hold = |hold: &Hold| {
            let end = Some(hold.end()).filter(|end| *end > time && end.is_finite());
            let motion = hold.next_break(time);
            end.into_iter().chain(motion).reduce(f64::min)
        };
        self.acting.iter().filter_map(of_hold).reduce(f64::min)
    }

    /// Returns the jumps of prescribed motion in the interval (`from`, `to`] [s], at most one per pin.
    pub(crate) fn jumps(&self, from: f64, to: f64) -> Vec<Jump> {
        if !self.moves {
            return vec![];
        }
        self.acting.iter().filter_map(|hold| hold.jump(from, to, self.dimension)).collect()
    }

    /// Writes positions [m] and velocities [m/s] of the moving coordinates at `time` [s] into the flat
    /// arrays `x` and `v`; returns false if a value is not finite. Does nothing without motion.
    pub(super) fn prescribe(&self, time: f64, x: &mut [f64], v: &mut [f64]) -> bool {
        if !self.moves {
            return true;
        }
        self.acting.iter().fold(true, |finite, hold| finite & hold.prescribe(time, self.dimension, x, v))
    }

    /// Returns the pin whose motion led to a non-finite position in `x`.
    pub(super) fn lost(&self, x: &[f64]) -> Option<&Hold> {
        let lost = |hold: &&Hold| hold.moves() && hold.coordinates(self.dimension).any(|i| !x[i].is_finite());
        self.acting.iter().find(lost)
    }

    /// Returns the states of all pins, in the order added.
    pub(crate) fn states(&self) -> Vec<PinState> {
        let state = |hold: &Hold, is_released| {
            let (name, starts) = (hold.name().to_owned(), hold.starts().to_vec());
            (hold.rank(), PinState { name, is_released, starts, drive: hold.drive().cloned() })
        };
        let acting = self.acting.iter().map(|hold| state(hold, false));
        let mut states: Vec<_> = acting.chain(self.released.iter().map(|hold| state(hold, true))).collect();
        states.sort_by_key(|(rank, _)| *rank);
        states.into_iter().map(|(_, state)| state).collect()
    }

    /// Restores these states; returns false without changes if they belong to other pins.
    pub(crate) fn set_states(&mut self, states: &[PinState]) -> bool {
        let mut order: Vec<&Hold> = self.all().collect();
        order.sort_by_key(|hold| hold.rank());
        let fits =
            order.len() == states.len() && order.iter().zip(states).all(|(hold, state)| state.is_of(hold));
        if !fits {
            return false;
        }
        let changes = self.states() != states;
        let mut holds = std::mem::take(&mut self.acting);
        holds.append(&mut self.released);
        holds.sort_by_key(Hold::rank);
        for (mut hold, state) in holds.into_iter().zip(states) {
            hold.set_starts(&state.starts);
            hold.set_drive(state.drive.clone());
            if state.is_released { self.released.push(hold) } else { self.acting.push(hold) }
        }
        if changes {
            self.changed();
        }
        true
    }

    /// Returns `1 / m` of each coordinate for vertices of these masses [kg], zero if an active pin
    /// selected by `asked` constrains it.
    fn inverse_mass(&self, mass: &[f64], asked: impl Fn(&Hold) -> bool) -> InverseMass {
        let mut inverse_mass = InverseMass::free(mass, self.dimension);
        for hold in self.acting.iter().filter(|hold| asked(hold)) {
            hold.coordinates(self.dimension).for_each(|i| inverse_mass.hold(i));
        }
        inverse_mass
    }

    fn changed(&mut self) {
        self.moves = self.acting.iter().any(Hold::moves);
        self.changes += 1;
    }
}

impl System {
    /// Returns the pins.
    pub(crate) fn pins(&self) -> &Pins {
        &self.pins
    }

    /// Applies `change` to the pins and returns its result. If the constrained coordinates change,
    /// structure and force are invalidated.
    pub(crate) fn change_pins<T>(&mut self, change: impl FnOnce(&mut Pins) -> T) -> T {
        let before = self.pins.changes;
        let result = change(&mut self.pins);
        if self.pins.changes != before {
            self.inverse_mass = self.pins.inverse_mass(&self.mass, |_| true);
            self.structure = super::fresh();
            // The force may be finite although it was not where it was pinned.
            self.force = super::ForceId::NONE;
        }
        result
    }

    /// Runs `measure` without any constraints.
    pub(crate) fn as_if_free<T>(&mut self, measure: impl FnOnce(&mut Self) -> T) -> T {
        let free = self.pins.inverse_mass(&self.mass, |_| false);
        self.with_inverse_mass(free, measure)
    }

    /// Runs `measure` with the final constraints: pins that never end.
    pub(crate) fn with_final_constraints<T>(&mut self, measure: impl FnOnce(&mut Self) -> T) -> T {
        if self.pins.acting.iter().all(|hold| hold.end() == f64::INFINITY) {
            return measure(self);
        }
        let inverse_mass = self.pins.inverse_mass(&self.mass, |hold| hold.end() == f64::INFINITY);
        self.with_inverse_mass(inverse_mass, measure)
    }

    /// Runs `measure` with other constraints and hence another structure.
    fn with_inverse_mass<T>(&mut self, inverse_mass: InverseMass, measure: impl FnOnce(&mut Self) -> T) -> T {
        let mass = std::mem::replace(&mut self.inverse_mass, inverse_mass);
        let structure = std::mem::replace(&mut self.structure, super::fresh());
        let found = measure(self);
        (self.inverse_mass, self.structure) = (mass, structure);
        found
    }
}
