//! A hollow cylinder.

use super::build::{at_least_one, positive, vector};
use super::{Mesh, MeshError, MeshSize, annulus, extrude};
use crate::spec::TubeSpec;

/// Counts of the tube.
pub(super) fn size(spec: &TubeSpec, dimension: usize) -> Result<MeshSize, MeshError> {
    solid("tube", dimension)?;
    let [radial, around, along] = spec.cells;
    at_least_one("cells", along)?;
    extrude::size(&annulus::counts([radial, around], None)?, along)
}

/// Rejects a solid in the plane.
pub(super) fn solid(shape: &'static str, dimension: usize) -> Result<(), MeshError> {
    if dimension == 3 { Ok(()) } else { Err(MeshError::ShapeDimension { shape, dimension: 3 }) }
}

/// Builds the tube: a ring in the plane `z = origin[2]`, extruded by `height`.
pub(super) fn build(spec: &TubeSpec, dimension: usize) -> Result<Mesh, MeshError> {
    size(spec, dimension)?;
    positive("height", spec.height)?;
    let origin = spec.origin.clone().unwrap_or_else(|| vec![0.0; 3]);
    vector("origin", &origin, 3)?;
    let [radial, around, along] = spec.cells;
    let radii = [spec.inner_radius, spec.outer_radius];
    let base = annulus::ring(radii, ([radial, around], None), [origin[0], origin[1]])?;
    extrude::build(&base, along, origin[2], spec.height)
}
