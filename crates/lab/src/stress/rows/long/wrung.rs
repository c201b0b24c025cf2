//! Twisted bodies: a mat, and four rods, with ends that rotate against each other.

use super::LongCase;
use super::run::LongRun;
use super::setups::{grid, head, solid};

pub(super) fn cases() -> Vec<LongCase> {
    let mut cases = vec![LongCase::new("a mat of 16 x 16 cells is wrung", |run| mat(run, 16, 250))];
    for step in [2.0, 0.5, 0.1, 0.025] {
        let name = format!("four rods are twisted in steps of {step} s");
        cases.push(LongCase::new(name, move |run| rods(run, 100, step, 10.0).map(|_| ())));
    }
    cases.push(LongCase::new("four rods are twisted alike by halves of a step", |run| halved_rods(run, 100)));
    cases.push(LongCase::new("a mat of 40 x 40 cells is wrung", |run| mat(run, 40, 250)));
    let finest = |run: &mut LongRun<'_>| rods(run, 100, 2e-3, 10.0).map(|_| ());
    cases.push(LongCase::new("four rods are twisted in steps of 0.002 s", finest));
    cases
}

/// Pins that rotate the ends at `x = -0.5 m` and `x = 0.5 m` against each other, one turn in five seconds
/// each.
const TURNS: &str = "pin = [{ half_space = { normal = [1, 0, 0], offset = -0.4999 }, \
    motion = { rotation = { axis = [1, 0, 0], point = [0, 0, 0], speed = '72 deg/s' } } }, \
    { half_space = { normal = [-1, 0, 0], offset = -0.4999 }, \
    motion = { rotation = { axis = [1, 0, 0], point = [0, 0, 0], speed = '-72 deg/s' } } }]";

/// A mat of 1 m, 2.5 cm thick.
pub(super) fn mat(run: &mut LongRun<'_>, cells: usize, steps: u64) -> Option<()> {
    let mesh = grid([cells, cells, 1], [1.0, 1.0, 0.025], [-0.5, -0.5, -0.0125]);
    let text = head(0.04, 0.0, "") + &solid("mat", &mesh, 2e4, 1000.0, TURNS);
    let mut scene = run.begin("mat", &text, steps);
    run.take(&mut scene, steps)?;
    run.end(&mut scene);
    Some(())
}

/// Four rods side by side, each of `cells` x 2 x 2, up to the time `until` [s]; returns the elastic
/// energy [J].
pub(super) fn rods(run: &mut LongRun<'_>, cells: usize, step: f64, until: f64) -> Option<f64> {
    let mut text = head(step, 0.0, "");
    for k in 0..4 {
        let place = [-0.5, 0.03 * f64::from(k % 2) - 0.025, 0.03 * f64::from(k / 2) - 0.025];
        text +=
            &solid(&format!("rod{k}"), &grid([cells, 2, 2], [1.0, 0.02, 0.02], place), 1e4, 1000.0, TURNS);
    }
    let steps = (until / step).round() as u64;
    let mut scene = run.begin(format!("rods at a step of {step} s"), &text, steps);
    run.take(&mut scene, steps)?;
    let energy = scene.elastic();
    run.end(&mut scene);
    Some(energy)
}

/// After half a turn of each end, halving the step changes the energy by 5 % at most.
pub(super) fn halved_rods(run: &mut LongRun<'_>, cells: usize) -> Option<()> {
    let mut before = None;
    for step in [0.025, 0.0125, 0.00625] {
        let energy = rods(run, cells, step, 2.5)?;
        if let Some(before) = before {
            run.measure("energy, by half the step", f64::abs(energy / before - 1.0), 0.05);
        }
        before = Some(energy);
    }
    Some(())
}
