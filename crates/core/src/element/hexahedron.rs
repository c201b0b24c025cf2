//! Hexahedron of eight nodes.

use super::cell::{CellKind, Isoparametric};
use super::{ElementDescription, multilinear};
use multilinear::GAUSS as G;

/// Corners of the reference cell, in VTK's order: around the bottom, then around the top.
const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

const EDGES: [[usize; 2]; 12] =
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];

const KIND: CellKind = CellKind {
    name: "hexahedron",
    plural: "hexahedra",
    dimension: 3,
    nodes: 8,
    edges: &EDGES,
    sides: &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]],
    mirror: &[0, 3, 2, 1, 4, 7, 6, 5],
    vtk: 12,
    gmsh: 5,
    suffix: "hex",
    about: ElementDescription {
        name: "hexahedron",
        summary: "Trilinear hexahedron in 3D that does not lock where it is nearly incompressible: eight \
                  evaluations of the material each, at the mean ratio of volumes",
        scene: "`elastic` of a body in 3D whose mesh has hexahedra, as `grid` with `element = \
                \"hexahedron\"`",
        vertices: 8,
        formula: "E = sum_q w_q psi((theta/J_q)^(1/3) F_q), J_q = det F_q, theta = sum_q w_q J_q / sum_q \
                  w_q, + sum_l V/6 eps^T (B - A) eps of bending across each axis, B the moduli of the \
                  solid, A of the cell",
        source: "Simo, Taylor, Pister 1985, Variational and projection methods for the volume constraint; \
                 Flanagan, Belytschko 1981, A uniform strain hexahedron and quadrilateral with orthogonal \
                 hourglass control",
    },
};

/// Hexahedron of eight nodes, 2 x 2 x 2 Gauss points.
pub const HEXAHEDRON: Isoparametric<3, 8> = Isoparametric {
    kind: &KIND,
    nodes: &CORNERS,
    shape: |xi| multilinear::shape(&CORNERS, xi),
    slopes: |xi| multilinear::slopes(&CORNERS, xi),
    moving_slopes: |xi| multilinear::slopes(&CORNERS, xi),
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
};
