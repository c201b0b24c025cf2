//! A beam whose height changes along its length. The default is the tapered membrane of test FV32 of NAFEMS,
//! "Selected benchmarks for natural frequency analysis" (1987).

use super::build::{at_least_one, positive};
use super::cooks_membrane::plane;
use super::{Mesh, MeshError, MeshSize, mapped};
use crate::spec::TaperedBeamSpec;

/// Counts of the beam.
pub(super) fn size(spec: &TaperedBeamSpec, dimension: usize) -> Result<MeshSize, MeshError> {
    plane("tapered_beam", dimension)?;
    spec.cells.iter().try_for_each(|&count| at_least_one("cells", count))?;
    mapped::size(spec.cells, spec.element)
}

/// Builds the beam from `x = 0` to `length`, symmetric about `y = 0`, with the height linear between the
/// two of `heights`.
pub(super) fn build(spec: &TaperedBeamSpec, dimension: usize) -> Result<Mesh, MeshError> {
    size(spec, dimension)?;
    positive("length", spec.length)?;
    spec.heights.iter().try_for_each(|&height| positive("heights", height))?;
    let [n0, n1] = spec.cells.map(|count| count as f64);
    let [start, end] = spec.heights;
    mapped::build((spec.cells, spec.element), ["left", "right", "bottom", "top"], |i, j| {
        let (a, b) = (i as f64 / n0, j as f64 / n1);
        [spec.length * a, (2.0 * b - 1.0) * 0.5 * (start * (1.0 - a) + end * a)]
    })
}
