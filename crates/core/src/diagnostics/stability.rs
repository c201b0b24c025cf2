//! How large a time step may be: the highest natural frequency of the assembled system, and what a scheme does to it.

use crate::integrator::{Method, amplification};
use crate::system::System;

/// Lanczos stops here; a few dozen steps are enough unless the top of the spectrum is very crowded.
const MAX_LANCZOS_STEPS: usize = 300;
/// Bound asked of the relative error of the largest eigenvalue. The residual bounds it; where the eigenvalue stands alone the
/// error is about the square of that, far below.
const EIGENVALUE_TOLERANCE: f64 = 1e-7;

/// The same where products are approximate: the corrected eigenvalue's error is about the square of its bound.
const APPROXIMATE_TOLERANCE: f64 = 1e-4;

/// The upper end of the spectrum of `K u = omega^2 M u`, `K` the Hessian of the energy.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Spectrum {
    /// Largest angular frequency [rad/s]; 0 where nothing oscillates.
    pub frequency: f64,
    /// Bound of its relative error, from the residual of the eigenpair.
    pub relative_error: f64,
    /// Products with the Hessian that it took.
    pub products: usize,
}

/// The largest natural frequency of `system` linearised at `x`, by Lanczos iteration on `M^-1/2 K M^-1/2` with products
/// only; pinned vertices do not take part. Golub, Van Loan 2013, *Matrix Computations*, algorithm 10.1.1.
///
/// The basis is not kept: lost orthogonality repeats eigenvalues that have converged, and does not move the largest.
/// The start vector is fixed, so that the result is the same everywhere.
///
/// Where a term approximates its products (mutual gravity of many particles), the basis is kept, and the eigenvector found is put
/// into one exact product: its Rayleigh quotient is the eigenvalue, and the residual of that is the bound.
pub fn largest_frequency(system: &mut System, x: &[f64]) -> Spectrum {
    let mut stiffness = |system: &mut System, p: &[f64], y: &mut [f64]| system.stiffness_product(x, p, y);
    let mut top = largest_eigenvalue(system, false, &mut stiffness);
    system.end_stiffness_products();
    if top.approximate {
        let scale = scale(system);
        (top.value, top.error) = rayleigh_quotient(system, x, &scale, &top.vector);
        top.products += 1;
    }
    if top.value.is_nan() || top.value <= 0.0 {
        return Spectrum { frequency: 0.0, relative_error: 0.0, products: top.products };
    }
    Spectrum {
        frequency: top.value.sqrt(),
        relative_error: 0.5 * top.error / top.value,
        products: top.products,
    }
}

/// The strongest damping: the upper end of the spectrum of `C u = c M u`, `C` the damping matrix.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StrongestDamping {
    /// Largest rate `c` at which damping alone slows a motion [1/s]; 0 without damping.
    pub rate: f64,
    /// Angular frequency that the stiffness would give to that motion [rad/s].
    pub frequency: f64,
}

/// The strongest damping of `system` at `(x, v)`, as [`largest_frequency`] finds the fastest motion.
pub fn strongest_damping(system: &mut System, x: &[f64], v: &[f64]) -> StrongestDamping {
    if !system.is_damped() {
        return StrongestDamping::default();
    }
    let mut damping = |system: &mut System, p: &[f64], y: &mut [f64]| {
        system.damping_product(x, v, p, y);
        false
    };
    let top = largest_eigenvalue(system, true, &mut damping);
    if top.value.is_nan() || top.value <= 0.0 {
        return StrongestDamping::default();
    }
    let scale = scale(system);
    let squared = rayleigh_quotient(system, x, &scale, &top.vector).0;
    StrongestDamping { rate: top.value, frequency: squared.max(0.0).sqrt() }
}

/// `M^-1/2`, zero where a coordinate is held.
fn scale(system: &System) -> Vec<f64> {
    system.inverse_mass().iter().map(|w| w.sqrt()).collect()
}

/// The largest eigenvalue of `M^-1/2 A M^-1/2`.
struct Top {
    /// NaN where products are not finite: a state outside of the domain of a material has no Hessian.
    value: f64,
    /// Bound of its error.
    error: f64,
    /// Products that it took.
    products: usize,
    /// Whether they were approximate.
    approximate: bool,
    /// The eigenvector, where it was asked for or products are approximate.
    vector: Vec<f64>,
}

/// The product with `A`; whether it is an approximation.
type Product<'a> = &'a mut dyn FnMut(&mut System, &[f64], &mut [f64]) -> bool;

fn largest_eigenvalue(system: &mut System, wants_vector: bool, product: Product<'_>) -> Top {
    let scale = scale(system);
    let mut top =
        Top { value: 0.0, error: 0.0, products: 0, approximate: false, vector: vec![0.0; scale.len()] };
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
        top.approximate = product(system, &scaled, &mut w);
        if top.approximate || wants_vector {
            basis.push(q.clone());
        }
        for i in 0..q.len() {
            w[i] *= scale[i];
        }
        let a: f64 = dot(&q, &w);
        alpha.push(a);
        top.products += 1;
        let last = beta.last().copied().unwrap_or(0.0);
        for i in 0..q.len() {
            w[i] -= a * q[i] + last * previous[i];
        }
        let b = norm(&w);
        if !(a + b).is_finite() {
            return Top { value: f64::NAN, approximate: false, ..top };
        }
        let check = step % 5 == 4 || step + 1 == MAX_LANCZOS_STEPS;
        let exhausted = b <= f64::EPSILON * alpha.iter().fold(0.0, |m: f64, a| m.max(a.abs()));
        if check || exhausted {
            let tolerance = if top.approximate { APPROXIMATE_TOLERANCE } else { EIGENVALUE_TOLERANCE };
            (top.value, ritz_vector) = largest_ritz_pair(&alpha, &beta);
            top.error = b * ritz_vector[step];
            if exhausted || top.error <= tolerance * top.value.abs() {
                break;
            }
        }
        beta.push(b);
        for i in 0..q.len() {
            (previous[i], q[i]) = (q[i], w[i] / b);
        }
    }
    for (weight, q) in ritz_vector.iter().zip(&basis) {
        top.vector.iter_mut().zip(q).for_each(|(v, q)| *v += weight * q);
    }
    top
}

/// The Rayleigh quotient of `M^-1/2 K M^-1/2` at `vector`, `scale` being `M^-1/2`, and the length of the residual: there is an
/// eigenvalue within that distance. One exact product.
fn rayleigh_quotient(system: &mut System, x: &[f64], scale: &[f64], vector: &[f64]) -> (f64, f64) {
    let length = norm(vector);
    let vector: Vec<f64> = vector.iter().map(|v| v / length).collect();
    let scaled: Vec<f64> = vector.iter().zip(scale).map(|(v, s)| v * s).collect();
    let mut w = vec![0.0; vector.len()];
    system.hessian_product(x, &scaled, &mut w);
    w.iter_mut().zip(scale).for_each(|(w, s)| *w *= s);
    let quotient = dot(&vector, &w);
    w.iter_mut().zip(&vector).for_each(|(w, v)| *w -= quotient * v);
    (quotient, norm(&w))
}

/// Largest eigenvalue of the tridiagonal matrix `T` with diagonal `alpha` and positive off-diagonal `beta`, and its unit
/// eigenvector. `O(n)`, where a full decomposition of every matrix on the way would cost more than the products.
///
/// All pivots of `theta I - T` are positive exactly where `theta` is above every eigenvalue: bisection. The eigenvector follows
/// from the twisted factorisation, pivots from both ends that meet where the remainder is smallest; Dhillon, Parlett 2004,
/// *Orthogonal eigenvectors and relative gaps*, SIAM J. Matrix Anal. Appl. 25, 858.
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

/// The pivots of `theta I - T`, from the first on.
fn pivots<'a>(
    alpha: impl Iterator<Item = &'a f64>,
    beta: impl Iterator<Item = &'a f64>,
    theta: f64,
) -> Vec<f64> {
    let mut pivots: Vec<f64> = vec![];
    for (a, b) in alpha.zip(std::iter::once(&0.0).chain(beta)) {
        // A pivot of zero would be one of either sign: a tiny one keeps the next finite.
        let before = pivots.last().map_or(1.0, |d| if *d == 0.0 { f64::MIN_POSITIVE } else { *d });
        pivots.push(theta - a - b * (b / before));
    }
    pivots
}

/// Component `i` of the start vector: equidistributed in (-1, 1), with no symmetry that a mesh could share.
fn start_component(i: usize) -> f64 {
    2.0 * (0.5 + (i as f64 + 1.0) * 0.754_877_666_246_692_7).fract() - 1.0
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// The largest step that a scheme may take.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct StabilityLimit {
    /// Largest natural frequency at the start [rad/s].
    pub frequency: f64,
    /// Largest rate at which damping slows a motion at the start [1/s]; 0 without damping.
    pub damping: f64,
    /// Largest stable step [s]; infinite where nothing oscillates.
    pub step: f64,
    /// True for schemes that gain energy at any step: `step` is then the one at which the fastest mode's amplitude doubles
    /// over the duration of the run.
    pub grows_at_any_step: bool,
}

/// The largest step at which `method` amplifies no motion of a system with this largest frequency [rad/s] and strongest damping,
/// under ether drag `ether_drag` [1/s], found by running the scheme on oscillators.
///
/// Three of them: the fastest undamped, since damping differs from motion to motion; the fastest with the strongest damping; and
/// the motion that is damped most, with its own frequency. Where damping is in proportion to the stiffness the last two are one
/// motion of the system, and the limit is exact.
pub fn stability_limit(
    method: &Method,
    frequency: f64,
    damping: StrongestDamping,
    ether_drag: f64,
    duration: f64,
) -> StabilityLimit {
    let limit = |oscillator: Oscillator| oscillator.limit(method, ether_drag, duration);
    let (mut step, grows_at_any_step) = limit(Oscillator { frequency, damping: 0.0 });
    if damping.rate > 0.0 {
        // Without any stiffness damping alone limits the step: an oscillator that is far slower than it.
        let slow = 1e-6 * damping.rate;
        for frequency in [frequency.max(slow), damping.frequency.max(slow)] {
            let damped = limit(Oscillator { frequency, damping: damping.rate });
            step = if damped.0 < step { damped.0 } else { step };
        }
    }
    StabilityLimit { frequency, damping: damping.rate, step, grows_at_any_step }
}

/// `x'' = -frequency^2 x - damping x'`.
#[derive(Clone, Copy)]
struct Oscillator {
    frequency: f64,
    damping: f64,
}

impl Oscillator {
    /// The largest stable step, and whether it is one of growth.
    fn limit(self, method: &Method, ether_drag: f64, duration: f64) -> (f64, bool) {
        let Oscillator { frequency, damping } = self;
        // What is stable at any step without damping is so with it: all of the left half-plane is stable.
        if frequency == 0.0 || method.documentation.stability_limit == f64::INFINITY {
            return (f64::INFINITY, false);
        }
        let radius =
            |h: f64| amplification(method, h * frequency, h * damping, h * ether_drag).spectral_radius();
        // Rounding leaves the radius of a neutral mode within a few units of one.
        let bounded = |h: f64| radius(h) <= 1.0 + 1e-13;
        let smallest = 1e-4 / frequency.max(damping);
        if bounded(smallest) {
            return (last_true(smallest, bounded), false);
        }
        let doubles_later = |h: f64| radius(h).ln() * (duration / h) <= std::f64::consts::LN_2;
        let mut start = smallest;
        while !doubles_later(start) && start > f64::MIN_POSITIVE {
            start *= 0.5;
        }
        (last_true(start, doubles_later), true)
    }
}

/// The end of the interval around `start` in which `holds` is true.
fn last_true(start: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (start, start);
    while holds(high) {
        low = high;
        high *= 1.1;
        if !high.is_finite() {
            return f64::INFINITY;
        }
    }
    while high - low > 1e-15 * high {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if holds(middle) { low = middle } else { high = middle }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    // With nothing between the twelfth and the thirteenth row but 1e-9, the vector decays over many orders of magnitude.
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
