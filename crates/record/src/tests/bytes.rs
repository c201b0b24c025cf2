//! Equal frames give equal bytes.

use std::collections::BTreeMap;
use std::fs;
use std::ops::ControlFlow;
use std::time::Duration;

use mcap::records::Record;

use super::{ALL, Moment, options, record, topology};
use crate::LogLevel;
use crate::McapRecorder;
use crate::Options;
use crate::read::walk;
use pliant::algebra::Mat;
use pliant::diagnostics::{Diagnostics, ElementState, Reaction};
use pliant::observer::{Frame, Work};
use pliant::probe::Probe;
use pliant_scene::Channel;

#[test]
fn the_same_frames_give_the_same_bytes_at_any_speed() {
    let directory = tempfile::tempdir().unwrap();
    let file = |name: &str, pause: u64| {
        let path = directory.path().join(name);
        let mut recorder = record(&path, &ALL, 9, 3);
        std::thread::sleep(Duration::from_millis(pause));
        recorder.log(LogLevel::Warning, "the step is close to the limit", 0.04).unwrap();
        recorder.record(&Moment::new(3, 9).frame()).unwrap();
        recorder.finish().unwrap();
        fs::read(path).unwrap()
    };
    let fast = file("fast.mcap", 0);
    assert!(fast == file("slow.mcap", 1100), "the clock has left a trace");
}

#[test]
fn chunks_end_where_the_frames_say() {
    // 48 kB of state per frame: a chunk of 4 MiB takes 87 of them.
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    record(&path, &ALL, 1000, 200).finish().unwrap();
    let bytes = fs::read(path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert_eq!(summary.chunk_indexes.len(), 3);
    assert!(summary.chunk_indexes.iter().all(|chunk| chunk.compression == "zstd"));
    let sizes: Vec<u64> = summary.chunk_indexes.iter().map(|chunk| chunk.uncompressed_size).collect();
    assert!(sizes[..2].iter().all(|size| (4 << 20..(4 << 20) + 100_000).contains(size)), "{sizes:?}");
}

#[test]
fn a_thread_beside_the_run_leaves_the_same_bytes() {
    let directory = tempfile::tempdir().unwrap();
    let file = |name: &str, max_loss| {
        let path = directory.path().join(name);
        let options = Options { max_loss, ..options(&ALL) };
        let mut recorder = McapRecorder::create(&path, &options, &topology(200)).unwrap();
        // Three chunks; the warning comes while a batch is being filled.
        for index in 0..1000 {
            recorder.record(&Moment::new(index, 200).frame()).unwrap();
            if index == 333 {
                recorder.log(LogLevel::Warning, "the step is close to the limit", 5.5).unwrap();
            }
        }
        recorder.finish().unwrap();
        fs::read(path).unwrap()
    };
    assert!(file("beside.mcap", Duration::from_secs(3600)) == file("here.mcap", Duration::ZERO));
}

/// Frame of numbers that are exact on every machine, with all quantities of two probes, a pin and a
/// tetrahedron.
fn record_moment(recorder: &mut McapRecorder, index: u32) {
    let number = |i: u32| f64::from(i * 7 % 11 + index) / 8.0;
    let x: Vec<f64> = (0..27).map(number).collect();
    let v: Vec<f64> = (0..27).map(|i| number(i + 5)).collect();
    let states: Vec<ElementState> = [1.0, 2.0]
        .map(|scale| ElementState {
            deformation_gradient: Mat([[scale, 0.0, 0.0], [0.25, 1.0, 0.0], [0.0, 0.0, 0.5]]),
            first_piola: Mat([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, number(index)]]),
            energy_density: scale + number(index),
            plane: false,
        })
        .into();
    let diagnostics = Diagnostics { time: number(index), min_j: Some(0.5), ..Diagnostics::default() };
    let about = [number(1), 2.0, 3.0];
    let reaction = Reaction { name: "block/left".into(), force: [1.5, 0.0, -2.0], moment: [0.25; 3], about };
    let frame = Frame {
        index: index.into(),
        step: 10 * u64::from(index),
        time: f64::from(index) / 64.0,
        load_factor: None,
        dimension: 3,
        x: &x,
        v: &v,
        diagnostics: Some(&diagnostics),
        elements: Some(&states[..1]),
        points: Some(&states),
        reactions: Some(&[reaction]),
        contacts: None,
        nodal_stress: None,
        contact_tractions: None,
        stress_error: None,
        work: Work::default(),
    };
    recorder.record(&frame).unwrap();
}

/// Updates an FNV-1a hash.
fn hash_of(bytes: impl AsRef<[u8]>, hash: &mut u64) {
    for byte in bytes.as_ref() {
        *hash = (*hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    }
}

#[test]
fn channels_and_messages_have_the_bytes_of_earlier_versions() {
    let probe = |name: &str, point| Probe {
        name: name.into(),
        body: "block".into(),
        vertices: vec![0, 3],
        weights: vec![0.25, 0.75],
        rest: [0.5; 3],
        point,
        reads_nodal_stress: false,
    };
    let elements =
        [Channel::VonMises, Channel::DeformationGradient, Channel::Jacobian, Channel::EnergyDensity];
    let options = Options {
        channels: [Channel::Reactions].into_iter().chain(elements).chain(ALL).collect(),
        // Strains of a state result from iterations, which another machine may round differently.
        probes: vec![probe("free", None), probe("other", None)],
        reactions: vec!["block/left".into(), "wall0".into()],
        ..options(&[])
    };
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let mut recorder = McapRecorder::create(&path, &options, &topology(9)).unwrap();
    for index in 0..6 {
        record_moment(&mut recorder, index);
    }
    recorder.log(LogLevel::Warning, "the step is close to the limit", 0.04).unwrap();
    recorder.finish().unwrap();
    let (mut hash, mut counts, mut topics) = (0xcbf2_9ce4_8422_2325, BTreeMap::new(), BTreeMap::new());
    walk(&path, &mut |_, record| {
        match record {
            Record::Schema { header, data } => {
                hash_of(format!("{header:?}"), &mut hash);
                hash_of(data, &mut hash);
            }
            Record::Channel(channel) => {
                hash_of(format!("{channel:?}"), &mut hash);
                topics.insert(channel.id, channel.topic);
            }
            Record::Message { header, data } => {
                *counts.entry(topics[&header.channel_id].clone()).or_insert(0) += 1;
                hash_of(format!("{header:?}"), &mut hash);
                hash_of(data, &mut hash);
            }
            _ => {}
        }
        Ok(ControlFlow::Continue(()))
    })
    .unwrap();
    let found: Vec<(&str, i32)> = counts.iter().map(|(topic, count)| (topic.as_str(), *count)).collect();
    let elements = ["deformation-gradient", "energy-density", "jacobian", "von-mises"];
    let elements = elements.map(|measure| format!("/elements/{measure}"));
    let mut expected: Vec<(&str, i32)> = elements.iter().map(|topic| (topic.as_str(), 6)).collect();
    expected.extend([("/energy", 6), ("/log", 1), ("/mesh", 3), ("/probe/free", 6), ("/probe/other", 6)]);
    expected.extend([("/reactions", 6), ("/state", 6), ("/tf", 1)]);
    assert_eq!(found, expected);
    assert_eq!(hash, 0x9f95_951e_ea34_9adb, "{hash:#x}: channels or messages have changed");
}
