//! Derivatives of a stress, given by the material or found by differences.

use super::BatchMaterial;
use crate::algebra::project_positive;
use crate::material::Psd;

/// Step of central differences, relative to the deformation: the cube root of the rounding of a double,
/// where the errors of truncation and of rounding are about equal, 1e-11 of the stiffness each.
const STEP: f64 = 6e-6;

/// Returns `dP_ij/dF_kl` at each deformation gradient, symmetric, `(m, d*d, d*d)`; NaN if the material
/// could not be evaluated. [`Psd::Projected`] gives the nearest positive semi-definite matrices.
pub(super) fn tangents<const D: usize>(material: &dyn BatchMaterial, f: &[f64], psd: Psd) -> Vec<f64> {
    let block = D * D;
    let mut tangents = vec![0.0; f.len() * block];
    match material.tangent(f, &mut tangents) {
        Some(true) => {}
        Some(false) => tangents.fill(f64::NAN),
        None => {
            // Column by column from differences along the unit matrices.
            let mut change = vec![0.0; f.len()];
            for kl in 0..block {
                change.chunks_exact_mut(block).for_each(|change| {
                    change.fill(0.0);
                    change[kl] = 1.0;
                });
                difference::<D>(material, f, &mut change);
                for (tangent, column) in
                    tangents.chunks_exact_mut(block * block).zip(change.chunks_exact(block))
                {
                    (0..block).for_each(|ij| tangent[ij * block + kl] = column[ij]);
                }
            }
        }
    }
    // Symmetrise, then project.
    for tangent in tangents.chunks_exact_mut(block * block) {
        for i in 0..block {
            for j in 0..i {
                let mean = 0.5 * (tangent[i * block + j] + tangent[j * block + i]);
                (tangent[i * block + j], tangent[j * block + i]) = (mean, mean);
            }
        }
        if psd == Psd::Projected {
            project_positive(tangent, block);
        }
    }
    tangents
}

/// Replaces the change of each deformation gradient by the change of its stress.
pub(super) fn along<const D: usize>(material: &dyn BatchMaterial, f: &[f64], change: &mut [f64]) {
    let block = D * D;
    let mut tangents = vec![0.0; f.len() * block];
    match material.tangent(f, &mut tangents) {
        Some(true) => {}
        Some(false) => return change.fill(f64::NAN),
        None => return difference::<D>(material, f, change),
    }
    for (change, tangent) in change.chunks_exact_mut(block).zip(tangents.chunks_exact(block * block)) {
        let along: Vec<f64> = tangent
            .chunks_exact(block)
            .map(|row| row.iter().zip(&*change).map(|(entry, change)| entry * change).sum())
            .collect();
        change.copy_from_slice(&along);
    }
}

/// Computes the same by central differences.
fn difference<const D: usize>(material: &dyn BatchMaterial, f: &[f64], change: &mut [f64]) {
    let block = D * D;
    // Each gradient has its own step, because changes may be of any size.
    let largest = |values: &[f64]| values.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    let steps = f.chunks_exact(block).zip(change.chunks_exact(block));
    let steps: Vec<f64> = steps
        .map(|(f, change)| match largest(change) {
            0.0 => 0.0,
            size => STEP * largest(f).max(1.0) / size,
        })
        .collect();
    let moved = |sign: f64| -> Vec<f64> {
        let moved = |i: usize| f[i] + sign * steps[i / block] * change[i];
        (0..f.len()).map(moved).collect()
    };
    let (mut after, mut before) = (vec![0.0; f.len()], vec![0.0; f.len()]);
    if !(material.stress(&moved(1.0), &mut after) && material.stress(&moved(-1.0), &mut before)) {
        return change.fill(f64::NAN);
    }
    for i in 0..f.len() {
        let step = steps[i / block];
        change[i] = if step == 0.0 { 0.0 } else { (after[i] - before[i]) / (2.0 * step) };
    }
}
