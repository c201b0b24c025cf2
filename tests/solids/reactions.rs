//! Forces that pins carry.

use pliant::simulation::Simulation;
use pliant_scene::assembly::UnstableStep;
use pliant_scene::{Scene, SceneError};

fn simulation(text: &str) -> Simulation {
    let scene = Scene::from_toml(text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    scene.assemble(UnstableStep::Refuse).map_err(SceneError::new).unwrap().simulation
}

// D3: the torque that holds a bar twisted by 30 and by 90 degrees, from an independent code.
#[test]
fn the_torque_of_a_twisted_bar_is_the_reference() {
    for (degrees, torque) in [(30, 1654.38), (90, 4967.04)] {
        let mut simulation = simulation(&format!(
            "dimension = 3\ntime = {{ integrator = 'symplectic-euler', step = 0.02, duration = 20.0 }}\n\
             world = {{ ether_drag = 4.0 }}\n[[body]]\n\
             mesh = {{ grid = {{ cells = [2, 2, 8], size = [1, 1, 4], origin = [-0.5, -0.5, 0] }} }}\n\
             elastic = {{ stable-neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = \
             1000.0 }}\n\
             pin = [{{ name = 'foot', half_space = {{ normal = [0, 0, 1], offset = 0 }} }},\n\
             {{ name = 'head', half_space = {{ normal = [0, 0, -1], offset = -4 }}, motion = {{ rotation = \
             {{ axis = [0, 0, 1], angle = '{degrees} * pi/180 * smoothstep(0, 4, t)' }} }} }}]\n"
        ));
        (0..1000).for_each(|_| simulation.step().unwrap());
        let [foot, head] = &simulation.reactions()[..] else { panic!("two pins") };
        assert_eq!((foot.name.as_str(), head.name.as_str()), ("body0/foot", "body0/head"));
        assert!((head.moment[2] / torque - 1.0).abs() < 1e-4, "{degrees}: {head:?}");
        // Nothing else pulls at the bar: the pins balance each other.
        for c in 0..3 {
            assert!((foot.force[c] + head.force[c]).abs() < 1e-4 * torque, "{foot:?} {head:?}");
        }
        assert!((foot.moment[2] + head.moment[2]).abs() < 1e-4 * torque, "{foot:?} {head:?}");
    }
}

/// Newton's second law of the whole body, at any time of a motion in which everything acts: reactions,
/// gravity, a load and drag add up to the rate of momentum, whose central differences are right to the
/// square of the step.
#[test]
fn reactions_are_what_is_left_of_the_rate_of_momentum() {
    let error = |h: f64| {
        let mut simulation = simulation(&format!(
            "dimension = 2\ntime = {{ integrator = 'rk4', step = {h:?}, duration = 1.0 }}\n\
             world = {{ gravity = [0, -9.8], ether_drag = 0.7 }}\n[[body]]\n\
             mesh = {{ grid = {{ cells = [4, 2], size = [2, 1] }} }}\n\
             elastic = {{ neo-hookean = {{ young = 1e4, poisson = 0.3 }} }}\nmass = {{ density = 10.0 }}\n\
             load = [{{ force = [30, 0] }}]\n\
             pin = [{{ half_space = {{ normal = [1, 0], offset = 0 }}, motion = {{ displacement = ['0.1 * \
             sin(6*t)', '0.05 * t^2'], rotation = {{ point = [0, 0.5], angle = '0.2 * sin(4*t)' }} }} }}, \
             {{ vertices = [14], axes = ['y'] }}]\n"
        ));
        let steps = (0.4 / h).round() as usize;
        let step = |simulation: &mut Simulation| {
            simulation.step().unwrap();
            simulation.diagnostics().linear_momentum
        };
        let before = (1..steps).map(|_| step(&mut simulation)).last().unwrap();
        let now = step(&mut simulation);
        let mut force = [30.0, -9.8 * 20.0];
        let reactions = simulation.reactions();
        assert!(reactions.iter().all(|r| r.force.iter().any(|f| f.abs() > 1.0)), "{reactions:?}");
        assert_eq!(reactions[1].force[0], 0.0);
        for c in 0..2 {
            force[c] += reactions.iter().map(|r| r.force[c]).sum::<f64>() - 0.7 * now[c];
        }
        let after = step(&mut simulation);
        (0..2).map(|c| ((after[c] - before[c]) / (2.0 * h) - force[c]).abs()).fold(0.0, f64::max)
    };
    let (coarse, fine) = (error(1e-3), error(5e-4));
    let order = (coarse / fine).log2();
    assert!((order - 2.0).abs() < 0.2 && fine < 0.1, "{coarse} {fine}: order {order}");
}

/// A bar that stands on the plane z = 0, pulled at one corner of its top in a direction along none of the
/// axes: in equilibrium its foot carries minus the load and minus its moment about the middle of the foot,
/// each to the tolerance of the solver, as deformed.
#[test]
fn the_moments_of_a_pin_about_all_three_axes_balance_that_of_the_load() {
    let force = [30.0, -50.0, 20.0];
    let mut simulation = simulation(&format!(
        "dimension = 3\ntime = {{ integrator = 'quasi-static', step = 1.0, duration = 1.0, solver = {{ \
         tolerance = 1e-12 }} }}\n[[body]]\n\
         mesh = {{ grid = {{ cells = [1, 1, 3], size = [1, 1, 3] }} }}\n\
         elastic = {{ stable-neo-hookean = {{ young = 1e4, poisson = 0.3 }} }}\nmass = {{ density = 10.0 }}\n\
         load = [{{ vertices = [15], force = {force:?} }}]\n\
         pin = [{{ half_space = {{ normal = [0, 0, 1], offset = 0 }} }}]\n"
    ));
    simulation.step().unwrap();
    let [foot] = &simulation.reactions()[..] else { panic!("one pin") };
    let x = simulation.positions();
    let arm = [0, 1, 2].map(|c| x[3 * 15 + c] - foot.about[c]);
    assert!(arm[2] > 2.5 && (foot.about[0] - 0.5).abs() < 1e-15 && foot.about[2] == 0.0, "{arm:?} {foot:?}");
    let moment = [0, 1, 2].map(|c| {
        let (a, b) = ((c + 1) % 3, (c + 2) % 3);
        arm[a] * force[b] - arm[b] * force[a]
    });
    for c in 0..3 {
        assert!(moment[c].abs() > 1.0, "{moment:?}");
        assert!((foot.force[c] + force[c]).abs() < 1e-6, "{foot:?}");
        assert!((foot.moment[c] + moment[c]).abs() < 1e-6, "about {c}: {foot:?} {moment:?}");
    }
}
