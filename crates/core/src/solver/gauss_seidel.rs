//! Conjugate gradients preconditioned by symmetric Gauss-Seidel, at the cost of one matrix product per
//! iteration.
//!
//! With the diagonal blocks `D = C C^T` of the matrix, the unknowns are `y = C^T x`:
//! `A = C^-1 (...) C^-T` has a unit diagonal, and `A = I + L + L^T`. The preconditioner is
//! `P = (I + L) (I + L)^T`. In terms of `y^ = (I + L)^T y` and `r^ = (I + L)^-1 r` the system is `(I +
//! L)^-1 A (I + L)^-T y^ = (I + L)^-1 b`, and with `t = (I + L)^-T p` the product is
//!
//! ```text
//! (I + L)^-1 A t = t + (I + L)^-1 (L^T t),   L^T t = p - t
//! ```
//!
//! (Eisenstat 1981, *Efficient implementation of a class of preconditioned conjugate gradient methods*,
//! SIAM Journal on Scientific and Statistical Computing 2(1)). Each block is read once, as in a product
//! with the matrix, and the iterations are about half of those with inverse diagonal blocks. Rows wait
//! for each other in a sweep; without the diagonal blocks, half as long.
//!
//! Only the blocks of `L^T` are stored. With `L^T` a row gathers from later rows; with `L` it scatters to
//! them, as a column of `L`, once it is known. This halves the memory traffic, and in both sweeps a block
//! row fits one register: sums over its entries wait for the end of the row.
//!
//! With over-relaxation `o`, `I / o + L` replaces `I + L`, and `L^T t + (1 - 1 / o) t` replaces `L^T t`:
//! Young 1971, *Iterative solution of large linear systems*, chapter 15.
//!
//! Rows are split into parts whose length depends only on their number. Threads process whole parts, so
//! that the result is bit-identical for any number of threads. Coupling between parts, `R`, is excluded
//! from `L`, and `A t` gains `R t`.

use rayon::prelude::*;

use super::block_matrix::{Block, BlockMatrix};
use super::cholesky::NotPositiveDefinite;
use super::conjugate_gradients::{CgReport, CgTolerance, ConjugateGradients, NoPreconditioner, factor};
use crate::deadline::Stop;
use crate::lanes::{HALF, HalfPack, Kernel, Lanes, dispatch_compact};

/// Most rows of a part.
const PART_ROWS: usize = 4096;
/// Vector row in a sweep.
type PaddedRow = [f64; HALF];

/// Conjugate gradients with symmetric Gauss-Seidel, and their memory.
#[derive(Default)]
pub struct GaussSeidel<const D: usize> {
    /// `C^-1` of each row, lower triangles.
    scale: Vec<Block<D>>,
    /// Pattern version of the parts.
    pattern: Option<u64>,
    parts: Vec<Part>,
    relaxation: Relaxation,
    cg: ConjugateGradients,
    vectors: SweepVectors,
    right: Vec<f64>,
}

/// Over-relaxation factor `o`.
#[derive(Clone, Copy, Debug)]
struct Relaxation(f64);

impl Default for Relaxation {
    /// No over-relaxation.
    fn default() -> Self {
        Relaxation(1.0)
    }
}

/// Vectors of the sweeps.
#[derive(Default)]
struct SweepVectors {
    /// `t = (I + L)^-T p`, zero beyond `D`.
    t: Vec<PaddedRow>,
    /// `L^T t`, then `(I + L)^-1 (L^T t + R t)`; undefined beyond `D`.
    rest: Vec<PaddedRow>,
}

/// Scaled blocks of consecutive rows.
#[derive(Default)]
struct Part {
    first: usize,
    rows: usize,
    /// Blocks of `L^T`, with columns counted from the first row, and of `R`.
    above: ScaledRows,
    outside: ScaledRows,
}

/// Rows of blocks stored by rows, side by side.
#[derive(Default)]
struct ScaledRows {
    start: Vec<u32>,
    column: Vec<u32>,
    /// Entries, with padding for the loads of the last block.
    value: Vec<f64>,
}

impl ScaledRows {
    fn clear(&mut self) {
        self.start.clear();
        self.start.push(0);
        self.column.clear();
    }

    fn end_row(&mut self) {
        self.start.push(self.column.len() as u32);
    }

    /// Allocates the entries of all blocks.
    fn end<const D: usize>(&mut self) {
        self.value.clear();
        self.value.resize(D * D * self.column.len() + HALF, 0.0);
    }

    /// Entries of block `at`.
    #[inline(always)]
    fn block_mut<const D: usize>(&mut self, at: usize) -> &mut [f64] {
        &mut self.value[D * D * at..][..D * D]
    }

    /// Columns of row `i`, and the entries from its first block on.
    #[inline(always)]
    fn row<const D: usize>(&self, i: usize) -> (&[u32], &[f64]) {
        let (from, to) = (self.start[i] as usize, self.start[i + 1] as usize);
        (&self.column[from..to], &self.value[D * D * from..])
    }

    /// Sums the products of the blocks of row `i` with rows of `x`. Rows and sum are zero beyond `D`.
    #[inline(always)]
    fn row_product<H: HalfPack, const D: usize>(&self, i: usize, x: &[PaddedRow]) -> H {
        let (columns, mut values) = self.row::<D>(i);
        let mut products = [H::splat(0.0); HALF];
        for column in columns {
            let x = H::load(&x[*column as usize]);
            let block = &values[..D * D - D + HALF];
            for k in 0..D {
                // Entries after a block row are multiplied by zero.
                products[k] = products[k] + row_of::<H, D>(block, k) * x;
            }
            values = &values[D * D..];
        }
        H::sums(products)
    }

    /// Subtracts the products of the transposed blocks of row `i` with `left` from rows of `y`.
    #[inline(always)]
    fn subtract_transposed<H: HalfPack, const D: usize>(
        &self,
        i: usize,
        left: &PaddedRow,
        y: &mut [PaddedRow],
    ) {
        let (columns, mut values) = self.row::<D>(i);
        let mut factors = [H::splat(0.0); D];
        for k in 0..D {
            factors[k] = H::splat(left[k]);
        }
        for column in columns {
            let block = &values[..D * D - D + HALF];
            let mut product = row_of::<H, D>(block, 0) * factors[0];
            for k in 1..D {
                product = product + row_of::<H, D>(block, k) * factors[k];
            }
            let y = &mut y[*column as usize];
            (H::load(y) - product).store(y);
            values = &values[D * D..];
        }
    }
}

/// A row padded with zeros beyond `D`.
#[inline(always)]
fn padded<const D: usize>(row: &[f64; D]) -> PaddedRow {
    let mut padded = [0.0; HALF];
    for k in 0..HALF {
        // Index loop: a slice copy would go through memory.
        if k < D {
            padded[k] = row[k];
        }
    }
    padded
}

/// Row `k` of a block, and the entries after it.
#[inline(always)]
fn row_of<H: HalfPack, const D: usize>(block: &[f64], k: usize) -> H {
    H::load(&block[D * k..].as_chunks().0[0])
}

/// Rows per part for `rows` in total.
fn rows_of_part(rows: usize) -> usize {
    rows.div_ceil(rows.div_ceil(PART_ROWS).max(1)).max(1)
}

/// Returns `C^-1`, lower triangle, of a block `C C^T`; `None` if it is not positive definite.
fn scale_of<const D: usize>(a: &Block<D>) -> Option<Block<D>> {
    let c = factor(a)?;
    let mut inverse = [[0.0; D]; D];
    for i in 0..D {
        inverse[i][i] = 1.0 / c[i][i];
        for j in 0..i {
            let sum = (j..i).map(|k| c[i][k] * inverse[k][j]).sum::<f64>();
            inverse[i][j] = -sum / c[i][i];
        }
    }
    Some(inverse)
}

impl<const D: usize> GaussSeidel<D> {
    /// Creates a solver with sweeps over-relaxed by `factor`, between 1 and 2.
    pub fn relaxed(factor: f64) -> Self {
        GaussSeidel { relaxation: Relaxation(factor), ..GaussSeidel::default() }
    }

    /// Sets the flag that ends solves.
    pub(super) fn set_stop(&mut self, stop: Stop) {
        self.cg.set_stop(stop);
    }

    /// Updates the solver for a new matrix with this pattern version.
    ///
    /// # Errors
    /// If a diagonal block is not positive definite.
    pub fn update(&mut self, matrix: &BlockMatrix<D>, pattern: u64) -> Result<(), NotPositiveDefinite> {
        let GaussSeidel { scale, pattern: of, parts, vectors: SweepVectors { t, rest }, .. } = self;
        scale.clear();
        for at in &matrix.diagonal {
            scale.push(scale_of(&matrix.value[*at as usize]).ok_or(NotPositiveDefinite)?);
        }
        let rows = matrix.rows();
        if *of != Some(pattern) {
            let each = rows_of_part(rows);
            parts.resize_with(rows.div_ceil(each), Part::default);
            for (number, part) in parts.iter_mut().enumerate() {
                part.first = number * each;
                part.rows = each.min(rows - part.first);
                part.lay_out(matrix);
            }
            *of = Some(pattern);
        }
        parts.par_iter_mut().for_each(|part| dispatch_compact(Scaling { part, matrix, scale }));
        for vector in [t, rest] {
            vector.resize(rows, [0.0; HALF]);
        }
        Ok(())
    }

    /// Solves for the right-hand side `b` with the last matrix, from `x = 0`. The residual tolerance
    /// refers to `sqrt(r^T P^-1 r)` relative to its first value.
    pub fn solve(
        &mut self,
        b: &[f64],
        x: &mut [f64],
        tolerance: CgTolerance,
        max_iterations: u64,
    ) -> CgReport {
        let GaussSeidel { scale, parts, relaxation: Relaxation(relaxation), cg, vectors, right, .. } = self;
        let SweepVectors { t, rest } = vectors;
        for ((rest, b), scale) in rest.iter_mut().zip(b.as_chunks::<D>().0).zip(&*scale) {
            for k in 0..D {
                rest[k] = (0..=k).map(|l| scale[k][l] * b[l]).sum();
            }
        }
        t.fill([0.0; HALF]);
        right.resize(b.len(), 0.0);
        let sweeps = Sweeps::<D> { parts, relaxation: *relaxation };
        sweeps.forward(t, rest, right);
        let product = |p: &[f64], q: &mut [f64]| {
            sweeps.backward(p, t, rest);
            sweeps.forward(t, rest, q);
        };
        let report = cg.solve::<D>(product, &mut NoPreconditioner, right, x, tolerance, max_iterations);
        sweeps.backward(x, t, rest);
        for ((x, t), scale) in x.as_chunks_mut::<D>().0.iter_mut().zip(&*t).zip(&*scale) {
            for k in 0..D {
                x[k] = (k..D).map(|l| scale[l][k] * t[l]).sum();
            }
        }
        report
    }
}

impl Part {
    /// Allocates the blocks of its rows of `matrix`.
    fn lay_out<const D: usize>(&mut self, matrix: &BlockMatrix<D>) {
        let Part { first, rows, above, outside } = self;
        let own = *first..*first + *rows;
        for rows in [&mut *above, outside] {
            rows.clear();
        }
        for i in own.clone() {
            for (j, _) in matrix.row(i) {
                if !own.contains(&j) {
                    outside.column.push(j as u32);
                } else if j > i {
                    above.column.push((j - *first) as u32);
                }
            }
            for rows in [&mut *above, outside] {
                rows.end_row();
            }
        }
        for rows in [above, outside] {
            rows.end::<D>();
        }
    }
}

/// Scales the blocks of a part: `C_i^-1 A_ij C_j^-T`.
struct Scaling<'a, const D: usize> {
    part: &'a mut Part,
    matrix: &'a BlockMatrix<D>,
    scale: &'a [Block<D>],
}

impl<const D: usize> Kernel for Scaling<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Scaling { part: Part { first, rows, above, outside }, matrix, scale } = self;
        let (first, end) = (*first, *first + *rows);
        let (mut at_above, mut at_outside) = (0, 0);
        for i in first..end {
            for (j, block) in matrix.row(i) {
                let is_own = j >= first && j < end;
                if is_own && j <= i {
                    continue;
                }
                let (rows, at) =
                    if is_own { (&mut *above, &mut at_above) } else { (&mut *outside, &mut at_outside) };
                let scaled = scaled(&scale[i], block, &scale[j]);
                rows.block_mut::<D>(*at).copy_from_slice(scaled.as_flattened());
                *at += 1;
            }
        }
    }
}

/// Computes `a B c^T` for lower triangles `a` and `c`.
#[inline(always)]
fn scaled<const D: usize>(a: &Block<D>, b: &Block<D>, c: &Block<D>) -> Block<D> {
    let mut half = [[0.0; D]; D];
    for k in 0..D {
        for m in 0..=k {
            for l in 0..D {
                half[k][l] += a[k][m] * b[m][l];
            }
        }
    }
    let mut whole = [[0.0; D]; D];
    for k in 0..D {
        for l in 0..D {
            for m in 0..=l {
                whole[k][l] += half[k][m] * c[l][m];
            }
        }
    }
    whole
}

/// Sweeps over all parts.
struct Sweeps<'a, const D: usize> {
    parts: &'a [Part],
    /// Over-relaxation factor `o`.
    relaxation: f64,
}

impl<const D: usize> Sweeps<'_, D> {
    /// Computes `t = (I / o + L)^-T p`, `p` flat, and `rest = L^T t + (1 - 1 / o) t`.
    fn backward(&self, p: &[f64], t: &mut [PaddedRow], rest: &mut [PaddedRow]) {
        let Sweeps { parts, relaxation } = *self;
        let p = p.as_chunks::<D>().0;
        if let [part] = parts {
            return dispatch_compact(Backward { part, relaxation, p, t, rest });
        }
        let each = parts.first().map_or(1, |part| part.rows);
        let vectors = p.par_chunks(each).zip(t.par_chunks_mut(each)).zip(rest.par_chunks_mut(each));
        parts.par_iter().zip(vectors).for_each(|(part, ((p, t), rest))| {
            dispatch_compact(Backward { part, relaxation, p, t, rest });
        });
    }

    /// Computes `q = t + (I / o + L)^-1 (rest + R t)`, flat; overwrites `rest`.
    fn forward(&self, t: &[PaddedRow], rest: &mut [PaddedRow], q: &mut [f64]) {
        let Sweeps { parts, relaxation } = *self;
        let q = q.as_chunks_mut::<D>().0;
        if let [part] = parts {
            return dispatch_compact(Forward { part, relaxation, t, rest, q });
        }
        let each = parts.first().map_or(1, |part| part.rows);
        let vectors = rest.par_chunks_mut(each).zip(q.par_chunks_mut(each));
        parts.par_iter().zip(vectors).for_each(|(part, (rest, q))| {
            dispatch_compact(Forward { part, relaxation, t, rest, q });
        });
    }
}

/// One part of [`Sweeps::backward`].
struct Backward<'a, const D: usize> {
    part: &'a Part,
    relaxation: f64,
    p: &'a [[f64; D]],
    t: &'a mut [PaddedRow],
    rest: &'a mut [PaddedRow],
}

impl<const D: usize> Kernel for Backward<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Backward { part: Part { rows, above, .. }, relaxation, p, t, rest } = self;
        let (factor, beside) = (L::Half::splat(relaxation), L::Half::splat(1.0 - 1.0 / relaxation));
        for i in (0..*rows).rev() {
            let sum: L::Half = above.row_product::<_, D>(i, t);
            let left = factor * (L::Half::load(&padded(&p[i])) - sum);
            left.store(&mut t[i]);
            (sum + beside * left).store(&mut rest[i]);
        }
    }
}

/// One part of [`Sweeps::forward`].
struct Forward<'a, const D: usize> {
    part: &'a Part,
    relaxation: f64,
    t: &'a [PaddedRow],
    rest: &'a mut [PaddedRow],
    q: &'a mut [[f64; D]],
}

impl<const D: usize> Kernel for Forward<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Forward { part: Part { first, rows, above, outside }, relaxation, t, rest, q } = self;
        let factor = L::Half::splat(relaxation);
        let alone = outside.column.is_empty();
        for i in 0..*rows {
            let mut sum = L::Half::load(&rest[i]);
            if !alone {
                sum = sum + outside.row_product::<_, D>(i, t);
            }
            let mut left = [0.0; HALF];
            (factor * sum).store(&mut left);
            above.subtract_transposed::<L::Half, D>(i, &left, rest);
            let own = &t[*first + i];
            for k in 0..D {
                q[i][k] = own[k] + left[k];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::conjugate_gradients::{CgEnd, Preconditioner, inverse};

    /// Rows of three parts, each coupled to the next.
    const ROWS: usize = 2 * PART_ROWS + 100;
    /// Distance of the coupled rows beyond neighbours: it spans parts.
    const FAR: usize = 3000;

    /// Springs between neighbours, stiffer along one axis than across, and between distant rows, on a
    /// foundation of stiffness `ground`.
    fn lattice(rows: usize, ground: f64) -> BlockMatrix<2> {
        lattice_of(rows, FAR, ground)
    }

    /// Builds the lattice with `far` rows between the distant coupled ones.
    fn lattice_of(rows: usize, far: usize, ground: f64) -> BlockMatrix<2> {
        let linked = |i: usize| {
            let near = [i.checked_sub(far), i.checked_sub(1), Some(i), Some(i + 1), Some(i + far)];
            near.into_iter().flatten().filter(move |j| *j < rows)
        };
        let (mut row_start, mut column) = (vec![0], vec![]);
        for i in 0..rows {
            column.extend(linked(i).map(|j| j as u32));
            row_start.push(column.len() as u32);
        }
        let mut matrix = BlockMatrix::zero(row_start, column);
        for i in 0..rows {
            for at in matrix.row_start[i] as usize..matrix.row_start[i + 1] as usize {
                let j = matrix.column[at] as usize;
                if i == j {
                    continue;
                }
                let stiffness = 1.0 + 0.5 * ((i + j) as f64).sin();
                let spring = [[stiffness, 0.3], [0.3, 4.0]];
                matrix.value[at] = spring.map(|row| row.map(|k| -k));
                let diagonal = &mut matrix.value[matrix.diagonal[i] as usize];
                (0..2).for_each(|k| (0..2).for_each(|l| diagonal[k][l] += spring[k][l]));
            }
            let diagonal = &mut matrix.value[matrix.diagonal[i] as usize];
            (0..2).for_each(|k| diagonal[k][k] += ground);
        }
        matrix
    }

    fn load(rows: usize) -> Vec<f64> {
        (0..2 * rows).map(|i| (0.7 * i as f64).sin() + (0.01 * i as f64).cos()).collect()
    }

    fn solved(matrix: &BlockMatrix<2>, residual: f64) -> (Vec<f64>, CgReport) {
        solved_by(GaussSeidel::default(), matrix, residual)
    }

    fn solved_by(mut solver: GaussSeidel<2>, matrix: &BlockMatrix<2>, residual: f64) -> (Vec<f64>, CgReport) {
        let b = load(matrix.rows());
        solver.update(matrix, 0).unwrap();
        let mut x = vec![0.0; b.len()];
        let report = solver.solve(&b, &mut x, residual.into(), 10_000);
        (x, report)
    }

    /// Inverse diagonal blocks.
    struct Jacobi(Vec<Block<2>>);

    impl Preconditioner<2> for Jacobi {
        fn update(&mut self, _: &BlockMatrix<2>) -> Result<(), NotPositiveDefinite> {
            Ok(())
        }

        fn apply(&mut self, r: &[f64], z: &mut [f64]) {
            for (i, block) in self.0.iter().enumerate() {
                (0..2).for_each(|k| z[2 * i + k] = block[k][0] * r[2 * i] + block[k][1] * r[2 * i + 1]);
            }
        }
    }

    #[test]
    fn solutions_solve_the_system_in_one_part_and_in_three() {
        for rows in [FAR + 1, ROWS] {
            let (matrix, b) = (lattice(rows, 0.02), load(rows));
            let (x, report) = solved(&matrix, 1e-12);
            assert_eq!(report.end, CgEnd::Converged, "{report:?}");
            let mut product = vec![0.0; b.len()];
            matrix.multiply(&x, &mut product);
            let left = product.iter().zip(&b).fold(0.0, |m: f64, (p, b)| m.max((p - b).abs()));
            assert!(left < 1e-9, "{rows} rows: {left:e} is left");
        }
    }

    #[test]
    fn over_relaxed_sweeps_find_the_solution_in_fewer_iterations() {
        for (rows, far) in [(1600, 40), (ROWS, 90)] {
            let matrix = lattice_of(rows, far, 0.002);
            let (expected, without) = solved(&matrix, 1e-12);
            let (x, report) = solved_by(GaussSeidel::relaxed(1.25), &matrix, 1e-12);
            assert_eq!(report.end, CgEnd::Converged, "{report:?}");
            assert!(10 * report.iterations < 9 * without.iterations, "{report:?}, {without:?}");
            let off = x.iter().zip(&expected).fold(0.0, |m: f64, (x, e)| m.max((x - e).abs()));
            assert!(off < 1e-9, "{rows} rows: {off:e} off");
        }
    }

    /// Iterations to the same error in the energy norm are well below those with inverse diagonal blocks.
    #[test]
    fn iterations_are_fewer_than_with_diagonal_blocks() {
        let (matrix, b) = (lattice(ROWS, 0.02), load(ROWS));
        let (exact, _) = solved(&matrix, 1e-13);
        let error = |x: &[f64]| {
            let off: Vec<f64> = x.iter().zip(&exact).map(|(x, e)| x - e).collect();
            let mut product = vec![0.0; off.len()];
            matrix.multiply(&off, &mut product);
            crate::solver::conjugate_gradients::dot(&off, &product).sqrt()
        };
        let (x, report) = solved(&matrix, 1e-6);
        let blocks = matrix.diagonal.iter().map(|at| inverse(&matrix.value[*at as usize])).collect();
        let mut jacobi = Jacobi(blocks);
        let mut by_blocks = |iterations: u64| {
            let mut x = vec![0.0; b.len()];
            let product = |p: &[f64], q: &mut [f64]| matrix.multiply(p, q);
            let mut cg = ConjugateGradients::default();
            cg.solve(product, &mut jacobi, &b, &mut x, CgTolerance::from(0.0), iterations);
            error(&x)
        };
        let same = 3 * report.iterations / 2;
        assert!(by_blocks(same) > error(&x), "{report:?}: as good after {same} iterations");
    }

    #[test]
    fn bits_do_not_depend_on_threads() {
        let matrix = lattice(ROWS, 0.02);
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| solved(&matrix, 1e-8))
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn indefinite_matrices_are_seen() {
        let matrix = lattice(200, -0.5);
        assert_eq!(solved(&matrix, 1e-8).1.end, CgEnd::Indefinite);
        let mut negative = lattice(200, 0.02);
        negative.value[negative.diagonal[70] as usize] = [[1.0, 2.0], [2.0, 1.0]];
        assert!(GaussSeidel::<2>::default().update(&negative, 0).is_err());
    }
}
