//! Shadow map: the surfaces that light reaches first.

use super::camera::Projected;
use super::figure::{DrawnFigure, bounds};
use super::raster::{self, Corner};
use super::space::{Vec3, cross, dot, minus, plus, times, unit};

/// Side of the map [texel].
const SIDE: usize = 1024;
/// Half side of the square that is averaged to soften shadow rims [texel].
const SOFT: i64 = 2;
/// Width of the shadow of a line [texel].
const LINE: f32 = 2.0;

/// Depths of the figure seen along the parallel light rays.
pub(super) struct ShadowMap {
    center: Vec3,
    right: Vec3,
    up: Vec3,
    /// Unit vector towards the light.
    pub(super) light: Vec3,
    /// Texels per metre.
    scale: f32,
    /// Depth tolerance that keeps a surface out of its own shadow [m].
    bias: f32,
    nearness: Vec<f32>,
}

impl ShadowMap {
    /// Shadow map of everything in the figure; `radius` is that of a usual dot [m].
    pub(super) fn new(figure: &DrawnFigure, places: &[Vec3], light: Vec3, radius: f32) -> ShadowMap {
        let (center, size) = bounds(places);
        let right = unit(cross([0.0, 0.0, 1.0], light));
        let up = cross(light, right);
        let scale = 0.5 * (SIDE - 8) as f32 / size;
        let nearness = vec![f32::NEG_INFINITY; SIDE * SIDE];
        let mut map = ShadowMap { center, right, up, light, scale, bias: 0.012 * size, nearness };
        map.cast(figure, radius);
        map
    }

    fn cast(&mut self, figure: &DrawnFigure, radius: f32) {
        for face in 0..figure.faces.len() {
            if let Some(corners) = figure.corners(face) {
                let corners = corners.map(|place| self.corner(place));
                raster::triangle(&corners, [SIDE; 2], |sample| {
                    keep(&mut self.nearness, sample.column, sample.row, sample.nearness);
                });
            }
        }
        for segment in &figure.segments {
            let ends = segment.map(|vertex| self.corner(figure.vertices[vertex as usize]));
            raster::line(&ends, LINE, [SIDE; 2], |sample, _, _| {
                keep(&mut self.nearness, sample.column, sample.row, sample.nearness);
            });
        }
        for dot in &figure.dots {
            let place = self.corner(figure.vertices[dot.vertex as usize]);
            let samples = (radius * dot.size * self.scale).max(1.0);
            raster::disc(place.at, samples, [SIDE; 2], |column, row, _| {
                keep(&mut self.nearness, column, row, place.nearness);
            });
        }
    }

    fn corner(&self, place: Vec3) -> Corner {
        let [x, y, nearness] = self.seen(place);
        Corner::new(&Projected { at: [x, y], nearness, weight: 1.0 }, 1)
    }

    /// Column, row and height towards the light.
    fn seen(&self, place: Vec3) -> [f32; 3] {
        let from_center = minus(place, self.center);
        let middle = 0.5 * SIDE as f32;
        let along = |axis: Vec3| middle + self.scale * dot(from_center, axis);
        [along(self.right), along(self.up), dot(from_center, self.light)]
    }

    /// Fraction of the light that reaches a position on a surface with this normal, 0 to 1.
    pub(super) fn lit(&self, place: Vec3, normal: Vec3) -> f32 {
        let raised = plus(place, times(normal, self.bias));
        let [x, y, nearness] = self.seen(raised);
        let (column, row) = (x.floor() as i64, y.floor() as i64);
        let inside = |at: i64| (SOFT..SIDE as i64 - SOFT).contains(&at);
        if !inside(column) || !inside(row) {
            return 1.0;
        }
        let width = (2 * SOFT + 1) as usize;
        let mut reached = 0;
        for y in 0..width {
            let from = (row - SOFT) as usize + y;
            let stored = &self.nearness[from * SIDE + (column - SOFT) as usize..][..width];
            reached += stored.iter().filter(|stored| nearness + 0.5 * self.bias > **stored).count();
        }
        reached as f32 / (width * width) as f32
    }
}

fn keep(stored: &mut [f32], column: usize, row: usize, nearness: f32) {
    let place = &mut stored[row * SIDE + column];
    *place = place.max(nearness);
}
