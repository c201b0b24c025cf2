//! Probes, from the scene to the reader.

use std::sync::atomic::AtomicBool;

use super::remains;
use crate::McapRecorder;
use crate::Options;
use crate::read::{Trajectory, info, recover};
use pliant::diagnostics::MEASURES;
use pliant::observer::{Frame, Observer, ObserverError};
use pliant::probe::{Reading, Table};
use pliant::run::{Plan, run};
use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{Channel, Scene};

/// A net, a stretched solid, a sheared and rotating one, with probes on all of them.
const BODIES: &str = "dimension = 2
time = { integrator = 'symplectic-euler', step = 1e-4, duration = 0.02 }
[[body]]
name = 'net'
mesh = { grid = { cells = [2, 2], spacing = 0.5, origin = [0.0, 5.0] } }
springs = { stiffness = 100.0 }
mass = { per_vertex = 1.0 }
velocity = { rigid = { linear = [1.0, 2.0] } }
[[body]]
name = 'first'
mesh = { grid = { cells = [2, 1], spacing = 0.5 } }
mass = { density = 1000.0 }
elastic = { corotated = { young = 1e5, poisson = 0.3 } }
position = { affine = { matrix = [[1.2, 0.0], [0.0, 1.0]] } }
[[body]]
name = 'second'
mesh = { grid = { cells = [2, 1], spacing = 0.5, origin = [3.0, 0.0] } }
mass = { density = 1000.0 }
elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }
position = { affine = { matrix = [[1.1, 0.2], [0.0, 0.9]], centre = [3.0, 0.0], translation = [0.0, 1.0] } }
velocity = { rigid = { angular = 3.0 } }
[[probe]]
name = 'middle'
at = [3.3, 0.2]
[[probe]]
name = 'knot'
body = 'net'
vertex = 4
[[probe]]
name = 'mesh'
at = [0.6, 5.1]
[[probe]]
name = 'corner'
at = [1.0, 0.5]
";

/// Deformation gradient of the second body.
const MATRIX: [[f64; 2]; 2] = [[1.1, 0.2], [0.0, 0.9]];

fn assembled() -> Assembly {
    let scene = Scene::from_toml(BODIES).unwrap_or_else(|error| panic!("{error}"));
    scene.assemble(UnstableStep::Refuse).unwrap_or_else(|problems| panic!("{problems:?}"))
}

/// Readings of all probes in every frame.
struct Witness<'a>(&'a Assembly, Vec<Vec<Reading>>);

impl Observer for Witness<'_> {
    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        self.1.push(self.0.probes.iter().map(|probe| probe.read(frame)).collect());
        Ok(())
    }
}

fn close(found: &[f64], expected: &[f64]) -> bool {
    found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-13)
}

#[test]
fn a_probe_moves_with_the_point_that_it_is_on() {
    let assembly = assembled();
    let simulation = &assembly.simulation;
    let (x, v, states) = (simulation.positions(), simulation.velocities(), simulation.point_states());
    let frame = Frame {
        load_factor: None,
        index: 0,
        step: 0,
        time: 0.25,
        dimension: 2,
        x: &x,
        v: &v,
        diagnostics: None,
        elements: None,
        points: Some(&states),
        reactions: None,
        contacts: None,
        nodal_stress: None,
        contact_tractions: None,
        stress_error: None,
        work: pliant::observer::Work::default(),
    };
    let readings: Vec<Reading> = assembly.probes.iter().map(|probe| probe.read(&frame)).collect();
    // Expected: x = c + A (X - c) + t with X - c = (0.3, 0.2).
    let middle = &readings[0];
    assert!(close(&middle.position, &[3.37, 1.18, 0.0]) && close(&middle.displacement, &[0.07, 0.98, 0.0]));
    // Centre of mass of the reference shape, (3.5, 0.25): the velocity field is given on that shape.
    assert!(close(&middle.velocity, &[-3.0 * (0.2 - 0.25), 3.0 * (3.3 - 3.5), 0.0]), "{middle:?}");
    // 1/2 (A^T A - I): A^T A = [[1.21, 0.22], [0.22, 0.85]].
    assert!(close(&middle.green_strain.unwrap(), &[0.105, -0.075, 0.0, 0.11, 0.0, 0.0]));
    // S of A = R S, in the plane: R = ((a, -b), (b, a)) / c, a = A_11 + A_22, b = A_21 - A_12.
    let (a, b) = (MATRIX[0][0] + MATRIX[1][1], MATRIX[1][0] - MATRIX[0][1]);
    let c = a.hypot(b);
    let stretch = |i: usize, j: usize| {
        let turned = [[a / c, -b / c], [b / c, a / c]];
        turned[0][i] * MATRIX[0][j] + turned[1][i] * MATRIX[1][j]
    };
    let strain = [stretch(0, 0) - 1.0, stretch(1, 1) - 1.0, 0.0, stretch(0, 1), 0.0, 0.0];
    assert!(close(&middle.corotated_strain.unwrap(), &strain), "{middle:?}");
    let corner = &readings[3];
    assert!(close(&corner.position, &[1.2, 0.5, 0.0]), "{corner:?}");
    // lecture 13: 1.2 along x; the elements of the body before this one are the net's, which have no
    // strain.
    assert!(close(&corner.green_strain.unwrap(), &[0.22, 0.0, 0.0, 0.0, 0.0, 0.0]));
    // lecture 16: P_11 = 2 mu 0.2 + lambda 0.2, P_22 = lambda 0.2; sigma = P F^T / J.
    let (mu, lambda) = (1e5 / 2.6, 0.3e5 / (1.3 * 0.4));
    let across = 0.2 * lambda / 1.2;
    let expected = [0.2 * (2.0 * mu + lambda), across, across, 0.0, 0.0, 0.0];
    let energy = (mu + 0.5 * lambda) * 0.04;
    assert!((corner.energy_density.unwrap() / energy - 1.0).abs() < 1e-12, "{corner:?}");
    let stress = corner.cauchy_stress.unwrap();
    assert!(stress.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12 * 1e5), "{stress:?}");
    for (reading, place) in [(&readings[1], [0.5, 5.5, 0.0]), (&readings[2], [0.6, 5.1, 0.0])] {
        assert!(close(&reading.position, &place) && close(&reading.displacement, &[0.0; 3]));
        assert_eq!((reading.velocity, reading.time), ([1.0, 2.0, 0.0], 0.25));
        assert_eq!((reading.green_strain, reading.cauchy_stress), (None, None), "a net has no elements");
        assert_eq!((reading.corotated_strain, reading.energy_density), (None, None));
    }
}

#[test]
fn readings_come_back_bit_by_bit_from_the_recording_and_the_table() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let (watched, mut run_through) = (assembled(), assembled());
    let options = Options { channels: vec![], probes: watched.probes.clone(), ..Options::default() };
    let mut recorder = McapRecorder::create(&path, &options, &watched.topology).unwrap();
    let mut text = Vec::new();
    let mut table = Table::new(&watched.probes, &mut text, "");
    let mut witness = Witness(&watched, vec![]);
    let plan = Plan { duration: 0.02, rate: 200.0 };
    let observers: &mut [&mut dyn Observer] = &mut [&mut witness, &mut recorder, &mut table];
    run(&mut run_through.simulation, &plan, observers, &AtomicBool::new(false));
    let part = remains(&path, "killed");
    let out = part.with_extension("");
    assert_eq!(recover(&part, &out, false).unwrap().frames, 5);
    let outcome = info(&out).unwrap().outcome.unwrap();
    recorder.finish_with(&outcome).unwrap();
    assert!(std::fs::read(out).unwrap() == std::fs::read(&path).unwrap(), "a kill loses no reading");

    let found = info(&path).unwrap();
    let topics: Vec<&str> = found.topics.iter().map(|topic| topic.topic.as_str()).collect();
    assert_eq!(topics, ["/probe/corner", "/probe/knot", "/probe/mesh", "/probe/middle"]);
    let mut trajectory = Trajectory::open(&path).unwrap();
    assert_eq!(trajectory.times().len(), 5);
    let text = String::from_utf8(text).unwrap();
    let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!((lines.len(), lines[0].len()), (6, 1 + 2 * (6 + 3 * 6 + 1) + 2 * 6));
    let columns_of_table = |name: &str| {
        let column = lines[0].iter().position(|head| *head == name).unwrap_or_else(|| panic!("{name}"));
        lines[1..].iter().map(|line| line[column].parse().unwrap()).collect::<Vec<f64>>()
    };
    for (i, probe) in watched.probes.iter().enumerate() {
        let columns = trajectory.probe(&probe.name).unwrap();
        let compare = |field: &str, head: &str, read: &dyn Fn(&Reading) -> f64| {
            let expected: Vec<f64> = witness.1.iter().map(|readings| read(&readings[i])).collect();
            let column = columns.iter().find(|column| column.name == field);
            assert_eq!(column.unwrap_or_else(|| panic!("{field}")).values, expected, "{field}");
            assert_eq!(columns_of_table(head), expected, "{head}");
        };
        let name = &probe.name;
        compare("time", "time [s]", &|r| r.time);
        for (c, axis) in ["x", "y"].into_iter().enumerate() {
            compare(&format!("position[{c}]"), &format!("{name}.{axis} [m]"), &|r| r.position[c]);
            compare(&format!("velocity[{c}]"), &format!("{name}.v{axis} [m/s]"), &|r| r.velocity[c]);
            compare(&format!("displacement[{c}]"), &format!("{name}.u{axis} [m]"), &|r| r.displacement[c]);
        }
        assert_eq!(columns.iter().any(|c| c.name == "green_strain[0]"), probe.point.is_some());
        if probe.point.is_some() {
            for (c, pair) in Channel::CauchyStress.measure().unwrap().fields.iter().enumerate() {
                let strain = |r: &Reading| r.green_strain.unwrap()[c];
                let corotated = |r: &Reading| r.corotated_strain.unwrap()[c];
                let stress = |r: &Reading| r.cauchy_stress.unwrap()[c];
                compare(&format!("green_strain[{c}]"), &format!("{name}.E{pair} [1]"), &strain);
                compare(&format!("corotated_strain[{c}]"), &format!("{name}.C{pair} [1]"), &corotated);
                compare(&format!("cauchy_stress[{c}]"), &format!("{name}.s{pair} [Pa]"), &stress);
            }
            let energy = |r: &Reading| r.energy_density.unwrap();
            compare("energy_density", &format!("{name}.psi [J/m^3]"), &energy);
        }
    }
    let knot = trajectory.elements(&MEASURES[0], 0);
    assert!(knot.is_err(), "no channel about elements was named");
}

/// In curved second-order elements, probes are exact at any point: for a deformation quadratic in the
/// reference position with straight reference sides, or an affine one with curved sides, they give
/// position and `F`.
#[test]
fn probes_in_quadratic_elements_are_exact_at_their_point() {
    // A ring whose nodes lie on its circles, and a block.
    for (d, mesh, places) in [
        (
            2,
            "annulus = { inner_radius = 0.5, outer_radius = 1.0, cells = [2, 12] }",
            [[0.3, 0.62, 0.0], [-0.93, 0.1, 0.0]],
        ),
        (3, "grid = { cells = [2, 1, 1], size = [2.0, 1.0, 0.7] }", [[0.3, 0.21, 0.6], [1.9, 0.5, 0.01]]),
    ] {
        let probe =
            |place: &[f64; 3], i: usize| format!("[[probe]]\nname = 'p{i}'\nat = {:?}\n", &place[..d]);
        let probes: String = places.iter().enumerate().map(|(i, place)| probe(place, i)).collect();
        let text = format!(
            "dimension = {d}\ntime = {{ integrator = 'symplectic-euler', step = 1e-6, duration = 1e-6 \
             }}\n[[body]]\n\
             mesh = {{ {mesh} }}\norder = 2\nmass = {{ density = 1000.0 }}\n\
             elastic = {{ stable-neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\n{probes}"
        );
        let scene = Scene::from_toml(&text).unwrap_or_else(|error| panic!("{error}"));
        let mut assembly =
            scene.assemble(UnstableStep::Accept).unwrap_or_else(|problems| panic!("{problems:?}"));
        let rest = assembly.simulation.positions().to_vec();
        // Curved elements do not represent deformations quadratic in X; affine maps they do.
        let bend = if d == 2 { 0.0 } else { 0.2 };
        let moved = |x: &[f64]| {
            let z = x.get(2).copied().unwrap_or(0.0);
            [
                1.1 * x[0] + 0.2 * x[1] + bend * x[0] * x[1],
                0.9 * x[1] - bend * x[0] * x[0],
                z + bend * x[1] * z,
            ]
        };
        let deformation = |x: &[f64; 3]| {
            [
                [1.1 + bend * x[1], 0.2 + bend * x[0], 0.0],
                [-2.0 * bend * x[0], 0.9, 0.0],
                [0.0, bend * x[2], 1.0 + bend * x[1]],
            ]
        };
        let numbering = assembly.simulation.numbering().clone();
        let x: Vec<f64> = rest.chunks(d).flat_map(|x| moved(x)[..d].to_vec()).collect();
        let internal = numbering.to_internal(&x, d).into_owned();
        assembly.simulation.state_mut().x_mut().copy_from_slice(&internal);
        let states = assembly.simulation.point_states();
        assert_eq!(states.len(), 2);
        for (probe, (place, state)) in assembly.probes.iter().zip(places.iter().zip(&states)) {
            assert!(close(&probe.rest, place), "{:?} {place:?}", probe.rest);
            let found = probe.read(&Frame {
                load_factor: None,
                index: 0,
                step: 0,
                time: 0.0,
                dimension: d,
                x: &x,
                v: &x,
                diagnostics: None,
                elements: None,
                points: Some(&states),
                reactions: None,
                contacts: None,
                nodal_stress: None,
                contact_tractions: None,
                stress_error: None,
                work: pliant::observer::Work::default(),
            });
            assert!(close(&found.position[..d], &moved(place)[..d]), "{found:?}");
            let (f, expected) = (state.deformation_gradient.0, deformation(place));
            for r in 0..d {
                assert!(close(&f[r][..d], &expected[r][..d]), "{d}D: {f:?} {expected:?}");
            }
            assert!(found.cauchy_stress.unwrap().iter().any(|s| s.abs() > 1e2));
        }
    }
}

#[test]
fn a_probe_outside_of_all_bodies_is_refused_where_it_stands() {
    let refused = |old: &str, new: &str| {
        let source = pliant_scene::Source::new("scene.toml", BODIES.replacen(old, new, 1));
        let error = match source.scene() {
            Err(error) => error,
            Ok(scene) => source.error(scene.assemble(UnstableStep::Refuse).err().unwrap()),
        };
        error.to_string()
    };
    for (old, new, says) in [
        (
            "at = [3.3, 0.2]",
            "at = [4.25, 0.75]",
            &[
                "24:6",
                "[4.25, 0.75] [m] is in no triangle of any body at rest",
                "`body = \"second\"`, `vertex = 5`",
                "0.3536 m away",
            ][..],
        ),
        ("at = [3.3, 0.2]", "at = [3.3, 0.2]\nbody = 'first'", &["is in no triangle of `first`"]),
        ("vertex = 4", "vertex = 9", &["28:10", "`vertex` is 9, but the body has 9 vertices", "0 to 8"]),
        ("body = 'net'\nvertex", "vertex", &["`vertex` is an index in a body, and there are several"]),
        ("body = 'net'", "body = 'nett'", &["27:8", "there is no body \"nett\"", "did you mean `net`?"]),
        ("name = 'corner'", "name = 'knot'", &["probes 1 and 3 are both named \"knot\""]),
        ("name = 'corner'", "name = 'a/b'", &["\"a/b\" cannot be the name of a probe"]),
        ("at = [1.0, 0.5]", "", &["the probe has neither `at` nor `vertex`"]),
        ("at = [1.0, 0.5]", "at = [1.0, 0.5]\nvertex = 1", &["the probe has both `at` and `vertex`"]),
        ("at = [1.0, 0.5]", "at = [1.0]", &["`at` has 1 number, but `dimension` is 2"]),
        ("at = [1.0, 0.5]", "at = ['1 s', 0.5]", &["[m]"]),
    ] {
        let text = refused(old, new);
        for says in says {
            assert!(text.contains(says), "{says:?} is not in\n{text}");
        }
    }
}
