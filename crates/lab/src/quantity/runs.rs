//! Runs of one scene with other meshes, schemes and steps, which give the values of quantities.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use pliant::deadline::until;
use pliant::observer::{Observer, Work};
use pliant::run::{Outcome, Plan, Summary, run};
use pliant::simulation::Simulation;
use pliant_scene::assembly::{Assembly, Report, UnstableStep};
use pliant_scene::{ProbeSpec, Problem, Scene};

use super::{QuantityObserver, QuantityOfInterest, QuantityValue};
use crate::statistics::RunStatistics;

/// Number of times at which quantities are read, if steps allow it.
pub const FRAMES: u64 = 25;

/// Runs of one scene.
pub struct QuantityRuns<'a> {
    quantities: Vec<QuantityOfInterest>,
    plan: Plan,
    interrupt: &'a AtomicBool,
    /// Time at which a run ends unfinished; `None` without one.
    deadline: Option<Instant>,
    /// Probes by their places at rest: vertices have other numbers on other meshes.
    probes: Vec<ProbeSpec>,
}

/// One run that reached its end.
#[derive(Clone, Debug)]
pub struct QuantityRun {
    /// Values of the quantities.
    pub values: Vec<QuantityValue>,
    /// Coordinates that are free to move.
    pub unknowns: usize,
    /// Cost of the run.
    pub statistics: RunStatistics,
}

/// Reason for which a run has no values.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoValues {
    /// The scene cannot be assembled.
    #[error("{0}")]
    Refused(String),
    /// The deadline has passed.
    #[error("it takes longer than the remaining budget")]
    Late,
    /// A step failed.
    #[error("a comparison run fails before its end")]
    Failed,
    /// The user interrupted.
    #[error("interrupted")]
    Interrupted,
}

/// Runs a simulation until `is_over`, which also ends a step in progress.
pub(crate) fn run_until(
    simulation: &mut Simulation,
    plan: &Plan,
    observers: &mut [&mut dyn Observer],
    is_over: impl Fn() -> bool + Sync,
) -> Summary {
    let summary = until(is_over, |stop| {
        simulation.system_mut().set_stop(Some(Arc::clone(stop)));
        run(simulation, plan, observers, stop)
    });
    simulation.system_mut().set_stop(None);
    summary
}

impl<'a> QuantityRuns<'a> {
    /// Runs of `scene`, assembled as `assembly`, over the times of `plan`.
    pub fn new(
        scene: &Scene,
        assembly: &Assembly,
        quantities: &[QuantityOfInterest],
        plan: Plan,
        interrupt: &'a AtomicBool,
    ) -> Self {
        let mut probes: Vec<ProbeSpec> = scene.probe.iter().flat_map(ProbeSpec::each).collect();
        for (spec, probe) in probes.iter_mut().zip(&assembly.probes) {
            if spec.vertex.take().is_some() {
                spec.at = Some(probe.rest[..scene.dimension].to_vec());
                spec.body = Some(probe.body.clone());
            }
            let is_read = |quantity: &QuantityOfInterest| quantity.stressed_probe() == Some(&spec.name);
            spec.nodal_stress |= quantities.iter().any(is_read);
        }
        QuantityRuns { quantities: quantities.to_vec(), plan, interrupt, deadline: None, probes }
    }

    /// Lets runs end unfinished after `seconds` from now.
    #[must_use]
    pub fn within(self, seconds: f64) -> Self {
        let deadline =
            Duration::try_from_secs_f64(seconds).ok().and_then(|time| Instant::now().checked_add(time));
        QuantityRuns { deadline, ..self }
    }

    /// Report on a variant of the scene, without running it.
    ///
    /// # Errors
    /// [`NoValues::Refused`] with the first problem.
    pub fn report(&self, scene: &Scene) -> Result<Report, NoValues> {
        Ok(self.assembled(scene, UnstableStep::Accept)?.report)
    }

    /// A variant of the scene with its probes where they are on the scene's own mesh.
    pub fn with_probes(&self, mut scene: Scene) -> Scene {
        scene.probe.clone_from(&self.probes);
        scene
    }

    fn assembled(&self, scene: &Scene, unstable: UnstableStep) -> Result<Assembly, NoValues> {
        let scene = self.with_probes(scene.clone());
        let refused = |problems: Vec<Problem>| {
            NoValues::Refused(problems.into_iter().next().map_or_else(String::new, |problem| problem.message))
        };
        let problems = scene.validate();
        if !problems.is_empty() {
            return Err(refused(problems));
        }
        scene.assemble(unstable).map_err(refused)
    }

    /// Runs a variant of the scene to its end.
    ///
    /// # Errors
    /// [`NoValues`].
    pub fn run(&self, scene: &Scene) -> Result<QuantityRun, NoValues> {
        let started = Instant::now();
        let mut assembly = self.assembled(scene, UnstableStep::Refuse)?;
        let setup = started.elapsed().as_secs_f64();
        let started = Instant::now();
        let frequencies = self.frequencies(&mut assembly)?;
        let mut stepping = started.elapsed().as_secs_f64();
        let mut observer = QuantityObserver::new(&self.quantities, &assembly.probes);
        let needs_run = self.quantities.iter().any(|quantity| quantity.frequency().is_none());
        let mut work = Work::default();
        if needs_run {
            // A single step may exceed the deadline.
            let is_interrupted = || self.interrupt.load(Ordering::Relaxed);
            let is_over =
                || is_interrupted() || self.deadline.is_some_and(|deadline| Instant::now() > deadline);
            let started = Instant::now();
            let summary = run_until(&mut assembly.simulation, &self.plan, &mut [&mut observer], is_over);
            stepping += started.elapsed().as_secs_f64();
            match summary.outcome {
                Outcome::Done => work = summary.work,
                Outcome::Interrupted if is_interrupted() => return Err(NoValues::Interrupted),
                Outcome::Interrupted => return Err(NoValues::Late),
                _ => return Err(NoValues::Failed),
            }
        }
        let value = |(i, quantity): (usize, &QuantityOfInterest)| match quantity.frequency() {
            Some(number) => QuantityValue::steady(frequencies[number - 1]),
            None => observer.value(i),
        };
        let values: Vec<QuantityValue> = self.quantities.iter().enumerate().map(value).collect();
        let never = |(value, quantity): &(&QuantityValue, &QuantityOfInterest)| {
            quantity.is_arrival() && value.value.is_nan()
        };
        if let Some((_, quantity)) = values.iter().zip(&self.quantities).find(never) {
            return Err(NoValues::Refused(format!("there is no time at which `{quantity}`")));
        }
        Ok(QuantityRun {
            values,
            unknowns: assembly.report.free_coordinates,
            statistics: RunStatistics::new(work, setup, stepping),
        })
    }

    /// Natural frequencies about the start, as many as quantities name [Hz].
    fn frequencies(&self, assembly: &mut Assembly) -> Result<Vec<f64>, NoValues> {
        let Some(count) = self.quantities.iter().filter_map(QuantityOfInterest::frequency).max() else {
            return Ok(vec![]);
        };
        let modes = assembly.simulation.modes(count).map_err(|error| NoValues::Refused(error.to_string()))?;
        Ok(modes.modes.iter().map(|mode| mode.frequency).collect())
    }
}
