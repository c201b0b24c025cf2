//! Steps that are not solved are taken in halves.

use super::{Retried, Simulation};
use crate::energy::Fault;
use crate::solver::StepFault;

/// How often a step that has led surfaces through each other is halved, whatever the options.
const CROSSING_HALVINGS: u32 = 10;

/// Steps that were not solved at once, in counts that do not depend on the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct RetriedSteps {
    /// Steps that were taken in parts.
    pub steps: u64,
    /// Parts that were taken in their place.
    pub parts: u64,
    /// How often the smallest part was halved: it is `2^-halvings` of a step.
    pub halvings: u32,
}

impl RetriedSteps {
    /// The steps of both.
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
    /// Takes the step of `h` [s] to the time `end` [s], if need be in parts: what is not solved is taken
    /// back to the last bit, and taken in halves, these in halves again, as often as the solver's options
    /// allow. The next step is tried as a whole again.
    ///
    /// Nothing is let go within: holds end where steps begin. What moves, and loads that change with time,
    /// are at the times of the parts. Schemes that remember earlier steps treat parts as any step of another
    /// size.
    ///
    /// The fault is that of the smallest part; the state is then what it was before the step.
    pub(super) fn step_in_parts(
        &mut self,
        h: f64,
        end: f64,
    ) -> Result<(), (StepFault, Option<Box<Retried>>)> {
        self.last_parts.clear();
        self.took_back = false;
        let fault = match self.single_step(h, end) {
            Ok(()) => return Ok(()),
            Err(fault) => fault,
        };
        // A straight way may cut a corner that a shorter one goes round: no sign that equations are too hard.
        let crosses = matches!(fault.fault, Some(Fault::Crossing { .. }));
        let most = self.solver.retries.max(if crosses { CROSSING_HALVINGS } else { 0 });
        if most == 0 || self.method.documentation.solves == 0 {
            return Err((fault, None));
        }
        let start = self.state.time;
        let (x, v) = (self.state.x().to_vec(), self.state.v().to_vec());
        let memory = self.integrator.memory(&self.system, &self.state);
        let ledger = self.ledger.clone();
        let history = self.system.history();

        let mut parts = RetriedSteps { steps: 1, ..RetriedSteps::default() };
        // How often the parts that are left were halved, the next one last.
        let mut left = vec![1, 1];
        let mut at = 0.0;
        while let Some(halvings) = left.pop() {
            let part = 0.5_f64.powi(halvings as i32);
            let goal = if left.is_empty() { end } else { start + (at + part) * h };
            // Implicit schemes begin with the acceleration at the beginning.
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
                    self.set_ledger(ledger);
                    self.last_parts.clear();
                    return Err((fault, Some(Box::new(retried))));
                }
            }
        }
        self.retried = self.retried.plus(parts);
        Ok(())
    }

    /// True if steps may be taken in parts: those that are solved, where the solver's options allow it or
    /// surfaces touch.
    pub fn may_take_parts(&self) -> bool {
        self.method.documentation.solves > 0 && (self.solver.retries > 0 || self.system.touches())
    }

    /// Parts that the last [`step`](Self::step) was taken in: size and time at the end of each [s]; none
    /// where it was taken as a whole. [`repeat_step`](Self::repeat_step) takes each of them again.
    pub fn last_parts(&self) -> &[[f64; 2]] {
        &self.last_parts
    }

    /// True if a step or part was taken back after it had been solved, because of what it led to or through,
    /// in the course of the last [`step`](Self::step).
    pub fn took_solved_part_back(&self) -> bool {
        self.took_back
    }

    /// One step of the scheme, of `h` [s]: what every step begins and ends with, whatever the scheme. Where a
    /// term guards the ways of vertices, a scheme whose solves do not end at its new positions must have come
    /// there straight. Whatever the scheme, the straight way of a step must not lead surfaces through each
    /// other: forces may be too weak to stop them, and corrections of a solve may lead round an edge.
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

    /// One step of the scheme, or a part of one, of `h` [s] to the time `end` [s], and the force there.
    pub(super) fn single_step(&mut self, h: f64, end: f64) -> Result<(), StepFault> {
        self.attempt(h)?;
        if !self.state.ensure_force(&mut self.system, end) {
            let fault = StepFault::at(&self.system, self.state.x(), self.state.v());
            self.integrator.undo(&mut self.state);
            self.took_back = true;
            return Err(fault);
        }
        let from = std::mem::replace(&mut self.state.time, end);
        self.note_in_ledger(from, h);
        Ok(())
    }
}
