//! Chebyshev smoother in single precision, with a matrix of 16-bit integers.
//!
//! Only the preconditioner has this precision: the conjugate gradients around it use the matrix in double
//! precision, so that their solution does not depend on it, and a third of the memory passes through the
//! caches. The matrix is that of scaled unknowns, `S^-1 A S^-1`, with `s_i^2` the largest diagonal entry
//! of row `i`. Its entries are at most 1 for any stiffness, and are stored in units of 1/32767. The error
//! is symmetric and at most 1.5e-5 of the diagonal. Half-precision floats would lose thirty times as much
//! at the large entries, which matter most.

use rayon::prelude::*;

use crate::lanes::{Kernel, Lanes, dispatch};
use crate::solver::block_matrix::BlockMatrix;
use crate::solver::conjugate_gradients::inverse;

/// Components of a vertex. Those beyond the dimension are zero in solutions and directions, and ignored
/// in right-hand sides and residuals.
pub(super) type Row = [f32; 4];
/// Rows per task; below twice as many, dispatch costs more than it saves.
pub const TASK_ROWS: usize = 1024;
/// Integer value of 1 in the matrix.
const UNIT: f32 = 32767.0;
/// Degree of the Chebyshev polynomial.
const DEGREE: usize = 3;
/// Ratio of the largest to the smallest eigenvalue that the polynomial damps.
const RATIO: f64 = 12.0;
/// Power iterations for the largest eigenvalue.
const POWER_ITERATIONS: usize = 12;
/// Safety factor for the eigenvalue bound. The Chebyshev polynomial leaves [-1, 1] at an eigenvalue 8 %
/// above the interval.
const SAFETY: f64 = 1.1;

/// A matrix with the inverses of its diagonal blocks, and the vectors of one level. Vectors are in
/// original unknowns between calls, in scaled ones within.
#[derive(Debug, Default)]
pub(super) struct Smoother<const D: usize> {
    row_start: Vec<u32>,
    column: Vec<u32>,
    /// Blocks of `S^-1 A S^-1`, `D` columns each.
    value: Vec<[[i16; 4]; D]>,
    /// Inverses of its diagonal blocks, `D` columns of four numbers per row.
    inverse: Vec<[Row; D]>,
    /// `s_i` of each row, and its inverse.
    scale: Vec<[f32; 2]>,
    /// Largest eigenvalue of `D^-1 A`.
    largest: f64,
    /// Solution.
    pub(super) x: Vec<Row>,
    /// Right-hand side.
    pub(super) b: Vec<Row>,
    /// Residual.
    pub(super) r: Vec<Row>,
    /// Last and next direction.
    d: Vec<Row>,
    e: Vec<Row>,
}

impl<const D: usize> Smoother<D> {
    /// Allocates the smoother for matrices of this structure.
    pub(super) fn new(matrix: &BlockMatrix<D>) -> Self {
        let zero = || vec![[0.0; 4]; matrix.rows()];
        Smoother {
            row_start: matrix.row_start.clone(),
            column: matrix.column.clone(),
            value: vec![[[0; 4]; D]; matrix.column.len()],
            inverse: vec![[[0.0; 4]; D]; matrix.rows()],
            scale: vec![[1.0; 2]; matrix.rows()],
            largest: 0.0,
            x: zero(),
            b: zero(),
            r: zero(),
            d: zero(),
            e: zero(),
        }
    }

    /// Sets the matrix to `scale * matrix`.
    pub(super) fn set(&mut self, matrix: &BlockMatrix<D>, scale: f64) {
        // Scales from the largest diagonal entry of each row.
        for (out, at) in self.scale.iter_mut().zip(&matrix.diagonal) {
            let block = &matrix.value[*at as usize];
            let largest = (0..D).fold(0.0, |m: f64, k| m.max(block[k][k]));
            let s = if largest > 0.0 { (scale * largest).sqrt() } else { 1.0 };
            *out = [s as f32, (1.0 / s) as f32];
        }
        // Scaled blocks as integers.
        let of_row = |(row, out): (usize, &mut [[[i16; 4]; D]])| {
            let own = f64::from(self.scale[row][1]);
            for ((c, block), out) in matrix.row(row).zip(out) {
                let factor = f64::from(UNIT) * scale * own * f64::from(self.scale[c][1]);
                for l in 0..D {
                    for k in 0..D {
                        let units = (factor * block[k][l]) as f32;
                        // Rounded; saturates if the matrix is not positive definite.
                        out[l][k] = (units + 0.5_f32.copysign(units)) as i16;
                    }
                }
            }
        };
        let mut rest = self.value.as_mut_slice();
        let rows = (0..matrix.rows()).map(|row| {
            let count = (matrix.row_start[row + 1] - matrix.row_start[row]) as usize;
            let (own, after) = std::mem::take(&mut rest).split_at_mut(count);
            rest = after;
            (row, own)
        });
        if matrix.rows() < 2 * TASK_ROWS || rayon::current_num_threads() == 1 {
            rows.for_each(of_row);
        } else {
            let rows: Vec<_> = rows.collect();
            rows.into_par_iter().with_min_len(TASK_ROWS).for_each(of_row);
        }
        // Inverse diagonal blocks of the scaled matrix, and its largest eigenvalue.
        for ((out, at), [s, _]) in self.inverse.iter_mut().zip(&matrix.diagonal).zip(&self.scale) {
            let inverse = inverse(&matrix.value[*at as usize]);
            let factor = f64::from(*s) * f64::from(*s) / scale;
            for l in 0..D {
                for k in 0..D {
                    out[l][k] = (factor * inverse[k][l]) as f32;
                }
            }
        }
        self.largest = SAFETY * self.power_iteration();
    }

    /// Estimates the largest eigenvalue of `D^-1 A` from below.
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

    /// Row `i` of `A x`.
    #[inline(always)]
    fn product(&self, i: usize, x: &[Row]) -> Row {
        let range = self.row_start[i] as usize..self.row_start[i + 1] as usize;
        // One sum per block column, so that they are independent.
        let mut sums = [[0.0; 4]; D];
        for (block, c) in self.value[range.clone()].iter().zip(&self.column[range]) {
            let x = &x[*c as usize];
            for l in 0..D {
                for k in 0..4 {
                    sums[l][k] = f32::from(block[l][k]).mul_add(x[l], sums[l][k]);
                }
            }
        }
        let mut sum = sums[0];
        for l in 1..D {
            sum = plus(&sum, &sums[l]);
        }
        times(1.0 / UNIT, sum)
    }

    /// Row `i` of `D^-1 r`.
    #[inline(always)]
    fn precondition(&self, i: usize, r: &Row) -> Row {
        let columns = &self.inverse[i];
        let mut z = times(r[0], columns[0]);
        for l in 1..D {
            z = plus(&z, &times(r[l], columns[l]));
        }
        z
    }

    /// Computes `x = S b` by Chebyshev iterations from zero, and `r = b - A x`; Saad 2003, *Iterative
    /// methods for sparse linear systems*, algorithm 12.1.
    pub(super) fn smooth_from_zero(&mut self) {
        let [mut x, mut r, mut d, mut e] = self.take();
        let (first, factors) = self.coefficients();
        self.run(FromZero { first }, [&mut x, &mut r, &mut d]);
        for (kept, gained) in factors {
            self.run(Advance { d: &d, kept, gained, last: 0.0 }, [&mut x, &mut r, &mut e]);
            std::mem::swap(&mut d, &mut e);
        }
        self.run(ResidualPass { x: &d }, [&mut r, &mut x, &mut []]);
        self.put_back([x, r, d, e]);
    }

    /// Runs the same iterations from `x`; `r` is overwritten.
    pub(super) fn smooth(&mut self) {
        let [mut x, mut r, mut d, mut e] = self.take();
        let (first, factors) = self.coefficients();
        x.iter_mut().zip(&self.scale).for_each(|(x, [s, _])| *x = times(*s, *x));
        self.run(FromSolution { x: &x, first }, [&mut r, &mut d, &mut []]);
        for (n, (kept, gained)) in factors.into_iter().enumerate() {
            // The first direction could not be added while the old solution was being read.
            let last = if n == 0 { 1.0 } else { 0.0 };
            self.run(Advance { d: &d, kept, gained, last }, [&mut x, &mut r, &mut e]);
            std::mem::swap(&mut d, &mut e);
        }
        x.iter_mut().zip(&self.scale).for_each(|(x, [_, s])| *x = times(*s, *x));
        self.put_back([x, r, d, e]);
    }

    /// Runs `pass` on all rows of the vectors that it needs.
    fn run<P: RowPass<D>>(&self, pass: P, vectors: [&mut [Row]; 3]) {
        let n = vectors[0].len();
        let [a, b, c] = vectors;
        let pass = &pass;
        let task = |(i, a, b, c)| dispatch(RowSpan { smoother: self, pass, first: i, a, b, c });
        if n < 2 * TASK_ROWS || rayon::current_num_threads() == 1 {
            return task((0, a, b, c));
        }
        // Unused vectors are empty.
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

    /// Returns the factor of the first direction, and for each further iteration those of the last
    /// direction and of the residual.
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
}

#[inline(always)]
fn minus(a: &Row, b: &Row) -> Row {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]]
}

#[inline(always)]
fn plus(a: &Row, b: &Row) -> Row {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]]
}

#[inline(always)]
fn times(s: f32, a: Row) -> Row {
    [s * a[0], s * a[1], s * a[2], s * a[3]]
}

/// Sum of all squares.
fn square(rows: &[Row]) -> f64 {
    rows.iter().map(|r| f64::from(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])).sum()
}

/// Operation on row `i` of up to three vectors.
trait RowPass<const D: usize>: Sync {
    /// Number of vectors used.
    const VECTORS: usize;
    /// Mark the implementation `#[inline(always)]`, see [`crate::lanes`].
    fn row(&self, smoother: &Smoother<D>, i: usize, rows: [&mut Row; 3]);
}

/// Rows from `first` on.
struct RowSpan<'a, P, const D: usize> {
    smoother: &'a Smoother<D>,
    pass: &'a P,
    first: usize,
    a: &'a mut [Row],
    b: &'a mut [Row],
    c: &'a mut [Row],
}

impl<P: RowPass<D>, const D: usize> Kernel for RowSpan<'_, P, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let RowSpan { smoother, pass, first, a, b, c } = self;
        let (mut spare_b, mut spare_c) = ([0.0; 4], [0.0; 4]);
        for (i, a) in a.iter_mut().enumerate() {
            let b = if P::VECTORS > 1 { &mut b[i] } else { &mut spare_b };
            let c = if P::VECTORS > 2 { &mut c[i] } else { &mut spare_c };
            pass.row(smoother, first + i, [a, b, c]);
        }
    }
}

/// Computes `y = factor D^-1 A x`.
struct Power<'a> {
    x: &'a [Row],
    factor: f32,
}

impl<const D: usize> RowPass<D> for Power<'_> {
    const VECTORS: usize = 1;

    #[inline(always)]
    fn row(&self, smoother: &Smoother<D>, i: usize, [y, _, _]: [&mut Row; 3]) {
        let ax = smoother.product(i, self.x);
        *y = times(self.factor, smoother.precondition(i, &ax));
    }
}

/// Computes `r = b`, `x = d = first D^-1 r`.
struct FromZero {
    first: f32,
}

impl<const D: usize> RowPass<D> for FromZero {
    const VECTORS: usize = 3;

    #[inline(always)]
    fn row(&self, smoother: &Smoother<D>, i: usize, [x, r, d]: [&mut Row; 3]) {
        *r = times(smoother.scale[i][1], smoother.b[i]);
        *d = times(self.first, smoother.precondition(i, r));
        *x = *d;
    }
}

/// Computes `r = b - A x`, `d = first D^-1 r`.
struct FromSolution<'a> {
    x: &'a [Row],
    first: f32,
}

impl<const D: usize> RowPass<D> for FromSolution<'_> {
    const VECTORS: usize = 2;

    #[inline(always)]
    fn row(&self, smoother: &Smoother<D>, i: usize, [r, d, _]: [&mut Row; 3]) {
        *r = minus(&times(smoother.scale[i][1], smoother.b[i]), &smoother.product(i, self.x));
        *d = times(self.first, smoother.precondition(i, r));
    }
}

/// Computes `r -= A x`, then returns `r` and `x` to the original unknowns.
struct ResidualPass<'a> {
    x: &'a [Row],
}

impl<const D: usize> RowPass<D> for ResidualPass<'_> {
    const VECTORS: usize = 2;

    #[inline(always)]
    fn row(&self, smoother: &Smoother<D>, i: usize, [r, x, _]: [&mut Row; 3]) {
        let [s, inverse] = smoother.scale[i];
        *r = times(s, minus(r, &smoother.product(i, self.x)));
        *x = times(inverse, *x);
    }
}

/// One iteration: `r -= A d`, `e = kept d + gained D^-1 r`, `x += e + last d`.
struct Advance<'a> {
    d: &'a [Row],
    kept: f32,
    gained: f32,
    last: f32,
}

impl<const D: usize> RowPass<D> for Advance<'_> {
    const VECTORS: usize = 3;

    #[inline(always)]
    fn row(&self, smoother: &Smoother<D>, i: usize, [x, r, e]: [&mut Row; 3]) {
        // Each row is read and written whole, or the compiler splits it.
        let rest = minus(r, &smoother.product(i, self.d));
        *r = rest;
        let (z, d) = (smoother.precondition(i, &rest), self.d[i]);
        let next = plus(&times(self.kept, d), &times(self.gained, z));
        *x = plus(x, &plus(&times(self.last, d), &next));
        *e = next;
    }
}
