//! Prescribed motion through contact: what is moved takes along what is in its way, and never passes through.

/// A plate above a block, pushed down by `depth` within one step.
fn pressed(depth: f64) -> String {
    format!(
        "dimension = 2\ntime = {{ integrator = 'implicit-euler', step = 0.01, duration = 0.01 }}\n\
         contact = {{ distance = 1e-3 }}\n\
         [[body]]\nname = 'block'\nmesh = {{ grid = {{ cells = [4, 4], size = [0.2, 0.2], origin = [0, \
         0.001] }} }}\n\
         elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n\
         [[obstacle]]\nname = 'floor'\nshape = {{ half_space = {{ normal = [0, 1], offset = 0 }} }}\n\
         [[obstacle]]\nname = 'plate'\nshape = {{ box = {{ min = [-0.1, 0.202], max = [0.3, 0.25] }} }}\n\
         motion = {{ velocity = [0, {}] }}\n",
        -depth / 0.01
    )
}

#[test]
fn a_plate_pushed_into_a_block_in_one_step_arrives() {
    for depth in [0.02, 0.1, 0.15] {
        let mut simulation = super::assembled(&pressed(depth)).simulation;
        super::advance(&mut simulation, 1);
        let x = simulation.positions();
        let top = x.chunks(2).take(25).map(|x| x[1]).fold(f64::MIN, f64::max);
        let bottom = x.chunks(2).take(25).map(|x| x[1]).fold(f64::MAX, f64::min);
        // The first vertex of the plate after the block and the floor.
        let plate = x.chunks(2).skip(26).map(|x| x[1]).fold(f64::MAX, f64::min);
        assert!((plate - (0.202 - depth)).abs() < 1e-12, "depth {depth}: the plate is at {plate}");
        let limited = simulation.work().solver.unwrap().longest_limited;
        assert!(limited > 0, "the block cut no way short");
        assert!(bottom > 0.0 && top < plate, "depth {depth}: {bottom} to {top} below {plate}");
    }
}

#[test]
fn a_plate_pushed_through_a_floor_is_an_error_with_names() {
    let mut simulation = super::assembled(&pressed(0.3)).simulation;
    let error = simulation.step().unwrap_err().to_string();
    let told = [
        "obstructed",
        "the motion of pin `plate/motion` is blocked",
        "of `block` and edge 0-2 of `plate` block",
    ];
    for says in told.into_iter().chain(["and behind them vertex ", "of `block` and `floor`"]) {
        assert!(error.contains(says), "{says:?} is not in {error}");
    }
    // Nothing has moved.
    let top = simulation.positions().chunks(2).take(25).map(|x| x[1]).fold(f64::MIN, f64::max);
    assert!((top - 0.201).abs() < 1e-12, "{top}");
}

/// Contacts of negative weight take away what points on several edges count twice. Projected Hessians are
/// without them: unless the bar's part of the matrix is so as well, faces follow it by a quarter of its way.
#[test]
fn a_bar_pushed_against_elements_of_second_order_takes_them_along() {
    let scene = "dimension = 3\ntime = { integrator = 'implicit-euler', step = 0.005, duration = 0.5 }\n\
         world = { gravity = [0, 0, -9.81] }\ncontact = {}\n\
         [[body]]\nname = 'block'\norder = 2\n\
         mesh = { grid = { cells = [2, 2, 2], size = [0.1, 0.1, 0.1], origin = [0, 0, 0.002] } }\n\
         elastic = { neo-hookean = { young = 1e5, poisson = 0.45 } }\nmass = { density = 1000 }\n\
         [[obstacle]]\nshape = { half_space = { normal = [0, 0, 1], offset = 0 } }\n\
         [[obstacle]]\nname = 'bar'\nmotion = { velocity = [-0.1, 0, 0] }\n\
         shape = { capsule = { axis = [[0.15, -0.1, 0.05], [0.15, 0.2, 0.05]], radius = 0.02 } }\n";
    let mut simulation = super::assembled(scene).simulation;
    super::advance(&mut simulation, 100);
    let of_block = |values: &[f64], k: usize| values.chunks(3).take(125).map(|x| x[k]).collect::<Vec<_>>();
    let x = of_block(&simulation.positions(), 0);
    let farthest = x.iter().copied().fold(f64::MIN, f64::max);
    // The bar's axis is at 0.1 m; it pushes the faces, at first below their middle.
    assert!(farthest < 0.083, "{farthest}");
    let speed = of_block(&simulation.velocities(), 0).iter().sum::<f64>() / 125.0;
    assert!((-0.2..-0.08).contains(&speed), "{speed}");
    let work = simulation.work().solver.unwrap();
    assert!(work.longest_limited < 10, "{work:?}");
}

/// A box lifts a soft cube whose vertices are over the diagonal of its face, where slopes of forces jump:
/// Newton's method went to and fro over that, and the face of the cube followed the box too slowly.
#[test]
fn a_box_lifts_a_cube_that_is_aligned_with_its_edges() {
    for friction in ["0", "0.3"] {
        let scene = format!(
            "dimension = 3\ntime = {{ integrator = 'implicit-euler', step = 0.01, duration = 0.6 }}\n\
             world = {{ gravity = [0, 0, -9.81] }}\ncontact = {{ friction = {friction} }}\n\
             [[body]]\n\
             mesh = {{ grid = {{ cells = [3, 3, 3], size = [0.2, 0.2, 0.2], origin = [0, 0, 0.02] }} }}\n\
             elastic = {{ neo-hookean = {{ young = 5e4, poisson = 0.4 }} }}\nmass = {{ density = 1000 }}\n\
             [[obstacle]]\nshape = {{ box = {{ min = [-0.1, -0.1, -0.2], max = [0.3, 0.3, 0] }} }}\n\
             motion = {{ velocity = [0, 0, 0.3] }}\n"
        );
        let mut simulation = super::assembled(&scene).simulation;
        super::advance(&mut simulation, 60);
        let heights: Vec<f64> = simulation.positions().chunks(3).take(64).map(|x| x[2]).collect();
        let lowest = heights.iter().copied().fold(f64::MAX, f64::min);
        let velocities = simulation.velocities();
        let speed = velocities.chunks(3).take(64).map(|v| v[2]).sum::<f64>() / 64.0;
        // The top of the box is at 0.18 m.
        assert!(lowest > 0.18 && lowest < 0.25, "{lowest}");
        assert!((-0.7..1.0).contains(&speed), "{speed}");
    }
}

/// Pins of a body that is not in their way itself: pressed onto a floor from above, and driven into it.
#[test]
fn a_pin_driven_into_a_floor_is_named() {
    let scene = |pin: &str| {
        format!(
            "dimension = 2\ntime = {{ integrator = 'implicit-euler', step = 0.01, duration = 1.0 }}\n\
             contact = {{ distance = 1e-3 }}\n\
             [[body]]\nname = 'block'\nmesh = {{ grid = {{ cells = [4, 4], size = [0.2, 0.2], origin = [0, \
             0.01] }} }}\n\
             elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n\
             pin = [{{ {pin}, motion = {{ velocity = [0, -1] }} }}]\n\
             [[obstacle]]\nname = 'floor'\nshape = {{ half_space = {{ normal = [0, 1], offset = 0 }} }}\n"
        )
    };
    let end = |pin: &str| {
        let mut simulation = super::assembled(&scene(pin)).simulation;
        (0..40).find_map(|_| simulation.step().err()).expect("nothing gives way").to_string()
    };
    let pressed = end("name = 'head', half_space = { normal = [0, -1], offset = -0.2099 }");
    for says in ["the motion of pin `block/head` is blocked", "and behind them vertex", "and `floor`"] {
        assert!(pressed.contains(says), "{says:?} is not in {pressed}");
    }
    // Into the floor, and to where no gap is left.
    for velocity in ["[0, -3]", "[0, -1]"] {
        let foot = "name = 'foot', half_space = { normal = [0, 1], offset = 0.011 }";
        let text = scene(foot).replace("[0, -1]", velocity);
        let driven = super::assembled(&text).simulation.step().unwrap_err().to_string();
        let told =
            ["the motion of pin `block/foot` is blocked: vertex ", "of `block` and `floor` block each other"];
        for says in told {
            assert!(driven.contains(says), "{velocity}: {says:?} is not in {driven}");
        }
        assert!(!driven.contains("behind"), "{driven}");
    }
}

/// A conveyor: a floor that slides takes what lies on it along, up to its own speed.
#[test]
fn a_sliding_floor_takes_a_block_along() {
    let time =
        "{ integrator = 'implicit-euler', step = 0.01, duration = 1.0, solver = { tolerance = 1e-12 } }";
    let contact = "{ distance = 1e-3, stiffness = 1e5, friction = 0.5, threshold_speed = 1e-3 }";
    let mut simulation = super::block_on_floor(time, contact, "", "motion = { velocity = [1, 0] }");
    let speed = |simulation: &pliant::simulation::Simulation| {
        simulation.velocities().chunks(2).take(12).map(|v| v[0]).sum::<f64>() / 12.0
    };
    super::advance(&mut simulation, 10);
    // mu g t on the way up, less what the shear of the block takes first.
    assert!((speed(&simulation) - 0.5 * 9.81 * 0.1).abs() < 0.01, "{}", speed(&simulation));
    super::advance(&mut simulation, 40);
    assert!((speed(&simulation) - 1.0).abs() < 2e-3, "{}", speed(&simulation));
    let balance = simulation.diagnostics().balance.unwrap();
    // The floor's work is the block's kinetic energy and the same again in friction: at 1 m/s, the momentum.
    let (system, v) = (simulation.system(), simulation.state().v());
    let free = (0..system.mass().len()).filter(|vertex| !system.is_pinned(*vertex));
    let momentum: f64 = free.map(|vertex| system.mass()[vertex] * v[2 * vertex]).sum();
    let work = balance.motion.unwrap();
    assert!((work - momentum).abs() < 1e-6 * momentum, "{work} J for {momentum} N s");
    assert!(work > balance.friction.unwrap(), "{balance:?}");
    assert_eq!(balance.damping, None);
}

/// A cube that sticks to a table that turns stays where it is on it: friction sees where the table goes in a
/// step, as it sees where the cube goes. By the speed of the table at the end of the step each of them leads
/// inwards by `r (omega h)^2 / 2`.
#[test]
fn what_sticks_to_a_turning_table_stays_on_its_circle() {
    let scene = "dimension = 3\ntime = { integrator = 'implicit-euler', step = 0.025, duration = 4 }\n\
         world = { gravity = [0, -9.8, 0] }\ncontact = { distance = 1e-3, friction = 0.5 }\n\
         [[body]]\nname = 'cube'\n\
         mesh = { grid = { cells = [1, 1, 1], size = [0.25, 0.25, 0.25], origin = [1.375, 0.0011, -0.125] } }\n\
         elastic = { fixed-corotated = { young = 1e8, poisson = 0.3 } }\nmass = { density = 1000 }\n\
         velocity = { rigid = { linear = [0, 0, -1.1781], angular = [0, 0.7854, 0] } }\n\
         [[obstacle]]\nname = 'table'\nshape = { box = { min = [-2, -0.1, -2], max = [2, 0, 2] } }\n\
         motion = { rotation = { axis = [0, 1, 0], point = [0, 0, 0], speed = '45 deg/s' } }\n";
    let mut simulation = super::assembled(scene).simulation;
    let radius = |simulation: &pliant::simulation::Simulation| {
        let x = simulation.positions();
        let mean = |k: usize| x.chunks(3).take(8).map(|x| x[k]).sum::<f64>() / 8.0;
        mean(0).hypot(mean(2))
    };
    let start = radius(&simulation);
    super::advance(&mut simulation, 160);
    // A regularised law creeps at a part of its threshold of speed.
    let moved = radius(&simulation) - start;
    assert!(moved.abs() < 2e-3, "{moved}");
    // What the contacts report is the friction of the step: a quarter of its bound turns the cube.
    let contacts = simulation.contacts();
    let sum = |of: &dyn Fn(&pliant::energy::SurfaceContact) -> f64| contacts.iter().map(of).sum::<f64>();
    let normal = sum(&|contact| contact.force);
    let friction = sum(&|contact| contact.friction[0]).hypot(sum(&|contact| contact.friction[2]));
    assert!(friction < 0.5 * 0.5 * normal, "{friction} of {normal}");
}
