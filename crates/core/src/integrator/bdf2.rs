//! Second backward differentiation formula, `y_(n+1) = (4 y_n - y_(n-1))/3 + (2/3) h y'_(n+1)`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::dirk::Dirk;
use super::implicit::{NextState, StageEquations, StageSolver, guess_acceleration};
use super::{BadParameter, Documentation, Integrator, Method, Scheme, implicit_euler, tr_bdf2};
use crate::solver::StepFault;
use crate::solver::structure::LentStructure;
use crate::solver::{SolverOptions, SolverWork};
use crate::state::State;
use crate::system::{ForceId, System};

/// How BDF2 starts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Bdf2Parameters {
    /// Scheme of the first step, for which there is no state before.
    pub start: Bdf2Start,
}

/// A scheme of one step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Bdf2Start {
    /// Accurate to the order of the method, and as stable.
    TrBdf2,
    /// The textbook's choice.
    ImplicitEuler,
}

impl Default for Bdf2Parameters {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl Bdf2Parameters {
    /// Default: start with TR-BDF2.
    pub const DEFAULT: Self = Bdf2Parameters { start: Bdf2Start::TrBdf2 };

    /// Always succeeds.
    ///
    /// # Errors
    /// None.
    pub fn check(&self) -> Result<(), BadParameter> {
        Ok(())
    }

    /// Returns the method with its documentation.
    pub fn method(self) -> Method {
        Method {
            documentation: Documentation {
                name: "bdf2",
                summary: "Backward differentiation of order 2: one solve a step, L-stable; keeps the last \
                          state",
                order: 2,
                force_evaluations: 0,
                solves: 1,
                stability_limit: f64::INFINITY,
                symplectic: false,
                conserves: "nothing else",
                source: "Hairer, Wanner 1996, Solving Ordinary Differential Equations II, section V.1",
            },
            scheme: Scheme::Bdf2(self.start),
        }
    }
}

/// Integrator of BDF2.
pub struct Bdf2 {
    solver: StageSolver,
    start: Dirk,
    /// State before the last step, and the state after it. The history is valid if `after` equals the
    /// current state and the step size is unchanged.
    before: NextState,
    after: NextState,
    /// Last step size and structure version.
    step: Option<(f64, u64)>,
    /// Value of `step` before the last step, if the history was valid then.
    earlier: Option<(f64, u64)>,
    /// True if walls moved vertices at the end of the last step: a history across that makes them bounce.
    jumped: bool,
    z: Vec<f64>,
    w: Vec<f64>,
    acceleration: Vec<f64>,
    next: NextState,
    /// Value of `before` before the last step.
    older: NextState,
    started: bool,
}

impl Bdf2 {
    /// Creates the integrator for `unknowns` coordinates.
    pub fn new(start: Bdf2Start, unknowns: usize, options: SolverOptions) -> Self {
        let tableau = match start {
            Bdf2Start::TrBdf2 => tr_bdf2::TABLEAU,
            Bdf2Start::ImplicitEuler => implicit_euler::TABLEAU,
        };
        Bdf2 {
            solver: StageSolver::new(options),
            start: Dirk::new(tableau, false, unknowns, options),
            before: NextState::new(unknowns),
            after: NextState::new(unknowns),
            step: None,
            earlier: None,
            jumped: false,
            z: vec![0.0; unknowns],
            w: vec![0.0; unknowns],
            acceleration: vec![0.0; unknowns],
            next: NextState::new(unknowns),
            older: NextState::new(unknowns),
            started: false,
        }
    }

    /// Stores the state after a step.
    fn remember(&mut self, system: &System, state: &State, h: f64) {
        self.after.x.copy_from_slice(state.x());
        self.after.v.copy_from_slice(state.v());
        self.step = Some((h, system.structure()));
        self.jumped = false;
    }

    /// True if `before` is the history of `state`.
    fn has_led_to(&self, state: &State) -> bool {
        !self.jumped && *self.after.x == *state.x() && *self.after.v == *state.v()
    }
}

impl Integrator for Bdf2 {
    fn step(&mut self, system: &mut System, state: &mut State, h: f64) -> Result<(), StepFault> {
        let earlier = self.step.filter(|_| self.has_led_to(state));
        let known = earlier == Some((h, system.structure()));
        std::mem::swap(&mut self.before, &mut self.older);
        self.before.x.copy_from_slice(state.x());
        self.before.v.copy_from_slice(state.v());
        let end = if known { self.advance(system, state, h) } else { self.start.step(system, state, h) };
        if end.is_ok() {
            (self.started, self.earlier) = (!known, earlier);
            self.remember(system, state, h);
            self.jumped = system.walls_have_acted();
        } else {
            // A failed step leaves the history unchanged.
            std::mem::swap(&mut self.before, &mut self.older);
        }
        end
    }

    fn stage_velocities(&self) -> &[Vec<f64>] {
        if self.started { self.start.stage_velocities() } else { &[] }
    }

    fn undo(&mut self, state: &mut State) {
        if self.started {
            self.start.undo(state);
        } else {
            state.swap(&mut self.next.x, &mut self.next.v, ForceId::NONE);
        }
        std::mem::swap(&mut self.before, &mut self.older);
        self.after.x.copy_from_slice(state.x());
        self.after.v.copy_from_slice(state.v());
        (self.step, self.jumped) = (self.earlier.take(), false);
    }

    fn memory(&self, system: &System, state: &State) -> Vec<f64> {
        let known = self.step.filter(|(_, set)| *set == system.structure() && self.has_led_to(state));
        known.map_or(vec![], |(h, _)| [&[h], &self.before.x[..], &self.before.v].concat())
    }

    fn recall(&mut self, memory: &[f64], system: &System, state: &State) {
        let n = self.z.len();
        self.step = None;
        if let Some((h, rows)) = memory.split_first().filter(|(_, rows)| rows.len() == 2 * n) {
            self.before.x.copy_from_slice(&rows[..n]);
            self.before.v.copy_from_slice(&rows[n..]);
            self.started = false;
            self.remember(system, state, *h);
        }
    }

    fn exchange_structure(&mut self, system: &System, lent: Option<LentStructure>) -> Option<LentStructure> {
        self.solver.exchange_structure(system, lent)
    }

    fn work(&self) -> SolverWork {
        self.solver.work().plus(self.start.work())
    }

    fn solver_bytes(&self, system: &mut System, x: &[f64]) -> usize {
        self.solver.bytes(system, x).saturating_add(self.start.solver_bytes(system, x))
    }
}

impl Bdf2 {
    /// Takes a BDF2 step; the previous state is in `older`.
    fn advance(&mut self, system: &mut System, state: &mut State, h: f64) -> Result<(), StepFault> {
        for i in 0..self.z.len() {
            self.z[i] = (state.x()[i] - self.older.x[i]) / 3.0;
            self.w[i] = (4.0 * state.v()[i] - self.older.v[i]) / 3.0;
        }
        let stage = StageEquations {
            x: state.x(),
            z: &self.z,
            w: &self.w,
            g: 2.0 / 3.0 * h,
            time: state.time + h,
            mean_of_held: false,
        };
        let NextState { x, v } = &mut self.next;
        x.copy_from_slice(state.x());
        guess_acceleration(system, state, &mut self.acceleration);
        self.solver.solve(system, &stage, x, v, &mut self.acceleration, false)?;
        let force = system.force();
        self.next.commit(system, state, h, force)
    }
}
