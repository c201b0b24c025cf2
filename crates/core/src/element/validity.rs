//! Validity of curved elements: `det J > 0` in the whole element, not only at some points.
//!
//! `J` is linear in the coordinates of a second-order simplex, so `det J` is a polynomial of degree `D`.
//! The least of its Bernstein coefficients is a lower bound; the coefficients at corners are values. The
//! coefficient of `(i, j[, k])` is the mean of `det [J_i e_1, J_j e_2[, J_k e_3]]` over all orders of
//! `i, j[, k]`, with `J_i` at corner `i`. If the bound is loose the element is halved. Source: Johnen,
//! Remacle, Geuzaine 2013, *Geometrical validity of curvilinear finite elements*, Journal of
//! Computational Physics 233, 359.

use super::mass::is_straight;
use super::quadrature::{content, factorial};
use super::shape::{is_simplex, jacobian};
use crate::algebra::Mat;

/// Limit on the parts that an element is cut into; only a `det J` that touches zero needs more.
const MOST_PARTS: usize = 2000;

/// Returns a lower bound of `det J` over the element, relative to its mean: 1 for straight elements. A
/// positive bound means a valid element; if an element is valid by more than a millionth, the bound is
/// positive. The bound is within 1/100 of the least value.
///
/// Returns -1 for elements that are inverted as a whole, and NaN without volume or if a coordinate is
/// NaN.
pub fn least_jacobian<const D: usize, const N: usize>(rest: &[[f64; D]; N]) -> f64 {
    let mean = factorial::<D>() * volume(rest);
    if mean.is_nan() || mean <= 0.0 {
        return mean.min(0.0) / mean.abs();
    }
    if is_straight(rest) {
        return 1.0;
    }
    let corners = corner_jacobians(rest);
    let least = bounds(corners.clone(), 0.01 * mean);
    // Only the sign of a value near zero needs many parts.
    if least > 0.0 || least < -0.01 * mean { least / mean } else { bounds(corners, 1e-6 * mean) / mean }
}

/// Returns the signed area [m^2] or volume [m^3] of a simplex with curved sides, or of a second-order
/// parallelepiped, exact up to rounding.
pub fn volume<const D: usize, const N: usize>(rest: &[[f64; D]; N]) -> f64 {
    if is_straight(rest) {
        return content::<D, N>(jacobian(rest, &some_place::<D, N>()).determinant());
    }
    // The mean of a polynomial over a simplex is the mean of its Bernstein coefficients.
    let coefficients = bernstein(&corner_jacobians(rest));
    coefficients.iter().sum::<f64>() / (coefficients.len() as f64 * factorial::<D>())
}

/// Returns some position in an element: the first corner of a simplex, the middle of another cell.
fn some_place<const D: usize, const N: usize>() -> [f64; 4] {
    if is_simplex::<D, N>() { [1.0, 0.0, 0.0, 0.0] } else { [0.0; 4] }
}

fn corner_jacobians<const D: usize, const N: usize>(rest: &[[f64; D]; N]) -> Vec<Mat<f64, D>> {
    let corner = |i: usize| {
        let mut lambda = [0.0; 4];
        lambda[i] = 1.0;
        jacobian(rest, &lambda)
    };
    (0..=D).map(corner).collect()
}

/// Returns a lower bound of the least `det J`, within `gap` of it unless that takes too many parts.
fn bounds<const D: usize>(corners: Vec<Mat<f64, D>>, gap: f64) -> f64 {
    let mut parts = vec![corners];
    let (mut least_value, mut least_bound) = (f64::INFINITY, f64::INFINITY);
    let mut looked_at = 0;
    while let Some(part) = parts.pop() {
        looked_at += 1;
        let bound = bernstein(&part).into_iter().fold(f64::INFINITY, f64::min);
        least_value = part.iter().map(Mat::determinant).fold(least_value, f64::min);
        if bound >= least_value - gap || looked_at > MOST_PARTS {
            least_bound = least_bound.min(bound);
            continue;
        }
        let (mut longest, mut ends) = (-1.0, [0, 1]);
        for i in 0..=D {
            for j in i + 1..=D {
                let difference = (part[i] - part[j]).norm_squared();
                if difference > longest {
                    (longest, ends) = (difference, [i, j]);
                }
            }
        }
        let middle = (part[ends[0]] + part[ends[1]]).scale(0.5);
        for end in ends {
            let mut half = part.clone();
            half[end] = middle;
            parts.push(half);
        }
    }
    least_bound
}

/// Returns the Bernstein coefficients of `det J` on the simplex with these Jacobians at its corners, one
/// for each multiset of `D` corners.
fn bernstein<const D: usize>(corners: &[Mat<f64, D>]) -> Vec<f64> {
    let mixed = |columns: [usize; 3]| {
        let mut m = Mat::<f64, D>::zero();
        for c in 0..D {
            for r in 0..D {
                m[r][c] = corners[columns[c]][r][c];
            }
        }
        m.determinant()
    };
    let mut coefficients = vec![];
    for i in 0..=D {
        for j in i..=D {
            if D == 2 {
                coefficients.push(0.5 * (mixed([i, j, 0]) + mixed([j, i, 0])));
                continue;
            }
            for k in j..=D {
                let orders = [[i, j, k], [j, k, i], [k, i, j], [i, k, j], [k, j, i], [j, i, k]];
                coefficients.push(orders.into_iter().map(mixed).sum::<f64>() / 6.0);
            }
        }
    }
    coefficients
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::algebra::tests::sample::Random;
    use crate::element::shape::tests::inside;
    use crate::element::shape::{middle_edges, order};

    /// Returns a straight element that is not at the origin.
    pub(crate) fn regular<const D: usize, const N: usize>(size: f64) -> [[f64; D]; N] {
        let mut rest = [[0.3; D]; N];
        for c in 0..D {
            rest[c + 1][c] += size;
            rest[c + 1][0] += 0.1 * size;
        }
        for (k, &[i, j]) in middle_edges::<D, N>().iter().enumerate() {
            rest[D + 1 + k] = std::array::from_fn(|c| 0.5 * (rest[i][c] + rest[j][c]));
        }
        rest
    }

    /// Returns such an element with its mid-edge nodes moved by up to `amplitude`.
    pub(crate) fn curved<const D: usize, const N: usize>(amplitude: f64) -> [[f64; D]; N] {
        let (mut rest, mut random) = (regular::<D, N>(1.0), Random(7));
        for node in &mut rest[D + 1..] {
            node.iter_mut().for_each(|x| *x += random.uniform(-amplitude, amplitude));
        }
        rest
    }

    fn is_a_bound<const D: usize, const N: usize>() {
        assert_eq!(order::<D, N>(), 2);
        assert_eq!(least_jacobian(&regular::<D, N>(3.0)), 1.0);
        let (mut valid, mut invalid) = (0, 0);
        for amplitude in [0.01, 0.05, 0.1, 0.2, 0.5, 0.8] {
            let rest = curved::<D, N>(amplitude);
            let least = least_jacobian(&rest);
            let mut random = Random(11);
            let mut sampled = f64::INFINITY;
            for n in 0..20_000 {
                let mut lambda = inside::<D>(&mut random);
                if n <= D {
                    lambda = [0.0; 4];
                    lambda[n] = 1.0;
                }
                sampled = sampled.min(jacobian(&rest, &lambda).determinant());
            }
            // The mean, from a rule that integrates it exactly.
            let rule = crate::element::mass_rule::<D, N>();
            let mean: f64 = rule.iter().map(|(l, w)| w * jacobian(&rest, l).determinant()).sum();
            assert!((mean / factorial::<D>() / volume(&rest) - 1.0).abs() < 1e-14);
            let sampled = sampled / mean;
            assert!(least <= sampled + 1e-14, "{D}D, {amplitude}: {least} is above {sampled}");
            assert!(least > sampled - 0.03, "{D}D, {amplitude}: {least} is far below {sampled}");
            if least > 0.0 { valid += 1 } else { invalid += 1 }
        }
        assert!(valid > 2 && invalid > 0, "{valid} valid, {invalid} invalid");
    }

    #[test]
    fn the_least_jacobian_is_a_close_lower_bound() {
        is_a_bound::<2, 6>();
        is_a_bound::<3, 10>();
    }

    /// A mid-edge node at a quarter of its edge: `det J` is 0 at a corner and positive elsewhere,
    /// quadrature points included.
    #[test]
    fn a_middle_at_a_quarter_of_its_edge_is_no_element_though_every_quadrature_point_is_fine() {
        let at = |t: f64| [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [t, 0.0], [0.5, 0.5], [0.0, 0.5]];
        assert!(least_jacobian(&at(0.3)) > 0.0 && least_jacobian(&at(0.25)) <= 0.0);
        assert!(least_jacobian(&at(0.2)) < 0.0);
        for q in 0..3 {
            let lambda = crate::element::quadrature_position::<2, 6>(q);
            assert!(jacobian(&at(0.2), &lambda).determinant() > 0.0);
        }
    }

    #[test]
    fn elements_inside_out_or_without_numbers_have_no_positive_bound() {
        let mut rest = regular::<2, 6>(1.0);
        rest.swap(0, 1);
        rest.swap(4, 5);
        assert_eq!(least_jacobian(&rest), -1.0);
        rest[3][0] = f64::NAN;
        assert!(least_jacobian(&rest).is_nan());
        assert!(least_jacobian(&[[0.0; 3]; 10]).is_nan());
    }
}
