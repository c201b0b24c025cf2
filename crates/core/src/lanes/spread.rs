//! Conversion of packs to the numbers of one lane after the other.

use std::ops::Range;

use super::{Lanes, WIDTH};

/// Writes the numbers of `packs` in each of `lanes`, one lane after the other.
///
/// # Panics
/// If `out` has no room for them.
#[inline(always)]
pub fn spread<L: Lanes>(packs: &[L], lanes: Range<usize>, out: &mut [f64]) {
    let count = packs.len();
    let (tiles, rest) = packs.as_chunks::<WIDTH>();
    for (i, tile) in tiles.iter().enumerate() {
        let rows = L::transpose(*tile);
        for lane in lanes.clone() {
            let row = &mut out[(lane - lanes.start) * count..][..count];
            rows[lane].store(&mut row.as_chunks_mut().0[i]);
        }
    }
    for (i, pack) in rest.iter().enumerate() {
        let numbers = pack.to_array();
        for lane in lanes.clone() {
            out[(lane - lanes.start) * count + count - rest.len() + i] = numbers[lane];
        }
    }
}
