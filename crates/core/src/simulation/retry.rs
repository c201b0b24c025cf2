//! Step subdivision: failed steps are retried in halves.

use super::{Retried, Simulation};
use crate::energy::Fault;
use crate::solver::StepFault;

/// Halvings allowed for a step in which surfaces crossed, whatever the options.
const CROSSING_HALVINGS: u32 = 10;

/// Counts of subdivided steps, machine-independent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct RetriedSteps {
    /// Steps that were subdivided.
    pub steps: u64,
    /// Substeps taken instead.
    pub parts: u64,
    /// Halvings of the smallest substep: its size is `2^-halvings` of a step.
    pub halvings: u32,
}

impl RetriedSteps {
    /// Adds both; `halvings` is the maximum.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        RetriedSteps {
            steps: self.steps + other.steps,
            parts: self.parts + other.parts,
            halvings: self.halvings.max(other.halvings),
        }
    }
}

impl Simulation {
    /// Takes the step of `h` [s] to the time `end` [s], subdividing it if necessary: a failed part is
    /// undone bit for bit and retried in halves, quarters and so on, as often as the solver options
    /// allow. The next step is tried as a whole again.
    ///
    /// Pins are released only at step starts. Motions and time-dependent loads are at the times of the
    /// substeps. Multistep methods treat substeps as steps of another size.
    ///
    /// The fault is that of the smallest substep; the state is then that before the step.
    pub(super) fn step_in_parts(
        &mut self,
        h: f64,
        end: f64,
    ) -> Result<(), (StepFault, Option<Box<Retried>>)> {
        self.last_parts.clear();
        let fault = match self.single_step(h, end) {
            Ok(()) => return Ok(()),
            Err(fault) => fault,
        };
        // A straight trajectory may cut a corner that a shorter step avoids: no sign that the equations
        // are too hard.
        let crosses = matches!(fault.fault, Some(Fault::Crossing { .. }));
        let most = self.solver.retries.max(if crosses { CROSSING_HALVINGS } else { 0 });
        if most == 0 {
            return Err((fault, None));
        }
        let start = self.state.time;
        let (x, v) = (self.state.x().to_vec(), self.state.v().to_vec());
        let memory = self.integrator.memory(&self.system, &self.state);
        let ledger = self.records.ledger.clone();
        let history = self.system.history();

        let mut parts = RetriedSteps { steps: 1, ..RetriedSteps::default() };
        // Halvings of the remaining substeps, the next one last.
        let mut left = vec![1, 1];
        let mut at = 0.0;
        while let Some(halvings) = left.pop() {
            let part = 0.5_f64.powi(halvings as i32);
            let goal = if left.is_empty() { end } else { start + (at + part) * h };
            // Implicit integrators start with the acceleration at the start of the step.
            let time = self.state.time;
            let known = self.state.ensure_force(&mut self.system, time);
            debug_assert!(known, "it was finite before");
            match self.single_step(part * h, goal) {
                Ok(()) => {
                    at += part;
                    parts.parts += 1;
                    self.last_parts.push([part * h, goal]);
                    parts.halvings = parts.halvings.max(halvings);
                }
                Err(_) if halvings < most && !self.system.is_stopped() => left.extend([halvings + 1; 2]),
                Err(fault) => {
                    let retried = Retried { halvings, step_size: part * h, time };
                    let (here_x, here_v) = self.state.rows_mut();
                    here_x.copy_from_slice(&x);
                    here_v.copy_from_slice(&v);
                    self.state.time = start;
                    self.system.set_history(&history, start);
                    self.integrator.recall(&memory, &self.system, &self.state);
                    self.records.set_ledger(ledger, &mut self.system);
                    self.last_parts.clear();
                    return Err((fault, Some(Box::new(retried))));
                }
            }
        }
        self.retried = self.retried.plus(parts);
        Ok(())
    }

    /// True if steps may be subdivided: implicit steps, if the solver options allow it or there is
    /// contact.
    pub fn may_take_parts(&self) -> bool {
        self.method.documentation.solves > 0 && (self.solver.retries > 0 || self.system.touches())
    }

    /// Returns the substeps of the last [`step`](Self::step): size and end time of each [s]; empty if it
    /// was not subdivided. [`repeat_step`](Self::repeat_step) takes each of them again.
    pub fn last_parts(&self) -> &[[f64; 2]] {
        &self.last_parts
    }

    /// True if a solved step or substep was undone during the last [`step`](Self::step) because of its
    /// end or trajectory.
    pub fn took_solved_part_back(&self) -> bool {
        self.took_back
    }

    /// Takes one integrator step of `h` [s], with the checks common to all integrators. Under terms that
    /// limit steps, an integrator whose last solve is not at its new positions must get there on a
    /// collision-free straight path. With any integrator, surfaces must not cross along the straight path
    /// of a step: forces may be too weak, and corrections of a solve may lead around an edge.
    pub(super) fn attempt(&mut self, h: f64) -> Result<(), StepFault> {
        self.attempts += 1;
        let Simulation { system, state, integrator, method, .. } = self;
        system.begin_step(state.x(), state.v(), h);
        let is_guarded = system.has_guards() && !method.ends_at_solution();
        let before = (is_guarded || system.touches()).then(|| state.x().to_vec());
        integrator.step(system, state, h)?;
        let fault = |before: Vec<f64>| {
            let guarded = is_guarded.then(|| system.way_fault(&before, state.x())).flatten();
            guarded.or_else(|| system.crossing(&before, state.x()))
        };
        let Some(fault) = before.and_then(fault) else { return Ok(()) };
        integrator.undo(state);
        self.took_back = true;
        Err(StepFault { fault: Some(fault), vertex: None, solve: None })
    }

    /// Takes one step or substep of `h` [s] to the time `end` [s], and evaluates the force there.
    pub(super) fn single_step(&mut self, h: f64, end: f64) -> Result<(), StepFault> {
        self.attempt(h)?;
        if !self.state.ensure_force(&mut self.system, end) {
            let fault = StepFault::at(&self.system, self.state.x(), self.state.v());
            self.integrator.undo(&mut self.state);
            self.took_back = true;
            return Err(fault);
        }
        let from = std::mem::replace(&mut self.state.time, end);
        self.note_step(from, h);
        Ok(())
    }
}
