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
    let [n0, n1] = spec.cells;
    mapped::build((spec.cells, spec.element), ["inner", "outer", "bottom", "left"], |i, j| {
        let a = i as f64 / n0 as f64;
        let direction = turn::of_fraction(j, n1.saturating_mul(4));
        // Adding 0.0 removes the sign of -0, the cosine at the end of the quarter.
        [0, 1].map(|axis| (spec.inner[axis] * (1.0 - a) + spec.outer[axis] * a) * direction[axis] + 0.0)
    })
}
