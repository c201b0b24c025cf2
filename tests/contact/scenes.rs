//! Scenes of the repository in which things touch: nothing passes through anything, and each does what it
//! is for.

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

/// Primitives that pass through each other.
pub(crate) fn crossings(assembly: &Assembly) -> Vec<(Vec<u32>, Vec<u32>)> {
    pliant_mesh::crossings(&assembly.topology, &assembly.simulation.positions())
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
