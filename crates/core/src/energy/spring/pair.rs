//! Individual springs, for their Hessians.

use crate::material::Psd;

/// One spring.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spring {
    /// Global vertices of its ends.
    pub(super) ends: [u32; 2],
    /// Stiffness [N/m].
    pub(super) stiffness: f64,
    /// Rest length [m].
    pub(super) rest_length: f64,
}

/// Writes the blocks `00, 01, 11` of the Hessians: with `n = (x_1 - x_2)/l` the block is `k (n n^T + (1 -
/// l0/l) (I - n n^T))` at either end, and minus that between them. Across a compressed spring the second
/// eigenvalue is negative: the projection removes it. Source: Choi, Ko 2002, "Stable but responsive cloth",
/// section 3.
pub(super) fn hessians<const D: usize>(springs: &[Spring], x: &[f64], psd: Psd, out: &mut [f64]) {
    let x = x.as_chunks::<D>().0;
    for (spring, out) in springs.iter().zip(out.chunks_exact_mut(3 * D * D)) {
        let [a, b] = spring.ends.map(|v| &x[v as usize]);
        let mut n = [0.0; D];
        let mut square = 0.0;
        for c in 0..D {
            n[c] = a[c] - b[c];
            square += n[c] * n[c];
        }
        let length = square.sqrt();
        // A spring of length zero has no direction and no force; its tangent is taken as that of a taut
        // one.
        let across = if length > 0.0 { 1.0 - spring.rest_length / length } else { 1.0 };
        let across = if psd == Psd::Projected && across < 0.0 { 0.0 } else { across };
        let along = if length > 0.0 { (1.0 - across) / square } else { 0.0 };
        for i in 0..D {
            for j in 0..D {
                let unit = if i == j { across } else { 0.0 };
                let entry = spring.stiffness * (unit + along * n[i] * n[j]);
                out[i * D + j] = entry;
                out[D * D + i * D + j] = -entry;
                out[2 * D * D + i * D + j] = entry;
            }
        }
    }
}
