//! Rates of the element kernels and of the decompositions, in cache, on one thread and the best instruction
//! set: `cargo bench -p pliant --bench kernels [-- NAME...]`. `PLIANT_SIMD=avx2` chooses another.
//!
//! The forces are those of one patch: positions copied in, deformation gradients, stresses, sums; in the
//! four states of deformation that the rotation minds.
#![allow(non_snake_case, clippy::needless_range_loop, clippy::print_stdout)]

use std::hint::black_box;
use std::time::Instant;

use pliant::algebra::{Mat, Svd, rotation, signed_svd};
use pliant::energy::EnergyTerm;
use pliant::energy::elastic::Elastic;
use pliant::lanes::{Kernel, Lanes, Pair, WIDTH, dispatch, level};
use pliant::material::Stress;
use pliant::material::{
    Corotated, Isotropic, Material, Model, NeoHookean, StableNeoHookean, StableNeoHookeanLog, Stvk,
};
use pliant::scalar::Scalar;

const ISOTROPIC: Isotropic = Isotropic::new(5e5, 0.4);
/// Edge of a cell [m].
const SPACING: f64 = 0.1 / 16.0;

/// Uniform in `[-1, 1)`.
fn noise(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Prints the best of many runs, unless the arguments name other rows.
fn rate(name: &str, items: usize, mut run: impl FnMut()) {
    let mut names = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).peekable();
    if names.peek().is_some() && !names.any(|wanted| name.contains(&wanted)) {
        return;
    }
    let mut best = f64::MAX;
    for _ in 0..40 {
        let start = Instant::now();
        for _ in 0..100 {
            run();
        }
        best = best.min(start.elapsed().as_secs_f64() / 100.0);
    }
    println!("{name:44} {:8.1} M/s", items as f64 / best * 1e-6);
}

/// A block of cells split into simplices, one kind after the other, so that the lanes of a pack share few
/// vertices.
fn block<const D: usize, const N: usize>(cells: [usize; 3]) -> (Vec<[u32; N]>, Vec<f64>) {
    let index = |c: [usize; 3]| (c[0] * (cells[1] + 1) + c[1]) * (cells[2] + 1) + c[2];
    let depth = if D == 3 { cells[2] } else { 0 };
    let (mut points, mut corners) = (vec![], vec![]);
    for i in 0..=cells[0] {
        for j in 0..=cells[1] {
            for k in 0..=depth {
                points.extend([i, j, k].iter().take(D).map(|&c| c as f64 * SPACING));
                if i < cells[0] && j < cells[1] && (D == 2 || k < cells[2]) {
                    corners.push([i, j, k]);
                }
            }
        }
    }
    // Kuhn's split: along the axes in every order. Odd orders are turned over.
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [1, 0, 2], [0, 2, 1], [2, 1, 0]];
    let mut elements = vec![];
    for (number, order) in ORDERS.iter().enumerate() {
        if D == 2 && order[2] != 2 {
            continue;
        }
        for corner in &corners {
            let (mut at, mut element) = (*corner, [0; N]);
            element[0] = index(at) as u32;
            for step in 0..D {
                at[order[step]] += 1;
                element[step + 1] = index(at) as u32;
            }
            if number >= 3 {
                element.swap(N - 2, N - 1);
            }
            elements.push(element);
        }
    }
    (elements, points)
}

/// Turned, twisted and disturbed by `amplitude` times the edge of a cell.
fn deformed<const D: usize>(rest: &[f64], amplitude: f64) -> Vec<f64> {
    let (mut x, mut state) = (rest.to_vec(), 3);
    for point in x.chunks_exact_mut(D) {
        let angle: f64 = 0.7 + if amplitude > 0.0 { point[0] / 0.4 * 1.57 } else { 0.0 };
        let (p, q) = (point[D - 2], point[D - 1]);
        (point[D - 2], point[D - 1]) = (p * angle.cos() - q * angle.sin(), p * angle.sin() + q * angle.cos());
        for c in point {
            *c += amplitude * SPACING * noise(&mut state);
        }
    }
    x
}

fn forces<M: Material<D> + Material<3> + Clone, const D: usize, const N: usize>(
    name: &str,
    material: M,
    stress: Stress,
    amplitude: f64,
) {
    let (elements, rest) = block::<D, N>(if D == 3 { [10, 4, 4] } else { [32, 16, 0] });
    let mut body = Elastic::<D, N>::linear("block", material, stress, &elements, &rest);
    let x = deformed::<D>(&rest, amplitude);
    rate(name, elements.len(), || {
        body.evaluate(black_box(&x));
    });
}

/// Operation on a matrix.
trait Decomposition {
    fn call<S: Scalar>(f: &Mat<S, 3>) -> Svd<S, 3>;
}
struct SignedSvd;
impl Decomposition for SignedSvd {
    #[inline(always)]
    fn call<S: Scalar>(f: &Mat<S, 3>) -> Svd<S, 3> {
        signed_svd(f)
    }
}
struct Rotation;
impl Decomposition for Rotation {
    #[inline(always)]
    fn call<S: Scalar>(f: &Mat<S, 3>) -> Svd<S, 3> {
        Svd { u: rotation(f), sigma: [S::zero(); 3], v: Mat::zero() }
    }
}

/// Packs of matrices, `f[row][column][lane]`, and packs of results.
type Packs = [[[f64; WIDTH]; 3]; 3];
struct Decompose<'a, F>(&'a [Packs], &'a mut [[Packs; 3]], std::marker::PhantomData<F>);
impl<F: Decomposition> Kernel for Decompose<'_, F> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        if L::PAIRS_PAY {
            for (from, to) in self.0.as_chunks::<2>().0.iter().zip(self.1.as_chunks_mut::<2>().0) {
                let f = Mat(Pair::zip_rows(&load::<L>(&from[0]).0, &load::<L>(&from[1]).0));
                let svd = F::call(&f);
                let (u, v) = (Pair::unzip_rows(&svd.u.0), Pair::unzip_rows(&svd.v.0));
                let sigma = Pair::unzip(&svd.sigma);
                store(&mut to[0], &u.0, &sigma.0, &v.0);
                store(&mut to[1], &u.1, &sigma.1, &v.1);
            }
        } else {
            for (from, to) in self.0.iter().zip(self.1) {
                let svd = F::call(&load::<L>(from));
                store(to, &svd.u.0, &svd.sigma, &svd.v.0);
            }
        }
    }
}

#[inline(always)]
fn load<L: Lanes>(from: &Packs) -> Mat<L, 3> {
    let mut m = Mat::zero();
    for i in 0..3 {
        for j in 0..3 {
            m[i][j] = L::load(&from[i][j]);
        }
    }
    m
}

#[inline(always)]
fn store<L: Lanes>(to: &mut [Packs; 3], u: &[[L; 3]; 3], sigma: &[L; 3], v: &[[L; 3]; 3]) {
    for i in 0..3 {
        for j in 0..3 {
            u[i][j].store(&mut to[0][i][j]);
            v[i][j].store(&mut to[2][i][j]);
        }
        sigma[i].store(&mut to[1][0][i]);
    }
}

fn decompose<F: Decomposition>(name: &str) {
    let mut state = 5;
    let mut from = vec![[[[0.0; WIDTH]; 3]; 3]; 64];
    for pack in &mut from {
        for i in 0..3 {
            for j in 0..3 {
                for x in &mut pack[i][j] {
                    *x = noise(&mut state) + if i == j { 1.0 } else { 0.0 };
                }
            }
        }
    }
    let mut to = vec![[[[[0.0; WIDTH]; 3]; 3]; 3]; from.len()];
    let kind = std::marker::PhantomData::<F>;
    rate(name, from.len() * WIDTH, || dispatch(Decompose(black_box(&from), black_box(&mut to), kind)));
}

fn main() {
    println!("{}", level().name());
    let by_hand = Stress::Analytic;
    forces::<_, 3, 4>("tet stable neo-Hookean", StableNeoHookean::new(&ISOTROPIC), by_hand, 0.03);
    forces::<_, 3, 4>("tet stable neo-Hookean log", StableNeoHookeanLog::new(&ISOTROPIC), by_hand, 0.03);
    forces::<_, 3, 4>("tet neo-Hookean", NeoHookean::new(&ISOTROPIC), by_hand, 0.03);
    forces::<_, 3, 4>("tet StVK", Stvk::new(&ISOTROPIC), by_hand, 0.03);
    for (state, amplitude) in [("rest", 0.0), ("mild", 0.03), ("strong", 0.5), ("wild", 1.5)] {
        let name = format!("tet corotated, {state}");
        forces::<_, 3, 4>(&name, Corotated::new(&ISOTROPIC), by_hand, amplitude);
    }
    forces::<_, 2, 3>("triangle corotated", Corotated::new(&ISOTROPIC), by_hand, 0.03);
    let model = StableNeoHookean::new(&ISOTROPIC);
    forces::<_, 3, 4>("autodiff tet stable neo-Hookean", model, Stress::Autodiff, 0.03);
    let model = StableNeoHookeanLog::new(&ISOTROPIC);
    forces::<_, 3, 4>("autodiff tet stable neo-Hookean log", model, Stress::Autodiff, 0.03);
    decompose::<Rotation>("rotation 3 x 3");
    decompose::<SignedSvd>("signed SVD 3 x 3");
}
