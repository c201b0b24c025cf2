//! Splitting schemes: the kinetic and the potential part of the motion, each solved exactly, in turn.

use super::{Integrator, StepFault, half_drag};
use crate::pass::Pass;
use crate::state::State;
use crate::system::{ForceId, System};

/// One part of a step, by its share of the step size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// `v += c h a(x)`.
    Kick(f64),
    /// `x += c h v`.
    Drift(f64),
}

/// Runs any sequence of kicks and drifts.
///
/// The force at the end of a step serves the first kick of the next, where positions have not changed since.
pub struct Splitting {
    stages: &'static [Stage],
    x: Vec<f64>,
    v: Vec<f64>,
}

impl Splitting {
    /// A runner for `stages` on `unknowns` coordinates.
    pub fn new(stages: &'static [Stage], unknowns: usize) -> Self {
        Splitting { stages, x: vec![0.0; unknowns], v: vec![0.0; unknowns] }
    }
}

impl Integrator for Splitting {
    fn step(&mut self, system: &mut System, state: &mut State, h: f64) -> Result<(), StepFault> {
        let half_drag = half_drag(system, h);
        let Splitting { stages, x, v } = self;
        let mut force = state.force;
        // Time belongs to the positions: it goes on while they do.
        let mut drifted = 0.0;
        let mut next = 0;
        while next < stages.len() {
            // A kick and the drift after it, or either alone: one pass over the vertices. The first goes from the state to
            // copies, so that a step that fails leaves the state as it was.
            let first = next == 0;
            let mut pass = Pass { drag_before: 1.0, kick: 0.0, drift: 0.0, drag_after: 1.0, walls: false };
            if let Some(Stage::Kick(c)) = stages.get(next) {
                pass.kick = c * h;
                if !system.holds(force) {
                    system.set_time(state.time + drifted * h);
                    let at = if first { state.x() } else { &x[..] };
                    force = system.evaluate(at).ok_or_else(|| StepFault::at(system, at, state.v()))?;
                }
                next += 1;
            }
            if let Some(Stage::Drift(c)) = stages.get(next) {
                pass.drift = c * h;
                drifted += c;
                next += 1;
            }
            let last = next == stages.len();
            pass.walls = last;
            if first {
                pass.drag_before = half_drag;
            }
            if last {
                pass.drag_after = half_drag;
            }
            let from = first.then(|| (state.x(), state.v()));
            let passed = system.pass(&pass, from, x, v);
            let prescribed = system.prescribe(state.time + drifted * h, x, v);
            if !(passed.finite && prescribed) {
                return Err(StepFault::at(system, x, v));
            }
            if pass.drift != 0.0 || passed.put_back {
                force = ForceId::NONE;
            }
        }
        state.swap(x, v, force);
        Ok(())
    }

    fn undo(&mut self, state: &mut State) {
        // The swap at the end of the step left the old state here.
        state.swap(&mut self.x, &mut self.v, ForceId::NONE);
    }

    fn bytes(&self) -> usize {
        8 * (self.x.len() + self.v.len())
    }
}
