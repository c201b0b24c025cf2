//! Construction of a checked mesh from the `mesh` table of a scene.

use std::path::Path;

use super::{
    Mesh, MeshError, annulus, ball, check::check, cloth, cooks_membrane, curved, cylinder, disk,
    elliptic_membrane, file, grid, inline, notched_beam, predicted_size, refine, repeat, sphere, strand,
    surface, tapered_beam, transform, tube,
};
use crate::spec::{BodyMesh, CellOrder, MeshSpec};
use pliant::element::CellBlock;

/// Builds the mesh that `spec` describes, `dimension` 2 or 3, and checks it.
///
/// `base` is the directory for relative paths of mesh files: that of the scene file.
///
/// ```
/// use std::path::Path;
///
/// let spec = serde_json::from_str(r#"{ "grid": { "cells": [4, 2], "spacing": 0.1 } }"#)?;
/// let mesh = pliant_mesh::build(&spec, 2, Path::new("."))?;
/// assert_eq!((mesh.vertex_count(), mesh.element_count(), mesh.point(14)), (15, 16, &[0.4, 0.2][..]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// The specification, the file or the mesh is unusable; see [`MeshError`].
pub fn build(spec: &MeshSpec, dimension: usize, base: &Path) -> Result<Mesh, MeshError> {
    build_shape(spec, dimension, base, false)
}

fn build_shape(
    spec: &MeshSpec,
    dimension: usize,
    base: &Path,
    keep_mid_nodes: bool,
) -> Result<Mesh, MeshError> {
    let size = predicted_size(spec, dimension, base)?;
    if !matches!(spec, MeshSpec::File(_)) {
        // The prediction for a file is far above the real need; the file's own size bounds it well
        // enough.
        size.probe()?;
    }
    let mesh = match spec {
        MeshSpec::Grid(spec) => grid::build(spec, dimension)?,
        MeshSpec::Cloth(spec) => cloth::build(spec, dimension)?,
        MeshSpec::Strand(spec) => strand::build(spec, dimension)?,
        MeshSpec::Disk(spec) => disk::build(spec, dimension)?,
        MeshSpec::Inline(spec) => inline::build(spec, dimension)?,
        MeshSpec::Surface(spec) => surface::build(spec, dimension, base)?,
        MeshSpec::Ball(spec) => ball::build(spec, dimension)?,
        MeshSpec::Sphere(spec) => sphere::build(spec, dimension)?,
        MeshSpec::Cylinder(spec) => cylinder::build(spec, dimension)?,
        MeshSpec::Tube(spec) => tube::build(spec, dimension)?,
        MeshSpec::Annulus(spec) => annulus::build(spec, dimension)?,
        MeshSpec::CooksMembrane(spec) => cooks_membrane::build(spec, dimension)?,
        MeshSpec::TaperedBeam(spec) => tapered_beam::build(spec, dimension)?,
        MeshSpec::NotchedBeam(spec) => notched_beam::build(spec, dimension)?,
        MeshSpec::EllipticMembrane(spec) => elliptic_membrane::build(spec, dimension)?,
        // Checked there, where positions in the file are known.
        MeshSpec::File(spec) => return file::build(spec, dimension, base, keep_mid_nodes),
    };
    check(&mesh)?;
    Ok(mesh)
}

/// Builds the mesh of a body: its shape, its cells cut `refine` times, promoted to second order if its order
/// is 2 (both with curved sides for round shapes), then `transform`, then `repeat`.
///
/// # Errors
/// Errors of [`build`]; an impossible transformation or repetition.
pub fn build_body(body: &BodyMesh<'_>, dimension: usize, base: &Path) -> Result<Mesh, MeshError> {
    let mut mesh = build_shape(body.shape, dimension, base, body.order.is_quadratic())?;
    for _ in 0..body.refine {
        mesh = refine::refine(&mesh, |mesh| curved::curve(body.shape, mesh))?;
    }
    if body.refine > 0 {
        check(&mesh)?;
    }
    if body.order.is_quadratic() {
        let serendipity = body.order == CellOrder::Serendipity;
        let count = 7 * mesh.element_count() as u64;
        let fewest =
            |block: &CellBlock| block.kind.of_first_order().and_then(|kind| kind.of_second_order(true));
        match mesh.block() {
            None if serendipity => return Err(MeshError::NoSerendipity),
            Some(block) if serendipity && block.kind.order() == 2 && fewest(block) != Some(block.kind) => {
                return Err(MeshError::LagrangeCells { cells: block.kind.plural });
            }
            _ => {}
        }
        let promoted =
            if serendipity { mesh.promoted_to_serendipity() } else { mesh.promoted_to_quadratic() };
        mesh = promoted.ok_or(MeshError::TooMany { what: "vertices", count })?;
        curved::curve(body.shape, &mut mesh);
        check(&mesh)?;
    }
    if let Some(spec) = body.transform {
        transform::apply(spec, &mut mesh)?;
    }
    if let Some(spec) = body.repeat {
        repeat::apply(spec, &mut mesh)?;
    }
    if body.transform.is_some() || body.repeat.is_some() {
        // Large factors may overflow, very unequal ones may flatten elements.
        check(&mesh)?;
    }
    Ok(mesh)
}

/// Rejects a vector of the wrong length, or with a NaN or an infinity.
pub(super) fn vector(field: &'static str, value: &[f64], dimension: usize) -> Result<(), MeshError> {
    if value.len() != dimension {
        return Err(MeshError::Components { field, expected: dimension, found: value.len() });
    }
    value.iter().try_for_each(|&value| finite(field, value))
}

/// Rejects NaN and infinity.
pub(super) fn finite(field: &'static str, value: f64) -> Result<(), MeshError> {
    if value.is_finite() { Ok(()) } else { Err(MeshError::NotFinite { field, value }) }
}

/// Rejects a number that is not finite and greater than zero.
pub(super) fn positive(field: &'static str, value: f64) -> Result<(), MeshError> {
    finite(field, value)?;
    if value > 0.0 { Ok(()) } else { Err(MeshError::NotPositive { field, value }) }
}

pub(super) fn at_least_one(field: &'static str, count: usize) -> Result<(), MeshError> {
    if count > 0 { Ok(()) } else { Err(MeshError::ZeroCount { field }) }
}
