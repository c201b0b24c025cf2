//! Statics that finds its own increments.

use std::path::{Path, PathBuf};

use pliant::simulation::{Simulation, StepError};
use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{Scene, Source};

/// A block pressed to 40.5 % of its height: an increment of 1 s moves the plate by more than a row of
/// elements.
const PRESSED: &str = "dimension = 2
time = { integrator = 'quasi-static', adaptive = { first = 1.0 }, duration = 2.0 }
output = { rate = 1.0 }
[[body]]
mesh = { grid = { cells = [2, 4], size = [1, 1] } }
elastic = { neo-hookean = { young = 1e4, poisson = 0.3 } }
mass = { density = 10.0 }
pin = [
  { name = 'foot', half_space = { normal = [0, 1], offset = 0 } },
  { name = 'head', half_space = { normal = [0, -1], offset = -1 }, motion.displacement = ['0', '-0.35 * \
  min(t, 1.7)'] },
]
load = [{ half_space = { normal = [1, 0], offset = 0 }, pressure = '200 * max(t - 0.3, 0)' }]
";

fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes")
}

fn assemble(text: &str) -> Assembly {
    let mut scene = Scene::from_toml(text).unwrap_or_else(|error| panic!("{error}"));
    scene.directory = scenes();
    scene.assemble(UnstableStep::Refuse).unwrap_or_else(|problems| panic!("{problems:?}"))
}

/// Goes on to each of these times; the times of all increments.
fn go(simulation: &mut Simulation, targets: &[f64]) -> Vec<f64> {
    let mut times = vec![];
    for target in targets {
        while simulation.state().time < *target {
            simulation.step_towards(*target).unwrap_or_else(|error| panic!("{error}"));
            times.push(simulation.state().time);
        }
    }
    times
}

fn largest_difference(a: &Simulation, b: &Simulation) -> f64 {
    let (a, b) = (a.positions(), b.positions());
    a.iter().zip(b.iter()).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
}

// Elastic bodies remember nothing of the way: two ways of increments end at one equilibrium, each to the
// tolerance of a billionth of the size, sqrt(2) m.
#[test]
fn increments_are_cut_and_land_on_frames_and_kinks_and_end_where_small_ones_do() {
    let mut automatic = assemble(PRESSED).simulation;
    let times = go(&mut automatic, &[1.0, 2.0]);
    for time in [0.3, 1.0, 1.7, 2.0] {
        assert!(times.contains(&time), "{time} is not among {times:?}");
    }
    let work = automatic.work();
    let increments = work.increments.unwrap();
    assert!(increments.cut_back >= 1 && Some(increments.cut_back) == work.rejected_steps, "{increments:?}");
    assert_eq!(increments.accepted, times.len() as u64);
    let starts = [0.0].iter().chain(&times);
    let sizes: Vec<f64> = starts.zip(&times).map(|(from, to)| to - from).collect();
    let least = sizes.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    assert!((increments.least - least).abs() < 1e-15 && (increments.largest - largest).abs() < 1e-15);
    let mut fixed = assemble(&PRESSED.replace("adaptive = { first = 1.0 }", "step = 0.05")).simulation;
    (0..40).for_each(|_| fixed.step().unwrap());
    let error = largest_difference(&automatic, &fixed);
    assert!(error < 4e-9, "{error:e} m");
}

#[test]
fn easy_increments_grow_up_to_the_largest() {
    let text = PRESSED.replace("0.35 *", "0.01 *").replace("200 *", "1 *");
    let mut simulation = assemble(&text.replace("first = 1.0", "first = 0.01, largest = 0.1")).simulation;
    go(&mut simulation, &[1.0]);
    let increments = simulation.work().increments.unwrap();
    assert_eq!(increments.cut_back, 0);
    // 0.01 twice, then half as large again each time: 0.1 is reached after six more, at 0.3 s.
    assert!(increments.accepted < 24, "{increments:?}");
    assert!(
        increments.least <= 0.01 && increments.largest > 0.08 && increments.largest <= 0.11,
        "{increments:?}"
    );
}

/// The state, and what the next step is made of, as bits.
fn bits(simulation: &Simulation) -> Vec<u64> {
    let state = simulation.state();
    let numbers = state.x().iter().chain(state.v()).chain([&state.time]);
    numbers.map(|number| number.to_bits()).collect()
}

#[test]
fn an_increment_below_the_least_ends_with_the_state_before_it_and_says_why() {
    let text = PRESSED.replace("first = 1.0", "first = 1.0, smallest = 1.0");
    let mut simulation =
        assemble(&text.replace("max(t - 0.3, 0)", "t").replace("min(t, 1.7)", "t")).simulation;
    let before = bits(&simulation);
    let error = simulation.step_towards(1.0).unwrap_err();
    assert_eq!(bits(&simulation), before);
    let increments = simulation.work().increments.unwrap();
    assert_eq!((increments.accepted, increments.cut_back), (0, 1));
    let StepError::StepTooSmall { step: 1, is_static: true, .. } = error else { panic!("{error}") };
    let message = error.to_string();
    let parts = [
        "increment 1 (t = 0 s) failed",
        "the smallest allowed is 1 s",
        "infeasible",
        "has J = ",
        "limit point",
    ];
    for part in parts {
        assert!(message.contains(part), "{part}: {message}");
    }
}

#[test]
fn the_force_that_is_left_is_named_with_its_vertex() {
    let text = "dimension = 2
        [time]
        integrator = 'quasi-static'
        adaptive = { smallest = 1.0 }
        duration = 1.0
        solver = { iterations = 1 }
        [[body]]
        mesh = { strand = { segments = 1, start = [0, 0], end = [1, 0] } }
        springs = { stiffness = 10.0 }
        mass = { per_vertex = 1.0 }
        pin = [{ vertices = [0] }]
        load = [{ vertices = [1], force = ['3*t', '4*t'] }]
        [output]
        rate = 1.0\n";
    let mut simulation = assemble(text).simulation;
    let message = simulation.step_towards(1.0).unwrap_err().to_string();
    assert!(message.contains("not converged within the iterations allowed"), "{message}");
    assert!(message.contains("N at vertex 1"), "{message}");
}

/// Distance between the ends of a scene of `scenes/` with its fixed step and with increments of its own,
/// and the size of the scene [m].
fn compare(name: &str, step: &str, adaptive: &str, duration: f64) -> (f64, f64) {
    let text = std::fs::read_to_string(scenes().join(name)).unwrap();
    let automatic = text.replacen(step, adaptive, 1);
    assert_ne!(text, automatic, "{name} has no {step}");
    let mut fixed = assemble(&text).simulation;
    while fixed.state().time < duration * (1.0 - 1e-12) {
        fixed.step().unwrap();
    }
    let mut automatic = assemble(&automatic).simulation;
    go(&mut automatic, &[duration]);
    (largest_difference(&fixed, &automatic), fixed.length_scale())
}

// Contact without friction remembers nothing of the way either.
#[test]
fn contact_ends_where_it_does_with_fixed_increments() {
    let (error, size) = compare("hertz_2d.toml", "step = \"0.25 s\"", "adaptive = { first = 0.5 }", 0.5);
    assert!(error < 1e-8 * size, "{error:e} m of {size} m");
}

/// A membrane of rubber under pressure from below, its rim held.
const BLOWN: &str = "dimension = 3
time = { integrator = 'quasi-static', step = 0.1, duration = 1.0 }
output = { rate = 1.0 }
[[body]]
mesh = { cloth = { cells = [4, 4], origin = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0] } }
membrane = { thickness = 0.001 }
elastic = { neo-hookean = { young = 1e6, poisson = 0.3 } }
mass = { density = 1000.0 }
pin = [
  { half_space = { normal = [1, 0, 0], offset = 0 } }, { half_space = { normal = [-1, 0, 0], offset = -1 } },
  { half_space = { normal = [0, 1, 0], offset = 0 } }, { half_space = { normal = [0, -1, 0], offset = -1 } },
]
load = [{ half_space = { normal = [0, 0, 1], offset = 10 }, pressure = '-2000 * min(t, 0.65)' }]
";

#[test]
fn a_membrane_under_follower_pressure_ends_where_it_does_with_fixed_increments() {
    let mut fixed = assemble(BLOWN).simulation;
    (0..10).for_each(|_| fixed.step().unwrap());
    let mut automatic = assemble(&BLOWN.replace("step = 0.1", "adaptive = {}")).simulation;
    let times = go(&mut automatic, &[1.0]);
    assert!(times.contains(&0.65), "{times:?}");
    let moved = automatic.positions().chunks(3).fold(0.0, |m: f64, x| m.max(x[2].abs()));
    assert!(moved > 0.1, "it is blown up by {moved} m");
    let error = largest_difference(&fixed, &automatic);
    assert!(error < 4e-9, "{error:e} m");
}

#[test]
fn keys_of_errors_are_refused_in_statics() {
    let wrong = |adaptive: &str| {
        let text = PRESSED.replace("{ first = 1.0 }", adaptive);
        Source::new("scene", &text).scene().unwrap_err().render(false)
    };
    for key in ["tolerance", "position", "velocity"] {
        let message = wrong(&format!("{{ {key} = 1e-3 }}"));
        let said = format!("quasi-static follows a criterion of its own, not `{key}`");
        assert!(message.contains(&said) && message.contains("`tolerance` of [time] solver"), "{message}");
    }
}
