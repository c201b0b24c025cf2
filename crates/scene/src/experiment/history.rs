//! Earlier states of an experiment.

use std::collections::VecDeque;

use pliant::simulation::{Simulation, Snapshot};

/// Steps between states that are kept. In steps, not in time of a clock: a replay keeps the same.
const INTERVAL: u64 = 32;
/// States kept, the last ones.
const KEPT: usize = 8;

/// Earlier states, ascending in steps.
#[derive(Default)]
pub(super) struct History(VecDeque<Snapshot>);

impl History {
    /// Keeps the present state before a step, if it is its turn.
    pub(super) fn before_step(&mut self, simulation: &Simulation) {
        let step = simulation.state().step;
        if !Self::is_turn(step) || self.0.back().is_some_and(|last| last.step >= step) {
            return;
        }
        if self.0.len() == KEPT {
            self.0.pop_front();
        }
        self.0.push_back(simulation.snapshot());
    }

    /// True if the state after `step` steps is kept, and has to be a good one.
    pub(super) fn is_turn(step: u64) -> bool {
        step.is_multiple_of(INTERVAL)
    }

    pub(super) fn can_go_back(&self, step: u64) -> bool {
        self.0.front().is_some_and(|first| first.step < step)
    }

    /// The last state before `step`; it, and what came after it, is kept no longer.
    pub(super) fn earlier_than(&mut self, step: u64) -> Option<Snapshot> {
        while self.0.back()?.step >= step {
            self.0.pop_back();
        }
        self.0.pop_back()
    }

    pub(super) fn forget(&mut self) {
        self.0.clear();
    }
}
