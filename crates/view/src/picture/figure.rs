//! What a picture shows: plain arrays, whatever they come from.

use super::image::Rgb;
use super::space::{Vec3, cross, dot, minus, mixed, plus, smooth_step, unit};

/// Triangles, lines and discs between vertices, and the walls behind them. Colours are of corners, so that a
/// number can belong to a vertex, to an element or to a body.
#[derive(Clone, Debug, Default)]
pub struct DrawnFigure {
    /// 2 or 3; a figure of two dimensions lies in the plane z = 0.
    pub dimension: usize,
    /// Places [m].
    pub vertices: Vec<Vec3>,
    /// Triangles: three numbers of vertices each.
    pub faces: Vec<[u32; 3]>,
    /// Colours of the corners of each triangle.
    pub face_colors: Vec<[Rgb; 3]>,
    /// Lines: two numbers of vertices each.
    pub segments: Vec<[u32; 2]>,
    /// Colours of the ends of each line.
    pub segment_colors: Vec<[Rgb; 2]>,
    /// Points.
    pub dots: Vec<Dot>,
    /// Walls: a point, and the unit normal towards the side on which bodies are.
    pub walls: Vec<[Vec3; 2]>,
    /// Small marks on vertices, with a name beside where there is one.
    pub marks: Vec<DrawnMark>,
    /// Paths of points so far, drawn as fading lines.
    pub trails: Vec<DrawnTrail>,
}

/// A point with a mass.
#[derive(Clone, Copy, Debug)]
pub struct Dot {
    /// Number of its vertex.
    pub vertex: u32,
    /// Its colour.
    pub color: Rgb,
    /// Radius, 1 for a usual one.
    pub size: f32,
}

/// A mark on a place: a pin, a probe.
#[derive(Clone, Debug)]
pub struct DrawnMark {
    /// Where [m].
    pub at: Vec3,
    /// What is written beside it; nothing where it is empty.
    pub name: String,
}

/// Where a point has been.
#[derive(Clone, Debug)]
pub struct DrawnTrail {
    /// Its places, the newest last [m].
    pub places: Vec<Vec3>,
    /// Its colour.
    pub color: Rgb,
}

/// Cosines of the angle between a triangle and its smooth normal at which an edge begins to be sharp, and at
/// which it is: a right angle between two faces is sharp, and so is one of sixty degrees.
const SHARP: [f32; 2] = [0.88, 0.76];

impl DrawnFigure {
    /// Every vertex that is drawn.
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

    /// Corners of a triangle; `None` where one is not a number.
    pub(crate) fn corners(&self, face: usize) -> Option<[Vec3; 3]> {
        let corners = self.faces[face].map(|vertex| self.vertices[vertex as usize]);
        corners.iter().all(is_finite).then_some(corners)
    }

    /// Unit normals of the vertices: means over their triangles, weighted by area.
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

    /// Normals at the corners of a triangle: those of its vertices, and its own where its surface has an
    /// edge.
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

/// Centre and radius of the box around places; a radius of 1 where it is a point.
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
