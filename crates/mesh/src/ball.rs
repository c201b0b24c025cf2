//! A solid ball.

use super::build::{at_least_one, positive, vector};
use super::geometry::measure;
use super::icosahedron::{FACES, Shells};
use super::mapped::add_triangles;
use super::sphere::placed;
use super::tube::solid;
use super::{Mesh, MeshError, MeshSize};
use crate::spec::BallSpec;

/// The six orders of the axes: each gives one tetrahedron of a cell (Kuhn's split).
const PATHS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// Counts of the ball.
pub(super) fn size(spec: &BallSpec, dimension: usize) -> Result<MeshSize, MeshError> {
    solid("ball", dimension)?;
    at_least_one("cells", spec.cells)?;
    let n = spec.cells as u64;
    let square = n.saturating_mul(n);
    let tetrahedra = square.saturating_mul(n).saturating_mul(20);
    // The centre and shells of 10 k^2 + 2: 1 + 10 n (n + 1) (2 n + 1) / 6 + 2 n.
    let sum = n.saturating_mul(n.saturating_add(1)).saturating_mul(n.saturating_mul(2).saturating_add(1)) / 6;
    let vertices = sum.saturating_mul(10).saturating_add(n.saturating_mul(2)).saturating_add(1);
    MeshSize { vertices, triangles: square.saturating_mul(20), tetrahedra, ..MeshSize::default() }.checked(3)
}

/// Builds a ball: the 20 tetrahedra between the centre and the faces of an icosahedron, each divided into
/// `cells^3`, with every shell projected to a sphere. The boundary is the group `surface`.
pub(super) fn build(spec: &BallSpec, dimension: usize) -> Result<Mesh, MeshError> {
    let size = size(spec, dimension)?;
    positive("radius", spec.radius)?;
    let centre = spec.centre.clone().unwrap_or_else(|| vec![0.0; 3]);
    vector("centre", &centre, 3)?;
    let mut mesh = Mesh { dimension, ..Mesh::default() };
    size.reserve(&mut mesh.tetrahedra, size.tetrahedra)?;
    let (mut shells, n) = (Shells::default(), spec.cells);
    size.reserve(&mut shells.points, size.vertices * 3)?;
    for face in FACES {
        // In the coordinates n >= p >= q >= r >= 0, with weights (p - q, q - r, r) on shell p, the
        // tetrahedron is a corner of a cube, and Kuhn's split of the cells respects it.
        for p in 0..n {
            for q in 0..=p {
                for r in 0..=q {
                    for path in PATHS {
                        let mut corner = [p, q, r];
                        let mut corners = [corner; 4];
                        for (step, axis) in path.into_iter().enumerate() {
                            corner[axis] += 1;
                            corners[step + 1] = corner;
                        }
                        if corners.iter().all(|[p, q, r]| p >= q && q >= r) {
                            let vertex = |[p, q, r]: [usize; 3]| shells.point(face, [p - q, q - r, r], n);
                            mesh.tetrahedra.push(corners.map(vertex));
                        }
                    }
                }
            }
        }
    }
    let points = &shells.points;
    let left = |cell: &&mut [u32; 4]| measure(points, 3, **cell).relative < 0.0;
    mesh.tetrahedra.iter_mut().filter(left).for_each(|cell| cell.swap(2, 3));
    mesh.points = placed(&shells.points, spec.radius, &centre);
    let surface = mesh.surface_triangles();
    add_triangles(&mut mesh, "surface", surface.into_iter());
    Ok(mesh)
}
