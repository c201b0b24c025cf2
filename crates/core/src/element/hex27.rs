//! Hexahedron of second order with 27 nodes, 3 x 3 x 3 Gauss points.

use super::ElementDescription;
use super::cell::{CellKind, Isoparametric};
use super::hexahedron::EDGES;
use super::second_order::{THREE, at_points, lagrange, products};

/// Nodes in the reference cell, in VTK's order.
const NODES: [[f64; 3]; 27] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
    [0.0, -1.0, -1.0],
    [1.0, 0.0, -1.0],
    [0.0, 1.0, -1.0],
    [-1.0, 0.0, -1.0],
    [0.0, -1.0, 1.0],
    [1.0, 0.0, 1.0],
    [0.0, 1.0, 1.0],
    [-1.0, 0.0, 1.0],
    [-1.0, -1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
    [-1.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, -1.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, 0.0],
];

const POINTS: [([f64; 3], f64); 27] = products(&THREE);

static SLOPES: [[[f64; 3]; 27]; 27] = at_points(&NODES, true, &POINTS);

const KIND: CellKind = CellKind {
    name: "hex27",
    plural: "hex27 cells",
    dimension: 3,
    nodes: 27,
    corners: 8,
    edges: &EDGES,
    sides: &[&[0, 4, 7, 3], &[1, 2, 6, 5], &[0, 1, 5, 4], &[2, 3, 7, 6], &[0, 3, 2, 1], &[4, 5, 6, 7]],
    mirror: &[
        0, 3, 2, 1, 4, 7, 6, 5, 11, 10, 9, 8, 15, 14, 13, 12, 16, 19, 18, 17, 22, 23, 20, 21, 24, 25, 26,
    ],
    vtk: 29,
    gmsh: 12,
    gmsh_nodes: &[
        0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25, 26,
    ],
    suffix: "hex27",
    about: ElementDescription {
        name: "hex27",
        summary: "Hexahedron of second order in 3D with straight or curved faces: 27 evaluations of the \
                  material each; bends well where it is distorted",
        scene: "`elastic` with `order = 2` of a body in 3D whose mesh has hexahedra",
        vertices: 27,
        formula: "E = sum_q w_q psi(F_q), F_q = sum_a x_a (dN_a/dX)^T",
        source: "Zienkiewicz, Taylor, Zhu 2013, The Finite Element Method, chapter 6, Lagrange",
    },
};

/// Hexahedron of second order with 27 nodes, 3 x 3 x 3 Gauss points.
pub const HEX27: Isoparametric<3, 27> = Isoparametric {
    kind: &KIND,
    nodes: &NODES,
    shape: |xi| lagrange(&NODES, xi).0,
    slopes: |xi| lagrange(&NODES, xi).1,
    points: &POINTS,
    slopes_at_points: &SLOPES,
};
