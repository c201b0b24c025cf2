//! Hexahedron of eight nodes.

use super::cell::{CellKind, Isoparametric};
use super::{ElementDescription, multilinear};
use multilinear::GAUSS as G;

/// Corners of the reference cell, in VTK's order: around the bottom, then around the top.
pub(super) const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

pub(super) const EDGES: [[usize; 2]; 12] =
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];

const KIND: CellKind = CellKind {
    name: "hexahedron",
    plural: "hexahedra",
    dimension: 3,
    nodes: 8,
    corners: 8,
    edges: &EDGES,
    sides: &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]],
    mirror: &[0, 3, 2, 1, 4, 7, 6, 5],
    vtk: 12,
    gmsh: 5,
    gmsh_nodes: &[],
    suffix: "hex",
    about: ElementDescription {
        name: "hexahedron",
        summary: "Trilinear hexahedron in 3D with one evaluation of the material and an energy of \
                  its hourglass modes (Q1SP): it bends as a beam does at any ratio of its lengths and does \
                  not lock where it is nearly incompressible; too stiff where it is a trapezoid that bends",
        scene: "`elastic` of a body in 3D whose mesh has hexahedra, as `grid` with `element = \
                \"hexahedron\"`",
        vertices: 8,
        formula: "V psi(F) + sum_l V/3 W(A_l) + sum_l V/9 W'(z_012 g_l^T), F = sum_a x_a b_a^T, A_l = \
                  sum_(k != l) z_kl g_k^T, z = cof(F)^T sum_a gamma_a x_a, W free of traction across l, W' \
                  of pressure",
        source: "Belytschko, Bindeman 1993, Assumed strain stabilization of the eight node hexahedral \
                 element; Reese, Wriggers 2000, A stabilization technique to avoid hourglassing in finite \
                 elasticity; Puso 2000, A highly efficient enhanced assumed strain physically stabilized \
                 hexahedral element",
    },
};

/// Hexahedron of eight nodes, 2 x 2 x 2 Gauss points.
pub const HEXAHEDRON: Isoparametric<3, 8> = Isoparametric {
    kind: &KIND,
    nodes: &CORNERS,
    shape: |xi| multilinear::shape(&CORNERS, xi),
    slopes: |xi| multilinear::slopes(&CORNERS, xi),
    points: &[
        ([-G, -G, -G], 1.0),
        ([G, -G, -G], 1.0),
        ([G, G, -G], 1.0),
        ([-G, G, -G], 1.0),
        ([-G, -G, G], 1.0),
        ([G, -G, G], 1.0),
        ([G, G, G], 1.0),
        ([-G, G, G], 1.0),
    ],
    slopes_at_points: &[],
};
