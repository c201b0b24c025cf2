//! Terms by the name of their material, the kind of their elements and the number of dimensions.
//!
//! The engine's terms are generic over all three, so that each has kernels of its own. A scene names them,
//! and needs the kernels of all; they are compiled here, behind functions that are not generic, once for all
//! crates above.
//!
//! ```
//! use pliant::material::{Isotropic, MaterialSpec, Stress};
//! use pliant_terms::{ElementSet, linear};
//!
//! let rest = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
//! let elements = ElementSet { body: "corner", dimension: 2, cells: &[0, 1, 2], rest: &rest,
//!     stress: Stress::Analytic, factors: None, axes: None };
//! let rubber = MaterialSpec::NeoHookean(Isotropic { young: 1e5, poisson: 0.4, preset: None });
//! let mut term = linear(&rubber, &elements);
//! assert_eq!(term.energy(&rest), 0.0);
//! ```

// Declared where it is set: by `tests/tools/web.sh`.
#![allow(unexpected_cfgs)]

mod cells;
mod gravity;
mod lecture;
mod makers;
mod muscle;
mod pressure;
mod springs;
mod viscous;

pub use cells::{cells, change_of_cells, shaped_cells, turning_cells};
pub use gravity::{direct_gravity, tree_gravity};
pub use lecture::{IS_FOR_LECTURE, has_material};
pub use muscle::{FibreSet, muscle};
pub use pressure::pressure;
pub use springs::{
    dashpots, expressed_dashpots, expressed_springs, hinge_dashpots, hinges, joint_dashpots, joints, springs,
};
pub use viscous::{ViscousSet, change_of_viscous_cells, viscous_cells, viscous_membrane, viscous_simplices};

use lecture::{left_out, visit};
use makers::{LinearMaker, MembraneMaker, QuadraticMaker};
use pliant::algebra::Mat;
use pliant::energy::EnergyTerm;
use pliant::energy::elastic::Sheet;
use pliant::material::{MaterialSpec, Stress};

/// Parts of an elastic term beside its material.
#[derive(Clone, Copy, Debug)]
pub struct ElementSet<'a> {
    /// Name of the body, for messages.
    pub body: &'a str,
    /// 2 or 3.
    pub dimension: usize,
    /// Vertices of the elements, flat `(elements, nodes)`; corners first.
    pub cells: &'a [u32],
    /// Rest positions of the whole system, flat `(n, dimension)` [m].
    pub rest: &'a [f64],
    /// How the stress is computed.
    pub stress: Stress,
    /// Factor of the energy density of each element, of linear and quadratic simplices: see
    /// [`Elastic::with_factors`](pliant::energy::elastic::Elastic::with_factors). All others leave it out.
    pub factors: Option<&'a [f64]>,
    /// Rotation from the axes of the material to those of space in each element, of these and of other cells:
    /// see [`Elastic::with_axes`](pliant::energy::elastic::Elastic::with_axes).
    pub axes: Option<&'a [Mat<f64, 3>]>,
}

impl<'a> ElementSet<'a> {
    /// Elements of `N` nodes.
    ///
    /// # Panics
    /// If the number of vertices is no multiple of `N`.
    fn of<const N: usize>(&self) -> &'a [[u32; N]] {
        whole_cells(self.cells)
    }
}

/// Cells of `N` nodes by their vertices, flat.
///
/// # Panics
/// If the number of vertices is no multiple of `N`.
fn whole_cells<const N: usize>(vertices: &[u32]) -> &[[u32; N]] {
    let (cells, left) = vertices.as_chunks::<N>();
    assert!(left.is_empty(), "cells of {N} nodes from {} vertices", vertices.len());
    cells
}

/// Linear triangles in the plane, linear tetrahedra in space, as
/// [`Elastic::linear`](pliant::energy::elastic::Elastic::linear) has them.
///
/// # Panics
/// As there, and if the cells are not whole ones.
pub fn linear(material: &MaterialSpec, elements: &ElementSet<'_>) -> Box<dyn EnergyTerm> {
    match elements.dimension {
        2 => visit::<2, _>(material, LinearMaker::<3>(elements)),
        _ => visit::<3, _>(material, LinearMaker::<4>(elements)),
    }
}

/// Triangles of six nodes in the plane, tetrahedra of ten in space, as
/// [`Elastic::quadratic`](pliant::energy::elastic::Elastic::quadratic) has them.
///
/// # Panics
/// As there, and if the cells are not whole ones.
pub fn quadratic(material: &MaterialSpec, elements: &ElementSet<'_>) -> Box<dyn EnergyTerm> {
    if IS_FOR_LECTURE {
        left_out();
    }
    match elements.dimension {
        2 => visit::<2, _>(material, QuadraticMaker::<6>(elements)),
        _ => visit::<3, _>(material, QuadraticMaker::<10>(elements)),
    }
}

/// A membrane in space, as [`Membrane::new`](pliant::energy::elastic::Membrane::new) has it; its stress is
/// computed as `sheet` says.
///
/// # Panics
/// As there, and if the cells are not whole ones.
pub fn membrane(material: &MaterialSpec, elements: &ElementSet<'_>, sheet: Sheet) -> Box<dyn EnergyTerm> {
    if IS_FOR_LECTURE {
        left_out();
    }
    visit::<2, _>(material, MembraneMaker(elements, sheet))
}
