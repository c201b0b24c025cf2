//! Runs that record the state at the times of comparison.

use std::sync::atomic::{AtomicBool, Ordering};

use super::clock::Clock;
use super::plan::{Contender, TimeGrid, TimeStepping};
use crate::quantity::run_until;
use pliant::observer::{Frame, Observer, ObserverError, Quantities};
use pliant::run::{Outcome, Plan, Summary, run};
use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{Adaptive, Problem, Scene};

/// States of a run at the times of comparison, without the start.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StateSamples {
    /// Times [s].
    pub times: Vec<f64>,
    /// Positions at each time, flat `(n, dimension)` [m].
    pub x: Vec<Vec<f64>>,
    /// Velocities at each time, flat `(n, dimension)` [m/s].
    pub v: Vec<Vec<f64>>,
}

/// Energy and momenta at the start and at each time of comparison.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct InvariantSeries {
    /// Times [s].
    pub times: Vec<f64>,
    /// Conserved energy: the total minus the net energy that entered [J].
    pub energy: Vec<f64>,
    /// Momentum `sum m v` [kg m/s].
    pub momentum: Vec<[f64; 3]>,
    /// Angular momentum `sum m x cross v` [kg m^2/s].
    pub angular_momentum: Vec<[f64; 3]>,
}

/// A recorded run.
pub(crate) struct WatchedRun {
    pub(crate) assembly: Assembly,
    pub(crate) summary: Summary,
    pub(crate) trajectory: StateSamples,
    pub(crate) series: InvariantSeries,
    /// True if it ran out of time.
    pub(crate) out_of_time: bool,
    pub(crate) setup: f64,
    pub(crate) stepping: f64,
}

/// Runs scenes on a time grid.
#[derive(Clone, Copy)]
pub(crate) struct Runner<'a> {
    pub(crate) grid: TimeGrid,
    pub(crate) clock: &'a dyn Clock,
    pub(crate) interrupt: &'a AtomicBool,
}

impl Runner<'_> {
    /// Assembles the scene with this integrator and step.
    pub(crate) fn assemble(
        &self,
        scene: &Scene,
        scheme: Contender,
        pace: TimeStepping,
    ) -> Result<Assembly, Vec<Problem>> {
        let scene = self.paced(scene, scheme, pace);
        let mut assembly = scene.assemble(UnstableStep::Accept)?;
        // Tests may use a method that is not in the registry.
        if scheme.method != scheme.spec.method() {
            assembly.simulation.set_method(scheme.method);
        }
        Ok(assembly)
    }

    /// Scene with another integrator and step. Explicit integrators have no solver.
    fn paced(&self, scene: &Scene, scheme: Contender, pace: TimeStepping) -> Scene {
        let mut scene = scene.clone();
        // All integrators share one contact energy: that of the scene's own integrator and step.
        scene.keep_contact(self.grid.step(1));
        scene.time.integrator = scheme.spec;
        scene.time.arc_length = None;
        (scene.time.step, scene.time.adaptive) = match pace {
            TimeStepping::Parts(parts) => (Some(self.grid.step(parts)), None),
            TimeStepping::Tolerance(tolerance) => {
                let given = scene.time.adaptive.take().unwrap_or_default();
                (None, Some(Adaptive { tolerance: Some(tolerance), ..given }))
            }
        };
        // Adaptive steps depend on frames, which are the times of comparison.
        scene.output.rate = self.grid.rate();
        if scheme.method.documentation.solves == 0 {
            scene.time.solver = None;
        }
        // A row has one step size: an unsolved step fails the run, without subdivision.
        if let Some(solver) = &mut scene.time.solver {
            solver.retries = None;
        }
        scene
    }

    /// Runs and records states, until `deadline` at most.
    pub(crate) fn watch(
        &self,
        scene: &Scene,
        scheme: Contender,
        pace: TimeStepping,
        deadline: f64,
    ) -> Result<WatchedRun, Vec<Problem>> {
        let before = self.clock.now();
        let mut assembly = self.assemble(scene, scheme, pace)?;
        let setup = self.clock.now() - before;
        let mut watcher = Watcher {
            clock: self.clock,
            deadline,
            seen: Default::default(),
            trajectory: StateSamples::default(),
            series: InvariantSeries::default(),
            out_of_time: false,
        };
        let before = self.clock.now();
        let plan = Plan { duration: self.grid.duration, rate: self.grid.rate() };
        // The work between two times of comparison may exceed the deadline.
        let over = || self.interrupt.load(Ordering::Relaxed) || self.clock.now() > deadline;
        let summary = run_until(&mut assembly.simulation, &plan, &mut [&mut watcher], over);
        watcher.catch_up(&summary.work);
        let stepping = self.clock.now() - before;
        let Watcher { trajectory, series, out_of_time, .. } = watcher;
        let stopped = matches!(summary.outcome, Outcome::Interrupted);
        let out_of_time = out_of_time || stopped && !self.interrupt.load(Ordering::Relaxed);
        Ok(WatchedRun { assembly, summary, trajectory, series, out_of_time, setup, stepping })
    }

    /// Frame rate of a timed run: the lowest possible, unless step sizes depend on frames.
    fn timed_rate(&self, pace: TimeStepping) -> f64 {
        match pace {
            TimeStepping::Parts(_) => 1.0 / self.grid.duration,
            TimeStepping::Tolerance(_) => self.grid.rate(),
        }
    }

    /// Times a run without recording: seconds of assembly and of stepping.
    pub(crate) fn time(
        &self,
        scene: &Scene,
        scheme: Contender,
        pace: TimeStepping,
    ) -> Result<(f64, f64), Vec<Problem>> {
        let before = self.clock.now();
        let mut assembly = self.assemble(scene, scheme, pace)?;
        let setup = self.clock.now() - before;
        let before = self.clock.now();
        let plan = Plan { duration: self.grid.duration, rate: self.timed_rate(pace) };
        assembly.simulation.count_losses(false);
        let summary = run(&mut assembly.simulation, &plan, &mut [], self.interrupt);
        self.clock.worked(&summary.work);
        Ok((setup, self.clock.now() - before))
    }
}

/// Records states.
struct Watcher<'a> {
    clock: &'a dyn Clock,
    deadline: f64,
    seen: pliant::observer::Work,
    trajectory: StateSamples,
    series: InvariantSeries,
    out_of_time: bool,
}

impl Watcher<'_> {
    /// Reports the work since the last call to the clock.
    fn catch_up(&mut self, work: &pliant::observer::Work) {
        let mut since = *work;
        since.force_evaluations -= self.seen.force_evaluations;
        self.seen = *work;
        self.clock.worked(&since);
    }
}

#[derive(Debug, thiserror::Error)]
#[error("the time for this run is over")]
struct OutOfTime;

impl Observer for Watcher<'_> {
    fn quantities(&self) -> Quantities {
        Quantities::DIAGNOSTICS
    }

    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        self.catch_up(&frame.work);
        if let Some(diagnostics) = frame.diagnostics {
            self.series.times.push(frame.time);
            self.series.energy.push(diagnostics.conserved());
            self.series.momentum.push(diagnostics.linear_momentum);
            self.series.angular_momentum.push(diagnostics.angular_momentum);
        }
        if frame.index > 0 {
            self.trajectory.times.push(frame.time);
            self.trajectory.x.push(frame.x.to_vec());
            self.trajectory.v.push(frame.v.to_vec());
        }
        if self.clock.now() > self.deadline {
            self.out_of_time = true;
            return Err(ObserverError { what: "studying".into(), source: Box::new(OutOfTime) });
        }
        Ok(())
    }
}

impl WatchedRun {
    /// True if the run was completed.
    pub(crate) fn is_done(&self) -> bool {
        matches!(self.summary.outcome, Outcome::Done)
    }
}
