//! Quadrilateral of four nodes.

use super::cell::{CellKind, Isoparametric};
use super::{ElementDescription, multilinear};
use multilinear::GAUSS as G;

/// Corners of the reference cell, in VTK's order.
const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

const KIND: CellKind = CellKind {
    name: "quadrilateral",
    plural: "quadrilaterals",
    dimension: 2,
    nodes: 4,
    edges: &[[0, 1], [1, 2], [2, 3], [3, 0]],
    sides: &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
    mirror: &[0, 3, 2, 1],
    vtk: 9,
    gmsh: 3,
    suffix: "quad",
    about: ElementDescription {
        name: "quadrilateral",
        summary: "Bilinear quadrilateral in 2D that does not lock where it is nearly incompressible: four \
                  evaluations of the material each, at the mean ratio of areas",
        scene: "`elastic` of a body in 2D whose mesh has quadrilaterals, as `grid` with `element = \
                \"quadrilateral\"`",
        vertices: 4,
        formula: "E = sum_q w_q psi((theta/J_q)^(1/2) F_q), J_q = det F_q, theta = sum_q w_q J_q / sum_q \
                  w_q, + sum_l V/6 eps^T (B - A) eps of bending across each axis, B the moduli of the \
                  solid, A of the cell",
        source: "Simo, Taylor, Pister 1985, Variational and projection methods for the volume constraint; \
                 Flanagan, Belytschko 1981, A uniform strain hexahedron and quadrilateral with orthogonal \
                 hourglass control",
    },
};

/// Quadrilateral of four nodes, 2 x 2 Gauss points.
pub const QUADRILATERAL: Isoparametric<2, 4> = Isoparametric {
    kind: &KIND,
    nodes: &CORNERS,
    shape: |xi| multilinear::shape(&CORNERS, xi),
    slopes: |xi| multilinear::slopes(&CORNERS, xi),
    moving_slopes: |xi| multilinear::slopes(&CORNERS, xi),
    points: &[([-G, -G], 1.0), ([G, -G], 1.0), ([G, G], 1.0), ([-G, G], 1.0)],
};
