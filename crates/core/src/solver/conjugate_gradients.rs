//! Preconditioned conjugate gradients.

use super::block_matrix::{Block, BlockMatrix};
use super::cholesky::NotPositiveDefinite;
use crate::deadline::Stop;
use crate::lanes::{Kernel, Lanes, dispatch_compact};

/// A preconditioner: a symmetric positive definite approximation of `A^-1`.
pub trait Preconditioner<const D: usize>: Send + Sync {
    /// Updates the preconditioner for a new matrix.
    ///
    /// # Errors
    /// If the matrix is found not positive definite.
    fn update(&mut self, matrix: &BlockMatrix<D>) -> Result<(), NotPositiveDefinite>;

    /// Computes `z = P r`.
    fn apply(&mut self, r: &[f64], z: &mut [f64]);

    /// True if `P` is the identity and need not be applied.
    fn is_identity(&self) -> bool {
        false
    }
}

/// Returns the Cholesky factor `L` of a block `L L^T`; `None` if it is not positive definite.
pub(super) fn factor<const D: usize>(a: &Block<D>) -> Option<Block<D>> {
    let mut l = [[0.0; D]; D];
    for i in 0..D {
        for j in 0..=i {
            let sum = a[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
            if i == j && (sum.is_nan() || sum <= 1e-14 * a[i][i]) {
                return None;
            }
            l[i][j] = if i == j { sum.sqrt() } else { sum / l[j][j] };
        }
    }
    Some(l)
}

/// Inverts a positive definite block by Cholesky; inverts the diagonal of any other block.
pub(super) fn inverse<const D: usize>(a: &Block<D>) -> Block<D> {
    let Some(l) = factor(a) else { return diagonal_inverse(a) };
    let mut r = [[0.0; D]; D];
    for column in 0..D {
        let mut y = [0.0; D];
        for i in 0..D {
            let right = if i == column { 1.0 } else { 0.0 };
            y[i] = (right - (0..i).map(|k| l[i][k] * y[k]).sum::<f64>()) / l[i][i];
        }
        for i in (0..D).rev() {
            y[i] = (y[i] - (i + 1..D).map(|k| l[k][i] * y[k]).sum::<f64>()) / l[i][i];
        }
        for i in 0..D {
            r[i][column] = y[i];
        }
    }
    r
}

fn diagonal_inverse<const D: usize>(a: &Block<D>) -> Block<D> {
    let mut r = [[0.0; D]; D];
    for i in 0..D {
        r[i][i] = if a[i][i] > 0.0 { 1.0 / a[i][i] } else { 1.0 };
    }
    r
}

/// The identity as a preconditioner.
pub(super) struct NoPreconditioner;

impl<const D: usize> Preconditioner<D> for NoPreconditioner {
    fn update(&mut self, _: &BlockMatrix<D>) -> Result<(), NotPositiveDefinite> {
        Ok(())
    }

    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        z.copy_from_slice(r);
    }

    fn is_identity(&self) -> bool {
        true
    }
}

/// Stopping criteria of conjugate gradients; either is enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CgTolerance {
    /// Largest relative residual `|b - A x| / |b|`.
    pub residual: f64,
    /// Largest `sqrt(r^T P r)` relative to its first value; 0 disables it.
    ///
    /// For `P` near `A^-1` this is the error in the energy norm, `|x - A^-1 b|_A / |A^-1 b|_A`; its
    /// square is the remaining fraction of the decrease of `x^T A x / 2 - b^T x`. The residual says
    /// little about that if some rows of `A` are far stiffer than the rest.
    pub energy: f64,
}

impl From<f64> for CgTolerance {
    /// Stops on the residual alone.
    fn from(residual: f64) -> Self {
        CgTolerance { residual, energy: 0.0 }
    }
}

/// How a conjugate-gradient solve ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CgEnd {
    /// The tolerance is met.
    Converged,
    /// A direction `p` with `p^T A p <= 0`, or a preconditioned residual with `r^T P r <= 0`: the matrix is
    /// not positive definite.
    Indefinite,
    /// The residual no longer falls, or the iterations are used up.
    Stalled,
    /// The solve was told to stop.
    Stopped,
}

/// Result of a conjugate-gradient solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CgReport {
    /// How the solve ended.
    pub end: CgEnd,
    /// Iterations, each with one product.
    pub iterations: u64,
    /// `|b - A x| / |b|` from the recursion.
    pub relative_residual: f64,
}

/// Conjugate gradients with their scratch vectors.
#[derive(Debug, Default)]
pub struct ConjugateGradients {
    r: Vec<f64>,
    z: Vec<f64>,
    p: Vec<f64>,
    q: Vec<f64>,
    stop: Stop,
}

impl ConjugateGradients {
    /// Sets the flag that ends solves; each iteration checks it.
    pub(crate) fn set_stop(&mut self, stop: Stop) {
        self.stop = stop;
    }

    /// Solves `A x = b` from `x = 0` to a `tolerance`; a plain number is a relative residual.
    /// `product(p, q)` writes `A p` to `q`. Shewchuk 1994, *An introduction to the conjugate gradient
    /// method without the agonizing pain*, B3.
    ///
    /// If `A` is indefinite, `x` is the iterate before the direction of negative curvature or, in the
    /// first iteration, a multiple of that direction: a descent direction for a minimiser; Nocedal,
    /// Wright 2006, *Numerical optimization*, algorithm 7.1.
    pub fn solve<const D: usize>(
        &mut self,
        mut product: impl FnMut(&[f64], &mut [f64]),
        preconditioner: &mut dyn Preconditioner<D>,
        b: &[f64],
        x: &mut [f64],
        tolerance: impl Into<CgTolerance>,
        max_iterations: u64,
    ) -> CgReport {
        let ConjugateGradients { r, z, p, q, stop } = self;
        for v in [&mut *r, &mut *z, &mut *p, &mut *q] {
            v.resize(b.len(), 0.0);
        }
        x.fill(0.0);
        r.copy_from_slice(b);
        let length = dot(b, b).sqrt();
        let tolerance = tolerance.into();
        let report = |end, iterations, residual: f64| CgReport {
            end,
            iterations,
            relative_residual: if length > 0.0 { residual / length } else { 0.0 },
        };
        if length == 0.0 {
            return report(CgEnd::Converged, 0, 0.0);
        }
        // First direction: the preconditioned residual.
        let is_identity = preconditioner.is_identity();
        let mut rz = if is_identity {
            p.copy_from_slice(r);
            dot(r, r)
        } else {
            preconditioner.apply(r, z);
            p.copy_from_slice(z);
            dot(r, z)
        };
        let least = tolerance.energy * tolerance.energy * rz;
        for iteration in 1..=max_iterations {
            if stop.is_set() {
                return report(CgEnd::Stopped, iteration - 1, dot(r, r).sqrt());
            }
            product(p, q);
            // Negative curvature ends the solve.
            let curvature = dot(p, q);
            if curvature.is_nan() || curvature <= 0.0 {
                let residual = dot(r, r).sqrt();
                let end = if curvature.is_nan() { CgEnd::Stalled } else { CgEnd::Indefinite };
                if iteration == 1 && curvature < 0.0 {
                    x.iter_mut().zip(&*p).for_each(|(x, p)| *x = rz / -curvature * p);
                }
                return report(end, iteration, residual);
            }
            // Advance solution and residual; stop on the residual.
            let square = dispatch_compact(IterateUpdate { alpha: rz / curvature, p, q, x, r });
            let residual = square.sqrt();
            if residual <= tolerance.residual * length {
                return report(CgEnd::Converged, iteration, residual);
            }
            // Precondition the residual; stop on the energy norm.
            let next = if is_identity {
                square
            } else {
                preconditioner.apply(r, z);
                dot(r, z)
            };
            if next.is_nan() || next <= 0.0 {
                let end = if next.is_nan() { CgEnd::Stalled } else { CgEnd::Indefinite };
                return report(end, iteration, residual);
            }
            if next <= least {
                return report(CgEnd::Converged, iteration, residual);
            }
            // Next conjugate direction.
            let beta = next / rz;
            rz = next;
            dispatch_compact(DirectionUpdate { beta, z: if is_identity { r } else { z }, p });
        }
        let residual = dot(r, r).sqrt();
        report(CgEnd::Stalled, max_iterations, residual)
    }
}

/// Partial sums of a dot product; their order depends on the length alone.
const SUMS: usize = 8;

/// Dot product, summed in an order independent of the number of threads.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    dispatch_compact(DotProduct { a, b })
}

struct DotProduct<'a> {
    a: &'a [f64],
    b: &'a [f64],
}

impl Kernel for DotProduct<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let mut sums = [0.0; SUMS];
        let (a, a_rest) = self.a.as_chunks::<SUMS>();
        let (b, b_rest) = self.b.as_chunks::<SUMS>();
        for (a, b) in a.iter().zip(b) {
            for k in 0..SUMS {
                sums[k] += a[k] * b[k];
            }
        }
        sums.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
    }
}

/// `x += alpha p`, `r -= alpha q`, and [`dot`] of the new `r` with itself.
struct IterateUpdate<'a> {
    alpha: f64,
    p: &'a [f64],
    q: &'a [f64],
    x: &'a mut [f64],
    r: &'a mut [f64],
}

impl Kernel for IterateUpdate<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let IterateUpdate { alpha, p, q, x, r } = self;
        let mut sums = [0.0; SUMS];
        let (p, p_rest) = p.as_chunks::<SUMS>();
        let (q, q_rest) = q.as_chunks::<SUMS>();
        let (x, x_rest) = x.as_chunks_mut::<SUMS>();
        let (r, r_rest) = r.as_chunks_mut::<SUMS>();
        for ((p, q), (x, r)) in p.iter().zip(q).zip(x.iter_mut().zip(r)) {
            for k in 0..SUMS {
                x[k] += alpha * p[k];
                r[k] -= alpha * q[k];
                sums[k] += r[k] * r[k];
            }
        }
        let mut rest = 0.0;
        for ((p, q), (x, r)) in p_rest.iter().zip(q_rest).zip(x_rest.iter_mut().zip(r_rest)) {
            *x += alpha * p;
            *r -= alpha * q;
            rest += *r * *r;
        }
        sums.iter().sum::<f64>() + rest
    }
}

/// `p = z + beta p`.
struct DirectionUpdate<'a> {
    beta: f64,
    z: &'a [f64],
    p: &'a mut [f64],
}

impl Kernel for DirectionUpdate<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (p, z) in self.p.iter_mut().zip(self.z) {
            *p = z + self.beta * *p;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Number of unknowns, and the stiffness ratio of the last ones.
    const UNKNOWNS: usize = 60;
    const STIFFER: f64 = 1e8;

    /// Stiffness of the link before unknown `i` of a chain on a foundation of stiffness 1/2.
    fn link(i: usize) -> f64 {
        if i < UNKNOWNS - 10 { 1.0 } else { STIFFER }
    }

    fn product(p: &[f64], q: &mut [f64]) {
        q.iter_mut().zip(p).for_each(|(q, p)| *q = 0.5 * p);
        for i in 1..UNKNOWNS {
            let pull = link(i) * (p[i] - p[i - 1]);
            q[i] += pull;
            q[i - 1] -= pull;
        }
    }

    /// Exact solve for a chain whose links are up to 1.5 times stiffer or softer, so that it is within
    /// that factor of the inverse.
    struct OtherChain;

    impl Preconditioner<1> for OtherChain {
        fn update(&mut self, _: &BlockMatrix<1>) -> Result<(), NotPositiveDefinite> {
            Ok(())
        }

        fn apply(&mut self, r: &[f64], z: &mut [f64]) {
            let link = |i: usize| link(i) * 1.5_f64.powf((7.0 * i as f64).sin());
            let mut diagonal = [0.5; UNKNOWNS];
            for i in 1..UNKNOWNS {
                diagonal[i - 1] += link(i);
                diagonal[i] += link(i);
            }
            z.copy_from_slice(r);
            for i in 1..UNKNOWNS {
                let factor = link(i) / diagonal[i - 1];
                diagonal[i] -= factor * link(i);
                z[i] += factor * z[i - 1];
            }
            z[UNKNOWNS - 1] /= diagonal[UNKNOWNS - 1];
            for i in (1..UNKNOWNS).rev() {
                z[i - 1] = (z[i - 1] + link(i) * z[i]) / diagonal[i - 1];
            }
        }
    }

    fn solved(tolerance: impl Into<CgTolerance>, b: &[f64]) -> (Vec<f64>, CgReport) {
        let mut x = vec![0.0; UNKNOWNS];
        let report =
            ConjugateGradients::default().solve(product, &mut OtherChain, b, &mut x, tolerance, 10_000);
        assert_eq!(report.end, CgEnd::Converged);
        (x, report)
    }

    fn energy_norm(x: &[f64]) -> f64 {
        let mut product_of_x = vec![0.0; UNKNOWNS];
        product(x, &mut product_of_x);
        dot(x, &product_of_x).sqrt()
    }

    /// Solves meet the energy-norm tolerance; without one they stop on the residual alone.
    #[test]
    fn solves_end_by_the_energy_norm() {
        let mut b: Vec<f64> = (0..UNKNOWNS).map(|i| 1.0 + (i as f64).sin()).collect();
        (b[UNKNOWNS - 1], b[UNKNOWNS - 10]) = (1e4, -1e4);
        let (exact, by_residual) = solved(1e-14, &b);
        let mut before = 0;
        for energy in [1e-1, 1e-2, 1e-4, 1e-6] {
            let (x, report) = solved(CgTolerance { residual: 1e-14, energy }, &b);
            let left: Vec<f64> = x.iter().zip(&exact).map(|(x, exact)| x - exact).collect();
            let error = energy_norm(&left) / energy_norm(&exact);
            // The preconditioner is the inverse to a factor of 1.5, the norm to its root, twice.
            assert!(error < 1.5 * energy, "{error:e} for {energy:e}");
            assert!(
                (before + 1..by_residual.iterations).contains(&report.iterations),
                "{energy:e}: {report:?}"
            );
            before = report.iterations;
        }
        assert_eq!(solved(CgTolerance { residual: 1e-14, energy: 0.0 }, &b).1, by_residual);
    }
}
