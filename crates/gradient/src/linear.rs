//! Linear equations of implicit steps with the exact Hessian: one factorisation for each solve of the run.

use pliant::material::Psd;
use pliant::solver::cholesky::Cholesky;
use pliant::solver::hessian::{Assembler, At, Weights};
use pliant::system::System;
use pliant_sparse::{Lu, SymbolicLu};

use crate::adjoint::free_only;
use crate::krylov::{CorrectedEquations, keep_free, solve};

/// The factors in `A = inertia M + damping d2R/dv2 + stiffness (d2E/dx2 + G)`: `G = (d2R/dx dv)^T` on the way
/// back, `d2R/dx dv` on the way forth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Coefficients {
    pub(crate) inertia: f64,
    pub(crate) damping: f64,
    pub(crate) stiffness: f64,
}

impl Coefficients {
    /// Writes `A p` over `y`, from the products with `p`.
    fn combine(self, system: &System, p: &[f64], products: &Products, y: &mut [f64]) {
        let (d, Coefficients { inertia, damping, stiffness }) = (system.dimension(), self);
        let Products { by_positions, by_velocities, .. } = products;
        for (i, y) in y.iter_mut().enumerate() {
            let inertial = inertia * system.mass()[i / d] * p[i];
            *y = inertial + damping * by_velocities[i] + stiffness * by_positions[i];
        }
    }
}

/// Products of a direction `p` with derivatives of forces.
pub(crate) struct Products {
    /// True for products of tangents, `G = d2R/dx dv`; false for those of adjoints, the transpose.
    is_forth: bool,
    /// `(d2E/dx2 + G) p` [N].
    pub(crate) by_positions: Vec<f64>,
    /// `d2R/dv2 p` [N]; zero where nothing dissipates.
    pub(crate) by_velocities: Vec<f64>,
    /// `p . dE/dx` of each energy term, where it comes with the products.
    pub(crate) works: Vec<Option<f64>>,
    scratch: Vec<f64>,
}

impl Products {
    /// Zero, of adjoints.
    pub(crate) fn back(unknowns: usize) -> Self {
        let zero = || vec![0.0; unknowns];
        Products {
            is_forth: false,
            by_positions: zero(),
            by_velocities: zero(),
            works: vec![],
            scratch: zero(),
        }
    }

    /// Zero, of tangents.
    pub(crate) fn forth(unknowns: usize) -> Self {
        Products { is_forth: true, ..Products::back(unknowns) }
    }

    /// Takes them at positions `x` and velocities `v`, flat.
    pub(crate) fn evaluate(&mut self, system: &mut System, (x, v): (&[f64], &[f64]), p: &[f64]) {
        match self.is_forth {
            true => system.hessian_product(x, p, &mut self.by_positions),
            false => system.transposed_product(x, p, &mut self.by_positions, &mut self.works),
        }
        if system.is_damped() {
            match self.is_forth {
                true => system.position_change(x, v, p, &mut self.scratch),
                false => system.position_product(x, v, p, &mut self.scratch),
            };
            self.by_positions.iter_mut().zip(&self.scratch).for_each(|(y, part)| *y += part);
            system.damping_product(x, v, p, &mut self.by_velocities);
        }
    }

    fn clear(&mut self) {
        self.by_positions.fill(0.0);
        self.by_velocities.fill(0.0);
        self.works.clear();
    }
}

/// Factors of the matrix of one configuration.
pub(crate) trait Factorisation {
    /// Assembles and factorises the symmetric part of the matrix at positions [m] and velocities [m/s],
    /// flat; false where it is singular.
    fn factorise(&mut self, system: &mut System, at: (&[f64], &[f64]), coefficients: Coefficients) -> bool;

    /// Replaces `b` by `A^-1 b`.
    fn solve(&mut self, b: &mut [f64]);

    /// True if the matrix that was factorised is positive definite.
    fn is_definite(&self) -> bool;

    /// `max_i sum_j |A_ij p_j|`, of the matrix that was factorised.
    fn largest_sum(&self, p: &[f64]) -> f64;
}

/// Residuals of solutions as exact as their last digits, over the sums of sizes.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// A factorisation for systems of `dimension` coordinates per vertex.
pub(crate) fn factorisation(dimension: usize) -> Box<dyn Factorisation> {
    match dimension {
        2 => Box::new(Sparse::<2>::default()),
        _ => Box::new(Sparse::<3>::default()),
    }
}

/// Cholesky's, its structure kept as long as it fits; LU where the exact matrix is not positive definite.
#[derive(Default)]
struct Sparse<const D: usize> {
    assembler: Option<Assembler<D>>,
    cholesky: Option<Cholesky>,
    /// Version of the pattern that Cholesky's structure is of: contact changes it.
    pattern: u64,
    lu: Option<Lu>,
}

impl<const D: usize> Factorisation for Sparse<D> {
    fn factorise(&mut self, system: &mut System, at: (&[f64], &[f64]), coefficients: Coefficients) -> bool {
        let ((x, v), Coefficients { inertia, damping, stiffness }) = (at, coefficients);
        // Pins that let go change what is held.
        if self.assembler.as_ref().is_some_and(|assembler| !assembler.fits(system)) {
            (self.assembler, self.cholesky) = (None, None);
        }
        let assembler = self.assembler.get_or_insert_with(|| Assembler::new(system));
        let weights = Weights { inertia, stiffness, damping };
        system.find_stencils(x);
        assembler.assemble(system, At { x, v, psd: Psd::Exact, predicted_from: None }, weights);
        let matrix = assembler.matrix();
        if self.cholesky.is_none() || self.pattern != assembler.pattern() {
            self.cholesky = Cholesky::new(matrix, x);
            self.pattern = assembler.pattern();
        }
        self.lu = None;
        if self.cholesky.as_mut().is_some_and(|cholesky| cholesky.factorize(matrix).is_ok()) {
            return true;
        }
        self.lu = lu(assembler);
        self.lu.is_some()
    }

    fn solve(&mut self, b: &mut [f64]) {
        match (&self.lu, &mut self.cholesky) {
            (Some(lu), _) => lu.solve(b),
            (None, Some(cholesky)) => cholesky.solve(b),
            (None, None) => {}
        }
    }

    fn is_definite(&self) -> bool {
        self.lu.is_none()
    }

    fn largest_sum(&self, p: &[f64]) -> f64 {
        let Some(assembler) = &self.assembler else { return 0.0 };
        let (matrix, p) = (assembler.matrix(), p.as_chunks::<D>().0);
        let mut largest = 0.0;
        for vertex in 0..matrix.rows() {
            let mut sums = [0.0; D];
            for (other, block) in matrix.row(vertex) {
                for (sum, row) in sums.iter_mut().zip(block) {
                    *sum += row.iter().zip(&p[other]).map(|(entry, p)| (entry * p).abs()).sum::<f64>();
                }
            }
            largest = sums.iter().fold(largest, |largest: f64, sum| largest.max(*sum));
        }
        largest
    }
}

/// Factors of the matrix last assembled, which is symmetric: its rows are its columns.
fn lu<const D: usize>(assembler: &Assembler<D>) -> Option<Lu> {
    let matrix = assembler.matrix();
    let (mut column_start, mut row, mut entries) = (vec![0], vec![], vec![]);
    for vertex in 0..matrix.rows() {
        for k in 0..D {
            for (other, block) in matrix.row(vertex) {
                row.extend((0..D).map(|l| other * D + l));
                entries.extend_from_slice(&block[k]);
            }
            column_start.push(row.len());
        }
    }
    SymbolicLu::new(column_start, row)?.factorize(&entries)
}

/// Solves `A p = b` at `x` for the free coordinates of a system; held ones of `p` are zero. On the way back
/// `A` is the transpose of the matrix of the way forth.
pub(crate) struct CorrectedSolver {
    factorisation: Box<dyn Factorisation>,
    residual: Vec<f64>,
}

impl CorrectedSolver {
    /// A solver for systems of `dimension` coordinates per vertex.
    pub(crate) fn new(dimension: usize) -> Self {
        CorrectedSolver { factorisation: factorisation(dimension), residual: vec![] }
    }

    /// True if the matrix of the last solve is positive definite, without its part that is not symmetric.
    pub(crate) fn is_definite(&self) -> bool {
        self.factorisation.is_definite()
    }

    /// Writes the solution to `p` and its products to `products`; false where there is none. Held
    /// coordinates of `b` are not looked at.
    ///
    /// Residuals are those of exact products: terms that leave their second derivative out of the matrix,
    /// and the part of the damping that is not symmetric, are part of the solution.
    pub(crate) fn solve(
        &mut self,
        system: &mut System,
        at: (&[f64], &[f64]),
        coefficients: Coefficients,
        b: &[f64],
        p: &mut [f64],
        products: &mut Products,
    ) -> bool {
        p.fill(0.0);
        products.clear();
        if !self.factorisation.factorise(system, at, coefficients) {
            return false;
        }
        let CorrectedSolver { factorisation, residual } = self;
        residual.clear();
        residual.extend_from_slice(b);
        let size = keep_free(system, residual);
        let mut equations =
            CorrectedStage { system, at, coefficients, b, products, factorisation: &mut **factorisation };
        solve(&mut equations, size, residual, p)
    }
}

/// The equations of one stage.
struct CorrectedStage<'a> {
    system: &'a mut System,
    at: (&'a [f64], &'a [f64]),
    coefficients: Coefficients,
    b: &'a [f64],
    products: &'a mut Products,
    factorisation: &'a mut dyn Factorisation,
}

impl CorrectedEquations for CorrectedStage<'_> {
    fn approximate(&mut self, b: &mut [f64]) {
        self.factorisation.solve(b);
    }

    fn product(&mut self, p: &[f64], y: &mut [f64]) {
        self.products.evaluate(self.system, self.at, p);
        self.coefficients.combine(self.system, p, self.products, y);
        free_only(self.system, y);
    }

    fn residual(&mut self, p: &[f64], residual: &mut [f64]) -> f64 {
        self.products.evaluate(self.system, self.at, p);
        let d = self.system.dimension();
        let Coefficients { inertia, damping, stiffness } = self.coefficients;
        let Products { by_positions, by_velocities, .. } = &*self.products;
        for i in 0..p.len() {
            let inertial = inertia * self.system.mass()[i / d] * p[i];
            residual[i] = self.b[i] - inertial - damping * by_velocities[i] - stiffness * by_positions[i];
        }
        keep_free(self.system, residual)
    }

    fn rounding(&self, p: &[f64]) -> f64 {
        let free = self.b.iter().zip(self.system.inverse_mass()).filter(|(_, weight)| **weight > 0.0);
        let largest = free.fold(0.0, |largest: f64, (b, _)| largest.max(b.abs()));
        ROUNDING * (self.factorisation.largest_sum(p) + largest)
    }
}

#[cfg(test)]
mod tests {
    use pliant::dissipation::{DissipationViews, DissipativeTerm, PositionProducts};

    use super::*;

    /// `dR/dv = k (-y, x)` of one vertex in the plane: across its place.
    struct Across(f64);

    impl DissipativeTerm for Across {
        fn name(&self) -> String {
            "across".into()
        }

        fn evaluate(&mut self, _: &[f64], _: &[f64]) -> bool {
            true
        }

        fn add_rows(&self, _: usize, _: &mut [f64]) {}

        fn add_damping_product(&mut self, _: &[f64], _: &[f64], _: &[f64], _: &mut [f64]) {}

        fn power(&mut self, _: &[f64], _: &[f64]) -> f64 {
            0.0
        }

        fn bytes(&self) -> usize {
            0
        }
    }

    impl DissipationViews for Across {}

    impl PositionProducts for Across {
        fn add_position_product(&mut self, _: &[f64], _: &[f64], p: &[f64], y: &mut [f64]) -> bool {
            y[0] += self.0 * p[1];
            y[1] -= self.0 * p[0];
            true
        }
    }

    // Corrections by the masses alone grow tenfold each.
    #[test]
    fn a_large_part_that_is_not_symmetric_is_solved() {
        let mut system = System::new(2, vec![2.0]);
        system.add_dissipation(Box::new(Across(5.0)));
        let coefficients = Coefficients { inertia: 1.0, damping: 1.0, stiffness: 4.0 };
        let (mut p, mut products) = (vec![0.0; 2], Products::back(2));
        let at = (&[1.0, 0.0][..], &[0.0, 0.0][..]);
        let mut solver = CorrectedSolver::new(2);
        assert!(solver.solve(&mut system, at, coefficients, &[22.0, -18.0], &mut p, &mut products));
        // 2 p_x + 20 p_y = 22, 2 p_y - 20 p_x = -18.
        assert!((p[0] - 1.0).abs() < 1e-14 && (p[1] - 1.0).abs() < 1e-14, "{p:?}");
    }
}
