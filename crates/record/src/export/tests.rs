//! Exported files read back as what was recorded.

use std::path::Path;

use super::{Export, write_pvd};
use crate::McapRecorder;
use crate::Options;
use crate::RecordedOutcome;
use crate::RecordedStatus;
use pliant::observer::Observer;
use pliant::run::{Plan, run};
use pliant_mesh::{Mesh, MidNodes, read};
use pliant_scene::assembly::UnstableStep;
use pliant_scene::{Channel, Scene};

/// A moving solid, a cloth, a strand and particles.
const BODIES: &str = "dimension = 3
time = { integrator = 'velocity-verlet', step = 1e-3, duration = 0.1 }
[world]
gravity = [0.0, 0.0, -9.8]
nbody = { constant = 1.0, softening = 0.1 }
[[body]]
name = 'ball'
mesh = { ball = { radius = 0.5, cells = 2 } }
elastic = { neo-hookean = { young = 1e4, poisson = 0.3 } }
mass = { density = 1000.0 }
[[body]]
name = 'sheet'
mesh = { sphere = { radius = 0.3, cells = 1 } }
transform = { translate = [2.0, 0.0, 0.0] }
springs = { stiffness = 10.0 }
mass = { per_vertex = 0.1 }
[[body]]
name = 'rope'
mesh = { strand = { segments = 2, start = [0.0, 3.0, 0.0], end = [1.0, 3.0, 0.0] } }
springs = { stiffness = 10.0 }
mass = { per_vertex = 0.1 }
velocity = { rigid = { linear = [1.0, 0.0, 0.0] } }
[[body]]
name = 'dust'
mesh = { inline = { points = [[0.0, -3.0, 0.0], [1.0, -3.0, 0.0]] } }
mass = { total = 1.0 }
";

/// Records eleven frames of a scene.
fn recorded(text: &str, path: &Path) -> Vec<f64> {
    recorded_with(text, &[], path)
}

/// Records eleven frames of a scene, with further channels.
fn recorded_with(text: &str, further: &[Channel], path: &Path) -> Vec<f64> {
    let mut scene = Scene::from_toml(text).unwrap_or_else(|error| panic!("{error}"));
    scene.output.channels = [&[Channel::State, Channel::VonMises, Channel::CauchyStress], further].concat();
    let mut assembly = scene.assemble(UnstableStep::Refuse).unwrap_or_else(|p| panic!("{p:?}"));
    let options = Options { channels: scene.output.channels.clone(), ..Options::default() };
    let mut recorder = McapRecorder::create(path, &options, &assembly.topology).unwrap();
    let plan = Plan { duration: 0.1, rate: 100.0 };
    let observers: &mut [&mut dyn Observer] = &mut [&mut recorder];
    run(&mut assembly.simulation, &plan, observers, &std::sync::atomic::AtomicBool::new(false));
    let outcome = RecordedOutcome {
        status: RecordedStatus::Completed,
        step: Some(100),
        time: 0.1,
        message: String::new(),
    };
    recorder.finish_with(&outcome).unwrap();
    assembly.simulation.state().x().to_vec()
}

fn written(export: &mut Export, frame: usize, path: &Path) {
    let mut bytes = Vec::new();
    if path.extension().unwrap() == "vtu" {
        export.write_vtu(frame, &mut bytes).unwrap();
    } else {
        export.write_obj(frame, &mut bytes).unwrap();
    }
    std::fs::write(path, bytes).unwrap();
}

fn read_back(path: &Path, dimension: usize) -> Mesh {
    read(path, dimension, MidNodes::Refuse).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_solid_reads_back_bit_by_bit() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    let only_ball = &BODIES[..BODIES.find("[[body]]\nname = 'sheet'").unwrap()].replace("nbody", "# nbody");
    let last = recorded(only_ball, &file);
    let mut export = Export::open(&file).unwrap();
    assert_eq!(export.times().len(), 11);
    let vtu = folder.path().join("a.vtu");
    written(&mut export, 10, &vtu);
    let mesh = read_back(&vtu, 3);
    assert_eq!(mesh.points, last);
    assert_eq!(mesh.tetrahedra.len(), 160);
    let obj = folder.path().join("a.obj");
    written(&mut export, 10, &obj);
    let surface = read_back(&obj, 3);
    assert_eq!((surface.triangles.len(), surface.vertex_count()), (80, 42));
    assert!(surface.boundary_edges().is_empty());
    assert!(surface.points.chunks(3).all(|x| last.chunks(3).any(|y| x == y)));
    assert_eq!(surface.groups["ball"].cells.len(), 80);
    // The displacement is the motion of the file's points.
    let text = std::fs::read_to_string(&vtu).unwrap();
    let after = text.split("Name=\"displacement\"").nth(1).unwrap();
    let (bytes, _) = pliant_files::base64::decode(after.split(['>', '<']).nth(1).unwrap().as_bytes());
    let moved: Vec<f64> = bytes[8..].as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
    let first = folder.path().join("b.vtu");
    written(&mut export, 0, &first);
    let start = read_back(&first, 3).points;
    assert_eq!(moved, last.iter().zip(&start).map(|(x, x0)| x - x0).collect::<Vec<f64>>());
    assert!(moved.iter().any(|u| u.abs() > 0.01));
}

#[test]
fn bodies_of_every_kind_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    let last = recorded(BODIES, &file);
    let mut export = Export::open(&file).unwrap();
    let mut bytes = Vec::new();
    export.write_vtu(10, &mut bytes).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    let count = last.len() / 3;
    // 160 tetrahedra, 20 triangles, two lines, two vertices.
    assert!(text.contains(&format!("NumberOfPoints=\"{count}\" NumberOfCells=\"184\"")));
    let mut bytes = Vec::new();
    export.write_obj(10, &mut bytes).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    let lines = |start: &str| text.lines().filter(|line| line.starts_with(start)).count();
    assert_eq!((lines("o "), lines("f "), lines("l "), lines("p ")), (4, 80 + 20, 2, 2));
    assert_eq!(lines("v "), 42 + 12 + 3 + 2);
    assert!(text.lines().any(|line| line == "l 55 56"), "numbers go on through the file");
}

#[test]
fn plane_bodies_lie_in_the_plane() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    let text = "dimension = 2
time = { integrator = 'velocity-verlet', step = 1e-4, duration = 0.1 }
[[body]]
mesh = { cooks_membrane = { cells = [2, 2] } }
transform = { scale = 0.01 }
elastic = { linear = { young = 1e4, poisson = 0.3 } }
mass = { density = 1000.0 }
velocity = { rigid = { angular = 1.0 } }
";
    let last = recorded(text, &file);
    let mut export = Export::open(&file).unwrap();
    let vtu = folder.path().join("a.vtu");
    written(&mut export, 10, &vtu);
    assert_eq!(read_back(&vtu, 2).points, last);
}

#[test]
fn collections_escape_their_names() {
    let mut bytes = Vec::new();
    write_pvd(&[(0.25, "a&b\".vtu".to_owned())], &mut bytes).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    assert!(text.contains("timestep=\"0.25\" part=\"0\" file=\"a&amp;b&quot;.vtu\""), "{text}");
    assert!(roxmltree::Document::parse(&text).is_ok());
}

#[test]
fn cells_that_are_elements_carry_what_was_recorded_of_them() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    let density = "mass = { density = 1000.0 }";
    let spinning = format!("{density}\nvelocity = {{ rigid = {{ angular = [0.0, 0.0, 5.0] }} }}");
    recorded(&BODIES.replacen(density, &spinning, 1), &file);
    let mut export = Export::open(&file).unwrap();
    let mut bytes = Vec::new();
    export.write_vtu(7, &mut bytes).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    let array = |name: &str| {
        let start = text.find(&format!("Name=\"{name}\"")).unwrap();
        let line = text[start..].lines().nth(1).unwrap();
        let (bytes, _) = pliant_files::base64::decode(line.as_bytes());
        let numbers: Vec<f64> =
            bytes[8..].as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
        numbers
    };
    let mut trajectory = crate::read::Trajectory::open(&file).unwrap();
    for measure in pliant::diagnostics::MEASURES.iter().filter(|m| text.contains(m.name)) {
        let rows = trajectory.elements(measure, 7).unwrap();
        assert!(rows.values.iter().any(|value| value.abs() > 1.0), "a spinning ball is under stress [Pa]");
        let (found, elements) = (array(measure.name), rows.values.len());
        // The ball is the first body.
        assert_eq!(found[..elements], rows.values, "{}", measure.name);
        assert!(found.len() > elements && found[elements..].iter().all(|value| value.is_nan()));
    }
    assert_eq!(
        text.matches("Name=\"von-mises\"").count() + text.matches("Name=\"cauchy-stress\"").count(),
        2
    );
}

/// Points carry what was recorded at vertices; those of other bodies have no stress.
#[test]
fn points_carry_recovered_stresses_and_their_principal_values() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    let density = "mass = { density = 1000.0 }";
    let spinning = format!("{density}\nvelocity = {{ rigid = {{ angular = [0.0, 0.0, 5.0] }} }}");
    let nodal = [Channel::NodalVonMises, Channel::NodalStress, Channel::Zz];
    recorded_with(&BODIES.replacen(density, &spinning, 1), &nodal, &file);
    let mut bytes = Vec::new();
    Export::open(&file).unwrap().write_vtu(7, &mut bytes).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    let array = |part: &str, name: &str| {
        let part = text.split(&format!("<{part}>")).nth(1).unwrap();
        let after = part.split(&format!("Name=\"{name}\"")).nth(1).unwrap();
        let (bytes, _) = pliant_files::base64::decode(after.split(['>', '<']).nth(1).unwrap().as_bytes());
        bytes[8..].as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect::<Vec<f64>>()
    };
    let mut trajectory = crate::read::Trajectory::open(&file).unwrap();
    let mut rows = |name: &str| {
        let field = pliant::diagnostics::RecordedField::named(name).unwrap();
        trajectory.field(&field, 7).unwrap().values
    };
    let (von_mises, stress) = (array("PointData", "nodal-von-mises"), array("PointData", "nodal-stress"));
    let principal = ["1", "2", "3"].map(|k| array("PointData", &format!("principal-{k}")));
    let ball = rows("nodal-von-mises").iter().filter(|value| !value.is_nan()).count();
    assert!(ball > 42 && von_mises.len() > ball && stress.len() == 6 * von_mises.len());
    assert_eq!(von_mises[..ball], rows("nodal-von-mises")[..ball]);
    assert_eq!(stress[..6 * ball], rows("nodal-stress")[..6 * ball]);
    assert!(von_mises[ball..].iter().chain(&principal[1][ball..]).all(|value| value.is_nan()));
    for (vertex, von_mises) in von_mises[..ball].iter().enumerate() {
        let [a, b, c] = principal.each_ref().map(|values| values[vertex]);
        assert!(a >= b && b >= c, "{a} {b} {c}");
        // Invariants of the tensor.
        let trace: f64 = stress[6 * vertex..][..3].iter().sum();
        let size = a.abs().max(c.abs());
        assert!(size > 1.0 && (a + b + c - trace).abs() < 1e-12 * size, "{a} {b} {c}: {trace}");
        let squares = (a - b).powi(2) + (b - c).powi(2) + (c - a).powi(2);
        assert!(((0.5 * squares).sqrt() - von_mises).abs() < 1e-12 * size, "{a} {b} {c}: {von_mises}");
    }
    let error = array("CellData", "zz");
    assert_eq!(error[..160], rows("zz"));
    assert!(error[..160].iter().all(|eta| *eta > 0.0) && error[160..].iter().all(|eta| eta.is_nan()));
}

/// Arrays and tables agree, body by body and measure by measure: arrays with all numbers, columns with
/// minima and maxima.
#[test]
fn arrays_and_tables_carry_what_was_recorded_of_elements() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    let density = "mass = { density = 1000.0 }";
    let spinning = format!("{density}\nvelocity = {{ rigid = {{ angular = [0.0, 0.0, 5.0] }} }}");
    recorded(&BODIES.replacen(density, &spinning, 1), &file);
    let mut trajectory = crate::read::Trajectory::open(&file).unwrap();
    let mut export = Export::open(&file).unwrap();
    let (mut csv, mut npz) = (Vec::new(), Vec::new());
    export.write_csv(&mut csv).unwrap();
    export.write_npz(&[3, 7], &mut npz).unwrap();
    let csv = String::from_utf8(csv).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!((rows.len(), rows[0][0], rows[0].len()), (12, "time", 1 + 2 + 12));
    let cell = |frame: usize, name: &str| -> f64 {
        rows[1 + frame][rows[0].iter().position(|column| *column == name).unwrap()].parse().unwrap()
    };
    let array = |name: &str| {
        let name = format!("{name}.npy");
        let at = npz.windows(name.len()).position(|window| window == name.as_bytes()).unwrap() + name.len();
        let length = usize::from(u16::from_le_bytes([npz[at + 8], npz[at + 9]]));
        let header = String::from_utf8_lossy(&npz[at + 10..at + 10 + length]).into_owned();
        let numbers = npz[at + 10 + length..].as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b));
        (header, numbers.take(2 * 160 * 6).collect::<Vec<f64>>())
    };
    for (measure, fields) in [("von-mises", 1), ("cauchy-stress", 6)] {
        let measure = pliant::diagnostics::Measure::named(measure).unwrap();
        let (header, numbers) = array(&format!("ball.{}", measure.name));
        let shape = if fields == 1 { "(2, 160,)" } else { "(2, 160, 6,)" };
        assert!(header.contains(shape), "{header}");
        for (i, frame) in [3, 7].into_iter().enumerate() {
            let values = trajectory.elements(measure, frame).unwrap().values;
            assert_eq!(numbers[i * values.len()..][..values.len()], values);
            for (k, field) in measure.fields.iter().enumerate() {
                let of_field = || values.iter().skip(k).step_by(fields).copied();
                let field = if fields > 1 { format!(".{field}") } else { String::new() };
                let name = |extreme: &str| format!("ball.{}{field}.{extreme}", measure.name);
                assert_eq!(cell(frame, &name("max")), of_field().fold(f64::NEG_INFINITY, f64::max));
                assert_eq!(cell(frame, &name("min")), of_field().fold(f64::INFINITY, f64::min));
            }
        }
    }
}

#[test]
fn quadrilaterals_and_hexahedra_read_back_with_their_stresses() {
    for (dimension, cells, element) in [(2, "[3, 2]", "quadrilateral"), (3, "[3, 2, 2]", "hexahedron")] {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("run.mcap");
        let text = format!(
            "dimension = {dimension}
time = {{ integrator = 'velocity-verlet', step = 1e-3, duration = 0.1 }}
[[body]]
mesh = {{ grid = {{ cells = {cells}, spacing = 0.1, element = '{element}' }} }}
elastic = {{ neo-hookean = {{ young = 1e4, poisson = 0.3 }} }}
mass = {{ density = 1000.0 }}
pin = [{{ half_space = {{ normal = [1.0, 0.0, 0.0], offset = 0.0 }} }}]
[world]
gravity = [0.0, -9.8, 1.0]
"
        );
        let text = if dimension == 2 {
            text.replace(", 0.0], offset", "], offset").replace(", 1.0]", "]")
        } else {
            text
        };
        let last = recorded(&text, &file);
        let mut export = Export::open(&file).unwrap();
        let vtu = folder.path().join("a.vtu");
        written(&mut export, 10, &vtu);
        let mesh = read_back(&vtu, dimension);
        assert_eq!(mesh.points, last);
        let block = mesh.block().unwrap();
        assert_eq!((block.kind.name, block.len()), (element, if dimension == 2 { 6 } else { 12 }));
        let text = std::fs::read_to_string(&vtu).unwrap();
        let after = text.split("Name=\"von-mises\"").nth(1).unwrap();
        let (bytes, _) = pliant_files::base64::decode(after.split(['>', '<']).nth(1).unwrap().as_bytes());
        let stresses: Vec<f64> =
            bytes[8..].as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
        assert!(stresses.len() == block.len() && stresses.iter().all(|stress| *stress > 1.0), "{stresses:?}");
        let obj = folder.path().join("a.obj");
        written(&mut export, 10, &obj);
        let surface = read_back(&obj, 3);
        // Two triangles for each quadrilateral of the closed surface.
        let faces = if dimension == 2 { 6 } else { 2 * (3 * 2 + 3 * 2 + 2 * 2) };
        assert_eq!(surface.triangles.len(), 2 * faces);
        assert_eq!(surface.boundary_edges().len(), if dimension == 2 { 10 } else { 0 });
    }
}

/// Other programs get the embedded surface as surface and the elements as solids; the recorded surface is
/// the attached one.
#[test]
fn skins_are_exported_as_surfaces() {
    let folder = tempfile::tempdir().unwrap();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n\
        f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";
    std::fs::write(folder.path().join("cube.obj"), text).unwrap();
    let scene = format!(
        "dimension = 3
        time = {{ integrator = 'velocity-verlet', step = 1e-3, duration = 0.1 }}
        world = {{ gravity = [0.0, 0.0, -10.0] }}
        [[body]]
        name = 'cube'
        mesh = {{ surface = {{ path = '{}', cells = 2 }} }}
        elastic = {{ neo-hookean = {{ young = 1e4, poisson = 0.3 }} }}
        mass = {{ density = 1000.0 }}",
        folder.path().join("cube.obj").display()
    );
    let file = folder.path().join("run.mcap");
    recorded(&scene, &file);
    let mut export = Export::open(&file).unwrap();
    for (name, count, z) in [("a.obj", 8, Some(-0.05)), ("a.vtu", 0, None)] {
        let path = folder.path().join(name);
        written(&mut export, 10, &path);
        let mesh = read(&path, 3, MidNodes::Refuse);
        match z {
            Some(z) => {
                let lines = std::fs::read_to_string(&path).unwrap();
                assert_eq!(lines.lines().filter(|line| line.starts_with("v ")).count(), count);
                assert_eq!(lines.lines().filter(|line| line.starts_with("f ")).count(), 12);
                let last = lines.lines().find(|line| line.starts_with("v ")).unwrap();
                let height: f64 = last.split(' ').next_back().unwrap().parse().unwrap();
                assert!((height - z).abs() < 1e-12, "{last}");
            }
            None => {
                let mesh = mesh.unwrap();
                assert!(!mesh.tetrahedra.is_empty() && mesh.vertex_count() == export.bodies.vertex_count);
            }
        }
    }
}
