//! A scene, its simulation and what was changed since: what is touched while it runs (lecture 21).
//!
//! Between steps an [`Experiment`] takes [commands](ExperimentCommand), and keeps a [log](CommandLog) of
//! them: the steps and commands of the log give the same bits again.

mod command;
mod controls;
mod fault;
mod history;
mod log;
#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use pliant::probe::Probe;
use pliant::run::EnergyWatch;
use pliant::simulation::{Simulation, StepError};
use pliant::topology::{BodyKind, Topology};

use crate::assembly::{Assembly, Report, UnstableStep};
use crate::{Scene, SceneError, Source};

pub use command::{CommandError, ExperimentCommand};
pub use controls::{Control, ControlValue, SliderScale};
pub use fault::StepFailure;
pub use log::{CommandLog, LogError, LoggedCommand};

use history::History;

/// A vertex on its way to a target.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Grabbed {
    /// The vertex, in the order of the scene.
    pub vertex: u32,
    /// Where it is drawn to [m].
    pub target: Vec<f64>,
}

/// A simulation that takes commands between steps.
pub struct Experiment {
    source: Source,
    scene: Scene,
    simulation: Simulation,
    topology: Topology,
    probes: Vec<Probe>,
    report: Report,
    /// Names of all pins of bodies at the start, `body/pin`; not those of obstacles, which nothing else holds.
    pins: Vec<String>,
    /// Names of those that are off.
    released: Vec<String>,
    grabbed: Option<Grabbed>,
    controls: Vec<Control>,
    stop: Option<Arc<AtomicBool>>,
    history: History,
    /// Judges the energy from the first step on.
    watch: Option<EnergyWatch>,
    failure: Option<StepFailure>,
    log: CommandLog,
}

impl Experiment {
    /// The experiment of a scene, at its start.
    ///
    /// # Errors
    /// As for [`Source::scene`] and [`Scene::assemble`].
    pub fn new(source: Source) -> Result<Experiment, SceneError> {
        let scene = source.scene()?;
        let Assembly { simulation, topology, probes, report } = assembled(&source, &scene)?;
        let controls = controls::of(&source, &scene);
        Ok(Experiment {
            log: CommandLog::new(source.text()),
            pins: pins_of_bodies(&simulation, &topology),
            source,
            scene,
            simulation,
            topology,
            probes,
            report,
            released: vec![],
            grabbed: None,
            controls,
            stop: None,
            history: History::default(),
            watch: None,
            failure: None,
        })
    }

    /// Takes one step; where it fails, the state is the last good one, and [`failure`](Self::failure) says
    /// why. Whether it was taken.
    pub fn step(&mut self) -> bool {
        self.history.before_step(&self.simulation);
        self.log.steps += 1;
        match self.judged_step() {
            Ok(()) => self.failure = None,
            // Stopped from elsewhere: a replay does not try it.
            Err(_) if self.simulation.system().is_stopped() => {
                self.log.steps -= 1;
                return false;
            }
            Err(error) => self.failure = Some(StepFailure::new(&error)),
        }
        self.failure.is_none()
    }

    fn judged_step(&mut self) -> Result<(), StepError> {
        let Experiment { simulation, watch, .. } = self;
        let watch = watch.get_or_insert_with(|| EnergyWatch::new(simulation));
        simulation.step()?;
        match History::is_turn(simulation.state().step) {
            true => watch.judge(simulation),
            false => Ok(()),
        }
    }

    /// Ends steps and solves once this flag is set, as [`Simulation::set_stop`] does.
    pub fn set_stop(&mut self, stop: Option<Arc<AtomicBool>>) {
        self.stop.clone_from(&stop);
        self.simulation.set_stop(stop);
    }

    /// The text, with the changes of commands.
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// Its content.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The stepper.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// The stepper, to be measured.
    pub fn simulation_mut(&mut self) -> &mut Simulation {
        &mut self.simulation
    }

    /// Bodies and their cells.
    pub fn topology(&self) -> &Topology {
        &self.topology
    }

    /// Points that the scene follows.
    pub fn probes(&self) -> &[Probe] {
        &self.probes
    }

    /// Counts and sizes at the start, or after the last change of a parameter.
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// The vertex that is grabbed.
    pub fn grabbed(&self) -> Option<&Grabbed> {
        self.grabbed.as_ref()
    }

    /// Why the last step was not taken; `None` where it was.
    pub fn failure(&self) -> Option<&StepFailure> {
        self.failure.as_ref()
    }

    /// True if there is an earlier state to [go back](ExperimentCommand::GoBack) to.
    pub fn can_go_back(&self) -> bool {
        self.history.can_go_back(self.simulation.state().step)
    }

    /// Commands so far, and steps that were tried.
    pub fn log(&self) -> &CommandLog {
        &self.log
    }

    /// Parameters that can be set, with their present values.
    pub fn controls(&self) -> Vec<Control> {
        controls::present(&self.controls, &self.scene, &self.pins, &self.released)
    }

    /// Names of the schemes in time that can be tried, and that of the present one.
    pub fn integrators(&self) -> (Vec<&'static str>, &'static str) {
        controls::integrators(&self.scene)
    }

    /// Repeats the steps and commands of `log` on `source`, the scene that it began with; `each` is called
    /// at the start and after every step that was taken. The end has the bits of the end of the first run.
    ///
    /// # Errors
    /// [`CommandError`]: the scene, or a command, is not that of the log.
    pub fn replay(
        source: Source,
        log: &CommandLog,
        mut each: impl FnMut(&mut Experiment),
    ) -> Result<Experiment, CommandError> {
        let mut experiment = Experiment::new(source)?;
        each(&mut experiment);
        let mut commands = log.commands.iter().peekable();
        loop {
            while let Some(next) = commands.next_if(|next| next.after <= experiment.log.steps) {
                experiment.execute(&next.command)?;
            }
            if experiment.log.steps >= log.steps {
                return Ok(experiment);
            }
            if experiment.step() {
                each(&mut experiment);
            }
        }
    }
}

/// Names of the pins that do not hold an obstacle.
fn pins_of_bodies(simulation: &Simulation, topology: &Topology) -> Vec<String> {
    let bodies = topology.bodies.iter().filter(|body| body.kind == BodyKind::Obstacle);
    let obstacles: Vec<&str> = bodies.map(|body| &body.name[..]).collect();
    let is_of_obstacle = |pin: &str| obstacles.contains(&pin.split('/').next().unwrap_or_default());
    simulation.pin_names().into_iter().filter(|pin| !is_of_obstacle(pin)).collect()
}

/// The simulation of a scene, problems located in its text.
fn assembled(source: &Source, scene: &Scene) -> Result<Assembly, SceneError> {
    scene.assemble(UnstableStep::Refuse).map_err(|problems| source.error(problems))
}
