//! Whole steps of a scene.

use std::time::{Duration, Instant};

use super::{BenchmarkError, Workload};
use pliant::simulation::Simulation;
use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{KeyPath, PositionSpec, Problem, Scene, SceneError};

/// Workload: steps of a simulation, from the same state for each repetition.
pub(super) struct Stepping {
    simulation: Simulation,
    start: SavedState,
    bytes: usize,
}

/// A state to restore.
pub(super) struct SavedState {
    x: Vec<f64>,
    v: Vec<f64>,
}

impl SavedState {
    pub(super) fn of(simulation: &Simulation) -> SavedState {
        SavedState { x: simulation.state().x().to_vec(), v: simulation.state().v().to_vec() }
    }

    /// Resets `simulation` to the saved state at time zero.
    pub(super) fn restore(&self, simulation: &mut Simulation) {
        let state = simulation.state_mut();
        state.x_mut().copy_from_slice(&self.x);
        state.v_mut().copy_from_slice(&self.v);
        (state.step, state.time) = (0, 0.0);
    }
}

impl Stepping {
    /// Workload of stepping `scene`.
    pub(super) fn new(scene: &Scene) -> Result<Stepping, BenchmarkError> {
        let Assembly { mut simulation, report, .. } = assemble(scene)?;
        simulation.count_losses(false);
        let start = SavedState::of(&simulation);
        Ok(Stepping { simulation, start, bytes: report.bytes })
    }

    #[cfg(test)]
    pub(super) fn simulation(&mut self) -> &mut Simulation {
        &mut self.simulation
    }
}

impl Workload for Stepping {
    fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError> {
        self.start.restore(&mut self.simulation);
        // The first step after a change also computes the initial force.
        self.simulation.step()?;
        let start = Instant::now();
        for _ in 0..repetitions {
            self.simulation.step()?;
        }
        Ok(start.elapsed())
    }

    fn bytes(&self) -> usize {
        self.bytes
    }
}

/// Assembles a scene as for a run, with any step size.
pub(super) fn assemble(scene: &Scene) -> Result<Assembly, BenchmarkError> {
    Ok(scene.assemble(UnstableStep::Accept).map_err(SceneError::new)?)
}

/// Parses a scene with one body, whose initial positions `displace` derives from the points of its mesh.
pub(super) fn displaced(text: &str, mut displace: impl FnMut(&mut [f64])) -> Result<Scene, BenchmarkError> {
    let mut scene = Scene::from_toml(text)?;
    let mesh = mesh_of(&scene)?;
    let rows = mesh.points.chunks_exact(mesh.dimension).map(|point| {
        let mut point = point.to_vec();
        displace(&mut point);
        point
    });
    scene.body[0].position = Some(PositionSpec::PerVertex(rows.collect()));
    Ok(scene)
}

/// Mesh of a scene's first body.
pub(super) fn mesh_of(scene: &Scene) -> Result<pliant_mesh::Mesh, BenchmarkError> {
    pliant_mesh::build(&scene.body[0].mesh, scene.dimension, &scene.directory).map_err(|error| {
        let path = KeyPath::root().key("body").index(0).key("mesh");
        SceneError::new(vec![Problem::semantic(path, error.to_string())]).into()
    })
}
