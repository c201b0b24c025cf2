//! Contact in steps that are not solved: a law without a pole, whose limits are known and said.

use super::particle::{FallingParticle, falls_from_half_a_metre};
use pliant::integrator::IntegratorSpec;
use pliant::simulation::Simulation;

const EXPLICIT: [IntegratorSpec; 6] = [
    IntegratorSpec::SymplecticEuler,
    IntegratorSpec::VelocityVerlet,
    IntegratorSpec::Rk4,
    IntegratorSpec::BogackiShampine3,
    IntegratorSpec::DormandPrince5,
    IntegratorSpec::Yoshida4,
];

fn name(scheme: &IntegratorSpec) -> &'static str {
    scheme.method().documentation.name
}

/// A particle of 1 kg on a layer of `kappa w` = 1000 N and 1 cm, so heavy that it rests where the gap closes:
/// `m g = 2 kappa w`, and `omega^2 = 4 kappa w / (m dhat)` there, the largest that the law has above.
fn pressed_flat(height: f64) -> FallingParticle {
    FallingParticle { gravity: [0.0, -2000.0], height, ..falls_from_half_a_metre() }
}

#[test]
fn the_largest_stable_step_is_the_one_predicted() {
    let omega = (4.0 * 1000.0 / 0.01f64).sqrt();
    for scheme in EXPLICIT {
        let limit = pressed_flat(0.0).simulation(&scheme, 1e-3).stability_limit(1.0).unwrap();
        assert!((limit.frequency - omega).abs() < 1e-9 * omega, "{}: {}", name(&scheme), limit.frequency);
        // Before anything touches too.
        let apart = pressed_flat(0.5).simulation(&scheme, 1e-3).stability_limit(1.0).unwrap();
        assert_eq!(apart.step, limit.step, "{}", name(&scheme));
        // Growth of the amplitude from the first quarter of some steps to the last.
        let growth = |part: f64| {
            let mut simulation = pressed_flat(1e-9).simulation(&scheme, part * limit.step);
            let mut quarters = [0.0f64; 4];
            for step in 0..2000 {
                super::advance(&mut simulation, 1);
                let (y, v) = (simulation.state().x()[1], simulation.state().v()[1]);
                let y = y.hypot(v / omega);
                quarters[step / 500] = quarters[step / 500].max(y);
                if y > 1e-5 {
                    return f64::INFINITY;
                }
            }
            quarters[3] / quarters[0]
        };
        let (below, above) = (growth(0.95), growth(1.05));
        assert!(below < 1.001, "{} grows by {below}", name(&scheme));
        assert!(above > 1.005, "{} grows by {above} alone", name(&scheme));
    }
}

/// Time of contact and the least gap of a fall, by Simpson's rule on the energy: `t = 2 int dy / v(y)`.
fn quadrature(falls: &FallingParticle, speed: f64) -> (f64, f64) {
    let (m, k, dhat, g) = (falls.mass, falls.stiffness, falls.reach, -falls.gravity[1]);
    let energy = |y: f64| 2.0 / 3.0 * k * dhat * (1.0 - y / dhat).max(0.0).powi(3) + m * g * y;
    let start = 0.5 * m * speed * speed + energy(dhat);
    let (mut low, mut high) = (-10.0 * dhat, dhat);
    for _ in 0..200 {
        let mid = 0.5 * (low + high);
        if energy(mid) > start { low = mid } else { high = mid }
    }
    let least = 0.5 * (low + high);
    // y = least + u^2 takes the root of the speed away.
    let top = (dhat - least).sqrt();
    let of = |u: f64| {
        let y = least + u * u;
        let v = (2.0 * (start - energy(y)) / m).max(0.0).sqrt();
        if u == 0.0 {
            let slope = 2.0 * k * (1.0 - least / dhat).powi(2) - m * g;
            2.0 / (2.0 * slope / m).sqrt()
        } else {
            2.0 * u / v
        }
    };
    let n = 2000;
    let h = top / f64::from(n);
    let weight = |i: i32| {
        if i == 0 || i == n {
            1.0
        } else if i % 2 == 1 {
            4.0
        } else {
            2.0
        }
    };
    let sum: f64 = (0..=n).map(|i| weight(i) * of(f64::from(i) * h)).sum();
    (2.0 * sum * h / 3.0, least)
}

/// The particle leaves with the speed it came with, after the time that the energy says.
#[test]
fn a_particle_bounces_off_the_cubic_law_as_the_quadrature_says() {
    let speed = 3.0;
    let start = FallingParticle { height: 0.01, velocity: [0.0, -speed], ..falls_from_half_a_metre() };
    let (time, least) = quadrature(&start, speed);
    for (scheme, h, tolerance) in [
        (IntegratorSpec::Rk4, 1e-5, 1e-6),
        (IntegratorSpec::DormandPrince5, 1e-5, 1e-6),
        (IntegratorSpec::VelocityVerlet, 1e-5, 1e-4),
    ] {
        let mut simulation = start.simulation(&scheme, h);
        let (mut lowest, mut found) = (f64::INFINITY, None);
        for step in 0..2000 {
            let before = simulation.state().x()[1];
            super::advance(&mut simulation, 1);
            let y = simulation.state().x()[1];
            lowest = lowest.min(y);
            if before < 0.01 && y >= 0.01 {
                found = Some((f64::from(step) + (0.01 - before) / (y - before)) * h);
                break;
            }
        }
        let found = found.unwrap();
        assert!((found - time).abs() < tolerance * time + 1e-9, "{}: {found} s, not {time}", name(&scheme));
        assert!((lowest - least).abs() < 1e-3 * 0.01, "{}: {lowest} m, not {least}", name(&scheme));
        let leaves = simulation.state().v()[1];
        assert!((leaves - speed).abs() < 2e-4 * speed, "{}: leaves at {leaves} m/s", name(&scheme));
    }
}

/// `kappa = f^2 m dhat / (w h^2)` stops approaches up to `sqrt(4/3) f dhat / h`, whatever the mass.
#[test]
fn approaches_are_stopped_up_to_the_speed_that_is_said() {
    let (f, h, dhat): (f64, f64, f64) = (0.3, 1e-4, 1e-3);
    for (mass, scheme) in [
        (1e-3, IntegratorSpec::VelocityVerlet),
        (1e3, IntegratorSpec::VelocityVerlet),
        (1.0, IntegratorSpec::SymplecticEuler),
        (1.0, IntegratorSpec::Rk4),
    ] {
        let stopped = |speed: f64, phase: f64| {
            let start = FallingParticle {
                mass,
                stiffness: f * f * mass * dhat / (h * h),
                reach: dhat,
                gravity: [0.0, 0.0],
                height: dhat + phase * h * speed,
                velocity: [0.0, -speed],
                friction: 0.0,
                threshold: 1e-3,
            };
            let mut simulation = start.simulation(&scheme, h);
            let mut least = f64::INFINITY;
            for _ in 0..40 {
                super::advance(&mut simulation, 1);
                least = simulation.state().x()[1].min(least);
            }
            let deepest = simulation.contact_extremes().deepest.as_ref().map_or(0.0, |deep| deep.depth);
            assert_eq!(deepest, (-least).max(0.0), "{}", name(&scheme));
            if let Some(hardest) = &simulation.contact_extremes().hardest {
                let said = (4.0f64 / 3.0).sqrt() * f * dhat / h;
                let error = (hardest.stopped - said).abs();
                assert!(error < 1e-12 * said, "{}: {}", name(&scheme), hardest.stopped);
            }
            least > 0.0
        };
        // The fastest that is stopped at every phase of the steps.
        let always = |speed: f64| (0..20).all(|k| stopped(speed, f64::from(k) / 20.0));
        let (mut low, mut high) = (0.1, 100.0);
        while high - low > 1e-3 * high {
            let mid = 0.5 * (low + high);
            if always(mid) { low = mid } else { high = mid }
        }
        let said = 1.1547 * f * dhat / h;
        assert!((low - said).abs() < 0.1 * said, "{}: {low} m/s, not {said}", name(&scheme));
    }
}

/// The collision of two soft bodies, by the law of explicit steps: its end, and the relative change of its
/// energy, the changes of its momentum [kg m/s] and angular momentum [kg m^2/s].
fn collide(integrator: &str, step: f64) -> (Simulation, [f64; 3]) {
    let text = super::collision::text(integrator, step).replace(", solver = { tolerance = 1e-12 }", "");
    // The barrier has a pole; without one it takes more to stop them.
    let text = text.replace("stiffness = 1e4", "stiffness = 2e5");
    let mut simulation = super::assembled(&text).simulation;
    let first = simulation.diagnostics();
    super::advance(&mut simulation, (0.2 / step).round() as usize);
    let end = simulation.diagnostics();
    assert!(simulation.contact_extremes().hardest.is_some(), "they met");
    let change = |a: [f64; 3], b: [f64; 3]| (0..3).fold(0.0, |m: f64, k| m.max((a[k] - b[k]).abs()));
    let changes = [
        (end.conserved() - first.conserved()).abs() / first.conserved(),
        change(end.linear_momentum, first.linear_momentum),
        change(end.angular_momentum, first.angular_momentum),
    ];
    (simulation, changes)
}

/// Mass-weighted rms difference of positions [m].
fn apart(a: &Simulation, b: &Simulation) -> f64 {
    let mass = a.system().mass();
    let rows = a.state().x().iter().zip(b.state().x()).enumerate();
    let sum: f64 = rows.map(|(i, (a, b))| mass[i / 2] * (a - b) * (a - b)).sum();
    (sum / mass.iter().sum::<f64>()).sqrt()
}

#[test]
fn explicit_schemes_have_their_orders_through_a_collision() {
    let (reference, _) = collide("'dormand-prince5'", 2.5e-5);
    for (scheme, steps, order) in [
        ("'velocity-verlet'", [2e-4, 1e-4, 5e-5], 2.0),
        ("'symplectic-euler'", [2e-4, 1e-4, 5e-5], 1.0),
        // The third derivative of the law jumps where it begins.
        ("'rk4'", [4e-4, 2e-4, 1e-4], 2.5),
    ] {
        let errors = steps.map(|h| apart(&collide(scheme, h).0, &reference));
        // Over both halvings: where the law begins within a step is a matter of chance.
        let found = 0.5 * (errors[0] / errors[2]).log2();
        assert!(found > order - 0.1, "{scheme}: {errors:?}, {found}");
    }
}

#[test]
fn momenta_are_kept_to_rounding_and_energy_to_the_square_of_the_step() {
    for scheme in ["'velocity-verlet'", "'symplectic-euler'"] {
        let (_, changes) = collide(scheme, 1e-4);
        // Of 47 kg m/s and 28 kg m^2/s.
        assert!(changes[1] < 47e-12 && changes[2] < 28e-12, "{scheme}: {changes:?}");
        let (_, finer) = collide(scheme, 5e-5);
        assert!(changes[0] < 2e-4 && finer[0] < changes[0], "{scheme}: {changes:?}, {finer:?}");
    }
}

/// A sheet of springs in the way of a particle, which comes too fast for it.
fn shot(contact: &str) -> String {
    format!(
        "dimension = 3\ntime = {{ integrator = 'velocity-verlet', step = 1e-3, duration = 1.0 }}\n\
         contact = {contact}\n\
         [[body]]\nname = 'cloth'\nmesh = {{ cloth = {{ cells = [2, 2], origin = [0, 0, 0], u = [0.2, 0, \
         0], v = [0, 0.2, 0] }} }}\n\
         springs = {{ stiffness = 10.0 }}\nmass = {{ total = 0.01 }}\n\
         [[body]]\nname = 'shot'\nmesh = {{ inline = {{ points = [[0.06, 0.03, 0.05]] }} }}\n\
         mass = {{ per_vertex = 0.01 }}\nvelocity = {{ rigid = {{ linear = [0, 0, -30] }} }}\n\
         contact = {{ radius = 1e-3 }}\n"
    )
}

#[test]
fn what_passes_through_a_sheet_ends_the_run_with_its_name_unless_the_scene_allows_it() {
    let mut simulation = super::assembled(&shot("{ distance = 2e-3 }")).simulation;
    let error = loop {
        match simulation.step() {
            Ok(()) => assert!(simulation.state().step < 20, "it passed"),
            Err(error) => break error.to_string(),
        }
    };
    assert!(error.contains("step 2 (t = 0.001 s)"), "{error}");
    assert!(error.contains("`shot`") && error.contains("of `cloth` cross"), "{error}");
    assert!(error.contains("allow_penetration = true"), "{error}");
    // Where it was before that step.
    assert!((simulation.positions()[29] - 0.02).abs() < 1e-12, "{}", simulation.positions()[29]);
    let mut allowed = super::assembled(&shot("{ distance = 2e-3, allow_penetration = true }")).simulation;
    super::advance(&mut allowed, 5);
    assert!(allowed.positions()[29] < -0.05, "{}", allowed.positions()[29]);
    // Slowly it bounces.
    let slow = shot("{ distance = 2e-3 }").replace("-30]", "-0.3]").replace("radius = 1e-3", "radius = 5e-3");
    let mut simulation = super::assembled(&slow).simulation;
    super::advance(&mut simulation, 400);
    assert!(simulation.velocities()[29] > -0.29, "{}", simulation.velocities()[29]);
}

/// On an incline of tan(theta) = 1/2, in its own axes.
fn on_incline(friction: f64, threshold: f64) -> FallingParticle {
    let (sin, cos) = (1.0 / 5f64.sqrt(), 2.0 / 5f64.sqrt());
    let gravity = [9.81 * sin, -9.81 * cos];
    // Where the layer carries it: 2 kappa w (1 - s)^2 = m g cos(theta).
    let height = 0.01 * (1.0 - (9.81 * cos / 2000.0).sqrt());
    FallingParticle { gravity, height, friction, threshold, ..falls_from_half_a_metre() }
}

/// A load below the limit of friction by the ratio `r` creeps at `e (1 - sqrt(1 - r))`, where `e` is what a
/// step bears if that is more than the threshold; one above it slides away.
#[test]
fn what_sticks_creeps_at_the_threshold_that_a_step_bears() {
    let normal = 9.81 * 2.0 / 5f64.sqrt();
    for scheme in EXPLICIT {
        for (mu, threshold, h) in [(0.6, 1e-3, 1e-3), (0.6, 0.1, 1e-3), (1.0, 1e-6, 1e-4)] {
            let mut simulation = on_incline(mu, threshold).simulation(&scheme, h);
            super::advance(&mut simulation, (0.5 / h) as usize);
            let borne = 2.0 * h * mu * normal;
            let expected = threshold.max(borne) * (1.0 - (1.0 - 0.5 / mu).sqrt());
            let found = simulation.state().v()[0];
            let told = simulation.contact_extremes().friction * h;
            assert!((told - borne).abs() < 1e-6 * borne, "{}: {told} m/s", name(&scheme));
            assert!(
                (found - expected).abs() < 1e-6 * expected,
                "{}: {found:e}, not {expected:e}",
                name(&scheme)
            );
        }
        let mut simulation = on_incline(0.4, 1e-3).simulation(&scheme, 1e-4);
        super::advance(&mut simulation, 5000);
        let expected = 0.5 * 9.81 / 5f64.sqrt() * (1.0 - 0.8);
        let found = simulation.state().v()[0];
        assert!((found - expected).abs() < 5e-3 * expected, "{}: {found}, not {expected}", name(&scheme));
    }
}

/// Scenes of every kind of contact, by their head, in which energy is kept.
const SCENES: [(&str, &str); 6] = [
    (
        "a sheet of springs on a ball",
        "dimension = 3\ntime = { integrator = 'velocity-verlet', step = 1e-4, duration = 0.25 }\n\
         world = { gravity = [0, 0, -9.81] }\ncontact = { distance = 2e-3 }\n\
         [[body]]\nname = 'cloth'\nmesh = { cloth = { cells = [6, 6], origin = [-0.15, -0.15, 0], u = [0.3, \
         0, 0], v = [0, 0.3, 0] } }\n\
         springs = { stiffness = 20 }\nmass = { total = 0.05 }\ncontact = { radius = 1e-3 }\n\
         [[obstacle]]\nname = 'ball'\nshape = { ball = { centre = [0, 0, -0.11], radius = 0.1 } }\n",
    ),
    (
        "strands across each other",
        "dimension = 3\ntime = { integrator = 'velocity-verlet', step = 1e-4, duration = 0.1 }\n\
         contact = { distance = 2e-3 }\n\
         [[body]]\nname = 'one'\nmesh = { strand = { segments = 10, start = [-0.2, 0.003, 0], end = [0.2, \
         0.003, 0] } }\n\
         springs = { stiffness = 200 }\nmass = { total = 0.02 }\ncontact = { radius = 3e-3 }\n\
         [[body]]\nname = 'other'\nmesh = { strand = { segments = 11, start = [0.01, -0.15, 0.02], end = \
         [0.01, 0.15, 0.02] } }\n\
         springs = { stiffness = 200 }\nmass = { total = 0.02 }\ncontact = { radius = 3e-3 }\n\
         velocity = { rigid = { linear = [0, 0, -1] } }\n",
    ),
    (
        "grains on a floor and on each other",
        "dimension = 2\ntime = { integrator = 'velocity-verlet', step = 1e-4, duration = 0.3 }\n\
         world = { gravity = [0, -9.81] }\ncontact = { distance = 2e-3 }\n\
         [[body]]\nname = 'grains'\nmesh = { inline = { points = [[0, 0.02], [0.002, 0.05], [-0.001, 0.09]] \
         } }\n\
         mass = { per_vertex = 0.1 }\ncontact = { radius = 0.01 }\n\
         [[obstacle]]\nname = 'floor'\nshape = { half_space = { normal = [0, 1], offset = 0 } }\n",
    ),
    (
        "a block that a floor pushes",
        "dimension = 2\ntime = { integrator = 'velocity-verlet', step = 5e-5, duration = 0.1 }\n\
         contact = { distance = 2e-3 }\n\
         [[body]]\nname = 'block'\nmesh = { grid = { cells = [3, 2], size = [0.2, 0.1], origin = [0, 0.01] \
         } }\n\
         elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }\nmass = { density = 1000 }\n\
         [[obstacle]]\nname = 'floor'\nshape = { half_space = { normal = [0, 1], offset = 0 } }\n\
         motion = { velocity = [0, 0.5] }\n",
    ),
    (
        "a strand that closes on itself",
        "dimension = 2\ntime = { integrator = 'velocity-verlet', step = 1e-4, duration = 0.1 }\n\
         contact = { distance = 2e-3 }\n\
         [[body]]\nname = 'clip'\n\
         mesh = { inline = { points = [[0, 0.03], [0.05, 0.03], [0.1, 0.03], [0.12, 0.015], [0.1, 0], \
         [0.05, 0], [0, 0]], edges = [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 6]] } }\n\
         springs = { stiffness = 500 }\nmass = { per_vertex = 0.01 }\ncontact = { radius = 3e-3 }\n\
         velocity = { per_vertex = [[0, -1], [0, -1], [0, 0], [0, 0], [0, 0], [0, 1], [0, 1]] }\n",
    ),
    (
        "a grain in a corner of two walls and a capsule",
        "dimension = 2\ntime = { integrator = 'velocity-verlet', step = 1e-4, duration = 0.3 }\n\
         contact = { distance = 2e-3 }\n\
         [[body]]\nname = 'grain'\nmesh = { inline = { points = [[0.1, 0.2]] } }\n\
         mass = { per_vertex = 0.1 }\ncontact = { radius = 0.01 }\nvelocity = { rigid = { linear = [-0.4, \
         -1] } }\n\
         [[obstacle]]\nname = 'floor'\nshape = { half_space = { normal = [0, 1], offset = 0 } }\n\
         [[obstacle]]\nname = 'side'\nshape = { half_space = { normal = [1, 0], offset = 0 } }\n\
         [[obstacle]]\nname = 'bar'\nshape = { capsule = { axis = [[0.2, 0.2], [0.3, 0.1]], radius = 0.02 } \
         }\n",
    ),
];

/// What touches is stopped, whatever it is, and the books close: energy, with the work of what moves, by the
/// square of the step.
#[test]
fn every_kind_of_contact_keeps_its_energy() {
    for (what, text) in SCENES {
        let run = |part: f64| {
            let step: f64 = text.split("step = ").nth(1).unwrap().split(',').next().unwrap().parse().unwrap();
            let duration: f64 =
                text.split("duration = ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
            let h = part * step;
            // One law for both steps.
            let mut scene = super::scene(text);
            scene.time.step = Some(h);
            scene.contact.as_mut().unwrap().designed_step = Some(step);
            let mut assembly = scene.assemble(super::UnstableStep::Refuse).unwrap();
            assert!(assembly.report.warnings.is_empty(), "{what}: {:?}", assembly.report.warnings);
            let simulation = &mut assembly.simulation;
            let first = super::conserved(simulation);
            let (mut off, mut most): (f64, f64) = (0.0, simulation.diagnostics().kinetic);
            for _ in 0..(duration / h).round() as usize {
                super::advance(simulation, 1);
                off = off.max((super::conserved(simulation) - first).abs());
                most = most.max(simulation.diagnostics().kinetic);
            }
            let extremes = simulation.contact_extremes();
            let hardest = extremes.hardest.as_ref().unwrap_or_else(|| panic!("{what}: nothing touched"));
            assert!(hardest.speed < hardest.stopped, "{what}: {hardest:?}");
            assert_eq!(extremes.deepest, None, "{what}");
            off / most
        };
        let (whole, half) = (run(1.0), run(0.5));
        assert!(whole < 1e-2 && half < 0.35 * whole, "{what}: off by {whole:e}, {half:e} in half steps");
    }
}

/// From 1 m/s, mu = 0.3: Coulomb's way is `v^2 / (2 mu g)`, and friction takes all of the motion.
#[test]
fn a_block_slides_to_rest_in_explicit_steps() {
    for scheme in ["velocity-verlet", "rk4"] {
        let time = format!("{{ integrator = '{scheme}', step = 1e-4, duration = 1.0 }}");
        let contact = "{ distance = 1e-3, stiffness = 1e5, friction = 0.3 }";
        let velocity = "velocity = { rigid = { linear = [1, 0] } }\n\
                        damping = { stiffness_proportional = 1e-3 }";
        let mut simulation = super::block_on_floor(&time, contact, velocity, "");
        let mean = |simulation: &Simulation| {
            let mass = simulation.system().mass();
            let sum: f64 = simulation.state().x().chunks(2).zip(mass).map(|(x, m)| m * x[0]).sum();
            sum / mass.iter().sum::<f64>()
        };
        let (start, first) = (mean(&simulation), super::conserved(&mut simulation));
        super::advance(&mut simulation, 6000);
        let way = mean(&simulation) - start;
        assert!((way - 0.169894665).abs() < 2e-3, "{scheme}: {way} m");
        let fastest = simulation.state().v().iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        assert!(fastest < 1e-4, "{scheme}: {fastest:e} m/s");
        let lost = simulation.diagnostics().balance.unwrap();
        // The damping takes what the block shakes.
        let (lost, shaken) = (lost.friction.unwrap(), lost.damping.unwrap());
        assert!(lost > 9.0 && shaken > 0.0 && (lost + shaken - 10.0).abs() < 0.05, "{scheme}: {lost} J");
        let off = (super::conserved(&mut simulation) - first).abs();
        assert!(off < 1e-2, "{scheme}: {off:e} J of 10 J");
    }
}

/// The worst contacts are kept at a checkpoint.
#[test]
fn the_hardest_approach_survives_a_checkpoint() {
    let start = FallingParticle { height: 0.0105, velocity: [0.0, -1.0], ..falls_from_half_a_metre() };
    let scheme = IntegratorSpec::VelocityVerlet;
    let mut simulation = start.simulation(&scheme, 1e-4);
    super::advance(&mut simulation, 50);
    let extremes = simulation.contact_extremes().clone();
    assert!(extremes.hardest.is_some());
    let checkpoint = simulation.checkpoint();
    let mut resumed = start.simulation(&scheme, 1e-4);
    resumed.resume(&checkpoint).unwrap();
    assert_eq!(*resumed.contact_extremes(), extremes);
}

fn warnings(contact: &str, speed: f64) -> String {
    let text = format!(
        "dimension = 2\ntime = {{ integrator = 'velocity-verlet', step = 1e-4, duration = 0.1 }}\n\
         world = {{ gravity = [0, -9.81] }}\ncontact = {contact}\n\
         [[body]]\nname = 'grain'\nmesh = {{ inline = {{ points = [[0, 0.03]] }} }}\nmass = {{ per_vertex = \
         0.1 }}\n\
         contact = {{ radius = 0.01 }}\nvelocity = {{ rigid = {{ linear = [0, -{speed}] }} }}\n\
         [[obstacle]]\nname = 'floor'\nshape = {{ half_space = {{ normal = [0, 1], offset = 0 }} }}\n"
    );
    super::assembled(&text).report.warnings.join("\n")
}

/// `1.1547 * 0.3 * 1e-3 / 1e-4` = 3.464 m/s, and `2 mu g h` = 9.81e-4 m/s at mu = 0.5.
#[test]
fn what_steps_do_not_stop_and_do_not_bear_is_said_before_a_run() {
    assert_eq!(warnings("{ distance = 1e-3 }", 3.4), "");
    let told = warnings("{ distance = 1e-3 }", 3.5);
    assert!(told.contains("`grain` and `floor`") && told.contains("stops 3.464 m/s"), "{told}");
    assert_eq!(warnings("{ distance = 1e-3, friction = 0.5, threshold_speed = 9.9e-4 }", 1.0), "");
    let told = warnings("{ distance = 1e-3, friction = 0.5, threshold_speed = 9.7e-4 }", 1.0);
    assert!(told.contains("9.7e-4 m/s") && told.contains("needs 9.81e-4 m/s"), "{told}");
}

/// A grain at rest, and what comes at it by its own motion: as fast as its motion says at the start.
#[test]
fn what_moving_obstacles_and_pins_come_with_is_said_before_a_run() {
    let warnings = |shape: &str, speed: f64| {
        let text = format!(
            "dimension = 2\ntime = {{ integrator = 'velocity-verlet', step = 1e-4, duration = 0.1 }}\n\
             contact = {{ distance = 1e-3 }}\n\
             [[body]]\nname = 'grain'\nmesh = {{ inline = {{ points = [[0, 0.05]] }} }}\nmass = {{ \
             per_vertex = 0.1 }}\n\
             contact = {{ radius = 0.01 }}\n\
             [[obstacle]]\nname = 'comes'\nshape = {{ {shape} }}\nmotion = {{ velocity = [0, {speed}] }}\n"
        );
        super::assembled(&text).report.warnings.join("\n")
    };
    for shape in [
        "half_space = { normal = [0, 1], offset = 0 }",
        "ball = { centre = [0, 0], radius = 0.01 }",
        "capsule = { axis = [[-0.1, 0], [0.1, 0]], radius = 0.01 }",
        "box = { min = [-0.1, -0.1], max = [0.1, 0.01] }",
    ] {
        assert_eq!(warnings(shape, 1.5), "", "{shape}");
        let told = warnings(shape, 20.0);
        assert!(told.contains("`grain` and `comes`") && told.contains("20 m/s"), "{shape}: {told}");
    }
}

/// A step that follows the error says nothing of how stiff contact of masses without a modulus is.
#[test]
fn contact_of_masses_in_adaptive_steps_needs_a_stiffness() {
    let text = |contact: &str| {
        format!(
            "dimension = 2\ntime = {{ integrator = 'dormand-prince5', duration = 0.2, adaptive = {{ \
             tolerance = 1e-6 }} }}\n\
             contact = {contact}\n\
             [[body]]\nname = 'grain'\nmesh = {{ inline = {{ points = [[0, 0.03]] }} }}\nmass = {{ \
             per_vertex = 0.1 }}\n\
             contact = {{ radius = 0.01 }}\nvelocity = {{ rigid = {{ linear = [0, -0.5] }} }}\n\
             [[obstacle]]\nname = 'floor'\nshape = {{ half_space = {{ normal = [0, 1], offset = 0 }} }}\n"
        )
    };
    let told = super::problems(&text("{ distance = 1e-3 }"));
    assert!(told.contains("how stiff contact of `grain` is") && told.contains("give `stiffness`"), "{told}");
    let mut simulation = super::assembled(&text("{ distance = 1e-3, stiffness = 1e4 }")).simulation;
    while simulation.state().time < 0.2 {
        simulation.step_towards(0.2).unwrap();
    }
    let v = simulation.state().v()[1];
    assert!((v - 0.5).abs() < 1e-3, "it leaves at {v} m/s");
}
