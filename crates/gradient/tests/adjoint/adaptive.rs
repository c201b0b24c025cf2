//! Runs whose step sizes follow the error: derivatives at the sizes that were chosen, against differences of
//! runs of these sizes.

use pliant::solver::SolverOptions;
use pliant::state::State;
use pliant_gradient::{LossFrame, ParameterSelection, RunGradient, UNLIMITED, gradient, gradient_to};
use pliant_scene::Scene;
use serde_json::json;

use crate::differences::{compare_number, compare_starts};
use crate::solid::assembled;
use crate::support::{compare, falling_beam, method};
use crate::tangents::compare_with_tangents;

/// A beam that falls; further tables.
fn beam(scheme: &str, young: f64, further: &str) -> Scene {
    let tolerance = if method(scheme).has_own_criterion() { "" } else { "tolerance = 1e-5, first = 0.2" };
    falling_beam(scheme, young, [&format!("adaptive = {{ {tolerance} }}"), further, ""])
}

/// Rejected steps of a run of so many accepted ones.
fn rejected(scene: &Scene, steps: u64) -> u64 {
    let mut simulation = assembled(scene).0;
    (0..steps).for_each(|_| simulation.step().unwrap());
    simulation.work().rejected_steps.unwrap()
}

#[test]
fn steps_of_chosen_sizes_have_derivatives() {
    for (scheme, steps) in
        [("dormand-prince5", 20), ("bogacki-shampine3", 20), ("sdirk2", 12), ("tr-bdf2", 12)]
    {
        let scene = beam(scheme, 5e4, "");
        compare_starts(scheme, &scene, (steps, 1e-6), |_| true);
        compare_with_tangents(scheme, &scene, steps);
        let young = |young| beam(scheme, young, "");
        compare_number(scheme, young, ("body.beam.elastic.young", 5e4, 5e4), (steps, 1e-6));
    }
    let rejected =
        ["dormand-prince5", "bogacki-shampine3"].map(|scheme| rejected(&beam(scheme, 5e4, ""), 20));
    assert!(rejected.iter().sum::<u64>() > 0, "no step was taken back");
}

// A close encounter: steps of many sizes. The exact flow has one derivative, whatever the steps.
#[test]
fn steps_of_the_own_choice_of_ias15_have_the_derivative_of_the_flow() {
    let text = |step: &str| {
        format!(
            "dimension = 2
             [time]
             integrator = \"ias15\"
             duration = 2.0
             {step}
             [world]
             nbody = {{ constant = 1.0 }}
             [[body]]
             name = \"three\"
             mesh = {{ inline = {{ points = [[1, 3], [-2, -1], [1, -1]] }} }}
             mass = {{ per_vertex = [3.0, 4.0, 5.0] }}"
        )
    };
    let run = |step: &str| {
        let mut simulation = assembled(&Scene::from_toml(&text(step)).unwrap()).0;
        let found = gradient_to(&mut simulation, &[1.75], &mut height(1.75), &mut [], UNLIMITED).unwrap();
        (found, simulation.state().step)
    };
    let (chosen, steps) = run("adaptive = {}");
    let (fixed, _) = run("step = 0.00125");
    assert!(steps < 400, "fewer than the 1400 fixed ones: {steps}");
    for (found, expected) in [(&chosen.position, &fixed.position), (&chosen.velocity, &fixed.velocity)] {
        compare("ias15", found, expected, 1e-10);
    }
}

#[test]
fn increments_of_statics_have_derivatives() {
    let beam = |young| beam("quasi-static", young, "");
    compare_number("increments", beam, ("body.beam.elastic.young", 2e5, 2e5), (2, 1e-6));
}

#[test]
fn walls_act_in_steps_of_chosen_sizes() {
    let walls = "walls = [{ normal = [0, 1], offset = -0.05 }]";
    let scene = beam("dormand-prince5", 5e4, walls);
    let found = compare_starts("walls", &scene, (40, 1e-6), |_| true);
    assert!(!found.wall_events.is_empty(), "nothing came to a wall");
}

/// The height of the last vertex at the end of a run, where it ends.
fn height(end: f64) -> impl FnMut(&LossFrame<'_>, &mut [f64], &mut [f64]) -> f64 {
    move |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
        if frame.time != end {
            return 0.0;
        }
        *x_bar.last_mut().unwrap() = 1.0;
        frame.x[frame.x.len() - 1]
    }
}

#[test]
fn runs_land_on_times_and_checkpoints_have_the_bits_of_none() {
    let scene = beam("dormand-prince5", 5e4, "");
    let run = |budget: usize| -> RunGradient {
        let mut simulation = assembled(&scene).0;
        let found = gradient_to(&mut simulation, &[0.03, 0.07], &mut height(0.07), &mut [], budget).unwrap();
        let mut alone = assembled(&scene).0;
        for time in [0.03, 0.07] {
            while alone.state().time < time {
                alone.step_towards(time).unwrap();
            }
        }
        assert_eq!(found.value, alone.positions()[alone.positions().len() - 1], "the run itself");
        // What comes after has the sizes that it would have had.
        simulation.step().unwrap();
        alone.step().unwrap();
        assert_eq!(simulation.state().time, alone.state().time);
        found
    };
    assert_eq!(run(UNLIMITED), run(0));
}

#[test]
fn fixed_steps_end_nearest_to_the_last_time() {
    let text = "dimension = 2
        [time]
        integrator = \"velocity-verlet\"
        step = 0.01
        duration = 1.0
        [[body]]
        name = \"dust\"
        mesh = { inline = { points = [[0, 1]] } }
        mass = { per_vertex = 1.0 }";
    let start = || assembled(&Scene::from_toml(text).unwrap()).0;
    let end = 7.0 * 0.01;
    let found = gradient_to(&mut start(), &[0.072], &mut height(end), &mut [], UNLIMITED).unwrap();
    assert_eq!(found, gradient(&mut start(), 7, &mut height(end), &mut [], UNLIMITED).unwrap());
    assert_eq!(found.value, 1.0);
}

/// A block between two plates, one of which comes nearer by more than a row of elements in a step: its
/// material does not survive that, and the step is taken in parts. Further keys of the upper pin.
fn pressed(scheme: &str, young: f64, pin: &str) -> Scene {
    // Inertia carries a block of elements further than equilibrium does.
    let (way, steps) = if scheme == "quasi-static" { (0.024, 2.5) } else { (0.05, 1.1) };
    let text = format!(
        "dimension = 2
         [time]
         integrator = \"{scheme}\"
         step = 0.1
         duration = 1.0
         solver = {{ tolerance = 1e-13, retries = 5 }}
         [world]
         gravity = [0.0, -9.81]
         [[body]]
         name = \"block\"
         mesh = {{ grid = {{ cells = [2, 8], size = [0.06, 0.1] }} }}
         elastic = {{ neo-hookean = {{ young = {young:?}, poisson = 0.4 }} }}
         mass = {{ density = 1100.0 }}
         pin = [
             {{ half_space = {{ normal = [0, 1], offset = 0 }} }},
             {{ half_space = {{ normal = [0, -1], offset = -0.1 }}, {pin}
                motion = {{ displacement = [\"0.1*t\", \"-{way}*min(10*t, {steps})\"] }} }},
         ]"
    );
    Scene::from_toml(&text).unwrap()
}

#[test]
fn steps_that_were_taken_in_parts_have_derivatives() {
    for scheme in ["quasi-static", "implicit-euler", "tr-bdf2", "bdf2", "newmark", "generalised-alpha"] {
        let scene = pressed(scheme, 1e6, "");
        let mut simulation = assembled(&scene).0;
        (0..4).for_each(|_| simulation.step().unwrap());
        let (retried, end) = (simulation.work().retried.unwrap(), simulation.state().time);
        assert!(retried.steps > 0, "{scheme}: {retried:?}");
        let young = |young| pressed(scheme, young, "");
        compare_number(scheme, young, ("body.block.elastic.young", 1e6, 1e6), (4, 1e-6));
        compare_with_tangents(scheme, &scene, 4);
        // Frames are those of whole steps, and so are the forces of each.
        let (mut simulation, topology) = assembled(&scene);
        let mut chosen =
            ParameterSelection::new(&scene, &topology, simulation.numbering(), &["forces", "pins"]).unwrap();
        let mut frames = vec![];
        let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
            frames.push((frame.step, frame.time));
            x_bar.fill(1.0);
            frame.x.iter().sum()
        };
        let found = gradient(&mut simulation, 4, &mut loss, chosen.parameters(), 0).unwrap();
        let n = found.position.len();
        assert_eq!(chosen.parts(&found).iter().map(Vec::len).collect::<Vec<_>>(), [4 * n, 5 * n]);
        frames.sort_by_key(|frame| frame.0);
        assert_eq!(frames.iter().map(|frame| frame.0).collect::<Vec<_>>(), [0, 1, 2, 3, 4], "{scheme}");
        assert_eq!(frames[4].1, end);
        assert_eq!((simulation.state().step, simulation.state().time), (4, end));
    }
}

/// A scheme whose solves do not end at new positions finds what these lead to once it is there: elements
/// that are turned inside out.
#[test]
fn a_step_of_which_a_solved_part_was_taken_back_has_derivatives() {
    let scheme = "crouzeix3";
    let of = |young: f64| {
        let mut scene = pressed(scheme, young, "");
        let motion = json!({ "displacement": ["0.1*t", "-0.05*min(10*t, 1.2)"] });
        scene.body[0].pin[1].motion = Some(serde_json::from_value(motion).unwrap());
        scene
    };
    let mut simulation = assembled(&of(1e6)).0;
    let mut step = |_| {
        simulation.step().unwrap();
        simulation.took_solved_part_back()
    };
    assert!((0..4).map(&mut step).filter(|taken_back| *taken_back).count() > 0, "nothing is taken back");
    compare_number(scheme, of, ("body.block.elastic.young", 1e6, 1e6), (4, 1e-6));
    compare_with_tangents(scheme, &of(1e6), 4);
}

/// The middle is held for less than half of a step that is taken in parts: all of that is without.
#[test]
fn parts_let_go_of_what_the_whole_step_does() {
    for (scheme, until) in [("implicit-euler", 0.03), ("bdf2", 0.03), ("quasi-static", 0.13)] {
        let scene_of = |young| {
            let mut scene = pressed(scheme, young, "");
            let middle = json!({
                "box": { "min": [-1.0, 0.04], "max": [1.0, 0.06] },
                "until": until,
                "motion": { "displacement": ["0.2*t", "-0.1*t"] },
            });
            scene.body[0].pin.push(serde_json::from_value(middle).unwrap());
            scene
        };
        let scene = scene_of(1e6);
        let mut simulation = assembled(&scene).0;
        let mut is_parted = false;
        for step in 1..=4 {
            simulation.step().unwrap();
            let begins = 0.1 * (step - 1) as f64;
            is_parted |= begins < until && until < begins + 0.05 && !simulation.last_parts().is_empty();
        }
        assert!(is_parted, "{scheme}: it lets go in a whole step");
        compare_number(scheme, scene_of, ("body.block.elastic.young", 1e6, 1e6), (4, 1e-6));
        compare_with_tangents(scheme, &scene, 4);
    }
}

/// A step that is taken back once it was solved, the first, one of the size of the last, or one of another,
/// leaves what the scheme knows as it was: the next one is that of a run without it.
#[test]
fn steps_that_are_taken_back_leave_the_memory_of_a_scheme() {
    for scheme in ["bdf2", "newmark", "generalised-alpha"] {
        for (first, taken_back) in [(0, 0.01), (3, 0.01), (3, 0.02), (3, 0.005)] {
            let run = |takes_back: bool| {
                let mut simulation = assembled(&falling_beam(scheme, 5e4, ["step = 0.01", "", ""])).0;
                let (n, options) = (simulation.state().x().len(), SolverOptions::default());
                let mut state = State::new(simulation.state().x().to_vec(), simulation.state().v().to_vec());
                let mut integrator = simulation.method().build(n, options);
                let system = simulation.system_mut();
                for h in std::iter::repeat_n(0.01, first).chain(takes_back.then_some(taken_back)) {
                    integrator.step(system, &mut state, h).unwrap();
                    state.time += h;
                }
                if takes_back {
                    integrator.undo(&mut state);
                    state.time -= taken_back;
                }
                let memory = integrator.memory(system, &state);
                (memory, state.x().to_vec())
            };
            assert_eq!(run(true), run(false), "{scheme}, {first} steps, then {taken_back}");
            assert_eq!(run(true).0.is_empty(), first == 0, "{scheme}");
        }
    }
}
