//! A run that was stopped at a checkpoint and resumed has the bits of one that was not.

use std::sync::atomic::{AtomicBool, Ordering};

use pliant::integrator::IntegratorSpec;
use pliant::observer::{Frame, Notes, Observer, ObserverError, Quantities};
use pliant::run::{Checkpoints, Plan, RunCheckpoint, Summary, count_losses_for, run, run_with_checkpoints};
use pliant::simulation::{Checkpoint, Simulation};
use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{Scene, Source};

use crate::support::method;
use crate::support::particles::figure_eight;

/// All that steps may remember: two tied bodies, damped, loaded, between walls, under gravity that changes;
/// pins that stay, that let go after 12 ms, that move, that move and jump.
const BODIES: &str = "dimension = 2
time = { integrator = 'symplectic-euler', step = 1e-3, duration = 0.04 }
world = { gravity = ['0.5*sin(200*t)', '-9.8'], ether_drag = 0.5, walls = [{ normal = [0.0, 1.0], offset = \
-0.001 }] }
[[body]]
name = 'beam'
mesh = { grid = { cells = [3, 1], spacing = 0.1 } }
elastic = { corotated = { young = 1e4, poisson = 0.3 } }
mass = { density = 1000.0 }
damping = { strain_rate = { shear = '5 Pa s' } }
pin = [
    { name = 'moving', vertices = [1], motion = { displacement = ['0.01*(1 - cos(60*t))', '0'] } },
    { name = 'released', vertices = [0], until = 0.012 },
    { name = 'still', vertices = [4], axes = ['x'] },
]
load = [{ vertices = [7], force = ['3*t', '2*sin(50*t)'] }]
muscle = [{ fibre = { direction = [1, 'X'] }, tension = '2e3*sin(40*t)' }]
[[body]]
name = 'strand'
mesh = { strand = { segments = 3, start = [0.3, 0.2], end = [0.3, 0.5] } }
springs = { stiffness = 200.0 }
mass = { per_vertex = 0.2 }
pin = [{ name = 'jumping', vertices = [3], motion = { displacement = ['0', '0.002*step(0.02, t)'] } }]
[[attachment]]
name = 'tie'
body = 'strand'
vertices = [0]
target = { body = 'beam', nearest_vertex = '20 cm' }
stiffness = 300.0
dashpot = 1.0
[[probe]]
name = 'corner'
body = 'beam'
at = [0.29, 0.09]
[output]
rate = 300.0
channels = ['state', 'energy', 'reactions', 'von-mises']
";

/// The scene with other values, by paths as for `--set`.
fn assembly(text: &str, changes: &[(&str, &str)]) -> Assembly {
    let changes: Vec<_> = changes.iter().map(|(path, value)| (path.to_string(), value.to_string())).collect();
    let scene = Source::new("scene", text).with_overrides(&changes).unwrap().scene();
    let scene = scene.unwrap_or_else(|error| panic!("{}", error.render(false)));
    scene.assemble(UnstableStep::Accept).unwrap_or_else(|problems| panic!("{problems:?}"))
}

fn go(simulation: &mut Simulation, steps: usize, what: &str) {
    for step in 0..steps {
        simulation.step().unwrap_or_else(|error| panic!("{what}, {step} steps on: {error}"));
    }
}

/// Takes `steps` steps with a checkpoint after each of `taken`, in one go, and goes on from each of them in
/// a simulation assembled anew.
fn assert_resumed_is_never_stopped(
    what: &str,
    build: impl Fn() -> Simulation,
    taken: &[usize],
    steps: usize,
) {
    let mut simulation = build();
    let mut checkpoints: Vec<Checkpoint> = vec![];
    for step in 0..steps {
        if taken.contains(&step) {
            checkpoints.push(simulation.checkpoint());
        }
        go(&mut simulation, 1, what);
    }
    let (end, measured) = (simulation.checkpoint(), simulation.diagnostics());
    for (i, (checkpoint, at)) in checkpoints.iter().zip(taken).enumerate() {
        let mut resumed = build();
        resumed.resume(checkpoint).unwrap();
        assert_eq!(&resumed.checkpoint(), checkpoint, "{what} at {at}");
        for pair in taken[i..].windows(2) {
            go(&mut resumed, pair[1] - pair[0], what);
            resumed.checkpoint();
        }
        go(&mut resumed, steps - taken[taken.len() - 1], what);
        assert_eq!(resumed.work(), simulation.work(), "{what} from {at}");
        assert_eq!(resumed.motion_jumps(), simulation.motion_jumps(), "{what} from {at}");
        assert!(resumed.checkpoint() == end, "{what} from {at}: another state");
        assert_eq!(resumed.diagnostics(), measured, "{what} from {at}");
    }
}

/// The names of schemes as scenes have them.
fn named(spec: &IntegratorSpec) -> String {
    match spec.method().documentation.name {
        name @ ("newmark" | "generalised-alpha" | "bdf2" | "ias15") => format!("{{ {name} = {{}} }}"),
        name => format!("'{name}'"),
    }
}

// Before the first step, on the way, where a pin lets go, right after a jump.
#[test]
fn every_scheme_resumes_with_the_same_bits() {
    for spec in IntegratorSpec::ALL {
        // In statics nothing else keeps the beam from turning about a point.
        let axes = if spec.method().is_static() { "['x', 'y']" } else { "['x']" };
        let changes = [("time.integrator", &named(spec)[..]), ("body.0.pin.2.axes", axes)];
        let build = || assembly(BODIES, &changes).simulation;
        assert_resumed_is_never_stopped(&named(spec), build, &[0, 5, 12, 13, 21], 26);
    }
}

#[test]
fn steps_that_follow_the_error_resume_with_the_same_bits() {
    let adaptive = IntegratorSpec::ALL.iter().filter(|spec| spec.method().is_adaptive());
    for spec in adaptive {
        let own = spec.method().has_own_criterion();
        let pace = if own { "adaptive = {}" } else { "adaptive = { tolerance = 1e-4 }" };
        let text = BODIES.replace("step = 1e-3", pace);
        // In statics nothing else keeps the beam from turning about a point.
        let axes = if spec.method().is_static() { "['x', 'y']" } else { "['x']" };
        let changes = [("time.integrator", &named(spec)[..]), ("body.0.pin.2.axes", axes)];
        let build = || assembly(&text, &changes).simulation;
        assert_resumed_is_never_stopped(&named(spec), build, &[0, 3, 7, 12], 18);
    }
}

#[test]
fn every_solver_resumes_with_the_same_bits() {
    for solver in ["cholesky", "cg", "multigrid", "matrix-free"] {
        for integrator in ["'implicit-euler'", "'linearised-implicit-euler'", "{ bdf2 = {} }", "'sdirk3'"] {
            let changes = [
                ("time.integrator", integrator),
                ("time.step", "4e-3"),
                ("time.solver", &format!("{{ linear = '{solver}' }}")),
                ("body.0.mesh.grid.cells", "[12, 4]"),
                ("body.0.mesh.grid.spacing", "0.025"),
                ("body.0.pin.2.vertices", "[13]"),
            ];
            let build = || assembly(BODIES, &changes).simulation;
            assert_resumed_is_never_stopped(&format!("{integrator} by {solver}"), build, &[1, 3, 4], 6);
        }
    }
}

/// A step that is taken in parts leaves a memory of the last part, which is shorter.
#[test]
fn steps_in_parts_resume_with_the_same_bits() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/pressed_block_2d.toml");
    let text = std::fs::read_to_string(path).unwrap();
    for integrator in ["'quasi-static'", "{ bdf2 = {} }", "{ generalised-alpha = {} }"] {
        let changes = [
            ("time.integrator", integrator),
            ("time.step", "0.5"),
            ("body.0.mesh.grid.cells", "[4, 10]"),
            ("body.0.pin.1.motion.displacement", "['0', '-0.05 * min(t, 1)']"),
        ];
        let build = || assembly(&text, &changes).simulation;
        let mut once = build();
        go(&mut once, 3, integrator);
        assert!(once.work().retried.unwrap().steps > 0, "{integrator}: {:?}", once.work());
        assert_resumed_is_never_stopped(integrator, build, &[1, 2], 3);
    }
}

/// Bodies that attract each other, directly and by a tree; cloth, membranes, elements without locking.
#[test]
fn every_kind_of_force_resumes_with_the_same_bits() {
    let scenes = [
        ("galaxy", &[("body.0.mesh.disk.count", "600")][..]),
        ("bending_cloth", &[]),
        ("balloon", &[]),
        ("incompressible_block", &[]),
        ("quadratic_beams_2d", &[]),
    ];
    for (name, changes) in scenes {
        let path = format!("{}/../../scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(path).unwrap();
        let build = || assembly(&text, changes).simulation;
        assert_resumed_is_never_stopped(name, build, &[1], 3);
    }
}

#[test]
fn bodies_on_orbits_resume_with_the_same_bits() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/pythagorean.toml");
    let adaptive = || Scene::from_path(path).unwrap().assemble(UnstableStep::Accept).ok().unwrap().simulation;
    assert_resumed_is_never_stopped("adaptive", adaptive, &[0, 1, 9, 20], 30);
    let fixed = || figure_eight(method("ias15"), 0.01);
    assert_resumed_is_never_stopped("fixed", fixed, &[0, 1, 9, 20], 30);
}

#[test]
fn a_checkpoint_with_other_pins_is_refused() {
    let mut simulation = assembly(BODIES, &[]).simulation;
    let checkpoint = simulation.checkpoint();
    let mut other = assembly(BODIES, &[("body.1.pin.0.name", "'other'")]).simulation;
    let before = other.checkpoint();
    assert!(other.resume(&checkpoint).unwrap_err().to_string().contains("other pins"));
    assert!(other.checkpoint() == before);
}

/// Bits of every frame: state, measurements, forces, work.
#[derive(Default)]
struct Witness(Vec<String>);

impl Observer for Witness {
    fn quantities(&self) -> Quantities {
        Quantities::DIAGNOSTICS | Quantities::REACTIONS | Quantities::POINTS
    }

    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        self.0.push(format!("{frame:?}"));
        Ok(())
    }

    fn note(&mut self, notes: &mut Notes) {
        notes.insert("frames".into(), self.0.len().to_string().into_bytes());
    }
}

/// Keeps the last checkpoint after these steps, and interrupts the run after the first if that is asked for.
struct At<'a> {
    steps: Vec<u64>,
    kept: Vec<RunCheckpoint>,
    interrupt: Option<&'a AtomicBool>,
}

impl Checkpoints for At<'_> {
    fn is_due(&mut self, step: u64) -> bool {
        self.steps.contains(&step)
    }

    fn keep(&mut self, checkpoint: &RunCheckpoint) -> Result<(), ObserverError> {
        self.kept.push(checkpoint.clone());
        if let Some(interrupt) = self.interrupt {
            interrupt.store(true, Ordering::Relaxed);
        }
        Ok(())
    }
}

/// A run of the scene that keeps checkpoints after these steps, from a checkpoint where one is given;
/// stopped by the first, where that is asked for.
fn whole_run(
    scene: &Scene,
    steps: &[u64],
    from: Option<&RunCheckpoint>,
    stops: bool,
) -> (Witness, Summary, Vec<RunCheckpoint>) {
    let mut simulation = scene.assemble(UnstableStep::Accept).ok().unwrap().simulation;
    let (mut witness, stop) = (Witness::default(), AtomicBool::new(false));
    let mut at = At { steps: steps.to_vec(), kept: vec![], interrupt: stops.then_some(&stop) };
    let mut observers: Vec<&mut dyn Observer> = vec![&mut witness];
    count_losses_for(&mut simulation, &observers);
    if let Some(from) = from {
        simulation.resume(&from.simulation).unwrap();
    }
    let state = from.map(|from| from.run.clone());
    let summary = run_with_checkpoints(&mut simulation, &scene.plan(), &mut observers, &stop, &mut at, state);
    let kept = at.kept;
    (witness, summary, kept)
}

// Frames are 10/3 steps apart: a checkpoint at one, between two, at the end.
#[test]
fn a_resumed_run_shows_the_frames_and_closing_numbers_of_a_whole_one() {
    for (integrator, pace) in [
        ("'velocity-verlet'", "step = 1e-3"),
        ("{ newmark = {} }", "step = 1e-3"),
        ("'dormand-prince5'", "adaptive = { tolerance = 1e-4 }"),
    ] {
        let text = BODIES.replace("'symplectic-euler'", integrator).replace("step = 1e-3", pace);
        let scene = Scene::from_toml(&text).unwrap();
        let steps = if pace.starts_with("step") { [0, 7, 10, 20] } else { [0, 3, 6, 8] };
        for step in steps {
            let (whole, end, _) = whole_run(&scene, &[step], None, false);
            let (mut first, stopped, kept) = whole_run(&scene, &[step], None, true);
            assert!(stopped.frames < end.frames, "{integrator} at {step}: {}", stopped.frames);
            // The second is that of the interruption, one step on.
            assert_eq!(kept.len(), 2, "{integrator} at {step}");
            let checkpoint = &kept[0];
            assert_eq!(checkpoint.notes["frames"], checkpoint.run.frames().to_string().into_bytes());
            first.0.truncate(checkpoint.run.frames() as usize);
            let (second, resumed, _) = whole_run(&scene, &[], Some(checkpoint), false);
            let frames: Vec<&String> = first.0.iter().chain(&second.0).collect();
            assert_eq!(frames, whole.0.iter().collect::<Vec<_>>(), "{integrator} at {step}");
            assert_eq!(format!("{resumed:?}"), format!("{end:?}"), "{integrator} at {step}");
        }
    }
}

/// The last checkpoint is one to go on from beyond the end: frames are those of the longer run.
#[test]
fn a_run_that_is_done_goes_on() {
    let scene = |duration: &str| {
        Scene::from_toml(&BODIES.replace("duration = 0.04", &format!("duration = {duration}"))).unwrap()
    };
    let (mut first, _, kept) = whole_run(&scene("0.022"), &[], None, false);
    let last = kept.last().unwrap();
    first.0.truncate(last.run.frames() as usize);
    let (second, resumed, _) = whole_run(&scene("0.04"), &[], Some(last), false);
    let (whole, mut end, _) = whole_run(&scene("0.04"), &[22], None, false);
    assert_eq!(first.0.iter().chain(&second.0).collect::<Vec<_>>(), whole.0.iter().collect::<Vec<_>>());
    // What loads may give goes by the duration that the scene had at the start.
    end.energy_scale = resumed.energy_scale;
    assert_eq!(format!("{resumed:?}"), format!("{end:?}"));
}

/// A run of the scene without checkpoints.
fn unchecked_run(scene: &Scene) -> (Witness, Summary) {
    let mut simulation = scene.assemble(UnstableStep::Accept).ok().unwrap().simulation;
    let mut witness = Witness::default();
    let mut observers: Vec<&mut dyn Observer> = vec![&mut witness];
    count_losses_for(&mut simulation, &observers);
    let plan: Plan = scene.plan();
    let summary = run(&mut simulation, &plan, &mut observers, &AtomicBool::new(false));
    (witness, summary)
}

/// A run has the same frames, measurements, work and closing numbers whichever of its checkpoints are kept,
/// if any, and goes on from each of them with the same bits. Returns how many could be kept, but for that
/// of the start.
fn assert_checkpoints_change_nothing(what: &str, scene: &Scene) -> usize {
    let (plain, end) = unchecked_run(scene);
    let end = format!("{end:?}");
    let mut most = vec![];
    for every in [1, 7] {
        let steps: Vec<u64> = (0..100_000).step_by(every).collect();
        let (checked, with, kept) = whole_run(scene, &steps, None, false);
        assert_eq!(checked.0, plain.0, "{what}, every {every} steps");
        assert_eq!(format!("{with:?}"), end, "{what}, every {every} steps");
        if every == 1 {
            most = kept;
        }
    }
    most.dedup_by_key(|kept| kept.simulation.snapshot().step);
    for kept in most.iter().skip(1).step_by(most.len().div_ceil(5)) {
        let (rest, resumed, _) = whole_run(scene, &[], Some(kept), false);
        let step = kept.simulation.snapshot().step;
        let shown = kept.run.frames() as usize;
        assert_eq!(rest.0, plain.0[shown..], "{what} from step {step}");
        assert_eq!(format!("{resumed:?}"), end, "{what} from step {step}");
    }
    most.len() - 1
}

/// README, promises 1 and 7: by every integrator, with steps of one size.
#[test]
fn checkpoints_change_no_bit_of_a_run() {
    for spec in IntegratorSpec::ALL {
        // In statics nothing else keeps the beam from turning about a point.
        let axes = if spec.method().is_static() { "['x', 'y']" } else { "['x']" };
        let text = BODIES
            .replace("'symplectic-euler'", &named(spec))
            .replace("axes = ['x']", &format!("axes = {axes}"));
        let scene = Scene::from_toml(&text.replace("duration = 0.04", "duration = 0.08")).unwrap();
        let kept = assert_checkpoints_change_nothing(&named(spec), &scene);
        assert!(kept > 0, "{}: no checkpoint on the way", named(spec));
    }
}

/// Likewise where steps follow the error.
#[test]
fn checkpoints_change_no_bit_of_a_run_whose_steps_follow_the_error() {
    for name in ["'dormand-prince5'", "'sdirk3'", "'tr-bdf2'", "'sdirk4'", "{ ias15 = {} }"] {
        let pace = if name.contains("ias15") { "adaptive = {}" } else { "adaptive = { tolerance = 1e-4 }" };
        let text = BODIES.replace("'symplectic-euler'", name).replace("step = 1e-3", pace);
        let scene = Scene::from_toml(&text.replace("duration = 0.04", "duration = 0.4")).unwrap();
        let kept = assert_checkpoints_change_nothing(name, &scene);
        assert!(kept > 0, "{name}: no checkpoint on the way");
    }
}

/// And in contact with friction, in explicit steps and in solved ones, by several solvers.
#[test]
fn checkpoints_change_no_bit_of_a_run_in_contact() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/falling_jelly_2d.toml");
    let explicit = std::fs::read_to_string(path).unwrap().replace("duration = \"1.5 s\"", "duration = 0.17");
    let time = "integrator = \"velocity-verlet\"\nstep = \"0.05 ms\"\nduration = 0.17";
    assert!(explicit.contains(time));
    let solved = |solver: &str| {
        let time_solved =
            format!("integrator = 'implicit-euler'\nstep = 4e-3\nduration = 0.3\nsolver = {solver}");
        explicit.replace(time, &time_solved).replace("stiffness = \"0.1 MPa\"", "")
    };
    for (what, text) in [
        ("velocity-verlet", explicit.clone()),
        ("implicit-euler", solved("{}")),
        ("implicit-euler by cg", solved("{ linear = 'cg' }")),
        ("implicit-euler by multigrid", solved("{ linear = 'multigrid' }")),
    ] {
        let scene = Scene::from_toml(&text).unwrap_or_else(|error| panic!("{}", error.render(false)));
        let kept = assert_checkpoints_change_nothing(what, &scene);
        assert!(kept > 0, "{what}: no checkpoint on the way");
    }
}
