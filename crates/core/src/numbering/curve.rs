//! Orders along a space-filling curve: neighbours in space become neighbours in memory.

use rayon::prelude::*;

/// Returns the order in which a Hilbert curve visits points of shape `(n, D)`. Points in the same cell of the
/// curve's grid (`2^16` cells along the longest side of the bounding box) keep their order.
///
/// # Panics
/// If there are more than `u32::MAX` points.
pub fn along_curve<const D: usize>(points: &[[f64; D]]) -> Vec<u32> {
    let (mut low, mut high) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    for point in points {
        for c in 0..D {
            low[c] = low[c].min(point[c]);
            high[c] = high[c].max(point[c]);
        }
    }
    let extent = (0..D).fold(0.0, |extent: f64, c| extent.max(high[c] - low[c]));
    let scale = if extent > 0.0 { f64::from((1u32 << BITS) - 1) / extent } else { 0.0 };
    let count = u32::try_from(points.len()).expect("points are numbered with 32 bits");
    let mut keyed: Vec<(u64, u32)> = (0..count)
        .into_par_iter()
        .map(|i| {
            let point = &points[i as usize];
            let mut cell = [0u32; D];
            for c in 0..D {
                // The cast saturates: a coordinate that is no number lies in cell 0.
                cell[c] = ((point[c] - low[c]) * scale) as u32;
            }
            (position_on_curve(cell), i)
        })
        .collect();
    keyed.par_sort_unstable();
    keyed.into_iter().map(|(_, i)| i).collect()
}

/// Bits of a cell's coordinate.
const BITS: u32 = 16;

/// Position of a cell along the Hilbert curve; Skilling 2004, *Programming the Hilbert curve*, AIP Conference
/// Proceedings 707, 381, the transform from axes.
fn position_on_curve<const D: usize>(mut cell: [u32; D]) -> u64 {
    let highest = 1u32 << (BITS - 1);
    let mut bit = highest;
    while bit > 1 {
        let lower = bit - 1;
        for c in 0..D {
            if cell[c] & bit != 0 {
                cell[0] ^= lower;
            } else {
                let exchanged = (cell[0] ^ cell[c]) & lower;
                cell[0] ^= exchanged;
                cell[c] ^= exchanged;
            }
        }
        bit >>= 1;
    }
    for c in 1..D {
        cell[c] ^= cell[c - 1];
    }
    let mut turned = 0;
    bit = highest;
    while bit > 1 {
        if cell[D - 1] & bit != 0 {
            turned ^= bit - 1;
        }
        bit >>= 1;
    }
    let mut position = 0;
    for shift in (0..BITS).rev() {
        for component in cell {
            position = position << 1 | u64::from((component ^ turned) >> shift & 1);
        }
    }
    position
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a grid of `n` cells a side.
    fn grid<const D: usize>(n: usize) -> Vec<[f64; D]> {
        let point = |mut i: usize| {
            let mut point = [0.0; D];
            for c in &mut point {
                *c = (i % n) as f64;
                i /= n;
            }
            point
        };
        (0..n.pow(D as u32)).map(point).collect()
    }

    fn every_step_goes_to_a_neighbour<const D: usize>(n: usize) {
        let points = grid::<D>(n);
        let order = along_curve(&points);
        let mut seen = vec![false; points.len()];
        for &i in &order {
            assert!(!std::mem::replace(&mut seen[i as usize], true), "point {i} comes twice");
        }
        assert_eq!(order.len(), points.len());
        for pair in order.windows(2) {
            let (a, b) = (points[pair[0] as usize], points[pair[1] as usize]);
            let distance: f64 = (0..D).map(|c| (a[c] - b[c]).abs()).sum();
            assert_eq!(distance, 1.0, "from {a:?} to {b:?}");
        }
    }

    #[test]
    fn the_curve_visits_every_cell_and_never_jumps() {
        every_step_goes_to_a_neighbour::<2>(64);
        every_step_goes_to_a_neighbour::<3>(16);
    }

    #[test]
    fn points_at_one_place_keep_their_order() {
        assert_eq!(along_curve(&[[1.0, 2.0]; 5]), [0, 1, 2, 3, 4]);
        assert_eq!(along_curve::<3>(&[]), [0u32; 0]);
    }
}
