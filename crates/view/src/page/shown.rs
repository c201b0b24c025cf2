//! The part of a body that is seen: inner vertices and elements do not travel.

use crate::drawing::DrawnBody;

/// Vertices and cells of a body, numbered from 0 among those that are seen.
pub(super) struct ShownBody {
    /// Numbers in the recording, ascending.
    pub(super) vertices: Vec<u32>,
    pub(super) triangles: Vec<u32>,
    pub(super) lines: Vec<u32>,
    /// Numbers of elements in the body, ascending; empty where triangles belong to none.
    pub(super) elements: Vec<u32>,
    /// Of each triangle, its place among `elements`.
    pub(super) triangle_elements: Vec<u32>,
    pub(super) is_particles: bool,
}

impl ShownBody {
    /// Of the boundary beneath a skin, those vertices are shown that are `marked`, ascending.
    pub(super) fn new(body: &DrawnBody, marked: &[u32]) -> ShownBody {
        let corners = body.triangles.as_flattened();
        let ends = body.lines.as_flattened();
        let beneath = body.beneath.iter().filter(|vertex| marked.binary_search(vertex).is_ok());
        let vertices = distinct(corners.iter().chain(ends).chain(&body.points).chain(beneath));
        let of_triangles = body.elements.as_deref().unwrap_or_default();
        let elements = distinct(of_triangles.iter());
        ShownBody {
            triangles: places(corners, &vertices),
            lines: places(ends, &vertices),
            triangle_elements: places(of_triangles, &elements),
            is_particles: !body.points.is_empty(),
            vertices,
            elements,
        }
    }
}

/// Ascending, each once.
fn distinct<'a>(numbers: impl Iterator<Item = &'a u32>) -> Vec<u32> {
    let mut numbers: Vec<u32> = numbers.copied().collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

/// Where each number stands among those that are shown, which has them all.
fn places(numbers: &[u32], shown: &[u32]) -> Vec<u32> {
    numbers.iter().filter_map(|number| shown.binary_search(number).ok()).map(|place| place as u32).collect()
}
