//! Vectors, and flat arrays of them, `(n, dimension)`.

use super::Vect;
use crate::scalar::Scalar;

/// Returns the mean of some points [m], third component 0 in 2D; `points` are flat `(n, dimension)`.
pub fn centre(points: &[f64], dimension: usize, corners: &[u32]) -> [f64; 3] {
    let mut centre = [0.0; 3];
    for corner in corners {
        let point = &points[*corner as usize * dimension..][..dimension];
        centre.iter_mut().zip(point).for_each(|(c, x)| *c += x / corners.len() as f64);
    }
    centre
}

/// Returns the dot product of two arrays of equal length, summed from the first element on.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Returns the dot product with fused sums: each product is added with one rounding.
#[inline(always)]
pub(crate) fn fused_dot<S: Scalar, const D: usize>(a: &Vect<S, D>, b: &Vect<S, D>) -> S {
    let mut sum = a[0] * b[0];
    for i in 1..D {
        sum = a[i].mul_add(b[i], sum);
    }
    sum
}

/// Returns the cross product `a x b`.
#[inline(always)]
pub fn cross<S: Scalar>(a: &Vect<S, 3>, b: &Vect<S, 3>) -> Vect<S, 3> {
    let mut product = [S::zero(); 3];
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        product[i] = a[j] * b[k] - a[k] * b[j];
    }
    product
}

/// Returns the unit vector along a vector, and its length. The unit vector of zero is NaN. The vector is
/// scaled by its largest component, because squares of small numbers underflow and those of large ones
/// overflow.
pub fn unit<S: Scalar, const D: usize>(vector: &Vect<S, D>) -> (Vect<S, D>, S) {
    let largest = vector.iter().fold(S::zero(), |largest, component| largest.max(component.abs()));
    let scaled = vector.map(|component| component / largest);
    let length = scaled.iter().fold(S::zero(), |sum, component| sum + *component * *component).sqrt();
    (scaled.map(|component| component / length), largest * length)
}

/// Returns the unit vector along two or three components of any size, the third 0 in 2D; `None` for zero, and
/// if a component is not finite.
pub fn direction(components: &[f64]) -> Option<[f64; 3]> {
    let mut vector = [0.0; 3];
    vector.iter_mut().zip(components).for_each(|(own, component)| *own = *component);
    let (along, _) = unit(&vector);
    along.iter().all(|component| component.is_finite()).then_some(along)
}

/// True if all values are finite; a sum instead of a test for each, so that it vectorises.
pub(crate) fn all_finite(values: &[f64]) -> bool {
    let mut sums = [0.0; 8];
    let chunks = values.chunks_exact(8);
    let rest: f64 = chunks.remainder().iter().map(|x| x * 0.0).sum();
    for chunk in chunks {
        for (sum, x) in sums.iter_mut().zip(chunk) {
            *sum += x * 0.0;
        }
    }
    // Zero times a finite number is zero, times anything else NaN.
    sums.iter().sum::<f64>() + rest == 0.0
}

/// Relative distance below which points coincide, as a fraction of their distance from the origin: rounding
/// of coordinates and of energies is a thousandth of it.
const ONE_POINT: f64 = 1e-12;

/// Returns the length scale of tolerances and energies [m]: the diagonal of the bounding box of points `(n,
/// dimension)`. For a single point, or several at one position, it is the distance from the origin along the
/// axis where they are farthest; at the origin, 1.
pub fn scene_size(x: &[f64], dimension: usize) -> f64 {
    let reach = x.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let diagonal = bounding_diagonal(x, dimension);
    if diagonal > ONE_POINT * reach {
        diagonal
    } else if reach > 0.0 {
        reach
    } else {
        1.0
    }
}

/// Diagonal of the bounding box of points `(n, dimension)` [m]; zero without points.
fn bounding_diagonal(x: &[f64], dimension: usize) -> f64 {
    let mut sum = 0.0;
    for c in 0..dimension {
        let component = || x.iter().skip(c).step_by(dimension);
        let low = component().fold(f64::INFINITY, |a, b| a.min(*b));
        let high = component().fold(f64::NEG_INFINITY, |a, b| a.max(*b));
        if high > low {
            sum += (high - low) * (high - low);
        }
    }
    sum.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_centre_is_the_mean_of_its_corners() {
        let points = [9.0, 9.0, 0.0, 0.0, 3.0, 0.0, 0.0, 6.0];
        assert_eq!(centre(&points, 2, &[1, 2, 3]), [1.0, 2.0, 0.0]);
    }

    #[test]
    fn units_of_tiny_and_huge_vectors_have_the_length_one() {
        for size in [1e-300, 1.0, 1e300] {
            let (along, length) = unit(&[3.0 * size, -4.0 * size]);
            assert!((along[0] - 0.6).abs() < 1e-15 && (along[1] + 0.8).abs() < 1e-15, "{along:?}");
            assert!((length / size - 5.0).abs() < 1e-14, "{length}");
        }
        assert!(unit(&[0.0; 3]).0.iter().all(|component| component.is_nan()));
    }

    #[test]
    fn directions_are_those_of_vectors_of_any_size() {
        let smallest = f64::from_bits(1);
        for size in [smallest, 1e-310, 1e-300, 1.0, 1e300, 0.25 * f64::MAX] {
            let along = direction(&[3.0 * size, -4.0 * size]).unwrap();
            let [x, y, z] = along;
            assert!((x - 0.6).abs() < 1e-13 && (y + 0.8).abs() < 1e-13 && z == 0.0, "{size:e}: {along:?}");
        }
        for none in [[0.0; 3], [f64::NAN, 1.0, 0.0], [f64::INFINITY, 1.0, 0.0]] {
            assert_eq!(direction(&none), None, "{none:?}");
        }
    }
}
