//! Paths of equilibria by arc length, against closed forms and published curves.

use std::sync::atomic::AtomicBool;

use pliant::observer::{Frame, Observer, ObserverError};
use pliant::run::{Outcome, Summary, run};
use pliant::simulation::{Checkpoint, PathState, Simulation, StepError};
use pliant::solver::SolveFailure;
use pliant_scene::assembly::UnstableStep;
use pliant_scene::{Scene, Source};

fn scene(text: &str) -> Scene {
    Scene::from_toml(text).unwrap_or_else(|error| panic!("{error}"))
}

fn simulation(text: &str) -> Simulation {
    let assembly = scene(text).assemble(UnstableStep::Refuse);
    assembly.unwrap_or_else(|problems| panic!("{problems:?}")).simulation
}

/// The load factor and the positions of every frame.
struct Curve(Vec<(f64, Vec<f64>)>);

impl Observer for Curve {
    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        self.0.push((frame.load_factor.unwrap(), frame.x.to_vec()));
        Ok(())
    }
}

fn follow(text: &str) -> (Vec<(f64, Vec<f64>)>, PathState, Summary) {
    let scene = scene(text);
    let mut simulation = simulation(text);
    let mut curve = Curve(vec![]);
    let summary = run(&mut simulation, &scene.plan(), &mut [&mut curve], &AtomicBool::new(false));
    assert!(matches!(summary.outcome, Outcome::Done), "{:?}", summary.outcome);
    (curve.0, summary.path.clone().unwrap(), summary)
}

/// Half the width and the height of a truss of two springs of `STIFFNESS` [N/m].
const WIDTH: f64 = 1.0;
const HEIGHT: f64 = 0.3;
const STIFFNESS: f64 = 1000.0;

/// Von Mises' truss: two springs meet at an apex that is pressed down.
const TRUSS: &str = "dimension = 2
[time]
integrator = 'quasi-static'
arc_length = { first = 0.05, until = [2.0], largest = 0.02 }
duration = 400
[[body]]
name = 'truss'
mesh = { inline = { points = [[-1, 0], [0, 0.3], [1, 0]], edges = [[0, 1], [1, 2]] } }
springs = { stiffness = 1000.0 }
mass = { per_vertex = 1.0 }
pin = [{ vertices = [0, 2] }]
load = [{ vertices = [1], force = ['0', '-10*t'] }]
[output]
channels = ['state', 'energy']
";

/// The force that presses the apex to the height `y` [N]: `2 k (l_0 - l) y / l`.
fn force(y: f64) -> f64 {
    let (at_rest, length) = (WIDTH.hypot(HEIGHT), WIDTH.hypot(y));
    2.0 * STIFFNESS * (at_rest - length) * y / length
}

// Limit points of the truss: dF/dy = 0 at l^3 = l_0 b^2.
#[test]
fn a_truss_snaps_through_along_its_closed_form() {
    let (curve, path, summary) = follow(TRUSS);
    let most = {
        let at_rest = WIDTH.hypot(HEIGHT);
        force(((at_rest * WIDTH * WIDTH).powf(2.0 / 3.0) - WIDTH * WIDTH).sqrt()) / 10.0
    };
    for (load_factor, x) in &curve {
        let error = (load_factor - force(x[3]) / 10.0).abs();
        assert!(error < 1e-8 * most, "off by {error:e} at y = {}", x[3]);
        assert!(x[2].abs() < 1e-12, "no sway: {}", x[2]);
    }
    assert!(curve.windows(2).all(|pair| pair[1].1[3] < pair[0].1[3]), "the apex only goes down");
    // Steps of 2 cm at most across two thirds of a metre; exactly to the load factor that ends it.
    assert_eq!(curve.last().unwrap().0, 2.0);
    assert!(path.has_ended && summary.work.steps > 32 && summary.work.steps < 400, "{:?}", summary.work);
    let [top, bottom] = &path.limit_points[..] else { panic!("{path:?}") };
    assert!(top.is_maximum && !bottom.is_maximum, "{path:?}");
    // A parabola over two steps of 0.02 m of a curve whose scale is the height: off by less than (0.02 /
    // 0.3)^2.
    assert!((top.load_factor / most - 1.0).abs() < 4e-3, "{top:?} {most}");
    assert!((bottom.load_factor / -most - 1.0).abs() < 4e-3, "{bottom:?} {most}");
    assert!(curve.iter().any(|(load_factor, _)| *load_factor < -0.99 * most), "less load than none");
    assert!((path.arc_length - (HEIGHT - curve.last().unwrap().1[3])).abs() < 1e-9, "{path:?}");
}

/// The same, pressed by the end of a soft spring that is moved down: it snaps back.
fn pressed_by_a_spring() -> String {
    TRUSS
        .replace("[1, 0]], edges = [[0, 1], [1, 2]]", "[1, 0], [0, 1.3]], edges = [[0, 1], [1, 2], [1, 3]]")
        .replace("stiffness = 1000.0", "stiffness = [1000.0, 1000.0, 40.0]")
        .replace("pin = [", "pin = [{ vertices = [3], motion = { displacement = ['0', '-t'] } }, ")
        .replace("load = [{ vertices = [1], force = ['0', '-10*t'] }]", "")
        .replace("first = 0.05, until = [2.0]", "first = 0.02, until = [1.0, -1.0]")
}

// The spring is stretched by h - u - y, and u is the load factor: u = h - y + F(y) / 40 N/m.
#[test]
fn prescribed_motion_goes_back_where_the_truss_snaps_back() {
    let (curve, path, _) = follow(&pressed_by_a_spring());
    for (moved, x) in &curve {
        let closed = HEIGHT - x[3] + force(x[3]) / 40.0;
        assert!((moved - closed).abs() < 1e-8, "{moved} instead of {closed} at y = {}", x[3]);
        assert_eq!(x[7], 1.3 - moved, "the end of the spring is where the load factor has it");
    }
    assert_eq!(curve.last().unwrap().0, 1.0);
    let [there, back] = &path.limit_points[..] else { panic!("{path:?}") };
    assert!(there.is_maximum && !back.is_maximum && there.load_factor > back.load_factor + 0.1, "{path:?}");
}

/// Lee's frame: two legs of 1.2 m, hinged at both ends, of EA = 43.2 MN and EI = 1440 N m^2, loaded 24 cm
/// from the corner, as a chain of springs that resist bending, `edges` to a leg.
fn lee(edges: usize) -> String {
    let length = 1.2 / edges as f64;
    let up = (0..edges).map(|i| format!("[0, {}]", length * i as f64));
    let along = (0..=edges).map(|i| format!("[{}, 1.2]", length * i as f64));
    let points: Vec<String> = up.chain(along).collect();
    let links: Vec<String> = (0..2 * edges).map(|i| format!("[{i}, {}]", i + 1)).collect();
    format!(
        "dimension = 2
        [time]
        integrator = 'quasi-static'
        arc_length = {{ first = 0.1, largest = 0.015 }}
        duration = 85
        [[body]]
        mesh = {{ inline = {{ points = [{}], edges = [{}] }} }}
        springs = {{ stiffness = {} }}
        bending = {{ stiffness = 1440.0 }}
        mass = {{ per_vertex = 1.0 }}
        pin = [{{ vertices = [0, {}] }}]
        load = [{{ vertices = [{}], force = ['0', '-10e3*t'] }}]
        ",
        points.join(", "),
        links.join(", "),
        4.32e7 / length,
        2 * edges,
        edges + edges / 5,
    )
}

/// Limit loads of Lee's frame as an elastica [10 kN], by `tests/tools/elastica.py frame`.
const ELASTICA: [f64; 2] = [1.855688, -0.941448];
/// The first as published by Lee, Manuel and Rossow (1968) and by many after them [10 kN].
const PUBLISHED: f64 = 1.8485;

// The joint at the corner, 2 tan(45 degrees), is four times as stiff as one in a straight leg: of 2.4 m of
// beam the bending of 3/4 of an edge is missing. A chain that is shorter by the part e = 0.75 h / 2.4 m
// bears 1 / (1 - e)^2 as much: 1 + 2 e at most, 0.7 % with h = 1 cm.
#[test]
fn lees_frame_has_the_limit_loads_of_the_elastica_and_those_published() {
    let (curve, path, _) = follow(&lee(120));
    let [first, second] = &path.limit_points[..] else { panic!("{path:?}") };
    assert!(first.is_maximum && !second.is_maximum, "{path:?}");
    for (found, expected) in [(first, ELASTICA[0]), (second, ELASTICA[1])] {
        let error = found.load_factor / expected - 1.0;
        assert!(error.abs() < 0.007, "off by {error:e}: {found:?}");
    }
    let error = first.load_factor / PUBLISHED - 1.0;
    assert!(error.abs() < 0.01, "off by {error:e} from what is published: {first:?}");
    // Between the limits the place of the load comes up again on its way down: it snaps back.
    let height = |at: &(f64, Vec<f64>)| at.1[2 * (120 + 24) + 1];
    let between = &curve[first.step as usize..second.step as usize];
    assert!(between.windows(2).any(|pair| height(&pair[1]) > height(&pair[0])), "no snap-back");
    assert!(height(&between[0]) > height(&between[between.len() - 1]), "down in all");
}

/// Half of a shallow clamped arch of solid elements: of radius 1 m, half angle 0.3, 11 mm thick, E = 1 MPa,
/// cut at its crown, which half of the load presses down.
fn arch(cells: usize) -> String {
    let (angle, thickness) = (0.3_f64, 0.011);
    let (mut points, mut triangles) = (vec![], vec![]);
    for i in 0..=cells {
        let phi = angle * (i as f64 / cells as f64 - 1.0);
        for radius in [1.0 - 0.5 * thickness, 1.0 + 0.5 * thickness] {
            points.push(format!("[{:?}, {:?}]", radius * phi.sin(), radius * phi.cos()));
        }
        if i < cells {
            let [a, b, c, d] = [2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1];
            triangles.push(format!("[{a}, {b}, {c}], [{a}, {c}, {d}]"));
        }
    }
    format!(
        "dimension = 2
        [time]
        integrator = 'quasi-static'
        arc_length = {{ first = 0.25, until = [3.0], largest = '2 mm' }}
        duration = 300
        [[body]]
        mesh = {{ inline = {{ points = [{}], triangles = [{}] }} }}
        order = 2
        elastic = {{ stvk = {{ young = 1e6, poisson = 0.0 }} }}
        mass = {{ density = 1000.0 }}
        pin = [
            {{ half_space = {{ normal = [{:?}, {:?}], offset = 0 }} }},
            {{ half_space = {{ normal = [-1, 0], offset = 0 }}, axes = ['x'] }},
        ]
        load = [{{ half_space = {{ normal = [-1, 0], offset = 0 }}, force = ['0', '-t'] }}]
        ",
        points.join(", "),
        triangles.join(", "),
        angle.cos(),
        angle.sin(),
    )
}

// Numbers of `tests/tools/elastica.py arch`, a beam with shear. An arch of straight pieces is lower by
// their height over the chord, (0.3/40)^2 / 8 m, a thousandth of its thickness; half of the load on three
// nodes through the thickness and curvature times thickness, a hundredth, squared, are no more. Together
// they change the load by some thousandths.
#[test]
fn a_shallow_arch_of_solid_elements_has_the_limit_loads_of_the_elastica() {
    let (_, path, _) = follow(&arch(40));
    let [top, bottom] = &path.limit_points[..] else { panic!("{path:?}") };
    for (found, expected) in [(top, 2.465866), (bottom, 1.228858)] {
        let error = found.load_factor / expected - 1.0;
        assert!(error.abs() < 0.01, "off by {error:e}: {found:?}");
    }
    assert!(top.is_maximum && !bottom.is_maximum && path.load_factor == 3.0, "{path:?}");
}

fn refused(text: &str) -> String {
    match Source::new("scene", text).scene() {
        Err(error) => error.render(false),
        Ok(_) => panic!("accepted: {text}"),
    }
}

#[test]
fn a_path_is_refused_where_there_is_none() {
    let with = |from: &str, to: &str| {
        assert!(TRUSS.contains(from), "{from}");
        refused(&TRUSS.replacen(from, to, 1))
    };
    let body = "pin = [{ vertices = [0, 2] }]";
    let load = "force = ['0', '-10*t']";
    let cases = [
        (with("'quasi-static'", "'implicit-euler'"), "implicit-euler integrates motion in time"),
        (with("'quasi-static'", "'velocity-verlet'"), "velocity-verlet integrates motion in time"),
        (with(load, "force = ['0', '-10']"), "nothing in the scene grows with the load factor"),
        (with(load, "force = ['0', '-10*step(0.5, t)']"), "this jumps with `t`"),
        (with("duration = 400", "duration = 400\nstep = 1.0"), "`step` and `arc_length` are both given"),
        (
            with("duration = 400", "duration = 400\nadaptive = {}"),
            "`adaptive` and `arc_length` are both given",
        ),
        (
            with("duration = 400", "duration = 400\nsolver = { retries = 2 }"),
            "`retries` is not for steps along a path",
        ),
        (
            with("duration = 400", "duration = 400\nsolver = { linear = 'cg' }"),
            "`linear` is not for steps along a path",
        ),
        (with("[output]", "[contact]\n[output]"), "arc length does not support contact"),
        (with(body, "pin = [{ vertices = [0, 2], until = 3 }]"), "a pin is released at a time"),
        (with(body, &format!("{body}\ndamping = {{ mass_proportional = 1.0 }}")), "no rates to damp"),
        (with("[output]", "[world]\nether_drag = 1.0\n[output]"), "no velocity to drag"),
        (with("first = 0.05", "first = 0.0"), "`first` must be positive and finite"),
        (with("until = [2.0]", "until = [1.0, 2.0, 3.0]"), "one load factor or two"),
    ];
    for (message, part) in cases {
        assert!(message.contains(part), "{part}: {message}");
    }
}

#[test]
fn a_load_that_nothing_free_feels_ends_the_run_with_the_reason() {
    let mut simulation = simulation(&TRUSS.replace("vertices = [1], force", "vertices = [0], force"));
    let before = simulation.state().x().to_vec();
    let error = simulation.step().unwrap_err();
    assert!(matches!(error, StepError::Unsolved { verdict: SolveFailure::Unloaded, .. }), "{error}");
    let message = error.to_string();
    assert!(message.contains("step 1 (load factor 0.000000)") && message.contains("by `t`"), "{message}");
    assert_eq!(simulation.state().x(), before);
}

// What a path remembers is part of the checkpoint: direction, radius, limit points.
#[test]
fn a_path_resumes_with_the_same_bits() {
    for text in [TRUSS.to_owned(), pressed_by_a_spring()] {
        let mut whole = simulation(&text);
        let mut taken: Vec<Checkpoint> = vec![];
        for step in 0..40 {
            if [0, 3, 20].contains(&step) {
                taken.push(whole.checkpoint());
            }
            whole.step().unwrap();
        }
        for (checkpoint, from) in taken.iter().zip([0, 3, 20]) {
            let mut resumed = simulation(&text);
            let text = serde_json::to_string(checkpoint).unwrap();
            resumed.resume(&serde_json::from_str(&text).unwrap()).unwrap();
            (from..40).for_each(|_| resumed.step().unwrap());
            assert_eq!(resumed.path(), whole.path());
            let bits = |simulation: &Simulation| -> Vec<u64> {
                simulation.state().x().iter().map(|x| x.to_bits()).collect()
            };
            assert_eq!(bits(&resumed), bits(&whole), "from step {from}");
            assert_eq!(resumed.work().solver, whole.work().solver);
        }
    }
}
