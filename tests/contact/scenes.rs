//! Scenes of the repository in which things touch: nothing passes through anything, and each does what it
//! is for.

use std::collections::BTreeSet;
use std::path::Path;

use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{Scene, Source};

fn opened_scene(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name);
    Scene::from_path(path).unwrap_or_else(|error| panic!("{error}"))
}

pub(crate) fn opened(name: &str) -> Assembly {
    opened_scene(name).assemble(UnstableStep::Refuse).unwrap_or_else(|problems| panic!("{problems:?}"))
}

type Point = [f64; 3];

fn minus(a: Point, b: Point) -> Point {
    [0, 1, 2].map(|k| a[k] - b[k])
}

/// Volume of the tetrahedron, times six, with its sign.
pub(crate) fn volume(a: Point, b: Point, c: Point, d: Point) -> f64 {
    let [u, v, w] = [minus(b, a), minus(c, a), minus(d, a)];
    u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
}

/// Orientation of four points, by exact arithmetic.
fn side(a: Point, b: Point, c: Point, d: Point) -> f64 {
    let coord = |[x, y, z]: Point| robust::Coord3D { x, y, z };
    robust::orient3d(coord(a), coord(b), coord(c), coord(d))
}

/// Whether a segment passes through a triangle.
fn crosses([p, q]: [Point; 2], [a, b, c]: [Point; 3]) -> bool {
    let apart = [side(a, b, c, p), side(a, b, c, q)];
    let around = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    let [above, below] = apart.map(|side| side > 0.0);
    let through = above != below && apart.iter().all(|side| *side != 0.0);
    through && (around.iter().all(|v| *v > 0.0) || around.iter().all(|v| *v < 0.0))
}

/// Orientation of three points in the plane, by exact arithmetic.
fn turn(a: Point, b: Point, c: Point) -> f64 {
    let coord = |[x, y, _]: Point| robust::Coord { x, y };
    robust::orient2d(coord(a), coord(b), coord(c))
}

/// Whether two segments in the plane pass through each other.
fn cut([a, b]: [Point; 2], [c, d]: [Point; 2]) -> bool {
    let opposite = |one: f64, other: f64| one != 0.0 && other != 0.0 && (one > 0.0) != (other > 0.0);
    opposite(turn(a, b, c), turn(a, b, d)) && opposite(turn(c, d, a), turn(c, d, b))
}

/// Indices of primitives of two lists whose boxes overlap, by a sweep along the first axis.
fn meeting<const M: usize, const N: usize>(a: &[[Point; M]], b: &[[Point; N]]) -> Vec<[usize; 2]> {
    let bounds = |points: &[Point]| -> [Point; 2] {
        let of = |f: fn(f64, f64) -> f64, start: f64| {
            [0, 1, 2].map(|k| points.iter().fold(start, |m, p| f(m, p[k])))
        };
        [of(f64::min, f64::INFINITY), of(f64::max, f64::NEG_INFINITY)]
    };
    let mut boxes: Vec<([Point; 2], usize)> = b.iter().enumerate().map(|(i, p)| (bounds(p), i)).collect();
    boxes.sort_by(|(a, _), (b, _)| a[0][0].total_cmp(&b[0][0]));
    let widest = boxes.iter().fold(0.0, |m: f64, ([low, high], _)| m.max(high[0] - low[0]));
    let mut found = vec![];
    for (i, points) in a.iter().enumerate() {
        let [low, high] = bounds(points);
        let first = boxes.partition_point(|([other, _], _)| other[0] < low[0] - widest);
        let near = boxes[first..].iter().take_while(|([other, _], _)| other[0] <= high[0]);
        let meets = near.filter(|([l, h], _)| (0..3).all(|k| l[k] <= high[k] && low[k] <= h[k]));
        found.extend(meets.map(|(_, j)| [i, *j]));
    }
    found
}

/// Primitives that pass through each other: edges through triangles of the surfaces of all bodies, in the
/// plane edges through edges of their outlines.
pub(crate) fn crossings(assembly: &Assembly) -> Vec<(Vec<u32>, Vec<u32>)> {
    let d = assembly.topology.dimension;
    let x = assembly.simulation.positions();
    let point = |v: u32| -> Point { [0, 1, 2].map(|k| if k < d { x[d * v as usize + k] } else { 0.0 }) };
    let bodies = &assembly.topology.bodies;
    // Springs of sheets and solids are no surfaces.
    let thin = bodies.iter().filter(|body| body.triangles.is_empty() && body.surface.is_empty());
    let strands = thin.flat_map(|body| body.edges.iter().copied());
    if d == 2 {
        let edges: Vec<[u32; 2]> =
            bodies.iter().flat_map(|body| outline(&body.triangles)).chain(strands).collect();
        let places: Vec<_> = edges.iter().map(|edge| edge.map(point)).collect();
        let apart = |[i, j]: &[usize; 2]| i < j && !edges[*i].iter().any(|v| edges[*j].contains(v));
        let pairs = meeting(&places, &places).into_iter().filter(apart);
        let crossing = pairs.filter(|[i, j]| cut(places[*i], places[*j]));
        return crossing.map(|[i, j]| (edges[i].to_vec(), edges[j].to_vec())).collect();
    }
    let triangles: Vec<[u32; 3]> = bodies.iter().flat_map(|body| body.surface.iter().copied()).collect();
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let edges: BTreeSet<[u32; 2]> = sides.chain(strands).map(|[a, b]| [a.min(b), a.max(b)]).collect();
    let edges: Vec<[u32; 2]> = edges.into_iter().collect();
    let segments: Vec<_> = edges.iter().map(|edge| edge.map(point)).collect();
    let places: Vec<_> = triangles.iter().map(|triangle| triangle.map(point)).collect();
    let apart = |[i, j]: &[usize; 2]| !edges[*i].iter().any(|v| triangles[*j].contains(v));
    let pairs = meeting(&segments, &places).into_iter().filter(apart);
    let crossing = pairs.filter(|[i, j]| crosses(segments[*i], places[*j]));
    crossing.map(|[i, j]| (edges[i].to_vec(), triangles[j].to_vec())).collect()
}

/// Edges with one triangle beside them.
fn outline(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut sides: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    sides.sort_unstable();
    sides.chunk_by(|a, b| a == b).filter(|same| same.len() == 1).map(|same| same[0]).collect()
}

/// The test sees what crosses: a spike in a sheet, two strokes in the plane.
#[test]
fn crossings_are_seen() {
    let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let spike = |z: f64| [[0.2, 0.2, 1.0], [0.2, 0.2, z]];
    assert!(crosses(spike(-1.0), triangle) && !crosses(spike(0.5), triangle));
    // By less than the volumes and areas of double precision can tell.
    let hair = 1e-200;
    assert!(crosses([[0.2, 0.2, 1.0], [0.2, 0.2, -hair]], triangle) && !crosses(spike(hair), triangle));
    let low = [[0.5, -1.0, 0.0], [0.5, hair, 0.0]];
    assert!(cut(low, [triangle[0], triangle[1]]));
    let stroke = |x: f64| [[x, -1.0, 0.0], [x, 1.0, 0.0]];
    assert!(cut(stroke(0.5), [triangle[0], triangle[1]]) && !cut(stroke(1.5), [triangle[0], triangle[1]]));
    let beside = [[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [5.0, 1.0, 0.0]];
    assert_eq!(meeting(&[spike(-1.0), spike(0.5), stroke(0.5)], &[beside, triangle]), [[0, 1], [2, 1]]);
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

/// Scenes of the repository in which things touch.
const TOUCHING: [&str; 10] = [
    "cloth_on_ball",
    "bunny_drop",
    "soft_stack",
    "chain",
    "twisted_mat",
    "crossed_bars",
    "pressed_jelly_2d",
    "card_house",
    "gripper",
    "hair_on_head",
];

/// Changes to a scene that make it small, and steps by which things have touched.
fn small(name: &str) -> (Vec<(String, &'static str)>, usize) {
    let (key, value, steps) = match name {
        "cloth_on_ball" => ("mesh.cloth.cells", "[12, 12]", 60),
        "soft_stack" => ("mesh.grid.cells", "[2, 2, 2]", 40),
        "chain" => ("mesh.tube.cells", "[1, 12, 1]", 50),
        "twisted_mat" => ("mesh.grid.cells", "[8, 8, 1]", 64),
        "crossed_bars" => ("order", "1", 60),
        "pressed_jelly_2d" => ("mesh.grid.cells", "[8, 8]", 60),
        "card_house" => ("mesh.grid.cells", "[8, 1]", 60),
        "gripper" => ("mesh.ball.cells", "3", 80),
        "hair_on_head" => ("mesh.strand.segments", "10", 60),
        _ => ("name", "bunny", 12),
    };
    let bodies = match name {
        "chain" | "card_house" => 5,
        "soft_stack" => 3,
        "crossed_bars" => 2,
        _ => 1,
    };
    let mut sets: Vec<(String, &str)> = (0..bodies).map(|i| (format!("body.{i}.{key}"), value)).collect();
    match name {
        // It falls at once, and cards fall over.
        "bunny_drop" => sets.push(("obstacle.0.shape.half_space.offset".into(), "-0.01")),
        "card_house" => sets.push(("contact.friction".into(), "0.1")),
        "hair_on_head" => sets.push(("body.0.repeat.count".into(), "[3, 3, 1]")),
        _ => {}
    }
    (sets, steps)
}

/// No primitives cross after any step of small versions of all of them, in which things do touch.
#[test]
fn nothing_crosses_in_any_step_of_small_scenes() {
    for name in TOUCHING {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(format!("{name}.toml"));
        let (sets, steps) = small(name);
        let sets: Vec<(String, String)> =
            sets.into_iter().map(|(key, value)| (key, value.to_owned())).collect();
        let source = Source::from_path(&path).and_then(|source| source.with_overrides(&sets));
        let scene = source.and_then(|source| source.scene()).unwrap_or_else(|error| panic!("{error}"));
        let mut assembly = scene.assemble(UnstableStep::Refuse).unwrap_or_else(|found| panic!("{found:?}"));
        let mut touches = false;
        for step in 1..=steps {
            super::advance(&mut assembly.simulation, 1);
            let found = crossings(&assembly);
            assert!(found.is_empty(), "{name} after step {step}: {found:?}");
            touches |= !assembly.simulation.contacts().is_empty();
        }
        assert!(touches, "{name}: nothing touches in {steps} steps");
    }
}

/// The same of the scenes as they are.
#[test]
#[ignore = "minutes: cargo test --release -p pliant-scene --test contact -- --ignored"]
fn nothing_crosses_in_any_step_of_scenes() {
    for name in TOUCHING {
        let mut assembly = opened(&format!("{name}.toml"));
        let h = assembly.simulation.step_size();
        for step in 1..=opened_scene(&format!("{name}.toml")).plan().steps(h) {
            super::advance(&mut assembly.simulation, 1);
            let found = crossings(&assembly);
            assert!(found.is_empty(), "{name} after step {step}: {found:?}");
        }
    }
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
