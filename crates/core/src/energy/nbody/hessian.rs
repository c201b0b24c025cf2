//! Second derivatives of pair gravity, for implicit integrators with few particles.

use crate::lanes::WIDTH;
use crate::material::Psd;

/// Number of particles up to which every pair has a block in the matrix, which would be large and dense
/// for more.
pub(super) const MAX_PARTICLES: usize = 256;

/// Returns every pair `i < j` of `particles` particles.
pub(super) fn pairs(particles: usize) -> Vec<[u32; 2]> {
    let count = particles as u32;
    (0..count).flat_map(|i| (i + 1..count).map(move |j| [i, j])).collect()
}

/// Writes the blocks `00, 01, 11` of the Hessian of `E = -k/s`, `s^2 = |d|^2 + softening^2`, for a pair with
/// separation `d`: `k (I/s^3 - 3 d d^T / s^5)` at either end, minus that between them. Along the line of
/// separation it is negative except at very small distances: the projection removes that part.
pub(super) fn pair_hessian<const D: usize>(d: [f64; D], k: f64, softening2: f64, psd: Psd, out: &mut [f64]) {
    let square: f64 = d.iter().map(|d| d * d).sum();
    let s2 = square + softening2;
    let across = k / (s2 * s2.sqrt());
    let mut along = -3.0 * across / s2;
    if psd == Psd::Projected && across + along * square < 0.0 {
        along = if square > 0.0 { -across / square } else { 0.0 };
    }
    for i in 0..D {
        for j in 0..D {
            let entry = along * d[i] * d[j] + if i == j { across } else { 0.0 };
            out[i * D + j] = entry;
            out[D * D + i * D + j] = -entry;
            out[2 * D * D + i * D + j] = entry;
        }
    }
}

/// Returns the mass of particle `i`.
pub(super) fn mass_of(mass: &[[f64; WIDTH]], i: u32) -> f64 {
    mass[i as usize / WIDTH][i as usize % WIDTH]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masses_are_found_in_their_packs() {
        let flat: Vec<f64> = (0..3 * WIDTH).map(|i| i as f64).collect();
        let packs = flat.as_chunks::<WIDTH>().0;
        (0..flat.len()).for_each(|i| assert_eq!(mass_of(packs, i as u32), flat[i]));
    }
}
