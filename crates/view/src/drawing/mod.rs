//! Drawing model of a recording: bodies as triangles, lines and points, frames, values for colouring, and
//! the surroundings (walls, pins, loads, probes).

mod body;
mod colouring;
mod elements;
mod loads;
mod surroundings;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use pliant_record::RecordError;
use pliant_record::read::{RecordedBodies, Trajectory, in_space, info};

pub use body::DrawnBody;
pub use colouring::{BodyScalars, Colouring, Scalars};
pub use loads::DrawnLoad;
pub use surroundings::{DrawnProbe, DrawnWall};

use surroundings::Surroundings;

/// Error of drawing a recording.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DrawError {
    /// The recording could not be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The recording has no frames.
    #[error("{} has no frames, so there is nothing to draw", path.display())]
    NoFrames {
        /// The file.
        path: PathBuf,
    },
    /// The recording lacks the values for a colouring.
    #[error("{} cannot be coloured by {colouring}: {reason}", path.display())]
    Colouring {
        /// The file.
        path: PathBuf,
        /// Name of the colouring.
        colouring: String,
        /// Reason.
        reason: String,
    },
}

/// Recording prepared for drawing.
#[derive(Debug)]
pub struct Drawing {
    path: PathBuf,
    trajectory: Trajectory,
    title: String,
    topics: Vec<String>,
    recorded: RecordedBodies,
    bodies: Vec<DrawnBody>,
    masses: Option<Vec<f64>>,
    /// Reference positions, flat `(vertex_count, 3)` [m], followed by those of embedded surfaces.
    rest: Option<Vec<f64>>,
    surroundings: Surroundings,
}

/// Treatment of embedded surfaces.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Skins {
    Drawn,
    LeftOut,
}

/// Frame, padded to three dimensions.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnFrame {
    /// Simulated time [s].
    pub time: f64,
    /// Positions, flat `(vertex_count, 3)` [m], `z = 0` in 2D, followed by those of embedded surfaces.
    pub x: Vec<f64>,
    /// Velocities, flat `(vertex_count, 3)` [m/s], in the same order.
    pub v: Vec<f64>,
}

impl Drawing {
    /// Opens a complete recording.
    ///
    /// Walls, pins and loads are those of the attached scene. There are none if the scene cannot be read
    /// or builds other meshes than those recorded (because of a missing mesh file).
    ///
    /// # Errors
    /// [`DrawError::Record`] with the errors of [`Trajectory::open`], or without the channel `/state`;
    /// [`DrawError::NoFrames`].
    pub fn open(path: &Path) -> Result<Drawing, DrawError> {
        Drawing::open_in(path, path.parent().unwrap_or(Path::new("")))
    }

    /// Opens a complete recording; files that the attached scene names are relative to `directory`.
    ///
    /// # Errors
    /// The errors of [`open`](Self::open).
    pub fn open_in(path: &Path, directory: &Path) -> Result<Drawing, DrawError> {
        Drawing::with(path, directory, Skins::Drawn)
    }

    /// Opens a complete recording without embedded surfaces: bodies are drawn by their own boundary.
    ///
    /// # Errors
    /// The errors of [`open`](Self::open).
    pub fn without_skins(path: &Path, directory: &Path) -> Result<Drawing, DrawError> {
        Drawing::with(path, directory, Skins::LeftOut)
    }

    fn with(path: &Path, directory: &Path, skins: Skins) -> Result<Drawing, DrawError> {
        let mut trajectory = Trajectory::open(path)?;
        let info = info(path)?;
        let topics: Vec<String> = info.topics.iter().map(|topic| topic.topic.clone()).collect();
        if !topics.iter().any(|topic| topic == "/state") {
            let topic = "/state".to_owned();
            return Err(RecordError::NoChannel { path: path.to_owned(), topic }.into());
        }
        if trajectory.times().is_empty() {
            return Err(DrawError::NoFrames { path: path.to_owned() });
        }
        let mut recorded = RecordedBodies::read(&mut trajectory, &info)?;
        if skins == Skins::LeftOut {
            recorded.bodies.iter_mut().for_each(|body| body.skin = None);
        }
        let bodies = recorded.bodies.iter().map(|body| DrawnBody::new(body, trajectory.dimension()));
        let mut bodies: Vec<DrawnBody> = bodies.collect();
        let masses = trajectory.masses()?;
        let dimension = trajectory.dimension();
        let rest =
            trajectory.rest_positions()?.map(|rest| recorded.with_skins::<3>(in_space(&rest, dimension)));
        let surroundings = Surroundings::read(&mut trajectory, directory, &topics)?;
        // The vertex that represents a half-space is not a particle.
        let is_plane = |body: &DrawnBody| surroundings.walls.iter().any(|wall| wall.name == body.name);
        bodies.iter_mut().filter(|body| is_plane(body)).for_each(|body| body.points.clear());
        let stem = || path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let title = info.title.filter(|title| !title.is_empty()).unwrap_or_else(stem);
        let path = path.to_owned();
        Ok(Drawing { path, trajectory, title, topics, recorded, bodies, masses, rest, surroundings })
    }

    /// File path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Dimension, 2 or 3.
    pub fn dimension(&self) -> usize {
        self.trajectory.dimension()
    }

    /// Number of vertices of all bodies.
    pub fn vertex_count(&self) -> usize {
        self.trajectory.vertex_count()
    }

    /// Title of the scene, or the file name if it has none.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Simulated time of each frame [s]; at least one.
    pub fn times(&self) -> &[f64] {
        self.trajectory.times()
    }

    /// Bodies by ascending vertex range.
    pub fn bodies(&self) -> &[DrawnBody] {
        &self.bodies
    }

    /// Masses of the vertices, of shape `(vertex_count,)` [kg]; `None` if not recorded.
    pub fn masses(&self) -> Option<&[f64]> {
        self.masses.as_deref()
    }

    /// Reference positions, flat `(vertex_count, 3)` [m], followed by those of embedded surfaces; `None`
    /// if not recorded.
    pub fn rest(&self) -> Option<&[f64]> {
        self.rest.as_deref()
    }

    /// Walls of the attached scene.
    pub fn walls(&self) -> &[DrawnWall] {
        &self.surroundings.walls
    }

    /// Vertices fixed by pins of the attached scene at the start, ascending.
    pub fn pins(&self) -> &[u32] {
        &self.surroundings.pins
    }

    /// Loads of the attached scene.
    pub fn loads(&self) -> &[DrawnLoad] {
        &self.surroundings.loads
    }

    /// Vertices with pins or loads, ascending.
    pub fn marked(&self) -> Vec<u32> {
        let loaded = self.loads().iter().flat_map(|load| load.on.iter().flatten());
        let mut marked: Vec<u32> = self.pins().iter().chain(loaded).copied().collect();
        marked.sort_unstable();
        marked.dedup();
        marked
    }

    /// Gravity of the attached scene at a time [s], [m/s^2]; zero without gravity.
    pub fn gravity(&self, time: f64) -> [f64; 3] {
        let mut gravity = [0.0; 3];
        let components = gravity.iter_mut().zip(&self.surroundings.gravity);
        components.for_each(|(g, component)| *g = component.value([0.0; 3], time));
        gravity
    }

    /// Recorded probes.
    pub fn probes(&self) -> &[DrawnProbe] {
        &self.surroundings.probes
    }

    /// Topics of the recording's channels, ascending.
    pub fn topics(&self) -> &[String] {
        &self.topics
    }

    /// Reads a frame, counted from 0.
    ///
    /// # Errors
    /// [`RecordError::NoFrame`], [`RecordError::Read`], [`RecordError::Damaged`].
    pub fn frame(&mut self, frame: usize) -> Result<DrawnFrame, DrawError> {
        let dimension = self.dimension();
        let x = self.recorded.with_skins::<3>(in_space(&self.trajectory.positions(frame)?, dimension));
        let v = self.recorded.with_skins::<3>(in_space(&self.trajectory.velocities(frame)?, dimension));
        // A frame that can be read has a time.
        let time = self.times().get(frame).copied().unwrap_or(0.0);
        Ok(DrawnFrame { time, x, v })
    }

    /// Underlying recording, for columns of `/energy`, `/reactions` and `/probe/<name>`.
    pub fn trajectory(&mut self) -> &mut Trajectory {
        &mut self.trajectory
    }
}
