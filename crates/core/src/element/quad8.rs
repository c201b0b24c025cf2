//! Quadrilateral of second order with eight nodes: corners and the middle of sides, 2 x 2 Gauss points.

use super::ElementDescription;
use super::cell::{CellKind, Isoparametric};
use super::second_order::{TWO, at_points, products, serendipity};

/// Nodes in the reference cell, in VTK's order.
const NODES: [[f64; 2]; 8] =
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]];

const POINTS: [([f64; 2], f64); 4] = products(&TWO);

const SLOPES: [[[f64; 2]; 8]; 4] = at_points(&NODES, false, &POINTS);

const KIND: CellKind = CellKind {
    name: "quad8",
    plural: "quad8 cells",
    dimension: 2,
    nodes: 8,
    corners: 4,
    edges: &[[0, 1], [1, 2], [2, 3], [3, 0]],
    sides: &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
    mirror: &[0, 3, 2, 1, 7, 6, 5, 4],
    vtk: 23,
    gmsh: 16,
    gmsh_nodes: &[],
    suffix: "quad8",
    about: ElementDescription {
        name: "quad8",
        summary: "Quadrilateral of second order in 2D without a node inside, with straight or curved sides: \
                  four evaluations of the material each (reduced integration)",
        scene: "`elastic` with `order = 2` and `serendipity = true` of a body in 2D whose mesh has \
                quadrilaterals",
        vertices: 8,
        formula: "E = sum_q w_q psi(F_q), F_q = sum_a x_a (dN_a/dX)^T",
        source: "Zienkiewicz, Taylor, Zhu 2013, The Finite Element Method, chapter 6, serendipity; 2 x 2 \
                 points: Zienkiewicz, Taylor, Too 1971, Reduced integration technique in general analysis \
                 of plates and shells",
    },
};

/// Quadrilateral of second order with eight nodes: corners and the middle of sides, 2 x 2 Gauss points.
pub const QUAD8: Isoparametric<2, 8> = Isoparametric {
    kind: &KIND,
    nodes: &NODES,
    shape: |xi| serendipity(&NODES, xi).0,
    slopes: |xi| serendipity(&NODES, xi).1,
    points: &POINTS,
    slopes_at_points: &SLOPES,
};
