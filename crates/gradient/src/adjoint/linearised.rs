//! Adjoint of linearly implicit Euler: implicit Euler with one Newton step.
//!
//! Let `X` be the old positions with prescribed ones at their new values. A step is `x' = X + d`, `v' =
//! d/h`,
//!
//! ```text
//! (1 + h c) M d - h M v + h^2 (dE/dx(X) + H(X) d) + h^2 (dR/dv(X, V) + C(X, V) d/h) = 0
//! ```
//!
//! where free vertices have `V = 0`. Its derivative by `X` contains the third derivative of the energy
//! along `d`. Central differences of sixth order compute it from products with Hessians at positions near
//! `X`,
//!
//! ```text
//! H(X) d = sum_k w_k/e (dE/dx(X + k e d) - dE/dx(X - k e d))    k = 1, 2, 3
//! ```
//!
//! with `e d` such a small fraction of the shortest edge that both truncation and rounding errors are
//! about 1e-13 of the third derivative. Parameters enter through their forces at these positions. Viscous
//! forces are differentiated in the same way along velocities.

use pliant::system::System;

use super::{Adjoint, AdjointForces, AdjointPlace, Bars, Singular, Step, add_scaled, free_only};
use crate::linear::Coefficients;

/// Weights at 1, 2 and 3 times the distance: central differences of sixth order.
const WEIGHTS: [f64; 3] = [3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0];
/// Largest difference as a fraction of the shortest edge.
const REACH: f64 = 4e-3;

/// Evaluation points of a linearised step.
pub(crate) struct LinearisedPlaces {
    /// Point of linearisation, `X` and `V`.
    pub(crate) x: Vec<f64>,
    pub(crate) v: Vec<f64>,
    /// End of the step [s].
    pub(crate) time: f64,
    /// Points of the differences, with their weights.
    pub(crate) beside: Vec<(f64, [Vec<f64>; 2])>,
}

impl LinearisedPlaces {
    /// Evaluation points of a step.
    pub(crate) fn of(system: &mut System, step: &Step<'_>) -> Self {
        let time = step.from.time + step.h;
        let (mut x, mut v) = (step.from.x.to_vec(), vec![0.0; step.x.len()]);
        system.prescribe(time, &mut x, &mut v);
        let mut way: Vec<f64> = step.v.iter().map(|v| step.h * v).collect();
        free_only(system, &mut way);
        let farthest = way.iter().fold(0.0, |most: f64, d| most.max(d.abs()));
        let mut beside = vec![];
        if farthest > 0.0 {
            let part = REACH * shortest_edge(system, &x) / farthest;
            for (k, weight) in (1..).zip(WEIGHTS) {
                for side in [1.0, -1.0] {
                    let (moved, weight) = (side * f64::from(k) * part, side * weight / part);
                    let mut along_x = x.clone();
                    add_scaled(&mut along_x, moved, &way);
                    beside.push((weight, [along_x, v.clone()]));
                    if system.is_damped() {
                        let mut along_v = v.clone();
                        add_scaled(&mut along_v, moved / step.h, &way);
                        beside.push((weight, [x.clone(), along_v]));
                    }
                }
            }
        }
        LinearisedPlaces { x, v, time, beside }
    }

    /// Coefficients of the matrix of a step of `h` [s].
    pub(crate) fn coefficients(system: &System, h: f64) -> Coefficients {
        Coefficients { inertia: 1.0 + h * system.ether_drag(), damping: h, stiffness: h * h }
    }
}

/// Shortest distance between vertices of a stencil at `x` [m]; the size of the scene if there are no
/// stencils.
fn shortest_edge(system: &mut System, x: &[f64]) -> f64 {
    let (d, mut shortest) = (system.dimension(), f64::INFINITY);
    for term in system.terms_mut() {
        let stencils = term.stencils();
        for stencil in stencils.vertices.chunks_exact(stencils.size.max(1)) {
            for (i, a) in stencil.iter().enumerate() {
                for b in &stencil[..i] {
                    let [a, b] = [a, b].map(|vertex| &x[*vertex as usize * d..][..d]);
                    let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
                    shortest = if square > 0.0 { shortest.min(square) } else { shortest };
                }
            }
        }
    }
    if shortest.is_finite() { shortest.sqrt() } else { pliant::solver::scene_size(x, d) }
}

/// Propagates `adjoint` back over one step.
///
/// # Errors
/// [`Singular`].
pub(super) fn step_back(
    forces: &mut AdjointForces<'_, '_>,
    step: &Step<'_>,
    adjoint: &mut Adjoint,
) -> Result<(), Singular> {
    let places = LinearisedPlaces::of(forces.system, step);
    let coefficients = LinearisedPlaces::coefficients(forces.system, step.h);
    let Adjoint { x, v, .. } = adjoint;
    let mut right: Vec<f64> = x.iter().zip(&*v).map(|(x, v)| step.h * v + step.h * step.h * x).collect();
    free_only(forces.system, &mut right);
    let mut none = vec![0.0; x.len()];
    let at = AdjointPlace { time: places.time, x: &places.x, v: &places.v };
    forces.solve(at, coefficients, &mut right, Bars { x, v: &mut none })?;
    // If indefinite, the step used another matrix, the projected one.
    if !forces.sums.is_definite() {
        return Err(Singular);
    }
    let p = forces.sums.direction().to_vec();
    for (weight, [at_x, at_v]) in &places.beside {
        let part: Vec<f64> = p.iter().map(|p| weight * p).collect();
        let at = AdjointPlace { time: places.time, x: at_x, v: at_v };
        forces.direction(at, &part, Bars { x, v: &mut none });
    }
    v.iter_mut().zip(&right).for_each(|(v, right)| *v = right / step.h);
    free_only(forces.system, v);
    Ok(())
}
