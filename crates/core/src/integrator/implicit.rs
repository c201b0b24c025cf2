//! Shared parts of the implicit integrators: the solve of a stage, and the new state of a step.

use super::equations::{end_step, exact_response};
use crate::lanes::Numbers;
use crate::solver::StepFault;
use crate::solver::structure::LentStructure;
use crate::solver::{Iterate, Minimizer, Objective, SolverOptions, SolverWork, Velocity, minimizer};
use crate::state::State;
use crate::system::{ForceId, System};

/// Equations `X = x_n + z + g V`, `V = w + g (a(X) - c V)` of one stage; `c` is the ether drag.
///
/// Eliminating `V` gives `(1 + g c) (u - y) = g^2 a(x_n + u)` with `u = X - x_n` and
/// `y = z + g w / (1 + g c)`: the stationarity condition of an [`Objective`].
pub(super) struct StageEquations<'a> {
    /// Old positions, flat [m].
    pub(super) x: &'a [f64],
    /// Displacement without the stage's velocity, flat [m].
    pub(super) z: &'a [f64],
    /// Velocity without the stage's acceleration, flat [m/s].
    pub(super) w: &'a [f64],
    /// Step size times the diagonal coefficient [s].
    pub(super) g: f64,
    /// Time of the stage [s].
    pub(super) time: f64,
    /// True if dissipative terms see prescribed coordinates at their mean velocities over the stage.
    pub(super) mean_of_held: bool,
}

/// Parameters of one minimisation except its target.
pub(super) struct ImplicitSolve<'a> {
    pub(super) inertia: f64,
    pub(super) stiffness: f64,
    /// Time of the force evaluations [s].
    pub(super) time: f64,
    pub(super) velocity: Velocity<'a>,
    /// Acceleration for the initial guess.
    pub(super) acceleration: Option<&'a [f64]>,
    pub(super) single_iteration: bool,
}

/// Solves stages; keeps its minimiser and matrices between solves.
pub(super) struct StageSolver {
    options: SolverOptions,
    minimizer: Option<Box<dyn Minimizer>>,
    /// Matrix structure for the minimiser, kept until the minimiser exists.
    lent: Option<LentStructure>,
    target: Vec<f64>,
    at: Iterate,
    guess: Iterate,
    /// Prescribed positions at the end of the solve, if a term limits steps: prescribed coordinates then
    /// move there together with the free ones. Empty without such terms.
    goal: Vec<f64>,
}

impl StageSolver {
    pub(super) fn new(options: SolverOptions) -> Self {
        StageSolver {
            options,
            minimizer: None,
            lent: None,
            target: vec![],
            at: Iterate::default(),
            guess: Iterate::default(),
            goal: vec![],
        }
    }

    /// Sets prescribed coordinates of `x` and their velocities `v` for `time` [s]. If a term limits
    /// steps, `x` is unchanged and the next solve moves these coordinates.
    ///
    /// # Errors
    /// If a value is not finite.
    pub(super) fn prescribe(
        &mut self,
        system: &System,
        time: f64,
        x: &mut [f64],
        v: &mut [f64],
    ) -> Result<(), StepFault> {
        self.goal.clear();
        if !(system.has_guards() && system.has_prescribed_motion()) {
            return if system.prescribe(time, x, v) { Ok(()) } else { Err(StepFault::at(system, x, v)) };
        }
        self.goal.extend_from_slice(x);
        if system.prescribe(time, &mut self.goal, v) {
            return Ok(());
        }
        Err(StepFault::at(system, &self.goal, v))
    }

    /// Solves `stage` for `x` and `v`, and writes the total acceleration `(V - w)/g`. On entry `x` is an
    /// admissible start, usually the configuration of the last step.
    pub(super) fn solve(
        &mut self,
        system: &mut System,
        stage: &StageEquations<'_>,
        x: &mut [f64],
        v: &mut [f64],
        acceleration: &mut [f64],
        single_iteration: bool,
    ) -> Result<(), StepFault> {
        let StageEquations { x: origin, z, w, g, time, mean_of_held } = *stage;
        let inertia = 1.0 + g * system.ether_drag();
        self.target.resize(x.len(), 0.0);
        for i in 0..x.len() {
            self.target[i] = z[i] + g * w[i] / inertia;
        }
        // Prescribed coordinates are set first; the velocity terms below depend on them.
        v.fill(0.0);
        self.prescribe(system, time, x, v)?;
        if mean_of_held {
            let goal = if self.goal.is_empty() { &*x } else { &self.goal };
            for i in (0..x.len()).filter(|i| system.inverse_mass()[*i] == 0.0) {
                v[i] = (goal[i] - origin[i] - z[i]) / g;
            }
        }
        // Minimise, then derive velocity and acceleration from the increments.
        let solve = ImplicitSolve {
            inertia,
            stiffness: g * g,
            time,
            velocity: Velocity { origin, rate: 1.0 / g, drift: z },
            acceleration: Some(acceleration),
            single_iteration,
        };
        self.minimize(system, &solve, x, v)?;
        let weight = system.inverse_mass();
        for i in 0..x.len() {
            if weight[i] == 0.0 {
                acceleration[i] = 0.0;
            } else {
                v[i] = (self.at.u[i] - z[i]) / g;
                acceleration[i] = (v[i] - w[i]) / g;
            }
        }
        Ok(())
    }

    /// Returns the inertial prediction, relative to the old positions, to be filled before
    /// [`minimize`](Self::minimize).
    pub(super) fn target(&mut self, unknowns: usize) -> &mut Vec<f64> {
        self.target.resize(unknowns, 0.0);
        &mut self.target
    }

    /// Minimises the objective and writes the minimiser to `x`. Starts from the best of `x`, the target,
    /// and the target shifted by the acceleration if one is given. `v` has the velocities of prescribed
    /// coordinates.
    pub(super) fn minimize(
        &mut self,
        system: &mut System,
        solve: &ImplicitSolve<'_>,
        x: &mut [f64],
        v: &[f64],
    ) -> Result<(), StepFault> {
        let ImplicitSolve { inertia, stiffness, time, velocity, acceleration, single_iteration } = *solve;
        system.set_time(time);
        let StageSolver { options, minimizer: kept, lent, target, at, guess, goal } = self;
        let goal = (!goal.is_empty()).then_some(&goal[..]);
        // Set up objective and minimiser; the structure lent earlier goes to a new minimiser.
        let objective =
            Objective { inertia, target, stiffness, velocity, held_velocity: v, goal, single_iteration };
        let minimizer = kept.get_or_insert_with(|| minimizer(system.dimension(), *options));
        if let Some(lent) = lent.take() {
            minimizer.exchange_structure(system, Some(lent));
        }
        for buffer in [&mut at.x, &mut at.u, &mut guess.x, &mut guess.u] {
            buffer.resize(x.len(), 0.0);
        }
        at.x.copy_from_slice(x);
        for i in 0..x.len() {
            at.u[i] = x[i] - velocity.origin[i];
        }
        // In statics the last equilibrium is the only start.
        if !single_iteration && inertia > 0.0 {
            let mut best = minimizer.objective(system, &objective, at);
            for acceleration in [None, acceleration] {
                for (i, held) in system.inverse_mass().iter().map(|w| *w == 0.0).enumerate() {
                    guess.u[i] = target[i] + acceleration.map_or(0.0, |a| stiffness / inertia * a[i]);
                    guess.x[i] = if held { x[i] } else { velocity.origin[i] + guess.u[i] };
                }
                if system.has_guards() {
                    shorten(system, &velocity, x, guess);
                }
                let there = minimizer.objective(system, &objective, guess);
                if there < best {
                    best = there;
                    std::mem::swap(at, guess);
                }
            }
        }
        let end = minimizer.minimize(system, &objective, at);
        x.copy_from_slice(&at.x);
        end
    }

    /// Solves with the matrix of the last solve, or with a kept one of the same coefficients, in place.
    /// Returns false if there is no matrix.
    pub(super) fn solve_last(&mut self, right: &mut [f64]) -> bool {
        self.minimizer.as_mut().is_some_and(|minimizer| minimizer.solve_last(right))
    }

    /// Returns the matrix structure and replaces it by `lent`.
    pub(super) fn exchange_structure(
        &mut self,
        system: &System,
        lent: Option<LentStructure>,
    ) -> Option<LentStructure> {
        match &mut self.minimizer {
            Some(minimizer) => minimizer.exchange_structure(system, lent),
            None => std::mem::replace(&mut self.lent, lent),
        }
    }

    /// Returns the displacement of the last minimum from the old positions, flat [m]; more accurate than
    /// the difference of positions.
    pub(super) fn increments(&self) -> &[f64] {
        &self.at.u
    }

    pub(super) fn work(&self) -> SolverWork {
        self.minimizer.as_ref().map_or(SolverWork::default(), |m| m.work())
    }

    /// Estimates the memory after a stage of `system` near `x`, flat [m], has been solved, in bytes.
    pub(super) fn bytes(&self, system: &mut System, x: &[f64]) -> usize {
        minimizer(system.dimension(), self.options).predicted_bytes(system, x)
    }
}

/// Shortens a guess to the collision-free part of the straight path from `x`, as seen by terms that limit
/// steps.
fn shorten(system: &System, velocity: &Velocity<'_>, x: &[f64], guess: &mut Iterate) {
    let dx: Vec<f64> = guess.x.iter().zip(x).map(|(guess, x)| guess - x).collect();
    let Some((part, _)) = system.shortened_way(x, &dx) else { return };
    for i in (0..x.len()).filter(|i| system.inverse_mass()[*i] > 0.0) {
        guess.u[i] = x[i] - velocity.origin[i] + part * dx[i];
        guess.x[i] = velocity.origin[i] + guess.u[i];
    }
}

/// Writes the acceleration at the start of a step to `a`, for the initial guess of the first solve. It
/// depends on the state alone, as the step itself does.
pub(super) fn guess_acceleration(system: &mut System, state: &State, a: &mut [f64]) {
    if !system.holds(state.force) {
        return a.fill(0.0);
    }
    system.evaluate_dissipation(state.x(), state.v());
    system.accelerations(a);
}

/// New state of a step; swapped with the old one at its end.
#[derive(Default)]
pub(super) struct NextState {
    pub(super) x: Numbers,
    pub(super) v: Numbers,
}

impl NextState {
    pub(super) fn new(unknowns: usize) -> Self {
        NextState { x: Numbers::zeros(unknowns), v: Numbers::zeros(unknowns) }
    }

    /// Ends a step of size `h` here.
    pub(super) fn commit(
        &mut self,
        system: &mut System,
        state: &mut State,
        h: f64,
        force: ForceId,
    ) -> Result<(), StepFault> {
        // The exact response equals that of the method to its order. Only walls without contact use it: the
        // step was solved without them, and they put back the vertices that ended behind them.
        end_step(system, state, h, (&mut self.x, &mut self.v), force, &exact_response)
    }
}
