//! Elements: deformation gradients from vertex positions, and forces from stresses.
//!
//! The number of nodes `N` and the dimension `D` identify the element. Simplices of first and second
//! order have 3 and 6 nodes in 2D, 4 and 10 in 3D; quadrilaterals of second order have 8 or 9, hexahedra
//! 20 or 27. [`quadrature_points`] gives the points over which energy, forces and stiffness are summed,
//! [`MassRule`] the mass, [`least_jacobian`] the validity of a curved element.
//!
//! Cells other than simplices are described by values: a [`CellKind`] describes the cell, an
//! [`Isoparametric`] integrates over it. Functions generic over `N` and `D` take second-order cells from
//! there; positions in them are `xi_k`, in the first entries of [`Barycentric`].
//!
//! # How to add one
//! 1. Write a file with a `CellKind` (nodes, edges, sides, mirror image, types of VTK and Gmsh, name in
//!    recordings, description) and its `Isoparametric` (shape functions, slopes, quadrature): `quad9.rs`.
//! 2. Add it to `cells!` at the end of `cell.rs`, under its order, and its description to `ELEMENTS` below.
//!    Readers, writers, checks, masses, probes, damping and energy read what it says. Kinds of second order
//!    are told apart by dimension and number of nodes: two kinds must not share both.
//! 3. A side with a new number of nodes needs shape functions and edges in `face.rs`, its variant of
//!    `LoadTarget` (`crates/scene/src/assembly/loads.rs`) and its line in `crates/terms/src/pressure.rs`.
//! 4. Say how scenes make it: `WholeCell` or `CellOrder` in `crates/mesh/src/spec/mod.rs`; add its array to
//!    `crates/py/src/topology.rs`.
//! 5. The tests of `cell`, `energy/elastic/cells` and `dissipation` visit the registry. Add it to `Kind` and
//!    `KINDS` (`tests/support/solid.rs`) and `solids` (`tests/element_record.rs`).
//! 6. Simplices have kernels of their own and are told apart by their number of nodes in `shape.rs`.

mod cell;
mod face;
mod hex20;
mod hex27;
mod hexahedron;
mod mass;
mod multilinear;
mod quad8;
mod quad9;
mod quadratic;
mod quadrature;
mod quadrilateral;
mod second_order;
mod shape;
mod simplex;
mod state;
mod tangents;
mod validity;

pub use cell::{CELL_KINDS, CellBlock, CellKind, CellVisitor, Isoparametric};
pub(crate) use face::face_corners;
pub use face::{FacePoint, face_points, vector_area};
pub use face::{area_rate, face_edges, face_middle};
pub use hex20::HEX20;
pub use hex27::HEX27;
pub use hexahedron::HEXAHEDRON;
pub use mass::{MassRule, mass_rule};
pub use quad8::QUAD8;
pub use quad9::QUAD9;
pub use quadrature::{
    MOST_POINTS, QuadraturePoint, centroid, interpolation, quadrature_count, quadrature_points,
    quadrature_position,
};
pub use quadrilateral::QUADRILATERAL;
pub use shape::{Barycentric, jacobian, order, reference_gradients, shape_functions};
pub use shape::{TETRAHEDRON_EDGES, TRIANGLE_EDGES};
pub use validity::{least_jacobian, volume};

pub(crate) use quadratic::{QuadraticGradients, QuadraticPositions};
pub(crate) use quadrature::point_content;
pub(crate) use second_order::{THREE, TWO};
pub(crate) use shape::is_simplex;
pub use simplex::{SimplexPack, simplex_rest};
pub use state::{ElementState, von_mises};
pub(crate) use tangents::{Tangents, edges, times, transpose_times};

/// Description of an element, for `pliant list elements`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct ElementDescription {
    /// Name of the element.
    pub name: &'static str,
    /// One-line description.
    pub summary: &'static str,
    /// Key of a scene that makes elements of this kind.
    pub scene: &'static str,
    /// Number of vertices.
    pub vertices: u32,
    /// Energy of the element.
    pub formula: &'static str,
    /// Source of the energy.
    pub source: &'static str,
}

/// Descriptions of all elements.
pub const ELEMENTS: &[ElementDescription] = &[
    ElementDescription {
        name: "triangle",
        summary: "Linear triangle in 2D: F is constant, one evaluation of the material each",
        scene: "`elastic` of a body in 2D whose mesh has triangles",
        vertices: 3,
        formula: "E = A psi(F), F = D_s D_m^-1, A the rest area",
        source: "Sifakis, Barbic 2012, FEM Simulation of 3D Deformable Solids, section 4.1",
    },
    ElementDescription {
        name: "tetrahedron",
        summary: "Linear tetrahedron in 3D: F is constant, one evaluation of the material each",
        scene: "`elastic` of a body in 3D whose mesh has tetrahedra",
        vertices: 4,
        formula: "E = V psi(F), F = D_s D_m^-1, V the rest volume",
        source: "Sifakis, Barbic 2012, FEM Simulation of 3D Deformable Solids, section 4.1",
    },
    ElementDescription {
        name: "quadratic triangle",
        summary: "Triangle of second order in 2D, with straight or curved sides: three evaluations of the \
                  material each",
        scene: "`elastic` with `order = 2` of a body in 2D whose mesh has triangles",
        vertices: 6,
        formula: "E = sum_q w_q psi(F_q), F_q = sum_a x_a (dN_a/dX)^T",
        source: "Zienkiewicz, Taylor, Zhu 2013, The Finite Element Method, section 6.3.2; rule: Strang, Fix \
                 1973",
    },
    ElementDescription {
        name: "quadratic tetrahedron",
        summary: "Tetrahedron of second order in 3D, with straight or curved sides: four evaluations of the \
                  material each",
        scene: "`elastic` with `order = 2` of a body in 3D whose mesh has tetrahedra",
        vertices: 10,
        formula: "E = sum_q w_q psi(F_q), F_q = sum_a x_a (dN_a/dX)^T",
        source: "Zienkiewicz, Taylor, Zhu 2013, The Finite Element Method, section 6.3.4; rule: Keast 1986",
    },
    QUADRILATERAL.kind.about,
    HEXAHEDRON.kind.about,
    QUAD8.kind.about,
    QUAD9.kind.about,
    HEX20.kind.about,
    HEX27.kind.about,
    ElementDescription {
        name: "membrane",
        summary: "Linear triangle in 3D: a sheet in plane stress or plane strain, which resists stretching \
                  and shearing",
        scene: "`elastic` and `membrane` of a body in 3D whose mesh has triangles",
        vertices: 3,
        formula: "E = h A psi(G), F = D_s D_m^-1 = Q G, Q^T Q = I, h the thickness and A the area at rest",
        source: "Bonet, Wood 2008, Nonlinear Continuum Mechanics for Finite Element Analysis, section 6.6",
    },
    ElementDescription {
        name: "spring",
        summary: "Spring between two vertices, in 2D and 3D",
        scene: "`springs` of a body: along every edge of its mesh",
        vertices: 2,
        formula: "E = k/2 (l - l0)^2, k given or Y l0",
        source: "Hooke's law, lecture 9",
    },
    ElementDescription {
        name: "hinge",
        summary: "Bending at the edge between two triangles in 3D",
        scene: "`bending` of a body: at every edge between two triangles of a sheet",
        vertices: 4,
        formula: "E = D/2 |e|^2/(A_1 + A_2) (theta - theta_0)^2",
        source: "Grinspun, Hirani, Desbrun, Schroeder 2003, Discrete Shells",
    },
    ElementDescription {
        name: "joint",
        summary: "Bending at a vertex between two edges, in 2D and 3D",
        scene: "`bending` of a body: at every vertex between two edges of a strand",
        vertices: 3,
        formula: "E = B/(l_1 + l_2) (kappa - kappa_0)^2, kappa = 2 tan(phi/2)",
        source: "Bergou, Wardetzky, Robinson, Audoly, Grinspun 2008, Discrete Elastic Rods",
    },
];
