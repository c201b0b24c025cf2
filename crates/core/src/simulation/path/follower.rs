//! Arc-length steps along a path of equilibria.

use super::constraint::{crossed, dot, increment, norm};
use super::{ArcLength, LimitPoint, PathState};
use crate::solver::tangent::{ExactTangent, exact_tangent};
use crate::solver::{SolveError, SolveFailure, SolverWork, StepFault};
use crate::state::State;
use crate::system::System;

/// Desired iterations per step.
const DESIRED: f64 = 5.0;
/// Iterations after which a step fails.
const MOST: u32 = 20;
/// Bounds of the ratio of consecutive radii.
const FACTOR: [f64; 2] = [0.5, 2.0];
/// Radius reduction after a failed step.
const AFTER_FAILURE: f64 = 0.25;
/// Smallest radius, as a fraction of the first one; below it the run ends.
const LEAST_RADIUS: f64 = 1e-6;
/// Default largest radius, as a fraction of the scene size.
const LARGEST_RADIUS: f64 = 0.05;
/// Difference step for load rates, as a fraction of the first increment; exact for proportional loads.
const DIFFERENCE: f64 = 1e-3;
/// Corrections of this many units in the last place of the positions are rounding.
const ULPS: f64 = 64.0;

/// Arc-length continuation.
pub(in super::super) struct PathFollower {
    pub(in super::super) options: ArcLength,
    pub(in super::super) state: PathState,
    tangent: Box<dyn ExactTangent>,
    work: SolverWork,
}

/// A point on or near the path.
struct PathPoint {
    x: Vec<f64>,
    v: Vec<f64>,
    load: f64,
}

/// Solutions of the two tangent systems.
struct Solutions {
    /// Correction by the residual force.
    correction: Vec<f64>,
    /// Displacement per load factor.
    by_load: Vec<f64>,
}

impl PathFollower {
    pub(in super::super) fn new(dimension: usize, options: ArcLength) -> Self {
        PathFollower {
            options,
            state: PathState::default(),
            tangent: exact_tangent(dimension),
            work: SolverWork::default(),
        }
    }

    pub(in super::super) fn work(&self) -> SolverWork {
        self.work
    }

    /// Moves `state` one step along the path with the tolerance [m] and the scene `size` [m].
    pub(super) fn step(
        &mut self,
        system: &mut System,
        state: &mut State,
        (tolerance, size): (f64, f64),
    ) -> Result<(), StepFault> {
        let start = PathPoint { x: state.x().to_vec(), v: state.v().to_vec(), load: self.state.load_factor };
        let found = self.solve_step(system, &start, (tolerance, size));
        match found {
            Ok((end, radius, iterations)) => {
                self.accept(system, state, &start, end, (radius, iterations), size);
                Ok(())
            }
            Err(fault) => {
                system.set_load_factor(Some(start.load));
                self.state.has_ended = false;
                Err(fault)
            }
        }
    }

    /// Returns the end of the next step from `start`, its radius and its iterations.
    fn solve_step(
        &mut self,
        system: &mut System,
        start: &PathPoint,
        (tolerance, size): (f64, f64),
    ) -> Result<(PathPoint, f64, u32), StepFault> {
        // Tangent of the path at the start, and the first radius.
        let Some(solutions) = self.solutions(system, start) else {
            return Err(failure(system, start, SolveFailure::Singular, 0, 0.0));
        };
        let by_load = solutions.by_load;
        let reach = norm(system, &by_load);
        if reach.is_nan() || reach <= 0.0 {
            return Err(failure(system, start, SolveFailure::Unloaded, 0, 0.0));
        }
        if self.state.first_radius == 0.0 {
            let first = self.largest(size).min(self.options.first.abs() * reach);
            (self.state.radius, self.state.first_radius) = (first, first);
        }
        // Direction along the path.
        let forwards = if self.state.way.is_empty() {
            self.options.first.signum()
        } else {
            // Continue in the direction of the last step: beyond a limit point the load decreases.
            let along = dot(system, &self.state.way, &by_load);
            if along == 0.0 { self.state.load_way.signum() } else { along.signum() }
        };
        let mut radius = self.state.radius;
        loop {
            // Correct the predictor; retry with a smaller radius if that fails.
            let load_way = forwards * radius / reach;
            let found = self.correct(system, start, (&by_load, load_way), radius, tolerance);
            let landed = found.and_then(|(end, iterations)| {
                Ok((self.land_on_bound(system, start, end, tolerance)?, iterations))
            });
            match landed {
                Ok((end, iterations)) => {
                    self.state.radius = radius;
                    return Ok((end, radius, iterations));
                }
                Err(fault) if system.is_stopped() => return Err(fault),
                Err(fault) => {
                    radius *= AFTER_FAILURE;
                    if radius < LEAST_RADIUS * self.state.first_radius {
                        return Err(fault);
                    }
                    self.state.cut_back += 1;
                }
            }
        }
    }

    /// Corrects the guess `start + load_way by_load` to an equilibrium at the distance `radius`.
    fn correct(
        &mut self,
        system: &mut System,
        start: &PathPoint,
        (by_load, load_way): (&[f64], f64),
        radius: f64,
        tolerance: f64,
    ) -> Result<(PathPoint, u32), StepFault> {
        let mut way: Vec<f64> = by_load.iter().map(|u| load_way * u).collect();
        let mut load_way = load_way;
        let mut last = f64::INFINITY;
        for iteration in 1..=MOST {
            // Current iterate.
            let mut here = PathPoint {
                x: start.x.iter().zip(&way).map(|(x, u)| x + u).collect(),
                v: start.v.clone(),
                load: start.load + load_way,
            };
            if system.is_stopped() {
                return Err(failure(system, &here, SolveFailure::Stopped, iteration, last));
            }
            // Solve the tangent systems, and choose the load increment that keeps the distance.
            let Some(Solutions { correction, by_load }) = self.solutions_at(system, &mut here) else {
                return Err(failure(system, &here, SolveFailure::Infeasible, iteration, last));
            };
            self.work.newton_iterations += 1;
            let Some(more) = increment(system, &way, (&correction, &by_load), radius) else {
                return Err(failure(system, &here, SolveFailure::Diverged, iteration, last));
            };
            // Apply the correction.
            last = 0.0;
            for i in 0..way.len() {
                let change = correction[i] + more * by_load[i];
                last = change.abs().max(last);
                way[i] += change;
            }
            load_way += more;
            let reach = here.x.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            // Converged: the end must be feasible, too.
            if last <= tolerance.max(ULPS * f64::EPSILON * reach) {
                let mut end = PathPoint {
                    x: start.x.iter().zip(&way).map(|(x, u)| x + u).collect(),
                    v: here.v,
                    load: start.load + load_way,
                };
                if is_feasible(system, &mut end) {
                    return Ok((end, iteration));
                }
                return Err(failure(system, &end, SolveFailure::Infeasible, iteration, last));
            }
            if !last.is_finite() {
                return Err(failure(system, &here, SolveFailure::Diverged, iteration, last));
            }
        }
        Err(failure(system, start, SolveFailure::IterationCap, MOST, last))
    }

    /// Moves the end of a step back to a load factor that ends the path, if the step passed one.
    fn land_on_bound(
        &mut self,
        system: &mut System,
        start: &PathPoint,
        end: PathPoint,
        tolerance: f64,
    ) -> Result<PathPoint, StepFault> {
        let bound = self.options.load.and_then(|bounds| crossed(bounds, start.load, end.load));
        self.state.has_ended = bound.is_some();
        let Some(bound) = bound else { return Ok(end) };
        let part = (bound - start.load) / (end.load - start.load);
        let x = start.x.iter().zip(&end.x).map(|(a, b)| a + part * (b - a)).collect();
        let guess = PathPoint { x, v: end.v, load: bound };
        let failed = failure(system, start, SolveFailure::Diverged, MOST, f64::NAN);
        self.equilibrium(system, guess, tolerance).ok_or(failed)
    }

    /// Solves for the equilibrium at the load factor of the guess.
    fn equilibrium(&mut self, system: &mut System, guess: PathPoint, tolerance: f64) -> Option<PathPoint> {
        let mut here = guess;
        for _ in 0..MOST {
            let Solutions { correction, .. } = self.solutions_at(system, &mut here)?;
            self.work.newton_iterations += 1;
            let last = correction.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
            here.x.iter_mut().zip(&correction).for_each(|(x, u)| *x += u);
            let reach = here.x.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            if last <= tolerance.max(ULPS * f64::EPSILON * reach) {
                return is_feasible(system, &mut here).then_some(here);
            }
            if !last.is_finite() {
                return None;
            }
        }
        None
    }

    fn solutions(&mut self, system: &mut System, at: &PathPoint) -> Option<Solutions> {
        let mut here = PathPoint { x: at.x.clone(), v: at.v.clone(), load: at.load };
        self.solutions_at(system, &mut here)
    }

    /// Solves the two tangent systems at a point, after setting prescribed coordinates. `None` if the
    /// force is not finite or the tangent is singular.
    fn solutions_at(&mut self, system: &mut System, here: &mut PathPoint) -> Option<Solutions> {
        if !place(system, here) {
            return None;
        }
        system.evaluate(&here.x)?;
        let mut correction = vec![0.0; here.x.len()];
        system.terms().iter().for_each(|term| term.add_rows(0, &mut correction));
        // Derivative of g by the load factor, including forces of prescribed motion on free coordinates.
        let mut by_load = vec![0.0; here.x.len()];
        let difference = DIFFERENCE * self.options.first.abs();
        system.load_rate(&here.x, here.load, difference, &mut by_load);
        if system.has_prescribed_motion() {
            let moving = moving(system, &here.v);
            let mut follows = vec![0.0; here.x.len()];
            system.hessian_product(&here.x, &moving, &mut follows);
            by_load.iter_mut().zip(&follows).for_each(|(q, f)| *q += f);
        }
        self.work.hessians += 1;
        self.work.factorizations += 1;
        if !self.tangent.factorize(system, &here.x) {
            return None;
        }
        // Solve both systems with one factorisation.
        for right in [&mut correction, &mut by_load] {
            for (r, weight) in right.iter_mut().zip(system.inverse_mass()) {
                *r = if *weight == 0.0 { 0.0 } else { -*r };
            }
            self.tangent.solve(right);
        }
        Some(Solutions { correction, by_load })
    }

    /// Makes the end of a step the state, and updates the path.
    fn accept(
        &mut self,
        system: &mut System,
        state: &mut State,
        start: &PathPoint,
        end: PathPoint,
        (radius, iterations): (f64, u32),
        size: f64,
    ) {
        system.set_load_factor(Some(end.load));
        let way: Vec<f64> = end.x.iter().zip(&start.x).map(|(end, start)| end - start).collect();
        let length = norm(system, &way);
        self.note_limit(state.step + 1, (start.load, end.load), length);
        let path = &mut self.state;
        path.arc_length += length;
        path.radii = if path.radii[0] == 0.0 {
            [length; 2]
        } else {
            [path.radii[0].min(length), path.radii[1].max(length)]
        };
        (path.way, path.load_way, path.load_factor) = (way, end.load - start.load, end.load);
        let factor = (DESIRED / f64::from(iterations)).sqrt().clamp(FACTOR[0], FACTOR[1]);
        path.radius = (factor * radius).min(self.options.largest.unwrap_or(LARGEST_RADIUS * size));
        let (x, v) = state.rows_mut();
        x.copy_from_slice(&end.x);
        // Rates of prescribed motion are with respect to the load factor, and not velocities.
        v.fill(0.0);
    }

    /// Records a limit point if the load factor turned between the last step and this one.
    fn note_limit(&mut self, step: u64, (from, to): (f64, f64), length: f64) {
        let path = &mut self.state;
        let (before, last) = (from - path.load_way, path.length);
        let turned = path.load_way * (to - from) < 0.0;
        if turned && last > 0.0 && length > 0.0 {
            // Parabola through three points over arc length, in Newton's form about the middle one.
            let (rise, fall) = ((from - before) / last, (to - from) / length);
            let curvature = (fall - rise) / (last + length);
            let slope = rise + curvature * last;
            let load_factor = from - slope * slope / (4.0 * curvature);
            path.limit_points.push(LimitPoint { step, load_factor, is_maximum: curvature < 0.0 });
        }
        path.length = length;
    }

    fn largest(&self, size: f64) -> f64 {
        self.options.largest.unwrap_or(LARGEST_RADIUS * size)
    }
}

/// Sets the load factor of a point and its prescribed coordinates; returns whether these are finite.
fn place(system: &mut System, here: &mut PathPoint) -> bool {
    system.set_load_factor(Some(here.load));
    system.set_time(here.load);
    system.prescribe(here.load, &mut here.x, &mut here.v)
}

/// Does the same; returns whether the force is finite, too.
fn is_feasible(system: &mut System, here: &mut PathPoint) -> bool {
    place(system, here) && system.evaluate(&here.x).is_some()
}

/// Rates of prescribed coordinates, zero elsewhere.
fn moving(system: &System, v: &[f64]) -> Vec<f64> {
    let mut moving = vec![0.0; v.len()];
    for hold in system.constraints().iter().filter(|hold| hold.moves()) {
        hold.coordinates(system.dimension()).for_each(|i| moving[i] = v[i]);
    }
    moving
}

fn failure(
    system: &System,
    at: &PathPoint,
    verdict: SolveFailure,
    iterations: u32,
    correction: f64,
) -> StepFault {
    let solve = Some(SolveError { verdict, iterations, correction, left: None });
    StepFault { solve, ..StepFault::at(system, &at.x, &at.v) }
}
