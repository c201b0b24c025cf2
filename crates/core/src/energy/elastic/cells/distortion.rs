//! Excess bending stiffness of a cell over the solid, due to its shape.

use super::hourglass::{RestModuli, dot, hourglass};
use super::rest::{CellRest, RestData};
use crate::algebra::Mat;
use crate::element::Isoparametric;
use crate::material::Tangent;

/// Returns the largest ratio, over pairs of axes of the cell, of its energy to that of the solid if the
/// nodes move like a solid that bends, `u = (x y, -x^2/2)` with `x` along one axis and `y` across it. The
/// ratio is 1 for parallelepipeds. The solid has Poisson's ratio 0.
pub fn bending_excess<const D: usize, const N: usize>(
    cell: &Isoparametric<D, N>,
    nodes: &[[f64; D]; N],
) -> f64 {
    let rest = CellRest::<f64, D, N>::new(cell, nodes);
    let tangent = Tangent::isotropic(0.0, 0.5);
    // Quadrature points in space, with their volumes, and the centroid.
    let points = cell.points.iter().map(|(xi, weight)| {
        let mut place = [0.0; D];
        for (shape, node) in (cell.shape)(xi).iter().zip(nodes) {
            (0..D).for_each(|i| place[i] += shape * node[i]);
        }
        (place, weight * cell.jacobian(nodes, xi).determinant())
    });
    let points: Vec<([f64; D], f64)> = points.collect();
    let mut centre = [0.0; D];
    for (place, part) in &points {
        (0..D).for_each(|i| centre[i] += part * place[i] / rest.volume);
    }
    let edges = cell.jacobian(nodes, &[0.0; D]).transpose();
    let mut most = 1.0f64;
    // Bending in the plane of each pair of axes of the cell.
    for (k, l) in (0..D).flat_map(|k| (0..D).map(move |l| (k, l))).filter(|(k, l)| k != l) {
        let length = |v: &[f64; D]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
        // Unit vectors along edge k and across it, in the plane of edges k and l.
        let along = edges[k].map(|c| c / length(&edges[k]));
        let part: f64 = edges[l].iter().zip(along).map(|(c, a)| c * a).sum();
        let mut across = edges[l];
        (0..D).for_each(|i| across[i] -= part * along[i]);
        let height = length(&across);
        let across = across.map(|c| c / height);
        let place = |point: &[f64; D]| {
            let at = |axis: &[f64; D]| (0..D).map(|i| (point[i] - centre[i]) * axis[i]).sum::<f64>();
            (at(&along), at(&across))
        };
        // Nodal displacements of the bending solid.
        let motion = nodes.map(|node| {
            let ((x, y), mut u) = (place(&node), [0.0; D]);
            (0..D).for_each(|i| u[i] = x * y * along[i] - 0.5 * x * x * across[i]);
            u
        });
        // Energy of the cell, and of the solid, whose strain is y along the axis.
        let (f, q): (Mat<f64, D>, _) = rest.measure(&motion);
        let y = hourglass((rest.volume, &rest.inverse), &RestModuli::new(&tangent), &q).by_amplitudes;
        let energy = rest.volume * tangent.apply(&f).dot(&f) + dot(&q, &y);
        let exact: f64 = points.iter().map(|(point, part)| part * place(point).1.powi(2)).sum();
        most = most.max(energy / exact);
    }
    most
}
