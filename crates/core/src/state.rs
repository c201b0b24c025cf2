//! State of a simulation: time, positions, velocities.

use crate::lanes::Numbers;
use crate::system::{ForceId, System};

/// Time, positions and velocities, with the identity of the force evaluated at these positions.
///
/// ```
/// let mut state = pliant::state::State::new(vec![0.0, 1.0], vec![2.0, 0.0]);
/// state.x_mut()[1] = 1.5;
/// assert_eq!((state.time, state.x(), state.v()), (0.0, &[0.0, 1.5][..], &[2.0, 0.0][..]));
/// ```
#[derive(Clone, Debug)]
pub struct State {
    /// Steps taken.
    pub step: u64,
    /// Simulated time [s].
    pub time: f64,
    x: Numbers,
    v: Numbers,
    /// Force at `x`: integrators whose last stage is the new state pass it on to the next step.
    pub(crate) force: ForceId,
}

impl State {
    /// Creates the state at time zero.
    ///
    /// # Panics
    /// If the arrays differ in length.
    pub fn new(x: Vec<f64>, v: Vec<f64>) -> Self {
        assert_eq!(x.len(), v.len(), "one velocity per position");
        State { step: 0, time: 0.0, x: (&x[..]).into(), v: (&v[..]).into(), force: ForceId::NONE }
    }

    /// Returns the positions, flat `(n, dimension)` [m].
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    /// Returns the velocities, flat `(n, dimension)` [m/s].
    pub fn v(&self) -> &[f64] {
        &self.v
    }

    /// Returns the positions for modification; invalidates the force.
    pub fn x_mut(&mut self) -> &mut [f64] {
        self.force = ForceId::NONE;
        &mut self.x
    }

    /// Returns the velocities for modification.
    pub fn v_mut(&mut self) -> &mut [f64] {
        &mut self.v
    }

    /// Returns positions and velocities for modification; invalidates the force.
    pub(crate) fn rows_mut(&mut self) -> (&mut [f64], &mut [f64]) {
        self.force = ForceId::NONE;
        (&mut self.x, &mut self.v)
    }

    /// Evaluates the force at the current positions for `time` [s], unless `system` still holds it;
    /// returns false if it is not finite.
    pub(crate) fn ensure_force(&mut self, system: &mut System, time: f64) -> bool {
        if !system.holds(self.force) {
            system.set_time(time);
            self.force = system.evaluate(&self.x).unwrap_or(ForceId::NONE);
        }
        self.force != ForceId::NONE
    }

    /// Swaps positions and velocities with `x` and `v`, where the force is `force`.
    pub(crate) fn swap(&mut self, x: &mut Numbers, v: &mut Numbers, force: ForceId) {
        self.force = force;
        std::mem::swap(&mut self.x, x);
        std::mem::swap(&mut self.v, v);
    }
}
