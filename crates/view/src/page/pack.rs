//! Packing of a recording: blocks of bytes for the page, and a head that describes them.

use serde_json::{Value, json};

use super::charts;
use super::codec::{Chunk, Extent, LARGEST, Quantiser, deflate, encode};
use super::loads;
use super::shown::ShownBody;
use crate::colour;
use crate::drawing::{BodyScalars, Colouring, DrawError, Drawing};

/// Number of frames encoded together.
const CHUNK: usize = 32;
/// A body flies if the box of its path is more than this many times its own size.
const FLIGHT: f64 = 2.0;

/// Named blocks with their head.
pub(super) struct Packed {
    pub(super) head: Value,
    pub(super) blocks: Vec<(String, Vec<u8>)>,
}

impl Packed {
    /// Size of all blocks [bytes].
    pub(super) fn bytes(&self) -> usize {
        self.blocks.iter().map(|(_, bytes)| bytes.len()).sum()
    }
}

/// Packs these frames and colourings.
pub(super) fn pack(
    drawing: &mut Drawing,
    frames: &[usize],
    colourings: &[Colouring],
) -> Result<Packed, DrawError> {
    let marked = drawing.marked();
    let shown: Vec<ShownBody> = drawing.bodies().iter().map(|body| ShownBody::new(body, &marked)).collect();
    let mut blocks = Vec::new();
    let motions = motions(drawing, &shown, frames, &mut blocks)?;
    let bodies: Vec<Value> =
        (0..shown.len()).map(|b| body(drawing, &shown[b], b, &motions[b], &mut blocks)).collect();
    let mut coloured = Vec::new();
    for (c, colouring) in colourings.iter().enumerate() {
        coloured.push(scalars(drawing, &shown, frames, (c, colouring), &mut blocks)?);
    }
    let pins = drawing.pins().to_vec();
    let probes: Vec<&str> = drawing.probes().iter().map(|probe| probe.name.as_str()).collect();
    let walls = drawing.walls().iter();
    let walls = walls.map(|w| json!({ "name": w.name, "point": w.point, "normal": w.normal }));
    let head = json!({
        "title": drawing.title(),
        "dimension": drawing.dimension(),
        "frames": frames,
        "frame_count": drawing.times().len(),
        "chunk": CHUNK,
        "times": frames.iter().map(|&frame| drawing.times()[frame]).collect::<Vec<_>>(),
        "bodies": bodies,
        "colourings": coloured,
        "colour_map": colour::viridis_table().as_flattened(),
        "pins": pins,
        "probes": probes,
        "probe_positions": frames.iter().map(|&frame| probe_positions(drawing, frame)).collect::<Vec<_>>(),
        "walls": walls.collect::<Vec<_>>(),
        "loads": loads::loads(drawing, &shown, frames),
        "gravity": loads::gravity(drawing, frames),
        "charts": charts::charts(drawing, frames)?,
    });
    Ok(Packed { head, blocks })
}

fn probe_positions(drawing: &Drawing, frame: usize) -> Vec<[f64; 3]> {
    drawing.probes().iter().map(|probe| probe.positions.get(frame).copied().unwrap_or_default()).collect()
}

/// Quantisation of the positions of a body.
struct CodedMotion {
    /// Quantisers of x, y and z.
    axes: [Quantiser; 3],
    /// Centroid in each frame; empty if the box does not follow the body.
    centres: Vec<[f32; 3]>,
    orders: Vec<u8>,
}

/// Boxes of a body: of its whole path, and around its centroid.
#[derive(Clone)]
struct Boxes {
    fixed: [Extent; 3],
    centred: [Extent; 3],
    centres: Vec<[f32; 3]>,
}

impl Boxes {
    const EMPTY: Boxes = Boxes { fixed: [Extent::EMPTY; 3], centred: [Extent::EMPTY; 3], centres: vec![] };

    fn add(&mut self, x: &[f64], vertices: &[u32]) {
        let centre = centroid(x, vertices);
        for &vertex in vertices {
            for axis in 0..3 {
                let place = x[3 * vertex as usize + axis];
                self.fixed[axis].add(place);
                self.centred[axis].add(place - f64::from(centre[axis]));
            }
        }
        self.centres.push(centre);
    }

    fn motion(self) -> CodedMotion {
        let size = |extents: &[Extent; 3]| extents.iter().map(Extent::length).fold(0.0, f64::max);
        let flies = size(&self.fixed) > FLIGHT * size(&self.centred);
        let extents = if flies { self.centred } else { self.fixed };
        let centres = if flies { self.centres } else { vec![] };
        CodedMotion { axes: extents.map(Quantiser::of), centres, orders: vec![] }
    }
}

/// Mean of the finite positions.
fn centroid(x: &[f64], vertices: &[u32]) -> [f32; 3] {
    let (mut sum, mut count) = ([0.0; 3], 0.0f64);
    for &vertex in vertices {
        let place = &x[3 * vertex as usize..3 * vertex as usize + 3];
        if place.iter().all(|c| c.is_finite()) {
            (0..3).for_each(|axis| sum[axis] += place[axis]);
            count += 1.0;
        }
    }
    sum.map(|sum| (sum / count.max(1.0)) as f32)
}

fn motions(
    drawing: &mut Drawing,
    shown: &[ShownBody],
    frames: &[usize],
    blocks: &mut Vec<(String, Vec<u8>)>,
) -> Result<Vec<CodedMotion>, DrawError> {
    let mut boxes = vec![Boxes::EMPTY; shown.len()];
    for &frame in frames {
        let x = drawing.frame(frame)?.x;
        boxes.iter_mut().zip(shown).for_each(|(boxes, body)| boxes.add(&x, &body.vertices));
    }
    let mut motions: Vec<CodedMotion> = boxes.into_iter().map(Boxes::motion).collect();
    for (k, chunk) in frames.chunks(CHUNK).enumerate() {
        let mut codes = vec![Vec::new(); shown.len()];
        for (offset, &frame) in chunk.iter().enumerate() {
            let x = drawing.frame(frame)?.x;
            for (b, body) in shown.iter().enumerate() {
                codes[b].push(motions[b].codes(&x, &body.vertices, CHUNK * k + offset));
            }
        }
        for (b, codes) in codes.iter().enumerate() {
            let Chunk { order, bytes } = encode(codes);
            motions[b].orders.push(order);
            blocks.push((format!("body{b}.position{k}"), bytes));
        }
    }
    Ok(motions)
}

impl CodedMotion {
    /// Codes of all x, then all y, then all z.
    fn codes(&self, x: &[f64], vertices: &[u32], frame: usize) -> Vec<u16> {
        let centre = self.centres.get(frame).copied().unwrap_or_default().map(f64::from);
        let axis = |axis: usize| {
            let place = move |vertex: &u32| x[3 * *vertex as usize + axis] - centre[axis];
            vertices.iter().map(move |vertex| self.axes[axis].code(place(vertex)))
        };
        axis(0).chain(axis(1)).chain(axis(2)).collect()
    }
}

fn body(
    drawing: &Drawing,
    shown: &ShownBody,
    number: usize,
    motion: &CodedMotion,
    blocks: &mut Vec<(String, Vec<u8>)>,
) -> Value {
    let drawn = &drawing.bodies()[number];
    let lists = [
        ("vertices", &shown.vertices),
        ("triangles", &shown.triangles),
        ("lines", &shown.lines),
        ("elements", &shown.elements),
        ("triangle_elements", &shown.triangle_elements),
    ];
    for (name, list) in lists {
        let bytes: Vec<u8> = list.iter().flat_map(|number| number.to_le_bytes()).collect();
        blocks.push((format!("body{number}.{name}"), deflate(&bytes)));
    }
    let mass = |vertex: &u32| drawing.masses().map(|masses| masses[*vertex as usize]);
    let masses: Option<Vec<f64>> =
        if shown.is_particles { shown.vertices.iter().map(mass).collect() } else { None };
    json!({
        "name": drawn.name,
        "colour": colour::of_body(number),
        "first_vertex": drawn.vertices.start,
        "first_of_skin": if drawn.skin.is_empty() { None } else { Some(drawn.skin.start) },
        "vertex_count": shown.vertices.len(),
        "element_count": drawn.element_count(),
        "particles": shown.is_particles,
        "masses": masses,
        "low": motion.axes.map(|axis| axis.low),
        "step": motion.axes.map(|axis| axis.step),
        "centres": motion.centres,
        "orders": motion.orders,
    })
}

/// Packs one colouring: its head, and the codes of each body with such values.
fn scalars(
    drawing: &mut Drawing,
    shown: &[ShownBody],
    frames: &[usize],
    (number, colouring): (usize, &Colouring),
    blocks: &mut Vec<(String, Vec<u8>)>,
) -> Result<Value, DrawError> {
    if matches!(colouring, Colouring::Body) {
        return Ok(json!({ "name": "body", "unit": "1", "bodies": [] }));
    }
    // Range over all frames.
    let mut extent = Extent::EMPTY;
    for &frame in frames {
        for values in seen(drawing, shown, colouring, frame)?.into_iter().flatten() {
            values.1.iter().for_each(|value| extent.add(*value));
        }
    }
    let quantiser = Quantiser::of(extent);
    // Codes, chunk by chunk.
    let mut bodies = vec![json!(null); shown.len()];
    for (k, chunk) in frames.chunks(CHUNK).enumerate() {
        let mut codes = vec![Vec::new(); shown.len()];
        for &frame in chunk {
            for (b, values) in seen(drawing, shown, colouring, frame)?.into_iter().enumerate() {
                let Some((place, values)) = values else { continue };
                if bodies[b].is_null() {
                    bodies[b] = json!({ "of": place, "orders": [] });
                }
                codes[b].push(values.into_iter().map(|value| quantiser.code(value)).collect());
            }
        }
        for (b, codes) in codes.iter().enumerate().filter(|(_, codes)| !codes.is_empty()) {
            let Chunk { order, bytes } = encode(codes);
            if let Some(orders) = bodies[b]["orders"].as_array_mut() {
                orders.push(json!(order));
            }
            blocks.push((format!("body{b}.colouring{number}.{k}"), bytes));
        }
    }
    let range = [quantiser.low, quantiser.low + quantiser.step * f64::from(LARGEST)];
    Ok(json!({ "name": colouring.to_string(), "unit": colouring.unit(), "range": range, "bodies": bodies }))
}

/// Values of the visible parts of each body, with their kind; `None` if a body has none.
type SeenScalars = Vec<Option<(&'static str, Vec<f64>)>>;

fn seen(
    drawing: &mut Drawing,
    shown: &[ShownBody],
    colouring: &Colouring,
    frame: usize,
) -> Result<SeenScalars, DrawError> {
    let scalars = drawing.scalars(colouring, frame)?;
    let of = |(b, scalars): (usize, BodyScalars)| {
        let body = &drawing.bodies()[b];
        match scalars {
            BodyScalars::Vertices(values) => {
                let value = |vertex: &u32| values[body.place(*vertex)];
                Some(("vertices", shown[b].vertices.iter().map(value).collect()))
            }
            BodyScalars::Elements(values) if !shown[b].elements.is_empty() => {
                let value = |element: &u32| values[*element as usize];
                Some(("elements", shown[b].elements.iter().map(value).collect()))
            }
            _ => None,
        }
    };
    Ok(scalars.bodies.into_iter().enumerate().map(of).collect())
}
