//! Arc-length continuation: paths of static equilibria through limit and turning points.
//!
//! The load factor `lambda` is an unknown, and takes the place of time in loads and prescribed motion. A
//! step covers a given distance `l` along the path of equilibria `g(x, lambda) = dE/dx = 0`,
//!
//! ```text
//! |dx| = l        |u|^2 = (1/n) sum_i |u_i|^2 over the n vertices that are free
//! ```
//!
//! (Riks 1979; the cylindrical constraint of Crisfield 1981, *A fast incremental/iterative solution
//! procedure that handles snap-through*, Computers & Structures 13, 55). Each iteration solves two
//! systems with one factorisation of the exact tangent `K`: `K d_g = -g` and `K d_q = q`, with
//! `q = -dg/dlambda` the load rate. The increment of `lambda` is the root of the quadratic
//! `|dx + d_g + dlambda d_q| = l` that turns `dx` less. The initial direction of a step is that of the
//! last step, which also passes turning points (Feng, Peric, Owen 1996).
//!
//! Radii follow the iterations (Ramm 1981): `l_(n+1) = l_n sqrt(desired / taken)`. A failed step is
//! retried with a quarter of its radius.

mod constraint;
mod follower;

pub(super) use follower::PathFollower;

use serde::{Deserialize, Serialize};

use super::{Simulation, StepError};

/// Options of arc-length continuation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ArcLength {
    /// First increment of the load factor.
    pub first: f64,
    /// Load factors that end the run; the last step ends exactly there.
    pub load: Option<[f64; 2]>,
    /// Largest step length [m]; `None`: a twentieth of the scene size.
    pub largest: Option<f64>,
}

/// Limit point: a local maximum or minimum of the load factor along the path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LimitPoint {
    /// Step at whose end it was passed.
    pub step: u64,
    /// Load factor at the limit point, from the parabola through three steps.
    pub load_factor: f64,
    /// True for a maximum.
    pub is_maximum: bool,
}

/// State of a path of equilibria.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PathState {
    /// Current load factor.
    pub load_factor: f64,
    /// Arc length covered so far [m].
    pub arc_length: f64,
    /// Limit points, in the order passed.
    pub limit_points: Vec<LimitPoint>,
    /// Steps retried with a smaller radius.
    pub cut_back: u64,
    /// Smallest and largest length of solved steps [m]; zero before the first.
    pub radii: [f64; 2],
    /// True if the path has reached a load factor that ends it.
    pub has_ended: bool,
    /// Radius of the next step [m]; zero before the first.
    radius: f64,
    first_radius: f64,
    /// Increments of the last step, flat [m], in system order, and of the load factor.
    way: Vec<f64>,
    load_way: f64,
    /// Length of the last step [m].
    length: f64,
}

impl Simulation {
    /// Enables arc-length continuation: steps follow the path of equilibria. Loads and prescribed motion
    /// depend on the load factor, which starts at 0, instead of time; time counts the steps.
    ///
    /// # Panics
    /// If the method is not [static](crate::integrator::Method::is_static).
    pub fn set_arc_length(&mut self, options: ArcLength) {
        assert!(self.method.is_static(), "a path of equilibria");
        self.path = Some(Box::new(PathFollower::new(self.system.dimension(), options)));
        self.system.set_load_factor(Some(0.0));
        self.state.v_mut().fill(0.0);
        // Loads at the current time may differ from those at the load factor.
        self.state.x_mut();
    }

    /// Continues from this state of a path; `None`: from its start.
    pub(super) fn set_path(&mut self, state: Option<PathState>) {
        let Some(path) = &mut self.path else { return };
        path.state = state.unwrap_or_default();
        self.system.set_load_factor(Some(path.state.load_factor));
        // Terms need the new load factor.
        self.state.x_mut();
    }

    /// Returns the path of equilibria so far; `None` without continuation.
    pub fn path(&self) -> Option<&PathState> {
        self.path.as_ref().map(|path| &path.state)
    }

    /// Returns the current load factor; `None` without continuation.
    pub fn load_factor(&self) -> Option<f64> {
        self.path().map(|path| path.load_factor)
    }

    /// True if the path has reached a load factor that ends the run.
    pub(crate) fn path_has_ended(&self) -> bool {
        self.path().is_some_and(|path| path.has_ended)
    }

    /// Takes one step along the path.
    pub(super) fn step_along_path(&mut self, mut path: Box<PathFollower>) -> Result<(), StepError> {
        let h = self.step_size;
        let end = (self.state.step + 1) as f64 * h;
        self.attempts += 1;
        let begun = self.ensure_force(self.state.time);
        self.open_ledger(false);
        let size = self.solver.size.unwrap_or_else(|| self.length_scale());
        let tolerance = self.solver.tolerance.unwrap_or(1e-9 * size);
        let taken = match begun {
            Ok(()) => path.step(&mut self.system, &mut self.state, (tolerance, size)),
            Err(error) => {
                self.path = Some(path);
                return Err(error);
            }
        };
        self.path = Some(path);
        taken.map_err(|fault| self.not_finite(fault, None))?;
        self.state.step += 1;
        self.state.time = end;
        self.ensure_force(end)?;
        self.note_step(end - h, h);
        Ok(())
    }
}
