//! Block Lanczos with a basis that is kept orthogonal.

use faer::{Mat, Side};

use super::inertia::Inertia;
use crate::solver::conjugate_gradients::dot;

/// Vectors in a block: modes of equal frequency that are found at once.
const BLOCK: usize = 8;
/// Directions shorter than this part of what they were are in the basis already.
const DEPENDENT: f64 = 1e-12;
/// Blocks that are added to the basis, the first of start vectors, before eigenvalues that have converged count.
const CONFIRMING: usize = 2;
/// Relative difference of an eigenvalue that has converged twice.
const SAME: f64 = 1e-4;
/// Residuals of small eigenvalues may be so many roundings of the largest one.
const ROUNDING_ULPS: f64 = 64.0;

/// An eigenpair of `T = A^-1 M`.
pub(super) struct Pair {
    /// `|T u - value u|_M / value`.
    pub(super) residual: f64,
    /// `u^T M u = 1`.
    pub(super) vector: Vec<f64>,
}

/// What was found.
pub(super) struct Found {
    /// The largest pairs, largest first.
    pub(super) pairs: Vec<Pair>,
    /// Products with `A^-1`.
    pub(super) solves: usize,
}

/// The `count` largest eigenpairs of `A^-1 M`, `M` zero where nothing moves: those whose residual
/// is at most `allowed(value)` times the eigenvalue. `solve` overwrites `b` by `A^-1 b`. `None` where
/// `is_stopped`, which is asked before every solve, says so.
///
/// A block of vectors finds no more copies of an eigenvalue than it has vectors: pairs that have converged count once new start vectors,
/// and what the iteration makes of them, have left them as they were.
pub(super) fn largest<const D: usize>(
    mass: &Inertia<D>,
    count: usize,
    allowed: impl Fn(f64) -> f64,
    mut solve: impl FnMut(&mut [f64]),
    is_stopped: impl Fn() -> bool,
) -> Option<Found> {
    let free = mass.diagonal().iter().filter(|m| **m > 0.0).count();
    let most = free.min(20 * count + 200);
    // The basis q_k, and T q_k.
    let (mut basis, mut images): (Vec<Direction>, Vec<Vec<f64>>) = (vec![], vec![]);
    // The rows `q_i^T M T q_j`, j <= i.
    let mut projected: Vec<Vec<f64>> = vec![];
    let (mut seed, seeds) = (0, 4 * BLOCK + most);
    let mut candidates: Vec<Vec<f64>> = vec![];
    // Eigenvalues that have converged, and the size of the basis in which they have.
    let mut converged: Option<(Vec<f64>, usize)> = None;
    loop {
        // Fill up with directions of no symmetry, where the block has run out of new ones.
        while candidates.len() < BLOCK && seed < seeds {
            candidates.push(start(mass.diagonal(), seed));
            seed += 1;
        }
        let first = basis.len();
        for candidate in candidates.drain(..) {
            if basis.len() < most
                && let Some(q) = orthonormal(candidate, &basis, mass)
            {
                basis.push(q);
            }
        }
        for q in &basis[first..] {
            let mut image = q.weighted.clone();
            if is_stopped() {
                return None;
            }
            solve(&mut image);
            image.iter_mut().zip(mass.diagonal()).filter(|(_, m)| **m == 0.0).for_each(|(y, _)| *y = 0.0);
            images.push(image);
        }
        for i in first..basis.len() {
            // Symmetric but for rounding.
            let entry =
                |j: usize| 0.5 * (dot(&basis[i].weighted, &images[j]) + dot(&basis[j].weighted, &images[i]));
            projected.push((0..=i).map(entry).collect());
        }
        let (values, pairs) = ritz(&basis, &images, &projected, mass, count, &allowed);
        // Where all of a block were in the basis already, as after more motions without stiffness than it
        // has vectors, new ones are tried.
        let exhausted = basis.len() == most || basis.len() == first && seed == seeds;
        if exhausted || pairs.len() == count && is_confirmed(&converged, &values, basis.len()) {
            return Some(Found { pairs, solves: images.len() });
        }
        let is_old = |(_, size): &(_, usize)| basis.len() >= size + CONFIRMING * BLOCK;
        if pairs.len() == count && converged.as_ref().is_none_or(is_old) {
            // Start vectors come next.
            converged = Some((values, basis.len()));
            continue;
        }
        candidates = images[first..].to_vec();
    }
}

/// Whether the eigenvalues are those that had converged before enough blocks were added to the basis.
fn is_confirmed(converged: &Option<(Vec<f64>, usize)>, values: &[f64], size: usize) -> bool {
    let Some((before, old)) = converged else { return false };
    let same = |(a, b): (&f64, &f64)| (a - b).abs() <= SAME * b.abs();
    size >= old + CONFIRMING * BLOCK && before.iter().zip(values).all(same)
}

/// Component `i` of start vector `seed`: equidistributed in (-1, 1).
fn start(mass: &[f64], seed: usize) -> Vec<f64> {
    let component = |i: usize| {
        let n = (i * 64 + seed % 64) as f64 + 1.0 + seed as f64 * 0.37;
        2.0 * (0.5 + n * 0.754_877_666_246_692_7).fract() - 1.0
    };
    mass.iter().enumerate().map(|(i, m)| if *m > 0.0 { component(i) } else { 0.0 }).collect()
}

/// A vector `q` of the basis, with `M q`.
struct Direction {
    vector: Vec<f64>,
    weighted: Vec<f64>,
}

/// `v` made orthogonal to the basis and of length one; `None` if it is in its span.
fn orthonormal<const D: usize>(mut v: Vec<f64>, basis: &[Direction], mass: &Inertia<D>) -> Option<Direction> {
    let length = |v: &[f64]| dot(&mass.times(v), v).sqrt();
    let before = length(&v);
    // Twice is enough: Parlett 1998, The symmetric eigenvalue problem, section 6.9.
    for _ in 0..2 {
        for q in basis {
            let part = dot(&q.weighted, &v);
            v.iter_mut().zip(&q.vector).for_each(|(v, q)| *v -= part * q);
        }
    }
    let length = length(&v);
    if length.is_nan() || length <= DEPENDENT * before {
        return None;
    }
    v.iter_mut().for_each(|v| *v /= length);
    Some(Direction { weighted: mass.times(&v), vector: v })
}

/// The `count` largest Ritz values, and their pairs as long as they have converged.
fn ritz<const D: usize>(
    basis: &[Direction],
    images: &[Vec<f64>],
    projected: &[Vec<f64>],
    mass: &Inertia<D>,
    count: usize,
    allowed: &impl Fn(f64) -> f64,
) -> (Vec<f64>, Vec<Pair>) {
    let k = basis.len();
    if k < count {
        return (vec![], vec![]);
    }
    let projected = Mat::<f64>::from_fn(k, k, |i, j| projected[i.max(j)][i.min(j)]);
    let Ok(eigen) = projected.self_adjoint_eigen(Side::Lower) else { return (vec![], vec![]) };
    let rounding = ROUNDING_ULPS * f64::EPSILON * eigen.S()[k - 1].abs();
    let mut pairs = vec![];
    for column in (k - count..k).rev() {
        let value = eigen.S()[column];
        let (mut vector, mut rest) = (vec![0.0; mass.diagonal().len()], vec![0.0; mass.diagonal().len()]);
        for (i, (q, image)) in basis.iter().zip(images).enumerate() {
            let weight = eigen.U()[(i, column)];
            vector.iter_mut().zip(&q.vector).for_each(|(s, q)| *s += weight * q);
            rest.iter_mut().zip(image).for_each(|(s, image)| *s += weight * image);
        }
        rest.iter_mut().zip(&vector).for_each(|(r, u)| *r -= value * u);
        let residual = dot(&mass.times(&rest), &rest).sqrt() / value.abs();
        // Images are right to roundings of the largest eigenvalue.
        if residual.is_nan() || residual > allowed(value).max(rounding / value.abs()) {
            break;
        }
        pairs.push(Pair { residual, vector });
    }
    let values = (k - count..k).rev().map(|column| eigen.S()[column]).collect();
    (values, pairs)
}
