//! A scene whose quantities are computed on other meshes, by other schemes and with other steps, within a
//! budget of time: what studies of total error and searches for an accuracy share.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use pliant::run::Plan;
use pliant_scene::assembly::UnstableStep;
use pliant_scene::{Scene, SceneError, Source};

use crate::quantity::{
    CellMeshes, CellScale, ElementFamily, FRAMES, NoValues, QuantityOfInterest, QuantityRuns, RunKey,
};
use crate::study::{Contender, TimeGrid};

/// Growth of the time of a run with half the cell size, as a power of 2 for each direction, of statics and
/// implicit schemes: between that of a band and that of nested dissection.
const IMPLICIT_GROWTH: f64 = 1.5;
/// Estimate of the time of an explicit step for each coordinate [s], before there is a run.
const SECONDS_PER_COORDINATE: f64 = 3e-8;

/// Reason for which a scene cannot be studied.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudiedSceneError {
    /// The scene cannot be simulated.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The scene names nothing.
    #[error("the scene has no [[probe]]: name one, or a quantity as --of left.force.x")]
    NoQuantity,
    /// A quantity is of no probe and no pin of the scene.
    #[error("the scene has no `{0}`: there is no probe, or not exactly one pin, of this name")]
    Missing(String),
    /// A duration of zero.
    #[error("`duration` is 0: nothing moves")]
    NoDuration,
    /// Other meshes are not the same problem.
    #[error("meshes cannot be refined: {0}")]
    Meshes(String),
}

/// The scene with its runs.
pub(crate) struct StudiedScene<'a> {
    pub(crate) scene: Scene,
    pub(crate) quantities: Vec<QuantityOfInterest>,
    pub(crate) cells: CellMeshes,
    pub(crate) runs: QuantityRuns<'a>,
    pub(crate) grid: TimeGrid,
    /// Step of the scene [s].
    pub(crate) own_step: f64,
    pub(crate) is_static: bool,
    /// Wall time of all runs [s].
    budget: f64,
    started: Instant,
    interrupt: &'a AtomicBool,
}

/// Largest stable step of an explicit scheme on a mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ExplicitLimit {
    /// The step [s].
    pub(crate) step: f64,
    /// Estimate of the time of a step, before there is a run [s].
    pub(crate) seconds: f64,
}

impl<'a> StudiedScene<'a> {
    /// Assembles the scene once. `quantities` are the displacements of all probes at the end if none is
    /// given.
    ///
    /// # Errors
    /// [`StudiedSceneError`].
    pub(crate) fn new(
        source: &Source,
        quantities: &[QuantityOfInterest],
        budget: f64,
        interrupt: &'a AtomicBool,
    ) -> Result<Self, StudiedSceneError> {
        let scene = source.scene()?;
        let assembly = scene.assemble(UnstableStep::Accept).map_err(|problems| source.error(problems))?;
        let quantities = match quantities.is_empty() {
            true => QuantityOfInterest::of_probes(&assembly.probes, scene.dimension),
            false => quantities.to_vec(),
        };
        if quantities.is_empty() {
            return Err(StudiedSceneError::NoQuantity);
        }
        if let Some(missing) = quantities.iter().find(|quantity| !quantity.is_of(&assembly)) {
            return Err(StudiedSceneError::Missing(missing.to_string()));
        }
        let duration = scene.time.duration;
        if duration <= 0.0 {
            return Err(StudiedSceneError::NoDuration);
        }
        let cells = CellMeshes::of(&scene).map_err(StudiedSceneError::Meshes)?;
        let is_static = assembly.simulation.method().is_static();
        let plan = Plan { duration, rate: if is_static { 1.0 } else { FRAMES as f64 } / duration };
        let runs = QuantityRuns::new(&scene, &assembly, &quantities, plan, interrupt).within(budget);
        Ok(StudiedScene {
            quantities,
            cells,
            runs,
            grid: TimeGrid { duration, times: FRAMES as usize },
            own_step: assembly.simulation.step_size(),
            is_static,
            budget,
            started: Instant::now(),
            interrupt,
            scene,
        })
    }

    /// Time since the start [s].
    pub(crate) fn seconds(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    /// Time that is left of the budget [s].
    pub(crate) fn left(&self) -> f64 {
        self.budget - self.seconds()
    }

    /// True if the user has interrupted.
    pub(crate) fn is_interrupted(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed)
    }

    /// The scene on another mesh.
    ///
    /// # Errors
    /// [`NoValues::Refused`] if the mesh has no such elements.
    pub(crate) fn on(&self, family: ElementFamily, scale: CellScale) -> Result<Scene, NoValues> {
        let refused = || NoValues::Refused("the mesh has no such elements".into());
        self.cells.scene(&self.scene, scale, Some(family)).ok_or_else(refused)
    }

    /// Mesh in words.
    pub(crate) fn words(&self, family: ElementFamily, scale: CellScale) -> String {
        format!("{} on {} cells", family.words(self.scene.dimension), self.cells.words(scale))
    }

    /// Keys that make the scene a run on another mesh, of a motion with its scheme and step.
    pub(crate) fn keys(
        &self,
        family: ElementFamily,
        scale: CellScale,
        paced: Option<(Contender, f64)>,
    ) -> Vec<RunKey> {
        let mut keys = self.cells.keys(&self.scene, scale, family);
        if let Some((contender, step)) = paced {
            keys.extend(RunKey::of_pace(&self.scene, contender.name(), step));
        }
        keys
    }

    /// A scene with another scheme and step [s].
    pub(crate) fn paced(&self, mut scene: Scene, contender: Contender, step: f64) -> Scene {
        let time = &mut scene.time;
        (time.integrator, time.step) = (contender.spec, Some(step));
        (time.adaptive, time.arc_length) = (None, None);
        if contender.method.documentation.solves == 0 {
            time.solver = None;
        }
        scene
    }

    /// Limit of an explicit scheme; `None` if it has none.
    ///
    /// # Errors
    /// [`NoValues::Refused`] if the scene cannot be assembled.
    pub(crate) fn explicit_limit(
        &self,
        scene: &Scene,
        contender: Contender,
    ) -> Result<Option<ExplicitLimit>, NoValues> {
        let report = self.runs.report(&self.paced(scene.clone(), contender, self.own_step))?;
        let seconds = report.free_coordinates as f64 * SECONDS_PER_COORDINATE;
        Ok(report.stability.as_ref().map(|stability| ExplicitLimit { step: stability.step, seconds }))
    }

    /// Smallest number of steps between two times of comparison with steps of at most `step` [s].
    pub(crate) fn parts_below(&self, step: f64) -> u64 {
        (self.grid.step(1) / step).ceil().max(1.0) as u64
    }

    /// Growth of the time of a run with half the cell size, as a power of 2.
    pub(crate) fn growth(&self, is_explicit: bool) -> f64 {
        let directions = self.cells.directions() as f64;
        if is_explicit { directions + 1.0 } else { IMPLICIT_GROWTH * directions }
    }
}
