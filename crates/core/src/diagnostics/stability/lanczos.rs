//! Largest eigenvalue of `M^-1/2 A M^-1/2` by Lanczos iteration, with products only; Golub, Van Loan
//! 2013, *Matrix Computations*, algorithm 10.1.1.
//!
//! Unless the vector is needed, the basis is not kept: lost orthogonality repeats converged eigenvalues
//! and does not move the largest. The start vector is fixed, so that the result is reproducible.

use crate::algebra::dot;
use crate::system::System;

/// Step limit; a few dozen steps suffice unless the top of the spectrum is very crowded.
const MAX_LANCZOS_STEPS: usize = 300;
/// Tolerance of the relative residual bound of the largest eigenvalue. The error of an isolated
/// eigenvalue is about its square, far below.
const EIGENVALUE_TOLERANCE: f64 = 1e-7;

/// The same tolerance with approximate products: the error of the corrected eigenvalue is about the
/// square of its bound.
const APPROXIMATE_TOLERANCE: f64 = 1e-4;

/// Largest eigenvalue of `M^-1/2 A M^-1/2`.
pub(super) struct LargestEigenvalue {
    /// Eigenvalue; NaN if products are not finite, for example outside the domain of a material, or if
    /// the system was stopped.
    pub(super) value: f64,
    /// Bound of its error.
    pub(super) error: f64,
    /// Number of products.
    pub(super) products: usize,
    /// True if products were approximate.
    pub(super) approximate: bool,
    /// Eigenvector, if requested or if products are approximate.
    pub(super) vector: Vec<f64>,
}

/// Product with `A`; returns whether it is an approximation.
pub(super) type Product<'a> = &'a mut dyn FnMut(&mut System, &[f64], &mut [f64]) -> bool;

/// Accuracy requested of an iteration.
#[derive(Clone, Copy)]
pub(super) struct LanczosGoal {
    /// True to compute the eigenvector.
    pub(super) vector: bool,
    /// Scale of eigenvalues and errors in addition to the largest: a norm of the matrix, in case that one
    /// cancels.
    pub(super) norm: f64,
    /// Tolerance of the relative error.
    pub(super) tolerance: f64,
}

impl LanczosGoal {
    /// The value alone, as accurately as a stability limit needs.
    pub(super) const VALUE: LanczosGoal =
        LanczosGoal { vector: false, norm: 0.0, tolerance: EIGENVALUE_TOLERANCE };
}

pub(super) fn largest_eigenvalue(
    system: &mut System,
    wanted: LanczosGoal,
    product: Product<'_>,
) -> LargestEigenvalue {
    let scale = scale(system);
    let mut top = LargestEigenvalue {
        value: 0.0,
        error: 0.0,
        products: 0,
        approximate: false,
        vector: vec![0.0; scale.len()],
    };
    // Normalised start vector.
    let mut q: Vec<f64> =
        (0..scale.len()).map(|i| if scale[i] > 0.0 { start_component(i) } else { 0.0 }).collect();
    let length = norm(&q);
    if length == 0.0 {
        return top;
    }
    q.iter_mut().for_each(|q| *q /= length);
    let mut previous = vec![0.0; q.len()];
    let (mut scaled, mut w) = (q.clone(), q.clone());
    let (mut alpha, mut beta): (Vec<f64>, Vec<f64>) = (vec![], vec![]);
    let (mut basis, mut ritz_vector) = (vec![], vec![]);
    for step in 0..MAX_LANCZOS_STEPS {
        for i in 0..q.len() {
            scaled[i] = scale[i] * q[i];
        }
        if system.is_stopped() {
            return LargestEigenvalue { value: f64::NAN, approximate: false, ..top };
        }
        top.approximate = product(system, &scaled, &mut w);
        if top.approximate || wanted.vector {
            basis.push(q.clone());
        }
        for i in 0..q.len() {
            w[i] *= scale[i];
        }
        // Three-term recurrence.
        let a: f64 = dot(&q, &w);
        alpha.push(a);
        top.products += 1;
        let last = beta.last().copied().unwrap_or(0.0);
        for i in 0..q.len() {
            w[i] -= a * q[i] + last * previous[i];
        }
        let b = norm(&w);
        if !(a + b).is_finite() {
            return LargestEigenvalue { value: f64::NAN, approximate: false, ..top };
        }
        // Check convergence every few steps.
        let check = step % 5 == 4 || step + 1 == MAX_LANCZOS_STEPS;
        let exhausted = b <= f64::EPSILON * alpha.iter().fold(wanted.norm, |m: f64, a| m.max(a.abs()));
        if check || exhausted {
            let tolerance = if top.approximate { APPROXIMATE_TOLERANCE } else { wanted.tolerance };
            (top.value, ritz_vector) = largest_ritz_pair(&alpha, &beta);
            top.error = b * ritz_vector[step];
            if exhausted || top.error <= tolerance * top.value.abs().max(wanted.norm) {
                break;
            }
        }
        beta.push(b);
        for i in 0..q.len() {
            (previous[i], q[i]) = (q[i], w[i] / b);
        }
    }
    // Ritz vector in original coordinates.
    for (weight, q) in ritz_vector.iter().zip(&basis) {
        top.vector.iter_mut().zip(q).for_each(|(v, q)| *v += weight * q);
    }
    top
}

/// Returns `M^-1/2`, zero at constrained coordinates.
pub(super) fn scale(system: &System) -> Vec<f64> {
    system.inverse_mass().iter().map(|w| w.sqrt()).collect()
}

/// Returns the Rayleigh quotient of `M^-1/2 A M^-1/2` at `vector` and the norm of the residual, with
/// `scale` as `M^-1/2`. An eigenvalue lies within that distance. Takes one exact product.
pub(super) fn rayleigh_quotient(
    system: &mut System,
    scale: &[f64],
    vector: &[f64],
    product: impl FnOnce(&mut System, &[f64], &mut [f64]),
) -> (f64, f64) {
    let length = norm(vector);
    let vector: Vec<f64> = vector.iter().map(|v| v / length).collect();
    let scaled: Vec<f64> = vector.iter().zip(scale).map(|(v, s)| v * s).collect();
    let mut w = vec![0.0; vector.len()];
    product(system, &scaled, &mut w);
    w.iter_mut().zip(scale).for_each(|(w, s)| *w *= s);
    let quotient = dot(&vector, &w);
    w.iter_mut().zip(&vector).for_each(|(w, v)| *w -= quotient * v);
    (quotient, norm(&w))
}

/// Computes the largest eigenvalue of the tridiagonal matrix `T` with diagonal `alpha` and positive
/// off-diagonal `beta`, and its unit eigenvector. Costs `O(n)`; repeated full decompositions would cost
/// more than the products.
///
/// Bisection: all pivots of `theta I - T` are positive exactly if `theta` is above all eigenvalues. The
/// eigenvector follows from the twisted factorisation, with pivots from both ends that meet where the
/// remainder is smallest; Dhillon, Parlett 2004, *Orthogonal eigenvectors and relative gaps*, SIAM J.
/// Matrix Anal. Appl. 25, 858.
fn largest_ritz_pair(alpha: &[f64], beta: &[f64]) -> (f64, Vec<f64>) {
    let n = alpha.len();
    let beside = |k: usize| if k > 0 { beta[k - 1] } else { 0.0 } + beta.get(k).copied().unwrap_or(0.0);
    let bound = (0..n).fold(0.0, |bound: f64, k| bound.max(alpha[k].abs() + beside(k)));
    let is_above = |theta: f64| pivots(alpha.iter(), beta.iter(), theta).iter().all(|pivot| *pivot > 0.0);
    let (mut low, mut high) = (-bound, bound);
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if is_above(middle) { high = middle } else { low = middle }
    }
    let forward = pivots(alpha.iter(), beta.iter(), high);
    let mut backward = pivots(alpha.iter().rev(), beta.iter().rev(), high);
    backward.reverse();
    let remainder = |k: usize| (forward[k] + backward[k] - (high - alpha[k])).abs();
    let twist = (0..n).fold(0, |twist, k| if remainder(k) < remainder(twist) { k } else { twist });
    let mut vector = vec![1.0; n];
    for k in (0..twist).rev() {
        vector[k] = beta[k] / forward[k] * vector[k + 1];
    }
    for k in twist + 1..n {
        vector[k] = beta[k - 1] / backward[k] * vector[k - 1];
    }
    let length = norm(&vector);
    vector.iter_mut().for_each(|v| *v /= length);
    (high, vector)
}

/// Returns the pivots of `theta I - T`, from the first on.
fn pivots<'a>(
    alpha: impl Iterator<Item = &'a f64>,
    beta: impl Iterator<Item = &'a f64>,
    theta: f64,
) -> Vec<f64> {
    let mut pivots: Vec<f64> = vec![];
    for (a, b) in alpha.zip(std::iter::once(&0.0).chain(beta)) {
        // A zero pivot could have either sign: a tiny one keeps the next finite.
        let before = pivots.last().map_or(1.0, |d| if *d == 0.0 { f64::MIN_POSITIVE } else { *d });
        pivots.push(theta - a - b * (b / before));
    }
    pivots
}

/// Component `i` of the start vector: equidistributed in (-1, 1), without any symmetry of a mesh.
fn start_component(i: usize) -> f64 {
    2.0 * (0.5 + (i as f64 + 1.0) * 0.754_877_666_246_692_7).fract() - 1.0
}

pub(super) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    // A coupling of 1e-9 after the twelfth row makes the vector decay over many orders of magnitude.
    #[test]
    fn the_largest_ritz_pair_is_an_eigenpair() {
        for n in [1, 2, 3, 10, 60, 300] {
            let alpha: Vec<f64> = (0..n).map(|i| 3.0 * start_component(7 * i)).collect();
            let beta: Vec<f64> =
                (1..n).map(|i| if i == 12 { 1e-9 } else { start_component(5 * i).abs() }).collect();
            let (eigenvalue, vector) = largest_ritz_pair(&alpha, &beta);
            let mut t = nalgebra::DMatrix::<f64>::from_diagonal(&nalgebra::DVector::from_vec(alpha.clone()));
            for i in 1..n {
                (t[(i, i - 1)], t[(i - 1, i)]) = (beta[i - 1], beta[i - 1]);
            }
            let v = nalgebra::DVector::from_vec(vector);
            let defect = (&t * &v - eigenvalue * &v).norm();
            assert!(defect < 1e-14, "{n}: {defect:e}");
            assert!((v.norm() - 1.0).abs() < 1e-14);
            assert!((t.symmetric_eigenvalues().max() - eigenvalue).abs() < 1e-13, "{n}");
        }
    }
}
