//! A recording resumed from a checkpoint has the same bytes as one of an uninterrupted run.

use std::fs;
use std::path::Path;

use super::{ALL, Moment, options, record, remains, topology};
use crate::Beginning;
use crate::McapRecorder;
use crate::Options;
use crate::RecordError;
use crate::RecordedOutcome;
use crate::RecordedStatus;
use pliant_scene::Channel;

const TEXT: &str = "title = \"A test\"\n";

fn beginning(path: &Path, frames: u64) -> Beginning<'_> {
    Beginning { path, scene_text: TEXT, frames }
}

/// Resumes after `kept` frames of the recording `from`, up to `frames` in `path`.
fn go_on(from: &Path, path: &Path, channels: &[Channel], vertex_count: u32, kept: u64, frames: u64) {
    let topology = topology(vertex_count);
    let options = options(channels);
    let mut recorder = McapRecorder::resume(path, &options, &topology, beginning(from, kept)).unwrap();
    assert_eq!(recorder.frames(), kept);
    for index in kept..frames {
        recorder.record(&Moment::new(index, vertex_count).frame()).unwrap();
    }
    recorder.finish().unwrap();
}

// With 1000 vertices 87 frames fill a chunk; with 6000, 14.5; with 100,000, one does.
#[test]
fn what_goes_on_after_a_kill_has_the_bytes_of_what_was_not_killed() {
    let cases = [
        (9, 20, 30, &[0, 1, 7, 20][..]),
        (1000, 120, 150, &[20, 86, 87, 88, 120]),
        (6000, 16, 20, &[14, 15]),
        (100_000, 2, 3, &[1]),
    ];
    for (vertex_count, recorded, frames, kept) in cases {
        let directory = tempfile::tempdir().unwrap();
        let expected = directory.path().join("expected.mcap");
        record(&expected, &ALL, vertex_count, frames).finish().unwrap();
        let path = directory.path().join("a.mcap");
        let recorder = record(&path, &ALL, vertex_count, recorded);
        for kept in kept {
            let part = remains(&path, &format!("killed-{kept}"));
            let same = part.with_extension("");
            let other = part.with_file_name("other.mcap");
            go_on(&same, &other, &ALL, vertex_count, *kept, frames);
            assert!(part.exists(), "what is only read stays");
            go_on(&same, &same, &ALL, vertex_count, *kept, frames);
            assert!(!part.exists());
            for file in [other, same] {
                assert!(fs::read(&file).unwrap() == fs::read(&expected).unwrap(), "{vertex_count}, {kept}");
            }
        }
        drop(recorder);
    }
}

/// Resuming drops the warnings and the last frame, which is not a frame of the resumed run.
#[test]
fn a_finished_recording_goes_on() {
    let directory = tempfile::tempdir().unwrap();
    let (path, expected) = (directory.path().join("a.mcap"), directory.path().join("expected.mcap"));
    record(&expected, &ALL, 9, 12).finish().unwrap();
    let mut recorder = record(&path, &ALL, 9, 6);
    recorder.log(crate::LogLevel::Warning, "close to the limit", 0.1).unwrap();
    let outcome = RecordedOutcome {
        status: RecordedStatus::Interrupted,
        step: Some(50),
        time: 0.1,
        message: String::new(),
    };
    recorder.finish_with(&outcome).unwrap();
    go_on(&path, &path, &ALL, 9, 5, 12);
    assert!(fs::read(&path).unwrap() == fs::read(&expected).unwrap());
    // Killed after resuming: both files exist, and the unfinished one lacks frames.
    let recorder = record(&directory.path().join("b.mcap"), &ALL, 9, 3);
    let part = remains(&directory.path().join("b.mcap"), "killed");
    fs::copy(&path, part.with_extension("")).unwrap();
    go_on(&part.with_extension(""), &part.with_extension(""), &ALL, 9, 10, 12);
    assert!(fs::read(part.with_extension("")).unwrap() == fs::read(&expected).unwrap());
    drop(recorder);
}

/// Another name for the same file: its frames are not lost with it.
#[test]
fn a_recording_goes_on_in_itself_by_another_name() {
    let directory = tempfile::tempdir().unwrap();
    let expected = directory.path().join("expected.mcap");
    record(&expected, &ALL, 9, 12).finish().unwrap();
    let recorder = record(&directory.path().join("a.mcap"), &ALL, 9, 8);
    let path = remains(&directory.path().join("a.mcap"), "killed").with_extension("");
    let other = directory.path().join("killed/../killed/a.mcap");
    go_on(&path, &other, &ALL, 9, 7, 12);
    assert!(fs::read(&path).unwrap() == fs::read(&expected).unwrap());
    drop(recorder);
}

/// The surface is not drawn in every frame.
#[test]
fn a_recording_of_the_surface_alone_goes_on() {
    let directory = tempfile::tempdir().unwrap();
    let (path, expected) = (directory.path().join("a.mcap"), directory.path().join("expected.mcap"));
    record(&expected, &[Channel::Mesh], 9, 12).finish().unwrap();
    record(&path, &[Channel::Mesh], 9, 8).finish().unwrap();
    go_on(&path, &path, &[Channel::Mesh], 9, 7, 12);
    assert!(fs::read(&path).unwrap() == fs::read(&expected).unwrap());
}

/// A kill while earlier frames are copied into the unfinished file loses none: they are in the complete
/// one, even if the other lacks a scene.
#[test]
fn a_kill_while_the_frames_before_are_copied_loses_none() {
    for channels in [&ALL[..], &[Channel::Mesh]] {
        let directory = tempfile::tempdir().unwrap();
        let (path, expected) = (directory.path().join("a.mcap"), directory.path().join("expected.mcap"));
        record(&expected, channels, 9, 12).finish().unwrap();
        for copied in [0, 3] {
            record(&path, channels, 9, 8).finish().unwrap();
            let begun = record(&directory.path().join("b.mcap"), channels, 9, copied);
            let part = remains(&directory.path().join("b.mcap"), &format!("killed-{copied}"));
            fs::copy(&path, part.with_extension("")).unwrap();
            go_on(&part.with_extension(""), &part.with_extension(""), channels, 9, 7, 12);
            let file = fs::read(part.with_extension("")).unwrap();
            assert!(file == fs::read(&expected).unwrap(), "{channels:?}, {copied} copied");
            fs::remove_file(&path).unwrap();
            drop(begun);
            fs::remove_dir_all(part.parent().unwrap()).unwrap();
            let _ = fs::remove_file(directory.path().join("b.mcap.part"));
        }
    }
}

#[test]
fn recordings_without_the_frames_before_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let refusal = |options: &Options, frames| {
        let end = McapRecorder::resume(&path, options, &topology(9), beginning(&path, frames));
        end.err().unwrap().to_string()
    };
    assert!(refusal(&options(&ALL), 3).contains("a.mcap is not there: the frames before"));
    record(&path, &ALL, 9, 4).finish().unwrap();
    let whole = fs::read(&path).unwrap();
    assert!(refusal(&options(&ALL), 5).contains("a.mcap ends before the checkpoint"));
    let mut recorder = McapRecorder::create(
        &directory.path().join("b.mcap"),
        &Options { scene_text: "x = 1".into(), ..options(&ALL) },
        &topology(9),
    )
    .unwrap();
    (0..5).for_each(|index| recorder.record(&Moment::new(index, 9).frame()).unwrap());
    let other = recorder.finish().unwrap().path;
    let end = McapRecorder::resume(&path, &options(&ALL), &topology(9), beginning(&other, 3));
    assert!(matches!(end, Err(RecordError::NoBeginning { reason: "was recorded with another scene", .. })));
    assert_eq!(fs::read(&path).unwrap(), whole);
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 2);
}

/// The bytes of the recording do not depend on it; the tail is on the disk.
#[test]
fn a_checkpoint_makes_frames_durable() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let options = Options { max_loss: std::time::Duration::from_secs(3600), ..options(&ALL) };
    let mut recorder = McapRecorder::create(&path, &options, &topology(9)).unwrap();
    for index in 0..10 {
        recorder.record(&Moment::new(index, 9).frame()).unwrap();
        if index == 6 {
            recorder.secure().unwrap();
            let found = crate::read::info(&remains(&path, "killed")).unwrap();
            assert_eq!(found.frames, 7);
        }
    }
    recorder.finish().unwrap();
    let strict = directory.path().join("b.mcap");
    record(&strict, &ALL, 9, 10).finish().unwrap();
    assert!(fs::read(&path).unwrap() == fs::read(&strict).unwrap());
}
