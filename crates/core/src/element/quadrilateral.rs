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
    corners: 4,
    edges: &[[0, 1], [1, 2], [2, 3], [3, 0]],
    sides: &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
    mirror: &[0, 3, 2, 1],
    vtk: 9,
    gmsh: 3,
    gmsh_nodes: &[],
    suffix: "quad",
    about: ElementDescription {
        name: "quadrilateral",
        summary: "Bilinear quadrilateral in 2D with one evaluation of the material and an energy of \
                  its hourglass modes (Q1SP): it bends as a beam does at any ratio of its lengths and does \
                  not lock where it is nearly incompressible; too stiff where it is a trapezoid that bends",
        scene: "`elastic` of a body in 2D whose mesh has quadrilaterals, as `grid` with `element = \
                \"quadrilateral\"`",
        vertices: 4,
        formula: "V psi(F) + sum_l V/3 W(A_l), F = sum_a x_a b_a^T, A_l = z g_k^T, k != l, z = cof(F)^T \
                  sum_a gamma_a x_a, W free of traction across l",
        source: "Belytschko, Bindeman 1993, Assumed strain stabilization of the eight node hexahedral \
                 element; Reese, Wriggers 2000, A stabilization technique to avoid hourglassing in finite \
                 elasticity; Puso 2000, A highly efficient enhanced assumed strain physically stabilized \
                 hexahedral element",
    },
};

/// Quadrilateral of four nodes, 2 x 2 Gauss points.
pub const QUADRILATERAL: Isoparametric<2, 4> = Isoparametric {
    kind: &KIND,
    nodes: &CORNERS,
    shape: |xi| multilinear::shape(&CORNERS, xi),
    slopes: |xi| multilinear::slopes(&CORNERS, xi),
    points: &[([-G, -G], 1.0), ([G, -G], 1.0), ([G, G], 1.0), ([-G, G], 1.0)],
    slopes_at_points: &[],
};
