//! Steps of the lecture's implicit cloth.

use super::stepping::Stepping;
use super::{BenchmarkCase, BenchmarkError, BenchmarkPart, BenchmarkRow, Metric, goal};
use pliant_scene::Scene;

pub(super) const ROW: BenchmarkRow = BenchmarkRow {
    name: "cloth-implicit",
    summary: "linearised implicit Euler steps of 0.01 s of the lecture's cloth of (N + 1)^2 masses, one \
              linear solve each",
    cases,
};

/// Square cloth of side 0.5 with masses of 1, structural and diagonal springs of 1000 N/m, and two fixed
/// corners.
fn cloth(n: usize, linear: &str) -> Result<Scene, BenchmarkError> {
    let last = n * (n + 1);
    Ok(Scene::from_toml(&format!(
        "dimension = 3
        time = {{ integrator = 'linearised-implicit-euler', step = 0.01, duration = 1.0, solver = {{ linear \
        = '{linear}' }} }}
        world = {{ gravity = [0.0, 0.0, -2.0] }}
        [[body]]
        mesh = {{ cloth = {{ cells = [{n}, {n}], origin = [0.0, 0.0, 0.0], u = [0.5, 0.0, 0.0], v = [0.0, \
        0.5, 0.0] }} }}
        springs = {{ stiffness = 1000.0 }}
        mass = {{ per_vertex = 1.0 }}
        pin = [{{ vertices = [0, {last}] }}]"
    ))?)
}

fn cases(threads: Option<usize>) -> Vec<BenchmarkCase> {
    let threads = threads.unwrap_or(1);
    let mut cases = vec![];
    for (n, linear, reach) in
        [(5, "cholesky", 60.0), (5, "matrix-free", 60.0), (128, "cholesky", 40e3), (128, "matrix-free", 40e3)]
    {
        cases.push(BenchmarkCase {
            size: (n as u64 + 1).pow(2),
            items: "masses",
            case: linear.to_owned(),
            figure: Metric::StepTime,
            parts: vec![BenchmarkPart::new("", threads, move || Stepping::new(&cloth(n, linear)?))],
            reference: goal(reach),
        });
    }
    cases
}
