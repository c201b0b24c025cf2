//! Explicit steps of a cloth of springs, numbered as a grid and at random.

use super::scatter::Scatter;
use super::stepping::{Stepping, displaced, mesh_of};
use super::{BenchmarkCase, BenchmarkError, BenchmarkPart, BenchmarkRow, Metric, goal};
use pliant_scene::{InlineSpec, MeshSpec, PositionSpec, Scene, Selection};

pub(super) const ROW: BenchmarkRow = BenchmarkRow {
    name: "springs",
    summary: "full steps of a cloth of springs, each spring counted once",
    cases,
};

/// Number of vertices along each side.
const SIDE: usize = 256;

/// Cloth with springs along sides and both diagonals of every cell; every vertex is moved by up to a
/// tenth of a cell along each axis.
pub(super) fn cloth(side: usize) -> Result<Scene, BenchmarkError> {
    let cells = side - 1;
    let text = format!(
        "dimension = 3
        time = {{ integrator = 'symplectic-euler', step = 1e-5, duration = 1.0 }}
        world = {{ gravity = [0.0, 0.0, -9.81] }}
        [[body]]
        mesh = {{ cloth = {{ cells = [{cells}, {cells}], origin = [0.0, 0.0, 0.0], u = [1.0, 0.0, 0.0], v = \
        [0.0, 1.0, 0.0] }} }}
        springs = {{ stiffness = 500.0 }}
        mass = {{ total = 0.3 }}
        pin = [{{ vertices = [0, {cells}] }}]"
    );
    let mut random = Scatter::new(5);
    displaced(&text, |x| {
        for c in 0..3 {
            x[c] += 0.1 / cells as f64 * random.symmetric();
        }
    })
}

/// Cloth with randomly numbered vertices; the springs keep their order.
pub(super) fn renumbered(side: usize) -> Result<Scene, BenchmarkError> {
    let mut scene = cloth(side)?;
    let mesh = mesh_of(&scene)?;
    let number = Scatter::new(6).permutation(mesh.vertex_count());
    let rows = |from: &mut dyn Iterator<Item = Vec<f64>>| {
        let mut rows = vec![vec![]; number.len()];
        for (&number, row) in number.iter().zip(from) {
            rows[number as usize] = row;
        }
        rows
    };
    let body = &mut scene.body[0];
    body.mesh = MeshSpec::Inline(InlineSpec {
        points: rows(&mut mesh.points.chunks_exact(mesh.dimension).map(<[f64]>::to_vec)),
        edges: mesh.edges.iter().map(|edge| edge.map(|vertex| number[vertex as usize])).collect(),
        ..InlineSpec::default()
    });
    if let Some(PositionSpec::PerVertex(position)) = &mut body.position {
        *position = rows(&mut std::mem::take(position).into_iter());
    }
    body.pin = vec![Selection::Vertices(vec![number[0], number[side - 1]]).into()];
    Ok(scene)
}

/// Number of springs: along both directions and both diagonals.
pub(super) fn count(side: usize) -> u64 {
    (4 * (side - 1) * (side - 1) + 2 * (side - 1)) as u64
}

fn cases(threads: Option<usize>) -> Vec<BenchmarkCase> {
    let springs = count(SIDE);
    type Build = fn(usize) -> Result<Scene, BenchmarkError>;
    let case = |(name, scene, reference): (&str, Build, f64)| BenchmarkCase {
        size: springs,
        items: "springs",
        case: name.into(),
        figure: Metric::Rate { per_repetition: springs as f64, scale: 1e-6, unit: "M spring-steps/s" },
        parts: vec![BenchmarkPart::new("", threads.unwrap_or(1), move || Stepping::new(&scene(SIDE)?))],
        reference: goal(reference).filter(|_| threads.unwrap_or(1) == 1),
    };
    [("numbered as a grid", cloth as Build, 1000.0), ("renumbered at random", renumbered, 420.0)]
        .map(case)
        .into()
}
