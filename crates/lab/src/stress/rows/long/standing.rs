//! Structures that stand by friction: cards, cubes, an arch; and their collapse with too little friction.

use std::fmt::Write;

use super::LongCase;
use super::run::{LongRun, LongScene};
use super::setups::{FLOOR, STONES, arch, grid, head, solid};

/// Friction regularisation velocity [m/s]: sticking contacts creep no faster.
const CREEP: f64 = 1e-4;
/// Number of cubes in the stack.
const CUBES: u32 = 10;

pub(super) fn cases() -> Vec<LongCase> {
    let arch = |name: &str, distance: f64| {
        let case = LongCase::new(name, move |run| stones(run, distance, 2000));
        LongCase { dimension: 2, poisson: 0.2, ..case }
    };
    let cards = LongCase::new("a house of cards stands", |run| cards(run, 20, 200));
    vec![
        LongCase { dimension: 2, poisson: 0.3, ..cards },
        arch("an arch of 25 stones 1 mm apart stands", 1e-3),
        arch("an arch of 25 stones 1 um apart stands", 1e-6),
        LongCase::new("a stack of ten stiff cubes stands", |run| stack(run, 1e9, 1000)),
        LongCase::new("a stack of ten soft cubes falls over", |run| stack(run, 1e5, 1000)),
    ]
}

/// Five cards of a metre, 1 cm thick, the last a little longer: two pairs lean against each other at 60
/// degrees, and the last lies on both.
fn house(cells: usize, friction: f64) -> String {
    let mut text = format!(
        "dimension = 2\ntime = {{ integrator = 'implicit-euler', step = 0.025, duration = 100.0 }}\n\
         world = {{ gravity = [0, -9.81] }}\n\
         contact = {{ distance = 0.35e-3, friction = {friction:?}, threshold_speed = {CREEP:?} }}\n\
         [[obstacle]]\nname = 'floor'\nshape = {{ half_space = {{ normal = [0, 1], offset = 0 }} }}\n"
    );
    // Angle, length, position of the lower side, true if below the line about which it is turned.
    let cards = [
        (60, 1.0, [0.0, 0.0004], 0.0),
        (120, 1.0, [1.0004, 0.0004], -0.01),
        (60, 1.0, [1.03, 0.0004], 0.0),
        (120, 1.0, [2.0304, 0.0004], -0.01),
        (0, 1.1, [0.4652, 0.871825], 0.0),
    ];
    for (k, (angle, length, place, low)) in cards.into_iter().enumerate() {
        let _ = write!(
            text,
            "[[body]]\nname = 'card{k}'\n\
             mesh = {{ grid = {{ cells = [{cells}, 1], size = [{length:?}, 0.01], origin = [0.0, {low:?}] \
             }} }}\n\
             transform = {{ rotate = {{ angle = '{angle} deg' }}, translate = {place:?} }}\n\
             elastic = {{ neo-hookean = {{ young = 1e8, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n"
        );
    }
    text
}

/// A house with `mu = 0.9` sags by its weight at first and then creeps; with 0.1 it lies on the floor.
pub(super) fn cards(run: &mut LongRun<'_>, cells: usize, steps: u64) -> Option<()> {
    let settling = steps / 5;
    let mut scene = run.begin("cards with mu = 0.9", &house(cells, 0.9), steps);
    let start = scene.heights("card4")[0];
    run.take(&mut scene, settling)?;
    let before = scene.x();
    run.take(&mut scene, steps - settling)?;
    let sunk = start - scene.heights("card4")[0];
    run.demand(sunk < 0.02, || format!("with mu = 0.9 the upper card sinks by {sunk:.3e} m"));
    let crept = before.iter().zip(scene.x()).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
    let seconds = 0.025 * (steps - settling) as f64;
    run.measure("creep of cards [m]", crept, CREEP * seconds);
    run.end(&mut scene);
    let mut scene = run.begin("cards with mu = 0.1", &house(cells, 0.1), 120);
    run.take(&mut scene, 120)?;
    let height = scene.heights("card4")[0];
    run.demand(height < 0.1, || format!("with mu = 0.1 the upper card is still {height:.3e} m high"));
    run.end(&mut scene);
    Some(())
}

/// Sticking faces creep at less than the regularisation velocity; sliding stones fall a good part of
/// `g t^2 / 2`, which is 0.44 m in 0.3 s.
pub(super) fn stones(run: &mut LongRun<'_>, distance: f64, steps: u64) -> Option<()> {
    let key = format!("stone{}", STONES / 2);
    let mut sinks = |friction: f64, steps: u64| {
        let mut scene = run.begin(format!("arch with mu = {friction}"), &arch(distance, friction), steps);
        let start = scene.centre(&key)[1];
        run.take(&mut scene, steps)?;
        let sunk = start - scene.centre(&key)[1];
        run.end(&mut scene);
        Some(sunk)
    };
    let (stands, falls) = (sinks(0.5, steps)?, sinks(0.2, 30)?);
    let seconds = 0.01 * steps as f64;
    run.measure("what the keystone sinks by with mu = 0.5 [m]", stands, 2.5 * CREEP * seconds + distance);
    run.demand(falls > 0.05, || format!("with mu = 0.2 the keystone sinks by {falls:.3e} m only"));
    Some(())
}

/// Stiff cubes stand. Soft ones must fall over: a column of 0.2 x 0.2 m carries its own weight up to a
/// height of `(7.84 E I / (rho g A))^(1/3)` (Greenhill 1881), 0.64 m at 1e5 Pa, 14 m at 1e9 Pa.
pub(super) fn stack(run: &mut LongRun<'_>, young: f64, steps: u64) -> Option<()> {
    let contact = format!("distance = 1e-3, friction = 0.5, threshold_speed = {CREEP:?}");
    let mut text = head(0.01, -9.81, &contact) + FLOOR;
    for k in 0..CUBES {
        let place = [0.01 * f64::from(k % 2), 0.007 * f64::from(k % 3), 0.001 + 0.201 * f64::from(k)];
        text += &solid(&format!("cube{k}"), &grid([2, 2, 2], [0.2; 3], place), young, 1000.0, "");
    }
    let centres = |scene: &LongScene| -> Vec<Vec<f64>> {
        (0..CUBES).map(|k| scene.centre(&format!("cube{k}"))).collect()
    };
    let mut scene = run.begin("stack", &text, steps);
    scene.expect_rounding(f64::from(CUBES) * young * 0.2_f64.powi(3));
    let start = centres(&scene);
    run.take(&mut scene, steps)?;
    let end = centres(&scene);
    let heights: Vec<f64> = end.iter().map(|centre| centre[2]).collect();
    let greenhill = (7.84 * young * 0.2 * 0.2 / 12.0 / (1000.0 * 9.81)).cbrt();
    if greenhill > 2.0 {
        run.demand(heights.windows(2).all(|h| h[1] > h[0] + 0.1), || format!("centres at {heights:?} m"));
        run.measure("height of the highest centre [m]", (heights[9] - 1.91).abs(), 0.02);
        // Each face below a cube lets it creep, and its sag is at most that of the whole column.
        let sag = 1000.0 * 9.81 * 2.0_f64.powi(2) / young;
        for (k, (start, end)) in start.iter().zip(&end).enumerate() {
            let aside = (end[0] - start[0]).hypot(end[1] - start[1]);
            let most = CREEP * 0.01 * steps as f64 * (k + 1) as f64 + sag;
            run.measure("way aside of a centre [m]", aside, most);
        }
    } else {
        run.demand(heights[9] < greenhill, || format!("centres at {heights:?} m, the bar is {greenhill} m"));
    }
    run.end(&mut scene);
    Some(())
}
