//! Least squares of polynomials in space.

use nalgebra::DMatrix;

use super::cells::{Point, TENSOR, Tensor};

/// Terms of a polynomial in the coordinates of space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Terms {
    /// All products of coordinates up to this degree.
    Complete(i32),
    /// Degree 2, and the cubic products of different coordinates: `x^2 y`, `x y^2`, in 3D also `x y z`.
    MixedCubic,
}

impl Terms {
    /// Returns the exponents of the coordinates in each term.
    fn exponents(self, dimension: usize) -> Vec<[i32; 3]> {
        let degree = match self {
            Terms::Complete(degree) => degree,
            Terms::MixedCubic => 3,
        };
        let most = [0, 1, 2].map(|k| if k < dimension { degree } else { 0 });
        let mut all = vec![];
        for total in 0..=degree {
            for i in 0..=most[0] {
                for j in 0..=most[1] {
                    let k = total - i - j;
                    let is_pure = [i, j, k].contains(&3) && self == Terms::MixedCubic;
                    if (0..=most[2]).contains(&k) && !is_pure {
                        all.push([i, j, k]);
                    }
                }
            }
        }
        all
    }
}

/// Coordinates of a patch: relative to its origin, along its axes, as fractions of its size along each.
#[derive(Clone, Copy, Debug)]
pub(super) struct FitFrame {
    pub(super) origin: Point,
    /// Unit vectors, one row each.
    pub(super) axes: [Point; 3],
    size: Point,
}

impl FitFrame {
    /// Creates a frame for these points.
    pub(super) fn new(origin: Point, axes: [Point; 3], points: &[Point]) -> Self {
        let unscaled = FitFrame { origin, axes, size: [1.0; 3] };
        let mut size: Point = [0.0; 3];
        for point in points {
            let local = unscaled.local(point);
            (0..3).for_each(|k| size[k] = size[k].max(local[k].abs()));
        }
        FitFrame { size: size.map(|size| if size > 0.0 { size } else { 1.0 }), ..unscaled }
    }

    fn local(&self, point: &Point) -> Point {
        let arm = [0, 1, 2].map(|c| point[c] - self.origin[c]);
        [0, 1, 2].map(|k| (0..3).map(|c| self.axes[k][c] * arm[c]).sum::<f64>() / self.size[k])
    }
}

/// Axes of space.
pub(super) const AXES: [Point; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Polynomial with values that are tensors.
#[derive(Clone, Debug)]
pub(super) struct TensorPolynomial {
    frame: FitFrame,
    exponents: Vec<[i32; 3]>,
    coefficients: Vec<Tensor>,
}

/// Ratio of the smallest to the largest diagonal entry of the triangular factor below which points do not
/// determine the coefficients.
const RANK: f64 = 1e-8;

impl TensorPolynomial {
    /// Fits the first of the `choices` that the points determine, by least squares, Householder's QR.
    /// Returns the polynomial and the number of choices skipped; `None` without points.
    pub(super) fn fitted(
        frame: FitFrame,
        dimension: usize,
        choices: &[Terms],
        (points, values): (&[Point], &[Tensor]),
    ) -> Option<(Self, usize)> {
        let local: Vec<Point> = points.iter().map(|point| frame.local(point)).collect();
        choices.iter().enumerate().find_map(|(skipped, terms)| {
            let exponents = terms.exponents(dimension);
            let coefficients = least_squares(&exponents, &local, values)?;
            Some((TensorPolynomial { frame, exponents, coefficients }, skipped))
        })
    }

    /// Returns the value at a point.
    pub(super) fn at(&self, point: &Point) -> Tensor {
        let local = self.frame.local(point);
        let mut sum = [0.0; TENSOR];
        for (exponents, coefficient) in self.exponents.iter().zip(&self.coefficients) {
            let term = monomial(exponents, &local);
            sum.iter_mut().zip(coefficient).for_each(|(sum, c)| *sum += term * c);
        }
        sum
    }
}

fn monomial(exponents: &[i32; 3], at: &Point) -> f64 {
    exponents.iter().zip(at).map(|(exponent, x)| x.powi(*exponent)).product()
}

/// Returns the coefficients of the terms; `None` if the points do not determine them.
fn least_squares(exponents: &[[i32; 3]], points: &[Point], values: &[Tensor]) -> Option<Vec<Tensor>> {
    let (rows, columns) = (points.len(), exponents.len());
    if rows < columns {
        return None;
    }
    let matrix = DMatrix::from_fn(rows, columns, |i, j| monomial(&exponents[j], &points[i]));
    let mut right = DMatrix::from_fn(rows, TENSOR, |i, c| values[i][c]);
    let qr = matrix.qr();
    let r = qr.r();
    let sizes = r.diagonal().map(f64::abs);
    // A matrix with a column of zeros and one that is not finite are refused, too.
    if sizes.min().partial_cmp(&(RANK * sizes.max())) != Some(std::cmp::Ordering::Greater) {
        return None;
    }
    qr.q_tr_mul(&mut right);
    let solution = r.solve_upper_triangular(&right.rows(0, columns))?;
    Some((0..columns).map(|j| std::array::from_fn(|c| solution[(j, c)])).collect())
}
