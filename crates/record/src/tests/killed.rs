//! A kill loses no frame whose recording had returned.

use std::fs;
use std::path::Path;
use std::time::Duration;

use super::{ALL, Moment, options, record, remains, topology};
use crate::LogLevel;
use crate::McapRecorder;
use crate::Options;
use crate::RecordError;
use crate::RecordedOutcome;
use crate::RecordedStatus;
use crate::read::{FileState, Trajectory, discard, info, recover};

/// Recovers the remains, and checks that they have the frames `0..frames` and everything around them.
fn check(part: &Path, frames: u64, vertex_count: u32) {
    let out = part.with_extension("");
    let recovered = recover(part, &out, true).unwrap();
    assert_eq!(recovered.frames, frames, "frames of {}", part.display());
    assert_eq!(recovered.bytes, fs::metadata(&out).unwrap().len());
    let found = info(&out).unwrap();
    assert_eq!((found.state, found.frames), (FileState::Complete, frames));
    assert_eq!(found.outcome.unwrap().status, RecordedStatus::Recovered);
    assert_eq!(found.vertices, Some(vertex_count as usize));
    assert_eq!(found.attachments[0].name, "scene.toml");
    let mut trajectory = Trajectory::open(&out).unwrap();
    assert_eq!(trajectory.times().len() as u64, frames);
    if frames > 0 {
        let times = trajectory.energy().unwrap().into_iter().find(|column| column.name == "time").unwrap();
        assert_eq!(times.values.len() as u64, frames, "rows without state");
        assert_eq!(recovered.last_time, trajectory.times()[frames as usize - 1]);
    }
    for index in [0, frames / 2, frames.saturating_sub(1)].into_iter().filter(|index| *index < frames) {
        assert_eq!(trajectory.positions(index as usize).unwrap(), Moment::new(index, vertex_count).x);
    }
}

#[test]
fn no_recorded_frame_is_lost() {
    let directory = tempfile::tempdir().unwrap();
    // In one chunk, at the end of the first (87 frames), and in the third; likewise if each frame is a
    // batch for the thread (14.5 to a chunk), and if each is a chunk.
    let small = [(9, 0), (9, 1), (9, 20), (1000, 86), (1000, 87), (1000, 88), (1000, 200)];
    let large = [(6000, 1), (6000, 14), (6000, 15), (6000, 16), (6000, 40), (100_000, 2)];
    for (vertex_count, frames) in small.into_iter().chain(large) {
        let path = directory.path().join(format!("{vertex_count}-{frames}.mcap"));
        let recorder = record(&path, &ALL, vertex_count, frames);
        let part = remains(&path, "killed");
        let found = info(&part).unwrap();
        assert_eq!((found.state, found.frames, found.outcome), (FileState::Unfinished, frames, None));
        check(&part, frames, vertex_count);
        drop(recorder);
    }
}

#[test]
fn frames_within_the_largest_loss_are_written_together() {
    // Handled by the run's thread, and by the writer thread.
    for vertex_count in [9, 3000] {
        let directory = tempfile::tempdir().unwrap();
        let delayed = |name: &str, max_loss| {
            let path = directory.path().join(name);
            let options = Options { max_loss, ..options(&ALL) };
            let mut recorder = McapRecorder::create(&path, &options, &topology(vertex_count)).unwrap();
            for index in 0..10 {
                recorder.record(&Moment::new(index, vertex_count).frame()).unwrap();
            }
            (path, recorder)
        };
        // An hour: nothing is written meanwhile. A kill would lose the frames, an orderly end does not.
        let (path, recorder) = delayed("dropped.mcap", Duration::from_secs(3600));
        assert_eq!(info(&remains(&path, "killed")).unwrap().frames, 0);
        drop(recorder);
        assert_eq!(info(&remains(&path, "dropped")).unwrap().frames, 10);
        let (finished, recorder) = delayed("finished.mcap", Duration::from_secs(3600));
        recorder.finish().unwrap();
        let (strict, recorder) = delayed("strict.mcap", Duration::ZERO);
        assert_eq!(info(&remains(&strict, "killed")).unwrap().frames, 10);
        recorder.finish().unwrap();
        assert!(fs::read(finished).unwrap() == fs::read(strict).unwrap(), "the same bytes in the end");
        assert!(!directory.path().join("finished.mcap.part.tail").exists());
        // A pause between frames ends the waiting.
        let (path, mut recorder) = delayed("paused.mcap", Duration::from_millis(1));
        std::thread::sleep(Duration::from_millis(2));
        recorder.record(&Moment::new(10, vertex_count).frame()).unwrap();
        assert_eq!(info(&remains(&path, "killed")).unwrap().frames, 11);
    }
}

#[test]
fn a_recovered_file_is_the_file_of_a_run_stopped_there() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let mut recorder = record(&path, &ALL, 1000, 120);
    recorder.log(LogLevel::Warning, "close to the limit", 2.0).unwrap();
    recorder.record(&Moment::new(120, 1000).frame()).unwrap();
    let part = remains(&path, "killed");
    let out = part.with_extension("");
    recover(&part, &out, false).unwrap();
    let outcome = info(&out).unwrap().outcome.unwrap();
    assert_eq!(
        outcome,
        RecordedOutcome { status: RecordedStatus::Recovered, step: Some(1200), time: 2.0, ..outcome.clone() }
    );
    recorder.finish_with(&outcome).unwrap();
    assert!(fs::read(out).unwrap() == fs::read(path).unwrap());
}

#[test]
fn a_file_cut_anywhere_gives_what_is_before_the_cut() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let recorder = record(&path, &ALL, 9, 4);
    let part = remains(&path, "killed");
    let tail = part.with_file_name("a.mcap.part.tail");
    let (part_bytes, tail_bytes) = (fs::read(&part).unwrap(), fs::read(&tail).unwrap());
    drop(recorder);
    let mut last = 0;
    // Every position would take minutes: a recovery waits for the disk.
    for cut in (0..tail_bytes.len()).step_by(31).chain([tail_bytes.len()]) {
        fs::write(&tail, &tail_bytes[..cut]).unwrap();
        let out = part.with_extension("");
        let recovered =
            recover(&part, &out, true).unwrap_or_else(|error| panic!("tail cut at {cut}: {error}"));
        assert!(recovered.frames >= last, "fewer frames from more bytes, at {cut}");
        if recovered.frames > last {
            check(&part, recovered.frames, 9);
        }
        last = recovered.frames;
    }
    assert_eq!(last, 4);
    fs::remove_file(&tail).unwrap();
    for cut in (8..part_bytes.len()).step_by(31) {
        fs::write(&part, &part_bytes[..cut]).unwrap();
        recover(&part, &part.with_extension(""), true)
            .unwrap_or_else(|error| panic!("part cut at {cut}: {error}"));
    }
    fs::write(&part, &part_bytes[..7]).unwrap();
    let error = recover(&part, &part.with_extension(""), true).unwrap_err();
    assert!(error.to_string().contains("a.mcap.part"), "{error}");
}

#[test]
fn a_complete_file_cut_short_gives_its_closed_chunks() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    record(&path, &ALL, 1000, 100).finish().unwrap();
    let bytes = fs::read(&path).unwrap();
    let chunks = mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes;
    let part = directory.path().join("cut.mcap.part");
    let out = part.with_extension("");
    let recover_first = |count: usize| {
        fs::write(&part, &bytes[..count]).unwrap();
        let frames = recover(&part, &out, true).unwrap().frames;
        (frames, info(&out).unwrap().outcome.unwrap().status)
    };
    let end_of_chunk = (chunks[0].chunk_start_offset + chunks[0].chunk_length) as usize;
    assert_eq!(recover_first(end_of_chunk), (87, RecordedStatus::Recovered));
    assert_eq!(recover_first(end_of_chunk - 1), (0, RecordedStatus::Recovered));
    // Only the end is missing: how the run ended is known.
    assert_eq!(recover_first(bytes.len() - 1), (100, RecordedStatus::Completed));
    // At any position: the data decompressed after it may be arbitrary. The index has the other chunk.
    for at in (1_000_000..2_000_000).step_by(71_717) {
        let damaged: Vec<u8> = bytes.iter().enumerate().map(|(i, b)| if i == at { !b } else { *b }).collect();
        for (length, frames) in [(bytes.len(), 13), (bytes.len() - 1, 0)] {
            fs::write(&part, &damaged[..length]).unwrap();
            let recovered = recover(&part, &out, true).unwrap();
            assert_eq!(recovered.frames, frames, "its checksum is wrong");
            assert_eq!(recovered.skipped.len(), 1, "{:?}", recovered.skipped);
        }
    }
}

#[test]
fn what_is_being_written_is_neither_recovered_nor_discarded() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let recorder = record(&path, &ALL, 9, 3);
    let part = directory.path().join("a.mcap.part");
    assert!(matches!(recover(&part, &path, false), Err(RecordError::InUse { .. })));
    assert!(matches!(discard(&part), Err(RecordError::InUse { .. })));
    assert_eq!(info(&part).unwrap().frames, 3, "but one may look");
    drop(recorder);
    assert_eq!(recover(&part, &path, false).unwrap().frames, 3, "dropped without finish");
    discard(&part).unwrap();
    let left: Vec<_> =
        fs::read_dir(directory.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["a.mcap"]);
}
