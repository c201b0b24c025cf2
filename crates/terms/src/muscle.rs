//! Active tension.

use pliant::element::{CellKind, CellVisitor, Isoparametric};
use pliant::energy::EnergyTerm;
use pliant::energy::elastic::points_of;
use pliant::energy::muscle::{ActiveTension, TensionField, cell_fibres, simplex_fibres};

use crate::lecture::left_out;
use crate::{IS_FOR_LECTURE, whole_cells};

/// Solid elements with a direction each.
#[derive(Clone, Debug)]
pub struct FibreSet<'a> {
    /// Name of the muscle, for messages.
    pub name: String,
    /// 2 or 3.
    pub dimension: usize,
    /// Kind of the cells; `None` for simplices.
    pub kind: Option<&'static CellKind>,
    /// Vertices of an element.
    pub nodes: usize,
    /// Vertices of the elements, flat `(elements, nodes)`; corners first.
    pub cells: &'a [u32],
    /// Rest positions of the whole system, flat `(n, dimension)` [m].
    pub rest: &'a [f64],
    /// Unit vector along the fibres of each element at rest, third component 0 in 2D.
    pub directions: &'a [[f64; 3]],
}

impl FibreSet<'_> {
    /// The direction of an element.
    fn along<const D: usize>(&self, element: usize) -> [f64; D] {
        let mut own = [0.0; D];
        own.copy_from_slice(&self.directions[element][..D]);
        own
    }
}

/// Muscles in these elements, as [`ActiveTension::new`] has them.
///
/// # Panics
/// If there are not as many directions as elements, or the cells are not whole ones.
pub fn muscle(fibres: FibreSet<'_>, tension: TensionField) -> Box<dyn EnergyTerm> {
    if IS_FOR_LECTURE {
        left_out();
    }
    assert_eq!(fibres.cells.len(), fibres.nodes * fibres.directions.len(), "a direction for each element");
    match (fibres.kind, fibres.dimension, fibres.nodes) {
        (Some(kind), ..) => kind.visit(CellMuscleMaker { fibres, tension }),
        (None, 2, 3) => simplices::<2, 3>(fibres, tension),
        (None, 2, _) => simplices::<2, 6>(fibres, tension),
        (None, _, 4) => simplices::<3, 4>(fibres, tension),
        (None, ..) => simplices::<3, 10>(fibres, tension),
    }
}

fn simplices<const D: usize, const N: usize>(
    set: FibreSet<'_>,
    tension: TensionField,
) -> Box<dyn EnergyTerm> {
    let (cells, rest) = (whole_cells::<N>(set.cells), set.rest);
    let fibres = |element: usize| {
        simplex_fibres::<D, N>(&points_of(rest, &cells[element]), |_| set.along::<D>(element))
    };
    Box::new(ActiveTension::<D, N>::new(set.name.clone(), cells, rest, fibres, tension))
}

/// Maker of muscles in cells of whatever kind is visited.
struct CellMuscleMaker<'a> {
    fibres: FibreSet<'a>,
    tension: TensionField,
}

impl CellVisitor for CellMuscleMaker<'_> {
    type Output = Box<dyn EnergyTerm>;

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Self::Output {
        let (set, rest) = (&self.fibres, self.fibres.rest);
        let cells = whole_cells::<N>(set.cells);
        let fibres = |element: usize| {
            cell_fibres(cell, &points_of(rest, &cells[element]), |_| set.along::<D>(element))
        };
        Box::new(ActiveTension::<D, N>::new(set.name.clone(), cells, rest, fibres, self.tension))
    }
}
