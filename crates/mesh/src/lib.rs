//! Meshes: generators, readers, checks and selections. Plain data, either two- or three-dimensional.
//!
//! [`build`] turns the `mesh` table of a scene into a checked [`Mesh`]. [`build_body`] transforms and
//! repeats it for a body. [`select`] turns a selection into vertex indices. [`predicted_size`] predicts
//! the memory of a mesh before any of it is allocated. Each generator or format has its own file.
//!
//! # How to add a generator
//! 1. Write a file in this folder with `build` and `size`, as `disk.rs` has them.
//! 2. Add its keys to `spec/shapes.rs`; to `MeshSpec` in `spec/mod.rs` a variant, its name in `name` and its
//!    count in `vertex_count`; a line each to `build.rs` and `size.rs`. Round shapes are curved in
//!    `curved.rs`.
//! 3. In `crates/scene/src/validate`: its dimension and its checks in `shapes.rs`, what bodies can be made
//!    of it in `MeshCapabilities::of` of `body.rs`.
//! 4. Add it to `generator_tests.rs` and to a scene, and print the scene format anew.

// Loops over small fixed ranges index several arrays at once.
#![allow(clippy::needless_range_loop)]

use std::collections::BTreeMap;

use pliant::element::CellBlock;
use pliant::lanes::hypot;
use pliant::topology::Skin;

mod abaqus;
#[cfg(test)]
mod abaqus_tests;
mod annulus;
mod ball;
mod build;
mod cell;
mod cells;
mod check;
mod clean;
mod cloth;
mod cooks_membrane;
mod crossing;
mod curved;
mod cylinder;
mod disk;
mod elliptic_membrane;
mod error;
mod extrude;
mod faces;
mod facets;
mod file;
#[cfg(test)]
mod file_tests;
mod format_error;
#[cfg(test)]
mod format_fault_tests;
#[cfg(test)]
mod format_tests;
#[cfg(test)]
mod fuzz_tests;
#[cfg(test)]
mod generator_tests;
mod geometry;
mod gmsh;
mod grid;
mod icosahedron;
mod include;
mod inline;
mod mapped;
mod measure;
mod medit;
mod notched_beam;
mod number_type;
mod obj;
mod pieces;
mod ply;
mod quadratic;
mod quality;
mod refine;
mod repeat;
mod select;
mod signature;
mod size;
mod skin;
pub mod spec;
mod sphere;
mod stl;
mod strand;
mod surface;
mod tapered_beam;
#[cfg(test)]
pub(crate) mod test_support;
mod tetgen;
mod thickness;
mod tokens;
mod topology;
mod transform;
mod tube;
mod turn;
mod vtk;
pub mod vtk_cells;
mod vtu;

pub use build::{build, build_body};
pub use cell::{Cell, FileTag};
pub use check::FoldedNodes;
pub use clean::Cleaned;
pub use crossing::crossings;
pub use error::MeshError;
pub use file::{files, read};
pub use format_error::FormatError;
pub use pieces::{BlockCount, Contents};
pub use quadratic::MidNodes;
pub use quality::{CurvedQuality, ElementQuality, Quality};
pub use select::select;
pub use size::{MeshSize, predicted_body_size, predicted_size};
pub use surface::{SurfaceError, SurfaceReport};
pub use thickness::Chord;

/// A named set of cells of one topological dimension (a physical group of a mesh file).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Group {
    /// 0 points, 1 edges, 2 triangles, 3 tetrahedra: the highest dimension of the cells with this name in
    /// the file.
    pub topological_dimension: usize,
    /// Indices into the mesh's cells of that dimension (for points: vertex indices; for edges:
    /// [`Mesh::lines`] if there are any, otherwise [`Mesh::edges`]), ascending.
    pub cells: Vec<u32>,
    /// All vertices of the cells with this name, ascending, each once.
    pub vertices: Vec<u32>,
}

/// A mesh: vertices and cells.
///
/// `points` is flat, `(n, dimension)` [m]. A mesh may have cells of several dimensions: a solid keeps the
/// boundary triangles that carry its named groups. The cells of the highest dimension become elements.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Dimension of the space, 2 or 3.
    pub dimension: usize,
    /// Reference positions, flat `(n, dimension)` [m].
    pub points: Vec<f64>,
    /// Edges that become springs; without any, springs are made of the edges of the highest-dimensional
    /// cells.
    pub edges: Vec<[u32; 2]>,
    /// Line cells of a file that also has triangles or tetrahedra. They only carry groups: if they became
    /// springs, a file with named boundary curves would lose the springs of its interior.
    pub lines: Vec<[u32; 2]>,
    /// Triangles, counter-clockwise in 2D.
    pub triangles: Vec<[u32; 3]>,
    /// Tetrahedra, `(x1-x0, x2-x0, x3-x0)` right-handed.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Mid-edge nodes of each triangle in a second-order mesh, in the order `01, 12, 20`; otherwise
    /// empty.
    pub triangle_middles: Vec<[u32; 3]>,
    /// Mid-edge nodes of each tetrahedron in a second-order mesh, in the order `01, 12, 02, 03, 13, 23`
    /// (VTK's); otherwise empty.
    pub tetrahedron_middles: Vec<[u32; 6]>,
    /// Cells other than simplices, one block per kind. In one dimension a mesh has either these or
    /// simplices.
    pub blocks: Vec<CellBlock>,
    /// Embedded surface that the mesh was made from and that is drawn in its place.
    pub skin: Option<Skin>,
    /// Named groups.
    pub groups: BTreeMap<String, Group>,
    /// Result of each step of cleaning that the scene asked for, in order.
    pub cleaned: Vec<Cleaned>,
    /// Names of the unread contents of the file, such as materials and supports of a deck.
    pub passed_over: Vec<String>,
}

impl Mesh {
    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.points.len() / self.dimension.max(1)
    }

    /// Position of vertex `i`, `(dimension)` [m].
    pub fn point(&self, i: usize) -> &[f64] {
        &self.points[i * self.dimension..(i + 1) * self.dimension]
    }

    /// Topological dimension of the elements: 3 for tetrahedra or hexahedra, 2 for triangles or
    /// quadrilaterals, 1 for edges only, 0 for points.
    pub fn element_dimension(&self) -> usize {
        let of_blocks = self.blocks.iter().map(|block| block.kind.dimension).max().unwrap_or(0);
        let of_simplices = if !self.tetrahedra.is_empty() {
            3
        } else if !self.triangles.is_empty() {
            2
        } else {
            usize::from(!self.edges.is_empty())
        };
        of_simplices.max(of_blocks)
    }

    /// Block of the elements; `None` for simplices.
    pub fn block(&self) -> Option<&CellBlock> {
        let dimension = self.element_dimension();
        self.blocks.iter().find(|block| block.kind.dimension == dimension)
    }

    /// Number of elements (cells of the highest dimension); 0 for points.
    pub fn element_count(&self) -> usize {
        if let Some(block) = self.block() {
            return block.len();
        }
        match self.element_dimension() {
            3 => self.tetrahedra.len(),
            2 => self.triangles.len(),
            _ => self.edges.len(),
        }
    }

    /// Lower and upper corner of the axis-aligned bounding box, `(dimension)` each [m]; empty without
    /// vertices.
    pub fn bounding_box(&self) -> (Vec<f64>, Vec<f64>) {
        if self.points.is_empty() {
            return (Vec::new(), Vec::new());
        }
        let (mut lower, mut upper) = (self.point(0).to_vec(), self.point(0).to_vec());
        for i in 1..self.vertex_count() {
            for (axis, &x) in self.point(i).iter().enumerate() {
                lower[axis] = lower[axis].min(x);
                upper[axis] = upper[axis].max(x);
            }
        }
        (lower, upper)
    }

    /// Length of the diagonal of the bounding box [m]: the size that tolerances refer to.
    pub fn diagonal(&self) -> f64 {
        let (lower, upper) = self.bounding_box();
        lower.iter().zip(&upper).fold(0.0_f64, |sum, (a, b)| hypot(sum, b - a))
    }
}
