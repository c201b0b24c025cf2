//! A quarter of an elliptic ring. The default is that of test LE1 of NAFEMS, "The standard NAFEMS benchmarks"
//! (1990).

use super::build::{at_least_one, positive};
use super::cooks_membrane::plane;
use super::{Mesh, MeshError, MeshSize, mapped, turn};
use crate::spec::EllipticMembraneSpec;

/// Counts of the membrane.
pub(super) fn size(spec: &EllipticMembraneSpec, dimension: usize) -> Result<MeshSize, MeshError> {
    plane("elliptic_membrane", dimension)?;
    spec.cells.iter().try_for_each(|&count| at_least_one("cells", count))?;
    mapped::size(spec.cells, spec.element)
}

/// Builds the membrane. With `a = i/n0` and `t = (pi/2) j/n1`, vertex `(i, j)` lies at
/// `(A cos t, B sin t)`; the semi-axes `(A, B)` are linear in `a` from `inner` to `outer`.
pub(super) fn build(spec: &EllipticMembraneSpec, dimension: usize) -> Result<Mesh, MeshError> {
    size(spec, dimension)?;
    for axis in 0..2 {
        positive("inner", spec.inner[axis])?;
        positive("outer", spec.outer[axis])?;
        if spec.inner[axis] >= spec.outer[axis] {
            let (value, bound) = (spec.inner[axis], spec.outer[axis]);
            return Err(MeshError::NotLess { field: "inner", value, other: "outer", bound });
        }
    }
    mapped::build((spec.cells, spec.element), ["inner", "outer", "bottom", "left"], |i, j| {
        point(spec, [i, j], 1)
    })
}

/// Moves the middle of every edge to its place between the ellipses of its ends, halfway between their
/// angles. Vertices are numbered as [`build`] does.
pub(super) fn curve(spec: &EllipticMembraneSpec, mesh: &mut Mesh) {
    let row = spec.cells[1] + 1;
    for (ends, middle) in mesh.middles() {
        let [a, b] = ends.map(|end| [end as usize / row, end as usize % row]);
        let place = point(spec, [a[0] + b[0], a[1] + b[1]], 2);
        mesh.points[middle as usize * 2..][..2].copy_from_slice(&place);
    }
}

/// Returns the point `(i, j)` of the lattice with `parts` points in each cell and direction.
fn point(spec: &EllipticMembraneSpec, [i, j]: [usize; 2], parts: usize) -> [f64; 2] {
    let [n0, n1] = spec.cells;
    let a = i as f64 / (parts * n0) as f64;
    let direction = turn::of_fraction(j, n1.saturating_mul(4 * parts));
    // Adding 0.0 removes the sign of -0, the cosine at the end of the quarter.
    [0, 1].map(|axis| (spec.inner[axis] * (1.0 - a) + spec.outer[axis] * a) * direction[axis] + 0.0)
}
