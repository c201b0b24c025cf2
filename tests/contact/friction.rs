//! Friction: what sticks creeps at the speed that the law says, what slides stops where it should.

use super::particle::FallingParticle;
use pliant::integrator::IntegratorSpec;

/// On an incline of tan(theta) = 1/2, in its own axes.
fn on_incline(friction: f64) -> FallingParticle {
    let (sin, cos) = (1.0 / 5f64.sqrt(), 2.0 / 5f64.sqrt());
    FallingParticle {
        mass: 1.0,
        stiffness: 1000.0,
        reach: 0.01,
        gravity: [9.81 * sin, -9.81 * cos],
        height: 0.0099,
        velocity: [0.0, 0.0],
        friction,
        threshold: 1e-3,
    }
}

/// A load below the limit of friction by the ratio `r` creeps at `e (1 - sqrt(1 - r))`, exactly.
#[test]
fn what_sticks_creeps_at_the_speed_of_the_law() {
    for (mu, speed) in
        [(0.501, 9.55323295e-4), (0.51, 8.59971992e-4), (0.6, 5.91751710e-4), (1.0, 2.92893219e-4)]
    {
        let mut simulation = on_incline(mu).simulation(&IntegratorSpec::ImplicitEuler, 0.01);
        super::advance(&mut simulation, 3000);
        let found = simulation.state().v()[0];
        assert!((found - speed).abs() < 1e-10, "mu {mu}: {found:e}, not {speed:e}");
        assert_eq!(simulation.work().solver.unwrap().unsettled, 0, "mu {mu}");
    }
}

/// An incline of 1 in 2 holds with a coefficient a ten-thousandth above one half, and lets go as far below.
#[test]
fn friction_holds_from_the_slope_of_the_incline_on() {
    let speed_after = |mu: f64| {
        let mut simulation = on_incline(mu).simulation(&IntegratorSpec::ImplicitEuler, 0.01);
        super::advance(&mut simulation, 3000);
        simulation.state().v()[0]
    };
    let (e, normal) = (1e-3, 9.81 * 2.0 / 5f64.sqrt());
    let creeps = e * (1.0 - (1.0 - 0.5 / 0.5001f64).sqrt());
    let found = speed_after(0.5001);
    assert!((found - creeps).abs() < 1e-10, "{found:e}, not {creeps:e}");
    // What is left of its weight speeds it up, from the creep on.
    let found = speed_after(0.4999);
    let slides = 1e-4 * normal * 30.0;
    assert!(found > slides && found < slides + 2.0 * e, "{found}, not {slides}");
}

/// Below the threshold it slides: `v' = v + h (g sin - mu g cos f1(v'))` of a rigid particle.
#[test]
fn what_slides_follows_the_recursion_of_a_rigid_particle() {
    let (sin, cos) = (1.0 / 5f64.sqrt(), 2.0 / 5f64.sqrt());
    let start = on_incline(0.49);
    // From where the layer carries it, so that the normal force is the weight's part from the beginning.
    let mut settled = FallingParticle { friction: 0.0, gravity: [0.0, start.gravity[1]], ..on_incline(0.0) }
        .simulation(&IntegratorSpec::QuasiStatic, 0.1);
    super::advance(&mut settled, 1);
    let height = settled.state().x()[1];
    let mut simulation = FallingParticle { height, ..start }.simulation(&IntegratorSpec::ImplicitEuler, 0.01);
    let (mut v, h, e) = (0.0f64, 0.01, 1e-3f64);
    for step in 0..100 {
        // By bisection: the right side falls with v'.
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..200 {
            let mid = 0.5 * (low + high);
            let s = (mid / e).min(1.0);
            let right = v + h * 9.81 * (sin - 0.49 * cos * s * (2.0 - s));
            if mid < right { low = mid } else { high = mid }
        }
        v = 0.5 * (low + high);
        super::advance(&mut simulation, 1);
        let found = simulation.state().v()[0];
        assert!((found - v).abs() < 1e-10, "step {step}: {found}, not {v}");
    }
}

/// Friction acts in the step in which something lands, where nothing touched before: what the floor takes
/// from the speed along it is `mu` times what it takes from the fall, in that step and in all others. The
/// balance has the work of that force, along the way of each step.
#[test]
fn what_lands_is_rubbed_in_the_same_step() {
    let (h, mu) = (0.01, 0.3);
    let falls = FallingParticle {
        gravity: [0.0, -9.81],
        height: 0.03,
        velocity: [5.0, -1.0],
        friction: mu,
        ..on_incline(mu)
    };
    let mut simulation = falls.simulation(&IntegratorSpec::ImplicitEuler, h);
    let (mut pushed, mut work) = (0, 0.0);
    for step in 0..20 {
        let (before, x) = (simulation.state().v().to_vec(), simulation.state().x()[0]);
        super::advance(&mut simulation, 1);
        let v = simulation.state().v();
        work += falls.mass / h * (before[0] - v[0]) * (simulation.state().x()[0] - x);
        let normal = v[1] - before[1] + 9.81 * h;
        let along = before[0] - v[0];
        assert!((along - mu * normal).abs() < 1e-10, "step {step}: {along} m/s for {normal} m/s");
        pushed += usize::from(normal > 0.1);
    }
    assert!(pushed > 0, "it did not land");
    let counted = simulation.diagnostics().balance.and_then(|balance| balance.friction).unwrap();
    assert!((counted - work).abs() < 1e-9 * work, "{counted} J, not {work} J");
}

/// What slides from the start on has lost `mu m g` times its way to friction, in steps of any size: what the
/// scheme takes beside that is not friction.
#[test]
fn friction_takes_its_force_times_the_way() {
    for h in [0.05, 0.02, 0.01] {
        let slides = FallingParticle {
            stiffness: 1e5,
            gravity: [0.0, -9.81],
            velocity: [2.3, 0.0],
            ..on_incline(0.45)
        };
        let mut settled = FallingParticle { friction: 0.0, velocity: [0.0; 2], ..slides }
            .simulation(&IntegratorSpec::QuasiStatic, 0.1);
        super::advance(&mut settled, 1);
        let mut simulation = FallingParticle { height: settled.state().x()[1], ..slides }
            .simulation(&IntegratorSpec::ImplicitEuler, h);
        let start = simulation.state().x()[0];
        super::advance(&mut simulation, (0.4 / h) as usize);
        let (work, end) = (simulation.diagnostics().balance.unwrap().friction.unwrap(), simulation.state());
        assert!(end.v()[0] > 0.1, "it still slides");
        let expected = 0.45 * 9.81 * (end.x()[0] - start);
        assert!((work - expected).abs() < 1e-6 * expected, "h = {h}: {work} J, not {expected} J");
    }
}

/// A block that slides to rest, from the equilibrium in which the floor carries it. Coulomb's way is `v^2 /
/// (2 mu g) = 0.169894665 m`; implicit Euler falls short of it by `h v / 2`. The ways are those of an
/// independent program.
#[test]
fn a_block_slides_to_rest_where_coulomb_says() {
    let cases = [
        (0.02, 20, 0.159888848),
        (0.01, 20, 0.164876746),
        (0.005, 20, 0.167370954),
        (0.02, 1, 0.159888482),
        (0.01, 1, 0.164876541),
        (0.005, 1, 0.167370842),
    ];
    for (h, renewals, expected) in cases {
        let time = format!(
            "{{ integrator = 'implicit-euler', step = {h}, duration = 1.0, solver = {{ tolerance = 1e-12 }} \
             }}"
        );
        let contact = format!(
            "{{ distance = 1e-3, stiffness = 1e5, friction = 0.3, threshold_speed = 1e-3, \
             friction_iterations = {renewals} }}"
        );
        let velocity = "velocity = { rigid = { linear = [1, 0] } }";
        let mut simulation = super::block_on_floor(&time, &contact, velocity, "");
        let mean = |x: &[f64], mass: &[f64]| {
            let sum = x.chunks(2).zip(mass).map(|(x, m)| m * x[0]).sum::<f64>();
            sum / mass.iter().sum::<f64>()
        };
        let at = |simulation: &pliant::simulation::Simulation| {
            mean(simulation.state().x(), simulation.system().mass())
        };
        let start = at(&simulation);
        super::advance(&mut simulation, (1.0 / h) as usize);
        let way = at(&simulation) - start;
        assert!((way - expected).abs() < 2e-8, "h = {h}, {renewals}: {way}, not {expected}");
        let fastest = simulation.state().v().iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        assert!(fastest < 1e-7, "{fastest:e}");
        assert_eq!(simulation.work().solver.unwrap().unsettled, 0);
        let friction = simulation.diagnostics().balance.unwrap().friction.unwrap();
        // The force of a step times its displacement: `mu m g` along the way.
        let expected = 0.3 * 20.0 * 9.81 * way;
        assert!((friction - expected).abs() < 2e-3 * friction, "{friction} J, not {expected} J");
    }
}

/// What creeps at one speed is held back by what pulls it, and what slides by `mu` times its normal force.
#[test]
fn friction_of_a_contact_is_the_force_that_motion_shows() {
    let pull = 9.81 / 5f64.sqrt();
    let mut sticks = on_incline(1.0).simulation(&IntegratorSpec::ImplicitEuler, 0.01);
    super::advance(&mut sticks, 3000);
    let contacts = sticks.contacts();
    assert_eq!(contacts.len(), 1);
    let [along, across, _] = contacts[0].friction;
    assert!((along + pull).abs() < 1e-9 && across.abs() < 1e-12, "{:?} for {pull} N", contacts[0]);
    let mut slides = on_incline(0.1).simulation(&IntegratorSpec::ImplicitEuler, 0.01);
    super::advance(&mut slides, 200);
    let contact = &slides.contacts()[0];
    assert!((contact.friction[0] + 0.1 * contact.force).abs() < 1e-12 * contact.force, "{contact:?}");
}

/// Recordings of before friction was in them are read as ever.
#[test]
fn contacts_without_friction_are_read() {
    let old = serde_json::json!({
        "bodies": ["a", "b"], "points": [[0, 0, 0], [0, 0, 1]], "normal": [0, 0, 1], "gap": 0.5,
        "relative_gap": 0.25, "force": 2.0,
    });
    let read: pliant::energy::SurfaceContact = serde_json::from_value(old).unwrap();
    assert_eq!((read.force, read.friction), (2.0, [0.0; 3]));
}

/// A block thrown along a floor, with the tolerance that a scene has by itself: in each step the floor takes
/// from its speed at most `mu` times what it takes from the fall, and just that much while it slides.
#[test]
fn a_block_thrown_onto_a_floor_slides_on_by_itself() {
    let text = "dimension = 2
        contact = { friction = 0.4, distance = '1 mm' }
        world = { gravity = [0, -10] }
        time = { integrator = 'implicit-euler', step = 0.01, duration = 0.6 }
        [[body]]
        name = 'block'
        mesh = { grid = { cells = [4, 4], size = [0.1, 0.1], origin = [0, 0.3] } }
        elastic = { neo-hookean = { young = '1 MPa', poisson = 0.3 } }
        mass = { density = 1000 }
        velocity = { rigid = { linear = [8, 0] } }
        [[obstacle]]
        name = 'floor'
        shape = { half_space = { normal = [0, 1], offset = 0 } }";
    let mut simulation = super::assembled(text).simulation;
    // Of the block: what the floor is has no mass.
    let speeds = |simulation: &pliant::simulation::Simulation| {
        let (mass, v) = (simulation.system().mass(), simulation.state().v());
        let along = |k: usize| mass.iter().zip(v.chunks(2)).map(|(m, v)| m * v[k]).sum::<f64>();
        [0, 1].map(|k| along(k) / mass.iter().sum::<f64>())
    };
    for step in 0..60 {
        let before = speeds(&simulation);
        super::advance(&mut simulation, 1);
        let after = speeds(&simulation);
        let (along, normal) = (before[0] - after[0], after[1] - before[1] + 0.1);
        assert!((along - 0.4 * normal).abs() < 2e-3 * normal.max(0.05), "{step}: {along} for {normal} m/s");
    }
    let [along, across] = speeds(&simulation);
    assert!((along + 0.4 * (across + 6.0) - 8.0).abs() < 2e-3, "{along} m/s");
}

/// A rod that trails over a sliding floor: friction lifts what presses it down, `N = W - mu tan(a) N`, and
/// for `mu tan(a) = 2` each normal force from the last would lead ever farther away. Forces at rest are
/// `N = W / (1 + mu tan(a))`.
#[test]
fn friction_that_lifts_its_own_load_settles() {
    let scene = "dimension = 2\nworld = { gravity = [0, -9.81] }\n[time]\nintegrator = 'implicit-euler'\n\
         step = 0.01\nduration = 1.0\nsolver = { tolerance = 1e-9 }\n\
         [contact]\ndistance = 1e-3\nstiffness = 1e5\nfriction = 1.0\nthreshold_speed = 1e-3\n\
         [[body]]\nmesh = { strand = { segments = 1, start = [0, 2], end = [1, 0.9e-3] } }\n\
         springs = { stiffness = 1e6 }\nmass = { per_vertex = 1.0 }\npin = [{ vertices = [0] }]\n\
         [[obstacle]]\nshape = { half_space = { normal = [0, 1], offset = 0 } }\n\
         motion = { velocity = [1, 0] }\n";
    let mut simulation = super::assembled(scene).simulation;
    super::advance(&mut simulation, 100);
    assert_eq!(simulation.work().solver.unwrap().unsettled, 0);
    let x = simulation.positions();
    let slope = (x[1] - x[3]) / (x[2] - x[0]);
    let contacts = simulation.contacts();
    let [contact] = &contacts[..] else { panic!("{contacts:?}") };
    let expected = 9.81 / (1.0 + slope);
    assert!((contact.force - expected).abs() < 1e-3 * expected, "{contact:?}, not {expected} N");
}
