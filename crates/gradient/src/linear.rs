//! Linear equations of implicit steps with the exact Hessian: one factorisation for each solve, or
//! conjugate gradients where the run's own steps use them.

use pliant::deadline::Stop;
use pliant::material::Psd;
use pliant::solver::LinearSolver;
use pliant::solver::conjugate_gradients::CgEnd;
use pliant::solver::gauss_seidel::GaussSeidel;
use pliant::solver::hessian::{At, Weights};
use pliant::solver::iterative::{AssembledMatrix, Iterative};
use pliant::solver::linearisation::Linearisation;
use pliant::solver::lu::BlockLu;
use pliant::solver::structure::LentStructure;
use pliant::system::System;

use crate::adjoint::free_only;
use crate::krylov::{CorrectedEquations, keep_free, solve};

/// Coefficients in `A = inertia M + damping d2R/dv2 + stiffness (d2E/dx2 + G)`: `G = (d2R/dx dv)^T` in
/// adjoints, `d2R/dx dv` in tangents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Coefficients {
    pub(crate) inertia: f64,
    pub(crate) damping: f64,
    pub(crate) stiffness: f64,
}

impl Coefficients {
    /// Combines the products with `p` to `A p`, written to `y`.
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
    /// True for products of tangents, `G = d2R/dx dv`; false for those of adjoints, with the transpose.
    is_forth: bool,
    /// `(d2E/dx2 + G) p` [N].
    pub(crate) by_positions: Vec<f64>,
    /// `d2R/dv2 p` [N]; zero without dissipation.
    pub(crate) by_velocities: Vec<f64>,
    /// `p . dE/dx` of each energy term, if computed along with the products.
    pub(crate) works: Vec<Option<f64>>,
    scratch: Vec<f64>,
}

impl Products {
    /// Zero products for adjoints.
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

    /// Zero products for tangents.
    pub(crate) fn forth(unknowns: usize) -> Self {
        Products { is_forth: true, ..Products::back(unknowns) }
    }

    /// Evaluates the products at positions `x` and velocities `v`, flat.
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

/// Factorisation, or iterative solver, of the matrix of one configuration.
pub(crate) trait Factorisation {
    /// Assembles and factorises the symmetric part of the matrix at positions [m] and velocities [m/s],
    /// flat; false if it is singular.
    fn factorise(&mut self, system: &mut System, at: (&[f64], &[f64]), coefficients: Coefficients) -> bool;

    /// Replaces `b` by `A^-1 b`, or by NaN if conjugate gradients do not converge. They may end at a
    /// residual of the fraction `left` of `b`, or at rounding.
    fn solve(&mut self, b: &mut [f64], left: f64);

    /// Hands out the structure of its matrices, and continues with the one `lent` by another solver of
    /// the system.
    fn exchange_structure(&mut self, system: &System, lent: Option<LentStructure>) -> Option<LentStructure>;

    /// True if conjugate gradients are used instead of factors.
    fn is_iterative(&self) -> bool;

    /// Factorises the matrix last assembled, and later ones; false if it is singular.
    fn factorise_instead(&mut self) -> bool;

    /// True if the matrix last assembled is positive definite. Conjugate gradients cannot tell, so
    /// factors replace them.
    fn is_definite(&mut self) -> bool;

    /// `max_i sum_j |A_ij p_j|` of the matrix last factorised.
    fn largest_sum(&self, p: &[f64]) -> f64;
}

/// Residual of a solution exact to its last digits, relative to the sum of magnitudes.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Creates a factorisation for systems of `dimension` coordinates per vertex.
pub(crate) fn factorisation(dimension: usize) -> Box<dyn Factorisation> {
    match dimension {
        2 => Box::new(Sparse::<2>::default()),
        _ => Box::new(Sparse::<3>::default()),
    }
}

/// Cholesky factorisation, its structure kept as long as it fits, or LU if the exact matrix is not
/// positive definite. Systems whose steps use conjugate gradients with multigrid use these instead, as
/// long as they converge.
#[derive(Default)]
struct Sparse<const D: usize> {
    linear: Linearisation<D>,
    iterative: Option<Iterative<D>>,
    /// True once conjugate gradients have failed to converge.
    is_factorised: bool,
    lu: BlockLu,
    /// Coefficients of the matrix last assembled.
    weights: Option<Weights>,
    /// Vertex positions that determine the elimination order, flat [m].
    places: Vec<f64>,
    solution: Vec<f64>,
}

/// Relative residual of conjugate gradients, comparable to that of a factorisation.
const CG_RESIDUAL: f64 = 1e-13;
/// Over-relaxation of symmetric Gauss-Seidel. For beams of 3,675 unknowns, 0.4 m long, steps of 1, 3, 10
/// and 20 ms took 28, 79, 139 and over 150 iterations without it, 24, 65, 117 and 130 with it. More of it
/// increases those of small steps.
const RELAXATION: f64 = 1.25;
/// Iterations with symmetric Gauss-Seidel above which multigrid is cheaper. Multigrid takes about 21
/// iterations; seven of Gauss-Seidel cost as much as one of those, for beams of 3,528 and of 14,520
/// unknowns.
const GAUSS_SEIDEL_ITERATIONS: u64 = 150;
/// Iterations with multigrid above which a factorisation is cheaper.
const MOST_ITERATIONS: u64 = 200;

/// Conjugate gradients with symmetric Gauss-Seidel. `None` if steps of such a system do not use conjugate
/// gradients, if a nonsymmetric part is missing from the matrix, or if its pattern changes.
fn iterative<const D: usize>(system: &System) -> Option<Iterative<D>> {
    let is_wanted = LinearSolver::Auto.choose(system) == LinearSolver::Multigrid
        && !system.is_damped()
        && system.terms().iter().all(|term| term.changing().is_none());
    is_wanted.then(|| Iterative::gauss_seidel(GaussSeidel::relaxed(RELAXATION), None))
}

impl<const D: usize> Sparse<D> {
    /// Replaces `b` by `A^-1 b` to this relative residual; `None` if conjugate gradients do not converge. If
    /// Gauss-Seidel takes too many iterations, multigrid replaces it, now and later.
    fn iterate(&mut self, b: &mut [f64], residual: f64) -> Option<()> {
        self.solution.resize(b.len(), 0.0);
        loop {
            let (iterative, solution) = (self.iterative.as_mut()?, &mut self.solution);
            let matrices = AssembledMatrix::of(self.linear.assembler()?);
            let is_first = matches!(iterative, Iterative::GaussSeidel { .. });
            let most = if is_first { GAUSS_SEIDEL_ITERATIONS } else { MOST_ITERATIONS };
            let made_for = (self.weights?, Psd::Exact, &self.places[..]);
            let end = iterative.solve(matrices, made_for, b, solution, (residual.into(), most)).end;
            if is_first && end == CgEnd::Stalled {
                let levels = self.linear.take_levels(&self.places, &Stop::default())?;
                self.iterative = Some(Iterative::multigrid(levels));
                continue;
            }
            b.copy_from_slice(solution);
            return (end == CgEnd::Converged).then_some(());
        }
    }
}

impl<const D: usize> Factorisation for Sparse<D> {
    fn factorise(&mut self, system: &mut System, at: (&[f64], &[f64]), coefficients: Coefficients) -> bool {
        let ((x, v), Coefficients { inertia, damping, stiffness }) = (at, coefficients);
        if self.linear.fit(system) {
            self.iterative = None;
        }
        let Some(assembler) = self.linear.assembler_mut() else { return false };
        let weights = Weights { inertia, stiffness, damping };
        system.find_stencils(x);
        assembler.assemble(system, At { x, v, psd: Psd::Exact, predicted_from: None }, weights);
        self.weights = Some(weights);
        self.places.clear();
        self.places.extend_from_slice(system.ordering_positions(x));
        if !self.is_factorised {
            self.iterative = self.iterative.take().or_else(|| iterative(system));
            self.is_factorised = self.iterative.is_none();
        }
        self.lu.forget();
        self.iterative.is_some() || self.factorise_instead()
    }

    fn exchange_structure(&mut self, system: &System, lent: Option<LentStructure>) -> Option<LentStructure> {
        let used = self.iterative.take().and_then(Iterative::into_levels);
        self.linear.exchange(system, used, lent)
    }

    fn is_iterative(&self) -> bool {
        self.iterative.is_some()
    }

    fn factorise_instead(&mut self) -> bool {
        (self.iterative, self.is_factorised) = (None, true);
        if self.linear.analyse(&self.places).is_some() && self.linear.factorise().is_ok() {
            return true;
        }
        let Some(assembler) = self.linear.assembler() else { return false };
        self.lu.factorize(assembler.matrix(), assembler.pattern())
    }

    fn solve(&mut self, b: &mut [f64], left: f64) {
        if self.iterative.is_some() {
            if self.iterate(b, left.max(CG_RESIDUAL)).is_none() {
                b.fill(f64::NAN);
            }
        } else if self.lu.is_factorised() {
            self.lu.solve(b);
        } else if let Some(factor) = self.linear.factor() {
            factor.solve(b);
        }
    }

    fn is_definite(&mut self) -> bool {
        (self.iterative.is_none() || self.factorise_instead()) && !self.lu.is_factorised()
    }

    fn largest_sum(&self, p: &[f64]) -> f64 {
        let Some(assembler) = self.linear.assembler() else { return 0.0 };
        let (matrix, p) = (assembler.matrix(), p.as_chunks::<D>().0);
        let mut largest = 0.0;
        for vertex in 0..matrix.rows() {
            // One sum for each block entry, so that additions do not wait for each other.
            let mut sums = [[0.0; D]; D];
            for (other, block) in matrix.row(vertex) {
                let p = &p[other];
                for k in 0..D {
                    for l in 0..D {
                        sums[k][l] += (block[k][l] * p[l]).abs();
                    }
                }
            }
            largest = sums.iter().fold(largest, |largest: f64, sums| largest.max(sums.iter().sum()));
        }
        largest
    }
}

/// Solver of `A p = b` for the free coordinates of a system; `p` is zero where fixed. The matrix of
/// adjoints is the transpose of that of tangents.
pub(crate) struct CorrectedSolver {
    factorisation: Box<dyn Factorisation>,
    residual: Vec<f64>,
}

impl CorrectedSolver {
    /// Creates a solver for systems of `dimension` coordinates per vertex.
    pub(crate) fn new(dimension: usize) -> Self {
        CorrectedSolver { factorisation: factorisation(dimension), residual: vec![] }
    }

    /// Hands out the structure of its matrices, and continues with the one `lent`.
    pub(crate) fn exchange_structure(
        &mut self,
        system: &System,
        lent: Option<LentStructure>,
    ) -> Option<LentStructure> {
        self.factorisation.exchange_structure(system, lent)
    }

    /// True if the symmetric part of the last matrix is positive definite.
    pub(crate) fn is_definite(&mut self) -> bool {
        self.factorisation.is_definite()
    }

    /// Writes the solution to `p` and its products to `products`; false if there is none. Fixed
    /// coordinates of `b` are ignored.
    ///
    /// Residuals use exact products: terms whose second derivative is missing from the matrix, and the
    /// nonsymmetric part of the damping, are included in the solution.
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
        loop {
            residual.clear();
            residual.extend_from_slice(b);
            let size = keep_free(system, residual);
            let factorisation = &mut **factorisation;
            let mut equations = CorrectedStage { system, at, coefficients, b, products, factorisation };
            if solve(&mut equations, size, residual, p) {
                return true;
            }
            if !factorisation.is_iterative() || !factorisation.factorise_instead() {
                return false;
            }
            p.fill(0.0);
        }
    }
}

/// Equations of one stage.
struct CorrectedStage<'a> {
    system: &'a mut System,
    at: (&'a [f64], &'a [f64]),
    coefficients: Coefficients,
    b: &'a [f64],
    products: &'a mut Products,
    factorisation: &'a mut dyn Factorisation,
}

impl CorrectedEquations for CorrectedStage<'_> {
    fn approximate(&mut self, b: &mut [f64], left: f64) {
        self.factorisation.solve(b, left);
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

    fn is_iterative(&self) -> bool {
        self.factorisation.is_iterative()
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
    use pliant::simulation::Simulation;
    use pliant_scene::{Scene, assembly::UnstableStep};

    use super::*;

    /// `dR/dv = k (-y, x)` of one vertex in 2D: perpendicular to its position.
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
    }

    impl DissipationViews for Across {}

    impl PositionProducts for Across {
        fn add_position_product(&mut self, _: &[f64], _: &[f64], p: &[f64], y: &mut [f64]) -> bool {
            y[0] += self.0 * p[1];
            y[1] -= self.0 * p[0];
            true
        }
    }

    /// A block of 3,267 free unknowns.
    fn block() -> Simulation {
        grid([10, 10, 9], "[0, 0, 1]")
    }

    /// Cubes of 0.1 m, fixed at the end given by `held`.
    fn grid(cells: [u32; 3], held: &str) -> Simulation {
        let size = cells.map(|cells| 0.1 * f64::from(cells));
        let text = format!(
            "dimension = 3
            time = {{ integrator = 'implicit-euler', step = 0.01, duration = 1.0 }}
            [[body]]
            mesh = {{ grid = {{ cells = {cells:?}, size = {size:?} }} }}
            elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}
            mass = {{ density = 1000.0 }}
            pin = [{{ half_space = {{ normal = {held}, offset = 0 }} }}]"
        );
        let scene = Scene::from_toml(&text).unwrap();
        scene.assemble(UnstableStep::Accept).unwrap().simulation
    }

    /// Solution for a right-hand side with this factor of the stiffness, and the solver that found it.
    fn solved(
        system: &mut System,
        x: &[f64],
        (is_factorised, stiffness): (bool, f64),
        b: &[f64],
    ) -> (Vec<f64>, &'static str) {
        let mut sparse = Sparse::<3> { is_factorised, ..Sparse::default() };
        let at = (x, &vec![0.0; x.len()][..]);
        let coefficients = Coefficients { inertia: 1.0, damping: 0.01, stiffness };
        assert!(sparse.factorise(system, at, coefficients));
        let mut p = b.to_vec();
        p.iter_mut().zip(system.inverse_mass()).filter(|(_, w)| **w == 0.0).for_each(|(p, _)| *p = 0.0);
        let right = p.clone();
        sparse.solve(&mut p, 0.0);
        if sparse.iterative.is_some() && p.iter().any(|p| p.is_nan()) {
            assert!(sparse.factorise_instead());
            p.copy_from_slice(&right);
            sparse.solve(&mut p, 0.0);
        }
        let how = match sparse.iterative {
            Some(Iterative::GaussSeidel { .. }) => "gauss-seidel",
            Some(Iterative::Multigrid(_)) => "multigrid",
            None => "factors",
        };
        (p, how)
    }

    #[test]
    fn conjugate_gradients_and_factors_have_one_solution() {
        // A block in its reference configuration and compressed to a third, where the exact matrix is
        // indefinite, and a long beam.
        for (mut simulation, press, stiffness, expected_how) in [
            (block(), 1.0, 1e-4, "gauss-seidel"),
            (grid([90, 3, 3], "[1, 0, 0]"), 1.0, 1.0, "multigrid"),
            (block(), 0.3, 1e-4, "factors"),
        ] {
            let rest = simulation.state().x().to_vec();
            let system = simulation.system_mut();
            let b: Vec<f64> = (0..rest.len()).map(|i| (12.9898 * (i as f64 + 1.0)).sin()).collect();
            let x: Vec<f64> =
                rest.iter().enumerate().map(|(i, x)| if i % 3 == 2 { press * x } else { *x }).collect();
            let (found, how) = solved(system, &x, (false, stiffness), &b);
            let (expected, _) = solved(system, &x, (true, stiffness), &b);
            assert_eq!(how, expected_how, "{press}, {stiffness}");
            let largest = expected.iter().fold(0.0, |largest: f64, p| largest.max(p.abs()));
            let off = found.iter().zip(&expected).fold(0.0, |off: f64, (p, q)| off.max((p - q).abs()));
            assert!(off <= 1e-11 * largest, "{how}: {off:e} of {largest:e}");
        }
    }

    /// A solver that continues with a lent structure finds bit-identical results.
    #[test]
    fn lent_structures_leave_the_bits() {
        let (mut lender, mut fresh) = (block(), block());
        lender.step().unwrap();
        let start = fresh.snapshot();
        lender.restore(&start).unwrap();
        for simulation in [&mut lender, &mut fresh] {
            (0..2).for_each(|_| simulation.step().unwrap());
        }
        assert_eq!(lender.state().x(), fresh.state().x());
        let lent = lender.exchange_matrix_structure(None);
        assert!(lent.is_some() && lender.exchange_matrix_structure(None).is_none());
        let x = fresh.state().x().to_vec();
        let b: Vec<f64> = (0..x.len()).map(|i| (12.9898 * (i as f64 + 1.0)).sin()).collect();
        let mut solutions = vec![];
        for (simulation, lent) in [(&mut lender, lent), (&mut fresh, None)] {
            let (system, mut sparse) = (simulation.system_mut(), Sparse::<3>::default());
            assert!(sparse.exchange_structure(system, lent).is_none());
            let coefficients = Coefficients { inertia: 1.0, damping: 0.01, stiffness: 1e2 };
            assert!(sparse.factorise(system, (&x, &vec![0.0; x.len()]), coefficients));
            let mut p = b.clone();
            sparse.solve(&mut p, 0.0);
            solutions.push(p);
            let back = sparse.exchange_structure(system, None);
            assert!(back.is_some());
            simulation.exchange_matrix_structure(back);
            simulation.step().unwrap();
        }
        assert_eq!(solutions[0], solutions[1]);
        fresh.restore(&start).unwrap();
        lender.restore(&start).unwrap();
        for simulation in [&mut lender, &mut fresh] {
            (0..2).for_each(|_| simulation.step().unwrap());
        }
        assert_eq!(lender.state().x(), fresh.state().x());
    }

    // Refinement with the masses alone diverges tenfold each time.
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
