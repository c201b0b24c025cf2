//! Flat arrays of vectors, `(n, dimension)`.

/// Whether all are finite; a sum instead of a test for each, so that it vectorises.
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

/// Diagonal of the bounding box of points `(n, dimension)` [m]; zero without points.
pub(crate) fn bounding_diagonal(x: &[f64], dimension: usize) -> f64 {
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
