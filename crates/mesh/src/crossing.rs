//! Detection of surfaces that intersect, by exact arithmetic, independent of the contact code.

use std::collections::BTreeSet;

use pliant::topology::Topology;

use crate::surface::exact::{pierces, turn};

type Point = [f64; 3];

/// Finds pairs of primitives that intersect at the positions `x`, flat [m], and returns the vertices of
/// both. In 3D these are edges and triangles of the surfaces of all bodies, in 2D the edges of their
/// outlines. Pairs with a common vertex and pairs that only touch do not count. Signs of volumes and
/// areas are exact (J. R. Shewchuk, 1997).
pub fn crossings(topology: &Topology, x: &[f64]) -> Vec<(Vec<u32>, Vec<u32>)> {
    let d = topology.dimension;
    let point = |v: u32| -> Point { [0, 1, 2].map(|k| if k < d { x[d * v as usize + k] } else { 0.0 }) };
    let bodies = &topology.bodies;
    // Springs of sheets and solids are not surfaces.
    let thin = bodies.iter().filter(|body| body.triangles.is_empty() && body.surface.is_empty());
    let strands = thin.flat_map(|body| body.edges.iter().copied());
    if d == 2 {
        let edges: Vec<[u32; 2]> =
            bodies.iter().flat_map(|body| outline(&body.triangles)).chain(strands).collect();
        let places: Vec<_> = edges.iter().map(|edge| edge.map(point)).collect();
        let apart = |[i, j]: &[usize; 2]| i < j && !edges[*i].iter().any(|v| edges[*j].contains(v));
        let pairs = overlapping(&places, &places).into_iter().filter(apart);
        let crossing = pairs.filter(|[i, j]| cut(places[*i], places[*j]));
        return crossing.map(|[i, j]| (edges[i].to_vec(), edges[j].to_vec())).collect();
    }
    let triangles: Vec<[u32; 3]> = bodies.iter().flat_map(|body| body.surface.iter().copied()).collect();
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let edges: BTreeSet<[u32; 2]> = sides.chain(strands).map(|[a, b]| [a.min(b), a.max(b)]).collect();
    let edges: Vec<[u32; 2]> = edges.into_iter().collect();
    let segments: Vec<_> = edges.iter().map(|edge| edge.map(point)).collect();
    let places: Vec<_> = triangles.iter().map(|triangle| triangle.map(point)).collect();
    let apart = |[i, j]: &[usize; 2]| !edges[*i].iter().any(|v| triangles[*j].contains(v));
    let pairs = overlapping(&segments, &places).into_iter().filter(apart);
    let crossing = pairs.filter(|[i, j]| pierces(&places[*j], &segments[*i][0], &segments[*i][1]));
    crossing.map(|[i, j]| (edges[i].to_vec(), triangles[j].to_vec())).collect()
}

/// True if two segments in the plane properly intersect.
fn cut([a, b]: [Point; 2], [c, d]: [Point; 2]) -> bool {
    let side = |[a, b, c]: [Point; 3]| turn([a[0], a[1]], [b[0], b[1]], [c[0], c[1]]);
    let opposite = |one: f64, other: f64| one != 0.0 && other != 0.0 && (one > 0.0) != (other > 0.0);
    opposite(side([a, b, c]), side([a, b, d])) && opposite(side([c, d, a]), side([c, d, b]))
}

/// Lower and upper corner of the bounding box of points.
fn bounds(points: &[Point]) -> [Point; 2] {
    let of = |pick: fn(f64, f64) -> f64, start: f64| {
        [0, 1, 2].map(|k| points.iter().fold(start, |m, p| pick(m, p[k])))
    };
    [of(f64::min, f64::INFINITY), of(f64::max, f64::NEG_INFINITY)]
}

/// Index pairs of primitives of two lists whose boxes overlap, by a sweep along the axis in which the
/// second list extends farthest.
fn overlapping<const M: usize, const N: usize>(a: &[[Point; M]], b: &[[Point; N]]) -> Vec<[usize; 2]> {
    let mut boxes: Vec<([Point; 2], usize)> = b.iter().enumerate().map(|(i, p)| (bounds(p), i)).collect();
    let [low, high] = bounds(b.as_flattened());
    let axis = [1, 2].into_iter().fold(0, |m, k| if high[k] - low[k] > high[m] - low[m] { k } else { m });
    boxes.sort_by(|(a, _), (b, _)| a[0][axis].total_cmp(&b[0][axis]));
    let widest = boxes.iter().fold(0.0, |m: f64, ([low, high], _)| m.max(high[axis] - low[axis]));
    let mut found = vec![];
    for (i, points) in a.iter().enumerate() {
        let [low, high] = bounds(points);
        let first = boxes.partition_point(|([other, _], _)| other[axis] < low[axis] - widest);
        let near = boxes[first..].iter().take_while(|([other, _], _)| other[axis] <= high[axis]);
        let meets = near.filter(|([l, h], _)| (0..3).all(|k| l[k] <= high[k] && low[k] <= h[k]));
        found.extend(meets.map(|(_, j)| [i, *j]));
    }
    found
}

/// Edges with a single triangle.
fn outline(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut sides: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    sides.sort_unstable();
    sides.chunk_by(|a, b| a == b).filter(|same| same.len() == 1).map(|same| same[0]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant::topology::{BodyKind, BodyTopology};

    fn body(kind: BodyKind, vertices: std::ops::Range<u32>) -> BodyTopology {
        BodyTopology {
            name: format!("{kind:?}"),
            kind,
            vertices,
            edges: vec![],
            triangles: vec![],
            tetrahedra: vec![],
            triangle_middles: vec![],
            tetrahedron_middles: vec![],
            blocks: vec![],
            surface: vec![],
            skin: None,
        }
    }

    fn of(dimension: usize, bodies: Vec<BodyTopology>, x: &[f64]) -> Vec<(Vec<u32>, Vec<u32>)> {
        let (vertex_count, masses) = (x.len() / dimension, vec![]);
        crossings(&Topology { dimension, vertex_count, rest_positions: x.to_vec(), masses, bodies }, x)
    }

    /// Smaller than double precision volumes and areas can resolve.
    const HAIR: f64 = 1e-200;

    #[test]
    fn a_spike_through_a_sheet_is_seen_and_one_above_it_is_not() {
        let found = |z: f64| {
            let mut sheet = body(BodyKind::Cloth, 0..3);
            sheet.surface = vec![[0, 1, 2]];
            let mut spike = body(BodyKind::Strand, 3..5);
            spike.edges = vec![[3, 4]];
            let x = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.2, 0.2, 1.0, 0.2, 0.2, z];
            of(3, vec![sheet, spike], &x)
        };
        assert_eq!(found(-1.0), [(vec![3, 4], vec![0, 1, 2])]);
        assert_eq!(found(-HAIR).len(), 1);
        assert!(found(HAIR).is_empty() && found(0.5).is_empty());
    }

    #[test]
    fn outlines_that_cut_each_other_in_the_plane_are_seen() {
        let found = |corners: [f64; 8], stroke: [f64; 4]| {
            let mut solid = body(BodyKind::Solid, 0..4);
            solid.triangles = vec![[0, 1, 2], [0, 2, 3]];
            let mut strand = body(BodyKind::Strand, 4..6);
            strand.edges = vec![[4, 5]];
            of(2, vec![solid, strand], &[&corners[..], &stroke[..]].concat())
        };
        let square = [0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0];
        // The diagonal does not belong to the outline.
        assert_eq!(found(square, [0.5, -1.0, 0.5, 0.6]), [(vec![0, 1], vec![4, 5])]);
        assert_eq!(found(square, [0.5, -1.0, 0.5, HAIR]).len(), 1);
        assert!(found(square, [0.5, -1.0, 0.5, -HAIR]).is_empty());
        let diamond = [0.0, -1.0, 1.0, 0.0, 0.0, 1.0, -1.0, 0.0];
        assert_eq!(found(diamond, [0.9, -0.9, 0.4, -0.4]).len(), 1);
        assert!(found(diamond, [0.9, -0.9, 0.6, -0.6]).is_empty(), "it ends before the side");
        assert!(found(diamond, [0.95, -0.6, 1.3, 0.9]).is_empty(), "it passes beside the side");
    }

    #[test]
    fn boxes_are_found_along_every_axis() {
        let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let stroke = |z: f64| [[0.2, 0.2, 1.0], [0.2, 0.2, z]];
        for shift in [[5.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 5.0]] {
            let beside = triangle.map(|p| [0, 1, 2].map(|k| p[k] + shift[k]));
            let found = overlapping(&[stroke(-1.0), stroke(0.5), stroke(-2.0)], &[beside, triangle]);
            assert_eq!(found, [[0, 1], [2, 1]], "{shift:?}");
        }
    }
}
