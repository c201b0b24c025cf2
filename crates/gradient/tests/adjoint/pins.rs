//! Pins that let go, and pins that turn.

use pliant::simulation::Simulation;
use pliant_gradient::{GradientError, LossFrame, UNLIMITED, gradient};
use pliant_scene::{ContactSpec, Scene};

use crate::differences::{compare_number, compare_starts};
use crate::solid::assembled;
use crate::support::{compare_with_differences, dot, falling_beam, scattered};
use crate::tangents::compare_with_tangents;

/// A beam, damped, its left end held by a pin of these further keys.
fn beam(scheme: &str, young: f64, pin: &str, further: &str) -> Scene {
    let step = if scheme == "dormand-prince5" { "adaptive = { tolerance = 1e-5 }" } else { "step = 0.01" };
    falling_beam(scheme, young, [step, further, pin])
}

const SCHEMES: [&str; 9] = [
    "velocity-verlet",
    "rk4",
    "implicit-euler",
    "sdirk2",
    "bdf2",
    "generalised-alpha",
    "gauss2",
    "dormand-prince5",
    "ias15",
];

const YOUNG: &str = "body.beam.elastic.young";

#[test]
fn pins_let_go_in_runs_that_have_derivatives() {
    for scheme in SCHEMES {
        let still = |young| beam(scheme, young, "until = 0.1", "");
        let let_go = |simulation: &Simulation| simulation.system().constraints().is_empty();
        compare_starts(scheme, &still(5e4), (20, 1e-6), let_go);
        compare_with_tangents(scheme, &still(5e4), 20);
        compare_number(scheme, still, (YOUNG, 5e4, 5e4), (20, 1e-6));
        let moving = |a: f64| {
            let motion = format!("displacement = [\"0\", \"A*t*(1 + Y) where A = {a:?}\"]");
            beam(scheme, 5e4, &format!("until = 0.1, motion = {{ {motion} }}"), "")
        };
        let name = "body.beam.pin.0.motion.parameters.A";
        compare_number(scheme, moving, (name, 0.6, 0.6), (20, 1e-6));
        let factor = |f: f64| moving(0.6 * f);
        compare_number(scheme, factor, ("body.beam.pin.0.motion.factor", 1.0, 1.0), (20, 1e-6));
    }
}

#[test]
fn pins_let_go_of_what_comes_to_a_wall() {
    let scene = |young| {
        let mut scene = beam("bdf2", young, "until = 0.04", "walls = [{ normal = [0, 1], offset = -0.05 }]");
        scene.contact = Some(ContactSpec { stiffness: Some(5e4), ..ContactSpec::default() });
        scene
    };
    let found = compare_starts("at a wall", &scene(5e4), (20, 1e-6), |_| true);
    assert!(found.contact_events.come > 0, "{:?}", found.contact_events);
    compare_number("at a wall", scene, (YOUNG, 5e4, 5e4), (20, 1e-6));
}

#[test]
fn checkpoints_hold_what_let_go_since() {
    let scene = beam("bdf2", 5e4, "until = 0.1", "");
    let run = |budget: usize| {
        let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], v_bar: &mut [f64]| {
            if frame.step != 20 && frame.step != 10 {
                return 0.0;
            }
            x_bar.copy_from_slice(&scattered(frame.x.len(), 1.0));
            v_bar.copy_from_slice(&scattered(frame.x.len(), 2.0));
            dot(x_bar, frame.x) + dot(v_bar, frame.v)
        };
        gradient(&mut assembled(&scene).0, 20, &mut loss, &mut [], budget).unwrap()
    };
    let (all, none) = (run(UNLIMITED), run(0));
    for (a, b) in all.position.iter().zip(&none.position) {
        assert!((a - b).abs() < 1e-9 * a.abs().max(1.0), "{a} {b}");
    }
}

const TURN: &str = "motion = { rotation = { point = [0.2, 0.1], angle = \"2*t + 9*t^2\" } }";

#[test]
fn pins_that_turn_have_derivatives() {
    for scheme in SCHEMES {
        for further in ["", "until = 0.1, "] {
            let turning = |young| beam(scheme, young, &format!("{further}{TURN}"), "");
            compare_with_tangents(scheme, &turning(5e4), 20);
            compare_starts(scheme, &turning(5e4), (20, 1e-6), |_| true);
            compare_number(scheme, turning, (YOUNG, 5e4, 5e4), (20, 1e-6));
        }
    }
}

// Moved at the beginning or under way, vertices that turn go on from where they are.
#[test]
fn places_from_which_vertices_turn_have_derivatives() {
    for scheme in SCHEMES {
        for further in ["", "until = 0.15, "] {
            for first in [0, 5] {
                let scene = beam(scheme, 5e4, &format!("{further}{TURN}"), "");
                let mut simulation = assembled(&scene).0;
                (0..first).for_each(|_| simulation.step().unwrap());
                let start = simulation.snapshot();
                let n = start.x.len();
                let x_dot = scattered(n, 1.0);
                let (w_x, w_v) = (scattered(n, 2.0), scattered(n, 3.0));
                let mut sizes = vec![];
                for _ in 0..20 {
                    simulation.step().unwrap();
                    sizes.push((simulation.last_step_size(), simulation.state().time));
                }
                let value = |x: &[f64], v: &[f64]| dot(&w_x, x) + 0.1 * dot(&w_v, v);
                let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], v_bar: &mut [f64]| {
                    if ![5, 20].contains(&(frame.step - first)) {
                        return 0.0;
                    }
                    x_bar.copy_from_slice(&w_x);
                    v_bar.iter_mut().zip(&w_v).for_each(|(bar, w)| *bar = 0.1 * w);
                    value(frame.x, frame.v)
                };
                simulation.restore(&start).unwrap();
                let found = gradient(&mut simulation, 20, &mut loss, &mut [], UNLIMITED).unwrap();
                let parts: Vec<f64> = found.position.iter().zip(&x_dot).map(|(by, dot)| by * dot).collect();
                let by = (parts.iter().sum::<f64>(), dot(&parts, &parts).sqrt());
                let what = format!("{scheme} {further} from step {first}");
                compare_with_differences(&what, by, (1e-5, 1e-6), |h| {
                    let mut moved = start.clone();
                    moved.x.iter_mut().zip(&x_dot).for_each(|(x, dot)| *x += h * dot);
                    simulation.restore(&moved).unwrap();
                    // Velocities of what turns go by its places.
                    let (mut x, mut v) = (simulation.state().x().to_vec(), simulation.state().v().to_vec());
                    assert!(simulation.system().prescribe(start.time, &mut x, &mut v));
                    simulation.state_mut().v_mut().copy_from_slice(&v);
                    let mut sum = 0.0;
                    for (i, (size, end)) in sizes.iter().enumerate() {
                        simulation.repeat_step(*size, *end).unwrap();
                        if [5, 20].contains(&(i + 1)) {
                            sum += value(&simulation.positions(), &simulation.velocities());
                        }
                    }
                    sum
                });
            }
        }
    }
}

#[test]
fn rotation_of_some_coordinates_is_refused() {
    let mut simulation = assembled(&beam("rk4", 5e4, &format!("axes = [\"x\"], {TURN}"), "")).0;
    let mut nothing = |_: &LossFrame<'_>, _: &mut [f64], _: &mut [f64]| 0.0;
    let refused = gradient(&mut simulation, 1, &mut nothing, &mut [], UNLIMITED).unwrap_err();
    assert!(
        matches!(&refused, GradientError::Unsupported { what, .. } if what.contains("a pin with `axes`")),
        "{refused}"
    );
}
