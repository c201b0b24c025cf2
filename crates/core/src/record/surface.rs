//! `/mesh`: what a viewer draws, as `foxglove.SceneUpdate`: one entity per body, its surface as triangles and its
//! springs as lines. Particles have neither; viewers draw them from `/state`.
//!
//! For looking at only: coordinates are rounded to single precision, which makes the file three times smaller, and
//! frames are left out so that a simulated second has at most 30 of them, fewer for large meshes.

use std::collections::BTreeMap;

use foxglove::messages::{
    Color, LinePrimitive, Point3, SceneEntity, SceneUpdate, TriangleListPrimitive, line_primitive,
};
use mcap::Channel;

use super::channel::{FRAME_ID, MESH, encode, typed};
use super::clock::timestamp;
use super::cloud::identity;
use crate::observer::Frame;
use crate::topology::{BodyTopology, Topology};

/// Most frames per simulated second.
const RATE: u128 = 30;
/// Vertices up to which that rate is kept; beyond, the numbers written per simulated second stay the same.
const FULL_RATE_VERTICES: u128 = 50_000;

/// Blue, orange, green, pink, sky, vermilion: told apart by colour-blind eyes too (Okabe and Ito).
const COLOURS: [[f64; 3]; 6] = [
    [0.0, 0.45, 0.70],
    [0.90, 0.62, 0.0],
    [0.0, 0.62, 0.45],
    [0.80, 0.47, 0.65],
    [0.34, 0.71, 0.91],
    [0.84, 0.37, 0.0],
];

/// What is drawn of all bodies.
#[derive(Debug)]
pub(super) struct Drawing {
    parts: Vec<Part>,
    vertex_count: u128,
    next_slot: u128,
}

/// What is drawn of one body.
#[derive(Debug)]
struct Part {
    name: String,
    colour: Color,
    triangles: Cells,
    lines: Cells,
}

/// Cells over the vertices that they use, numbered from 0.
#[derive(Debug)]
struct Cells {
    vertices: Vec<u32>,
    indices: Vec<u32>,
}

impl Drawing {
    /// `None` if there is nothing to draw: then there is no channel either.
    pub(super) fn new(topology: &Topology) -> Option<Self> {
        let drawn = topology.bodies.iter().filter(|body| !body.surface.is_empty() || !body.edges.is_empty());
        let parts: Vec<Part> =
            drawn.zip(COLOURS.iter().cycle()).map(|(body, c)| Part::new(body, c)).collect();
        let vertex_count =
            parts.iter().map(|p| p.triangles.vertices.len() + p.lines.vertices.len()).sum::<usize>();
        (!parts.is_empty()).then_some(Drawing { parts, vertex_count: vertex_count as u128, next_slot: 0 })
    }

    /// Declares the channel.
    pub(super) fn channel() -> Channel<'static> {
        typed::<SceneUpdate>(MESH, BTreeMap::new())
    }

    /// Whether a frame at this time is drawn: the first of each slot of 1/30 s (longer for large meshes) is.
    pub(super) fn is_due(&mut self, log_time: u64) -> bool {
        // Times are rounded to nanoseconds; a microsecond keeps 1/30 s from falling just short of its slot.
        let time = u128::from(log_time) + 1_000;
        let slot =
            time * RATE * FULL_RATE_VERTICES / (1_000_000_000 * self.vertex_count.max(FULL_RATE_VERTICES));
        let due = slot >= self.next_slot;
        if due {
            self.next_slot = slot + 1;
        }
        due
    }

    /// Encodes a frame, replacing what is in the buffer.
    pub(super) fn encode_frame(&self, frame: &Frame<'_>, log_time: u64, buffer: &mut Vec<u8>) {
        let entities = self.parts.iter().map(|part| part.entity(frame, log_time)).collect();
        encode(&SceneUpdate { deletions: Vec::new(), entities }, buffer);
    }
}

impl Part {
    fn new(body: &BodyTopology, &[r, g, b]: &[f64; 3]) -> Self {
        Part {
            name: body.name.clone(),
            colour: Color { r, g, b, a: 1.0 },
            triangles: Cells::new(body.surface.as_flattened()),
            lines: Cells::new(body.edges.as_flattened()),
        }
    }

    fn entity(&self, frame: &Frame<'_>, log_time: u64) -> SceneEntity {
        let mut entity = SceneEntity {
            timestamp: Some(timestamp(log_time)),
            frame_id: FRAME_ID.to_owned(),
            // A viewer replaces the entity of the same name: the previous frame.
            id: self.name.clone(),
            ..SceneEntity::default()
        };
        if !self.triangles.indices.is_empty() {
            entity.triangles.push(TriangleListPrimitive {
                pose: Some(identity()),
                points: self.triangles.points(frame),
                color: Some(self.colour),
                colors: Vec::new(),
                indices: self.triangles.indices.clone(),
            });
        }
        if !self.lines.indices.is_empty() {
            entity.lines.push(LinePrimitive {
                r#type: line_primitive::Type::LineList as i32,
                pose: Some(identity()),
                // Pixels, being scale invariant.
                thickness: 1.0,
                scale_invariant: true,
                points: self.lines.points(frame),
                color: Some(self.colour),
                colors: Vec::new(),
                indices: self.lines.indices.clone(),
            });
        }
        entity
    }
}

impl Cells {
    fn new(cells: &[u32]) -> Self {
        let mut vertices = cells.to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        // Every cell vertex was put into the list above, so the search always finds it.
        let number = |v: &u32| vertices.partition_point(|other| other < v) as u32;
        let indices = cells.iter().map(number).collect();
        Cells { vertices, indices }
    }

    fn points(&self, frame: &Frame<'_>) -> Vec<Point3> {
        let dimension = frame.dimension;
        let coordinate = |x: &[f64], axis: usize| f64::from(x.get(axis).copied().unwrap_or(0.0) as f32);
        let point = |&vertex: &u32| {
            let x = &frame.x[vertex as usize * dimension..][..dimension];
            Point3 { x: coordinate(x, 0), y: coordinate(x, 1), z: coordinate(x, 2) }
        };
        self.vertices.iter().map(point).collect()
    }
}
