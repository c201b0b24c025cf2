//! Block Lanczos method with full orthogonalisation.

use pliant_sparse::symmetric_eigen;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

use super::inertia::Inertia;
use crate::deadline::Stop;
use crate::solver::conjugate_gradients::dot;

/// Vectors per block.
const BLOCK: usize = 8;
/// A direction that shrinks below this fraction in the orthogonalisation lies in the basis already.
const DEPENDENT: f64 = 1e-12;
/// Allowed residuals of small eigenvalues, in roundings of the largest one.
const ROUNDING_ULPS: f64 = 64.0;
/// State and stream of the random generator for start vectors.
const GENERATOR: [u128; 2] = [1, 2];

/// Eigenpair of `T = A^-1 M`.
pub(super) struct EigenPair {
    /// Relative residual `|T u - value u|_M / value`.
    pub(super) residual: f64,
    /// Eigenvector with `u^T M u = 1`.
    pub(super) vector: Vec<f64>,
}

/// Iteration for the `count` largest eigenpairs of `T = A^-1 M`, with `M` zero at constrained
/// coordinates.
///
/// The search space is spanned by start vectors and their images under powers of `T`, and so has at most
/// as many copies of an eigenvalue as start vectors. It does not reveal missing copies:
/// [`run`](Self::run) starts from further vectors at each call.
pub(super) struct Lanczos<'a, const D: usize> {
    mass: &'a Inertia<D>,
    count: usize,
    /// Largest size of the basis.
    most: usize,
    basis: Vec<BasisVector>,
    /// Images `T q` of the basis.
    images: Vec<Vec<f64>>,
    /// Rows `q_i^T M T q_j`, j <= i.
    projected: Vec<Vec<f64>>,
    /// Generator of start vectors, and how many more may be drawn.
    random: Pcg64,
    starts: usize,
    /// Size of the basis before its last block.
    last: usize,
    /// Flag that ends the iteration between solves.
    stop: Stop,
}

impl<'a, const D: usize> Lanczos<'a, D> {
    pub(super) fn new(mass: &'a Inertia<D>, count: usize, stop: Stop) -> Self {
        let free = mass.diagonal().iter().filter(|m| **m > 0.0).count();
        let most = free.min(20 * count + 200);
        Lanczos {
            mass,
            count,
            most,
            basis: vec![],
            images: vec![],
            projected: vec![],
            random: Pcg64::new(GENERATOR[0], GENERATOR[1]),
            starts: 4 * BLOCK + most,
            last: 0,
            stop,
        }
    }

    /// Returns the number of pairs requested.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Returns the number of products with `A^-1`.
    pub(super) fn solves(&self) -> usize {
        self.images.len()
    }

    /// True if no new direction is left.
    pub(super) fn is_exhausted(&self) -> bool {
        self.basis.len() == self.most || self.last == self.basis.len() && self.starts == 0
    }

    /// Continues from new start vectors until the `count` largest pairs have relative residuals of at
    /// most `allowed(value)`, or no direction is left. Returns the converged pairs, largest first; `None`
    /// if stopped. `solve` overwrites `b` by `A^-1 b`.
    pub(super) fn run(
        &mut self,
        allowed: impl Fn(f64) -> f64,
        mut solve: impl FnMut(&mut [f64]),
    ) -> Option<Vec<EigenPair>> {
        self.extend(vec![], &mut solve)?;
        loop {
            let images = self.images[self.last..].to_vec();
            self.extend(images, &mut solve)?;
            let pairs = self.ritz(&allowed);
            if pairs.len() == self.count || self.is_exhausted() {
                return Some(pairs);
            }
        }
    }

    /// Adds a block to the basis: the candidates, filled up with start vectors if they are too few, for
    /// example because the last block was already in the basis. `None` if stopped.
    fn extend(&mut self, mut candidates: Vec<Vec<f64>>, solve: &mut impl FnMut(&mut [f64])) -> Option<()> {
        while candidates.len() < BLOCK && self.starts > 0 {
            candidates.push(start(self.mass.diagonal(), &mut self.random));
            self.starts -= 1;
        }
        self.last = self.basis.len();
        for candidate in candidates {
            if self.basis.len() < self.most
                && let Some(q) = orthonormal(candidate, &self.basis, self.mass)
            {
                self.basis.push(q);
            }
        }
        for q in &self.basis[self.last..] {
            let mut image = q.weighted.clone();
            if self.stop.is_set() {
                return None;
            }
            solve(&mut image);
            let held = self.mass.diagonal().iter().map(|m| *m == 0.0);
            image.iter_mut().zip(held).filter(|(_, held)| *held).for_each(|(y, _)| *y = 0.0);
            self.images.push(image);
        }
        for i in self.last..self.basis.len() {
            // Symmetric up to rounding.
            let half = |i: usize, j: usize| 0.5 * dot(&self.basis[i].weighted, &self.images[j]);
            self.projected.push((0..=i).map(|j| half(i, j) + half(j, i)).collect());
        }
        Some(())
    }

    /// Returns the leading converged ones of the `count` largest Ritz pairs.
    fn ritz(&self, allowed: &impl Fn(f64) -> f64) -> Vec<EigenPair> {
        let k = self.basis.len();
        if k < self.count {
            return vec![];
        }
        let Some(eigen) = symmetric_eigen(k, |i, j| self.projected[i][j]) else { return vec![] };
        // Images are accurate to roundings of the largest eigenvalue.
        let rounding = ROUNDING_ULPS * f64::EPSILON * eigen.values[k - 1].abs();
        let pair = |column: usize| {
            let value = eigen.values[column];
            let weights = (0..k).map(|i| eigen.vector(i, column));
            let pair = self.pair(value, weights);
            (pair.residual <= allowed(value).max(rounding / value.abs())).then_some(pair)
        };
        (k - self.count..k).rev().map_while(pair).collect()
    }

    /// Builds the pair whose vector has these weights in the basis.
    fn pair(&self, value: f64, weights: impl Iterator<Item = f64>) -> EigenPair {
        let zeros = || vec![0.0; self.mass.diagonal().len()];
        let (mut vector, mut rest) = (zeros(), zeros());
        for ((q, image), weight) in self.basis.iter().zip(&self.images).zip(weights) {
            vector.iter_mut().zip(&q.vector).for_each(|(s, q)| *s += weight * q);
            rest.iter_mut().zip(image).for_each(|(s, image)| *s += weight * image);
        }
        rest.iter_mut().zip(&vector).for_each(|(r, u)| *r -= value * u);
        let residual = dot(&self.mass.times(&rest), &rest).sqrt() / value.abs();
        EigenPair { residual, vector }
    }
}

/// Start vector, uniform in (-1, 1) at free coordinates. Random, so that any number of them is
/// independent: differences of equidistributed sequences are step functions of few steps.
fn start(mass: &[f64], random: &mut Pcg64) -> Vec<f64> {
    let mut uniform = || (random.next_u64() >> 11) as f64 * (2.0 / (1_u64 << 53) as f64) - 1.0;
    mass.iter().map(|m| if *m > 0.0 { uniform() } else { 0.0 }).collect()
}

/// Basis vector `q` with `M q`.
struct BasisVector {
    vector: Vec<f64>,
    weighted: Vec<f64>,
}

/// Orthonormalises `v` against the basis; `None` if it lies in the span of the basis.
fn orthonormal<const D: usize>(
    mut v: Vec<f64>,
    basis: &[BasisVector],
    mass: &Inertia<D>,
) -> Option<BasisVector> {
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
    Some(BasisVector { weighted: mass.times(&v), vector: v })
}

#[cfg(test)]
mod tests {
    use super::{GENERATOR, Pcg64, dot, start};

    /// Each of `n` random vectors has a component orthogonal to the earlier ones; that of the last vector
    /// has an RMS of `1 / sqrt(n) = 0.13` of its length.
    #[test]
    fn as_many_start_vectors_as_coordinates_are_independent() {
        let n = 63;
        let mut random = Pcg64::new(GENERATOR[0], GENERATOR[1]);
        let mut basis: Vec<Vec<f64>> = vec![];
        for number in 0..n {
            let mut v = start(&vec![1.0; n], &mut random);
            let before = dot(&v, &v).sqrt();
            for q in basis.iter().chain(&basis) {
                let part = dot(q, &v);
                v.iter_mut().zip(q).for_each(|(v, q)| *v -= part * q);
            }
            let length = dot(&v, &v).sqrt();
            assert!(length > 1e-3 * before, "vector {number}: {length} of {before} is new");
            v.iter_mut().for_each(|v| *v /= length);
            basis.push(v);
        }
    }
}
