//! Commands between steps.

use pliant::simulation::{AdoptError, GrabError, Snapshot, SnapshotError};
use pliant::topology::BodyKind;

use super::{Experiment, Grabbed, LoggedCommand, assembled};
use crate::assembly::Assembly;
use crate::{SceneError, Source};

/// A change between two steps.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case")]
pub enum ExperimentCommand {
    /// Sets a parameter of the scene.
    Set {
        /// Path of its key.
        path: String,
        /// Value in SI units.
        value: f64,
    },
    /// Turns a pin on, where its vertices are now, or off.
    Pin {
        /// Name, `body/pin`.
        name: String,
        /// True for on.
        on: bool,
    },
    /// Ties a vertex to a target by a spring and a dashpot.
    Grab {
        /// The vertex, in the order of the scene.
        vertex: u32,
        /// The target [m].
        target: Vec<f64>,
    },
    /// Moves the target of the grabbed vertex.
    Drag {
        /// The target [m].
        target: Vec<f64>,
    },
    /// Lets go of the grabbed vertex.
    Release,
    /// Steps by another scheme.
    Integrator {
        /// Its name.
        name: String,
    },
    /// Goes to the start, with the parameters and pins of now.
    Reset,
    /// Goes to an earlier state, with the parameters and pins of now.
    GoBack,
    /// Goes to a state from elsewhere, with the parameters and pins of now.
    Place {
        /// The state.
        state: Box<Snapshot>,
    },
}

/// A command was refused; nothing has changed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CommandError {
    /// The changed scene cannot be simulated.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The changed scene cannot go on from the present state.
    #[error(transparent)]
    Adopt(#[from] AdoptError),
    /// A vertex cannot be grabbed.
    #[error(transparent)]
    Grab(#[from] GrabError),
    /// A number is not finite.
    #[error("{path} = {value} is not finite")]
    NotFinite {
        /// Path of the key.
        path: String,
        /// Its value.
        value: f64,
    },
    /// There is no such parameter.
    #[error("there is no parameter `{path}` to set; there are {paths:?}")]
    NoControl {
        /// Path that was given.
        path: String,
        /// Paths of the parameters.
        paths: Vec<String>,
    },
    /// There is no such pin.
    #[error("there is no pin `{name}`; there are {pins:?}")]
    NoPin {
        /// Name that was given.
        name: String,
        /// Names of the pins.
        pins: Vec<String>,
    },
    /// There is no such scheme.
    #[error("there is no integrator `{name}`; there are {names:?}")]
    NoIntegrator {
        /// Name that was given.
        name: String,
        /// Names of the schemes.
        names: Vec<&'static str>,
    },
    /// No earlier state was kept.
    #[error("there is no earlier state to go back to; reset goes to the start")]
    NoEarlierState,
    /// An earlier state does not fit.
    #[error(transparent)]
    Snapshot(#[from] SnapshotError),
}

impl Experiment {
    /// Executes a command between two steps.
    ///
    /// # Errors
    /// [`CommandError`]; nothing has changed then.
    pub fn execute(&mut self, command: &ExperimentCommand) -> Result<(), CommandError> {
        let before = self.watch.is_some().then(|| self.simulation.diagnostics());
        match command {
            ExperimentCommand::Set { path, value } => self.set(path, *value),
            ExperimentCommand::Pin { name, on } => self.pin(name, *on),
            ExperimentCommand::Grab { vertex, target } => self.grab(*vertex, target),
            ExperimentCommand::Drag { target } => self.drag(target),
            ExperimentCommand::Release => {
                self.let_go();
                Ok(())
            }
            ExperimentCommand::Integrator { name } => self.swap_integrator(name),
            ExperimentCommand::Reset => self.reset(),
            ExperimentCommand::GoBack => self.go_back(),
            ExperimentCommand::Place { state } => self.place(state),
        }?;
        if let (Some(before), Some(watch)) = (before, &mut self.watch) {
            watch.go_on(&before, &mut self.simulation);
        }
        self.log.commands.push(LoggedCommand { after: self.log.steps, command: command.clone() });
        Ok(())
    }

    fn set(&mut self, path: &str, value: f64) -> Result<(), CommandError> {
        if !value.is_finite() {
            return Err(CommandError::NotFinite { path: path.into(), value });
        }
        if !self.controls.iter().any(|control| control.path == path) {
            let paths = self.controls.iter().map(|control| control.path.clone()).collect();
            return Err(CommandError::NoControl { path: path.into(), paths });
        }
        self.change(path, &format!("{value:?}"))
    }

    fn swap_integrator(&mut self, name: &str) -> Result<(), CommandError> {
        let (names, _) = self.integrators();
        if !names.contains(&name) {
            return Err(CommandError::NoIntegrator { name: name.into(), names });
        }
        self.change("time.integrator", name)
    }

    /// Goes on with a value of the scene changed.
    fn change(&mut self, path: &str, value: &str) -> Result<(), CommandError> {
        let changed = self.source.varied(&[(path.to_owned(), value.to_owned())])?;
        // Notes of all changes before this one would be said of it.
        let source = Source { overrides: vec![], ..changed };
        self.assemble_anew(source, true)
    }

    /// Assembles `source`, and goes on from the present state, or from the start.
    fn assemble_anew(&mut self, source: Source, from_present: bool) -> Result<(), CommandError> {
        let scene = source.scene()?;
        let Assembly { mut simulation, topology, probes, report } = assembled(&source, &scene)?;
        for name in &self.released {
            simulation.release(name);
        }
        simulation.set_stop(self.stop.clone());
        if from_present {
            self.simulation.adopt(simulation)?;
            // Walls have become bodies, or have ceased to be: earlier states have other vertices.
            if topology.vertex_count != self.topology.vertex_count {
                self.history.forget();
            }
        } else {
            self.simulation = simulation;
        }
        (self.source, self.scene, self.topology) = (source, scene, topology);
        (self.probes, self.report, self.failure) = (probes, report, None);
        // With the stiffness that the body has now.
        match self.grabbed.clone() {
            Some(Grabbed { vertex, target }) => self.grab(vertex, &target),
            None => Ok(()),
        }
    }

    fn pin(&mut self, name: &str, on: bool) -> Result<(), CommandError> {
        if !self.pins.iter().any(|pin| pin == name) {
            return Err(CommandError::NoPin { name: name.into(), pins: self.pins.clone() });
        }
        let is_on = !self.released.iter().any(|released| released == name);
        match (is_on, on) {
            (true, false) => {
                self.released.push(name.to_owned());
                self.simulation.release(name);
            }
            (false, true) => {
                let released = self.released.clone();
                self.released.retain(|released| released != name);
                // A vertex that the pin holds can no longer be drawn.
                self.let_go();
                let made = self.assemble_anew(self.source.clone(), true);
                if made.is_err() {
                    self.released = released;
                }
                return made;
            }
            _ => {}
        }
        self.failure = None;
        Ok(())
    }

    fn let_go(&mut self) {
        self.simulation.let_go();
        self.grabbed = None;
    }

    fn grab(&mut self, vertex: u32, target: &[f64]) -> Result<(), CommandError> {
        self.simulation.grab(vertex, target, self.mass_around(vertex))?;
        self.grabbed = Some(Grabbed { vertex, target: target.to_owned() });
        self.failure = None;
        Ok(())
    }

    fn drag(&mut self, target: &[f64]) -> Result<(), CommandError> {
        self.simulation.drag(target)?;
        if let Some(grabbed) = &mut self.grabbed {
            grabbed.target = target.to_owned();
        }
        self.failure = None;
        Ok(())
    }

    /// Mass of the body of a vertex [kg]; of a particle its own.
    fn mass_around(&self, vertex: u32) -> f64 {
        let masses = &self.topology.masses;
        let body = self.topology.bodies.iter().find(|body| body.vertices.contains(&vertex));
        match body.filter(|body| body.kind != BodyKind::Particles) {
            Some(body) => masses[body.vertices.start as usize..body.vertices.end as usize].iter().sum(),
            None => masses.get(vertex as usize).copied().unwrap_or(0.0),
        }
    }

    fn reset(&mut self) -> Result<(), CommandError> {
        self.grabbed = None;
        self.assemble_anew(self.source.clone(), false)?;
        self.watch = None;
        self.history.forget();
        Ok(())
    }

    fn place(&mut self, state: &Snapshot) -> Result<(), CommandError> {
        self.simulation.restore(state)?;
        self.let_go();
        self.watch = None;
        self.history.forget();
        self.failure = None;
        Ok(())
    }

    fn go_back(&mut self) -> Result<(), CommandError> {
        let step = self.simulation.state().step;
        let snapshot = self.history.earlier_than(step).ok_or(CommandError::NoEarlierState)?;
        self.simulation.restore(&snapshot)?;
        self.watch = None;
        self.failure = None;
        Ok(())
    }
}
