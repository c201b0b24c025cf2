//! Flat arrays of vectors, `(n, dimension)`.

/// True if all are finite; a sum instead of a test for each, so that it vectorises.
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

/// Points are one point where they differ by less than this part of their distance from the origin: rounding,
/// of coordinates and of energies, is a thousandth of it.
const ONE_POINT: f64 = 1e-12;

/// The length that tolerances and energies go by [m]: the diagonal of the bounding box of points `(n,
/// dimension)`; of a single point, or several at one place, its distance from the origin along the axis where
/// it is farthest; at the origin, 1.
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
