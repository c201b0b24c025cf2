//! Steps of adaptive size.

use super::{Simulation, StepError};
use crate::control::{Controller, StepControl};
use crate::integrator::equations::acceleration_at;
use crate::integrator::estimate::{ErrorNorm, Judgement};
use crate::solver::StepFault;
use crate::solver::scene_size;
use crate::system::{ForceId, System};

/// Times closer than this many units in the last place are equal.
const SAME_TIME_ULPS: f64 = 8.0;
/// First step without motion and forces, as a fraction of the largest step.
const FIRST_AT_REST: f64 = 1e-3;

impl Simulation {
    /// Returns the length scale of position and energy errors [m]: the diagonal of the bounding box of
    /// all vertices. If all vertices coincide, it is their largest coordinate, or 1 at the origin.
    pub fn length_scale(&self) -> f64 {
        scene_size(self.state.x(), self.system.dimension())
    }

    /// Returns the speed scale of velocity errors [m/s], `sqrt(2 E / m)`: the speed of all masses
    /// together with the current energy, kinetic and stored, plus what gravity can release over the scene
    /// size.
    pub fn speed_scale(&mut self) -> f64 {
        let energy = self.system.kinetic(self.state.v()) + self.potential_scale();
        (2.0 * energy / self.system.mass().iter().sum::<f64>()).sqrt()
    }

    /// Enables adaptive step sizes, starting with the first step that `control` gives or two force
    /// evaluations estimate. Implicit steps are solved to a [fraction](crate::solver::PART_OF_STEP_ERROR)
    /// of the error tolerance, unless the solver options set a tolerance.
    ///
    /// # Panics
    /// If the integrator has neither an error estimate nor a criterion of its own, see
    /// [`Method::is_adaptive`](crate::integrator::Method::is_adaptive).
    pub fn set_step_control(&mut self, control: StepControl) {
        let first = control.first.unwrap_or_else(|| self.first_step(&control));
        let controller = Controller::new(control, &self.method, first);
        self.step_size = controller.next();
        self.controller = Some(Box::new(controller));
        self.set_solver(self.solver);
    }

    /// Returns the step size control; `None` with fixed steps.
    pub fn step_control(&self) -> Option<&StepControl> {
        self.controller.as_ref().map(|controller| &controller.control)
    }

    /// Takes one step that goes at most to the time `target` [s], and ends exactly there if it gets that
    /// far. Without [step control](Self::set_step_control) takes a step of fixed size.
    ///
    /// Pins are released exactly at their end, and steps end at kinks of keyframed motion.
    ///
    /// # Errors
    /// [`StepError`]; the state is then unchanged.
    pub fn step_towards(&mut self, target: f64) -> Result<(), StepError> {
        self.forget_in_time();
        let Some(mut controller) = self.controller.take() else { return self.step() };
        let end = self.controlled_step(&mut controller, target);
        self.step_size = controller.next();
        self.controller = Some(controller);
        end
    }

    /// Returns the size of the step that led to the current state [s]; zero before the first.
    pub fn last_step_size(&self) -> f64 {
        self.last_step_size
    }

    /// Takes one step of `h` [s] to the time `end` [s], whatever its error: repeats a step
    /// [chosen](Self::step_towards) in a run, or one of its [substeps](Self::last_parts), from the same
    /// state. Step size control continues unaffected.
    ///
    /// ```
    /// use pliant::integrator::IntegratorSpec;
    /// use pliant::{simulation::Simulation, state::State, system::System};
    ///
    /// let thrown = State::new(vec![0.0; 3], vec![1.0, 2.0, 3.0]);
    /// let mut simulation =
    ///     Simulation::new(System::new(3, vec![1.0]), thrown, IntegratorSpec::Rk4.method(), 0.5);
    /// simulation.repeat_step(0.25, 0.25)?;
    /// assert_eq!((simulation.state().time, simulation.last_step_size()), (0.25, 0.25));
    /// assert!((simulation.positions()[2] - 0.75).abs() < 1e-15);
    /// # Ok::<(), pliant::simulation::StepError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`step`](Self::step); the state is then unchanged.
    pub fn repeat_step(&mut self, h: f64, end: f64) -> Result<(), StepError> {
        let time = self.state.time;
        // Adaptive steps end at the times at which pins end; substeps of fixed steps release what the
        // whole step did.
        let until = match self.controller {
            Some(_) => time + SAME_TIME_ULPS * f64::EPSILON * time.abs().max(h),
            None => self.released_until(time).unwrap_or(time + 0.5 * self.step_size),
        };
        let released = self.system.change_pins(|pins| pins.release(until));
        self.ensure_force(time)?;
        self.open_ledger(released);
        self.single_step(h, end).map_err(|fault| self.not_finite(fault, None))?;
        self.state.step += 1;
        self.last_step_size = h;
        Ok(())
    }

    /// Returns the error norm that the integrator estimates for a step of `h` [s] from here, relative to
    /// the tolerances; does not take the step. `None` without an estimate, or if the step fails.
    pub fn estimate_of_a_step(&mut self, h: f64) -> Option<f64> {
        let controller = self.controller.take()?;
        let stepped = self.attempt(h).is_ok();
        let judgement = stepped.then(|| self.judge(&controller, h)).flatten();
        if stepped {
            self.integrator.undo(&mut self.state);
        }
        self.controller = Some(controller);
        match judgement {
            Some(Judgement::Error(error)) => Some(error),
            _ => None,
        }
    }

    fn controlled_step(&mut self, controller: &mut Controller, target: f64) -> Result<(), StepError> {
        let time = self.state.time;
        let same = SAME_TIME_ULPS * f64::EPSILON * time.abs().max(controller.next());
        // Release pins and open the ledger as at the start of any step.
        let released = self.system.change_pins(|pins| pins.release(time + same));
        self.ensure_force(time)?;
        self.open_ledger(released);
        // The step must not pass a kink or the target.
        let next_break = self.system.next_break(time + same).filter(|at| *at < target - same);
        let goal = next_break.unwrap_or(target);
        let mut last = (controller.next(), None, None);
        loop {
            if self.system.is_stopped() {
                return Err(self.not_finite(StepFault::stopped(), None));
            }
            let h = controller.plan(goal - time);
            let smallest = controller.floor(time);
            // NaN counts as too small.
            let is_large_enough = h >= smallest || h >= goal - time;
            if !is_large_enough {
                return Err(self.too_small(smallest, last));
            }
            let end = if h == goal - time { goal } else { time + h };
            // Attempt the step; accept it, or reject and retry.
            let (judgement, fault) = match self.attempt(h) {
                Err(fault) => (None, Some(fault)),
                Ok(()) => {
                    let judged = self.judge(controller, h);
                    match judged {
                        Some(judgement) if !controller.admits(h, judgement) => {
                            self.integrator.undo(&mut self.state);
                            (Some(judgement), None)
                        }
                        judged if self.state.ensure_force(&mut self.system, end) => {
                            self.state.step += 1;
                            self.state.time = end;
                            self.last_step_size = h;
                            controller.accept(h, judged.unwrap_or(Judgement::Step(h)));
                            self.note_step(time, h);
                            return Ok(());
                        }
                        _ => {
                            let fault = StepFault::at(&self.system, self.state.x(), self.state.v());
                            self.integrator.undo(&mut self.state);
                            (None, Some(fault))
                        }
                    }
                }
            };
            controller.reject(h, judgement);
            last = (h, judgement, fault);
            // Implicit integrators start with the acceleration at the start of the step.
            self.ensure_force(time)?;
        }
    }

    fn judge(&mut self, controller: &Controller, h: f64) -> Option<Judgement> {
        let tolerances = &controller.control.tolerances;
        self.integrator.judge(&mut self.system, &self.state, h, tolerances)
    }

    fn too_small(
        &self,
        smallest: f64,
        (step_size, judgement, fault): (f64, Option<Judgement>, Option<StepFault>),
    ) -> StepError {
        StepError::StepTooSmall {
            step: self.state.step + 1,
            time: self.state.time,
            step_size,
            smallest,
            error: match judgement {
                Some(Judgement::Error(error)) => Some(error),
                _ => None,
            },
            cause: fault.map(|fault| Box::new(self.located(fault))),
            is_static: self.method.is_static(),
        }
    }

    /// Estimates the first step: algorithm of Hairer, Norsett, Wanner 1993, *Solving Ordinary
    /// Differential Equations I*, section II.4, with the scene size for the norm of the positions, which
    /// have no natural zero, and the time scale `tau = d_0 / d_1` for its time unit:
    ///
    /// ```text
    /// d_0 = |(size, v)|   d_1 = |(v, a)|   tau = d_0 / d_1   h_0 = tau / 100
    /// d_2 = |(v, a)(x + h_0 v, v + h_0 a) - (v, a)| / h_0
    /// h = min(100 h_0, tau (0.01 / max(d_0, tau^2 d_2))^(1/k))
    /// ```
    fn first_step(&mut self, control: &StepControl) -> f64 {
        let at_rest = FIRST_AT_REST * control.largest;
        let (size, time) = (self.length_scale(), self.state.time);
        let (x, v) = (self.state.x().to_vec(), self.state.v().to_vec());
        let Some(a) = acceleration(&mut self.system, &x, &v, time) else { return at_rest };
        let mut norm = ErrorNorm::new(x.len());
        let mut length =
            |system: &System, in_x: &(dyn Fn(usize) -> f64 + Sync), in_v: &(dyn Fn(usize) -> f64 + Sync)| {
                norm.of(system, &control.tolerances, &v, &v, |range, x, v| {
                    for (k, i) in range.enumerate() {
                        (x[k], v[k]) = (in_x(i), in_v(i));
                    }
                })
            };
        // Time scale and trial step.
        let per_axis = size / (self.system.dimension() as f64).sqrt();
        let d0 = length(&self.system, &|_| per_axis, &|i| v[i]);
        let d1 = length(&self.system, &|i| v[i], &|i| a[i]);
        if !(d0 > 0.0 && d1 > 0.0 && (d0 / d1).is_finite()) {
            return at_rest;
        }
        let tau = d0 / d1;
        let h0 = (0.01 * tau).min(control.largest);
        // Second derivative along the trial step.
        let x1: Vec<f64> = x.iter().zip(&v).map(|(x, v)| x + h0 * v).collect();
        let v1: Vec<f64> = v.iter().zip(&a).map(|(v, a)| v + h0 * a).collect();
        let Some(a1) = acceleration(&mut self.system, &x1, &v1, time + h0) else { return h0 };
        let d2 = length(&self.system, &|i| (v1[i] - v[i]) / h0, &|i| (a1[i] - a[i]) / h0);
        let exponent = self.method.error_exponent().map_or(1.0, f64::from);
        let h1 = tau * (0.01 / d0.max(tau * tau * d2)).powf(1.0 / exponent);
        let first = h1.min(100.0 * h0).min(control.largest);
        if first > 0.0 { first } else { h0 }
    }
}

/// Returns the acceleration [m/s^2] at `(x, v)`, with drag; `None` if it is not finite.
fn acceleration(system: &mut System, x: &[f64], v: &[f64], time: f64) -> Option<Vec<f64>> {
    let (mut x, mut v) = (x.to_vec(), v.to_vec());
    let mut a = vec![0.0; x.len()];
    acceleration_at(system, time, (&mut x, &mut v), ForceId::NONE, &mut a).ok()?;
    Some(a)
}
