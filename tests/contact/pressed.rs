//! A ball that a plate presses to a tenth of its height and lets go.

use pliant_scene::assembly::Assembly;

use super::torture::{FLOOR, endured, head, solid, vertices};

/// Radius of the ball [m].
const RADIUS: f64 = 0.1;

/// A ball on a floor, below a plate that goes down for half a second and up again; then both part.
fn press(cells: usize, step: f64) -> Assembly {
    let ball = format!("ball = {{ cells = {cells}, radius = {RADIUS:?}, centre = [0, 0, 0.101] }}");
    let moves = |down: f64, away: f64| {
        format!(
            "motion = {{ keyframes = {{ times = [0, 0.5, 1.0, 1.3], smooth = true, \
             displacements = [[0, 0, 0], [0, 0, {down:?}], [0, 0, 0], [0, 0, {away:?}]] }} }}\n"
        )
    };
    let plate = "[[obstacle]]\nname = 'plate'\n\
        shape = { box = { min = [-0.6, -0.6, 0.202], max = [0.6, 0.6, 0.25] } }\n";
    let ball = solid("ball", &ball, 1e5, 1000.0, "");
    let text =
        head(step, 0.0, "distance = 1e-3") + FLOOR + &moves(0.0, -1.0) + &ball + plate + &moves(-0.182, 1.0);
    super::assembled(&text)
}

/// The height of the ball [m].
fn height(assembly: &Assembly) -> f64 {
    let x = assembly.simulation.positions();
    let heights = vertices(assembly, "ball").map(|v| x[3 * v + 2]);
    let [low, high] =
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(z), high.max(z)]);
    high - low
}

/// Pressed and let go: what it stored at its flattest is gone to a millionth.
fn survives(cells: usize, step: f64) {
    let mut assembly = press(cells, step);
    let down = (0.5 / step).round() as usize;
    endured("pressed ball", &mut assembly, down, down);
    // The plate is 2 cm above the floor, and there are two gaps of at most a millimetre.
    let pressed = height(&assembly);
    assert!((0.2 * RADIUS - 2e-3..0.2 * RADIUS).contains(&pressed), "{pressed} m");
    let stored = assembly.simulation.diagnostics().elastic;
    endured("ball let go", &mut assembly, 3 * down, 3 * down);
    let left = assembly.simulation.diagnostics().elastic;
    assert!(left < 1e-6 * stored, "{left:e} J of {stored:e} J are left, height {} m", height(&assembly));
}

#[test]
fn a_ball_pressed_to_a_tenth_comes_back() {
    survives(2, 5e-3);
}

/// A plate that goes farther in a step than the gap that it has: what it pushes gets out of its way.
#[test]
fn a_plate_that_goes_farther_than_its_gap_in_a_step_pushes_on() {
    let mut assembly = press(4, 5e-3);
    endured("pressed ball", &mut assembly, 20, 20);
    // Smooth keyframes: 3 s^2 - 2 s^3 of its 18.2 cm down.
    let down = 0.182 * (3.0 - 2.0 * 0.2) * 0.2 * 0.2;
    let pressed = height(&assembly);
    assert!((0.201 - down - 2e-3..0.201 - down + 1e-3).contains(&pressed), "{pressed} m, {down} m down");
}

#[test]
#[ignore = "minutes: cargo test --release -p pliant-scene --test contact -- --ignored"]
fn torture_a_fine_ball_pressed_to_a_tenth_comes_back() {
    survives(8, 5e-3);
}
