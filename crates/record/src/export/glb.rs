//! Export as binary glTF 2.0 with a morph target for each frame,
//! <https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html>.

use std::io::Write;

use serde_json::{Value, json};

use super::{Export, ExportError};
use crate::channels::mesh::BODY_COLOURS;
use crate::read::RecordedBody;

/// Values of `componentType`, `target` and `mode`.
const I16: u32 = 5122;
const U16: u32 = 5123;
const U32: u32 = 5125;
const FLOAT: u32 = 5126;
const VERTICES: u32 = 34_962;
const INDICES: u32 = 34_963;
const POINTS: u32 = 0;
const LINES: u32 = 1;
const TRIANGLES: u32 = 4;

impl Export {
    /// Maximum number of frames of a `.glb`: its weights are their number squared.
    pub const GLB_FRAMES: usize = 120;

    /// Writes these frames of all surfaces, lines and points as one animated scene with a mesh for each
    /// body. The mesh has the positions of the first frame, and for each further frame a morph target
    /// with the displacements from there, whose weight is 1 at its time. Units are metres, y up (`z` of
    /// the recording; two-dimensional scenes keep their `y`). Numbers have single precision, or are
    /// `quantised` to 16 bits of the body's box, for which readers must support `KHR_mesh_quantization`.
    ///
    /// # Errors
    /// [`ExportError::TooManyFrames`]; a frame that cannot be read; a write error of the stream.
    pub fn write_glb(
        &mut self,
        frames: &[usize],
        quantised: bool,
        out: &mut dyn Write,
    ) -> Result<(), ExportError> {
        if frames.len() > Self::GLB_FRAMES {
            return Err(ExportError::TooManyFrames { count: frames.len(), most: Self::GLB_FRAMES });
        }
        let flat = self.trajectory.dimension() < 3;
        let mut states = Vec::new();
        for &frame in frames {
            states.push(self.frame(frame)?);
        }
        let start = states.first().map_or(0.0, |state| state.time);
        let times: Vec<f32> = states.iter().map(|state| (state.time - start) as f32).collect();
        let mut document = Gltf::default();
        let times = (times.len() > 1).then(|| document.floats(&times, "SCALAR", None));
        for (number, body) in self.bodies.bodies.iter().enumerate() {
            let shown = Shown::of(body);
            let places: Vec<Vec<[f32; 3]>> =
                states.iter().map(|state| shown.places(&state.x, flat)).collect();
            document.body(&shown, &body.name, number, &places, quantised, times);
        }
        if quantised {
            document.extensions = vec!["KHR_mesh_quantization"];
        }
        Ok(out.write_all(&document.bytes())?)
    }
}

/// Visible vertices of a body, and their connectivity.
struct Shown {
    /// Vertices, ascending.
    vertices: Vec<u32>,
    indices: Vec<u32>,
    mode: u32,
}

impl Shown {
    fn of(body: &RecordedBody) -> Shown {
        let (cells, mode): (Vec<u32>, u32) = if body.is_particles() {
            (body.vertices.clone().collect(), POINTS)
        } else if body.surface.is_empty() {
            (body.lines().as_flattened().to_vec(), LINES)
        } else {
            (body.drawn().as_flattened().to_vec(), TRIANGLES)
        };
        let mut vertices = cells.clone();
        vertices.sort_unstable();
        vertices.dedup();
        let number = |vertex: &u32| vertices.binary_search(vertex).unwrap_or_else(|at| at) as u32;
        let indices = cells.iter().map(number).collect();
        Shown { vertices, indices, mode }
    }

    /// Positions of the vertices, y up.
    fn places(&self, x: &[f64], flat: bool) -> Vec<[f32; 3]> {
        let place = |vertex: &u32| {
            let [x, y, z] = [0, 1, 2].map(|axis| x[3 * *vertex as usize + axis] as f32);
            if flat { [x, y, z] } else { [x, z, -y] }
        };
        self.vertices.iter().map(place).collect()
    }
}

/// Document with its buffer.
#[derive(Default)]
struct Gltf {
    buffer: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    nodes: Vec<Value>,
    samplers: Vec<Value>,
    channels: Vec<Value>,
    extensions: Vec<&'static str>,
}

impl Gltf {
    fn body(
        &mut self,
        shown: &Shown,
        name: &str,
        number: usize,
        places: &[Vec<[f32; 3]>],
        quantised: bool,
        times: Option<usize>,
    ) {
        let Some(first) = places.first().filter(|places| !places.is_empty()) else { return };
        // Positions and morph targets.
        let grid = Grid::of(places, quantised);
        let position = self.positions(first, &grid);
        let targets: Vec<Value> = places[1..]
            .iter()
            .map(|places| json!({ "POSITION": self.displacements(first, places, &grid) }))
            .collect();
        let mut primitive = json!({
            "attributes": { "POSITION": position }, "mode": shown.mode, "material": self.materials.len(),
        });
        if shown.mode != POINTS {
            primitive["indices"] = json!(self.indices(&shown.indices));
        }
        // Mesh, material and node.
        let count = targets.len();
        let mut mesh = json!({ "name": name });
        if count > 0 {
            primitive["targets"] = json!(targets);
            mesh["weights"] = json!(vec![0.0; count]);
        }
        mesh["primitives"] = json!([primitive]);
        let [r, g, b] = BODY_COLOURS[number % BODY_COLOURS.len()].map(|channel| channel * channel);
        let surface =
            json!({ "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6 });
        self.materials.push(json!({ "name": name, "pbrMetallicRoughness": surface, "doubleSided": true }));
        let node = json!({ "name": name, "mesh": self.meshes.len() });
        self.nodes.push(if quantised { grid.on(node) } else { node });
        self.meshes.push(mesh);
        if let Some(times) = times.filter(|_| count > 0) {
            self.animate(times, count);
        }
    }

    /// At the time of frame `k + 1` target `k` has weight 1 and the others 0; weights are interpolated
    /// between.
    fn animate(&mut self, times: usize, count: usize) {
        let weight = |frame: usize, target: usize| if frame == target + 1 { 1.0 } else { 0.0 };
        let weights: Vec<f32> =
            (0..=count).flat_map(|frame| (0..count).map(move |target| weight(frame, target))).collect();
        let output = self.floats(&weights, "SCALAR", None);
        let node = self.nodes.len() - 1;
        self.channels
            .push(json!({ "sampler": self.samplers.len(), "target": { "node": node, "path": "weights" } }));
        self.samplers.push(json!({ "input": times, "output": output, "interpolation": "LINEAR" }));
    }

    fn positions(&mut self, places: &[[f32; 3]], grid: &Grid) -> usize {
        if grid.quantised {
            let steps: Vec<[i32; 3]> = places.iter().map(|place| grid.steps(place)).collect();
            self.whole(&steps, U16)
        } else {
            self.floats(places.as_flattened(), "VEC3", Some(VERTICES))
        }
    }

    fn displacements(&mut self, from: &[[f32; 3]], to: &[[f32; 3]], grid: &Grid) -> usize {
        let pairs = from.iter().zip(to);
        if grid.quantised {
            let steps: Vec<[i32; 3]> = pairs
                .map(|(from, to)| {
                    let (from, to) = (grid.steps(from), grid.steps(to));
                    [0, 1, 2].map(|axis| to[axis] - from[axis])
                })
                .collect();
            self.whole(&steps, I16)
        } else {
            let moved: Vec<f32> =
                pairs.flat_map(|(from, to)| [0, 1, 2].map(|axis| to[axis] - from[axis])).collect();
            self.floats(&moved, "VEC3", Some(VERTICES))
        }
    }

    /// Writes rows of three 16-bit numbers, each padded to 8 bytes.
    fn whole(&mut self, rows: &[[i32; 3]], component: u32) -> usize {
        let bytes: Vec<u8> = rows
            .iter()
            .flat_map(|row| [row[0], row[1], row[2], 0].map(|number| (number as u16).to_le_bytes()))
            .flatten()
            .collect();
        let view = self.view(&bytes, Some(VERTICES), Some(8));
        let least = [0, 1, 2].map(|axis| rows.iter().map(|row| row[axis]).min());
        let most = [0, 1, 2].map(|axis| rows.iter().map(|row| row[axis]).max());
        self.accessors.push(json!({
            "bufferView": view, "componentType": component, "count": rows.len(), "type": "VEC3",
            "min": least, "max": most,
        }));
        self.accessors.len() - 1
    }

    fn floats(&mut self, values: &[f32], kind: &str, target: Option<u32>) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.view(&bytes, target, None);
        let width = if kind == "VEC3" { 3 } else { 1 };
        let fold = |axis: usize, start: f32, pick: fn(f32, f32) -> f32| {
            values.iter().skip(axis).step_by(width).copied().fold(start, pick)
        };
        let least: Vec<f32> = (0..width).map(|axis| fold(axis, f32::INFINITY, f32::min)).collect();
        let most: Vec<f32> = (0..width).map(|axis| fold(axis, f32::NEG_INFINITY, f32::max)).collect();
        self.accessors.push(json!({
            "bufferView": view, "componentType": FLOAT, "count": values.len() / width, "type": kind,
            "min": least, "max": most,
        }));
        self.accessors.len() - 1
    }

    fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|index| index.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(INDICES), None);
        self.accessors.push(json!({
            "bufferView": view, "componentType": U32, "count": indices.len(), "type": "SCALAR",
        }));
        self.accessors.len() - 1
    }

    fn view(&mut self, bytes: &[u8], target: Option<u32>, stride: Option<usize>) -> usize {
        let mut view = json!({ "buffer": 0, "byteOffset": self.buffer.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        if let Some(stride) = stride {
            view["byteStride"] = json!(stride);
        }
        self.buffer.extend(bytes);
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    /// Header, document and buffer, each padded to four bytes.
    fn bytes(self) -> Vec<u8> {
        let generator = concat!("pliant ", env!("CARGO_PKG_VERSION"));
        let mut document = json!({
            "asset": { "version": "2.0", "generator": generator },
            "scene": 0,
            "scenes": [{ "nodes": (0..self.nodes.len()).collect::<Vec<_>>() }],
            "nodes": self.nodes, "meshes": self.meshes, "materials": self.materials,
            "accessors": self.accessors, "bufferViews": self.views,
            "buffers": [{ "byteLength": self.buffer.len() }],
        });
        if !self.channels.is_empty() {
            document["animations"] =
                json!([{ "name": "motion", "samplers": self.samplers, "channels": self.channels }]);
        }
        if !self.extensions.is_empty() {
            document["extensionsUsed"] = json!(self.extensions);
            document["extensionsRequired"] = json!(self.extensions);
        }
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + text.len() + 8 + self.buffer.len();
        let mut file = b"glTF".to_vec();
        for number in [2, length as u32, text.len() as u32] {
            file.extend(number.to_le_bytes());
        }
        file.extend(b"JSON");
        file.extend(text);
        file.extend((self.buffer.len() as u32).to_le_bytes());
        file.extend(b"BIN\0");
        file.extend(self.buffer);
        file
    }
}

/// Number of steps on the longest side of a box: signed differences of two positions fit 16 bits.
const STEPS: f32 = 32_767.0;

/// Lattice over the box of all positions of a body.
struct Grid {
    quantised: bool,
    corner: [f32; 3],
    step: f32,
}

impl Grid {
    fn of(places: &[Vec<[f32; 3]>], quantised: bool) -> Grid {
        let all = || places.iter().flatten();
        let fold = |axis: usize, start: f32, pick: fn(f32, f32) -> f32| {
            all().map(|place| place[axis]).fold(start, pick)
        };
        let corner = [0, 1, 2].map(|axis| fold(axis, f32::INFINITY, f32::min));
        let side = |axis: usize| fold(axis, f32::NEG_INFINITY, f32::max) - corner[axis];
        let longest = side(0).max(side(1)).max(side(2));
        Grid { quantised, corner, step: if longest > 0.0 { longest / STEPS } else { 1.0 } }
    }

    fn steps(&self, place: &[f32; 3]) -> [i32; 3] {
        [0, 1, 2].map(|axis| ((place[axis] - self.corner[axis]) / self.step).round() as i32)
    }

    /// Node with the transformation from steps to metres.
    fn on(&self, mut node: Value) -> Value {
        node["translation"] = json!(self.corner);
        node["scale"] = json!([self.step, self.step, self.step]);
        node
    }
}
