//! Paths of equilibria by arc length, through limit points and turning points.
//!
//! The load factor `lambda` is an unknown: loads and prescribed motion are those of the "time" `lambda`, and
//! a step goes a given distance `l` along the path of equilibria `g(x, lambda) = dE/dx = 0`,
//!
//! ```text
//! |dx| = l        |u|^2 = (1/n) sum_i |u_i|^2 over the n vertices that are free
//! ```
//!
//! (Riks 1979; the cylindrical constraint of Crisfield 1981, *A fast incremental/iterative solution
//! procedure that handles snap-through*, Computers & Structures 13, 55). With one factorisation of the exact
//! tangent `K` two systems are solved in every iteration, `K d_g = -g` and `K d_q = q`, `q = -dg/dlambda` the
//! rate of the load. The increment of `lambda` is that root of the quadratic `|dx + d_g + dlambda d_q| = l`
//! that turns `dx` less. The first direction of a step is that of the last one, which leads through turning
//! points too (Feng, Peric, Owen 1996).
//!
//! Radii follow the iterations (Ramm 1981): `l_(n+1) = l_n sqrt(desired / taken)`; a step that is not solved
//! is taken back and tried with a quarter of its radius.

mod constraint;
mod follower;

pub(super) use follower::PathFollower;

use serde::{Deserialize, Serialize};

use super::{Simulation, StepError};

/// How a path of equilibria is followed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ArcLength {
    /// The first increment of the load factor.
    pub first: f64,
    /// The run ends where the path comes to one of these load factors, exactly there.
    pub load: Option<[f64; 2]>,
    /// Largest distance of a step [m]; `None`: a twentieth of the size of the scene.
    pub largest: Option<f64>,
}

/// A point of a path where the load factor was largest, or least.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LimitPoint {
    /// The step at whose end it was passed.
    pub step: u64,
    /// The load factor there: that of the parabola through three steps.
    pub load_factor: f64,
    /// True if it was largest there.
    pub is_maximum: bool,
}

/// Path of equilibria so far.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PathState {
    /// The load factor now.
    pub load_factor: f64,
    /// Distance that the steps have gone [m].
    pub arc_length: f64,
    /// Limit points, in the order in which they were passed.
    pub limit_points: Vec<LimitPoint>,
    /// Steps that were taken back and tried with a smaller radius.
    pub cut_back: u64,
    /// Least and largest radius of steps that were solved [m]; zero before the first.
    pub radii: [f64; 2],
    /// True if the path has come to one of the load factors that end it.
    pub has_ended: bool,
    /// Radius of the next step [m]; zero before the first.
    radius: f64,
    first_radius: f64,
    /// Increments of the last step, flat [m], in the order of the system, and of the load factor.
    way: Vec<f64>,
    load_way: f64,
    /// Length of the last step [m].
    length: f64,
}

impl Simulation {
    /// Follows the path of equilibria by arc length from now on: steps go along it, loads and prescribed
    /// motion are those of the load factor, which begins at 0, in place of the time, and time counts the
    /// steps.
    ///
    /// # Panics
    /// If the scheme is not [static](crate::integrator::Method::is_static).
    pub fn set_arc_length(&mut self, options: ArcLength) {
        assert!(self.method.is_static(), "a path of equilibria");
        self.path = Some(Box::new(PathFollower::new(self.system.dimension(), options)));
        self.system.set_load_factor(Some(0.0));
        self.state.v_mut().fill(0.0);
        // Loads of the time are others than those of the load factor.
        self.state.x_mut();
    }

    /// Goes on from this point of a path; `None`: from its beginning.
    pub(super) fn set_path(&mut self, state: Option<PathState>) {
        let Some(path) = &mut self.path else { return };
        path.state = state.unwrap_or_default();
        self.system.set_load_factor(Some(path.state.load_factor));
        // The terms are to hear of it.
        self.state.x_mut();
    }

    /// The path of equilibria so far; `None` where none is followed.
    pub fn path(&self) -> Option<&PathState> {
        self.path.as_ref().map(|path| &path.state)
    }

    /// The load factor now; `None` where no path is followed.
    pub fn load_factor(&self) -> Option<f64> {
        self.path().map(|path| path.load_factor)
    }

    /// True if the path has come to a load factor that ends the run.
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
        self.note_in_ledger(end - h, h);
        Ok(())
    }
}
