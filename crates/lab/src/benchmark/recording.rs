//! Cost of recording during a run.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use super::stepping::{SavedState, assemble};
use super::{BenchmarkCase, BenchmarkError, BenchmarkPart, BenchmarkRow, Metric, Workload, goal};
use pliant::observer::Observer;
use pliant::run::{self, Outcome, Plan};
use pliant_record::{MAX_LOSS, McapRecorder, Options};
use pliant_scene::Scene;
use pliant_scene::assembly::Assembly;

pub(super) const ROW: BenchmarkRow = BenchmarkRow {
    name: "recording",
    summary: "share of a run that goes into recording 60 frames per simulated second",
    cases,
};

/// Timed part of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Scope {
    /// Nothing is recorded or measured.
    Nothing,
    /// Frames: measuring energies, encoding, compressing, writing.
    Frames,
    /// Frames, opening the file, and waiting for the disk at the end.
    File,
}

/// Scenes of the lecture, with the simulated time [s]; that of the galaxy, by far the slowest, is
/// shortened.
const SCENES: [(&str, &str, f64); 3] = [
    ("the cantilever of triangles", super::tri_corotated::CANTILEVER, 2.0),
    ("the cantilever of springs", include_str!("../../scenes/cantilever_springs_2d.toml"), 2.0),
    ("the galaxy", include_str!("../../scenes/galaxy.toml"), 0.5),
];

struct RecordedRun {
    assembly: Assembly,
    start: SavedState,
    plan: Plan,
    options: Options,
    scope: Scope,
    directory: Directory,
}

impl RecordedRun {
    fn new(text: &str, duration: f64, scope: Scope) -> Result<RecordedRun, BenchmarkError> {
        let scene = Scene::from_toml(text)?;
        let assembly = assemble(&scene)?;
        let options = Options {
            channels: scene.output.channels.clone(),
            scene_text: text.into(),
            max_loss: MAX_LOSS,
            ..Options::default()
        };
        Ok(RecordedRun {
            start: SavedState::of(&assembly.simulation),
            assembly,
            plan: Plan { duration, rate: 60.0 },
            options,
            scope,
            directory: Directory::new().map_err(|error| BenchmarkError::Run(error.to_string()))?,
        })
    }

    fn once(&mut self) -> Result<Duration, BenchmarkError> {
        self.start.restore(&mut self.assembly.simulation);
        let path = self.directory.0.join("run.mcap");
        let opening = Instant::now();
        let mut recorder = match self.scope {
            Scope::Nothing => None,
            _ => Some(McapRecorder::create(&path, &self.options, &self.assembly.topology)?),
        };
        let opening = opening.elapsed();
        let running = Instant::now();
        {
            let mut observers: Vec<&mut dyn Observer> = vec![];
            observers.extend(recorder.as_mut().map(|recorder| recorder as &mut dyn Observer));
            let simulation = &mut self.assembly.simulation;
            run::count_losses_for(simulation, &observers);
            let summary = run::run(simulation, &self.plan, &mut observers, &AtomicBool::new(false));
            if !matches!(summary.outcome, Outcome::Done) {
                return Err(BenchmarkError::Run(format!("{:?}", summary.outcome)));
            }
        }
        let running = running.elapsed();
        let closing = Instant::now();
        if let Some(recorder) = recorder {
            recorder.finish()?;
        }
        let closing = closing.elapsed();
        remove(&path);
        Ok(if self.scope == Scope::File { opening + running + closing } else { running })
    }
}

impl Workload for RecordedRun {
    fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError> {
        (0..repetitions).try_fold(Duration::ZERO, |sum, _| Ok(sum + self.once()?))
    }
}

/// A temporary directory that is removed at the end.
struct Directory(PathBuf);

impl Directory {
    fn new() -> std::io::Result<Directory> {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("pliant-bench-{}-{count}", std::process::id()));
        std::fs::create_dir_all(&path)?;
        Ok(Directory(path))
    }
}

impl Drop for Directory {
    fn drop(&mut self) {
        // Files that cannot be removed from a temporary directory may remain.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn remove(path: &Path) {
    // The next recording would refuse to overwrite the file, with an error.
    let _ = std::fs::remove_file(path);
}

fn cases(threads: Option<usize>) -> Vec<BenchmarkCase> {
    let mut cases = vec![];
    for (name, text, duration) in SCENES {
        for (scope, what) in
            [(Scope::Frames, "frames"), (Scope::File, "frames, opening and closing the file")]
        {
            let part = |name, scope| {
                BenchmarkPart::new(name, threads.unwrap_or(1), move || {
                    RecordedRun::new(text, duration, scope)
                })
            };
            cases.push(BenchmarkCase {
                size: (60.0 * duration) as u64 + 1,
                items: "frames",
                case: format!("{name}: {what}"),
                figure: Metric::Share,
                parts: vec![part("recorded", scope), part("not recorded", Scope::Nothing)],
                reference: goal(5.0),
            });
        }
    }
    cases
}
