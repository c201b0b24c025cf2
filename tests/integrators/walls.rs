//! Energy that walls take, and forces they carry: nothing from what rests or slides, the energy of arrival
//! from what falls, by every scheme; the weight of what lies on them.

use std::sync::atomic::AtomicBool;

use pliant::integrator::{IntegratorSpec, Method};
use pliant::run::{Outcome, Plan, Summary, run};
use pliant::simulation::Simulation;
use pliant_scene::assembly::UnstableStep;
use pliant_scene::{Scene, SceneError};

use crate::support::{
    advance, assert_relative, methods, methods_of_measurable_order, run_watched, solve_to_rounding,
};

/// Gravity [m/s^2].
const G: f64 = 10.0;

fn assembled(text: &str) -> Simulation {
    let mut scene = Scene::from_toml(text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    // As by studies, which compare all schemes: those that hold contact would solve for walls.
    scene.world.puts_back = true;
    let mut simulation = scene.assemble(UnstableStep::Accept).map_err(SceneError::new).unwrap().simulation;
    solve_to_rounding(&mut simulation);
    simulation
}

/// A mass of 2 kg in 2D at a place, with a velocity, in a `world` beside gravity, with more `keys`.
fn mass(method: Method, h: f64, [x, v]: [[f64; 2]; 2], world: &str, keys: &str) -> Simulation {
    let name = method.documentation.name;
    assembled(&format!(
        "dimension = 2\ntime = {{ integrator = '{name}', step = {h:?}, duration = 1.0 }}\n\
         world = {{ gravity = [0, -{G:?}], {world} }}\n[[body]]\nmesh = {{ inline = {{ points = [{x:?}] }} \
         }}\n\
         mass = {{ per_vertex = 2.0 }}\nvelocity = {{ rigid = {{ linear = {v:?} }} }}\n{keys}\n"
    ))
}

const FLOOR: &str = "walls = [{ normal = [0, 1], offset = 0 }]";

/// Schemes whose steps walls end: those that solve a step do so without them, and those of several steps go
/// on from places that no wall has seen. Forward Euler moves by the old velocity: what rests falls for a step
/// before it is put back.
fn methods_with_walls() -> impl Iterator<Item = Method> {
    methods().filter(|m| m.documentation.solves == 0 && m.documentation.name != "forward-euler")
}

fn lost(simulation: &mut Simulation) -> f64 {
    simulation.diagnostics().balance.unwrap().walls.unwrap()
}

/// To the last bit, under loads that stay and that grow, with drag and damping: forces do no work on what
/// does not move.
#[test]
fn a_mass_at_rest_on_a_floor_loses_nothing_by_any_scheme() {
    let cases = [
        ("", "damping = { mass_proportional = 3.0 }"),
        ("ether_drag = 2.0,", "load = [{ force = [0, '-40*t'] }]"),
    ];
    for method in methods_with_walls() {
        for (world, keys) in cases {
            let world = format!("{world} {FLOOR}");
            let mut simulation = mass(method, 0.01, [[0.1, 0.0], [0.0; 2]], &world, keys);
            let start = simulation.diagnostics();
            advance(&mut simulation, 200);
            let end = simulation.diagnostics();
            let (name, balance) = (method.documentation.name, end.balance.unwrap());
            assert_eq!(balance.walls, Some(0.0), "{name}: {balance:?}");
            // What drag, damping and loads do in a step that the wall takes back is taken back too.
            let rounding = 1e-14 * 200.0 * 2.0 * G * 0.1;
            let parts = [balance.damping, balance.ether_drag, Some(end.conserved() - start.conserved())];
            for part in parts.into_iter().flatten() {
                assert!(part.abs() < rounding, "{name}: {part:e} J, {balance:?}");
            }
        }
    }
}

/// A mass that falls from the height y loses m g y, whatever velocity it has along the floor.
#[test]
fn what_falls_on_a_floor_loses_its_energy_of_arrival_by_every_scheme() {
    for method in methods_with_walls() {
        let mut simulation = mass(method, 0.01, [[0.0, 0.7], [3.0, 0.0]], FLOOR, "");
        let name = method.documentation.name;
        let start = simulation.diagnostics();
        // It falls for 0.37 s.
        advance(&mut simulation, 60);
        assert_relative(lost(&mut simulation), 2.0 * G * 0.7, 1e-11, name);
        let end = simulation.diagnostics();
        // The velocities of schemes of first order are h/2 beside the positions.
        let rounding = 1e-12 * start.total;
        assert!((end.conserved() - start.conserved()).abs() < rounding, "{name}: {start:?} {end:?}");
        assert!(simulation.positions()[1].abs() < 1e-15 && simulation.velocities()[1] == 0.0);
    }
}

/// By schemes of several steps too: velocities from before the impact would throw it up again.
#[test]
fn what_has_fallen_on_a_floor_stays_there() {
    // By forward Euler what rests falls for a step before it is put back.
    for method in methods().filter(|method| method.documentation.name != "forward-euler") {
        let mut simulation = mass(method, 0.01, [[0.0, 0.7], [3.0, 0.0]], FLOOR, "");
        advance(&mut simulation, 39);
        for _ in 0..20 {
            advance(&mut simulation, 1);
            let (height, speed) = (simulation.positions()[1], simulation.velocities()[1]);
            let name = method.documentation.name;
            assert!(height.abs() < 1e-15 && speed == 0.0, "{name}: {height} m, {speed} m/s");
        }
    }
}

/// On a slope of 3 to 4, where the wall pushes and nothing is lost.
#[test]
fn what_slides_down_a_slope_loses_nothing_by_any_scheme() {
    let slope = "walls = [{ normal = [3, 4], offset = 0 }]";
    for method in methods() {
        let mut simulation = mass(method, 0.01, [[0.0, 0.0], [0.0, 0.0]], slope, "");
        advance(&mut simulation, 100);
        let [x, y] = simulation.positions()[..] else { panic!("one vertex") };
        // `g sin / 2` along the slope in a second, schemes of first order half a step more or less.
        assert_relative(x.hypot(y), 0.5 * 0.6 * G, 0.011, method.documentation.name);
        let (energy, taken) = (2.0 * G * -y, lost(&mut simulation));
        assert!(taken < 1e-12 * energy, "{}: {taken:e} of {energy} J", method.documentation.name);
    }
}

/// In a valley, where one wall moves a vertex off the other in every step: little is lost once, and nothing
/// after that.
#[test]
fn what_lies_between_two_walls_loses_nothing() {
    for normals in [["[1, 1]", "[-1, 1]"], ["[1, 0.3]", "[-1, 0.5]"], ["[0.2, 1]", "[-0.3, 1]"]] {
        let walls = normals.map(|n| format!("{{ normal = {n}, offset = 0 }}")).join(", ");
        for method in methods_with_walls() {
            let world = format!("walls = [{walls}]");
            let mut simulation = mass(method, 0.01, [[0.0, 0.0], [0.0, 0.0]], &world, "");
            advance(&mut simulation, 300);
            let settled = lost(&mut simulation);
            advance(&mut simulation, 300);
            let (later, name) = (lost(&mut simulation), method.documentation.name);
            // A few times `m (g h)^2`, while it comes to its place.
            assert!(settled < 4.0 * (G * 0.01_f64).powi(2), "{name}, {normals:?}: {settled} J");
            assert!(later - settled < 1e-12 * settled.max(1e-3), "{name}, {normals:?}: {settled} {later} J");
            // Both carry the weight together, in the mean over steps that move it to and fro.
            let before = simulation.velocities().into_owned();
            let mut given = [0.0; 2];
            for _ in 0..50 {
                advance(&mut simulation, 1);
                let reactions = simulation.reactions();
                (0..2).for_each(|c| given[c] += 0.01 * reactions.iter().map(|r| r.force[c]).sum::<f64>());
            }
            let after = simulation.velocities();
            for c in 0..2 {
                let off = given[c] - [0.0, 0.5 * 2.0 * G][c] - 2.0 * (after[c] - before[c]);
                assert!(off.abs() < 1e-11, "{name}, {normals:?}: {given:?} N s, off by {off:e}");
            }
        }
    }
}

/// A bar of springs that falls on the floor and comes off it again: every step counts a loss or nothing, and
/// the sum is what finer steps and schemes of higher order count.
#[test]
fn losses_never_shrink_and_do_not_depend_on_the_step_to_first_order() {
    let bar = |method: Method, steps: usize| {
        let (name, h) = (method.documentation.name, 0.4 / steps as f64);
        let mut simulation = assembled(&format!(
            "dimension = 2\ntime = {{ integrator = '{name}', step = {h:?}, duration = 1.0 }}\n\
             world = {{ gravity = [0, -{G:?}], {FLOOR} }}\n[[body]]\n\
             mesh = {{ strand = {{ segments = 7, start = [0, 0.05], end = [0, 0.75] }} }}\nsprings = {{ \
             stiffness = 4e3 }}\n\
             mass = {{ per_vertex = 0.2 }}\nvelocity = {{ rigid = {{ linear = [0, -1] }} }}\n"
        ));
        let start = simulation.diagnostics();
        let mut before = 0.0;
        for _ in 0..steps {
            advance(&mut simulation, 1);
            let now = lost(&mut simulation);
            assert!(now >= before, "{name}: {now} after {before}");
            before = now;
        }
        assert!(before > 0.1 * start.kinetic, "{before} J of {start:?}");
        before
    };
    let exact = bar(IntegratorSpec::Rk4.method(), 12800);
    let explicit = methods_of_measurable_order().filter(|method| method.documentation.solves == 0);
    // By forward Euler the bar gains energy on its way.
    for method in explicit.filter(|method| method.documentation.name != "forward-euler") {
        let [coarse, fine] = [400, 1600].map(|steps| (bar(method, steps) / exact - 1.0).abs());
        let name = method.documentation.name;
        // Of second order: sixteen times as much in steps four times as long.
        assert!(fine < 0.003 && coarse < 16.0 * 0.003, "{name}: off by {coarse:e} and {fine:e}");
    }
}

/// A block lies on a floor, leans at a wall, and hangs at a pin by one corner: forces and moments are in
/// equilibrium. By symplectic Euler, whose forces are those at the places where walls have put vertices.
#[test]
fn walls_carry_what_lies_on_them() {
    let mut simulation = assembled(
        "dimension = 2\ntime = { integrator = 'symplectic-euler', step = 2e-3, duration = 1.0 }\n\
         world = { gravity = [3, -10], ether_drag = 20.0, walls = [\
         { normal = [0, 2], offset = -0.5 }, { normal = [-1, 0], offset = -2 }] }\n\
         [[body]]\nname = 'block'\nmesh = { grid = { cells = [4, 2], size = [2, 1], origin = [0, -0.5] } }\n\
         elastic = { neo-hookean = { young = 1e4, poisson = 0.3 } }\nmass = { density = 10.0 }\n\
         load = [{ vertices = [10], force = [0, -7] }]\npin = [{ name = 'top', vertices = [14], axes = \
         ['y'] }]\n",
    );
    advance(&mut simulation, 10000);
    let names = ["block/top", "wall0", "wall1"];
    assert_eq!(simulation.reaction_names(), names);
    let reactions = simulation.reactions();
    assert_eq!(reactions.iter().map(|r| r.name.as_str()).collect::<Vec<_>>(), names);
    let [pin, floor, side] = &reactions[..] else { panic!("{reactions:?}") };
    assert!(floor.force[1] > 50.0 && floor.force[0] == 0.0 && side.force[0] < -50.0, "{reactions:?}");
    assert_eq!((floor.about, side.about), ([0.0, -0.5, 0.0], [2.0, 0.0, 0.0]));
    // Moments of forces about the origin; the centre of mass from the positions.
    let (x, mut moment) = (simulation.positions().into_owned(), 0.0);
    for (x, m) in x.chunks(2).zip(simulation.system().mass()) {
        moment += m * (x[0] * -10.0 - x[1] * 3.0);
    }
    moment += x[20] * -7.0;
    for r in &reactions {
        moment += r.moment[2] + r.about[0] * r.force[1] - r.about[1] * r.force[0];
    }
    let sum = |c: usize| reactions.iter().map(|r| r.force[c]).sum::<f64>();
    let off = [sum(0) + 3.0 * 20.0, sum(1) - 10.0 * 20.0 - 7.0, moment];
    assert!(off.iter().all(|off| off.abs() < 1e-6), "{off:?}: {pin:?} {floor:?} {side:?}");
    // Nothing is lost, damped or dragged any more.
    let before = simulation.diagnostics().balance.unwrap();
    advance(&mut simulation, 1000);
    let after = simulation.diagnostics().balance.unwrap();
    assert!((after.lost() - before.lost()).abs() < 1e-9, "{before:?} {after:?}");
}

/// A bead that a pin keeps on a wire, on an oblique wall: the wall pushes along its normal, and the pin
/// holds against it.
#[test]
fn a_pin_holds_against_the_wall() {
    let slope = "walls = [{ normal = [3, 4], offset = 0 }]";
    let method = IntegratorSpec::SymplecticEuler.method();
    let pin = "pin = [{ name = 'wire', vertices = [0], axes = ['x'] }]";
    let mut simulation = mass(method, 0.01, [[0.0, 0.0], [0.0, 0.0]], slope, pin);
    advance(&mut simulation, 10);
    let [pin, wall] = &simulation.reactions()[..] else { panic!("two") };
    // The wall carries the weight of 20 N: 25 N along (0.6, 0.8).
    for (force, expected) in [(pin.force, [-15.0, 0.0, 0.0]), (wall.force, [15.0, 20.0, 0.0])] {
        for c in 0..3 {
            assert!((force[c] - expected[c]).abs() < 1e-12, "{pin:?} {wall:?}");
        }
    }
    assert!(lost(&mut simulation) < 1e-14);
}

/// A mass, two at one place, at the origin, on the floor: what has no size is compared with the energy it
/// could have.
#[test]
fn what_has_no_size_is_not_unstable() {
    // In the last, both are at one place but for rounding.
    let places = [
        "[0.1, 0, 2]",
        "[0, 0, 0]",
        "[0, 0, 1e6]",
        "[1, 1, 1], [1, 1, 1]",
        "[0, 0, 0.3], [0, 0, 0.30000000000000004]",
    ];
    let worlds = ["", ", walls = [{ normal = [0, 0, 1], offset = 0 }]", ", ether_drag = 0.3"];
    for method in methods() {
        for points in places {
            for world in worlds {
                let name = method.documentation.name;
                let text = format!(
                    "dimension = 3\ntime = {{ integrator = '{name}', step = 1e-2, duration = 3.0 }}\n\
                     world = {{ gravity = [0, 0, -9.81]{world} }}\n[[body]]\n\
                     mesh = {{ inline = {{ points = [{points}] }} }}\nmass = {{ per_vertex = 1.0 }}\n"
                );
                let mut simulation = assembled(&text);
                let summary = run_watched(&mut simulation, 3.0, 50.0);
                assert!(matches!(summary.outcome, Outcome::Done), "{name}: {:?}\n{text}", summary.outcome);
                assert!(summary.energy_scale > 1.0, "{name}: {}\n{text}", summary.energy_scale);
            }
        }
    }
}

/// By how much the energy has changed that nothing accounts for, over the energy in play.
fn drift(summary: &Summary) -> f64 {
    (summary.end.conserved() - summary.start.conserved()).abs() / summary.energy_scale
}

/// Counts do not depend on observers: a run that is not watched leaves the balance as it is, and
/// one that begins later has its own start.
#[test]
fn runs_that_nobody_watches_keep_the_balance() {
    let damped = || {
        let method = IntegratorSpec::Rk4.method();
        mass(method, 0.01, [[0.0, 5.0], [0.0; 2]], "ether_drag = 2.0", "")
    };
    let plan = Plan { duration: 0.4, rate: 10.0 };
    let mut simulation = damped();
    let summary = run(&mut simulation, &plan, &mut [], &AtomicBool::new(false));
    let balance =
        simulation.diagnostics().balance.expect("losses are counted unless they are told not to be");
    let mut stepped = damped();
    advance(&mut stepped, 40);
    assert_eq!(stepped.diagnostics().balance, Some(balance));
    assert!(drift(&summary) < 1e-4, "{}", drift(&summary));
    // The state is changed by hand: the next run has a balance of its own.
    simulation.set_positions(&[1.0, 3.0]);
    let summary = run_watched(&mut simulation, 0.4, 10.0);
    let again = summary.end.balance.unwrap().ether_drag.unwrap();
    assert!(drift(&summary) < 1e-4, "{}", drift(&summary));
    assert!(again > 1.0 && again != balance.ether_drag.unwrap(), "{again}");
    // Losses that are asked for in the middle are those since then.
    let mut simulation = damped();
    simulation.count_losses(false);
    advance(&mut simulation, 40);
    assert!(simulation.diagnostics().balance.is_none());
    simulation.count_losses(true);
    let summary = run_watched(&mut simulation, 0.4, 10.0);
    assert!(drift(&summary) < 1e-4, "{}", drift(&summary));
}

/// Masses on springs that fall into a corner of two oblique walls.
fn in_a_corner(name: &str, h: f64, drag: f64) -> Simulation {
    assembled(&format!(
        "dimension = 2\ntime = {{ integrator = '{name}', step = {h:?}, duration = 1.0 }}\n\
         world = {{ ether_drag = {drag:?}, gravity = [2, -{G:?}], \
         walls = [{{ normal = [0.1, 1], offset = -0.3 }}, {{ normal = [-1, 0], offset = -1.1 }}] \
         }}\n[[body]]\n\
         mesh = {{ strand = {{ segments = 3, start = [0.2, 0.3], end = [1.0, 0.6] }} }}\n\
         springs = {{ stiffness = 400.0 }}\nmass = {{ per_vertex = 0.5 }}\n"
    ))
}

/// Masses on springs fall into a corner of two oblique walls and bounce there: what the walls give in all
/// steps is the change of momentum less the impulses of gravity and drag.
#[test]
fn walls_give_what_momentum_lacks_by_every_scheme() {
    for (method, drag) in methods_with_walls().flat_map(|m| [(m, 0.0), (m, 3.0)]) {
        let (name, h, steps) = (method.documentation.name, 1e-3, 1000);
        let mut simulation = in_a_corner(name, h, drag);
        let (mut given, before) = ([0.0; 2], simulation.positions().into_owned());
        for _ in 0..steps {
            advance(&mut simulation, 1);
            for wall in simulation.reactions() {
                (0..2).for_each(|c| given[c] += h * wall.force[c]);
            }
        }
        // Impulse of drag goes by the way: `c m (x - x_0)`.
        let mut momentum = [0.0; 2];
        for (i, v) in simulation.velocities().iter().enumerate() {
            momentum[i % 2] += 0.5 * (v + drag * (simulation.positions()[i] - before[i]));
        }
        let gravity = [2.0 * 2.0, -2.0 * G];
        assert!(given[0] < -1.0 && given[1] > 5.0, "{name}: {given:?}");
        // Velocities of symplectic Euler are half a step ahead of positions.
        let bound = match (drag, name) {
            (0.0, _) => 1e-11,
            (_, "symplectic-euler") => 10.0 * h,
            _ => 20.0 * h * h,
        };
        for c in 0..2 {
            let off = given[c] + gravity[c] - momentum[c];
            assert!(off.abs() < bound, "{name}, drag {drag}: {given:?} N s, {momentum:?}, off by {off:e}");
        }
    }
}

/// A blow is in the step in which it falls, at its place; before any step, what presses is told.
#[test]
fn a_blow_is_in_its_step_and_has_a_moment() {
    for method in methods_with_walls() {
        let name = method.documentation.name;
        let mut simulation = mass(method, 0.01, [[3.0, 0.0], [0.0, -4.0]], FLOOR, "");
        let before = &simulation.reactions()[0];
        assert_relative(before.force[1], 2.0 * G, 1e-12, name);
        advance(&mut simulation, 1);
        let blow = &simulation.reactions()[0];
        // It had 8 N s, and got 0.2 from gravity.
        assert_relative(blow.force[1], (8.0 + 0.2) / 0.01, 1e-11, name);
        assert_relative(blow.moment[2], 3.0 * (8.0 + 0.2) / 0.01, 1e-11, name);
        let checkpoint = simulation.checkpoint();
        let kept = simulation.reactions();
        advance(&mut simulation, 1);
        assert_relative(simulation.reactions()[0].force[1], 2.0 * G, 1e-11, name);
        simulation.resume(&checkpoint).unwrap();
        assert_eq!(simulation.reactions(), kept, "{name}");
    }
}

/// A mass at rest is carried whatever slows what moves, by every scheme; two oblique walls carry it together.
#[test]
fn what_lies_still_is_carried_under_any_drag() {
    let valley = "walls = [{ normal = [1, 2], offset = 0 }, { normal = [-2, 1], offset = 0 }]";
    for method in methods_with_walls() {
        for (drag, damping) in [
            (20.0, ""),
            (0.0, "damping = { mass_proportional = 30.0 }"),
            (5.0, "damping = { mass_proportional = 9.0 }"),
        ] {
            for walls in [FLOOR, valley] {
                let name = method.documentation.name;
                let world = format!("ether_drag = {drag:?}, {walls}");
                let mut simulation = mass(method, 0.02, [[0.0, 0.0], [0.0, 0.0]], &world, damping);
                for _ in 0..3 {
                    advance(&mut simulation, 1);
                    let sum = simulation.reactions().iter().map(|r| r.force[1]).sum::<f64>();
                    assert_relative(sum, 2.0 * G, 1e-12, &format!("{name}, {drag} and {damping} on {walls}"));
                }
            }
        }
    }
}

/// Walls act block by block where no losses are counted: the same motion and the same reactions, to the last
/// bit.
#[test]
fn reactions_do_not_depend_on_whether_losses_are_counted() {
    for (method, drag) in methods_with_walls().flat_map(|m| [(m, 0.0), (m, 3.0)]) {
        let name = method.documentation.name;
        let mut simulations = [true, false].map(|counts| {
            let mut simulation = in_a_corner(name, 1e-3, drag);
            simulation.count_losses(counts);
            simulation
        });
        let mut pushed = [0; 2];
        for _ in 0..1000 {
            simulations.iter_mut().for_each(|simulation| advance(simulation, 1));
            let [counted, uncounted] = &mut simulations;
            assert_eq!(counted.reactions(), uncounted.reactions(), "{name}, drag {drag}");
            assert_eq!(counted.positions(), uncounted.positions(), "{name}, drag {drag}");
            for (pushed, wall) in pushed.iter_mut().zip(counted.reactions()) {
                *pushed += u32::from(wall.force != [0.0; 3]);
            }
        }
        assert!(pushed.iter().all(|pushed| *pushed > 10), "{name}: steps in which walls push: {pushed:?}");
    }
}
