//! Checked closed surfaces.

use rayon::prelude::*;

use super::error::SurfaceError;
use super::exact::{Corners, meeting, pierces, squared_distance};
use super::inside::{GridAxes, windings};
use super::tree::{self, BoxCorners, BoxTree};
use crate::facets::for_each_equal;
use crate::geometry::{cross, dot, subtract};
use crate::{Mesh, MeshError};
use pliant::topology::DisjointSets;

/// A closed surface of triangles, counter-clockwise seen from outside.
pub(super) struct ClosedSurface {
    /// Vertices [m], without unused ones.
    pub(super) points: Vec<[f64; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Names and triangles of the file's triangle groups.
    pub(super) groups: Vec<(String, Vec<u32>)>,
    tree: BoxTree,
}

impl ClosedSurface {
    /// Surface of the triangles of a mesh, or the boundary of its solid cells.
    ///
    /// # Errors
    /// [`SurfaceError::NoTriangles`], an edge that is not shared by triangles in pairs of opposite
    /// directions, a surface that is inside out.
    pub(super) fn new(mesh: &Mesh) -> Result<ClosedSurface, MeshError> {
        let cells = if mesh.element_dimension() > 1 { mesh.surface_triangles() } else { vec![] };
        if cells.is_empty() {
            let found = match mesh.element_dimension() {
                1 => ("edges", mesh.edges.len()),
                _ => ("points", mesh.vertex_count()),
            };
            return Err(SurfaceError::NoTriangles { found: found.0, count: found.1 }.into());
        }
        let is_surface = mesh.element_dimension() == 2;
        let of_triangles =
            mesh.groups.iter().filter(|(_, group)| is_surface && group.topological_dimension == 2);
        let groups = of_triangles.map(|(name, group)| (name.clone(), group.cells.clone())).collect();
        let mut used = cells.as_flattened().to_vec();
        used.sort_unstable();
        used.dedup();
        let number = |v: u32| used.partition_point(|other| *other < v) as u32;
        let triangles: Vec<[u32; 3]> = cells.iter().map(|cell| cell.map(number)).collect();
        let points: Vec<[f64; 3]> = used.iter().map(|v| mesh.nodes::<3, 1>(&[*v])[0]).collect();
        check_edges(&triangles, &points)?;
        let boxes: Vec<BoxCorners> =
            triangles.iter().map(|t| tree::around(t.map(|v| points[v as usize]))).collect();
        let surface = ClosedSurface { points, triangles, groups, tree: BoxTree::new(&boxes) };
        let volume = surface.volume();
        if volume <= 0.0 || volume.is_nan() {
            return Err(SurfaceError::InsideOut { volume }.into());
        }
        Ok(surface)
    }

    /// Corners of a triangle.
    pub(super) fn corners(&self, triangle: usize) -> Corners {
        self.triangles[triangle].map(|v| self.points[v as usize])
    }

    /// Centroid of a triangle.
    pub(super) fn middle(&self, triangle: usize) -> [f64; 3] {
        let [a, b, c] = self.corners(triangle);
        [0, 1, 2].map(|i| (a[i] + b[i] + c[i]) / 3.0)
    }

    /// Lower and upper corner of the bounding box [m].
    pub(super) fn bounds(&self) -> BoxCorners {
        tree::around(self.points.iter().copied())
    }

    /// Enclosed volume [m^3], by the divergence theorem about the centre of the box.
    pub(super) fn volume(&self) -> f64 {
        (0..self.triangles.len()).map(|i| self.volume_below(i)).sum()
    }

    /// Signed volume between a triangle and the centre of the box [m^3].
    fn volume_below(&self, triangle: usize) -> f64 {
        let [low, high] = self.tree.bounds();
        let middle = [0, 1, 2].map(|c| 0.5 * (low[c] + high[c]));
        let [a, b, c] = self.corners(triangle).map(|x| subtract(x, middle));
        dot(a, cross(b, c)) / 6.0
    }

    /// Area [m^2].
    pub(super) fn area(&self) -> f64 {
        let area = |i: usize| {
            let [a, b, c] = self.corners(i);
            let normal = cross(subtract(b, a), subtract(c, a));
            0.5 * dot(normal, normal).sqrt()
        };
        (0..self.triangles.len()).map(area).sum()
    }

    /// Enclosed volumes of the connected pieces [m^3], negative for the boundary of a cavity.
    pub(super) fn pieces(&self) -> Vec<f64> {
        let mut pieces = DisjointSets::new(self.points.len());
        self.triangles.iter().for_each(|triangle| pieces.connect(triangle));
        let (of_vertex, count) = pieces.numbered();
        let mut volumes = vec![0.0; count];
        for (i, triangle) in self.triangles.iter().enumerate() {
            volumes[of_vertex[triangle[0] as usize] as usize] += self.volume_below(i);
        }
        volumes
    }

    /// Winding number around each point of a grid.
    pub(super) fn windings(&self, axes: &GridAxes) -> Vec<i16> {
        windings((0..self.triangles.len()).map(|i| self.corners(i)), axes)
    }

    /// Fraction of the segment from a point inside to one outside at which it last meets the surface.
    pub(super) fn exit(&self, inside: &[f64; 3], outside: &[f64; 3]) -> Option<f64> {
        let mut last: Option<f64> = None;
        self.tree.overlapping(&tree::around([*inside, *outside]), |i| {
            let met = meeting(&self.corners(i as usize), inside, outside);
            last = last.into_iter().chain(met).reduce(f64::max);
        });
        last
    }

    /// Distance from the centroid of a triangle inwards along its normal to the opposite side [m].
    pub(super) fn thickness(&self, triangle: usize) -> Option<f64> {
        let [a, b, c] = self.corners(triangle);
        let normal = cross(subtract(b, a), subtract(c, a));
        let size = dot(normal, normal).sqrt();
        let [low, high] = self.bounds();
        let reach = dot(subtract(high, low), subtract(high, low)).sqrt();
        let middle = self.middle(triangle);
        let end = [0, 1, 2].map(|i| middle[i] - reach * normal[i] / size);
        let mut first: Option<f64> = None;
        self.tree.overlapping(&tree::around([middle, end]), |i| {
            let met = meeting(&self.corners(i as usize), &middle, &end).filter(|_| i as usize != triangle);
            first = first.into_iter().chain(met).reduce(f64::min);
        });
        first.map(|share| share * reach)
    }

    /// Triangle nearest to a point, and its squared distance [m^2].
    pub(super) fn nearest(&self, point: &[f64; 3]) -> Option<(u32, f64)> {
        self.tree.nearest(point, |i| squared_distance(&self.corners(i as usize), point))
    }

    /// Checks that no two triangles intersect.
    ///
    /// # Errors
    /// [`SurfaceError::Crossing`] with the first pair.
    pub(super) fn check_crossings(&self) -> Result<(), SurfaceError> {
        let crossed = |i: usize| {
            let corners = self.corners(i);
            let mut others = vec![];
            self.tree.overlapping(&tree::around(corners), |j| {
                if (j as usize) > i && self.cross(i, j as usize) {
                    others.push(j);
                }
            });
            others.sort_unstable();
            others
        };
        let crossings: Vec<Vec<u32>> = (0..self.triangles.len()).into_par_iter().map(crossed).collect();
        let count = crossings.iter().map(Vec::len).sum();
        let first = crossings.iter().enumerate().find_map(|(i, others)| Some((i, *others.first()?)));
        match first {
            None => Ok(()),
            Some((i, other)) => {
                Err(SurfaceError::Crossing { triangles: [i, other as usize], count, place: self.middle(i) })
            }
        }
    }

    /// True if an edge of one of two triangles pierces the interior of the other.
    fn cross(&self, i: usize, j: usize) -> bool {
        let pierced = |a: usize, b: usize| {
            let (own, other) = (self.triangles[a], self.triangles[b]);
            (0..3).any(|k| {
                let ends = [own[k], own[(k + 1) % 3]];
                // An edge with a vertex of the other triangle does not pierce it.
                let apart = ends.iter().all(|v| !other.contains(v));
                let [p, q] = ends.map(|v| self.points[v as usize]);
                apart && pierces(&self.corners(b), &p, &q)
            })
        };
        pierced(i, j) || pierced(j, i)
    }
}

/// Checks that every edge has equally many triangles in both directions.
fn check_edges(triangles: &[[u32; 3]], points: &[[f64; 3]]) -> Result<(), SurfaceError> {
    let ends = |i: usize| [triangles[i / 3][i % 3], triangles[i / 3][(i + 1) % 3]];
    let sorted = |i: usize| {
        let [a, b] = ends(i);
        [a.min(b), a.max(b)]
    };
    // Number of edges with one triangle and the first of them; first edge whose triangles do not pair up.
    let (mut open, mut first_open, mut first_odd): (usize, Option<usize>, Option<(usize, usize)>) =
        (0, None, None);
    for_each_equal(3 * triangles.len(), sorted, |run| {
        let side = run[0] as usize;
        let forward = run.iter().filter(|i| ends(**i as usize) == sorted(side)).count();
        if run.len() == 1 {
            open += 1;
            first_open = Some(first_open.map_or(side, |first| first.min(side)));
        } else if 2 * forward != run.len() && first_odd.is_none_or(|(first, _)| side < first) {
            first_odd = Some((side, run.len()));
        }
    });
    let place = |side: usize| {
        let [a, b] = ends(side).map(|v| points[v as usize]);
        [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]))
    };
    match (first_open, first_odd) {
        (Some(side), _) => {
            Err(SurfaceError::Open { triangle: side / 3, edge: ends(side), place: place(side), count: open })
        }
        (None, Some((side, 2))) => {
            Err(SurfaceError::OppositeSides { triangle: side / 3, edge: ends(side), place: place(side) })
        }
        (None, Some((side, count))) => {
            Err(SurfaceError::OddEdge { triangle: side / 3, edge: ends(side), place: place(side), count })
        }
        (None, None) => Ok(()),
    }
}
