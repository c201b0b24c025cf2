//! Rates of lane kernels in cache, one thread, on every instruction set: `cargo bench -p pliant --bench
//! lanes`.
#![allow(non_snake_case, clippy::needless_range_loop, clippy::print_stdout)]

use std::hint::black_box;
use std::time::Instant;

use pliant::algebra::Mat;
use pliant::lanes::{InstructionSet, Kernel, Lanes, Pair, Rows, WIDTH, dispatch_at};
use pliant::scalar::Real;

/// Numbers per array: four arrays stay in the first-level cache.
const COUNT: usize = 1024;

/// A function of packs, in place of a closure: closures lose the instruction set of their caller.
trait Function {
    fn call<R: Real>(x: R) -> R;
}
struct Logarithm;
impl Function for Logarithm {
    #[inline(always)]
    fn call<R: Real>(x: R) -> R {
        x.ln()
    }
}
struct Exponential;
impl Function for Exponential {
    #[inline(always)]
    fn call<R: Real>(x: R) -> R {
        x.exp()
    }
}
/// First Piola-Kirchhoff stress of a stable neo-Hookean material, at a deformation made from one number.
struct Stress;
impl Function for Stress {
    #[inline(always)]
    fn call<R: Real>(x: R) -> R {
        let mut F = Mat::<R, 3>::scalar(x);
        F[0][1] = x * x;
        F[1][2] = F[0][1] - x;
        F[2][0] = F[1][2] * x;
        let C = F.cofactor();
        let J = F.determinant_with(&C);
        let mu = R::splat(2.0);
        let a = mu - mu / (F.norm_squared() + R::one());
        let P = F.scale_add(a, &C.scale(R::splat(3.0) * (J - R::splat(1.5))));
        // Every component is needed.
        let mut s = P[0][0];
        for i in 0..3 {
            for j in 0..3 {
                s = s.max(P[i][j]);
            }
        }
        s
    }
}

/// `to[i] = function(from[i])`, by packs or by pairs of packs.
struct Apply<'a, F, const PAIRED: bool>(&'a [f64], &'a mut [f64], std::marker::PhantomData<F>);
impl<F: Function, const PAIRED: bool> Kernel for Apply<'_, F, PAIRED> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (from, _) = self.0.as_chunks::<WIDTH>();
        let (to, _) = self.1.as_chunks_mut::<WIDTH>();
        if PAIRED {
            let (from, _) = from.as_chunks::<2>();
            let (to, _) = to.as_chunks_mut::<2>();
            for ([a, b], [c, d]) in from.iter().zip(to) {
                let y = F::call(Pair(L::load(a), L::load(b)));
                y.0.store(c);
                y.1.store(d);
            }
        } else {
            for (a, c) in from.iter().zip(to) {
                F::call(L::load(a)).store(c);
            }
        }
    }
}

/// Gathers rows and adds them to other rows.
struct Move<'a, const D: usize>(&'a Rows<D>, &'a mut Rows<D>, &'a [[u16; WIDTH]]);
impl<const D: usize> Kernel for Move<'_, D> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        for index in self.2 {
            let x: [L; D] = L::gather(self.0, index);
            L::scatter_add(self.1, index, x);
        }
    }
}

/// Prints millions of items per second, best of many runs. A macro, for the reason above.
macro_rules! rate {
    ($level:expr, $name:expr, $items:expr, $run:expr) => {{
        let mut best = f64::MAX;
        for _ in 0..30 {
            let start = Instant::now();
            for _ in 0..200 {
                $run;
            }
            best = best.min(start.elapsed().as_secs_f64() / 200.0);
        }
        println!("{:8}  {:40} {:8.0} M/s", $level.name(), $name, $items as f64 / best * 1e-6);
    }};
}

fn apply<F: Function>(level: InstructionSet, name: &str) {
    let from: Vec<f64> = (0..COUNT).map(|i| 0.3 + 2.0 * i as f64 / COUNT as f64).collect();
    let mut to = vec![0.0; COUNT];
    let kind = std::marker::PhantomData::<F>;
    rate!(
        level,
        format!("{name}, one pack"),
        COUNT,
        dispatch_at(level, Apply::<F, false>(black_box(&from), black_box(&mut to), kind))
    );
    rate!(
        level,
        format!("{name}, two packs"),
        COUNT,
        dispatch_at(level, Apply::<F, true>(black_box(&from), black_box(&mut to), kind))
    );
}

fn moves<const D: usize>(level: InstructionSet) {
    let (from, mut to) = (Rows::<D>::new(), Rows::<D>::new());
    let mut index = vec![[0u16; WIDTH]; COUNT / WIDTH];
    for (i, x) in index.as_flattened_mut().iter_mut().enumerate() {
        *x = (i * 167 % 400) as u16;
    }
    rate!(
        level,
        format!("gather and scatter of rows, {D}D"),
        COUNT,
        dispatch_at(level, Move(black_box(&from), black_box(&mut to), black_box(&index)))
    );
}

fn main() {
    for level in InstructionSet::ALL {
        if !level.is_available() {
            println!("{:8}  not on this processor", level.name());
            continue;
        }
        apply::<Logarithm>(level, "ln");
        apply::<Exponential>(level, "exp");
        apply::<Stress>(level, "stable neo-Hookean stress");
        moves::<3>(level);
        moves::<2>(level);
    }
}
