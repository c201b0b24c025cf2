//! Storage of references next to a report, so that they are computed once.

use std::path::{Path, PathBuf};

use super::super::plan::TimeGrid;
use super::Reference;
use pliant_files::durable_file;
use pliant_files::fnv::fnv1a;
use pliant_scene::{Body, Scene, Time};

/// Key of a problem: its physics and duration, independent of computation and output.
pub fn key(scene: &Scene, grid: &TimeGrid) -> String {
    format!("{:016x}", fnv1a(problem(scene, grid).as_bytes()))
}

/// Problem as a text: the scene without integrator, step, solver, output and study; and the times.
fn problem(scene: &Scene, grid: &TimeGrid) -> String {
    let time = scene.time.clone();
    let plain = Scene {
        title: None,
        study: None,
        accuracy: None,
        output: Default::default(),
        probe: vec![],
        time: Time {
            integrator: pliant::integrator::IntegratorSpec::VelocityVerlet,
            solver: None,
            step: Some(1.0),
            adaptive: None,
            ..scene.time.clone()
        },
        ..scene.clone()
    };
    // The directory identifies files, if the scene has any.
    let reads = |body: &Body| body.mesh.file().is_some();
    let directory = plain.body.iter().any(reads).then_some(&plain.directory);
    let TimeGrid { duration, times } = grid;
    let text = plain.to_toml().unwrap_or_default();
    // The contact energy is that of the scene's own integrator and step.
    let contact = scene.acting_contact().map(|contact| contact.kept(&time, grid.step(1)));
    let contact = contact.map_or(String::new(), |contact| {
        format!("Contact {{ explicit: {:?}, step: {:?} }}\n", contact.explicit_law, contact.designed_step)
    });
    // References are stored under the hash of this text: it belongs to their format.
    format!("{text}\n{contact}Grid {{ duration: {duration:?}, times: {times:?} }}\n{directory:?}")
}

/// Folder of references; without a folder nothing is stored.
#[derive(Clone, Debug, Default)]
pub(crate) struct Store(pub(crate) Option<PathBuf>);

#[derive(serde::Serialize, serde::Deserialize)]
struct StoredReference {
    problem: String,
    reference: Reference,
}

impl Store {
    fn path(folder: &Path, scene: &Scene, grid: &TimeGrid) -> PathBuf {
        folder.join(format!("reference-{}.json", key(scene, grid)))
    }

    /// Stored reference of this problem, if it can be read.
    pub(crate) fn load(&self, scene: &Scene, grid: &TimeGrid) -> Option<Reference> {
        let text = std::fs::read_to_string(Self::path(self.0.as_ref()?, scene, grid)).ok()?;
        let kept: StoredReference = serde_json::from_str(&text).ok()?;
        (kept.problem == problem(scene, grid)).then_some(kept.reference)
    }

    /// Stores a reference.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn save(&self, scene: &Scene, grid: &TimeGrid, reference: &Reference) -> std::io::Result<()> {
        let Some(folder) = &self.0 else { return Ok(()) };
        let kept = StoredReference { problem: problem(scene, grid), reference: reference.clone() };
        durable_file::replace(&Self::path(folder, scene, grid), &serde_json::to_vec(&kept)?)
    }
}
