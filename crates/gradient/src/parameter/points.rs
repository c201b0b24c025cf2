//! Quadrature points of elements in the reference configuration: simplices of first and second order, and
//! isoparametric elements.

use pliant::element::{
    Isoparametric, QuadraturePoint, quadrature_count, quadrature_points, quadrature_position, shape_functions,
};
use pliant::energy::elastic::points_of;

/// Points of a quadrature rule in every element, element by element.
#[derive(Clone)]
pub(super) struct VolumePoints<const D: usize, const N: usize> {
    pub(super) points: Vec<QuadraturePoint<D, N>>,
    /// Values of the shape functions at these points, the same in all elements.
    pub(super) values: Vec<[f64; N]>,
}

impl<const D: usize, const N: usize> VolumePoints<D, N> {
    /// Points of no elements.
    pub(super) fn none() -> Self {
        VolumePoints { points: vec![], values: vec![] }
    }

    /// Points of elements with reference positions `rest`, flat [m], for a rule of positions and volume
    /// fractions.
    pub(super) fn new(elements: &[[u32; N]], rest: &[f64], rule: &[([f64; 4], f64)]) -> Self {
        let of_element = |element: &[u32; N]| {
            let nodes = points_of(rest, element);
            rule.iter().map(|(at, part)| QuadraturePoint::new(&nodes, at, *part)).collect::<Vec<_>>()
        };
        VolumePoints {
            points: elements.iter().flat_map(of_element).collect(),
            values: rule.iter().map(|(at, _)| shape_functions::<D, N>(at)).collect(),
        }
    }

    /// Quadrature points of the energy of isoparametric elements with reference positions `rest`.
    pub(super) fn of_cells(elements: &[[u32; N]], rest: &[f64], cell: &Isoparametric<D, N>) -> Self {
        let of_cell = |vertices: &[u32; N]| {
            let nodes = points_of(rest, vertices);
            let point = move |(xi, weight): &([f64; D], f64)| {
                let j = cell.jacobian(&nodes, xi);
                let transposed = j.inverse().transpose();
                let gradients = (cell.slopes)(xi).map(|slope| transposed.mul_vec(&slope));
                QuadraturePoint { weight: weight * j.determinant(), gradients }
            };
            cell.points.iter().map(point).collect::<Vec<_>>()
        };
        VolumePoints {
            points: elements.iter().flat_map(of_cell).collect(),
            values: cell.points.iter().map(|(xi, _)| (cell.shape)(xi)).collect(),
        }
    }

    /// Quadrature points of the energy of simplices.
    pub(super) fn of_energy(elements: &[[u32; N]], rest: &[f64]) -> Self {
        let of_element =
            |element: &[u32; N]| quadrature_points(&points_of(rest, element)).collect::<Vec<_>>();
        let values = |q| shape_functions::<D, N>(&quadrature_position::<D, N>(q));
        VolumePoints {
            points: elements.iter().flat_map(of_element).collect(),
            values: (0..quadrature_count::<D, N>()).map(values).collect(),
        }
    }

    /// Reference positions of all points, third component 0 in 2D [m].
    pub(super) fn places(&self, elements: &[[u32; N]], rest: &[f64]) -> Vec<[f64; 3]> {
        let of_element = |element: &[u32; N]| {
            let nodes = points_of::<D, N>(rest, element);
            let place = move |values: &[f64; N]| {
                let mut place = [0.0; 3];
                place[..D].copy_from_slice(&mean(&nodes, values));
                place
            };
            self.values.iter().map(place).collect::<Vec<_>>()
        };
        elements.iter().flat_map(of_element).collect()
    }

    /// Points of element `i` with the values of the shape functions.
    pub(super) fn of(&self, i: usize) -> impl Iterator<Item = (&QuadraturePoint<D, N>, &[f64; N])> {
        self.all_of(i).iter().zip(&self.values)
    }

    /// Points of element `i`.
    pub(super) fn all_of(&self, i: usize) -> &[QuadraturePoint<D, N>] {
        let count = self.values.len();
        if count == 0 { &[] } else { &self.points[i * count..][..count] }
    }
}

/// Interpolation `sum_a n_a r_a` of the rows of an element's nodes.
pub(super) fn mean<const D: usize, const N: usize>(rows: &[[f64; D]; N], values: &[f64; N]) -> [f64; D] {
    let mut sum = [0.0; D];
    for (row, n) in rows.iter().zip(values) {
        sum.iter_mut().zip(row).for_each(|(sum, row)| *sum += n * row);
    }
    sum
}
