//! Scenes that break programs of contact: nothing passes through anything, all ends by itself, no energy
//! comes from nowhere. Those that take longer than seconds are cases of `pliant stress --long`.

use pliant_scene::assembly::Assembly;

use super::scenes::crossings;
use super::setups::{grid, head, sheet_at_sheet, solid};

/// Energy from nowhere may be so large, as a part of what prescribed motion turned over: its work is
/// integrated over steps at whose ends its rate is known. And as a part of the energy in play, which solves
/// leave.
const GAINS: [f64; 2] = [1e-2, 1e-7];

/// Steps of a scene of text, looked at `looks` times, all alike: no crossing, positive gaps, no energy from
/// nowhere.
pub(crate) fn tortured(what: &str, text: &str, steps: usize, looks: usize) -> Assembly {
    let mut assembly = super::assembled(text);
    endured(what, &mut assembly, steps, looks);
    assembly
}

/// The same of a scene that goes on.
pub(crate) fn endured(what: &str, assembly: &mut Assembly, steps: usize, looks: usize) {
    assert_eq!(steps % looks, 0, "{what}: {steps} steps are not looked at {looks} times");
    // Friction is not added: what is lost makes up for no gain.
    let measured = |assembly: &mut Assembly| {
        let now = assembly.simulation.diagnostics();
        let brought = now.balance.map_or(0.0, |balance| balance.net() + balance.lost());
        let in_play = now.kinetic + now.elastic + now.contact.unwrap_or(0.0);
        [now.total - brought, brought.abs(), in_play]
    };
    let [mut least, mut turnover, mut in_play] = measured(assembly);
    let mut gain = [0.0, 0.0];
    for _ in 0..looks {
        super::advance(&mut assembly.simulation, steps / looks);
        let time = assembly.simulation.state().time;
        assert!(assembly.simulation.state().x().iter().all(|x| x.is_finite()), "{what} at {time} s");
        assert!(assembly.simulation.contacts().iter().all(|c| c.gap > 0.0), "{what} at {time} s");
        let found = crossings(assembly);
        assert!(found.is_empty(), "{what} at {time} s: {found:?}");
        let [energy, brought, now] = measured(assembly);
        (turnover, in_play) = (turnover.max(brought), in_play.max(now));
        if energy - least > gain[0] {
            gain = [energy - least, time];
        }
        least = least.min(energy);
    }
    let ([gain, time], most) = (gain, GAINS[0] * turnover + GAINS[1] * in_play);
    assert!(gain <= most, "{what} until {time} s: {gain:e} J of {in_play:e} J come from nowhere");
}

/// Vertices of a body.
pub(crate) fn vertices(assembly: &Assembly, name: &str) -> std::ops::Range<usize> {
    let body = assembly.topology.bodies.iter().find(|body| body.name == name).unwrap();
    body.vertices.start as usize..body.vertices.end as usize
}

/// Mean height of the vertices of a body [m].
fn height(assembly: &Assembly, name: &str) -> f64 {
    let body = assembly.topology.bodies.iter().find(|body| body.name == name).unwrap();
    let x = assembly.simulation.positions();
    let heights = body.vertices.clone().map(|v| x[3 * v as usize + 2]);
    heights.sum::<f64>() / body.vertices.len() as f64
}

/// A sheet of 0.3 m that flies at another at 100 m/s, a metre in a step, with thickness and almost without.
#[test]
fn a_sheet_at_100_metres_a_second_does_not_pass_another() {
    for radius in [5e-4, 1e-6] {
        let assembly = tortured("sheets", &sheet_at_sheet(6, radius), 4, 4);
        assert!(height(&assembly, "flies") > height(&assembly, "still"), "radius {radius}");
    }
}

/// Spikes, wedges and edges exactly on each other, vertices over vertices, edges over edges, faces in one
/// plane: the start is taken, and nothing is lost on the way.
#[test]
fn exact_alignments_are_no_trouble() {
    let spike = |up: f64, z: f64| {
        let tip = z;
        let base = z + up * 0.2;
        let order = if up > 0.0 { "[0, 1, 2, 3]" } else { "[0, 2, 1, 3]" };
        format!(
            "inline = {{ points = [[0, 0, {tip:?}], [0.1, 0, {base:?}], [0, 0.1, {base:?}], [-0.1, -0.1, \
             {base:?}]], tetrahedra = [{order}] }}"
        )
    };
    let wedge = |up: f64, z: f64| {
        let base = z + up * 0.2;
        let order = if up > 0.0 { "[0, 1, 2, 3]" } else { "[0, 2, 1, 3]" };
        format!(
            "inline = {{ points = [[-0.1, 0, {z:?}], [0.1, 0, {z:?}], [0, 0.1, {base:?}], [0, -0.1, \
             {base:?}]], tetrahedra = [{order}] }}"
        )
    };
    let cases = [
        ("spike on spike", spike(1.0, 5e-4), spike(-1.0, -5e-4)),
        ("spike on wedge", spike(1.0, 5e-4), wedge(-1.0, -5e-4)),
        ("wedge on wedge", wedge(1.0, 5e-4), wedge(-1.0, -5e-4)),
        ("spike on box", spike(1.0, 5e-4), grid([2, 2, 1], [0.2, 0.2, 0.1], [-0.1, -0.1, -0.1005])),
        (
            "box on box",
            grid([1, 1, 1], [0.2, 0.2, 0.1], [-0.1, -0.1, 5e-4]),
            grid([2, 2, 1], [0.2, 0.2, 0.1], [-0.1, -0.1, -0.1005]),
        ),
        (
            "box on box, edge over edge",
            grid([1, 1, 1], [0.2, 0.2, 0.1], [0.1, -0.1, 5e-4]),
            grid([2, 2, 1], [0.2, 0.2, 0.1], [-0.1, -0.1, -0.1005]),
        ),
    ];
    for (what, above, below) in cases {
        let text = head(0.01, -9.81, "distance = 1e-3, friction = 0.3")
            + &solid("above", &above, 1e5, 1000.0, "")
            + &solid(
                "below",
                &below,
                1e5,
                1000.0,
                "pin = [{ half_space = { normal = [0, 0, 1], offset = -0.09 } }]",
            );
        tortured(what, &text, 30, 6);
    }
}

/// A block that falls on a layer, from the softest contact to the stiffest, and from the nearest to the
/// widest: it stays above, and Newton's method takes no more than three times what a prototype took.
#[test]
fn stiffnesses_and_reaches_of_many_decades_hold_a_block() {
    // Stiffness over Young's modulus; most Newton iterations of any step there.
    for (ratio, distance, most) in [
        (0.01, 1e-3, 12),
        (0.1, 1e-3, 10),
        (1.0, 1e-3, 15),
        (10.0, 1e-3, 19),
        (100.0, 1e-3, 32),
        (1.0, 1e-2, 15),
        (1.0, 1e-5, 30),
    ] {
        let text = format!(
            "dimension = 2\ntime = {{ integrator = 'implicit-euler', step = 0.01, duration = 1.0 }}\n\
             world = {{ gravity = [0, -9.81] }}\ncontact = {{ distance = {distance:?}, stiffness = {:?} }}\n\
             [[body]]\nname = 'block'\nmesh = {{ grid = {{ cells = [4, 4], size = [0.2, 0.2], origin = \
             [0.1, 0.1123] }} }}\n\
             elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n\
             velocity = {{ rigid = {{ linear = [0, -3] }} }}\n\
             [[body]]\nname = 'layer'\nmesh = {{ grid = {{ cells = [9, 2], size = [0.4, 0.1] }} }}\n\
             elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n\
             pin = [{{ half_space = {{ normal = [0, 1], offset = 0 }} }}]\n",
            ratio * 1e5
        );
        let mut simulation = super::assembled(&text).simulation;
        let mut worst = 0;
        for step in 0..30 {
            let before = simulation.work().solver.unwrap().newton_iterations;
            super::advance(&mut simulation, 1);
            worst = worst.max(simulation.work().solver.unwrap().newton_iterations - before);
            assert!(simulation.contacts().iter().all(|c| c.gap > 0.0), "{ratio}, {distance}, step {step}");
        }
        assert!(worst <= 3 * most, "{ratio} E, {distance} m: {worst} iterations, {most} there");
        let x = simulation.positions();
        let middle = x.chunks(2).take(25).map(|x| x[1]).sum::<f64>() / 25.0;
        assert!((0.12..0.3).contains(&middle), "{ratio} E, {distance} m: {middle} m");
    }
}

/// Layers stop the way of the ends again and again: in the 50th step the rest of it was rounding, and free
/// coordinates were stopped on another way.
#[test]
fn a_coarse_mat_is_wrung_until_its_layers_lie_on_each_other() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/twisted_mat.toml");
    let text = std::fs::read_to_string(path).unwrap().replace("[16, 16, 1]", "[12, 12, 1]");
    let mut assembly = super::assembled(&text);
    super::advance(&mut assembly.simulation, 52);
}

#[test]
fn a_house_of_cards_stands_by_friction_alone() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/card_house.toml");
    for (friction, stands) in [("friction = 0.9", true), ("friction = 0.1", false)] {
        let text = std::fs::read_to_string(path).unwrap().replace("friction = 0.9", friction);
        let mut assembly = super::assembled(&text);
        let top = |assembly: &Assembly| {
            let body = assembly.topology.bodies.iter().find(|body| body.name == "card_5").unwrap();
            let x = assembly.simulation.positions();
            body.vertices.clone().map(|v| x[2 * v as usize + 1]).fold(f64::INFINITY, f64::min)
        };
        let start = top(&assembly);
        super::advance(&mut assembly.simulation, 300);
        let end = top(&assembly);
        // It sags by its own weight; what sticks creeps by at most 0.1 mm/s.
        assert!(
            (start - end < 0.02) == stands && (end < 0.1) != stands,
            "{friction}: {start} m, then {end} m"
        );
    }
}
