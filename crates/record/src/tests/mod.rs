//! Tests of recording, reading and recovering, with shared helpers.

mod bytes;
mod content;
mod continuation;
mod damaged;
mod disk_full;
mod elements;
mod killed;
mod probes;
mod protobuf;
mod reactions;
mod refusal;

use std::fs;
use std::path::{Path, PathBuf};

use super::{McapRecorder, Options};
use pliant::diagnostics::Diagnostics;
use pliant::observer::{Frame, Work};
use pliant::topology::{BodyKind, BodyTopology, Topology};
use pliant_scene::Channel;

const ALL: [Channel; 3] = [Channel::State, Channel::Mesh, Channel::Energy];

/// A tetrahedron, a triangle of springs, and particles up to `vertex_count`.
fn topology(vertex_count: u32) -> Topology {
    let body = |name: &str, kind, vertices| BodyTopology {
        blocks: vec![],
        name: name.to_owned(),
        kind,
        vertices,
        edges: Vec::new(),
        triangles: Vec::new(),
        tetrahedra: Vec::new(),
        triangle_middles: Vec::new(),
        tetrahedron_middles: Vec::new(),
        surface: Vec::new(),
        skin: None,
    };
    let solid = BodyTopology {
        tetrahedra: vec![[0, 1, 2, 3]],
        surface: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..body("block", BodyKind::Solid, 0..4)
    };
    let net = BodyTopology { edges: vec![[4, 5], [5, 6], [6, 4]], ..body("net", BodyKind::Springs, 4..7) };
    Topology {
        dimension: 3,
        vertex_count: vertex_count as usize,
        rest_positions: (0..3 * vertex_count).map(|i| f64::from(i) * 0.1).collect(),
        masses: Vec::new(),
        bodies: vec![solid, net, body("dust", BodyKind::Particles, 7..vertex_count)],
    }
}

/// Frame with numbers that need full double precision.
struct Moment {
    index: u64,
    x: Vec<f64>,
    v: Vec<f64>,
    diagnostics: Diagnostics,
}

impl Moment {
    fn new(index: u64, vertex_count: u32) -> Self {
        let time = index as f64 / 60.0;
        let number = |i: u32| (f64::from(i) * 0.7 + time * 31.0).sin() / 3.0;
        let diagnostics = Diagnostics {
            time,
            kinetic: 0.1 + time,
            total: 1.0 / 3.0,
            linear_momentum: [0.1, -0.2, 0.3],
            min_j: Some(number(7)),
            ..Diagnostics::default()
        };
        let x = (0..3 * vertex_count).map(number).collect();
        let v = (0..3 * vertex_count).map(|i| number(i + 1000)).collect();
        Moment { index, x, v, diagnostics }
    }

    fn frame(&self) -> Frame<'_> {
        Frame {
            load_factor: None,
            index: self.index,
            step: 10 * self.index,
            time: self.diagnostics.time,
            dimension: 3,
            x: &self.x,
            v: &self.v,
            diagnostics: Some(&self.diagnostics),
            elements: None,
            points: None,
            reactions: None,
            contacts: None,
            nodal_stress: None,
            contact_tractions: None,
            stress_error: None,
            work: Work {
                steps: 10 * self.index,
                force_evaluations: 20 * self.index,
                rejected_steps: None,
                increments: None,
                retried: None,
                solver: None,
            },
        }
    }
}

fn options(channels: &[Channel]) -> Options {
    Options {
        channels: channels.to_vec(),
        title: Some("A test".to_owned()),
        scene_text: "title = \"A test\"\n".to_owned(),
        ..Options::default()
    }
}

/// Records frames `0..frames` and leaves the recorder open.
fn record(path: &Path, channels: &[Channel], vertex_count: u32, frames: u64) -> McapRecorder {
    let mut recorder = McapRecorder::create(path, &options(channels), &topology(vertex_count)).unwrap();
    for index in 0..frames {
        recorder.record(&Moment::new(index, vertex_count).frame()).unwrap();
    }
    recorder
}

/// Copies the files that a process killed at this moment leaves behind: the data handed to the operating
/// system. They go to another directory to keep their names.
fn remains(path: &Path, directory: &str) -> PathBuf {
    let directory = path.parent().unwrap().join(directory);
    fs::create_dir_all(&directory).unwrap();
    let name = path.file_name().unwrap().to_str().unwrap();
    for suffix in [".part", ".part.tail"] {
        let file = format!("{name}{suffix}");
        fs::copy(path.with_file_name(&file), directory.join(&file)).unwrap();
    }
    directory.join(format!("{name}.part"))
}
