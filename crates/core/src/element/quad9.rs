//! Quadrilateral of second order with nine nodes, 3 x 3 Gauss points.

use super::ElementDescription;
use super::cell::{CellKind, Isoparametric};
use super::second_order::{THREE, at_points, lagrange, products};

/// Nodes in the reference cell, in VTK's order.
const NODES: [[f64; 2]; 9] = [
    [-1.0, -1.0],
    [1.0, -1.0],
    [1.0, 1.0],
    [-1.0, 1.0],
    [0.0, -1.0],
    [1.0, 0.0],
    [0.0, 1.0],
    [-1.0, 0.0],
    [0.0, 0.0],
];

const POINTS: [([f64; 2], f64); 9] = products(&THREE);

const SLOPES: [[[f64; 2]; 9]; 9] = at_points(&NODES, true, &POINTS);

const KIND: CellKind = CellKind {
    name: "quad9",
    plural: "quad9 cells",
    dimension: 2,
    nodes: 9,
    corners: 4,
    edges: &[[0, 1], [1, 2], [2, 3], [3, 0]],
    sides: &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
    mirror: &[0, 3, 2, 1, 7, 6, 5, 4, 8],
    vtk: 28,
    gmsh: 10,
    gmsh_nodes: &[],
    suffix: "quad9",
    about: ElementDescription {
        name: "quad9",
        summary: "Quadrilateral of second order in 2D with straight or curved sides: nine evaluations of \
                  the material each; bends well where it is distorted",
        scene: "`elastic` with `order = 2` of a body in 2D whose mesh has quadrilaterals",
        vertices: 9,
        formula: "E = sum_q w_q psi(F_q), F_q = sum_a x_a (dN_a/dX)^T",
        source: "Zienkiewicz, Taylor, Zhu 2013, The Finite Element Method, chapter 6, Lagrange",
    },
};

/// Quadrilateral of second order with nine nodes, 3 x 3 Gauss points.
pub const QUAD9: Isoparametric<2, 9> = Isoparametric {
    kind: &KIND,
    nodes: &NODES,
    shape: |xi| lagrange(&NODES, xi).0,
    slopes: |xi| lagrange(&NODES, xi).1,
    points: &POINTS,
    slopes_at_points: &SLOPES,
};
