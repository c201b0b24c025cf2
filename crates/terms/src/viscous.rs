//! Viscosity of elements of every kind.

use pliant::dissipation::{DissipativeTerm, StrainRate, Viscosity};
use pliant::element::{CellKind, CellVisitor, Isoparametric};
use pliant::energy::elastic::{flattened, points_of};

use crate::lecture::left_out;
use crate::{IS_FOR_LECTURE, whole_cells};

/// Elements that dissipate: their body, vertices and rest positions.
#[derive(Clone, Copy, Debug)]
pub struct ViscousSet<'a> {
    /// Name of the body, for messages.
    pub body: &'a str,
    /// 2 or 3.
    pub dimension: usize,
    /// Vertices of the elements, flat `(elements, nodes)`; corners first.
    pub cells: &'a [u32],
    /// Rest positions of the whole system, flat `(n, dimension)` [m].
    pub rest: &'a [f64],
}

/// Viscosity of simplices of this order, 1 or 2, as [`StrainRate::points`] has it.
///
/// # Panics
/// If the cells are not whole ones.
pub fn viscous_simplices(
    viscosity: Viscosity,
    order: usize,
    set: &ViscousSet<'_>,
) -> Box<dyn DissipativeTerm> {
    if IS_FOR_LECTURE && order != 1 {
        left_out();
    }
    match (set.dimension, order) {
        (2, 1) => viscous_points::<2, 3>(viscosity, set),
        (2, _) => viscous_points::<2, 6>(viscosity, set),
        (_, 1) => viscous_points::<3, 4>(viscosity, set),
        _ => viscous_points::<3, 10>(viscosity, set),
    }
}

fn viscous_points<const D: usize, const N: usize>(
    viscosity: Viscosity,
    set: &ViscousSet<'_>,
) -> Box<dyn DissipativeTerm> {
    let ViscousSet { body, cells, rest, .. } = *set;
    let shape = |element: &[u32; N]| points_of::<D, N>(rest, element);
    Box::new(StrainRate::<D, N, _>::points(body, viscosity, whole_cells(cells), rest, shape))
}

/// Viscosity of triangles of a membrane in space, times its thickness [Pa s m].
///
/// # Panics
/// If the cells are not whole ones.
pub fn viscous_membrane(viscosity: Viscosity, set: &ViscousSet<'_>) -> Box<dyn DissipativeTerm> {
    if IS_FOR_LECTURE {
        left_out();
    }
    let ViscousSet { body, cells, rest, .. } = *set;
    let shape = |triangle: &[u32; 3]| flattened(&points_of(rest, triangle)).0;
    Box::new(StrainRate::<3, 3, _>::points(body, viscosity, whole_cells(cells), rest, shape))
}

/// Viscosity of cells of a kind, as [`StrainRate::cells`] has it; of second order as
/// [`StrainRate::quadratic`].
///
/// # Panics
/// If the cells are not whole ones.
pub fn viscous_cells(
    viscosity: Viscosity,
    kind: &CellKind,
    set: &ViscousSet<'_>,
) -> Box<dyn DissipativeTerm> {
    change_of_viscous_cells(viscosity, Viscosity::default(), kind, set)
}

/// The change of the dissipation of cells of the viscosity `about` with a parameter, by which that changes by
/// `viscosity`. From none at all it is the dissipation of cells of that.
///
/// # Panics
/// If the cells are not whole ones.
pub fn change_of_viscous_cells(
    viscosity: Viscosity,
    about: Viscosity,
    kind: &CellKind,
    set: &ViscousSet<'_>,
) -> Box<dyn DissipativeTerm> {
    if IS_FOR_LECTURE {
        left_out();
    }
    let about = (about != Viscosity::default()).then_some(about);
    match kind.order() {
        1 => kind.visit_first(ViscousCellsMaker { viscosity, about, set }),
        // Linear in the viscosity.
        _ => kind.visit_second(ViscousSecondOrderMaker { viscosity, set }),
    }
}

/// Maker of the viscosity of cells of second order of whatever kind is visited.
struct ViscousSecondOrderMaker<'a> {
    viscosity: Viscosity,
    set: &'a ViscousSet<'a>,
}

impl CellVisitor for ViscousSecondOrderMaker<'_> {
    type Output = Box<dyn DissipativeTerm>;

    fn visit<const D: usize, const N: usize>(self, _: &'static Isoparametric<D, N>) -> Self::Output {
        viscous_points::<D, N>(self.viscosity, self.set)
    }
}

/// Maker of the viscosity of cells of whatever kind is visited.
struct ViscousCellsMaker<'a> {
    viscosity: Viscosity,
    about: Option<Viscosity>,
    set: &'a ViscousSet<'a>,
}

impl CellVisitor for ViscousCellsMaker<'_> {
    type Output = Box<dyn DissipativeTerm>;

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Self::Output {
        let ViscousSet { body, cells, rest, .. } = *self.set;
        let cells = whole_cells(cells);
        Box::new(match self.about {
            Some(about) => StrainRate::change_of_cells(body, self.viscosity, about, cell, cells, rest),
            None => StrainRate::cells(body, self.viscosity, cell, cells, rest),
        })
    }
}
