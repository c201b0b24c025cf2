//! Files are replaced on request only, and inconsistent recordings are refused.

use std::fs;

use super::{ALL, Moment, options, record, topology};
use crate::McapRecorder;
use crate::Options;
use crate::RecordError;
use crate::read::{Trajectory, info, recover};
use pliant::observer::Frame;
use pliant::probe::Probe;
use pliant_scene::Channel;

#[test]
fn an_existing_output_is_replaced_only_on_demand_and_only_at_the_end() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    fs::write(&path, "precious").unwrap();
    let error = McapRecorder::create(&path, &options(&ALL), &topology(9)).err().unwrap();
    assert!(matches!(error, RecordError::Exists { .. }));
    assert!(error.to_string().contains("--force"), "{error}");
    let overwriting = Options { overwrite: true, ..options(&ALL) };
    let recorder = McapRecorder::create(&path, &overwriting, &topology(9)).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"precious", "until the new one is complete");
    recorder.finish().unwrap();
    assert_eq!(info(&path).unwrap().frames, 0);
    let left: Vec<_> =
        fs::read_dir(directory.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["a.mcap"]);
}

#[test]
fn the_remains_of_a_killed_run_are_replaced_only_on_demand() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    drop(record(&path, &ALL, 9, 3));
    let error = McapRecorder::create(&path, &options(&ALL), &topology(9)).err().unwrap();
    assert!(matches!(error, RecordError::LeftOver { .. }));
    assert!(error.to_string().contains("pliant recover") && error.to_string().contains("--force"), "{error}");
    let overwriting = Options { overwrite: true, ..options(&ALL) };
    McapRecorder::create(&path, &overwriting, &topology(9)).unwrap().finish().unwrap();
    assert_eq!(info(&path).unwrap().frames, 0, "nothing of the old run");
}

#[test]
fn two_runs_cannot_write_one_file() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let first = record(&path, &ALL, 9, 1);
    let overwriting = Options { overwrite: true, ..options(&ALL) };
    let second = McapRecorder::create(&path, &overwriting, &topology(9)).err();
    assert!(matches!(second, Some(RecordError::InUse { .. })), "{second:?}");
    first.finish().unwrap();
    assert_eq!(info(&path).unwrap().frames, 1);
}

#[test]
fn an_output_that_appears_during_the_run_is_not_replaced() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let recorder = record(&path, &ALL, 9, 1);
    fs::write(&path, "precious").unwrap();
    assert!(matches!(recorder.finish(), Err(RecordError::Exists { .. })));
    assert_eq!(fs::read(&path).unwrap(), b"precious");
    let part = directory.path().join("a.mcap.part");
    assert!(matches!(recover(&part, &path, false), Err(RecordError::Exists { .. })));
    assert_eq!(recover(&part, &directory.path().join("b.mcap"), false).unwrap().frames, 1);
}

#[test]
fn frames_and_cells_must_fit_the_topology() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let mut wrong = topology(9);
    wrong.bodies[1].edges.push([0, 9]);
    let error = McapRecorder::create(&path, &options(&ALL), &wrong).err().unwrap();
    assert_eq!(error.to_string(), "body `net` refers to vertex 9, but there are 9");
    assert!(!directory.path().join("a.mcap.part").exists());

    let mut recorder = record(&path, &ALL, 9, 2);
    let error = recorder.record(&Moment::new(2, 8).frame()).unwrap_err();
    assert!(matches!(error, RecordError::FrameShape { frame: 2, expected: 27, found: 24 }));
    let moment = Moment::new(2, 9);
    let error = recorder.record(&Frame { diagnostics: None, ..moment.frame() }).unwrap_err();
    assert_eq!(error.to_string(), "frame 2 has no diagnostics, which the channel /energy records");
    assert!(matches!(error, RecordError::MissingQuantities { frame: 2, .. }));
    recorder.record(&moment.frame()).unwrap();
    assert_eq!(recorder.finish().unwrap().frames, 3);
}

#[test]
fn a_frame_without_what_a_channel_records_is_refused_by_the_name_of_the_channel() {
    let directory = tempfile::tempdir().unwrap();
    let probe = Probe {
        name: "tip".into(),
        body: "block".into(),
        vertices: vec![0],
        weights: vec![1.0],
        rest: [0.0; 3],
        point: Some(0),
        reads_nodal_stress: false,
    };
    let with_probe = Options { probes: vec![probe], ..options(&[]) };
    for (options, says) in [
        (with_probe, "frame 0 has no states of points, which the channel /probe/tip records"),
        (options(&[Channel::Reactions]), "frame 0 has no reactions, which the channel /reactions records"),
    ] {
        let path = directory.path().join("a.mcap");
        let options = Options { overwrite: true, ..options };
        let mut recorder = McapRecorder::create(&path, &options, &topology(9)).unwrap();
        let moment = Moment::new(0, 9);
        assert_eq!(recorder.record(&moment.frame()).unwrap_err().to_string(), says);
        let (points, reactions) = (Some(&[][..]), Some(&[][..]));
        recorder.record(&Frame { points, reactions, ..moment.frame() }).unwrap();
        assert_eq!(recorder.finish().unwrap().frames, 1);
    }
}

#[test]
fn other_files_are_told_apart() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    assert!(matches!(info(&path), Err(RecordError::Read { .. })));
    fs::write(&path, "PK\u{3}\u{4} not this").unwrap();
    assert!(matches!(info(&path), Err(RecordError::NotMcap { .. })));
    assert!(matches!(
        recover(&path, &directory.path().join("b.mcap"), false),
        Err(RecordError::NotMcap { .. })
    ));
    assert!(!directory.path().join("b.mcap").exists());

    let mut other = mcap::Writer::new(fs::File::create(&path).unwrap()).unwrap();
    other.finish().unwrap();
    assert_eq!(info(&path).unwrap().vertices, None);
    assert!(matches!(Trajectory::open(&path), Err(RecordError::Unexpected { .. })));

    let path = directory.path().join("c.mcap");
    let recorder = record(&path, &ALL[..1], 9, 1);
    let part = directory.path().join("c.mcap.part");
    assert!(matches!(Trajectory::open(&part), Err(RecordError::NotFinished { .. })));
    recorder.finish().unwrap();
    assert!(matches!(Trajectory::open(&path).unwrap().energy(), Err(RecordError::NoChannel { .. })));
}
