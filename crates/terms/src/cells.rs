//! Cells that are no simplices.

use pliant::algebra::Mat;
use pliant::dissipation::Viscosity;
use pliant::element::{CellKind, CellVisitor, Isoparametric};
use pliant::energy::EnergyTerm;
use pliant::energy::elastic::{CellShapes, CellTurns, OnePointCells, PullBack};
use pliant::material::{Material, MaterialSpec, MaterialVisitor, Psd, Tangent};

use crate::lecture::{left_out, visit};
use crate::makers::QuadraticMaker;
use crate::{ElementSet, IS_FOR_LECTURE};

/// Cells of a kind: of first order as [`OnePointCells::new`] has them, of second order as
/// [`Elastic::quadratic`](pliant::energy::elastic::Elastic::quadratic).
///
/// # Panics
/// As there, and if the cells are not whole ones.
pub fn cells(material: &MaterialSpec, kind: &CellKind, elements: &ElementSet<'_>) -> Box<dyn EnergyTerm> {
    if IS_FOR_LECTURE {
        left_out();
    }
    match kind.order() {
        1 => kind.visit_first(CellsMaker { material, about: None, elements }),
        _ => kind.visit_second(SecondOrderMaker { material, elements }),
    }
}

/// The change of the energy of cells of the material `about` with a parameter, by which its energy density
/// changes by that of `material`.
///
/// # Panics
/// As [`cells`].
pub fn change_of_cells(
    material: &MaterialSpec,
    about: &MaterialSpec,
    kind: &CellKind,
    elements: &ElementSet<'_>,
) -> Box<dyn EnergyTerm> {
    if IS_FOR_LECTURE {
        left_out();
    }
    match kind.order() {
        1 => kind.visit_first(CellsMaker { material, about: Some(about), elements }),
        // Linear in the energy density.
        _ => cells(material, kind, elements),
    }
}

/// Cells of the material turned by axes that change by `turns` with the components of a direction of each:
/// see [`TurningCells`](pliant::energy::elastic::TurningCells). Of first order.
///
/// # Panics
/// If [`cells`] panics, if the cells are of second order, and if there are no axes or not as many turns.
pub fn turning_cells(
    material: &MaterialSpec,
    kind: &CellKind,
    elements: &ElementSet<'_>,
    turns: &[[Mat<f64, 3>; 3]],
) -> Box<dyn CellTurns> {
    if IS_FOR_LECTURE {
        left_out();
    }
    kind.visit_first(TurningMaker { material, elements, turns })
}

/// Cells of the material and of a viscosity whose shape at rest changes: see
/// [`ShapedCells`](pliant::energy::elastic::ShapedCells). Of first order.
///
/// # Panics
/// If [`cells`] panics, and if the cells are of second order.
pub fn shaped_cells(
    material: &MaterialSpec,
    kind: &CellKind,
    elements: &ElementSet<'_>,
    viscosity: Viscosity,
) -> Box<dyn CellShapes> {
    if IS_FOR_LECTURE {
        left_out();
    }
    kind.visit_first(ShapedMaker { material, elements, viscosity })
}

/// Maker of shaped cells of whatever kind is visited, and of whatever material then.
#[derive(Clone, Copy)]
struct ShapedMaker<'a> {
    material: &'a MaterialSpec,
    elements: &'a ElementSet<'a>,
    viscosity: Viscosity,
}

impl CellVisitor for ShapedMaker<'_> {
    type Output = Box<dyn CellShapes>;

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Self::Output {
        visit::<D, _>(self.material, ShapedCellsMaker::<D, N> { of: self, cell })
    }
}

struct ShapedCellsMaker<'a, const D: usize, const N: usize> {
    of: ShapedMaker<'a>,
    cell: &'static Isoparametric<D, N>,
}

impl<const D: usize, const N: usize> MaterialVisitor<D> for ShapedCellsMaker<'_, D, N> {
    type Output = Box<dyn CellShapes>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Self::Output {
        let ElementSet { body, rest, stress, axes, .. } = *self.of.elements;
        let how = (stress, PullBack::of(self.of.material));
        let cells = OnePointCells::new(body, material, how, self.cell, self.of.elements.of(), rest);
        let cells = match axes {
            Some(axes) => cells.with_axes(axes, rest),
            None => cells,
        };
        let Viscosity { shear, second } = self.of.viscosity;
        Box::new(cells.shaped((shear, second)))
    }
}

/// Maker of turning cells of whatever kind is visited, and of whatever material then.
#[derive(Clone, Copy)]
struct TurningMaker<'a> {
    material: &'a MaterialSpec,
    elements: &'a ElementSet<'a>,
    turns: &'a [[Mat<f64, 3>; 3]],
}

impl CellVisitor for TurningMaker<'_> {
    type Output = Box<dyn CellTurns>;

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Self::Output {
        visit::<D, _>(self.material, TurningCellsMaker::<D, N> { of: self, cell })
    }
}

struct TurningCellsMaker<'a, const D: usize, const N: usize> {
    of: TurningMaker<'a>,
    cell: &'static Isoparametric<D, N>,
}

impl<const D: usize, const N: usize> MaterialVisitor<D> for TurningCellsMaker<'_, D, N> {
    type Output = Box<dyn CellTurns>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Self::Output {
        let ElementSet { body, rest, stress, axes, .. } = *self.of.elements;
        let how = (stress, PullBack::of(self.of.material));
        let cells = OnePointCells::new(body, material, how, self.cell, self.of.elements.of(), rest);
        let turns = self.of.turns.iter().map(|turns| std::array::from_fn(|c| turns[c].leading())).collect();
        Box::new(cells.with_axes(axes.unwrap_or_default(), rest).turning(turns))
    }
}

/// Maker of cells of second order of whatever kind is visited.
struct SecondOrderMaker<'a> {
    material: &'a MaterialSpec,
    elements: &'a ElementSet<'a>,
}

impl CellVisitor for SecondOrderMaker<'_> {
    type Output = Box<dyn EnergyTerm>;

    fn visit<const D: usize, const N: usize>(self, _: &'static Isoparametric<D, N>) -> Self::Output {
        visit::<D, _>(self.material, QuadraticMaker::<N>(self.elements))
    }
}

/// Maker of cells of whatever kind is visited.
struct CellsMaker<'a> {
    material: &'a MaterialSpec,
    about: Option<&'a MaterialSpec>,
    elements: &'a ElementSet<'a>,
}

impl CellVisitor for CellsMaker<'_> {
    type Output = Box<dyn EnergyTerm>;

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Self::Output {
        let pull_back = PullBack::of(self.about.unwrap_or(self.material));
        let about = self.about.map(|about| visit::<D, _>(about, TangentMaker));
        visit::<D, _>(self.material, OnePointCellsMaker { elements: self.elements, cell, pull_back, about })
    }
}

/// Maker of the tangent at rest of whatever material is visited.
struct TangentMaker;

impl<const D: usize> MaterialVisitor<D> for TangentMaker {
    type Output = Tangent<D>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Tangent<D> {
        Material::<D>::hessian(&material, &Mat::identity(), Psd::Exact)
    }
}

/// Their maker of whatever material is visited.
struct OnePointCellsMaker<'a, const D: usize, const N: usize> {
    elements: &'a ElementSet<'a>,
    cell: &'static Isoparametric<D, N>,
    pull_back: PullBack,
    about: Option<Tangent<D>>,
}

impl<const D: usize, const N: usize> MaterialVisitor<D> for OnePointCellsMaker<'_, D, N> {
    type Output = Box<dyn EnergyTerm>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Box<dyn EnergyTerm> {
        let ElementSet { body, rest, stress, .. } = *self.elements;
        let how = (stress, self.pull_back);
        let cells = OnePointCells::new(body, material, how, self.cell, self.elements.of(), rest);
        let cells = match self.elements.axes {
            Some(axes) => cells.with_axes(axes, rest),
            None => cells,
        };
        Box::new(match &self.about {
            Some(tangent) => cells.as_change_of(tangent, rest),
            None => cells,
        })
    }
}
