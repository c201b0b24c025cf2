//! Mode shapes as a recording.

use std::f64::consts::TAU;
use std::path::Path;

use pliant::modes::{Mode, Modes};
use pliant::observer::Frame;
use pliant_record::{LogLevel, MAX_LOSS, McapRecorder, Options, RecordError, Recorded};
use pliant_scene::Channel;
use pliant_scene::assembly::Assembly;
use serde_json::json;

use crate::arguments::ModesArguments;
use crate::failure::Failure;
use crate::input::Input;
use crate::text::{counted, number};

/// How long each mode swings, in the time of the recording [s], once to and fro in each second.
const SECONDS: u64 = 2;
/// Frames a second.
const RATE: u64 = 30;

/// Records `found`, one mode after the other: a log message says which, the metadata `modes` has them all.
pub(super) fn record(
    path: &Path,
    arguments: &ModesArguments,
    input: &Input,
    assembly: &Assembly,
    found: &Modes,
) -> Result<Recorded, Failure> {
    let segments: Vec<_> = found
        .modes
        .iter()
        .enumerate()
        .map(|(i, mode)| {
            let start = SECONDS * i as u64;
            json!({ "mode": i + 1, "frequency": mode.frequency, "start": start, "end": start + SECONDS })
        })
        .collect();
    let title = input.scene.title.as_ref().map_or(String::new(), |title| format!(" of: {title}"));
    let options = Options {
        overwrite: arguments.force,
        channels: vec![Channel::State, Channel::Mesh],
        title: Some(format!("Mode shapes{title}")),
        scene_text: input.source.text().to_owned(),
        metadata: [("modes".to_owned(), json!(segments).to_string())].into(),
        max_loss: MAX_LOSS,
        ..Options::default()
    };
    let recorder = McapRecorder::create(path, &options, &assembly.topology);
    let recorder = recorder.map_err(|error| Failure::recording(&error))?;
    play(recorder, arguments.amplitude, assembly, found).map_err(|error| Failure::recording(&error))
}

fn play(
    mut recorder: McapRecorder,
    share: f64,
    assembly: &Assembly,
    found: &Modes,
) -> Result<Recorded, RecordError> {
    let dimension = assembly.simulation.system().dimension();
    let origin = assembly.simulation.positions();
    let (mut x, mut v) = (origin.to_vec(), vec![0.0; origin.len()]);
    let per_mode = SECONDS * RATE;
    let mut index = 0;
    for (i, mode) in found.modes.iter().enumerate() {
        let scale = share * assembly.simulation.length_scale() / largest(mode, dimension);
        recorder.log(LogLevel::Info, &name(i, mode), index as f64 / RATE as f64)?;
        // Each begins and ends in the middle of its swing; the last frame of all closes the circle.
        let last = u64::from(i + 1 == found.modes.len());
        for frame in 0..per_mode + last {
            let (sin, cos) = (TAU * frame as f64 / RATE as f64).sin_cos();
            for (n, phi) in mode.shape.iter().enumerate() {
                x[n] = origin[n] + scale * sin * phi;
                v[n] = scale * TAU * cos * phi;
            }
            recorder.record(&Frame {
                index,
                step: index,
                time: index as f64 / RATE as f64,
                dimension,
                x: &x,
                v: &v,
                ..Frame::default()
            })?;
            index += 1;
        }
    }
    recorder.finish()
}

/// How far the vertex moves that moves farthest.
fn largest(mode: &Mode, dimension: usize) -> f64 {
    let length = |row: &[f64]| row.iter().map(|c| c * c).sum::<f64>().sqrt();
    mode.shape.chunks_exact(dimension).map(length).fold(f64::MIN_POSITIVE, f64::max)
}

fn name(i: usize, mode: &Mode) -> String {
    if mode.frequency > 0.0 {
        format!("mode {}: {} Hz", i + 1, number(mode.frequency))
    } else {
        format!("mode {}: rigid motion", i + 1)
    }
}

/// Result of writing.
pub(super) fn describe(recorded: &Recorded) -> String {
    format!(
        "recorded {} in {}: each mode for {SECONDS} s, slowed down to one swing a second",
        counted(recorded.frames, "frame", "frames"),
        recorded.path.display()
    )
}
