//! Assembly of the matrix of an implicit step.

use std::time::{Duration, Instant};

use super::beam::{SMALL, tets, wavy};
use super::stepping::assemble;
use super::{BenchmarkCase, BenchmarkError, BenchmarkPart, BenchmarkRow, Metric, Workload, goal};
use pliant::material::Psd;
use pliant::simulation::Simulation;
use pliant::solver::hessian::{Assembler, At, Weights};

pub(super) const ROW: BenchmarkRow = BenchmarkRow {
    name: "hessian-stable-neo-hookean",
    summary: "the matrix M + h^2 K of a beam of tetrahedra, element Hessians projected, stable neo-Hookean \
              with its log term",
    cases,
};

struct Assembling {
    simulation: Simulation,
    assembler: Assembler<3>,
}

impl Assembling {
    fn new() -> Result<Assembling, BenchmarkError> {
        let mut simulation = assemble(&wavy(SMALL, "analytic")?)?.simulation;
        let assembler = Assembler::new(simulation.system_mut());
        Ok(Assembling { simulation, assembler })
    }
}

impl Workload for Assembling {
    fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError> {
        let state = self.simulation.state();
        let at = At { x: state.x(), v: state.v(), psd: Psd::Projected, predicted_from: None };
        let weights = Weights { inertia: 1.0, stiffness: 1e-4, damping: 0.0 };
        let start = Instant::now();
        for _ in 0..repetitions {
            self.assembler.assemble(self.simulation.system(), at, weights);
        }
        Ok(start.elapsed())
    }

    fn bytes(&self) -> usize {
        self.assembler.bytes()
    }
}

fn cases(threads: Option<usize>) -> Vec<BenchmarkCase> {
    let counts = threads.map_or_else(|| vec![1, 2], |n| vec![n]);
    let case = |threads| BenchmarkCase {
        size: tets(SMALL),
        items: "tets",
        case: String::new(),
        figure: Metric::Rate { per_repetition: tets(SMALL) as f64, scale: 1e-6, unit: "M tets/s" },
        parts: vec![BenchmarkPart::new("", threads, Assembling::new)],
        reference: if threads == 1 { goal(10.0) } else { None },
    };
    counts.into_iter().map(case).collect()
}
