//! The linear systems of implicit steps: conjugate gradients with multigrid, and the factorisation they
//! replace.

use std::time::{Duration, Instant};

use super::beam::{falling, tets};
use super::stepping::assemble;
use super::{BenchmarkCase, BenchmarkError, BenchmarkPart, BenchmarkRow, Metric, Workload, goal};
use pliant::material::Psd;
use pliant::solver::block_matrix::BlockMatrix;
use pliant::solver::cholesky::Cholesky;
use pliant::solver::conjugate_gradients::{CgEnd, ConjugateGradients, Preconditioner};
use pliant::solver::hessian::{Assembler, At, Weights};
use pliant::solver::multigrid::Multigrid;

pub(super) const ROW: BenchmarkRow = BenchmarkRow {
    name: "solve",
    summary: "(M + h^2 K) x = M g of a beam of tetrahedra at rest, h = 0.01 s: conjugate gradients to 1e-6, \
              their set-up, Cholesky",
    cases,
};

/// Time step `h` [s].
const TIME_STEP: f64 = 0.01;

/// Linear system of an implicit step, with its solvers.
pub(super) struct LinearSystem {
    matrix: BlockMatrix<3>,
    right: Vec<f64>,
    x: Vec<f64>,
    pub(super) multigrid: Multigrid<3>,
    cg: ConjugateGradients,
}

impl LinearSystem {
    /// System of the beam of `4n x n x n` cells.
    pub(super) fn new(n: usize) -> Result<LinearSystem, BenchmarkError> {
        let mut simulation = assemble(&falling(n)?)?.simulation;
        let x = simulation.state().x().to_vec();
        let system = simulation.system_mut();
        let mut assembler = Assembler::<3>::new(system);
        let weights = Weights { inertia: 1.0, stiffness: TIME_STEP * TIME_STEP, damping: 0.0 };
        assembler.assemble(system, At { x: &x, v: &x, psd: Psd::Projected, predicted_from: None }, weights);
        let matrix = assembler.matrix().clone();
        let held = assembler.held();
        let weight = |i: usize| if held[i] || i % 3 != 2 { 0.0 } else { system.mass()[i / 3] };
        let right = (0..x.len()).map(weight).collect();
        let too_large = || BenchmarkError::Run("the levels do not fit memory".into());
        let mut multigrid = Multigrid::new(&matrix, &x, held).ok_or_else(too_large)?;
        multigrid
            .update(&matrix)
            .map_err(|_| BenchmarkError::Run("the matrix is not positive definite".into()))?;
        Ok(LinearSystem { matrix, right, x, multigrid, cg: ConjugateGradients::default() })
    }

    /// Solves to 1e-6; returns the iterations.
    pub(super) fn solve(&mut self) -> Result<u64, BenchmarkError> {
        let LinearSystem { matrix, right, x, multigrid, cg } = self;
        let product = |p: &[f64], q: &mut [f64]| matrix.multiply(p, q);
        let report = cg.solve(product, multigrid, right, x, 1e-6, 1000);
        match report.end {
            CgEnd::Converged => Ok(report.iterations),
            end => Err(BenchmarkError::Run(format!("conjugate gradients: {end:?}"))),
        }
    }
}

struct Solving(LinearSystem);

impl Workload for Solving {
    fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError> {
        let start = Instant::now();
        for _ in 0..repetitions {
            self.0.solve()?;
        }
        Ok(start.elapsed())
    }

    fn bytes(&self) -> usize {
        self.0.matrix.bytes()
    }
}

struct SettingUp(LinearSystem);

impl Workload for SettingUp {
    fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError> {
        let start = Instant::now();
        for _ in 0..repetitions {
            let done = self.0.multigrid.update(&self.0.matrix);
            done.map_err(|_| BenchmarkError::Run("the matrix is not positive definite".into()))?;
        }
        Ok(start.elapsed())
    }
}

struct Factorising {
    matrix: BlockMatrix<3>,
    cholesky: Cholesky,
}

impl Factorising {
    fn new(n: usize) -> Result<Factorising, BenchmarkError> {
        let LinearSystem { matrix, x, .. } = LinearSystem::new(n)?;
        let cholesky = Cholesky::new(&matrix, &x);
        let cholesky =
            cholesky.ok_or_else(|| BenchmarkError::Run("the factor does not fit memory".into()))?;
        Ok(Factorising { matrix, cholesky })
    }
}

impl Workload for Factorising {
    fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError> {
        let start = Instant::now();
        for _ in 0..repetitions {
            let done = self.cholesky.factorize(&self.matrix);
            done.map_err(|_| BenchmarkError::Run("the matrix is not positive definite".into()))?;
        }
        Ok(start.elapsed())
    }
}

/// Constructor of a part for a beam of `n` cells across.
type MakePart = fn(threads: usize, n: usize) -> BenchmarkPart;

fn cases(threads: Option<usize>) -> Vec<BenchmarkCase> {
    let counts = threads.map_or_else(|| vec![1, 2], |n| vec![n]);
    // Solvers, and their target with 16 cells across on one thread [ms].
    let kinds: [(&str, MakePart, f64); 3] = [
        (
            "multigrid",
            |threads, n| BenchmarkPart::new("", threads, move || Ok(Solving(LinearSystem::new(n)?))),
            32.0,
        ),
        (
            "set-up",
            |threads, n| BenchmarkPart::new("", threads, move || Ok(SettingUp(LinearSystem::new(n)?))),
            15.0,
        ),
        ("Cholesky", |threads, n| BenchmarkPart::new("", threads, move || Factorising::new(n)), 650.0),
    ];
    let mut cases = vec![];
    for n in [6, 11, 16] {
        for (kind, part, reach) in kinds {
            // The factorisation uses one thread.
            for &threads in counts.iter().filter(|count| kind != "Cholesky" || **count == counts[0]) {
                cases.push(BenchmarkCase {
                    size: tets([4 * n, n, n]),
                    items: "tets",
                    case: kind.into(),
                    figure: Metric::Time,
                    parts: vec![part(threads, n)],
                    reference: goal(reach).filter(|_| n == 16 && threads == 1),
                });
            }
        }
    }
    cases
}
