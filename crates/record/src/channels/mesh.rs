//! `/mesh`: surfaces and lines for viewers, as `foxglove.SceneUpdate`: one entity per body, its surface
//! as triangles and its springs as lines. Particles have neither; viewers draw them from `/state`.
//!
//! For display only: coordinates are rounded to single precision, which makes the file three times
//! smaller, and at most 30 frames per simulated second are kept, fewer for large meshes.

use std::collections::BTreeMap;

use mcap::Channel;

use super::{ChannelEncoder, ChannelKind, Encoders, single};
use crate::Options;
use crate::clock::timestamp;
use crate::cloud::identity;
use crate::declaration::{FRAME_ID, typed};
use crate::memory::RecordingBytes;
use crate::protobuf::{MessageWriter, SCENE_UPDATE};
use pliant::observer::{Frame, Quantities};
use pliant::topology::{BodyTopology, Skin, Topology};

const NUMBER: u16 = 2;

/// Not in every frame, and therefore first.
pub(super) const KIND: ChannelKind = ChannelKind { numbers: NUMBER..=NUMBER, is_complete: false, encoders };

/// Maximum number of frames per simulated second.
const RATE: u128 = 30;
/// Number of vertices up to which that rate is kept; beyond, the data rate per simulated second is
/// constant.
const FULL_RATE_VERTICES: u128 = 50_000;

/// Colours of bodies, in order and repeated: red, green, blue from 0 to 1. Blue, orange, green, pink,
/// sky, vermilion can be told apart by colour-blind viewers, too (Okabe and Ito).
pub const BODY_COLOURS: [[f64; 3]; 6] = [
    [0.0, 0.45, 0.70],
    [0.90, 0.62, 0.0],
    [0.0, 0.62, 0.45],
    [0.80, 0.47, 0.65],
    [0.34, 0.71, 0.91],
    [0.84, 0.37, 0.0],
];

/// Bytes of a point in a message: three doubles with their tags, preceded by a tag and a length.
const POINT_BYTES: usize = 3 * 9 + 2;

/// Encoder of `/mesh`.
struct MeshChannel {
    bodies: Vec<MeshBody>,
    vertex_count: u128,
    next_slot: u128,
}

/// Surface and lines of one body.
struct MeshBody {
    name: String,
    /// Red, green, blue.
    colour: [f64; 3],
    triangles: DrawnCells,
    lines: DrawnCells,
    /// Drawn instead of the triangles.
    skin: Option<Skin>,
}

/// Elements over the vertices that they use, numbered from 0.
struct DrawnCells {
    vertices: Vec<u32>,
    indices: Vec<u32>,
}

/// No encoder if nothing is drawn.
fn encoders(options: &Options, topology: &Topology) -> Encoders {
    let is_asked = options.channels.contains(&pliant_scene::Channel::Mesh);
    single(is_asked.then(|| MeshChannel::new(topology)).filter(|mesh| !mesh.bodies.is_empty()))
}

impl MeshChannel {
    fn new(topology: &Topology) -> Self {
        let drawn = topology.bodies.iter().filter(|body| !body.surface.is_empty() || !body.edges.is_empty());
        let bodies: Vec<MeshBody> =
            drawn.zip(BODY_COLOURS.iter().cycle()).map(|(body, c)| MeshBody::new(body, c)).collect();
        let of_skin = |body: &MeshBody| body.skin.as_ref().map_or(0, Skin::vertex_count);
        let count =
            |body: &MeshBody| body.triangles.vertices.len() + body.lines.vertices.len() + of_skin(body);
        let vertex_count = bodies.iter().map(count).sum::<usize>() as u128;
        MeshChannel { bodies, vertex_count, next_slot: 0 }
    }
}

impl ChannelEncoder for MeshChannel {
    fn quantities(&self) -> Quantities {
        Quantities::STATE
    }

    fn declaration(&self) -> Channel<'static> {
        typed(NUMBER, "/mesh", SCENE_UPDATE, BTreeMap::new())
    }

    /// True for the first frame in a slot of 1/30 s (longer for large meshes).
    fn is_due(&mut self, log_time: u64) -> bool {
        // Times are rounded to nanoseconds; a microsecond keeps 1/30 s from falling just short of its
        // slot.
        let time = u128::from(log_time) + 1_000;
        let slot =
            time * RATE * FULL_RATE_VERTICES / (1_000_000_000 * self.vertex_count.max(FULL_RATE_VERTICES));
        let due = slot >= self.next_slot;
        if due {
            self.next_slot = slot + 1;
        }
        due
    }

    fn bytes(&self) -> RecordingBytes {
        let cells = self.bodies.iter().flat_map(|body| [&body.triangles, &body.lines]);
        let bytes = |cells: &DrawnCells| RecordingBytes {
            held: 4 * (cells.vertices.len() + cells.indices.len()),
            message: POINT_BYTES * cells.vertices.len() + 4 * cells.indices.len(),
        };
        let of_skin = |skin: &Skin| RecordingBytes {
            held: 12 * skin.triangles.len() + 12 * skin.nodes.len(),
            message: POINT_BYTES * skin.vertex_count() + 12 * skin.triangles.len(),
        };
        let skins = self.bodies.iter().flat_map(|body| &body.skin).map(of_skin);
        cells.map(bytes).chain(skins).sum()
    }

    fn encode(&mut self, frame: &Frame<'_>, log_time: u64, buffer: &mut Vec<u8>) {
        let mut update = MessageWriter::append_to(buffer);
        for body in &self.bodies {
            update.message(2, |entity| body.encode(frame, log_time, entity));
        }
    }
}

impl MeshBody {
    fn new(body: &BodyTopology, colour: &[f64; 3]) -> Self {
        MeshBody {
            name: body.name.clone(),
            colour: *colour,
            triangles: DrawnCells::new(if body.skin.is_some() { &[] } else { body.surface.as_flattened() }),
            lines: DrawnCells::new(body.edges.as_flattened()),
            skin: body.skin.clone(),
        }
    }

    /// Writes a `foxglove.SceneEntity`. Viewers replace the entity of the same name, that of the previous
    /// frame.
    fn encode(&self, frame: &Frame<'_>, log_time: u64, entity: &mut MessageWriter<'_>) {
        timestamp(entity, 1, log_time);
        entity.string(2, FRAME_ID).string(3, &self.name);
        if !self.lines.indices.is_empty() {
            entity.message(11, |lines| self.encode_lines(frame, lines));
        }
        if !self.triangles.indices.is_empty() {
            entity.message(12, |triangles| self.encode_triangles(frame, triangles));
        }
        if let Some(skin) = &self.skin {
            entity.message(12, |triangles| self.encode_skin(skin, frame, triangles));
        }
    }

    /// Writes a `foxglove.LinePrimitive`, lines of one pixel.
    fn encode_lines(&self, frame: &Frame<'_>, lines: &mut MessageWriter<'_>) {
        lines.integer(1, LINE_LIST).message(2, identity).double(3, 1.0).integer(4, true.into());
        self.lines.encode_points(5, frame, lines);
        lines.message(6, |colour| self.encode_colour(colour)).fixed32_list(8, &self.lines.indices);
    }

    /// Writes a `foxglove.TriangleListPrimitive`.
    fn encode_triangles(&self, frame: &Frame<'_>, triangles: &mut MessageWriter<'_>) {
        triangles.message(1, identity);
        self.triangles.encode_points(2, frame, triangles);
        triangles.message(3, |colour| self.encode_colour(colour)).fixed32_list(5, &self.triangles.indices);
    }

    /// Writes the embedded surface as a `foxglove.TriangleListPrimitive`, interpolated from its elements.
    fn encode_skin(&self, skin: &Skin, frame: &Frame<'_>, triangles: &mut MessageWriter<'_>) {
        triangles.message(1, identity);
        for vertex in 0..skin.vertex_count() {
            let x: [f64; 3] = skin.interpolated(vertex, frame.x);
            triangles.message(2, |point| encode_point(point, &x));
        }
        triangles.message(3, |colour| self.encode_colour(colour));
        triangles.fixed32_list(5, skin.triangles.as_flattened());
    }

    fn encode_colour(&self, colour: &mut MessageWriter<'_>) {
        colour.doubles(1, &self.colour).double(4, 1.0);
    }
}

/// Writes the coordinates of a `foxglove.Point3`.
fn encode_point(point: &mut MessageWriter<'_>, x: &[f64]) {
    for (axis, x) in (1..).zip(x) {
        point.double(axis, f64::from(*x as f32));
    }
}

/// Value for pairs of points in the enumeration `foxglove.LinePrimitive.Type`.
const LINE_LIST: u64 = 2;

impl DrawnCells {
    fn new(cells: &[u32]) -> Self {
        let mut vertices = cells.to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        // A vertex belongs to several elements, mostly six triangles.
        vertices.shrink_to_fit();
        // Every vertex is in the list above, so the search always finds it.
        let number = |v: &u32| vertices.partition_point(|other| other < v) as u32;
        let indices = cells.iter().map(number).collect();
        DrawnCells { vertices, indices }
    }

    /// Writes the vertices as entries of a list of `foxglove.Point3`.
    fn encode_points(&self, field: u8, frame: &Frame<'_>, message: &mut MessageWriter<'_>) {
        let dimension = frame.dimension;
        for &vertex in &self.vertices {
            let x = &frame.x[vertex as usize * dimension..][..dimension];
            message.message(field, |point| encode_point(point, x));
        }
    }
}
