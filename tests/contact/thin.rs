//! Strands, particles and capsules: what has no triangles touches too.

use std::sync::Arc;

use pliant::energy::{ContactPlace, EnergyTerm};
use pliant_contact::barrier::{Barrier, PotentialForm};
use pliant_contact::candidates::BodyPairs;
use pliant_contact::energy::ContactEnergy;
use pliant_contact::merge::Duplicates;
use pliant_contact::model::{ContactLaw, ContactLaws, ContactModel, SolidBall, SolidHalfSpace};
use pliant_contact::surface::{ContactSurface, SurfacePrimitives, VertexKind};
use pliant_contact::terms::{ContactTerms, ExplicitOptions, contact_terms};

use super::{advance, assembled, conserved, problems};

/// Numbers that look random, from -1 to 1.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Bodies of two triangles, of two wires that meet, of three particles, and of a wire, all near the origin.
fn mixed() -> ContactModel {
    mixed_at(&mixed_rest(), 0.0)
}

/// Their places at rest, flat.
fn mixed_rest() -> Vec<f64> {
    [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 1.0, 0.0],
        [-0.2, 0.5, 0.2],
        [0.5, 0.5, 0.2],
        [1.2, 0.5, 0.2],
        [0.4, 0.4, 0.4],
        [0.6, 0.6, 0.4],
        [0.5, 0.3, 0.5],
        [0.5, -0.2, 0.3],
        [0.5, 1.2, 0.3],
    ]
    .concat()
}

/// The same at rest elsewhere, with this coefficient of friction.
fn mixed_at(rest: &[f64], friction: f64) -> ContactModel {
    let bodies = [0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3];
    let primitives = SurfacePrimitives {
        triangles: &[[0, 1, 2], [1, 3, 2]],
        edges: &[[4, 5], [5, 6], [10, 11]],
        particles: &[7, 8, 9],
        quadrilaterals: &[],
    };
    let mut surface = ContactSurface::in_space(&primitives, rest, &bodies);
    assert_eq!(surface.wires.len(), 3);
    assert_eq!(
        [0, 5, 8].map(|v| surface.kinds[v]),
        [VertexKind::Face, VertexKind::Wire, VertexKind::Particle]
    );
    let radii = [0.0, 0.03, 0.02, 0.03];
    surface.thicken(radii.to_vec(), 0.5);
    let law = |a: usize, b: usize| {
        let barrier =
            Barrier { form: PotentialForm::Barrier, stiffness: 1e3, reach: 0.5, offset: radii[a] + radii[b] };
        ContactLaw { barrier, friction }
    };
    ContactModel {
        surface,
        half_spaces: vec![],
        balls: vec![],
        pairs: BodyPairs::all(4),
        laws: ContactLaws::new(4, law),
        duplicates: Duplicates::Max,
        threshold_speed: 1e-3,
        friction_iterations: 20,
        shortened: vec![],
        names: ["sheet", "strand", "grains", "bar"].map(String::from).to_vec(),
        labels: vec![0; 12],
    }
}

/// Positions in which everything is near everything and nothing overlaps.
fn scattered(numbers: &mut Numbers) -> Vec<f64> {
    let heights = [0.0, 0.0, 0.0, 0.0, 0.22, 0.2, 0.24, 0.45, 0.47, 0.6, 0.36, 0.34];
    let places = [
        [0.0, 0.0],
        [1.0, 0.0],
        [0.0, 1.0],
        [1.0, 1.0],
        [-0.2, 0.5],
        [0.5, 0.5],
        [1.2, 0.5],
        [0.3, 0.4],
        [0.7, 0.6],
        [0.5, 0.3],
        [0.5, -0.2],
        [0.5, 1.2],
    ];
    let row = |(place, height): (&[f64; 2], &f64)| [place[0], place[1], *height];
    let rows: Vec<f64> = places.iter().zip(&heights).flat_map(row).collect();
    rows.iter().map(|x| x + 0.01 * numbers.next()).collect()
}

/// The mixed bodies between an inclined plane and a ball.
fn mixed_with_obstacles(rest: &[f64]) -> ContactModel {
    let mut model = mixed_at(rest, 0.3);
    let (plane, ball) = (12, 13);
    model.surface.bodies.extend([4, 5]);
    model.surface.vertex_areas.extend([0.0; 2]);
    let names = ["sheet", "strand", "grains", "bar", "plane", "ball"];
    let radii = [0.0, 0.03, 0.02, 0.03, 0.0, 0.2];
    model.names = names.map(String::from).to_vec();
    model.laws = ContactLaws::new(6, |a, b| {
        let offset = radii[a] + radii[b];
        let barrier = Barrier { form: PotentialForm::Barrier, stiffness: 1e3, reach: 0.5, offset };
        ContactLaw { barrier, friction: 0.3 }
    });
    model.pairs = BodyPairs::all(6);
    model.pairs.set(4, 5, false);
    model.half_spaces = vec![SolidHalfSpace { vertex: plane, normal: [0.0, 0.0, 1.0], depth: 0.0, body: 4 }];
    model.balls = vec![SolidBall { vertex: ball, body: 5 }];
    model.labels.extend([0; 2]);
    model
}

/// Friction that is held goes by a part of the way to that at other positions: up from none where nothing
/// touches, and down again.
#[test]
fn held_friction_goes_over_by_a_part() {
    let mut numbers = Numbers(5);
    let mut x = scattered(&mut numbers);
    x.extend([0.0, 0.0, -0.2, 0.5, 0.6, 0.95]);
    let v: Vec<f64> = x.iter().map(|_| numbers.next()).collect();
    let apart: Vec<f64> = x.iter().map(|x| 1e3 * x).collect();
    let model = Arc::new(mixed_with_obstacles(&mixed_rest()));
    let ContactTerms { friction, .. } = contact_terms(3, model, ExplicitOptions::default());
    let mut friction = friction.unwrap();
    let mut after = |held: &[f64], part: f64| {
        friction.frozen().unwrap().freeze(held, part);
        friction.evaluate(&x, &v);
        let mut rubs = vec![0.0; x.len()];
        friction.add_rows(0, &mut rubs);
        rubs
    };
    let whole = after(&x, 1.0);
    assert!(whole.iter().any(|force| force.abs() > 1e-3));
    assert!(after(&apart, 1.0).iter().all(|force| *force == 0.0));
    for (held, part, expected) in [(&x, 0.25, 0.25), (&apart, 0.5, 0.125), (&x, 0.5, 0.5625)] {
        let off =
            after(held, part).iter().zip(&whole).fold(0.0, |m: f64, (f, w)| m.max((f - expected * w).abs()));
        let largest = whole.iter().fold(0.0, |m: f64, w| m.max(w.abs()));
        assert!(off < 1e-12 * largest, "{off:e} N of {largest} N for {expected}");
    }
}

/// Forces of contact and of friction, whose normal forces are those of `held` where there is any, go by the
/// shape at rest as those of models at rest elsewhere differ.
#[test]
fn forces_of_all_kinds_of_primitives_go_by_the_shape_at_rest() {
    let mut numbers = Numbers(11);
    for round in 0..6 {
        let mut x = scattered(&mut numbers);
        x.extend([0.0, 0.0, -0.2, 0.5, 0.6, 0.95]);
        let mut random = |size: f64| x.iter().map(|_| size * numbers.next()).collect::<Vec<f64>>();
        let [p, v, moved] = [1.0, 1e-3, 3e-3].map(&mut random);
        let (change, rest) = (random(1.0)[..36].to_vec(), mixed_rest());
        let held: Option<Vec<f64>> =
            (round % 2 == 1).then(|| x.iter().zip(&moved).map(|(x, moved)| x + moved).collect());
        let at_rest = |h: f64| -> Vec<f64> { rest.iter().zip(&change).map(|(x, d)| x + h * d).collect() };
        let terms = |h: f64| {
            contact_terms(3, Arc::new(mixed_with_obstacles(&at_rest(h))), ExplicitOptions::default())
        };
        let force = |h: f64| {
            let ContactTerms { mut energy, friction } = terms(h);
            let (mut rows, mut friction) = (vec![0.0; x.len()], friction.unwrap());
            assert!(energy.evaluate(&x));
            energy.add_rows(0, &mut rows);
            if let Some(held) = &held {
                friction.frozen().unwrap().freeze(held, 1.0);
            }
            friction.evaluate(&x, &v);
            let mut rubs = vec![0.0; x.len()];
            friction.add_rows(0, &mut rubs);
            assert!(rubs.iter().any(|force| force.abs() > 1e-3));
            rows.iter().zip(rubs).map(|(row, rubs)| row + rubs).collect::<Vec<f64>>()
        };
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let ContactTerms { energy, .. } = terms(0.0);
        let shaped = energy.touching().and_then(|touching| touching.shaped()).unwrap();
        let place = ContactPlace { x: &x, v: &v, held: held.as_deref() };
        let (mut by_rest, mut forces) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        shaped.add_work_by_shape(place, &p, &rest, &mut by_rest);
        shaped.add_gradient_by_shape(place, &change, &rest, &mut forces);
        let found = dot(&by_rest, &change);
        assert!((found - dot(&forces, &p)).abs() < 1e-11 * found.abs(), "{found}, {}", dot(&forces, &p));
        let h = 1e-4;
        let differences = |h: f64| (dot(&force(h), &p) - dot(&force(-h), &p)) / (2.0 * h);
        let expected = (4.0 * differences(0.5 * h) - differences(h)) / 3.0;
        assert!((found - expected).abs() < 1e-8 * expected.abs(), "{round}: {found}, {expected}");
    }
}

fn gradient(energy: &mut ContactEnergy<3>, x: &[f64]) -> Vec<f64> {
    assert!(energy.evaluate(x));
    let mut g = vec![0.0; x.len()];
    energy.add_rows(0, &mut g);
    g
}

/// The gradient is that of the energy, adds up to zero, and so does its moment, for pairs of all kinds.
#[test]
fn forces_of_all_kinds_of_primitives_are_gradients() {
    let mut energy = ContactEnergy::<3>::new(Arc::new(mixed()));
    let mut numbers = Numbers(7);
    for _ in 0..20 {
        let x = scattered(&mut numbers);
        let g = gradient(&mut energy, &x);
        let size = g.iter().map(|g| g * g).sum::<f64>().sqrt();
        assert!((0..12).all(|v| g[3 * v..3 * v + 3].iter().any(|g| *g != 0.0)), "something touches nothing");
        for k in 0..3 {
            let force: f64 = (0..12).map(|v| g[3 * v + k]).sum();
            let (a, b) = ((k + 1) % 3, (k + 2) % 3);
            let moment: f64 =
                (0..12).map(|v| x[3 * v + a] * g[3 * v + b] - x[3 * v + b] * g[3 * v + a]).sum();
            assert!(force.abs() < 1e-12 * size && moment.abs() < 1e-12 * size, "{force}, {moment} of {size}");
        }
        let direction: Vec<f64> = x.iter().map(|_| numbers.next()).collect();
        let at = |energy: &mut ContactEnergy<3>, s: f64| {
            let moved: Vec<f64> = x.iter().zip(&direction).map(|(x, d)| x + s * d).collect();
            energy.energy(&moved)
        };
        let h = 1e-5;
        let slope = (8.0 * (at(&mut energy, h) - at(&mut energy, -h)) - at(&mut energy, 2.0 * h)
            + at(&mut energy, -2.0 * h))
            / (12.0 * h);
        let expected: f64 = g.iter().zip(&direction).map(|(g, d)| g * d).sum();
        assert!((slope - expected).abs() < 1e-7 * size, "{slope} for {expected}");
    }
}

/// `x -> Q x + t` leaves the energy, and turns the forces.
#[test]
fn energies_of_all_kinds_of_primitives_do_not_know_of_rigid_motion() {
    let mut energy = ContactEnergy::<3>::new(Arc::new(mixed()));
    let mut numbers = Numbers(11);
    // Rotations about z by 0.7, then about x by -1.1.
    let ((s, c), (t, d)) = (0.7_f64.sin_cos(), (-1.1_f64).sin_cos());
    let rotated = |rows: &[f64]| -> Vec<f64> {
        let row = |r: &[f64]| {
            let [x, y, z] = [c * r[0] - s * r[1], s * r[0] + c * r[1], r[2]];
            [x, d * y - t * z, t * y + d * z]
        };
        rows.chunks(3).flat_map(row).collect()
    };
    for _ in 0..10 {
        let x = scattered(&mut numbers);
        let g = gradient(&mut energy, &x);
        let e = energy.energy(&x);
        let moved: Vec<f64> =
            rotated(&x).iter().enumerate().map(|(i, x)| x + [0.3, -0.8, 0.5][i % 3]).collect();
        let found = gradient(&mut energy, &moved);
        // Positions of size 1 are rounded by 1e-16, the barrier at gaps of some hundredths tells ten times
        // of it.
        assert!(
            e > 0.0 && (energy.energy(&moved) - e).abs() < 1e-12 * e,
            "{} for {e}",
            energy.energy(&moved)
        );
        let size = g.iter().map(|g| g * g).sum::<f64>().sqrt();
        for (found, expected) in found.iter().zip(rotated(&g)) {
            assert!((found - expected).abs() < 1e-11 * size, "{found} for {expected}");
        }
    }
}

/// A wire that slides over the diagonal and the side of two triangles in one plane feels no bump: one place
/// is counted once. So do a triangle's worth of wire and a wire on a wire's bend.
#[test]
fn the_normal_force_of_a_wire_does_not_depend_on_the_edges_below_it() {
    let model = mixed();
    let mut energy = ContactEnergy::<3>::new(Arc::new(model));
    let far = |v: usize| [100.0 + 10.0 * v as f64, 0.0, 0.0];
    let force = |energy: &mut ContactEnergy<3>, along: f64| {
        let mut rows: Vec<[f64; 3]> = (0..12).map(far).collect();
        rows[..4].copy_from_slice(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]);
        // The bar is shorter than the square, and parallel to it.
        (rows[10], rows[11]) = ([0.3 + along, 0.35, 0.3], [0.5 + along, 0.52, 0.3]);
        let g = gradient(energy, rows.as_flattened());
        -(g[32] + g[35])
    };
    let forces: Vec<f64> = (0..20).map(|i| force(&mut energy, 0.013 * f64::from(i))).collect();
    let (low, high) = forces.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), f| (l.min(*f), h.max(*f)));
    assert!(low > 0.0 && high - low < 0.2 * high, "{low} to {high}: {forces:?}");
}

fn grain(text: &str) -> String {
    format!(
        "dimension = 3\ntime = {{ integrator = 'tr-bdf2', step = 1e-5, duration = 1.0 }}\n\
         contact = {{ distance = 1e-3 }}\n{text}"
    )
}

/// Head on, without loss: they exchange their velocities.
#[test]
fn two_particles_of_one_mass_exchange_their_velocities() {
    let body = |name: &str, x: f64, v: f64| {
        format!(
            "[[body]]\nname = '{name}'\nmesh = {{ inline = {{ points = [[{x}, 0, 0]] }} }}\nmass = {{ \
             per_vertex = 1e-3 }}\ncontact = {{ radius = 0.01 }}\nvelocity = {{ rigid = {{ linear = [{v}, \
             0, 0] }} }}\n"
        )
    };
    let text = grain(&(body("left", -0.0115, 0.3) + &body("right", 0.0115, -0.1)));
    let text = text.replace("distance = 1e-3", "distance = 1e-3, stiffness = 1e5");
    let mut simulation = assembled(&text).simulation;
    let energy = conserved(&mut simulation);
    advance(&mut simulation, 3000);
    let v = simulation.state().v().to_vec();
    assert!((v[0] + 0.1).abs() < 1e-4 && (v[3] - 0.3).abs() < 1e-4, "{v:?}");
    assert!((conserved(&mut simulation) - energy).abs() < 1e-4 * energy);
}

/// Closed form: the barrier of the half-space on the area of a disk carries its weight.
#[test]
fn a_particle_rests_on_a_half_space_at_the_height_of_its_barrier() {
    let text = "dimension = 3\ntime = { integrator = 'quasi-static', step = 1.0, duration = 1.0, \
                solver = { tolerance = 1e-14 } }\nworld = { gravity = [0, 0, -9.81] }\n\
                contact = { distance = 0.01, stiffness = 12732395.447351627 }\n\
                [[body]]\nmesh = { inline = { points = [[0, 0, 0.0099]] } }\nmass = { per_vertex = 1.0 }\n\
                pin = [{ vertices = [0], axes = ['x', 'y'] }]\n\
                [[obstacle]]\nshape = { half_space = { normal = [0, 0, 1], offset = 0 } }\n";
    let mut simulation = assembled(text).simulation;
    advance(&mut simulation, 1);
    let z = simulation.positions()[2];
    // Of kappa w = 1000 N, an independent program.
    assert!((z - 0.009796444424245).abs() < 1e-11, "{z}");
}

/// A thread that falls across a round bar hangs over it, on both sides, and nowhere inside.
#[test]
fn a_strand_hangs_over_a_capsule() {
    let text = "dimension = 3\ntime = { integrator = 'implicit-euler', step = 5e-3, duration = 1.0 }\n\
                world = { gravity = [0, 0, -9.81] }\ncontact = { distance = 1e-3, friction = 0.4 }\n\
                [[body]]\nname = 'thread'\n\
                mesh = { strand = { segments = 24, start = [-0.3, 0, 0.06], end = [0.3, 0, 0.06] } }\n\
                springs = { stiffness = '500 N/m' }\nmass = { density = '10 g/m' }\ncontact = { radius = \
                2e-3 }\n\
                [[obstacle]]\nname = 'bar'\n\
                shape = { capsule = { axis = [[0.013, -0.2, 0], [0.013, 0.2, 0]], radius = 0.05 } }\n";
    let mut assembly = assembled(text);
    for _ in 0..10 {
        advance(&mut assembly.simulation, 10);
        let x = assembly.simulation.positions();
        for v in 0..25 {
            let from_axis = (x[3 * v] - 0.013).hypot(x[3 * v + 2]);
            assert!(from_axis > 0.052, "vertex {v} at {from_axis} m from the axis");
        }
    }
    let x = assembly.simulation.positions();
    assert!(x[2] < -0.1 && x[3 * 24 + 2] < -0.1, "its ends hang down: {} and {}", x[2], x[74]);
    let top = (0..25).map(|v| x[3 * v + 2]).fold(f64::NEG_INFINITY, f64::max);
    assert!((0.052..0.0545).contains(&top), "{top}");
}

/// The bar turns and takes along what it touches.
#[test]
fn a_capsule_turns_with_its_motion() {
    let text = "dimension = 2\ntime = { integrator = 'implicit-euler', step = 5e-3, duration = 1.0 }\n\
                contact = { distance = 1e-3 }\n\
                [[body]]\nname = 'grain'\nmesh = { inline = { points = [[0.2, 0.03]] } }\n\
                mass = { per_vertex = 0.01 }\ncontact = { radius = 0.005 }\n\
                [[obstacle]]\nname = 'bat'\nshape = { capsule = { axis = [[0, 0], [0.3, 0]], radius = 0.02 \
                } }\n\
                motion = { rotation = { point = [0, 0], speed = 2.0 } }\n";
    let mut simulation = assembled(text).simulation;
    let y = simulation.positions()[1];
    advance(&mut simulation, 40);
    let v = &simulation.state().v()[..2];
    // Pushed ahead by the side that comes at 0.4 m/s.
    assert!(simulation.positions()[1] > y + 0.02 && v[1] > 0.3, "{v:?}");
}

/// Threads that cross hold each other: the loose one stays above the one that is held.
#[test]
fn a_strand_falls_on_a_strand_and_stays_above() {
    let text = "dimension = 3\ntime = { integrator = 'implicit-euler', step = 5e-3, duration = 1.0 }\n\
                world = { gravity = [0, 0, -9.81] }\ncontact = { distance = 1e-3, friction = 0.3 }\n\
                [[body]]\nname = 'held'\n\
                mesh = { strand = { segments = 10, start = [-0.2, 0.003, 0], end = [0.2, 0.003, 0] } }\n\
                springs = { stiffness = '2 kN/m' }\nmass = { density = '10 g/m' }\ncontact = { radius = \
                2e-3 }\n\
                pin = [{ vertices = [0, 10] }]\n\
                [[body]]\nname = 'loose'\n\
                mesh = { strand = { segments = 11, start = [0.01, -0.15, 0.01], end = [0.01, 0.15, 0.01] } \
                }\n\
                springs = { stiffness = '2 kN/m' }\nmass = { density = '10 g/m' }\ncontact = { radius = \
                2e-3 }\n";
    let mut assembly = assembled(text);
    advance(&mut assembly.simulation, 60);
    let contacts = assembly.simulation.contacts();
    assert!(contacts.iter().any(|c| c.bodies[0] != c.bodies[1]), "they touch: {contacts:?}");
    assert!(contacts.iter().all(|c| c.gap > 0.0));
    let x = assembly.simulation.positions();
    let height = |v: usize| x[3 * v + 2];
    assert!((11 + 5..=11 + 6).any(|v| height(v) > height(5)), "the loose one lies on the other");
    let heights: Vec<f64> = (0..23).map(height).collect();
    assert!(height(11) < -0.03 && height(22) < -0.03, "its ends hang: {heights:?}");
}

#[test]
fn strands_and_particles_that_meet_have_a_thickness() {
    let strand = "dimension = 3\ntime = { integrator = 'implicit-euler', step = 5e-3, duration = 1.0 }\n\
                  contact = {}\n[[body]]\nname = 'thread'\n\
                  mesh = { strand = { segments = 4, start = [0, 0, 0.06], end = [0.3, 0, 0.06] } }\n\
                  springs = { stiffness = '500 N/m' }\nmass = { density = '10 g/m' }\n";
    let told = problems(strand);
    assert!(told.contains("strands of `thread` have no thickness") && told.contains("radius"), "{told}");
    assembled(&(strand.to_owned() + "contact = { self = false }\n"));
    assembled(&(strand.to_owned() + "contact = { radius = 1e-3 }\n"));
    let two = strand.to_owned()
        + "contact = { self = false }\n[[body]]\nname = 'grain'\nmesh = { inline = { points = [[0, 0, 0.2]] \
           } }\n\
           mass = { per_vertex = 0.01 }\n";
    let told = problems(&two);
    assert!(told.contains("touch those of `grain`"), "{told}");
    let apart = two.replace(
        "contact = {}",
        "contact = { pairs = [{ between = ['grain', 'thread'], contact = false }] }",
    );
    assembled(&apart);
}

#[test]
fn a_capsule_has_two_ends() {
    let scene = |axis: &str| {
        format!(
            "dimension = 3\ntime = {{ integrator = 'implicit-euler', step = 5e-3, duration = 1.0 \
             }}\ncontact = {{}}\n\
             [[body]]\nmesh = {{ inline = {{ points = [[0, 0, 1]] }} }}\nmass = {{ per_vertex = 0.01 }}\n\
             [[obstacle]]\nshape = {{ capsule = {{ axis = {axis}, radius = 0.1 }} }}\n"
        )
    };
    for (axis, expected) in
        [("[[0, 0, 0], [0, 0, 0]]", "that is a `ball`"), ("[[0, 0, 0]]", "two ends, got 1")]
    {
        let error = pliant_scene::Scene::from_toml(&scene(axis)).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}
