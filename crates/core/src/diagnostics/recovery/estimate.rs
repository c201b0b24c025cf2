//! Estimate of the error of stresses by Zienkiewicz and Zhu.

use nalgebra::DMatrix;

use super::cells::{Cells, NodalRows, SampledConfiguration, Tensor, row_of, weighted};
use super::reference::ShapeValues;
use super::{Recovery, recovered, tensor};
use crate::algebra::Mat;
use crate::energy::{ElementTerm, EvaluatedElement};
use crate::material::Tangent;

/// Estimated error of the stress in energy norms, the difference from a recovered stress:
/// `eta_K^2 = integral over K of (P* - P) : C^-1 : (P* - P)`, with the first Piola stress `P` of the
/// elements, the recovered one `P*` and the tangent `C = dP/dF` at the centre of the element, without the
/// directions in which it is not positive. In a linear material this is the estimate of Zienkiewicz, Zhu
/// 1992, part 1, equation 5. In 2D all values are per unit thickness.
///
/// Estimates of singular solutions, as at re-entrant corners, are too low by a fifth on any mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct StressError {
    /// `eta_K` of every element, body after body, each in the order of the mesh [sqrt(J)].
    pub elements: Vec<f64>,
    /// `eta = (sum eta_K^2)^1/2` [sqrt(J)].
    pub total: f64,
    /// Energy norm of the solution, `|u|_E = (2 integral of psi)^1/2` [sqrt(J)].
    pub norm: f64,
}

impl StressError {
    /// Returns `eta / (|u|_E^2 + eta^2)^1/2`; zero without deformation.
    pub fn relative(&self) -> f64 {
        let whole = self.norm.hypot(self.total);
        if whole > 0.0 { self.total / whole } else { 0.0 }
    }
}

/// Estimates the error of the stress of these terms; `None` if elements have no tangent, as membranes.
pub(crate) fn stress_error<'a>(
    terms: impl Iterator<Item = &'a dyn ElementTerm>,
    at: SampledConfiguration<'_>,
    recovery: Recovery,
) -> Option<StressError> {
    distance(terms, at, |cells| {
        let NodalRows { vertices, values, .. } = recovered(cells, recovery);
        move |points: &PointsOfCell<'_>| {
            let nodes = points.vertices.len();
            let at_nodes: Vec<Tensor> = match recovery {
                Recovery::Element => values[points.cell * nodes..][..nodes].to_vec(),
                Recovery::Average | Recovery::Patch => {
                    points.vertices.iter().map(|vertex| values[row_of(&vertices, *vertex)]).collect()
                }
            };
            points.shapes.iter().map(|shape| weighted(&shape.values, &at_nodes)).collect()
        }
    })
}

/// Points of a cell.
pub(super) struct PointsOfCell<'a> {
    /// Number of the cell in the mesh.
    cell: usize,
    /// Nodes of the cell, in the order of the scene.
    pub(super) vertices: &'a [u32],
    /// Shape functions at the points.
    pub(super) shapes: &'a [ShapeValues],
}

/// Returns the distance of the first Piola stress from another field in the energy norm. The function
/// that `field` returns for the cells of a term gives that field [Pa] at points of a cell.
pub(super) fn distance<'a, F: Fn(&PointsOfCell<'_>) -> Vec<Tensor>>(
    terms: impl Iterator<Item = &'a dyn ElementTerm>,
    at: SampledConfiguration<'_>,
    field: impl Fn(&Cells) -> F,
) -> Option<StressError> {
    let (mut squares, mut norm) = (vec![], 0.0);
    for term in terms {
        let cells = Cells::sampled(term, at, |state| state.first_piola)?;
        norm += add_squares(term, &cells, &field(&cells), &mut squares)?;
    }
    let total = squares.iter().sum::<f64>().sqrt();
    let elements = squares.into_iter().map(f64::sqrt).collect();
    Some(StressError { elements, total, norm: norm.sqrt() })
}

/// Appends `eta_K^2` of the elements of a term. Returns `|u|_E^2`.
fn add_squares(
    term: &dyn ElementTerm,
    cells: &Cells,
    field: &dyn Fn(&PointsOfCell<'_>) -> Vec<Tensor>,
    squares: &mut Vec<f64>,
) -> Option<f64> {
    let (element, at, nodes) = (&cells.element, cells.at, cells.element.nodes.len());
    if element.is_sheet {
        return None;
    }
    let (points, weights): (Vec<_>, Vec<_>) = element.rule().into_iter().unzip();
    let shapes: Vec<_> = points.iter().map(|point| element.shape(point)).collect();
    let first = squares.len();
    squares.resize(first + term.element_count(), 0.0);
    let (mut norm, mut has_tangents, mut inverse) = (0.0, true, TangentInverse::default());
    term.each_at(at.x, &points, &mut |EvaluatedElement { number, states, tangent, .. }| {
        let Some(tangent) = tangent() else {
            has_tangents = false;
            return;
        };
        let compliance = inverse.of(&tangent);
        let own = &cells.vertices[number * nodes..][..nodes];
        let better = field(&PointsOfCell { cell: number, vertices: own, shapes: &shapes });
        for (((state, shape), weight), better) in states.iter().zip(&shapes).zip(&weights).zip(&better) {
            let volume = weight * element.content() * jacobian(&shape.slopes, own, at);
            let change = tensor(better) - state.first_piola;
            squares[first + number] += volume * compliance.apply(&change).dot(&change);
            norm += 2.0 * volume * state.energy_density;
        }
    });
    has_tangents.then_some(norm)
}

/// Returns the determinant of the derivative of the reference position by the reference coordinates.
fn jacobian(slopes: &[[f64; 3]], vertices: &[u32], at: SampledConfiguration<'_>) -> f64 {
    let mut j = if at.dimension == 2 { Mat::diagonal(&[0.0, 0.0, 1.0]) } else { Mat::zero() };
    for (vertex, slope) in vertices.iter().zip(slopes) {
        let point = at.rest_point(*vertex);
        for (i, k) in (0..3).flat_map(|i| (0..3).map(move |k| (i, k))) {
            j[i][k] += point[i] * slope[k];
        }
    }
    j.determinant()
}

/// Pseudo-inverse of the last tangent: elements of a linear material share it.
#[derive(Default)]
struct TangentInverse(Option<(Tangent<3>, Tangent<3>)>);

/// Fraction of the largest eigenvalue of a tangent below which others count as zero, such as those of
/// rotations.
const LEAST: f64 = 1e-9;

impl TangentInverse {
    /// Returns the pseudo-inverse of the positive part of a tangent.
    fn of(&mut self, tangent: &Tangent<3>) -> Tangent<3> {
        if let Some((last, inverse)) = &self.0
            && last == tangent
        {
            return *inverse;
        }
        let entry = |row: usize, column: usize| tangent.0[row / 3][row % 3][column / 3][column % 3];
        let matrix = DMatrix::from_fn(9, 9, |row, column| 0.5 * (entry(row, column) + entry(column, row)));
        let mut inverse = Tangent::zero();
        if matrix.iter().all(|entry| entry.is_finite()) {
            let eigen = matrix.symmetric_eigen();
            let least = LEAST * eigen.eigenvalues.amax();
            for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
                if *value > least {
                    for (row, column) in (0..9).flat_map(|row| (0..9).map(move |column| (row, column))) {
                        let part = vector[row] * vector[column] / value;
                        inverse.0[row / 3][row % 3][column / 3][column % 3] += part;
                    }
                }
            }
        }
        self.0 = Some((*tangent, inverse));
        inverse
    }
}
