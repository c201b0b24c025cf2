//! Helpers that record small scenes.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use pliant::observer::Observer;
use pliant::run::run;
use pliant_record::{McapRecorder, Options, RecordedOutcome, RecordedStatus};
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;

/// Runs a scene and records it.
pub(crate) fn recorded(text: &str, path: &Path) {
    recorded_as(text, text, path);
}

/// Runs a scene and records it with another text attached.
pub(crate) fn recorded_as(text: &str, attached: &str, path: &Path) {
    let scene = Scene::from_toml(text).unwrap_or_else(|error| panic!("{error}"));
    let mut assembly = scene.assemble(UnstableStep::Refuse).unwrap_or_else(|p| panic!("{p:?}"));
    let options = Options {
        channels: scene.output.channels.clone(),
        title: scene.title.clone(),
        probes: assembly.probes.clone(),
        scene_text: attached.to_owned(),
        ..Options::default()
    };
    let mut recorder = McapRecorder::create(path, &options, &assembly.topology).unwrap();
    let observers: &mut [&mut dyn Observer] = &mut [&mut recorder];
    run(&mut assembly.simulation, &scene.plan(), observers, &AtomicBool::new(false));
    let status = RecordedStatus::Completed;
    let outcome = RecordedOutcome { status, step: None, time: scene.time.duration, message: String::new() };
    recorder.finish_with(&outcome).unwrap();
}
