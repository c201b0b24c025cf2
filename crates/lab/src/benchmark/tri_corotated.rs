//! Explicit steps of corotated triangles: a large mesh, and one so small that the overhead dominates.

use super::scatter::Scatter;
use super::stepping::{Stepping, displaced};
use super::{BenchmarkCase, BenchmarkError, BenchmarkPart, BenchmarkRow, Metric, goal};
use pliant_scene::Scene;

pub(super) const ROW: BenchmarkRow = BenchmarkRow {
    name: "tri-corotated",
    summary: "full steps of corotated triangles: the lecture's cantilever, and a sheet",
    cases,
};

/// Scene of the lecture.
pub(super) const CANTILEVER: &str = include_str!("../../scenes/cantilever_fem_2d.toml");

const SHEET_CELLS: [usize; 2] = [511, 127];

/// Sheet turned by 0.8 rad, with every vertex moved by up to a tenth of a cell along each axis, and fixed
/// at x = 0.
pub(super) fn sheet(cells: [usize; 2]) -> Result<Scene, BenchmarkError> {
    let text = format!(
        "dimension = 2
        time = {{ integrator = 'symplectic-euler', step = 1e-6, duration = 1.0 }}
        world = {{ gravity = [0.0, -9.81] }}
        [[body]]
        mesh = {{ grid = {{ cells = {cells:?}, spacing = 0.002 }} }}
        elastic = {{ corotated = {{ young = 3e6, poisson = 0.3 }} }}
        mass = {{ density = 1000.0 }}
        pin = [{{ half_space = {{ normal = [1.0, 0.0], offset = 0.0 }} }}]"
    );
    let mut random = Scatter::new(4);
    let (sin, cos) = 0.8_f64.sin_cos();
    displaced(&text, |x| {
        (x[0], x[1]) = (cos * x[0] - sin * x[1], sin * x[0] + cos * x[1]);
        for c in 0..2 {
            x[c] += 0.1 * 0.002 * random.symmetric();
        }
    })
}

fn cases(threads: Option<usize>) -> Vec<BenchmarkCase> {
    let (one, threads) = (threads.unwrap_or(1) == 1, threads.unwrap_or(1));
    let triangles = 2 * SHEET_CELLS[0] * SHEET_CELLS[1];
    vec![
        BenchmarkCase {
            size: 2 * 19 * 3,
            items: "triangles",
            case: "the lecture's 20 x 4 vertices".into(),
            figure: Metric::StepTime,
            parts: vec![BenchmarkPart::new("", threads, || Stepping::new(&Scene::from_toml(CANTILEVER)?))],
            reference: goal(0.45).filter(|_| one),
        },
        BenchmarkCase {
            size: triangles as u64,
            items: "triangles",
            case: "512 x 128 vertices".into(),
            figure: Metric::Rate {
                per_repetition: triangles as f64,
                scale: 1e-6,
                unit: "M triangle-steps/s",
            },
            parts: vec![BenchmarkPart::new("", threads, || Stepping::new(&sheet(SHEET_CELLS)?))],
            reference: goal(270.0).filter(|_| one),
        },
    ]
}
