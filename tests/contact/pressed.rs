//! A ball that a plate presses to a tenth of its height and lets go.

use pliant_scene::assembly::Assembly;

use super::setups::{PRESSED_RADIUS, press};
use super::torture::{endured, vertices};

/// The height of the ball [m].
fn height(assembly: &Assembly) -> f64 {
    let x = assembly.simulation.positions();
    let heights = vertices(assembly, "ball").map(|v| x[3 * v + 2]);
    let [low, high] =
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(z), high.max(z)]);
    high - low
}

/// Pressed and let go: what it stored at its flattest is gone to a millionth.
#[test]
fn a_ball_pressed_to_a_tenth_comes_back() {
    let mut assembly = super::assembled(&press(2, 5e-3));
    endured("pressed ball", &mut assembly, 100, 100);
    // The plate is 2 cm above the floor, and there are two gaps of at most a millimetre.
    let pressed = height(&assembly);
    assert!((0.2 * PRESSED_RADIUS - 2e-3..0.2 * PRESSED_RADIUS).contains(&pressed), "{pressed} m");
    let stored = assembly.simulation.diagnostics().elastic;
    endured("ball let go", &mut assembly, 300, 300);
    let left = assembly.simulation.diagnostics().elastic;
    assert!(left < 1e-6 * stored, "{left:e} J of {stored:e} J are left, height {} m", height(&assembly));
}

/// A plate that goes farther in a step than the gap that it has: what it pushes gets out of its way.
#[test]
fn a_plate_that_goes_farther_than_its_gap_in_a_step_pushes_on() {
    let mut assembly = super::assembled(&press(4, 5e-3));
    endured("pressed ball", &mut assembly, 20, 20);
    // Smooth keyframes: 3 s^2 - 2 s^3 of its 18.2 cm down.
    let down = 0.182 * (3.0 - 2.0 * 0.2) * 0.2 * 0.2;
    let pressed = height(&assembly);
    assert!((0.201 - down - 2e-3..0.201 - down + 1e-3).contains(&pressed), "{pressed} m, {down} m down");
}
