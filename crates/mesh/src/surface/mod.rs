//! Solids from closed surfaces: tetrahedra that end on the surface, or whole cubes.
//!
//! # How to add a stencil or a check
//! `closed` checks the surface, `inside` computes exact winding numbers at lattice points, `stuffing` makes
//! tetrahedra, `hexahedra` cubes, `bind` the skin, `report` what `pliant check` prints. Signs come from
//! exact predicates (`exact`), so that an edge from inside to outside always meets the surface. Tests are in
//! `tests.rs`.

mod bind;
mod closed;
mod error;
pub(crate) mod exact;
mod groups;
mod hexahedra;
mod inside;
mod lattice;
mod report;
mod stuffing;
#[cfg(test)]
mod tests;
mod tree;

use std::path::Path;

pub use error::SurfaceError;
pub use report::SurfaceReport;

use crate::build::positive;
use crate::facets::for_each_equal;
use crate::file::{self, SurfaceFile};
use crate::spec::{SolidElement, SurfaceSpec};
use crate::{Mesh, MeshError, MeshSize};
use closed::ClosedSurface;
use lattice::CubicLattice;
use pliant::topology::DisjointSets;

/// Distance of the skin from the solid, in cell edges, above which a part counts as lost. Sharp edges are
/// cut off by up to one.
const LOST: f64 = 1.5;

/// Number of cells that a part must be thick to be kept.
const CELLS_THROUGH: f64 = 1.5;

/// Edge length of the cells [m].
fn spacing(spec: &SurfaceSpec, surface: &ClosedSurface) -> Result<f64, MeshError> {
    let side = longest_side(surface);
    match (spec.cells, spec.spacing) {
        (Some(0), None) => Err(MeshError::ZeroCount { field: "cells" }),
        (Some(cells), None) => Ok(side / cells as f64),
        (None, Some(spacing)) => {
            positive("spacing", spacing)?;
            if spacing > side {
                Err(SurfaceError::LargeSpacing { spacing, side }.into())
            } else {
                Ok(spacing)
            }
        }
        (cells, _) => Err(SurfaceError::CellsOrSpacing { both: cells.is_some() }.into()),
    }
}

/// Reads the surface of the file and checks that it is closed and oriented outwards.
fn read(
    spec: &SurfaceSpec,
    dimension: usize,
    base: &Path,
) -> Result<(SurfaceFile, ClosedSurface), MeshError> {
    if dimension != 3 {
        return Err(MeshError::ShapeDimension { shape: "solid from a surface", dimension: 3 });
    }
    let file = file::read_surface(spec.file(), base)?;
    let surface = ClosedSurface::new(file.mesh()).map_err(|error| file.locate(error))?;
    Ok((file, surface))
}

/// Upper bounds of the counts: the cells inside by the volume, and three per cell that the surface may
/// cut.
pub(super) fn size(spec: &SurfaceSpec, dimension: usize, base: &Path) -> Result<MeshSize, MeshError> {
    let (_, surface) = read(spec, dimension, base)?;
    let spacing = spacing(spec, &surface)?;
    let cubes = CubicLattice::cubes_of(&surface.bounds(), spacing);
    let lattice =
        cubes.iter().fold(1u64, |product, n| product.saturating_mul(*n as u64 + 1)).saturating_mul(2);
    let (volume, area) = (surface.volume() / spacing.powi(3), surface.area() / spacing.powi(2));
    // Cubes inside or touched, at most all.
    let touched = ((volume + 3.0 * area).ceil() as u64).saturating_add(27).min(lattice);
    let size = MeshSize::default();
    let size = match spec.element_or_default() {
        SolidElement::Tetrahedron => MeshSize {
            vertices: touched.saturating_mul(4),
            triangles: ((24.0 * area).ceil() as u64).saturating_add(27).min(lattice.saturating_mul(4)),
            tetrahedra: touched.saturating_mul(12),
            ..size
        },
        SolidElement::Hexahedron => {
            let vertices = touched.saturating_mul(2);
            let triangles = ((12.0 * area).ceil() as u64).saturating_add(27);
            MeshSize { vertices, triangles, blocks: touched, block_nodes: 8, ..size }
        }
    };
    let checked = size.checked(3).and_then(|size| match lattice > u64::from(u32::MAX) {
        true => Err(MeshError::TooMany { what: "points of the lattice", count: lattice }),
        false => Ok(size),
    });
    let size = checked.map_err(|error| match (error, spec.spacing) {
        (MeshError::TooMany { what, count }, Some(spacing)) => {
            let side = longest_side(&surface);
            SurfaceError::SmallSpacing { spacing, side, what, count }.into()
        }
        (error, _) => error,
    })?;
    // Two 16-bit winding numbers and a flag per lattice point.
    Ok(MeshSize { bytes: size.bytes.saturating_add(lattice.saturating_mul(6)), ..size })
}

/// Builds the solid inside of the surface, with the skin.
pub(super) fn build(spec: &SurfaceSpec, dimension: usize, base: &Path) -> Result<Mesh, MeshError> {
    let (file, surface) = read(spec, dimension, base)?;
    let spacing = spacing(spec, &surface)?;
    let located = |error: SurfaceError| file.locate(error.into());
    if !spec.union {
        surface.check_crossings().map_err(located)?;
    }
    let lattice = CubicLattice::new(&surface.bounds(), spacing);
    let inside = inside(&surface, &lattice, spec.union).map_err(located)?;
    let mut mesh = Mesh { dimension, ..Mesh::default() };
    match spec.element_or_default() {
        SolidElement::Tetrahedron => {
            let stuffing = stuffing::stuff(&surface, &lattice, &inside);
            mesh.points = stuffing.points.into_flattened();
            mesh.tetrahedra = stuffing.tetrahedra;
        }
        SolidElement::Hexahedron => {
            let (points, block) = hexahedra::cubes(&lattice, &inside);
            mesh.points = points.into_flattened();
            mesh.blocks = vec![block];
        }
    }
    if mesh.element_count() == 0 {
        check_kept(&surface, &vec![f64::INFINITY; surface.triangles.len()], spacing).map_err(located)?;
    }
    let (skin, distances) = bind::bind(&surface, &mesh);
    check_kept(&surface, &distances, spacing).map_err(located)?;
    if !spec.union {
        check_pieces(&surface, &mesh, spacing).map_err(located)?;
    }
    mesh.skin = Some(skin);
    groups::add(&surface, &mut mesh);
    mesh.cleaned = file.mesh().cleaned.clone();
    Ok(mesh)
}

/// For each lattice point: true if it is inside.
fn inside(surface: &ClosedSurface, lattice: &CubicLattice, union: bool) -> Result<Vec<bool>, SurfaceError> {
    let windings = lattice.ordered(lattice.axes().map(|axes| surface.windings(axes)));
    let is_wrong = |winding: &i16| if union { *winding < 0 } else { !(0..=1).contains(winding) };
    if let Some(point) = windings.iter().position(is_wrong) {
        return Err(SurfaceError::Winding { winding: windings[point], place: lattice.place(point as u32) });
    }
    Ok(windings.into_iter().map(|winding| winding > 0).collect())
}

/// Rejects a solid that lacks a part of the surface; the error names the thinnest lost part.
fn check_kept(surface: &ClosedSurface, distances: &[f64], spacing: f64) -> Result<(), SurfaceError> {
    let lost = (0..distances.len()).filter(|i| distances[*i] > LOST * spacing);
    let measured: Vec<(usize, Option<f64>)> = lost.map(|i| (i, surface.thickness(i))).collect();
    let thin = |thickness: Option<f64>| thickness.unwrap_or(f64::INFINITY);
    let thinnest = measured.into_iter().min_by(|a, b| thin(a.1).total_cmp(&thin(b.1)).then(a.0.cmp(&b.0)));
    let Some((triangle, thickness)) = thinnest else { return Ok(()) };
    let finer = thickness.map_or(0.5 * spacing, |thickness| thickness / CELLS_THROUGH).min(0.9 * spacing);
    Err(SurfaceError::Thin {
        triangle,
        place: surface.middle(triangle),
        distance: distances[triangle],
        spacing,
        thickness,
        cells: (longest_side(surface) / finer).ceil() as usize,
    })
}

fn longest_side(surface: &ClosedSurface) -> f64 {
    let [low, high] = surface.bounds();
    (0..3).map(|c| high[c] - low[c]).fold(0.0, f64::max)
}

/// Rejects a solid with more or fewer pieces than the surface encloses. Cells are connected by faces:
/// parts joined at a vertex or an edge only could swing freely.
fn check_pieces(surface: &ClosedSurface, mesh: &Mesh, spacing: f64) -> Result<(), SurfaceError> {
    let expected = surface.pieces().iter().filter(|volume| **volume > 0.0).count();
    let (of_cell, found) = pieces(mesh);
    if found == expected {
        return Ok(());
    }
    let mut sizes = vec![0usize; found];
    of_cell.iter().for_each(|piece| sizes[*piece as usize] += 1);
    let smallest = (0..found).fold(0, |small, i| if sizes[i] < sizes[small] { i } else { small });
    let mut sum = [0.0; 3];
    for (cell, _) in of_cell.iter().enumerate().filter(|(_, piece)| **piece as usize == smallest) {
        let corners = cell_corners(mesh, cell);
        for corner in &corners {
            (0..3).for_each(|c| sum[c] += mesh.point(*corner as usize)[c] / corners.len() as f64);
        }
    }
    let place = sum.map(|x| x / sizes[smallest] as f64);
    let cells = (1.5 * longest_side(surface) / spacing).ceil() as usize;
    Err(SurfaceError::Pieces { expected, found, place, spacing, cells })
}

fn cell_corners(mesh: &Mesh, cell: usize) -> Vec<u32> {
    match mesh.block() {
        Some(block) => block.of::<8>()[cell].to_vec(),
        None => mesh.tetrahedra[cell].to_vec(),
    }
}

/// Piece of each element, and the number of pieces; elements are connected by common faces.
fn pieces(mesh: &Mesh) -> (Vec<u32>, usize) {
    let mut links: Vec<[u32; 2]> = vec![];
    let sides: Vec<[u32; 4]>;
    if let Some(block) = mesh.block() {
        sides = block.sides().collect();
        let per_cell = sides.len() / block.len();
        link(sides.len(), |i| sides[i], |i| i / per_cell, &mut links);
    } else {
        let face = |i: usize| {
            let cell = mesh.tetrahedra[i / 4];
            [1, 2, 3].map(|step| cell[(i + step) % 4])
        };
        link(4 * mesh.tetrahedra.len(), face, |i| i / 4, &mut links);
    }
    let mut pieces = DisjointSets::new(mesh.element_count());
    links.iter().for_each(|pair| pieces.connect(pair));
    pieces.numbered()
}

/// Adds the pairs of cells that share a facet.
fn link<const N: usize>(
    count: usize,
    facet: impl Fn(usize) -> [u32; N],
    cell: impl Fn(usize) -> usize,
    links: &mut Vec<[u32; 2]>,
) {
    let key = |i: usize| {
        let mut key = facet(i);
        key.sort_unstable();
        key
    };
    for_each_equal(count, key, |run| {
        links.extend(run.windows(2).map(|pair| [pair[0], pair[1]].map(|i| cell(i as usize) as u32)));
    });
}
