//! Where energy comes from and where it goes: what there is, less what came in, plus what was lost, stays the same to the order of the
//! scheme, whatever a scene has in it.

use pliant::assembly::UnstableStep;
use pliant::diagnostics::Balance;
use pliant::integrator::Method;
use pliant::scene::{Scene, SceneError};
use pliant::simulation::Simulation;

use crate::support::{advance, assert_relative, methods, methods_of_measurable_order, solve_to_rounding};

/// A block of 2 x 1 m in 2D, stretched at the start, in a `world`, with more `keys`.
fn block(integrator: &str, step: f64, world: &str, keys: &str) -> Simulation {
    let text = format!(
        "dimension = 2\ntime = {{ integrator = '{integrator}', step = {step:?}, duration = 1.0 }}\nworld = {{ {world} }}\n\
         [[body]]\nmesh = {{ grid = {{ cells = [4, 2], size = [2, 1] }} }}\n\
         elastic = {{ stable-neo-hookean = {{ young = 1e4, poisson = 0.3 }} }}\nmass = {{ density = 10.0 }}\n\
         position = {{ affine = {{ matrix = [[1.1, 0.0], [0.0, 0.95]] }} }}\n{keys}\n"
    );
    let scene = Scene::from_toml(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    scene.assemble(UnstableStep::Accept).map_err(SceneError::new).unwrap().simulation
}

struct Case {
    what: &'static str,
    world: &'static str,
    keys: &'static str,
    /// Parts of the balance that have to be more than 0.1 J.
    much: fn(&Balance) -> [Option<f64>; 3],
    /// The order of the balance is at most this.
    order: f64,
}

const PINNED: &str = "pin = [{ half_space = { normal = [1, 0], offset = 0 } }]";

/// Everything that brings energy in or takes it away, alone and together.
const CASES: [Case; 10] = [
    Case {
        what: "a damped bar",
        world: "gravity = [0, -9.81]",
        keys: "springs = { stiffness = 1e3 }\n\
               damping = { mass_proportional = 0.5, stiffness_proportional = 2e-3, dashpot = 3.0 }\n\
               pin = [{ half_space = { normal = [1, 0], offset = 0 } }]",
        much: |balance| [balance.damping, None, None],
        order: 4.0,
    },
    Case {
        what: "a body dropped on a wall",
        world: "gravity = [0, -9.81], walls = [{ normal = [0.1, 1], offset = -0.1 }, { normal = [-1, 0], offset = -2.3 }]",
        keys: "",
        much: |balance| [balance.walls, None, None],
        order: WITH_WALLS,
    },
    Case {
        what: "a bar shaken by gravity",
        world: "gravity = ['40 * sin(9 * t)', '-9.81 * cos(5 * t)']",
        keys: PINNED,
        much: |balance| [balance.gravity, None, None],
        order: 4.0,
    },
    Case {
        what: "a bar with ether drag",
        world: "gravity = [0, -9.81], ether_drag = 0.7",
        keys: PINNED,
        much: |balance| [balance.ether_drag, None, None],
        // At least: implicit schemes split the drag off.
        order: 2.0,
    },
    Case {
        what: "a damped bar that is moved",
        world: "gravity = ['3 * sin(5 * t)', 0]",
        keys: "damping = { strain_rate = { shear = 2.0, second = 3.0 }, mass_proportional = 0.3 }\n\
               pin = [{ half_space = { normal = [1, 0], offset = 0 }, motion = { displacement = ['0.3 * sin(4*t)', 't^2'] } }]",
        much: |balance| [balance.damping, balance.motion, None],
        order: 4.0,
    },
    Case {
        what: "a bar that is moved through the ether",
        world: "ether_drag = 2.0",
        keys: "pin = [{ half_space = { normal = [1, 0], offset = 0 }, motion = { displacement = ['2 * sin(3*t)', '-2 * t^2'] } }]",
        much: |balance| [balance.ether_drag, balance.motion, None],
        order: 2.0,
    },
    Case {
        what: "a bar under every kind of load, tied to a place",
        world: "gravity = [0, -9.81]",
        keys: "load = [{ vertices = [14], force = ['60 * cos(7*t)', '90*t'] }, { vertices = [4], force_per_vertex = [0, -5] },\n\
               { body_force = ['100 * Y * t', '-60 * cos(3*t)'] }, { half_space = { normal = [-1, 0], offset = -2 }, traction = [0, '-60 * t'] },\n\
               { half_space = { normal = [0, -1], offset = -1 }, pressure = '200 * sin(4*t)' }, { half_space = { normal = [-1, 0], offset = -2 }, pressure = 80 }]\n\
               [[attachment]]\nvertices = [0, 5]\nstiffness = 300.0\ndashpot = 9.0",
        much: |balance| [balance.loads, None, None],
        order: 4.0,
    },
    Case {
        what: "a dragged and damped body on a wall",
        world: "gravity = [0, -9.81], ether_drag = 0.7, walls = [{ normal = [0, 1], offset = -0.1 }]",
        keys: "damping = { stiffness_proportional = 1e-3 }",
        much: |balance| [balance.walls, balance.damping, None],
        order: WITH_WALLS,
    },
    Case {
        what: "a body pressed on a wall",
        world: "gravity = ['30 * t', '-9.81 - 40 * t'], walls = [{ normal = [0, 1], offset = -0.1 }]",
        keys: "load = [{ half_space = { normal = [0, -1], offset = -1 }, pressure = '300 * t' }, { force = [0, '-400 * t'] }]",
        much: |balance| [balance.walls, balance.gravity, None],
        order: WITH_WALLS,
    },
    Case {
        what: "a body moved on a wall, with everything",
        world: "gravity = [0, '-9.81 - 20 * t'], ether_drag = 0.7, walls = [{ normal = [0, 1], offset = -0.1 }, { normal = [-1, 0.1], offset = -2.2 }]",
        keys: "damping = { strain_rate = { shear = 2.0, second = 3.0 }, mass_proportional = 0.3 }\n\
               load = [{ half_space = { normal = [0, -1], offset = -1 }, pressure = '300 * t' }, { vertices = [9], force = [0, '-200 * t'] }]\n\
               pin = [{ vertices = [5], motion = { displacement = ['0.9 * t', '0.1 * sin(9*t)'] } }]\n\
               [[attachment]]\nvertices = [0]\nstiffness = 300.0\ndashpot = 9.0",
        much: |balance| [balance.walls, balance.motion, balance.damping],
        order: WITH_WALLS,
    },
];

/// Walls act at the ends of steps.
const WITH_WALLS: f64 = 2.0;

/// In weightlessness, one row of vertices meets a wall in the first step, and what moves on goes on to press
/// on it.
#[test]
fn what_a_wall_takes_is_the_energy_of_arrival() {
    let keys = "velocity = { rigid = { linear = [3.0, -2.0] } }";
    let world = "walls = [{ normal = [0, 1], offset = 0 }]";
    let mut simulation = block("velocity-verlet", 1e-7, world, keys);
    let (system, state) = (simulation.system(), simulation.state());
    let rows = state.x().chunks(2).zip(system.mass());
    let lowest: f64 = rows.filter(|(x, _)| x[1] < 0.1).map(|(_, m)| m).sum();
    simulation.step().unwrap();
    let lost = simulation.diagnostics().balance.unwrap().walls.unwrap();
    // The motion along the normal is gone; in 1e-7 s forces have not changed it.
    assert_relative(lost, 0.5 * lowest * 4.0, 1e-5, "the first step");
    advance(&mut simulation, 100);
    let later = simulation.diagnostics().balance.unwrap().walls.unwrap();
    assert_relative(later, lost, 1e-5, "what presses on a wall that it has reached loses nothing");
    simulation.state_mut();
    advance(&mut simulation, 1);
    let again = simulation.diagnostics().balance.unwrap().walls.unwrap();
    assert!(again < 1e-9 * lost, "a state that was changed by hand begins a balance of its own: {again}");
}

/// A force that goes away at once: its potential jumps, its power is finite.
#[test]
fn a_load_that_jumps_leaves_the_balance_closed() {
    let keys = format!("{PINNED}\nload = [{{ force = [0, '-200 * (t < 0.2)'] }}]");
    let residual = |steps: usize| {
        let mut simulation = block("rk4", 0.4 / steps as f64, "", &keys);
        let start = simulation.diagnostics();
        (0..steps).for_each(|_| simulation.step().unwrap());
        let end = simulation.diagnostics();
        assert!(end.balance.unwrap().loads.unwrap() > 1.0, "{end:?}");
        (end.conserved() - start.conserved()).abs()
    };
    // One order in the step of the jump.
    let (coarse, fine) = (residual(400), residual(1600));
    assert!(coarse < 1.0 && coarse / fine > 3.0, "{coarse:e} {fine:e}");
}

/// A mass that is moved through the ether at a steady pace: what moves it does the work of the drag, and
/// nothing else.
#[test]
fn what_moves_a_mass_through_the_ether_does_the_work_of_the_drag() {
    let (mass, drag, speed) = (3.0, 0.7, 2.0);
    for method in methods() {
        let name = method.documentation.name;
        let text = format!(
            "dimension = 2\ntime = {{ integrator = '{name}', step = 0.01, duration = 1.0 }}\nworld = {{ ether_drag = {drag:?} }}\n\
             [[body]]\nmesh = {{ inline = {{ points = [[0, 0], [1, 0]] }} }}\nmass = {{ per_vertex = {mass:?} }}\n\
             pin = [{{ vertices = [0], motion = {{ velocity = [0, {speed:?}] }} }}]\n"
        );
        let scene = Scene::from_toml(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let mut simulation =
            scene.assemble(UnstableStep::Accept).map_err(SceneError::new).unwrap().simulation;
        advance(&mut simulation, 50);
        let balance = simulation.diagnostics().balance.unwrap();
        let work = drag * mass * speed * speed * 0.5;
        assert_relative(balance.motion.unwrap(), work, 1e-12, name);
        assert_relative(balance.ether_drag.unwrap(), work, 1e-12, name);
        // And pulls with its force.
        assert_relative(simulation.reactions()[0].force[1], drag * mass * speed, 1e-12, name);
    }
}

/// What nobody asks for is not computed: no ledger of losses.
#[test]
fn losses_are_counted_only_where_somebody_asks() {
    let world = "ether_drag = 0.5, walls = [{ normal = [0, 1], offset = -0.1 }]";
    for asked in [false, true] {
        let mut simulation = block("rk4", 1e-4, world, "damping = { mass_proportional = 0.5 }");
        simulation.count_losses(asked);
        simulation.step().unwrap();
        let balance = simulation.diagnostics().balance;
        assert_eq!(balance.is_some_and(|b| b.damping.or(b.ether_drag).or(b.walls).is_some()), asked);
    }
}

/// Energy in = energy out: by every scheme, with everything that brings energy in or takes it away.
#[test]
#[ignore = "ten cases by every scheme take minutes, and the cases with walls are still to be confirmed for schemes that solve"]
fn the_balance_of_energy_closes_to_the_order_of_every_scheme_whatever_takes_energy() {
    let mut failures = vec![];
    for case in &CASES {
        // With order 15, rounding would be measured.
        for method in methods_of_measurable_order() {
            failures.extend(wrong_order(case, method));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// What the balance is off by after 0.4 s.
fn residual(case: &Case, method: Method, steps: usize) -> f64 {
    let mut simulation = block(method.documentation.name, 0.4 / steps as f64, case.world, case.keys);
    solve_to_rounding(&mut simulation);
    let start = simulation.diagnostics();
    advance(&mut simulation, steps);
    let end = simulation.diagnostics();
    for part in (case.much)(&end.balance.unwrap()).into_iter().flatten() {
        assert!(part.abs() > 0.1, "{}: {end:?}", case.what);
    }
    (end.conserved() - start.conserved()).abs()
}

/// The order of the residual, if it is not that of the scheme.
fn wrong_order(case: &Case, method: Method) -> Option<String> {
    let documentation = method.documentation;
    let order = f64::from(documentation.order).min(case.order);
    // Where in a step a vertex arrives at a wall depends on the step, and with it the residual: it is the
    // mean of some steps that has an order.
    let has_walls = case.world.contains("walls");
    let (parts, factor): (&[usize], usize) = if has_walls { (&[16, 18, 20, 22], 4) } else { (&[16], 2) };
    let steps = match (documentation.order, documentation.solves, has_walls) {
        (1, 0, false) => 4000,
        (2 | 3, 0, false) => 2000,
        (_, 0, false) => 1000,
        // Forward Euler gains energy on its way.
        (1, 0, true) => 2048,
        (1, ..) => 512,
        (_, 0, true) => 256,
        (2, _, false) => 400,
        _ => 128,
    };
    let mean = |steps: usize| {
        let residuals = parts.iter().map(|part| residual(case, method, part * steps / 16));
        (residuals.map(|residual| residual * residual).sum::<f64>() / parts.len() as f64).sqrt()
    };
    let (coarse, fine) = (mean(steps), mean(factor * steps));
    let measured = (coarse / fine).log2() / (factor as f64).log2();
    // The energy of some schemes is one order better than their positions; a NaN does not agree.
    let agrees = measured > order - 0.3;
    (!agrees).then(|| {
        let name = documentation.name;
        format!("{}, {name}: order {measured:.3} of {order}, {coarse:e} J, {fine:e} J", case.what)
    })
}
