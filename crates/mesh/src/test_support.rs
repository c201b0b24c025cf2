//! Shortcuts for building test meshes.

use std::path::Path;

use super::{Mesh, MeshError, build};
use crate::spec::{GridSpec, InlineSpec, MeshSpec};

/// Grid at the origin.
pub(crate) fn grid(cells: &[usize], spacing: f64) -> GridSpec {
    GridSpec { cells: cells.to_vec(), spacing: Some(spacing), ..GridSpec::default() }
}

pub(crate) fn build_grid(spec: &GridSpec, dimension: usize) -> Result<Mesh, MeshError> {
    build(&MeshSpec::Grid(spec.clone()), dimension, Path::new("."))
}

pub(crate) fn build_inline(spec: &InlineSpec, dimension: usize) -> Result<Mesh, MeshError> {
    build(&MeshSpec::Inline(spec.clone()), dimension, Path::new("."))
}

/// Points of the plane or of space.
pub(crate) fn points<const D: usize>(points: &[[f64; D]]) -> Vec<Vec<f64>> {
    points.iter().map(|p| p.to_vec()).collect()
}
