//! Generalised-alpha methods, including Newmark's: one implicit solve per step, with the old acceleration
//! as history.

use super::Integrator;
use super::equations::acceleration;
use super::implicit::{ImplicitSolve, NextState, StageSolver};
use crate::solver::StepFault;
use crate::solver::structure::LentStructure;
use crate::solver::{SolverOptions, SolverWork, Velocity};
use crate::state::State;
use crate::system::{ForceId, System};

/// Coefficients of the generalised-alpha equation of motion with Newmark's formulas:
///
/// ```text
/// M a_(n+1-alpha_m) = f(x_(n+1-alpha_f)) - c M v_(n+1-alpha_f)
/// x_(n+1) = x_n + h v_n + h^2 ((1/2 - beta) a_n + beta a_(n+1))
/// v_(n+1) = v_n + h ((1 - gamma) a_n + gamma a_(n+1))
/// y_(n+1-alpha) = (1 - alpha) y_(n+1) + alpha y_n
/// ```
///
/// Chung, Hulbert 1993, "A time integration algorithm for structural dynamics with improved numerical
/// dissipation", eqs. 1 to 6.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlphaCoefficients {
    /// Weight of the old acceleration in the equation of motion.
    pub alpha_m: f64,
    /// Weight of the old force in the equation of motion.
    pub alpha_f: f64,
    /// Newmark's `beta`.
    pub beta: f64,
    /// Newmark's `gamma`.
    pub gamma: f64,
}

/// Integrator of the generalised-alpha family.
pub struct Alpha {
    coefficients: AlphaCoefficients,
    solver: StageSolver,
    /// State at the end of the last step, to which `history` belongs.
    after: NextState,
    history: AlphaHistory,
    /// History at the start of the last step.
    earlier: AlphaHistory,
    /// Displacement at which the stage's velocity vanishes.
    drift: Vec<f64>,
    next: NextState,
}

/// Accelerations after the last two steps.
struct AlphaHistory {
    acceleration: Vec<f64>,
    /// `acceleration` before the last step.
    before: Vec<f64>,
    /// Size of the last step [s].
    size: f64,
    /// Structure version of the system for both accelerations; `None` without history.
    known: Option<u64>,
}

impl AlphaHistory {
    fn none(unknowns: usize) -> Self {
        let zeros = || vec![0.0; unknowns];
        AlphaHistory { acceleration: zeros(), before: zeros(), size: 0.0, known: None }
    }

    fn copy_from(&mut self, other: &AlphaHistory) {
        self.acceleration.copy_from_slice(&other.acceleration);
        self.before.copy_from_slice(&other.before);
        (self.size, self.known) = (other.size, other.known);
    }
}

impl Alpha {
    /// Creates the integrator for `unknowns` coordinates.
    pub fn new(coefficients: AlphaCoefficients, unknowns: usize, options: SolverOptions) -> Self {
        Alpha {
            coefficients,
            solver: StageSolver::new(options),
            after: NextState::new(unknowns),
            history: AlphaHistory::none(unknowns),
            earlier: AlphaHistory::none(unknowns),
            drift: vec![0.0; unknowns],
            next: NextState::new(unknowns),
        }
    }

    /// Computes the acceleration of the state from its force.
    fn start(&mut self, system: &mut System, state: &mut State) -> Result<(), StepFault> {
        if !state.ensure_force(system, state.time) {
            return Err(StepFault::at(system, state.x(), state.v()));
        }
        acceleration(system, state.x(), state.v(), &mut self.history.acceleration);
        Ok(())
    }

    /// Restores the history at the start of the last step.
    fn go_back(&mut self) {
        std::mem::swap(&mut self.history, &mut self.earlier);
        self.earlier.known = None;
    }

    /// True if the history belongs to this state.
    fn is_known(&self, system: &System, state: &State) -> bool {
        let AlphaHistory { known, .. } = self.history;
        known == Some(system.structure()) && *self.after.x == *state.x() && *self.after.v == *state.v()
    }
}

impl Integrator for Alpha {
    fn step(&mut self, system: &mut System, state: &mut State, h: f64) -> Result<(), StepFault> {
        let is_known = self.is_known(system, state);
        self.earlier.copy_from(&self.history);
        self.history.known = None;
        if !is_known {
            self.earlier.known = None;
            self.start(system, state)?;
        } else if h != self.history.size {
            self.resize(h);
        }
        let end = self.advance(system, state, h);
        if end.is_ok() {
            // If walls moved vertices, the stored acceleration belongs to positions behind the walls. If
            // it is the acceleration of this very time, it is computed from the force again.
            let AlphaCoefficients { alpha_m, alpha_f, .. } = self.coefficients;
            let is_elsewhere = system.walls_have_acted() && alpha_m == alpha_f;
            self.history.known = (!is_elsewhere).then(|| system.structure());
            self.history.size = h;
        } else {
            // A failed step leaves the history unchanged.
            self.go_back();
        }
        end
    }

    fn undo(&mut self, state: &mut State) {
        state.swap(&mut self.next.x, &mut self.next.v, ForceId::NONE);
        self.go_back();
        self.after.x.copy_from_slice(state.x());
        self.after.v.copy_from_slice(state.v());
    }

    fn memory(&self, system: &System, state: &State) -> Vec<f64> {
        let AlphaHistory { acceleration, before, size, .. } = &self.history;
        if self.is_known(system, state) { [&[*size], &acceleration[..], before].concat() } else { vec![] }
    }

    fn recall(&mut self, memory: &[f64], system: &System, state: &State) {
        let AlphaHistory { acceleration, before, size: last, known } = &mut self.history;
        let n = acceleration.len();
        let memory = memory.split_first().filter(|(_, rows)| rows.len() == 2 * n);
        *known = memory.map(|(size, rows)| {
            acceleration.copy_from_slice(&rows[..n]);
            before.copy_from_slice(&rows[n..]);
            *last = *size;
            self.after.x.copy_from_slice(state.x());
            self.after.v.copy_from_slice(state.v());
            system.structure()
        });
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

impl Alpha {
    /// Adapts the stored acceleration to a step of `h` [s]. If `alpha_m` differs from `alpha_f`, it
    /// belongs to another time: `a_n = x''(t_n + (alpha_m - alpha_f) h) + O(h^2)`. For another step size
    /// it is extrapolated along the last difference: `a_n + (alpha_m - alpha_f) (h / h_last - 1) (a_n -
    /// a_(n-1))`. Without this, steps of variable size would be first order.
    fn resize(&mut self, h: f64) {
        let AlphaCoefficients { alpha_m, alpha_f, .. } = self.coefficients;
        let AlphaHistory { acceleration, before, size, .. } = &mut self.history;
        let factor = (alpha_m - alpha_f) * (h / *size - 1.0);
        if factor != 0.0 {
            acceleration.iter_mut().zip(&*before).for_each(|(a, b)| *a += factor * (*a - b));
        }
    }

    /// Takes a step from a state with known acceleration.
    fn advance(&mut self, system: &mut System, state: &mut State, h: f64) -> Result<(), StepFault> {
        let AlphaCoefficients { alpha_m, alpha_f, beta, gamma } = self.coefficients;
        let (x, v, a) = (state.x(), state.v(), &self.history.acceleration);
        let drag = system.ether_drag();
        // With X = x_(n+1-alpha_f), x_(n+1) - x_n = (X - x_n)/(1 - alpha_f), a_(n+1) = (x_(n+1) - x_n -
        // p)/(beta h^2) and v_(n+1) = q + gamma h a_(n+1), the equation of motion is
        // `inertia (X - target) = s a(X)`.
        let (new_m, new_f) = (1.0 - alpha_m, 1.0 - alpha_f);
        let inertia = 1.0 + new_f * gamma * h * drag / new_m;
        let s = beta * h * h * new_f / new_m;
        // The velocity at X vanishes where X - x_n is the drift, and grows with `rate`.
        let rate = gamma / (beta * h);
        let target = self.solver.target(x.len());
        for i in 0..x.len() {
            let p = h * v[i] + h * h * (0.5 - beta) * a[i];
            let q = v[i] + h * (1.0 - gamma) * a[i];
            // Part independent of X: old acceleration and drag of old velocities.
            let old = alpha_m * a[i] + drag * (new_f * q + alpha_f * v[i]);
            target[i] = new_f * p - s / inertia * old;
            self.drift[i] = new_f * p - (new_f * q + alpha_f * v[i]) / rate;
        }
        // Solve for X at the intermediate time.
        let time = state.time + new_f * h;
        self.next.x.copy_from_slice(x);
        self.next.v.fill(0.0);
        self.solver.prescribe(system, time, &mut self.next.x, &mut self.next.v)?;
        let solve = ImplicitSolve {
            inertia,
            stiffness: s,
            time,
            velocity: Velocity { origin: x, rate, drift: &self.drift },
            acceleration: Some(a),
            single_iteration: false,
        };
        self.solver.minimize(system, &solve, &mut self.next.x, &self.next.v)?;
        // Extrapolate X to the end of the step, and derive acceleration and velocity.
        let force = if alpha_f == 0.0 { system.force() } else { ForceId::NONE };
        let AlphaHistory { acceleration, before, .. } = &mut self.history;
        std::mem::swap(acceleration, before);
        let (a, weight) = (&*before, system.inverse_mass());
        for i in 0..x.len() {
            if weight[i] == 0.0 {
                (self.next.v[i], acceleration[i]) = (0.0, 0.0);
                continue;
            }
            let p = h * v[i] + h * h * (0.5 - beta) * a[i];
            let q = v[i] + h * (1.0 - gamma) * a[i];
            let u = self.solver.increments()[i] / new_f;
            acceleration[i] = (u - p) / (beta * h * h);
            self.next.x[i] = x[i] + u;
            self.next.v[i] = q + h * gamma * acceleration[i];
        }
        self.next.commit(system, state, h, force)?;
        self.after.x.copy_from_slice(state.x());
        self.after.v.copy_from_slice(state.v());
        Ok(())
    }
}
