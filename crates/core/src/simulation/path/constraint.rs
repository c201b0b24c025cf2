//! Arc-length constraint of a step along a path of equilibria.

use crate::system::System;

/// Returns the bound between two load factors, if any.
pub(super) fn crossed(bounds: [f64; 2], from: f64, to: f64) -> Option<f64> {
    bounds.into_iter().find(|bound| (from - bound) * (to - bound) <= 0.0 && from != *bound)
}

/// Solves for the increment of the load factor at which `way + correction + increment by_load` has the
/// length `radius`; of two roots, takes the one that turns `way` less. `None` without a real root.
pub(super) fn increment(
    system: &System,
    way: &[f64],
    (correction, by_load): (&[f64], &[f64]),
    radius: f64,
) -> Option<f64> {
    let corrected: Vec<f64> = way.iter().zip(correction).map(|(u, d)| u + d).collect();
    let a = dot(system, by_load, by_load);
    let b = dot(system, &corrected, by_load);
    let c = dot(system, &corrected, &corrected) - radius * radius;
    let discriminant = b * b - a * c;
    if !(discriminant >= 0.0 && a > 0.0) {
        return None;
    }
    // Avoids cancellation.
    let sum = -(b + b.signum() * discriminant.sqrt());
    let roots = if sum == 0.0 { [0.0, 0.0] } else { [sum / a, c / sum] };
    let along = dot(system, way, by_load);
    let turns = |root: f64| root * along;
    Some(if turns(roots[0]) >= turns(roots[1]) { roots[0] } else { roots[1] })
}

/// Inner product `(1/n) sum_i a_i . b_i` over the free coordinates, with `n` their count divided by the
/// dimension.
pub(super) fn dot(system: &System, a: &[f64], b: &[f64]) -> f64 {
    let (mut sum, mut free) = (0.0, 0_usize);
    for ((a, b), weight) in a.iter().zip(b).zip(system.inverse_mass()) {
        if *weight != 0.0 {
            sum += a * b;
            free += 1;
        }
    }
    if free == 0 { 0.0 } else { sum * system.dimension() as f64 / free as f64 }
}

pub(super) fn norm(system: &System, a: &[f64]) -> f64 {
    dot(system, a, a).sqrt()
}
