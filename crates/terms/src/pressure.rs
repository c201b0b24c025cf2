//! Pressure on faces, by the number of dimensions and of nodes.

use pliant::energy::EnergyTerm;
use pliant::energy::load::{Pressure, PressureField};

use crate::whole_cells;

/// Pressure on faces of `nodes` vertices of the system, flat `(faces, nodes)`, as [`Pressure::new`] has it:
/// edges of 2 or 3 nodes in the plane, in space triangles of 3 or 6 and quadrilaterals of 4.
///
/// # Panics
/// If the faces are not whole ones, or there is no face of so many nodes.
pub fn pressure(
    (dimension, nodes): (usize, usize),
    name: String,
    faces: &[u32],
    rest: &[f64],
    rim_stays: bool,
    field: PressureField,
) -> Box<dyn EnergyTerm> {
    match (dimension, nodes) {
        (2, 2) => Box::new(Pressure::<2, 2>::new(name, whole_cells(faces), rest, rim_stays, field)),
        (2, 3) => Box::new(Pressure::<2, 3>::new(name, whole_cells(faces), rest, rim_stays, field)),
        (3, 3) => Box::new(Pressure::<3, 3>::new(name, whole_cells(faces), rest, rim_stays, field)),
        (3, 4) => Box::new(Pressure::<3, 4>::new(name, whole_cells(faces), rest, rim_stays, field)),
        (3, 8) => Box::new(Pressure::<3, 8>::new(name, whole_cells(faces), rest, rim_stays, field)),
        (3, 9) => Box::new(Pressure::<3, 9>::new(name, whole_cells(faces), rest, rim_stays, field)),
        (3, 6) => Box::new(Pressure::<3, 6>::new(name, whole_cells(faces), rest, rim_stays, field)),
        _ => panic!("no face of {nodes} nodes in {dimension} dimensions"),
    }
}
