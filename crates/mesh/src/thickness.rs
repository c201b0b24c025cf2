//! Thickness of solids, in metres and in cells: from their surface along the inward normal to the other side.

use std::collections::HashMap;

use super::Mesh;
use super::facets::for_each_equal;
use pliant::algebra::cross;
use pliant::algebra::{Mat, Vect};
use pliant::element::{CellBlock, simplex_rest};

/// Chord of a solid: from a point on a surface face along the inward normal to where it leaves the solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chord {
    /// Length of the face [m], or its area [m^2].
    pub face: f64,
    /// Length of the line [m].
    pub length: f64,
    /// Number of cells along the chord: the sum over the crossed elements of the chord's length in each,
    /// divided by the element's extent along it. In a grid this is the number of grid cells, however they
    /// are split.
    pub cells: f64,
}

/// Marks the absence of a neighbour.
const NONE: u32 = u32::MAX;

/// Barycentric coordinates of the start: the chord avoids the diagonals of a regular mesh.
const START: [f64; 3] = [0.347, 0.322, 0.331];

impl Mesh {
    /// Chords from the surface faces of a solid of linear elements, about `most` of them at most, evenly
    /// chosen; chords lost by rounding are omitted. In quadrilaterals and hexahedra a chord leads from
    /// the middle of a side to the middle of the opposite side. Empty unless elements fill the space.
    pub fn chords(&self, most: usize) -> Vec<Chord> {
        if let Some(block) = self.block() {
            return chords_of_cells(self, block, most);
        }
        match (self.dimension, self.element_dimension()) {
            (2, 2) => chords::<2, 3>(self, &self.triangles, most),
            (3, 3) => chords::<3, 4>(self, &self.tetrahedra, most),
            _ => vec![],
        }
    }
}

fn chords<const D: usize, const N: usize>(mesh: &Mesh, cells: &[[u32; N]], most: usize) -> Vec<Chord> {
    let neighbours = neighbours(cells);
    let faces = || {
        let of_element = |(e, across): (usize, &[u32; N])| {
            let open = across.map(|other| other == NONE);
            (0..N).filter(move |i| open[*i]).map(move |i| (e, i))
        };
        neighbours.iter().enumerate().flat_map(of_element)
    };
    let stride = faces().count().div_ceil(most.max(1)).max(1);
    let walk = Walk::<D, N> { mesh, cells, neighbours: &neighbours };
    faces().step_by(stride).filter_map(|(element, face)| walk.chord(element, face)).collect()
}

/// Chords through cells with opposite sides.
fn chords_of_cells(mesh: &Mesh, block: &CellBlock, most: usize) -> Vec<Chord> {
    let cells: Vec<&[u32]> = block.cells().collect();
    let sides = block.kind.sides;
    let key = |(cell, side): (usize, usize)| {
        let mut key: Vec<u32> = sides[side].iter().map(|node| cells[cell][*node]).collect();
        key.sort_unstable();
        key
    };
    let all = || (0..cells.len()).flat_map(|cell| (0..sides.len()).map(move |side| (cell, side)));
    // Cells of each side.
    let mut of_side: HashMap<Vec<u32>, Vec<(usize, usize)>> = HashMap::new();
    all().for_each(|place| of_side.entry(key(place)).or_default().push(place));
    let middle = |(cell, side): (usize, usize)| {
        let nodes = sides[side];
        let mut middle = [0.0; 3];
        for node in nodes {
            let point = mesh.point(cells[cell][*node] as usize);
            middle.iter_mut().zip(point).for_each(|(sum, x)| *sum += x / nodes.len() as f64);
        }
        middle
    };
    let opposite =
        |side: usize| sides.iter().position(|other| other.iter().all(|node| !sides[side].contains(node)));
    // Walk from a boundary side through opposite sides to the other boundary.
    let chord = |start: (usize, usize)| {
        let (mut place, mut count) = (start, 0);
        let nodes = sides[start.1].iter().map(|node| mesh.point(cells[start.0][*node] as usize));
        let face = extent_of_side(&nodes.collect::<Vec<_>>());
        while count < cells.len() {
            count += 1;
            let exit = (place.0, opposite(place.1)?);
            let next = of_side.get(&key(exit))?.iter().find(|(cell, _)| *cell != place.0);
            let Some(next) = next else {
                let length = distance(&middle(start), &middle(exit));
                return Some(Chord { face, length, cells: count as f64 });
            };
            place = *next;
        }
        None
    };
    let open: Vec<(usize, usize)> = all().filter(|place| of_side[&key(*place)].len() == 1).collect();
    let stride = open.len().div_ceil(most.max(1)).max(1);
    open.into_iter().step_by(stride).filter_map(chord).collect()
}

/// Length of an edge, or area of a quadrilateral from its diagonals.
fn extent_of_side(nodes: &[&[f64]]) -> f64 {
    let between = |a: usize, b: usize| {
        let mut edge = [0.0; 3];
        edge.iter_mut().zip(nodes[a]).zip(nodes[b]).for_each(|((edge, a), b)| *edge = b - a);
        edge
    };
    if nodes.len() < 4 {
        return norm(between(0, 1));
    }
    0.5 * norm(cross(&between(0, 2), &between(1, 3)))
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    norm([b[0] - a[0], b[1] - a[1], b[2] - a[2]])
}

fn norm(v: [f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// Neighbour across the face opposite each vertex of each element.
fn neighbours<const N: usize>(cells: &[[u32; N]]) -> Vec<[u32; N]> {
    let face = |i: usize| {
        let mut key = cells[i / N];
        // u32::MAX sorts last: no vertex has this number.
        key[i % N] = u32::MAX;
        key.sort_unstable();
        key
    };
    let mut across = vec![[NONE; N]; cells.len()];
    for_each_equal(N * cells.len(), face, |run| {
        for pair in run.windows(2) {
            let (a, b) = (pair[0] as usize, pair[1] as usize);
            (across[a / N][a % N], across[b / N][b % N]) = ((b / N) as u32, (a / N) as u32);
        }
    });
    across
}

/// Traces chords through the elements of a mesh.
struct Walk<'a, const D: usize, const N: usize> {
    mesh: &'a Mesh,
    cells: &'a [[u32; N]],
    neighbours: &'a [[u32; N]],
}

impl<const D: usize, const N: usize> Walk<'_, D, N> {
    /// Chord from this face of an element; `None` if rounding misleads the walk.
    fn chord(&self, mut element: usize, face: usize) -> Option<Chord> {
        let mut nodes = self.mesh.nodes::<D, N>(&self.cells[element]);
        let slopes = slopes(&nodes);
        // The barycentric coordinate of the vertex opposite a face grows inwards, from 0 to 1 over the
        // height.
        let steepness = slopes[face].iter().map(|c| c * c).sum::<f64>().sqrt();
        let direction = slopes[face].map(|c| c / steepness);
        let volume = simplex_rest(&nodes).1.abs();
        let corners = (0..N).filter(|i| *i != face).map(|i| nodes[i]);
        let total: f64 = START[..D].iter().sum();
        let mut place = [0.0; D];
        for (corner, share) in corners.zip(START) {
            (0..D).for_each(|c| place[c] += share / total * corner[c]);
        }
        let mut chord = Chord { face: D as f64 * volume * steepness, length: 0.0, cells: 0.0 };
        let mut entry = face;
        for _ in 0..self.cells.len() {
            let (length, exit) = leave(&nodes, &place, &direction, entry)?;
            chord.length += length;
            chord.cells += length / extent(&nodes, &direction);
            (0..D).for_each(|c| place[c] += length * direction[c]);
            let next = self.neighbours[element][exit];
            if next == NONE {
                return chord.cells.is_finite().then_some(chord);
            }
            let back = element as u32;
            element = next as usize;
            entry = self.neighbours[element].iter().position(|other| *other == back)?;
            nodes = self.mesh.nodes::<D, N>(&self.cells[element]);
        }
        None
    }
}

/// Gradients of the barycentric coordinates.
fn slopes<const D: usize, const N: usize>(nodes: &[[f64; D]; N]) -> [Vect<f64, D>; N] {
    let inverse: Mat<f64, D> = simplex_rest(nodes).0;
    let mut slopes = [[0.0; D]; N];
    for a in 0..D {
        slopes[a + 1] = inverse[a];
        (0..D).for_each(|c| slopes[0][c] -= inverse[a][c]);
    }
    slopes
}

/// Distance from `place` along `direction` to the face where it leaves the element, and the index of the
/// opposite vertex.
fn leave<const D: usize, const N: usize>(
    nodes: &[[f64; D]; N],
    place: &[f64; D],
    direction: &[f64; D],
    entry: usize,
) -> Option<(f64, usize)> {
    let slopes = slopes(nodes);
    let along =
        |slope: &[f64; D], vector: &[f64; D]| slope.iter().zip(vector).map(|(s, v)| s * v).sum::<f64>();
    let mut first: Option<(f64, usize)> = None;
    for i in (0..N).filter(|i| *i != entry) {
        let rate = along(&slopes[i], direction);
        // Any other vertex lies on the face.
        let from = nodes[usize::from(i == 0)];
        let mut offset = [0.0; D];
        (0..D).for_each(|c| offset[c] = place[c] - from[c]);
        let length = (along(&slopes[i], &offset) / -rate).max(0.0);
        if rate < 0.0 && first.is_none_or(|(least, _)| length < least) {
            first = Some((length, i));
        }
    }
    first
}

/// Extent of the element along a direction.
fn extent<const D: usize, const N: usize>(nodes: &[[f64; D]; N], direction: &[f64; D]) -> f64 {
    let along = nodes.map(|x| (0..D).map(|c| x[c] * direction[c]).sum::<f64>());
    along.iter().fold(f64::NEG_INFINITY, |m, x| m.max(*x))
        - along.iter().fold(f64::INFINITY, |m, x| m.min(*x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build;

    fn mesh(dimension: usize, spec: serde_json::Value) -> Mesh {
        build(&serde_json::from_value(spec).unwrap(), dimension, ".".as_ref()).unwrap()
    }

    /// In a grid every chord is an edge of the box and counts the grid's cells, however they are split.
    #[test]
    fn chords_of_boxes_are_their_edges_and_cross_their_cells() {
        let boxes = [(vec![5, 3], vec![2.0, 0.3]), (vec![3, 4, 2], vec![1.0, 0.2, 0.5])];
        for ((cells, size), whole) in boxes.into_iter().flat_map(|of| [(of.clone(), false), (of, true)]) {
            let d = cells.len();
            let mut grid = serde_json::json!({ "cells": cells, "size": size });
            if whole {
                grid["element"] = serde_json::json!(if d == 2 { "quadrilateral" } else { "hexahedron" });
            }
            let mesh = mesh(d, serde_json::json!({ "grid": grid }));
            let chords = mesh.chords(usize::MAX);
            let volume: f64 = size.iter().product();
            for axis in 0..d {
                let along = chords.iter().filter(|chord| (chord.length - size[axis]).abs() < 1e-12);
                let along: Vec<&Chord> = along.collect();
                let faces: f64 = along.iter().map(|chord| chord.face).sum();
                assert!((faces - 2.0 * volume / size[axis]).abs() < 1e-12, "{d}D, axis {axis}: {faces}");
                let expected = cells[axis] as f64;
                assert!(along.iter().all(|chord| (chord.cells - expected).abs() < 1e-12), "{along:?}");
            }
            if !whole {
                assert_eq!(chords.len(), mesh.faces_count());
            }
            assert!(mesh.chords(7).len() <= 7);
        }
    }

    /// Chords of a ring are its radii; its straight sides rotate the normals a little.
    #[test]
    fn chords_of_a_ring_are_its_width() {
        let ring = mesh(
            2,
            serde_json::json!({ "annulus": { "inner_radius": 0.9, "outer_radius": 1.0, "cells": [3, 96] } }),
        );
        let chords = ring.chords(usize::MAX);
        assert_eq!(chords.len(), 2 * 96);
        for chord in chords {
            assert!(
                (chord.length / 0.1 - 1.0).abs() < 0.02 && (2.8..3.3).contains(&chord.cells),
                "{chord:?}"
            );
        }
    }

    impl Mesh {
        fn faces_count(&self) -> usize {
            if self.dimension == 2 { self.boundary_edges().len() } else { self.surface_triangles().len() }
        }
    }
}
