//! Cook's membrane: R. D. Cook, "Improved two-dimensional finite element", J. Struct. Div. ASCE 100 (1974)
//! 1851-1863.

use super::build::at_least_one;
use super::{Mesh, MeshError, MeshSize, mapped};
use crate::spec::CooksMembraneSpec;

/// Counts of the membrane.
pub(super) fn size(spec: &CooksMembraneSpec, dimension: usize) -> Result<MeshSize, MeshError> {
    plane("cooks_membrane", dimension)?;
    spec.cells.iter().try_for_each(|&count| at_least_one("cells", count))?;
    mapped::size(spec.cells, spec.element)
}

/// Rejects a plane shape in a 3D scene.
pub(super) fn plane(shape: &'static str, dimension: usize) -> Result<(), MeshError> {
    if dimension == 2 { Ok(()) } else { Err(MeshError::ShapeDimension { shape, dimension: 2 }) }
}

/// Builds the membrane with corners (0, 0), (48, 44), (48, 60), (0, 44). With `a = i/n0` and `b = j/n1`,
/// vertex `(i, j)` lies at `(48 a, 44 a (1 - b) + (44 + 16 a) b)`.
pub(super) fn build(spec: &CooksMembraneSpec, dimension: usize) -> Result<Mesh, MeshError> {
    size(spec, dimension)?;
    let [n0, n1] = spec.cells.map(|count| count as f64);
    mapped::build((spec.cells, spec.element), ["left", "right", "bottom", "top"], |i, j| {
        let (a, b) = (i as f64 / n0, j as f64 / n1);
        [48.0 * a, 44.0 * a * (1.0 - b) + (44.0 + 16.0 * a) * b]
    })
}
