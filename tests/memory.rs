//! Memory that damaged files make the library ask for.
//!
//! A binary of its own: the allocator counts for all threads, and other tests would allocate beside these.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use peak_alloc::PeakAlloc;
use pliant::observer::Observer;
use pliant::run::{self, Plan};
use pliant_record::read::{Trajectory, info, recover};
use pliant_record::{McapRecorder, Options};
use pliant_scene::assembly::UnstableStep;
use pliant_scene::{Channel, Scene};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// One test at a time.
static ALONE: Mutex<()> = Mutex::new(());

/// Result of `work`, and the most bytes that were allocated in it beyond those that were before.
fn peak<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let before = ALLOCATOR.current_usage();
    ALLOCATOR.reset_peak_usage();
    let result = work();
    (result, ALLOCATOR.peak_usage().saturating_sub(before))
}

/// A recording of some kilobytes.
fn recording(path: &Path) {
    let text = "dimension = 2
        title = 'a spring'
        time = { integrator = 'velocity-verlet', step = 0.002, duration = 0.5 }
        [[body]]
        name = 'pair'
        mesh = { strand = { segments = 1, start = [0.0, 0.0], end = [1.0, 0.0] } }
        springs = { stiffness = 100.0 }
        mass = { per_vertex = 1.0 }";
    let scene = Scene::from_toml(text).unwrap();
    let mut assembly = scene.assemble(UnstableStep::Refuse).unwrap();
    let channels = vec![Channel::State, Channel::Energy];
    let options = Options { channels, scene_text: text.to_owned(), overwrite: true, ..Options::default() };
    let mut recorder = McapRecorder::create(path, &options, &assembly.topology).unwrap();
    let plan = Plan { duration: 0.5, rate: 20.0 };
    let mut observers: Vec<&mut dyn Observer> = vec![&mut recorder];
    run::run(&mut assembly.simulation, &plan, &mut observers, &std::sync::atomic::AtomicBool::new(false));
    recorder.finish().unwrap();
}

/// A chunk may unpack to 2^15 times its length; nothing else asks for more than the file is long.
#[test]
fn a_damaged_recording_asks_for_no_more_memory_than_its_bytes_can_need() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    recording(&path);
    let sound = fs::read(&path).unwrap();
    let allowed = (1 << 15) * sound.len() + (16 << 20);
    for at in 0..sound.len() - 8 {
        for damage in [&[0xFF_u8; 4][..], &[0xFF, 0xFF, 0xFF, 0x7F], &[0xFF; 8]] {
            let mut damaged = sound.clone();
            damaged[at..at + damage.len()].copy_from_slice(damage);
            fs::write(&path, &damaged).unwrap();
            let (_, asked) = peak(|| {
                let _ = info(&path);
                let _ = Trajectory::open(&path).and_then(|mut trajectory| {
                    let _ = trajectory.energy();
                    trajectory.positions(3)
                });
            });
            assert!(asked < allowed, "byte {at}, {damage:?}: {asked} bytes asked for, of {allowed}");
        }
    }
    // What a killed run left is read from its beginning.
    for at in (0..sound.len() - 40).step_by(7) {
        let mut damaged = sound[..sound.len() - 30].to_vec();
        damaged[at..at + 4].fill(0xFF);
        let part = directory.path().join("a.mcap.part");
        fs::write(&part, &damaged).unwrap();
        let (_, asked) = peak(|| {
            let _ = info(&part);
            let _ = recover(&part, &directory.path().join("b.mcap"), true);
        });
        assert!(asked < allowed, "byte {at} of a part: {asked} bytes asked for, of {allowed}");
    }
}

/// A body of this kind in steps of this scheme, by this solver.
fn body_of(kind: &str, cells: &[usize], integrator: &str, solver: Option<&str>) -> Scene {
    let element = kind.ends_with("hexahedra").then_some("hexahedron");
    let mut body = serde_json::json!({
        "name": "body",
        "mesh": { "grid": { "cells": cells, "spacing": 0.01, "element": element } },
        "mass": { "density": 1000.0 },
    });
    match kind {
        "springs" => body["springs"] = serde_json::json!({ "stiffness": 100.0 }),
        _ => body["elastic"] = serde_json::json!({ "stable-neo-hookean": { "young": 1e6, "poisson": 0.4 } }),
    }
    if kind.starts_with("quadratic") {
        body["order"] = 2.into();
    }
    let mut time = serde_json::json!({ "integrator": integrator, "step": 1e-6, "duration": 3e-6 });
    if let Some(solver) = solver {
        time["step"] = 1e-3.into();
        time["duration"] = 3e-3.into();
        time["solver"] = serde_json::json!({ "linear": solver });
    }
    let mut gravity = vec![0.0; cells.len()];
    gravity[cells.len() - 1] = -9.81;
    let steps = if solver.is_some() { 1e3 } else { 1e6 };
    serde_json::from_value(serde_json::json!({
        "dimension": cells.len(),
        "time": time,
        "world": { "gravity": gravity },
        "body": [body],
        "output": { "rate": steps },
    }))
    .unwrap()
}

/// Bytes that do not grow with a scene, or hardly.
const FIXED: f64 = 2e6;

/// The memory that `check` says of a run, without the program itself, is within a factor of 1.5 of the peak of what is
/// allocated.
#[test]
fn a_run_takes_the_memory_that_was_predicted() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let directory = tempfile::tempdir().unwrap();
    let kinds: [(&str, &[usize]); 6] = [
        ("tetrahedra", &[14, 14, 14]),
        ("quadratic tetrahedra", &[6, 6, 6]),
        ("quadratic hexahedra", &[5, 5, 5]),
        ("hexahedra", &[11, 11, 11]),
        ("triangles", &[100, 100]),
        ("springs", &[12, 12, 12]),
    ];
    let solvers = [None, Some("cholesky"), Some("multigrid"), Some("matrix-free")];
    for (kind, cells) in kinds {
        for solver in solvers {
            let integrator = if solver.is_some() { "implicit-euler" } else { "symplectic-euler" };
            let scene = body_of(kind, cells, integrator, solver);
            let path = directory.path().join("a.mcap");
            let (predicted, taken) = peak(|| {
                let mut assembly = scene.assemble(UnstableStep::Refuse).unwrap();
                let options = Options {
                    channels: scene.output.channels.clone(),
                    overwrite: true,
                    max_loss: pliant_record::MAX_LOSS,
                    ..Options::default()
                };
                let frames = assembly.report.frames;
                let recording = pliant_record::predicted_bytes(&options, &assembly.topology, frames);
                let mut recorder = McapRecorder::create(&path, &options, &assembly.topology).unwrap();
                let plan = Plan { duration: scene.time.duration, rate: scene.output.rate };
                let mut observers: Vec<&mut dyn Observer> = vec![&mut recorder];
                let never = std::sync::atomic::AtomicBool::new(false);
                run::run(&mut assembly.simulation, &plan, &mut observers, &never);
                recorder.finish().unwrap();
                assembly.report.bytes + recording
            });
            let (said, most) = (predicted as f64, taken as f64);
            let is_right = most < 1.5 * said + FIXED && said < 1.5 * most + FIXED;
            assert!(is_right, "{kind}, {solver:?}: {taken} bytes taken, {predicted} predicted");
        }
    }
}
