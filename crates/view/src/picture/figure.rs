//! Figure: content of a picture as plain arrays.

use super::image::Rgb;
use super::space::{Vec3, cross, dot, minus, mixed, plus, smooth_step, unit};

/// Triangles, lines and discs between vertices, with walls. Colours belong to corners, so that a value
/// can belong to a vertex, an element or a body.
#[derive(Clone, Debug, Default)]
pub struct DrawnFigure {
    /// Dimension, 2 or 3; a two-dimensional figure lies in the plane z = 0.
    pub dimension: usize,
    /// Positions [m].
    pub vertices: Vec<Vec3>,
    /// Triangles: three vertex indices each.
    pub faces: Vec<[u32; 3]>,
    /// Colours of the corners of each triangle.
    pub face_colors: Vec<[Rgb; 3]>,
    /// Lines: two vertex indices each.
    pub segments: Vec<[u32; 2]>,
    /// Colours of the ends of each line.
    pub segment_colors: Vec<[Rgb; 2]>,
    /// Points.
    pub dots: Vec<Dot>,
    /// Walls: a point, and the unit normal towards the bodies.
    pub walls: Vec<[Vec3; 2]>,
    /// Marks at vertices, with an optional name.
    pub marks: Vec<DrawnMark>,
    /// Past paths of points, drawn as fading lines.
    pub trails: Vec<DrawnTrail>,
}

/// Point with a mass.
#[derive(Clone, Copy, Debug)]
pub struct Dot {
    /// Vertex index.
    pub vertex: u32,
    /// Colour.
    pub color: Rgb,
    /// Radius relative to a usual one.
    pub size: f32,
}

/// Mark at a position: a pin or a probe.
#[derive(Clone, Debug)]
pub struct DrawnMark {
    /// Position [m].
    pub at: Vec3,
    /// Label; none if empty.
    pub name: String,
}

/// Past path of a point.
#[derive(Clone, Debug)]
pub struct DrawnTrail {
    /// Positions, the newest last [m].
    pub places: Vec<Vec3>,
    /// Colour.
    pub color: Rgb,
}

/// Cosines of the angle between a triangle's normal and the smooth normal at which an edge starts to be
/// sharp and is fully sharp: edges of ninety and of sixty degrees between faces are sharp.
const SHARP: [f32; 2] = [0.88, 0.76];

impl DrawnFigure {
    /// Positions of all drawn vertices.
    pub(crate) fn drawn(&self) -> Vec<Vec3> {
        let mut used = vec![false; self.vertices.len()];
        let faces = self.faces.iter().flatten();
        let dots = self.dots.iter().map(|dot| &dot.vertex);
        for vertex in faces.chain(self.segments.iter().flatten()).chain(dots) {
            used[*vertex as usize] = true;
        }
        let places = self.vertices.iter().zip(used).filter(|(place, used)| *used && is_finite(place));
        places.map(|(place, _)| *place).collect()
    }

    /// Corners of a triangle; `None` if one is not finite.
    pub(crate) fn corners(&self, face: usize) -> Option<[Vec3; 3]> {
        let corners = self.faces[face].map(|vertex| self.vertices[vertex as usize]);
        corners.iter().all(is_finite).then_some(corners)
    }

    /// Unit vertex normals: means over their triangles, weighted by area.
    pub(crate) fn vertex_normals(&self) -> Vec<Vec3> {
        let mut normals = vec![[0.0; 3]; self.vertices.len()];
        for (face, vertices) in self.faces.iter().enumerate() {
            if let Some([a, b, c]) = self.corners(face) {
                let normal = cross(minus(b, a), minus(c, a));
                for vertex in vertices {
                    normals[*vertex as usize] = plus(normals[*vertex as usize], normal);
                }
            }
        }
        normals.iter().map(|normal| unit(*normal)).collect()
    }

    /// Normals at the corners of a triangle: vertex normals, or its own normal at sharp edges.
    pub(crate) fn corner_normals(&self, face: usize, vertex_normals: &[Vec3]) -> Option<[Vec3; 3]> {
        let [a, b, c] = self.corners(face)?;
        let own = unit(cross(minus(b, a), minus(c, a)));
        Some(self.faces[face].map(|vertex| {
            let smooth = vertex_normals[vertex as usize];
            mixed(own, smooth, smooth_step(SHARP[1], SHARP[0], dot(own, smooth)))
        }))
    }
}

fn is_finite(place: &Vec3) -> bool {
    place.iter().all(|x| x.is_finite())
}

/// Centre and radius of the bounding box; radius 1 for a single point.
pub(crate) fn bounds(places: &[Vec3]) -> (Vec3, f32) {
    let fold = |start: f32, pick: fn(f32, f32) -> f32| {
        places.iter().fold([start; 3], |a, b| [0, 1, 2].map(|i| pick(a[i], b[i])))
    };
    if places.is_empty() {
        return ([0.0; 3], 1.0);
    }
    let (low, high) = (fold(f32::INFINITY, f32::min), fold(f32::NEG_INFINITY, f32::max));
    let radius = 0.5 * super::space::length(minus(high, low));
    ([0, 1, 2].map(|i| 0.5 * (low[i] + high[i])), if radius > 0.0 { radius } else { 1.0 })
}
