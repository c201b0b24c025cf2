//! Visible part of a body: interior vertices and elements are not packed.

use crate::drawing::DrawnBody;

/// Vertices, triangles and lines of a body, renumbered from 0 over visible vertices.
pub(super) struct ShownBody {
    /// Vertex indices in the recording, ascending.
    pub(super) vertices: Vec<u32>,
    pub(super) triangles: Vec<u32>,
    pub(super) lines: Vec<u32>,
    /// Element indices in the body, ascending; empty if triangles have no elements.
    pub(super) elements: Vec<u32>,
    /// Index into `elements` for each triangle.
    pub(super) triangle_elements: Vec<u32>,
    pub(super) is_particles: bool,
}

impl ShownBody {
    /// Selects the visible part. Of the boundary below an embedded surface, only `marked` vertices
    /// (ascending) are included.
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

/// Sorted distinct numbers.
fn distinct<'a>(numbers: impl Iterator<Item = &'a u32>) -> Vec<u32> {
    let mut numbers: Vec<u32> = numbers.copied().collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

/// Index of each number among the visible ones, which include all of them.
fn places(numbers: &[u32], shown: &[u32]) -> Vec<u32> {
    numbers.iter().filter_map(|number| shown.binary_search(number).ok()).map(|place| place as u32).collect()
}
