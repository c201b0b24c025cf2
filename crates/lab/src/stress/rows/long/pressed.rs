//! Compressed bodies: a ball between plates, a small cube below a large one.

use super::LongCase;
use super::run::LongRun;
use super::setups::{FLOOR, PRESSED_RADIUS, grid, head, press, solid};

pub(super) fn cases() -> Vec<LongCase> {
    vec![
        LongCase::new("a large cube on a small one", |run| large_on_small(run, 3, 40)),
        LongCase::new("a ball pressed to a tenth comes back", |run| pressed(run, 8, 5e-3)),
    ]
}

/// A cube of 1 m and 10 t on a cube of 0.1 m with a hundredth of its stiffness: it stays above.
pub(super) fn large_on_small(run: &mut LongRun<'_>, cells: usize, steps: u64) -> Option<()> {
    let text = head(0.025, -9.81, "friction = 0.5")
        + FLOOR
        + &solid("small", &grid([cells; 3], [0.1; 3], [-0.05, -0.05, 1e-4]), 1e6, 1000.0, "")
        + &solid("large", &grid([cells; 3], [1.0; 3], [-0.5, -0.5, 0.1002]), 1e8, 1e4, "");
    let mut scene = run.begin("cubes", &text, steps);
    run.take(&mut scene, steps)?;
    let [small, large] = ["small", "large"].map(|name| scene.centre(name)[2]);
    run.demand(small < large, || format!("the large one is at {large} m, the small one at {small} m"));
    run.end(&mut scene);
    Some(())
}

/// A ball compressed for half a second to a height of two centimetres, then released: its stored energy
/// falls to a millionth of the maximum.
pub(super) fn pressed(run: &mut LongRun<'_>, cells: usize, step: f64) -> Option<()> {
    let down = (0.5 / step).round() as u64;
    let mut scene = run.begin("ball", &press(cells, step), 4 * down);
    run.take(&mut scene, down)?;
    // There are two gaps of at most a millimetre.
    let [low, high] = scene.heights("ball");
    let height = high - low;
    let between = 0.2 * PRESSED_RADIUS - 2e-3..0.2 * PRESSED_RADIUS;
    run.demand(between.contains(&height), || format!("pressed, it is {height} m high"));
    let stored = scene.elastic();
    run.take(&mut scene, 3 * down)?;
    run.measure("energy that is left, of what it stored", scene.elastic() / stored, 1e-6);
    run.end(&mut scene);
    Some(())
}
