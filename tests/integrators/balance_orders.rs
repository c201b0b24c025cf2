//! Energy in = energy out, by every scheme, with everything that brings energy in or takes it away.

use pliant::diagnostics::Balance;
use pliant::integrator::Method;

use super::balance::{PINNED, block};
use crate::support::{advance, methods_of_measurable_order, solve_to_rounding};

struct Case {
    world: &'static str,
    keys: &'static str,
    /// Parts of the balance that have to be more than 0.1 J.
    much: fn(&Balance) -> [Option<f64>; 3],
    /// The order of the balance is at most this.
    order: f64,
}

/// Walls act at the ends of steps.
const WITH_WALLS: f64 = 2.0;

/// Integrals of what flows are of fourth order.
const WITHOUT: f64 = 4.0;

/// One test for each case.
macro_rules! cases {
    ($($(#[$about:meta])* $name:ident: $case:expr,)+) => {
        $(
            $(#[$about])*
            #[test]
            fn $name() {
                closes(&$case);
            }
        )+
    };
}

cases! {
    damped_bar: Case {
        world: "gravity = [0, -9.81]",
        keys: "springs = { stiffness = 1e3 }\n\
               damping = { mass_proportional = 0.5, stiffness_proportional = 2e-3, dashpot = 3.0 }\n\
               pin = [{ half_space = { normal = [1, 0], offset = 0 } }]",
        much: |balance| [balance.damping, None, None],
        order: WITHOUT,
    },
    body_dropped_on_walls: Case {
        world: "gravity = [0, -9.81], walls = [{ normal = [0.1, 1], offset = -0.1 }, { normal = [-1, 0], \
                offset = -2.3 }]",
        keys: "",
        much: |balance| [balance.walls, None, None],
        order: WITH_WALLS,
    },
    bar_shaken_by_gravity: Case {
        world: "gravity = ['40 * sin(9 * t)', '-9.81 * cos(5 * t)']",
        keys: PINNED,
        much: |balance| [balance.gravity, None, None],
        order: WITHOUT,
    },
    bar_with_ether_drag: Case {
        world: "gravity = [0, -9.81], ether_drag = 0.7",
        keys: PINNED,
        much: |balance| [balance.ether_drag, None, None],
        order: WITHOUT,
    },
    damped_bar_that_is_moved: Case {
        world: "gravity = ['3 * sin(5 * t)', 0]",
        keys: "damping = { strain_rate = { shear = 2.0, second = 3.0 }, mass_proportional = 0.3 }\n\
               pin = [{ half_space = { normal = [1, 0], offset = 0 }, motion = { displacement = ['0.3 * \
               sin(4*t)', 't^2'] } }]",
        much: |balance| [balance.damping, balance.motion, None],
        order: WITHOUT,
    },
    bar_moved_through_the_ether: Case {
        world: "ether_drag = 2.0",
        keys: "pin = [{ half_space = { normal = [1, 0], offset = 0 }, motion = { displacement = ['2 * \
               sin(3*t)', '-2 * t^2'] } }]",
        much: |balance| [balance.ether_drag, balance.motion, None],
        order: WITHOUT,
    },
    bar_under_every_kind_of_load: Case {
        world: "gravity = [0, -9.81]",
        keys: "load = [{ vertices = [5], force = ['60 * cos(7*t)', '90*t'] }, { vertices = [2], \
               force_per_vertex = [0, -5] },\n\
               { body_force = ['100 * Y * t', '-60 * cos(3*t)'] }, { half_space = { normal = [-1, 0], \
               offset = -2 }, traction = [0, '-60 * t'] },\n\
               { half_space = { normal = [0, -1], offset = -1 }, pressure = '200 * sin(4*t)' }, { \
               half_space = { normal = [-1, 0], offset = -2 }, pressure = 80 }]\n\
               [[attachment]]\nvertices = [0, 3]\nstiffness = 300.0\ndashpot = 9.0",
        much: |balance| [balance.loads, None, None],
        order: WITHOUT,
    },
    bar_with_muscles: Case {
        world: "gravity = [0, -9.81]",
        keys: "pin = [{ half_space = { normal = [1, 0], offset = 0 } }]\n\
               muscle = [{ fibre = { direction = [1, 'X/4'] }, tension = '900 * (1 + Y) * sin(6*t)' },\n\
               { fibre = { direction = [0, 1] }, tension = 300 }]",
        much: |balance| [balance.loads, None, None],
        order: WITHOUT,
    },
    dragged_and_damped_body_on_a_wall: Case {
        world: "gravity = [0, -9.81], ether_drag = 0.7, walls = [{ normal = [0, 1], offset = -0.1 }]",
        keys: "damping = { stiffness_proportional = 1e-3 }",
        much: |balance| [balance.walls, balance.damping, None],
        order: WITH_WALLS,
    },
    body_pressed_on_a_wall: Case {
        world: "gravity = ['30 * t', '-9.81 - 40 * t'], walls = [{ normal = [0, 1], offset = -0.1 }]",
        keys: "load = [{ half_space = { normal = [0, -1], offset = -1 }, pressure = '300 * t' }, { force = \
               [0, '-400 * t'] }]",
        much: |balance| [balance.walls, balance.gravity, None],
        order: WITH_WALLS,
    },
    body_moved_on_walls_with_everything: Case {
        world: "gravity = [0, '-9.81 - 20 * t'], ether_drag = 0.7, walls = [{ normal = [0, 1], offset = \
                -0.1 }, { normal = [-1, 0.1], offset = -2.2 }]",
        keys: "damping = { strain_rate = { shear = 2.0, second = 3.0 }, mass_proportional = 0.3 }\n\
               load = [{ half_space = { normal = [0, -1], offset = -1 }, pressure = '300 * t' }, { vertices \
               = [2], force = [0, '-200 * t'] }]\n\
               pin = [{ vertices = [3], motion = { displacement = ['0.9 * t', '0.1 * sin(9*t)'] } }]\n\
               [[attachment]]\nvertices = [0]\nstiffness = 300.0\ndashpot = 9.0",
        much: |balance| [balance.walls, balance.motion, balance.damping],
        order: WITH_WALLS,
    },
}

/// Fails unless the balance of `case` closes to the order of every scheme. With order 15, rounding would be
/// measured.
fn closes(case: &Case) {
    let failures: Vec<String> =
        methods_of_measurable_order().filter_map(|method| wrong_order(case, method)).collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Energy that the balance is off by on the way to 0.4 s, root mean square [J]: at a single time, errors of
/// some sizes of the step cancel.
fn residual(case: &Case, method: Method, steps: usize) -> f64 {
    let mut simulation = block(method.documentation.name, 0.4 / steps as f64, case.world, case.keys);
    solve_to_rounding(&mut simulation);
    let start = simulation.diagnostics();
    let mut square = 0.0;
    for look in 0..LOOKS {
        advance(&mut simulation, steps * (look + 1) / LOOKS - steps * look / LOOKS);
        square += (simulation.diagnostics().conserved() - start.conserved()).powi(2);
    }
    let end = simulation.diagnostics();
    for part in (case.much)(&end.balance.unwrap()).into_iter().flatten() {
        assert!(part.abs() > 0.1, "{end:?}");
    }
    (square / LOOKS as f64).sqrt()
}

/// How often a run is looked at.
const LOOKS: usize = 16;

/// The order of the residual, if it is not that of the scheme.
///
/// Errors of several orders may cancel in steps of one size, or be of another order still in large ones: of
/// two large sizes, one gives the order.
fn wrong_order(case: &Case, method: Method) -> Option<String> {
    let documentation = method.documentation;
    let order = f64::from(documentation.order).min(case.order);
    // Where in a step a vertex arrives at a wall depends on the step, and with it the residual: it is the
    // mean of some steps that has an order.
    let has_walls = case.world.contains("walls");
    let parts: &[usize] = if has_walls { &[16, 18, 20, 22] } else { &[16] };
    let mean = |steps: usize| {
        let residuals = parts.iter().map(|part| residual(case, method, part * steps / 16));
        (residuals.map(|residual| residual * residual).sum::<f64>() / parts.len() as f64).sqrt()
    };
    let (coarse, fine) = match (documentation.order, has_walls) {
        (1, _) | (2, false) => ([128, 64], 1024),
        _ => ([64, 128], 512),
    };
    let least = mean(fine);
    let measured = |steps: usize| (mean(steps) / least).log2() / (fine as f64 / steps as f64).log2();
    // Means of four arrivals differ by a factor of two between them: a third of an order over a factor of
    // eight. The energy of some schemes is one order better than their positions; a NaN does not agree.
    let enough = order - if has_walls { 0.5 } else { 0.3 };
    let agrees = coarse.into_iter().any(|steps| measured(steps) > enough);
    (!agrees).then(|| {
        let (name, orders) = (documentation.name, coarse.map(measured));
        format!("{name}: order {orders:.3?} of {order}, {least:e} J in {fine} steps")
    })
}
