//! A plane ring.

use super::build::{at_least_one, positive, vector};
use super::cooks_membrane::plane;
use super::mapped::{add_lines, with_cells};
use super::{Mesh, MeshError, MeshSize, turn};
use crate::spec::{AnnulusSpec, WholeCell};
use pliant::element::CellBlock;

/// Smallest number of cells around the ring.
const LEAST_AROUND: usize = 3;

/// Counts of the ring.
pub(super) fn size(spec: &AnnulusSpec, dimension: usize) -> Result<MeshSize, MeshError> {
    plane("annulus", dimension)?;
    counts(spec.cells, spec.element)?.checked(2)
}

/// Counts of a ring; the bytes are not filled in.
pub(super) fn counts(cells: [usize; 2], element: Option<WholeCell>) -> Result<MeshSize, MeshError> {
    let [radial, around] = cells;
    at_least_one("cells", radial)?;
    if around < LEAST_AROUND {
        return Err(MeshError::TooFew { field: "cells", count: around, least: LEAST_AROUND });
    }
    let [radial, around] = [radial as u64, around as u64];
    let size = MeshSize {
        vertices: radial.saturating_add(1).saturating_mul(around),
        lines: around.saturating_mul(2),
        ..MeshSize::default()
    };
    with_cells(size, radial.saturating_mul(around), element)
}

/// Builds the ring about `centre`, by default the origin.
pub(super) fn build(spec: &AnnulusSpec, dimension: usize) -> Result<Mesh, MeshError> {
    size(spec, dimension)?;
    let centre = spec.centre.clone().unwrap_or_else(|| vec![0.0; 2]);
    vector("centre", &centre, 2)?;
    ring([spec.inner_radius, spec.outer_radius], (spec.cells, spec.element), [centre[0], centre[1]])
}

/// Vertex `(i, j)`, `i` outwards and `j` counter-clockwise from the positive x-axis, has index `j (n0 + 1) +
/// i`.
pub(super) fn ring(
    radii: [f64; 2],
    (cells, element): ([usize; 2], Option<WholeCell>),
    centre: [f64; 2],
) -> Result<Mesh, MeshError> {
    let size = counts(cells, element)?.checked(2)?;
    let [inner, outer] = radii;
    positive("inner_radius", inner)?;
    positive("outer_radius", outer)?;
    if inner >= outer {
        let (field, other) = ("inner_radius", "outer_radius");
        return Err(MeshError::NotLess { field, value: inner, other, bound: outer });
    }
    let [n0, n1] = cells;
    let mut mesh = Mesh { dimension: 2, ..Mesh::default() };
    size.reserve(&mut mesh.points, size.vertices * 2)?;
    size.reserve(&mut mesh.triangles, size.triangles)?;
    let index = |i: usize, j: usize| ((j % n1) * (n0 + 1) + i) as u32;
    for j in 0..n1 {
        let direction = turn::of_fraction(j, n1);
        for i in 0..=n0 {
            let a = i as f64 / n0 as f64;
            let radius = inner * (1.0 - a) + outer * a;
            mesh.points.extend([0, 1].map(|axis| centre[axis] + radius * direction[axis]));
        }
    }
    let mut vertices = vec![];
    size.reserve(&mut vertices, size.blocks * size.block_nodes)?;
    for j in 0..n1 {
        for i in 0..n0 {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            if element.is_some() {
                vertices.extend([a, b, c, d]);
            } else {
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    if let Some(element) = element {
        mesh.blocks.push(CellBlock { kind: element.kind(), vertices });
    }
    add_lines(&mut mesh, "outer", (0..n1).map(|j| [index(n0, j), index(n0, j + 1)]));
    add_lines(&mut mesh, "inner", (0..n1).rev().map(|j| [index(0, j + 1), index(0, j)]));
    Ok(mesh)
}
