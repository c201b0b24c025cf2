//! A solid compared with the surface that it was made from.

use rayon::prelude::*;
use serde::Serialize;

use super::exact::squared_distance;
use super::tree::{self, BoxCorners, BoxTree};
use crate::Mesh;
use crate::geometry::{cross, dot, subtract};

/// Comparison of a solid with the surface that it was made from, both in the reference configuration.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SurfaceReport {
    /// Number of triangles of the surface.
    pub triangles: usize,
    /// Number of vertices of the surface.
    pub vertices: usize,
    /// Volume enclosed by the surface [m^3].
    pub volume: f64,
    /// Volume of the solid [m^3].
    pub solid_volume: f64,
    /// True if the boundary of the solid lies on the surface; false for whole cubes.
    pub fitted: bool,
    /// Smallest and largest angle between two faces of an element [degree]; `None` for whole cubes.
    pub dihedral: Option<[f64; 2]>,
    /// Largest distance of a vertex of the surface from the boundary of the solid [m].
    pub distance: f64,
}

impl Mesh {
    /// Compares a solid with the surface that it was made from; `None` for other meshes.
    pub fn surface_report(&self) -> Option<SurfaceReport> {
        let skin = self.skin.as_ref()?;
        let points = self.skin_points();
        let boundary: Vec<[[f64; 3]; 3]> =
            self.surface_triangles().iter().map(|triangle| self.nodes::<3, 3>(triangle)).collect();
        let boxes: Vec<BoxCorners> = boundary.iter().map(|corners| tree::around(*corners)).collect();
        let tree = BoxTree::new(&boxes);
        let from_boundary = |point: &[f64; 3]| {
            let found = tree.nearest(point, |i| squared_distance(&boundary[i as usize], point));
            found.map_or(0.0, |(_, square)| square)
        };
        let farthest = points.par_iter().map(from_boundary).reduce(|| 0.0, f64::max);
        let [low, high] = tree::around(points.iter().copied());
        let middle = [0, 1, 2].map(|c| 0.5 * (low[c] + high[c]));
        let below = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|v| subtract(points[v as usize], middle));
            dot(a, cross(b, c)) / 6.0
        };
        Some(SurfaceReport {
            triangles: skin.triangles.len(),
            vertices: points.len(),
            volume: skin.triangles.iter().map(below).sum(),
            solid_volume: self.quality().elements.map_or(0.0, |elements| elements.total_volume),
            fitted: self.block().is_none(),
            dihedral: self.dihedral_angles(),
            distance: farthest.sqrt(),
        })
    }

    /// Smallest and largest angle between two faces of a tetrahedron [degree]; `None` without tetrahedra.
    fn dihedral_angles(&self) -> Option<[f64; 2]> {
        let of_cell = |cell: &[u32; 4]| {
            let x = self.nodes::<3, 4>(cell);
            let angle = |[a, b, c, d]: [usize; 4]| {
                // Angle between the planes of `a b c` and `a b d`, about the edge `a b`.
                let along = subtract(x[b], x[a]);
                let [left, right] = [c, d].map(|end| cross(along, subtract(x[end], x[a])));
                let sine = cross(left, right);
                dot(sine, sine).sqrt().atan2(dot(left, right)).to_degrees()
            };
            let edges = [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]];
            edges
                .map(angle)
                .into_iter()
                .fold([180.0_f64, 0.0_f64], |[low, high], a| [low.min(a), high.max(a)])
        };
        let both = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        self.tetrahedra.par_iter().map(of_cell).reduce_with(both)
    }
}
