//! Stress at nodes in recordings and at probes.

use std::sync::atomic::AtomicBool;

use pliant::diagnostics::recovery::Recovery;
use pliant::diagnostics::{NODAL_MEASURES, RecordedField};
use pliant::observer::{Frame, Observer, ObserverError, Quantities};
use pliant::probe::{self, Table};
use pliant::run::run;
use pliant_record::read::{RecordedRows, Trajectory};
use pliant_record::{McapRecorder, Options};
use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{Problem, Scene};
use tempfile::TempDir;

/// Assembles and runs a scene, recorded as it asks for. The folder holds the file.
fn recorded(text: &str) -> (Assembly, Trajectory, TempDir) {
    let scene = Scene::from_toml(text).unwrap_or_else(|error| panic!("{error}"));
    let mut assembly = scene.assemble(UnstableStep::Refuse).unwrap_or_else(|problems| panic!("{problems:?}"));
    let (channels, probes) = (scene.output.channels.clone(), assembly.probes.clone());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let options = Options { channels, probes, ..Options::default() };
    let mut recorder = McapRecorder::create(&path, &options, &assembly.topology).unwrap();
    run(&mut assembly.simulation, &scene.plan(), &mut [&mut recorder], &AtomicBool::new(false));
    recorder.finish().unwrap();
    (assembly, Trajectory::open(&path).unwrap(), folder)
}

fn rows(trajectory: &mut Trajectory, name: &str, frame: usize) -> RecordedRows {
    trajectory.field(&RecordedField::named(name).unwrap(), frame).unwrap()
}

/// Young's modulus of the bodies [Pa].
const YOUNG: f64 = 1e5;

/// A body in `dimension` dimensions, stretched by a fifth along x.
fn stretched(dimension: usize, name: &str, keys: &str, young: f64) -> String {
    let mesh = if dimension == 2 { "cells = [3, 2]" } else { "cells = [3, 2, 2]" };
    let matrix = if dimension == 2 { "[[1.2, 0], [0, 1]]" } else { "[[1.2, 0, 0], [0, 1, 0], [0, 0, 1]]" };
    let centre = if dimension == 2 { "[0, 0]" } else { "[0, 0, 0]" };
    let (element, order) = keys.split_once(';').unwrap_or((keys, ""));
    format!(
        "[[body]]\nname = '{name}'\nmesh = {{ grid = {{ {mesh}, spacing = 0.25 {element} }} }}\n{order}\n\
         mass = {{ density = 1000.0 }}\n\
         elastic = {{ corotated = {{ young = {young:?}, poisson = 0.3 }} }}\n\
         position = {{ affine = {{ centre = {centre}, matrix = {matrix} }} }}\n"
    )
}

/// Stress of the stretched body, `P = 2 mu (F - I) + lambda tr(F - I) I`, `sigma = P F^T / J` [Pa].
fn exact(young: f64) -> [f64; 6] {
    let (mu, lambda) = (young / 2.6, 0.3 * young / (1.3 * 0.4));
    let across = 0.2 * lambda / 1.2;
    [0.2 * (2.0 * mu + lambda), across, across, 0.0, 0.0, 0.0]
}

/// Fails unless every row is the exact stress of this body, to rounding.
#[track_caller]
fn assert_uniform(rows: &[f64], young: f64, what: &str) {
    assert!(!rows.is_empty());
    for row in rows.chunks_exact(6) {
        let off = row.iter().zip(exact(young)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-10 * young, "{what}: {row:?} is not {:?}", exact(young));
    }
}

// Patch test: the stress of an affine motion is exact at every vertex, those of the boundary included.
#[test]
fn a_uniform_stress_is_exact_at_every_vertex() {
    let kinds = [
        (2, ""),
        (2, ";order = 2"),
        (2, ", element = 'quadrilateral'"),
        (2, ", element = 'quadrilateral';order = 2"),
        (3, ""),
        (3, ", element = 'hexahedron'"),
        (3, ", element = 'hexahedron';order = 2\nserendipity = true"),
    ];
    for ((dimension, keys), recovery) in
        kinds.into_iter().flat_map(|kind| ["patch", "average"].map(|recovery| (kind, recovery)))
    {
        let what = format!("{dimension}D {keys} {recovery}");
        let (assembly, mut trajectory, _folder) = recorded(&format!(
            "dimension = {dimension}\n\
             time = {{ integrator = 'velocity-verlet', step = 1e-5, duration = 0.0 }}\n\
             output = {{ channels = ['nodal-von-mises', 'nodal-stress', 'zz'], recovery = '{recovery}' }}\n\
             {}",
            stretched(dimension, "bar", keys, YOUNG)
        ));
        let stress = rows(&mut trajectory, "nodal-stress", 0);
        assert_eq!(stress.values.len(), 6 * assembly.topology.vertex_count, "{what}");
        assert_uniform(&stress.values, YOUNG, &what);
        let x = assembly.simulation.positions();
        let places = stress.places.chunks_exact(3).zip(x.chunks_exact(dimension));
        assert!(places.into_iter().all(|(place, x)| place[..dimension] == *x), "{what}");
        let expected = exact(YOUNG)[0] - exact(YOUNG)[1];
        let von_mises = rows(&mut trajectory, "nodal-von-mises", 0);
        assert_eq!((von_mises.fields.len(), von_mises.unit.as_str()), (1, "Pa"));
        assert!(von_mises.values.iter().all(|s| (s - expected).abs() < 1e-10 * YOUNG), "{what}");
        let error = rows(&mut trajectory, "zz", 0).values;
        assert_eq!(error.len(), assembly.simulation.element_states().len());
        // The square root of an energy whose stresses are exact to rounding.
        assert!(error.iter().all(|eta| *eta < 1e-10 * YOUNG.sqrt()), "{what}: {error:?}");
    }
}

/// A thick ring, held at one side and pulled by a force that grows.
fn ring(time: &str, recovery: &str) -> String {
    format!(
        "dimension = 2
time = {{ {time} }}
output = {{ rate = 100.0, channels = ['nodal-von-mises', 'nodal-stress', 'zz'], recovery = '{recovery}' }}
[[body]]
name = 'ring'
mesh = {{ annulus = {{ inner_radius = 0.1, outer_radius = 0.3, cells = [4, 24] }} }}
mass = {{ density = 1000.0 }}
elastic = {{ neo-hookean = {{ young = 1e6, poisson = 0.3 }} }}
load = [{{ vertices = [0, 1, 2, 3], force = ['3e4 * t', 0.0] }}]
pin = [{{ half_space = {{ normal = [1.0, 0.0], offset = -0.2 }} }}]
"
    )
}

#[test]
fn channels_have_the_bits_of_the_recovery_in_statics_and_dynamics() {
    for time in [
        "integrator = 'quasi-static', step = 0.01, duration = 0.02",
        "integrator = 'velocity-verlet', step = 1e-4, duration = 0.02",
    ] {
        for (name, recovery) in [("patch", Recovery::Patch), ("average", Recovery::Average)] {
            let (assembly, mut trajectory, _folder) = recorded(&ring(time, name));
            assert_eq!(trajectory.times().len(), 3);
            let Assembly { simulation, topology, .. } = &assembly;
            let expected = simulation.nodal_stress(topology, recovery);
            assert!(expected.von_mises().iter().any(|stress| *stress > 1e3), "the ring is loaded [Pa]");
            let (stress, von_mises) =
                (rows(&mut trajectory, "nodal-stress", 2), rows(&mut trajectory, "nodal-von-mises", 2));
            assert_eq!(von_mises.values, expected.von_mises());
            for (vertex, tensor) in expected.vertices.iter().zip(&expected.stress) {
                let row = &stress.values[6 * *vertex as usize..][..6];
                let entries = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];
                assert_eq!(row, entries.map(|(i, j)| tensor[i][j]));
            }
            let error = simulation.stress_error(topology, recovery).unwrap();
            assert_eq!(rows(&mut trajectory, "zz", 2).values, error.elements);
            assert_ne!(von_mises.values, rows(&mut trajectory, "nodal-von-mises", 1).values);
        }
    }
}

/// A rope without elements.
const ROPE: &str = "[[body]]\nname = 'rope'\n\
    mesh = { strand = { segments = 1, start = [0, 3], end = [1, 3] } }\n\
    springs = { stiffness = 1.0 }\nmass = { per_vertex = 1.0 }\n";

#[test]
fn stress_is_not_averaged_across_bodies() {
    let right = stretched(2, "hard", ", origin = [0.75, 0.0]", 10.0 * YOUNG);
    let tie = "[[attachment]]\nname = 'glue'\nbody = 'soft'\n\
               half_space = { normal = [-1.0, 0.0], offset = -0.75 }\n\
               target = { body = 'hard', nearest_vertex = '1 um' }\nstiffness = 10.0\n";
    for recovery in ["patch", "average"] {
        let (assembly, mut trajectory, _folder) = recorded(&format!(
            "dimension = 2\ntime = {{ integrator = 'velocity-verlet', step = 1e-5, duration = 0.0 }}\n\
             output = {{ channels = ['nodal-stress', 'nodal-von-mises'], recovery = '{recovery}' }}\n\
             {ROPE}{}{}{tie}",
            stretched(2, "soft", "", YOUNG),
            right
        ));
        let stress = rows(&mut trajectory, "nodal-stress", 0);
        let bodies: Vec<&str> = stress.bodies.iter().map(|body| body.name.as_str()).collect();
        assert_eq!(bodies, ["soft", "hard"], "a rope has no elements");
        let of = |body: usize| {
            let body = &stress.bodies[body];
            let topology = assembly.topology.bodies.iter().find(|other| other.name == body.name).unwrap();
            let range = topology.vertices.start as usize..topology.vertices.end as usize;
            assert_eq!(body.first..body.first + body.count, range.clone());
            &stress.values[6 * range.start..6 * range.end]
        };
        assert_uniform(of(0), YOUNG, recovery);
        assert_uniform(of(1), 10.0 * YOUNG, recovery);
        let of_rope = &rows(&mut trajectory, "nodal-von-mises", 0).values[..2];
        assert!(of_rope.iter().all(|stress| stress.is_nan()), "{of_rope:?}");
    }
}

/// Probes in an element and at a vertex, with the stress at nodes, and one without.
const PROBES: &str = "[[probe]]\nname = 'inside'\nat = [0.17, 0.06]\nnodal_stress = true\n\
    [[probe]]\nname = 'corner'\nvertex = 7\nnodal_stress = true\n\
    [[probe]]\nname = 'bare'\nat = [0.17, 0.06]\n";

#[test]
fn probes_read_the_recovered_stress_in_their_element() {
    let time = "integrator = 'quasi-static', step = 0.01, duration = 0.02";
    let output = "channels = ['nodal-von-mises', 'nodal-stress', 'zz'], recovery = 'patch' ";
    let text = ring(time, "patch").replace(output, "channels = ['state']") + PROBES;
    let (mut assembly, mut trajectory, _folder) = recorded(&text);
    let Assembly { simulation, topology, probes, .. } = &assembly;
    let expected = simulation.nodal_stress(topology, Recovery::Patch);
    assert_eq!(expected.vertices, (0..topology.vertex_count as u32).collect::<Vec<u32>>());
    for probe in &probes[..2] {
        assert_eq!(probe.vertices.len(), if probe.name == "inside" { 3 } else { 1 });
        let mut sum = [0.0; 6];
        for (vertex, weight) in probe.vertices.iter().zip(&probe.weights) {
            let tensor = expected.stress[*vertex as usize];
            let entries = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(|(i, j)| tensor[i][j]);
            sum.iter_mut().zip(entries).for_each(|(sum, entry)| *sum += weight * entry);
        }
        let columns = trajectory.probe(&probe.name).unwrap();
        let last = |name: &str| {
            let column = columns.iter().find(|column| column.name == name);
            column.unwrap_or_else(|| panic!("no {name}")).values[2]
        };
        for (k, entry) in sum.iter().enumerate() {
            assert_eq!(last(&format!("nodal_stress[{k}]")), *entry, "{}", probe.name);
        }
        let [xx, yy, zz, xy, yz, xz] = sum;
        let squares = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
        let von_mises = (0.5 * squares + 3.0 * (xy * xy + yz * yz + xz * xz)).sqrt();
        let found = last("nodal_von_mises");
        assert!(found > 1e3 && (found / von_mises - 1.0).abs() < 1e-12, "{found} is not {von_mises}");
    }
    let bare = trajectory.probe("bare").unwrap();
    assert!(bare.iter().all(|column| !column.name.starts_with("nodal")), "only where it is asked for");
    // The same numbers in a table.
    let probes = probes.clone();
    let titles = probe::titles(&probes, 2, false);
    assert!(titles.contains("inside.nodal_sxx [Pa],inside.nodal_syy [Pa]"), "{titles}");
    assert!(titles.contains("corner.nodal_von_mises [Pa],") && !titles.contains("bare.nodal"), "{titles}");
    let (mut out, columns) = (Vec::new(), titles.split(',').count());
    let mut table = Table::new(&probes, &mut out, "writing a table");
    Frame::of_state(&mut assembly.simulation, 0, table.quantities(), None, |frame| table.frame(frame))
        .unwrap();
    let line = String::from_utf8(out).unwrap().lines().nth(1).unwrap().to_owned();
    assert_eq!(line.split(',').count(), columns);
    let at = titles.split(',').position(|title| title == "inside.nodal_von_mises [Pa]").unwrap();
    let inside = trajectory.probe("inside").unwrap();
    let of_file = inside.iter().find(|column| column.name == "nodal_von_mises").unwrap().values[2];
    assert_eq!(line.split(',').nth(at).unwrap().parse::<f64>().unwrap(), of_file);
}

/// Quantities of frames that a run computed.
struct Seen(Quantities, Quantities);

impl Observer for Seen {
    fn quantities(&self) -> Quantities {
        self.0
    }

    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        self.1 |= frame.quantities();
        Ok(())
    }
}

#[test]
fn nothing_is_recovered_that_is_not_named() {
    let all = Quantities::NODAL_STRESS | Quantities::STRESS_ERROR;
    let named = "['nodal-von-mises', 'nodal-stress', 'zz'], recovery = 'patch'";
    let time = "integrator = 'velocity-verlet', step = 1e-4, duration = 0.01";
    for (channels, asked, computed) in [
        ("['state', 'von-mises']", all, Quantities::NONE),
        ("['nodal-von-mises']", all, all),
        ("['zz']", Quantities::STRESS_ERROR, Quantities::STRESS_ERROR),
    ] {
        let text = ring(time, "patch").replace(named, channels);
        let scene = Scene::from_toml(&text).unwrap_or_else(|error| panic!("{error}"));
        let mut assembly = scene.assemble(UnstableStep::Refuse).unwrap_or_else(|p| panic!("{p:?}"));
        let mut seen = Seen(asked, Quantities::NONE);
        run(&mut assembly.simulation, &scene.plan(), &mut [&mut seen], &AtomicBool::new(false));
        assert_eq!(seen.1, Quantities::STATE | computed, "{channels}");
        assert_eq!(assembly.simulation.recovered_stress().is_some(), channels != "['state', 'von-mises']");
    }
    let names = NODAL_MEASURES.map(|measure| measure.name);
    assert_eq!(names, ["nodal-von-mises", "nodal-stress"]);
}

#[test]
fn what_cannot_be_recovered_is_refused() {
    let time = "integrator = 'velocity-verlet', step = 1e-4, duration = 0.01";
    let told = |text: &str| {
        let problems = match Scene::from_toml(text) {
            Err(error) => error.problems().to_vec(),
            Ok(scene) => scene.assemble(UnstableStep::Refuse).err().unwrap(),
        };
        let line =
            |problem: &Problem| format!("{}: {}; {}", problem.path, problem.message, problem.help.join("; "));
        problems.iter().map(line).collect::<Vec<String>>().join("\n")
    };
    let named = "channels = ['nodal-von-mises', 'nodal-stress', 'zz'], recovery = 'patch'";
    let element = told(&ring(time, "element"));
    assert!(element.contains("output.recovery: `element` gives each element its own stress"), "{element}");
    assert!(element.contains("use \"patch\" or \"average\""), "{element}");
    let idle = told(&ring(time, "patch").replace(named, "channels = ['state'], recovery = 'average'"));
    assert!(idle.contains("output.recovery: `recovery` has no effect: nothing reads its stress"), "{idle}");
    let unknown = told(&ring(time, "spr"));
    assert!(unknown.contains("`patch`"), "{unknown}");
    let probe = "[[probe]]\nname = 'knot'\nbody = 'rope'\nvertex = 0\nnodal_stress = true\n";
    let of_rope = told(&format!("{}{ROPE}{probe}", ring(time, "patch")));
    assert!(of_rope.contains("probe.0.nodal_stress: `nodal_stress` is about finite elements"), "{of_rope}");
    let alone = "dimension = 2\ntime = { integrator = 'velocity-verlet', step = 1e-4, duration = 0.01 }\n\
                 output = { channels = ['nodal-stress'] }\n";
    let springs = told(&format!("{alone}{ROPE}"));
    assert!(springs.contains("channel `nodal-stress` is about finite elements"), "{springs}");
    let sheet = told(
        "dimension = 3\ntime = { integrator = 'velocity-verlet', step = 1e-6, duration = 0.01 }\n\
         output = { channels = ['nodal-stress', 'zz'] }\n[[body]]\nname = 'sail'\n\
         mesh = { cloth = { cells = [2, 2], origin = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0] } }\n\
         membrane = { thickness = 0.01 }\nmass = { density = 1000.0 }\n\
         elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }\n",
    );
    assert!(sheet.contains("output.channels.1: channel `zz` divides by the stiffness of solids"), "{sheet}");
    assert!(!sheet.contains("channels.0"), "membranes have a stress at nodes: {sheet}");
}

/// A bar of 1 m that is pulled by 1 %: displacements along it grow evenly, and its stress is the same.
#[test]
fn a_line_is_a_row_of_probes() {
    let bar = "dimension = 2\ntime = { integrator = 'quasi-static', step = 1.0, duration = 1.0 }\n\
               [[body]]\nname = 'bar'\nmesh = { grid = { cells = [4, 2], size = [1.0, 0.5] } }\n\
               elastic = { linear = { young = 1e6, poisson = 0.0 } }\nmass = { density = 1.0 }\n\
               pin = [{ half_space = { normal = [1, 0], offset = 0 } },\n\
               { half_space = { normal = [-1, 0], offset = -1 }, motion = { velocity = [0.01, 0.0] } }]\n";
    let line = "[[probe]]\nname = 'cut'\nat = [0.1, 0.2]\nline = { to = [0.9, 0.3], points = 5 }\n";
    let (assembly, mut trajectory, _folder) = recorded(&format!("{bar}{line}"));
    let names: Vec<&str> = assembly.probes.iter().map(|probe| &probe.name[..]).collect();
    assert_eq!(names, ["cut-0", "cut-1", "cut-2", "cut-3", "cut-4"]);
    for (i, name) in names.iter().enumerate() {
        let (columns, place) = (trajectory.probe(name).unwrap(), 0.1 + 0.2 * i as f64);
        let last = |title: &str| {
            let column = columns.iter().find(|column| column.name == title);
            *column.unwrap_or_else(|| panic!("no {title}")).values.last().unwrap()
        };
        assert!((assembly.probes[i].rest[0] - place).abs() < 1e-15);
        assert!((last("displacement[0]") - 0.01 * place).abs() < 1e-12, "{name}");
        assert!((last("cauchy_stress[0]") - 1e4).abs() < 1e-6, "{name}");
    }
    let told = |text: String| match Scene::from_toml(&text) {
        Ok(_) => panic!("accepted: {text}"),
        Err(error) => error.to_string(),
    };
    let second = "[[probe]]\nname = 'cut-3'\nat = [0.5, 0.2]\n";
    let twice = told(format!("{bar}{line}{second}"));
    assert!(twice.contains("probes 0 and 1 are both named \"cut-3\""), "{twice}");
    let vertex = told(format!("{bar}{}", line.replace("at = [0.1, 0.2]", "vertex = 3")));
    assert!(vertex.contains("a `line` begins at `at`"), "{vertex}");
    let one = told(format!("{bar}{}", line.replace("points = 5", "points = 1")));
    assert!(one.contains("a line has 2 to 1000 `points`, not 1"), "{one}");
}
