//! The surface of a ball.

use super::build::{at_least_one, positive, vector};
use super::icosahedron::{FACES, Shells};
use super::tube::solid;
use super::{Mesh, MeshError, MeshSize};
use crate::spec::SphereSpec;

/// Counts of the surface.
pub(super) fn size(spec: &SphereSpec, dimension: usize) -> Result<MeshSize, MeshError> {
    solid("sphere", dimension)?;
    at_least_one("cells", spec.cells)?;
    let square = (spec.cells as u64).saturating_mul(spec.cells as u64);
    MeshSize {
        vertices: square.saturating_mul(10).saturating_add(2),
        triangles: square.saturating_mul(20),
        ..MeshSize::default()
    }
    .checked(dimension)
}

/// Builds the sphere: each of the 20 faces of an icosahedron is divided into `cells^2` triangles and
/// projected to the sphere. Triangles are counter-clockwise seen from outside.
pub(super) fn build(spec: &SphereSpec, dimension: usize) -> Result<Mesh, MeshError> {
    let size = size(spec, dimension)?;
    positive("radius", spec.radius)?;
    let centre = spec.centre.clone().unwrap_or_else(|| vec![0.0; 3]);
    vector("centre", &centre, 3)?;
    let mut mesh = Mesh { dimension, ..Mesh::default() };
    size.reserve(&mut mesh.triangles, size.triangles)?;
    let (mut shells, n) = (Shells::default(), spec.cells);
    size.reserve(&mut shells.points, size.vertices * 3)?;
    for face in FACES {
        // Weights (n - p, p - q, q) with n >= p >= q >= 0.
        let mut at = |p: usize, q: usize| shells.point(face, [n - p, p - q, q], n);
        for p in 0..n {
            for q in 0..=p {
                mesh.triangles.push([at(p, q), at(p + 1, q), at(p + 1, q + 1)]);
                if q < p {
                    mesh.triangles.push([at(p, q), at(p + 1, q + 1), at(p, q + 1)]);
                }
            }
        }
    }
    let points = &shells.points;
    let x = |vertex: u32| [0, 1, 2].map(|axis| points[3 * vertex as usize + axis]);
    mesh.triangles.iter_mut().filter(|cell| inwards(cell.map(x))).for_each(|cell| cell.swap(1, 2));
    mesh.points = placed(&shells.points, spec.radius, &centre);
    Ok(mesh)
}

/// True if a triangle is clockwise seen from outside, on a surface about the origin.
fn inwards([a, b, c]: [[f64; 3]; 3]) -> bool {
    let determinant = a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0]);
    determinant < 0.0
}

/// Maps points of the unit ball to the ball with this radius and centre.
pub(super) fn placed(points: &[f64], radius: f64, centre: &[f64]) -> Vec<f64> {
    points.iter().enumerate().map(|(i, x)| centre[i % 3] + radius * x).collect()
}
