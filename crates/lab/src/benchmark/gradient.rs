//! Runs with the gradient of a loss at their end, compared with the same runs without.

use std::time::{Duration, Instant};

use pliant::numbering::Numbering;
use pliant::simulation::Simulation;
use pliant_gradient::{LossFrame, ParameterSelection, UNLIMITED};
use pliant_scene::Scene;

use super::beam::{falling, tets, wavy};
use super::stepping::{SavedState, assemble};
use super::{BenchmarkCase, BenchmarkError, BenchmarkPart, BenchmarkRow, Metric, Workload};
use super::{PublishedValue, goal};

pub(super) const EXPLICIT: BenchmarkRow = BenchmarkRow {
    name: "gradient-explicit",
    summary: "100 explicit steps of a wavy beam of tetrahedra and the gradient of the height of a vertex by \
              Young's modulus, the start and gravity, beside the steps alone: 4 times, of which 3 for the \
              way back",
    cases: |threads| cases(threads, tets(CELLS), 100, goal(4.0), || wavy(CELLS, "analytic")),
};

pub(super) const IMPLICIT: BenchmarkRow = BenchmarkRow {
    name: "gradient-implicit",
    summary: "10 steps of implicit Euler of a beam of tetrahedra that falls and the same gradient, beside \
              the steps alone: twice, of which once for the way back",
    cases: |threads| cases(threads, 24 * ACROSS.pow(3) as u64, 10, goal(2.0), || falling(ACROSS)),
};

/// Number of cells of the explicit beam.
const CELLS: [usize; 3] = [32, 8, 8];
/// Number of cells across the implicit beam.
const ACROSS: usize = 6;

fn cases(
    threads: Option<usize>,
    size: u64,
    steps: u64,
    reference: Option<PublishedValue>,
    scene: fn() -> Result<Scene, BenchmarkError>,
) -> Vec<BenchmarkCase> {
    let threads = threads.unwrap_or(1);
    let part = |name, with_gradient| {
        BenchmarkPart::new(name, threads, move || DifferentiatedRun::new(scene()?, steps, with_gradient))
    };
    vec![BenchmarkCase {
        size,
        items: "tets",
        case: format!("{steps} steps"),
        figure: Metric::Slowdown,
        parts: vec![part("with gradient", true), part("steps alone", false)],
        reference,
    }]
}

/// A run, restarted from the same state for each repetition.
struct DifferentiatedRun {
    simulation: Simulation,
    start: SavedState,
    steps: u64,
    /// Parameters of the gradient; `None` for the steps alone.
    parameters: Option<ParameterSelection>,
}

impl DifferentiatedRun {
    fn new(scene: Scene, steps: u64, with_gradient: bool) -> Result<Self, BenchmarkError> {
        let assembly = assemble(&scene)?;
        let mut simulation = assembly.simulation;
        simulation.count_losses(false);
        let numbering: &Numbering = simulation.numbering();
        let names = ["position", "velocity", "world.gravity", "body.0.elastic.young"];
        let selection = ParameterSelection::new(&scene, &assembly.topology, numbering, &names)?;
        let start = SavedState::of(&simulation);
        Ok(DifferentiatedRun { simulation, start, steps, parameters: with_gradient.then_some(selection) })
    }
}

impl Workload for DifferentiatedRun {
    fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError> {
        let (mut elapsed, last) = (Duration::ZERO, self.steps);
        let mut height = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
            if frame.step < last {
                return 0.0;
            }
            let i = x_bar.len() - 1;
            x_bar[i] = 1.0;
            frame.x[i]
        };
        for _ in 0..repetitions {
            self.start.restore(&mut self.simulation);
            let start = Instant::now();
            match &mut self.parameters {
                Some(selection) => {
                    let parameters = selection.parameters();
                    pliant_gradient::gradient(
                        &mut self.simulation,
                        last,
                        &mut height,
                        parameters,
                        UNLIMITED,
                    )?;
                }
                None => {
                    for _ in 0..last {
                        self.simulation.step()?;
                    }
                }
            }
            elapsed += start.elapsed();
        }
        Ok(elapsed)
    }
}
