//! The content of a recording is what was recorded.

use std::fs;

use super::protobuf::{all, double, fixed32_list};
use super::{ALL, Moment, options, record, topology};
use crate::LogLevel;
use crate::McapRecorder;
use crate::RecordedOutcome;
use crate::RecordedStatus;
use crate::read::{FileState, Trajectory, info};
use pliant::observer::{Frame, Observer, Quantities, Work};
use pliant_scene::Channel;

#[test]
fn every_bit_of_positions_velocities_and_energies_comes_back() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    record(&path, &ALL, 1000, 200).finish().unwrap();
    let mut trajectory = Trajectory::open(&path).unwrap();
    assert_eq!((trajectory.dimension(), trajectory.vertex_count(), trajectory.times().len()), (3, 1000, 200));
    // Backwards, across chunks.
    for index in (0..200).rev().step_by(7) {
        let moment = Moment::new(index, 1000);
        assert_eq!(trajectory.positions(index as usize).unwrap(), moment.x);
        assert_eq!(trajectory.velocities(index as usize).unwrap(), moment.v);
        assert!((trajectory.times()[index as usize] - moment.diagnostics.time).abs() < 0.51e-9);
    }
    let energy = trajectory.energy().unwrap();
    let column = |name: &str| energy.iter().find(|column| column.name == name).unwrap().values.clone();
    let expected = |f: fn(&Moment) -> f64| (0..200).map(|i| f(&Moment::new(i, 1000))).collect::<Vec<_>>();
    assert_eq!(column("time"), expected(|m| m.diagnostics.time));
    assert_eq!(column("kinetic"), expected(|m| m.diagnostics.kinetic));
    assert_eq!(column("min_j"), expected(|m| m.diagnostics.min_j.unwrap()));
    assert_eq!(column("linear_momentum[1]"), vec![-0.2; 200]);
    assert_eq!(column("work.force_evaluations"), expected(|m| 20.0 * m.index as f64));
    assert!(!energy.iter().any(|column| column.name == "inverted"), "no frame has it");
    assert!(trajectory.positions(200).unwrap_err().to_string().contains("has 200 frames"));
}

#[test]
fn only_what_was_asked_for_is_in_the_file() {
    let directory = tempfile::tempdir().unwrap();
    let cases: [(&[Channel], &[&str]); 5] = [
        (&[], &[]),
        (&[Channel::Energy], &["/energy"]),
        (&[Channel::State], &["/state", "/tf"]),
        (&[Channel::Mesh], &["/mesh", "/tf"]),
        (&ALL, &["/energy", "/mesh", "/state", "/tf"]),
    ];
    for (number, (channels, topics)) in cases.into_iter().enumerate() {
        let path = directory.path().join(format!("{number}.mcap"));
        let recorder = record(&path, channels, 9, 2);
        let measures = recorder.quantities().contains(Quantities::DIAGNOSTICS);
        assert_eq!(measures, channels.contains(&Channel::Energy));
        recorder.finish().unwrap();
        let found: Vec<String> = info(&path).unwrap().topics.into_iter().map(|topic| topic.topic).collect();
        assert_eq!(found, topics);
    }
    let path = directory.path().join("particles.mcap");
    let mut particles = topology(9);
    particles.bodies.drain(..2);
    McapRecorder::create(&path, &options(&[Channel::Mesh]), &particles).unwrap().finish().unwrap();
    assert_eq!(info(&path).unwrap().topics, [], "nothing to draw");
}

#[test]
fn info_says_what_is_in_the_file_and_how_the_run_ended() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let mut recorder = record(&path, &ALL, 9, 5);
    recorder.log(LogLevel::Error, "step 50: J = -0.1 in element 0", 0.08).unwrap();
    let message = "step 50: element 0 inverted".to_owned();
    let outcome =
        RecordedOutcome { status: RecordedStatus::Failed, step: Some(49), time: 0.1 + 0.2, message };
    recorder.finish_with(&outcome).unwrap();

    let info = info(&path).unwrap();
    assert_eq!(info.state, FileState::Complete);
    assert_eq!(info.outcome, Some(outcome));
    assert_eq!((info.frames, info.vertices, info.dimension), (5, Some(9), Some(3)));
    assert_eq!((info.start_time, info.end_time), (0.0, 0.08));
    assert_eq!(info.title.as_deref(), Some("A test"));
    assert_eq!(info.metadata["units"], "SI: m, kg, s");
    assert_eq!(info.bodies[1].name, "net");
    assert_eq!((info.bodies[1].first_vertex, info.bodies[1].vertices, info.bodies[1].edges), (4, 3, 3));
    let names: Vec<&str> = info.attachments.iter().map(|attachment| attachment.name.as_str()).collect();
    let expected = ["scene.toml", "rest.f64", "topology/block.tet.u32", "topology/block.surface.u32"];
    assert_eq!(names[..4], expected);
    let mut trajectory = Trajectory::open(&path).unwrap();
    let edges = trajectory.attachment("topology/net.edge.u32").unwrap().unwrap();
    assert_eq!(edges, [4, 5, 5, 6, 6, 4].map(u32::to_le_bytes).concat());
    assert_eq!(trajectory.attachment("scene.toml").unwrap().unwrap(), b"title = \"A test\"\n");
    assert!(serde_json::to_string(&info).unwrap().contains(r#""status":"failed""#));
}

#[test]
fn viewers_get_surfaces_lines_and_a_plane_in_2d() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let mut flat = topology(9);
    flat.dimension = 2;
    flat.rest_positions.truncate(18);
    let mut recorder = McapRecorder::create(&path, &options(&ALL[..2]), &flat).unwrap();
    let x: Vec<f64> = (0..18).map(|i| f64::from(i) / 3.0).collect();
    let frame = Frame {
        load_factor: None,
        index: 0,
        step: 0,
        time: 0.0,
        dimension: 2,
        x: &x,
        v: &x,
        diagnostics: None,
        elements: None,
        points: None,
        reactions: None,
        contacts: None,
        nodal_stress: None,
        contact_tractions: None,
        stress_error: None,
        work: Work::default(),
    };
    recorder.record(&frame).unwrap();
    recorder.finish().unwrap();
    assert_eq!(Trajectory::open(&path).unwrap().velocities(0).unwrap(), x);

    let bytes = fs::read(&path).unwrap();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        match message.channel.topic.as_str() {
            "/state" => {
                let data = &all(&message.data, 6)[0];
                assert!(message.data.ends_with(data), "the data must come last");
                let numbers: Vec<f64> =
                    data.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
                assert_eq!(numbers[6..12], [2.0 / 3.0, 1.0, 0.0, 2.0 / 3.0, 1.0, 0.0]);
            }
            "/mesh" => {
                let entities = all(&message.data, 2);
                let ids: Vec<Vec<u8>> = entities.iter().map(|entity| all(entity, 3).remove(0)).collect();
                assert_eq!(ids, [b"block".to_vec(), b"net".to_vec()], "particles are not drawn here");
                let triangles = &all(&entities[0], 12)[0];
                let indices = fixed32_list(&all(triangles, 5)[0]);
                assert_eq!(indices, [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]);
                assert_eq!(double(&all(triangles, 2)[1], 1), f64::from(2.0_f32 / 3.0));
                let lines = &all(&entities[1], 11)[0];
                let points = all(lines, 5);
                assert_eq!((points.len(), fixed32_list(&all(lines, 8)[0])), (3, vec![0, 1, 1, 2, 2, 0]));
                assert_eq!(double(&points[0], 1), f64::from(8.0_f32 / 3.0));
            }
            other => assert_eq!(other, "/tf"),
        }
    }
}

#[test]
fn the_mesh_is_drawn_thirty_times_a_second_and_less_if_large() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    record(&path, &ALL, 9, 61).finish().unwrap();
    let count = |path: &std::path::Path| {
        info(path).unwrap().topics.iter().find(|t| t.topic == "/mesh").unwrap().messages
    };
    let bytes = fs::read(&path).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let drawn: Vec<u32> = messages.filter(|m| m.channel.topic == "/mesh").map(|m| m.sequence).collect();
    assert_eq!(drawn, (0..=60).step_by(2).collect::<Vec<u32>>(), "of 60 frames per second, every other");

    // 150,000 points at line ends: a third of the rate.
    let path = directory.path().join("large.mcap");
    let mut large = topology(150_000);
    large.bodies[1].edges = (0..75_000).map(|i| [2 * i, 2 * i + 1]).collect();
    large.bodies.remove(0);
    let mut recorder = McapRecorder::create(&path, &options(&[Channel::Mesh]), &large).unwrap();
    for index in 0..13 {
        recorder.record(&Moment::new(index, 150_000).frame()).unwrap();
    }
    recorder.finish().unwrap();
    assert_eq!(count(&path), 3, "at 0, 0.1 and 0.2 s");
}

#[test]
fn a_run_without_frames_is_a_file_too() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let recorded = record(&path, &ALL, 9, 0).finish().unwrap();
    assert_eq!((recorded.frames, recorded.bytes), (0, fs::metadata(&path).unwrap().len()));
    assert_eq!(info(&path).unwrap().frames, 0);
    let mut trajectory = Trajectory::open(&path).unwrap();
    assert!(trajectory.times().is_empty());
    assert_eq!(trajectory.energy().unwrap(), []);

    // A recording without vertices is valid.
    let path = directory.path().join("b.mcap");
    let empty =
        pliant::topology::Topology { vertex_count: 0, bodies: vec![], rest_positions: vec![], ..topology(9) };
    let mut recorder = McapRecorder::create(&path, &options(&[Channel::State]), &empty).unwrap();
    let mut moment = Moment::new(0, 9);
    moment.x.clear();
    moment.v.clear();
    recorder.record(&moment.frame()).unwrap();
    recorder.finish().unwrap();
    assert!(Trajectory::open(&path).unwrap().positions(0).unwrap().is_empty());
}

#[test]
#[ignore = "writes samples for the readers of other projects into the directory PLIANT_SAMPLES"]
fn samples_for_other_readers() {
    let directory = std::path::PathBuf::from(std::env::var("PLIANT_SAMPLES").unwrap());
    let mut recorder = record(&directory.join("all.mcap"), &ALL, 1000, 200);
    recorder.log(LogLevel::Warning, "a warning", 3.0).unwrap();
    recorder.finish().unwrap();
    record(&directory.join("small.mcap"), &ALL, 9, 3).finish().unwrap();
    record(&directory.join("state.mcap"), &ALL[..1], 9, 3).finish().unwrap();
    record(&directory.join("energy.mcap"), &ALL[2..], 9, 3).finish().unwrap();
    record(&directory.join("empty.mcap"), &ALL, 9, 0).finish().unwrap();
    drop(record(&directory.join("killed.mcap"), &ALL, 1000, 100));
    crate::read::recover(&directory.join("killed.mcap.part"), &directory.join("killed.mcap"), false).unwrap();
}
