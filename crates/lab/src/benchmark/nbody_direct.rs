//! Explicit steps of N-body gravity by direct summation over pairs.

use super::stepping::Stepping;
use super::{BenchmarkCase, BenchmarkError, BenchmarkPart, BenchmarkRow, Metric, goal};
use pliant_scene::Scene;

pub(super) const ROW: BenchmarkRow = BenchmarkRow {
    name: "nbody-direct",
    summary: "full steps of N bodies by the direct sum, counted as N (N - 1) interactions",
    cases,
};

/// Galaxy of the lecture with `count` stars.
pub(super) fn galaxy(count: usize) -> Result<Scene, BenchmarkError> {
    Ok(Scene::from_toml(&format!(
        "dimension = 3
        time = {{ integrator = 'symplectic-euler', step = 1e-5, duration = 1.0 }}
        world = {{ nbody = {{ constant = 1.0, softening = 0.02 }} }}
        [[body]]
        mesh = {{ disk = {{ count = {count}, radius = 1.0, inner_radius = 0.1, thickness = 0.02, seed = 1 \
        }} }}
        mass = {{ total = 1.0 }}
        velocity = {{ tangential = {{ speed = 0.9 }} }}"
    ))?)
}

fn cases(threads: Option<usize>) -> Vec<BenchmarkCase> {
    let case = |count: usize| BenchmarkCase {
        size: count as u64,
        items: "bodies",
        case: String::new(),
        figure: Metric::Rate {
            per_repetition: (count * (count - 1)) as f64,
            scale: 1e-9,
            unit: "G interactions/s",
        },
        parts: vec![BenchmarkPart::new("", threads.unwrap_or(1), move || Stepping::new(&galaxy(count)?))],
        reference: goal(4.2).filter(|_| threads.unwrap_or(1) == 1),
    };
    [2_000, 20_000].map(case).into()
}
