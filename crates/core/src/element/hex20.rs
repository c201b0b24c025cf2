//! Hexahedron of second order with twenty nodes: corners and the middle of edges, 2 x 2 x 2 Gauss points.

use super::ElementDescription;
use super::cell::{CellKind, Isoparametric};
use super::hexahedron::EDGES;
use super::second_order::{TWO, at_points, products, serendipity};

/// Nodes in the reference cell, in VTK's order.
const NODES: [[f64; 3]; 20] = [
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
];

const POINTS: [([f64; 3], f64); 8] = products(&TWO);

const SLOPES: [[[f64; 3]; 20]; 8] = at_points(&NODES, false, &POINTS);

const KIND: CellKind = CellKind {
    name: "hex20",
    plural: "hex20 cells",
    dimension: 3,
    nodes: 20,
    corners: 8,
    edges: &EDGES,
    sides: &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]],
    mirror: &[0, 3, 2, 1, 4, 7, 6, 5, 11, 10, 9, 8, 15, 14, 13, 12, 16, 19, 18, 17],
    vtk: 25,
    gmsh: 17,
    gmsh_nodes: &[0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15],
    suffix: "hex20",
    about: ElementDescription {
        name: "hex20",
        summary: "Hexahedron of second order in 3D without nodes inside and on faces, with straight or \
                  curved edges: eight evaluations of the material each (reduced integration)",
        scene: "`elastic` with `order = 2` and `serendipity = true` of a body in 3D whose mesh has hexahedra",
        vertices: 20,
        formula: "E = sum_q w_q psi(F_q), F_q = sum_a x_a (dN_a/dX)^T",
        source: "Zienkiewicz, Taylor, Zhu 2013, The Finite Element Method, chapter 6, serendipity; 2 x 2 x \
                 2 points: Zienkiewicz, Taylor, Too 1971, Reduced integration technique in general analysis \
                 of plates and shells",
    },
};

/// Hexahedron of second order with twenty nodes: corners and the middle of edges, 2 x 2 x 2 Gauss points.
pub const HEX20: Isoparametric<3, 20> = Isoparametric {
    kind: &KIND,
    nodes: &NODES,
    shape: |xi| serendipity(&NODES, xi).0,
    slopes: |xi| serendipity(&NODES, xi).1,
    points: &POINTS,
    slopes_at_points: &SLOPES,
};
