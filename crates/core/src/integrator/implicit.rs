//! Parts that implicit schemes have in common: stages that are solved, and the memory of a step.

use super::equations::{end_step, exact_response};
use crate::lanes::Numbers;
use crate::solver::StepFault;
use crate::solver::structure::LentStructure;
use crate::solver::{Iterate, Minimizer, Objective, SolverOptions, SolverWork, Velocity, minimizer};
use crate::state::State;
use crate::system::{ForceId, System};

/// The equations `X = x_n + z + g V`, `V = w + g (a(X) - c V)` of one stage, `c` the ether drag.
///
/// Eliminated: `(1 + g c) (u - y) = g^2 a(x_n + u)` with `u = X - x_n` and `y = z + g w / (1 + g c)`, the
/// minimum of an [`Objective`].
pub(super) struct StageEquations<'a> {
    /// The old positions, flat [m].
    pub(super) x: &'a [f64],
    /// How far the vertices are from there without the stage's velocity, flat [m].
    pub(super) z: &'a [f64],
    /// Their velocity without the stage's acceleration, flat [m/s].
    pub(super) w: &'a [f64],
    /// Step size times the diagonal coefficient [s].
    pub(super) g: f64,
    /// Time of the stage [s].
    pub(super) time: f64,
    /// Dissipative terms see held coordinates at their mean velocities over the stage.
    pub(super) mean_of_held: bool,
}

/// One minimisation, but for its target.
pub(super) struct ImplicitSolve<'a> {
    pub(super) inertia: f64,
    pub(super) stiffness: f64,
    /// Time at which forces are evaluated [s].
    pub(super) time: f64,
    pub(super) velocity: Velocity<'a>,
    /// For a start.
    pub(super) acceleration: Option<&'a [f64]>,
    pub(super) single_iteration: bool,
}

/// Solves stages; keeps what was learnt for the next.
pub(super) struct StageSolver {
    options: SolverOptions,
    minimizer: Option<Box<dyn Minimizer>>,
    /// Structure of matrices that the minimiser is to go on with, until there is one.
    lent: Option<LentStructure>,
    target: Vec<f64>,
    at: Iterate,
    guess: Iterate,
    /// Where held coordinates are to be at the end of the solve, where a term guards ways: they go there with
    /// the others. Empty where nothing guards them.
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

    /// Moves held coordinates of `x`, and sets their velocities `v`, as prescribed at `time` [s]. Where a
    /// term guards ways, `x` stays as it is, and the next solve takes them along.
    ///
    /// # Errors
    /// A number is not finite.
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

    /// Solves `stage` into `x` and `v`, and writes `(V - w)/g`, the whole acceleration. `x` is the start on
    /// entry: a configuration that is allowed, usually that of the last step.
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
        // Held coordinates are where they are held, and what follows goes by these.
        v.fill(0.0);
        self.prescribe(system, time, x, v)?;
        if mean_of_held {
            let goal = if self.goal.is_empty() { &*x } else { &self.goal };
            for i in (0..x.len()).filter(|i| system.inverse_mass()[*i] == 0.0) {
                v[i] = (goal[i] - origin[i] - z[i]) / g;
            }
        }
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

    /// Where the vertices would go without force, from the old positions, to be filled before
    /// [`minimize`](Self::minimize).
    pub(super) fn target(&mut self, unknowns: usize) -> &mut Vec<f64> {
        self.target.resize(unknowns, 0.0);
        &mut self.target
    }

    /// Minimises an objective, and writes where the minimum is to `x`, from the best of three starts: `x`,
    /// the target, and the target moved on by an acceleration, where there is one. `v` has the velocities of
    /// held coordinates.
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
        // In statics there is no other start than the last equilibrium.
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

    /// Replaces `right` by the solution with the matrix of the last solve, or one kept from before with the
    /// same coefficients; false where there is none.
    pub(super) fn solve_last(&mut self, right: &mut [f64]) -> bool {
        self.minimizer.as_mut().is_some_and(|minimizer| minimizer.solve_last(right))
    }

    /// Gives the structure of its matrices away, and goes on with the one `lent`.
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

    /// Distance of the last minimum from the old positions, more exactly than its own positions say; flat
    /// [m].
    pub(super) fn increments(&self) -> &[f64] {
        &self.at.u
    }

    pub(super) fn work(&self) -> SolverWork {
        self.minimizer.as_ref().map_or(SolverWork::default(), |m| m.work())
    }

    pub(super) fn bytes(&self) -> usize {
        8 * (self.target.len() + self.goal.len())
            + self.at.bytes()
            + self.guess.bytes()
            + self.minimizer.as_ref().map_or(0, |m| m.bytes())
            + self.lent.as_ref().map_or(0, LentStructure::bytes)
    }

    /// Bytes beyond [`bytes`](Self::bytes) once a stage near `x` has been solved.
    pub(super) fn further_bytes(&self, system: &mut System, x: &[f64]) -> usize {
        let predicted = minimizer(system.dimension(), self.options).predicted_bytes(system, x);
        // The target, and two configurations.
        (predicted + 8 * 5 * x.len()).saturating_sub(self.bytes())
    }
}

/// Takes a guess back to where the straight way from `x` is free, as terms that guard ways see it.
fn shorten(system: &System, velocity: &Velocity<'_>, x: &[f64], guess: &mut Iterate) {
    let dx: Vec<f64> = guess.x.iter().zip(x).map(|(guess, x)| guess - x).collect();
    let Some((part, _)) = system.shortened_way(x, &dx) else { return };
    for i in (0..x.len()).filter(|i| system.inverse_mass()[*i] > 0.0) {
        guess.u[i] = x[i] - velocity.origin[i] + part * dx[i];
        guess.x[i] = velocity.origin[i] + guess.u[i];
    }
}

/// Writes the acceleration at the beginning of a step to `a`, where to start the first solve from: like the
/// step itself it depends on the state alone, and not on steps before.
pub(super) fn guess_acceleration(system: &mut System, state: &State, a: &mut [f64]) {
    if !system.holds(state.force) {
        return a.fill(0.0);
    }
    system.evaluate_dissipation(state.x(), state.v());
    system.accelerations(a);
}

/// The new state of a step, swapped with the old one at its end.
#[derive(Default)]
pub(super) struct NextState {
    pub(super) x: Numbers,
    pub(super) v: Numbers,
}

impl NextState {
    pub(super) fn new(unknowns: usize) -> Self {
        NextState { x: Numbers::zeros(unknowns), v: Numbers::zeros(unknowns) }
    }

    /// Ends a step of `h` here.
    pub(super) fn commit(
        &mut self,
        system: &mut System,
        state: &mut State,
        h: f64,
        force: ForceId,
    ) -> Result<(), StepFault> {
        // To the order of the scheme. Only walls that are no contact see it: the step was solved without
        // them, and they put back what it has left behind them.
        end_step(system, state, h, (&mut self.x, &mut self.v), force, &exact_response)
    }

    pub(super) fn bytes(&self) -> usize {
        8 * (self.x.len() + self.v.len())
    }
}
