//! A solid cylinder.

use super::build::{at_least_one, positive, vector};
use super::mapped::add_lines;
use super::tube::solid;
use super::{Mesh, MeshError, MeshSize, extrude, turn};
use crate::spec::CylinderSpec;

/// Counts of the base: one vertex, then rings of 6, 12, 18, ... vertices.
fn base_size(radial: usize) -> MeshSize {
    let n = radial as u64;
    MeshSize {
        vertices: n.saturating_mul(n.saturating_add(1)).saturating_mul(3).saturating_add(1),
        triangles: n.saturating_mul(n).saturating_mul(6),
        lines: n.saturating_mul(6),
        ..MeshSize::default()
    }
}

/// Counts of the cylinder.
pub(super) fn size(spec: &CylinderSpec, dimension: usize) -> Result<MeshSize, MeshError> {
    solid("cylinder", dimension)?;
    spec.cells.iter().try_for_each(|&count| at_least_one("cells", count))?;
    extrude::size(&base_size(spec.cells[0]), spec.cells[1])
}

/// Builds the cylinder: a disk in the plane `z = origin[2]`, extruded by `height`.
pub(super) fn build(spec: &CylinderSpec, dimension: usize) -> Result<Mesh, MeshError> {
    size(spec, dimension)?;
    positive("radius", spec.radius)?;
    positive("height", spec.height)?;
    let origin = spec.origin.clone().unwrap_or_else(|| vec![0.0; 3]);
    vector("origin", &origin, 3)?;
    let base = disk(spec.radius, spec.cells[0], [origin[0], origin[1]]);
    extrude::build(&base, spec.cells[1], origin[2], spec.height)
}

/// Builds a disk of `rings` rings of triangles about the centre, vertex 0. Ring `k` has `6 k` vertices,
/// counter-clockwise from the positive x-axis.
fn disk(radius: f64, rings: usize, centre: [f64; 2]) -> Mesh {
    let mut mesh = Mesh { dimension: 2, points: centre.to_vec(), ..Mesh::default() };
    let index = |k: usize, j: usize| if k == 0 { 0 } else { (1 + 3 * k * (k - 1) + j % (6 * k)) as u32 };
    for k in 1..=rings {
        let radius = radius * (k as f64 / rings as f64);
        for j in 0..6 * k {
            let direction = turn::of_fraction(j, 6 * k);
            mesh.points.extend([0, 1].map(|axis| centre[axis] + radius * direction[axis]));
        }
        for sector in 0..6 {
            let (inner, outer) = (sector * (k - 1), sector * k);
            for m in 0..k {
                let [a, b, c] = [index(k - 1, inner + m), index(k, outer + m), index(k, outer + m + 1)];
                mesh.triangles.push([a, b, c]);
                if m + 1 < k {
                    mesh.triangles.push([a, c, index(k - 1, inner + m + 1)]);
                }
            }
        }
    }
    add_lines(&mut mesh, "side", (0..6 * rings).map(|j| [index(rings, j), index(rings, j + 1)]));
    mesh
}
