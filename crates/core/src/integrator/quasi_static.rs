//! Static equilibrium at the end of each step: `dE/dx(x, t) = 0` under slowly changing loads and
//! prescribed motion.
//!
//! Time is the load parameter: there is no inertia, and only prescribed motion has velocities. Newton's
//! method minimises the energy from the last equilibrium. Steps are load increments; if they are
//! adaptive, their size depends on how many matrices the last ones took
//! ([`control::increments`](crate::control::increments)).
use super::estimate::{Judgement, Tolerances};
use super::implicit::{ImplicitSolve, NextState, StageSolver};
use super::{Documentation, Integrator, Method, Scheme};
use crate::solver::StepFault;
use crate::solver::structure::LentStructure;
use crate::solver::{SolverOptions, SolverWork, Velocity};
use crate::state::State;
use crate::system::{ForceId, System};

/// The quasi-static method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "quasi-static",
        summary: "No dynamics: static equilibrium under the loads and the prescribed motion of each step",
        order: 0,
        force_evaluations: 0,
        solves: 1,
        stability_limit: f64::INFINITY,
        symplectic: false,
        conserves: "nothing: there is no inertia",
        source: "Nocedal, Wright 2006, Numerical optimization, algorithm 3.2",
    },
    scheme: Scheme::QuasiStatic,
};

/// Integrator of quasi-statics.
pub struct QuasiStatic {
    solver: StageSolver,
    next: NextState,
    origin: Vec<f64>,
    /// Zero: no drift in statics.
    drift: Vec<f64>,
    /// Matrices of the last step; iterations if none was assembled.
    matrices: u64,
    /// Velocities that dissipative terms saw at the end of the last step [m/s]: one vector, none without
    /// dissipation.
    seen: Vec<Vec<f64>>,
}

impl QuasiStatic {
    /// Creates the integrator for `unknowns` coordinates.
    pub fn new(unknowns: usize, options: SolverOptions) -> Self {
        let zero = || vec![0.0; unknowns];
        QuasiStatic {
            solver: StageSolver::new(options),
            next: NextState::new(unknowns),
            origin: zero(),
            drift: zero(),
            matrices: 0,
            seen: vec![],
        }
    }
}

impl Integrator for QuasiStatic {
    fn step(&mut self, system: &mut System, state: &mut State, h: f64) -> Result<(), StepFault> {
        let time = state.time + h;
        self.next.x.copy_from_slice(state.x());
        self.next.v.fill(0.0);
        self.solver.prescribe(system, time, &mut self.next.x, &mut self.next.v)?;
        // Dissipative terms resist the step from the last equilibrium to this one.
        self.origin.copy_from_slice(state.x());
        self.solver.target(state.x().len()).fill(0.0);
        let solve = ImplicitSolve {
            inertia: 0.0,
            stiffness: 1.0,
            time,
            velocity: Velocity { origin: &self.origin, rate: 1.0 / h, drift: &self.drift },
            acceleration: None,
            single_iteration: false,
        };
        // Solve, and count the matrices for the step size control.
        let before = self.solver.work();
        self.solver.minimize(system, &solve, &mut self.next.x, &self.next.v)?;
        let after = self.solver.work();
        self.matrices = match after.hessians - before.hessians {
            0 => after.newton_iterations - before.newton_iterations,
            matrices => matrices,
        };
        // Commit the equilibrium; keep the velocities that dissipative terms saw.
        let force = system.force();
        self.next.commit(system, state, h, force)?;
        self.seen.clear();
        if system.is_damped() {
            let on_the_way = state.x().iter().zip(&self.origin).map(|(x, before)| (x - before) / h);
            let each = on_the_way.zip(state.v()).zip(system.inverse_mass());
            let seen = each.map(|((way, held), weight)| if *weight == 0.0 { *held } else { way });
            self.seen.push(seen.collect());
        }
        Ok(())
    }

    fn undo(&mut self, state: &mut State) {
        state.swap(&mut self.next.x, &mut self.next.v, ForceId::NONE);
    }

    fn judge(&mut self, _: &mut System, _: &State, _: f64, _: &Tolerances) -> Option<Judgement> {
        Some(Judgement::Matrices(self.matrices))
    }

    /// Returns one stage, the equilibrium: the velocity from the last equilibrium for free coordinates,
    /// the prescribed velocity for the others.
    fn stage_velocities(&self) -> &[Vec<f64>] {
        &self.seen
    }

    fn exchange_structure(&mut self, system: &System, lent: Option<LentStructure>) -> Option<LentStructure> {
        self.solver.exchange_structure(system, lent)
    }

    fn work(&self) -> SolverWork {
        self.solver.work()
    }

    fn solver_bytes(&self, system: &mut System, x: &[f64]) -> usize {
        self.solver.bytes(system, x)
    }
}
