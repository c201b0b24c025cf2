//! Scenes of the repository in which things touch: nothing passes through anything, and each does what it
//! is for.

use std::collections::BTreeSet;
use std::path::Path;

use pliant_scene::Scene;
use pliant_scene::assembly::{Assembly, UnstableStep};

pub(crate) fn opened(name: &str) -> Assembly {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name);
    let scene = Scene::from_path(path).unwrap_or_else(|error| panic!("{error}"));
    scene.assemble(UnstableStep::Refuse).unwrap_or_else(|problems| panic!("{problems:?}"))
}

type Point = [f64; 3];

fn minus(a: Point, b: Point) -> Point {
    [0, 1, 2].map(|k| a[k] - b[k])
}

/// Volume of the tetrahedron, times six, with its sign.
fn volume(a: Point, b: Point, c: Point, d: Point) -> f64 {
    let [u, v, w] = [minus(b, a), minus(c, a), minus(d, a)];
    u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
}

/// Whether a segment passes through a triangle.
fn crosses([p, q]: [Point; 2], [a, b, c]: [Point; 3]) -> bool {
    let apart = volume(a, b, c, p) * volume(a, b, c, q) < 0.0;
    let around = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
    apart && (around.iter().all(|v| *v > 0.0) || around.iter().all(|v| *v < 0.0))
}

/// Edges that pass through triangles of the surfaces of all bodies, each with the triangle.
pub(crate) fn crossings(assembly: &Assembly) -> Vec<([u32; 2], [u32; 3])> {
    let x = assembly.simulation.positions();
    let point = |v: u32| -> Point { x[3 * v as usize..][..3].try_into().unwrap() };
    let triangles: Vec<[u32; 3]> =
        assembly.topology.bodies.iter().flat_map(|body| body.surface.iter().copied()).collect();
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let edges: BTreeSet<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    let mut found = vec![];
    for edge in edges {
        for triangle in triangles.iter().filter(|t| !edge.iter().any(|v| t.contains(v))) {
            if crosses(edge.map(point), triangle.map(point)) {
                found.push((edge, *triangle));
            }
        }
    }
    found
}

/// Takes `steps` steps and looks for crossings `looks` times on the way.
pub(crate) fn watched(name: &str, steps: usize, looks: usize) -> Assembly {
    let mut assembly = opened(name);
    for _ in 0..looks {
        super::advance(&mut assembly.simulation, steps / looks);
        let found = crossings(&assembly);
        assert!(found.is_empty(), "{name} at {} s: {found:?}", assembly.simulation.state().time);
    }
    assembly
}

/// Mean position of a body.
fn middle(assembly: &Assembly, name: &str) -> Point {
    let x = assembly.simulation.positions();
    let body = assembly.topology.bodies.iter().find(|body| body.name == name).unwrap();
    let count = f64::from(body.vertices.end - body.vertices.start);
    let mut sum = [0.0; 3];
    for v in body.vertices.clone() {
        (0..3).for_each(|k| sum[k] += x[3 * v as usize + k] / count);
    }
    sum
}

#[test]
fn two_bars_collide_and_part() {
    let assembly = watched("crossed_bars.toml", 60, 6);
    let apart = middle(&assembly, "along")[2] - middle(&assembly, "across")[2];
    // They never are nearer than half of both thicknesses, less what they are compressed by.
    assert!(apart > 0.08, "{apart}");
}

#[test]
fn a_gripper_lifts_a_ball_by_friction() {
    let mut assembly = opened("gripper.toml");
    let before = middle(&assembly, "ball")[2];
    super::advance(&mut assembly.simulation, 180);
    assert!(crossings(&assembly).is_empty());
    let lifted = middle(&assembly, "ball")[2] - before;
    // The jaws rise by 0.1 m; the ball sinks in its grip and creeps.
    assert!((0.095..0.103).contains(&lifted), "{lifted}");
    // What the jaws carry is its weight.
    let weight = 9.81 * assembly.report.mass;
    let reactions = assembly.simulation.reactions();
    let carried: f64 = reactions.iter().filter(|r| r.name != "table/motion").map(|r| r.force[2]).sum();
    assert!((carried - weight).abs() < 0.02 * weight, "{carried} N of {weight} N");
}

#[test]
fn a_stack_of_cubes_stands() {
    let assembly = watched("soft_stack.toml", 100, 4);
    let [first, second, third] = ["first", "second", "third"].map(|name| middle(&assembly, name));
    assert!(first[2] < second[2] && second[2] < third[2]);
    assert!((third[2] - second[2] - 0.2).abs() < 0.02, "{third:?} above {second:?}");
}

#[test]
fn bits_do_not_depend_on_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut assembly = opened("gripper.toml");
            super::advance(&mut assembly.simulation, 40);
            let state = assembly.simulation.state();
            let bits: Vec<u64> = state.x().iter().chain(state.v()).map(|x| x.to_bits()).collect();
            (bits, assembly.simulation.work())
        })
    };
    let (one, work) = run(1);
    for threads in [2, 3] {
        let (bits, other) = run(threads);
        assert!(bits == one, "{threads} threads");
        assert_eq!(format!("{other:?}"), format!("{work:?}"));
    }
}
