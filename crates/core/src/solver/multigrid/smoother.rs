//! Chebyshev smoothing in single precision.
//!
//! Only the preconditioner is computed in single precision: the conjugate gradients around it see the matrix in double, so what
//! they converge to does not depend on it, and half the memory goes through the caches.

use rayon::prelude::*;

use crate::lanes::{Kernel, Lanes, dispatch_compact};
use crate::solver::block_matrix::BlockMatrix;
use crate::solver::conjugate_gradients::inverse;

/// The components of a vertex. Those beyond the dimension are zero in solutions and directions; in right-hand sides and residuals
/// they are anything, and not looked at.
pub(super) type Row = [f32; 4];
/// Rows that a thread takes at once: below twice as many the hand-over costs more than it saves.
pub(super) const TASK_ROWS: usize = 1024;
/// Degree of the polynomial.
const DEGREE: usize = 3;
/// The polynomial damps what lies between the largest eigenvalue and this part of it.
const RATIO: f64 = 12.0;
/// Power iterations for the largest eigenvalue.
const POWER_ITERATIONS: usize = 12;
/// What they may fall short by. Chebyshev's polynomial leaves [-1, 1] where an eigenvalue lies 8 % above the interval.
const SAFETY: f64 = 1.1;

/// A matrix in single precision with the inverses of its diagonal blocks, and the vectors of one level.
#[derive(Debug, Default)]
pub(super) struct Smoother<const D: usize> {
    row_start: Vec<u32>,
    column: Vec<u32>,
    /// `D * D` numbers a block, by columns, and a few zeros so that four can be read from every column.
    value: Vec<f32>,
    /// `D` columns of four numbers for every row.
    inverse: Vec<[Row; D]>,
    /// Largest eigenvalue of `D^-1 A`.
    largest: f64,
    /// The solution.
    pub(super) x: Vec<Row>,
    /// The right-hand side.
    pub(super) b: Vec<Row>,
    /// The residual.
    pub(super) r: Vec<Row>,
    /// Directions: the last and the next one.
    d: Vec<Row>,
    e: Vec<Row>,
}

impl<const D: usize> Smoother<D> {
    /// For matrices of this structure.
    pub(super) fn new(matrix: &BlockMatrix<D>) -> Self {
        let zero = || vec![[0.0; 4]; matrix.rows()];
        Smoother {
            row_start: matrix.row_start.clone(),
            column: matrix.column.clone(),
            value: vec![0.0; D * D * matrix.column.len() + 4],
            inverse: vec![[[0.0; 4]; D]; matrix.rows()],
            largest: 0.0,
            x: zero(),
            b: zero(),
            r: zero(),
            d: zero(),
            e: zero(),
        }
    }

    /// Takes `scale * matrix`.
    pub(super) fn set(&mut self, matrix: &BlockMatrix<D>, scale: f64) {
        let convert = |(out, block): (&mut [f32], &[[f64; D]; D])| {
            for l in 0..D {
                for k in 0..D {
                    out[l * D + k] = (scale * block[k][l]) as f32;
                }
            }
        };
        let count = D * D * matrix.value.len();
        let values = self.value[..count].par_chunks_exact_mut(D * D);
        if matrix.rows() < 2 * TASK_ROWS || rayon::current_num_threads() == 1 {
            self.value[..count].chunks_exact_mut(D * D).zip(&matrix.value).for_each(convert);
        } else {
            values.zip(&matrix.value).with_min_len(8 * TASK_ROWS).for_each(convert);
        }
        for (out, at) in self.inverse.iter_mut().zip(&matrix.diagonal) {
            let inverse = inverse(&matrix.value[*at as usize]);
            for l in 0..D {
                for k in 0..D {
                    out[l][k] = (inverse[k][l] / scale) as f32;
                }
            }
        }
        self.largest = SAFETY * self.power_iteration();
    }

    /// The largest eigenvalue of `D^-1 A`, from below.
    fn power_iteration(&mut self) -> f64 {
        let mut seed = 1u32;
        for row in &mut self.x {
            for k in 0..D {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                row[k] = (seed >> 8) as f32 / (1 << 24) as f32 - 0.5;
            }
        }
        let (mut x, mut y) = (std::mem::take(&mut self.x), std::mem::take(&mut self.d));
        let mut before = square(&x);
        let mut eigenvalue = 1.0;
        for _ in 0..POWER_ITERATIONS {
            let factor = (1.0 / before.sqrt()) as f32;
            self.run(Power { x: &x, factor }, [&mut y, &mut [], &mut []]);
            before = square(&y);
            eigenvalue = before.sqrt();
            std::mem::swap(&mut x, &mut y);
        }
        (self.x, self.d) = (x, y);
        eigenvalue
    }

    /// Row `i` of `A x`; beyond the dimension stands what the next column of each block gives. To compute that is cheaper than not
    /// to: a vector of three numbers is no register.
    #[inline(always)]
    fn product(&self, i: usize, x: &[Row]) -> Row {
        // A sum for every column of the blocks: they do not wait for each other.
        let mut sums = [[0.0; 4]; D];
        let range = self.row_start[i] as usize..self.row_start[i + 1] as usize;
        for (block, c) in range.clone().zip(&self.column[range]) {
            let x = &x[*c as usize];
            let block = &self.value[block * D * D..block * D * D + D * D + 4 - D];
            for l in 0..D {
                let column = &block[l * D..l * D + 4];
                for k in 0..4 {
                    sums[l][k] += column[k] * x[l];
                }
            }
        }
        let mut sum = [0.0; 4];
        for l in 0..D {
            for k in 0..4 {
                sum[k] += sums[l][k];
            }
        }
        sum
    }

    /// Row `i` of `D^-1 r`.
    #[inline(always)]
    fn precondition(&self, i: usize, r: &Row) -> Row {
        let mut z = [0.0; 4];
        for l in 0..D {
            for k in 0..4 {
                z[k] += self.inverse[i][l][k] * r[l];
            }
        }
        z
    }

    /// `x = S b` by Chebyshev iterations from zero, and `r = b - A x`; Saad 2003, *Iterative methods for sparse linear
    /// systems*, algorithm 12.1.
    pub(super) fn smooth_from_zero(&mut self) {
        let [mut x, mut r, mut d, mut e] = self.take();
        let (first, factors) = self.coefficients();
        self.run(FromZero { first }, [&mut x, &mut r, &mut d]);
        for (kept, gained) in factors {
            self.run(Advance { d: &d, kept, gained, last: 0.0 }, [&mut x, &mut r, &mut e]);
            std::mem::swap(&mut d, &mut e);
        }
        self.run(Residual { x: &d }, [&mut r, &mut [], &mut []]);
        self.put_back([x, r, d, e]);
    }

    /// The same iterations from `x` on; `r` is left behind.
    pub(super) fn smooth(&mut self) {
        let [mut x, mut r, mut d, mut e] = self.take();
        let (first, factors) = self.coefficients();
        self.run(FromSolution { x: &x, first }, [&mut r, &mut d, &mut []]);
        for (n, (kept, gained)) in factors.into_iter().enumerate() {
            // The first direction could not be added while the old solution was being read.
            let last = if n == 0 { 1.0 } else { 0.0 };
            self.run(Advance { d: &d, kept, gained, last }, [&mut x, &mut r, &mut e]);
            std::mem::swap(&mut d, &mut e);
        }
        self.put_back([x, r, d, e]);
    }

    /// Runs `pass` on every row of the vectors, those that it needs.
    fn run<P: Pass<D>>(&self, pass: P, vectors: [&mut [Row]; 3]) {
        let n = vectors[0].len();
        let [a, b, c] = vectors;
        let pass = &pass;
        let task = |(i, a, b, c)| dispatch_compact(Rows { smoother: self, pass, first: i, a, b, c });
        if n < 2 * TASK_ROWS || rayon::current_num_threads() == 1 {
            return task((0, a, b, c));
        }
        // Vectors that are not needed are empty.
        let mut tasks = Vec::with_capacity(n.div_ceil(TASK_ROWS));
        let (mut b, mut c) = (b, c);
        for (number, a) in a.chunks_mut(TASK_ROWS).enumerate() {
            let (of_b, rest_b) = b.split_at_mut(a.len().min(b.len()));
            let (of_c, rest_c) = c.split_at_mut(a.len().min(c.len()));
            (b, c) = (rest_b, rest_c);
            tasks.push((number * TASK_ROWS, a, of_b, of_c));
        }
        tasks.into_par_iter().for_each(task);
    }

    /// The factor of the first direction; of the last direction and of the residual in every further iteration.
    fn coefficients(&self) -> (f32, [(f32, f32); DEGREE - 1]) {
        let (high, low) = (self.largest, self.largest / RATIO);
        let (middle, half) = (0.5 * (high + low), 0.5 * (high - low));
        let sigma = middle / half;
        let mut rho = 1.0 / sigma;
        let mut factors = [(0.0, 0.0); DEGREE - 1];
        for factor in &mut factors {
            let next = 1.0 / (2.0 * sigma - rho);
            *factor = ((next * rho) as f32, (2.0 * next / half) as f32);
            rho = next;
        }
        ((1.0 / middle) as f32, factors)
    }

    fn take(&mut self) -> [Vec<Row>; 4] {
        [&mut self.x, &mut self.r, &mut self.d, &mut self.e].map(std::mem::take)
    }

    fn put_back(&mut self, [x, r, d, e]: [Vec<Row>; 4]) {
        (self.x, self.r, self.d, self.e) = (x, r, d, e);
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        4 * (self.row_start.len() + self.column.len() + self.value.len())
            + size_of_val(&self.inverse[..])
            + 5 * size_of_val(&self.x[..])
    }
}

#[inline(always)]
fn minus(a: &Row, b: &Row) -> Row {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]]
}

#[inline(always)]
fn times(s: f32, a: Row) -> Row {
    [s * a[0], s * a[1], s * a[2], s * a[3]]
}

/// The sum of all squares.
fn square(rows: &[Row]) -> f64 {
    rows.iter().map(|r| f64::from(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])).sum()
}

/// What is done with row `i` of up to three vectors.
trait Pass<const D: usize>: Sync {
    /// How many vectors it takes.
    const VECTORS: usize;
    /// Mark the implementation `#[inline(always)]`, see [`crate::lanes`].
    fn row(&self, smoother: &Smoother<D>, i: usize, rows: [&mut Row; 3]);
}

/// Rows from `first` on.
struct Rows<'a, P, const D: usize> {
    smoother: &'a Smoother<D>,
    pass: &'a P,
    first: usize,
    a: &'a mut [Row],
    b: &'a mut [Row],
    c: &'a mut [Row],
}

impl<P: Pass<D>, const D: usize> Kernel for Rows<'_, P, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Rows { smoother, pass, first, a, b, c } = self;
        let (mut spare_b, mut spare_c) = ([0.0; 4], [0.0; 4]);
        for (i, a) in a.iter_mut().enumerate() {
            let b = if P::VECTORS > 1 { &mut b[i] } else { &mut spare_b };
            let c = if P::VECTORS > 2 { &mut c[i] } else { &mut spare_c };
            pass.row(smoother, first + i, [a, b, c]);
        }
    }
}

/// `y = factor D^-1 A x`.
struct Power<'a> {
    x: &'a [Row],
    factor: f32,
}

impl<const D: usize> Pass<D> for Power<'_> {
    const VECTORS: usize = 1;

    #[inline(always)]
    fn row(&self, smoother: &Smoother<D>, i: usize, [y, _, _]: [&mut Row; 3]) {
        let ax = smoother.product(i, self.x);
        *y = times(self.factor, smoother.precondition(i, &ax));
    }
}

/// `r = b`, `x = d = first D^-1 r`.
struct FromZero {
    first: f32,
}

impl<const D: usize> Pass<D> for FromZero {
    const VECTORS: usize = 3;

    #[inline(always)]
    fn row(&self, smoother: &Smoother<D>, i: usize, [x, r, d]: [&mut Row; 3]) {
        *r = smoother.b[i];
        *d = times(self.first, smoother.precondition(i, r));
        *x = *d;
    }
}

/// `r = b - A x`, `d = first D^-1 r`.
struct FromSolution<'a> {
    x: &'a [Row],
    first: f32,
}

impl<const D: usize> Pass<D> for FromSolution<'_> {
    const VECTORS: usize = 2;

    #[inline(always)]
    fn row(&self, smoother: &Smoother<D>, i: usize, [r, d, _]: [&mut Row; 3]) {
        *r = minus(&smoother.b[i], &smoother.product(i, self.x));
        *d = times(self.first, smoother.precondition(i, r));
    }
}

/// `r -= A x`.
struct Residual<'a> {
    x: &'a [Row],
}

impl<const D: usize> Pass<D> for Residual<'_> {
    const VECTORS: usize = 1;

    #[inline(always)]
    fn row(&self, smoother: &Smoother<D>, i: usize, [r, _, _]: [&mut Row; 3]) {
        *r = minus(r, &smoother.product(i, self.x));
    }
}

/// One iteration: `r -= A d`, `e = kept d + gained D^-1 r`, `x += e + last d`.
struct Advance<'a> {
    d: &'a [Row],
    kept: f32,
    gained: f32,
    last: f32,
}

impl<const D: usize> Pass<D> for Advance<'_> {
    const VECTORS: usize = 3;

    #[inline(always)]
    fn row(&self, smoother: &Smoother<D>, i: usize, [x, r, e]: [&mut Row; 3]) {
        *r = minus(r, &smoother.product(i, self.d));
        let z = smoother.precondition(i, r);
        let d = &self.d[i];
        for k in 0..4 {
            e[k] = self.kept * d[k] + self.gained * z[k];
            x[k] += self.last * d[k] + e[k];
        }
    }
}
