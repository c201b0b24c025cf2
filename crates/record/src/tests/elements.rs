//! Element measures, from the simulation to the reader.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use super::remains;
use crate::BodyRows;
use crate::McapRecorder;
use crate::Options;
use crate::RecordError;
use crate::read::{Trajectory, info, recover};
use pliant::diagnostics::{ElementState, MEASURES};
use pliant::observer::{Frame, Observer, ObserverError};
use pliant::run::{Plan, run};
use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{Channel, Scene};

/// Springs, then two solids, sheared and thrown.
fn scene(dimension: usize) -> Scene {
    let (cells, cloth, velocity) = match dimension {
        2 => ("[2, 1]", "grid = { cells = [1, 1], spacing = 1.0 }", "[1.0, 0.0]"),
        _ => (
            "[2, 1, 1]",
            "cloth = { cells = [1, 1], origin = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0] }",
            "[1.0, 0.0, 0.0]",
        ),
    };
    let matrix = if dimension == 2 {
        "[[1.1, 0.2], [0.0, 0.9]]"
    } else {
        "[[1.1, 0.2, 0.0], [0.0, 0.9, 0.1], [0.0, 0.0, 1.0]]"
    };
    let solid = |name: &str, material: &str| {
        format!(
            "[[body]]\nname = '{name}'\nmesh = {{ grid = {{ cells = {cells}, spacing = 0.5 }} }}\n\
             mass = {{ density = 1000.0 }}\nelastic = {{ {material} = {{ young = 1e5, poisson = 0.3 }} }}\n\
             position = {{ affine = {{ matrix = {matrix} }} }}\nvelocity = {{ rigid = {{ linear = \
             {velocity} }} }}\n"
        )
    };
    let text = format!(
        "dimension = {dimension}\ntime = {{ integrator = 'symplectic-euler', step = 1e-3, duration = 0.02 \
         }}\n\
         [[body]]\nmesh = {{ {cloth} }}\nsprings = {{ stiffness = 1.0 }}\nmass = {{ per_vertex = 1.0 \
         }}\n{}{}",
        solid("a", "corotated"),
        solid("b", "neo-hookean"),
    );
    Scene::from_toml(&text).unwrap_or_else(|error| panic!("{error}"))
}

/// State that the recorder should have received, from the frames alone.
struct Witness(Vec<Vec<ElementState>>);

impl Observer for Witness {
    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        self.0.push(frame.elements.map(<[_]>::to_vec).unwrap_or_default());
        Ok(())
    }
}

fn recorded(scene: &Scene, channels: &[Channel], path: &Path) -> (Assembly, Witness, McapRecorder) {
    let mut scene = scene.clone();
    scene.output.channels = channels.to_vec();
    let mut assembly = scene.assemble(UnstableStep::Refuse).unwrap_or_else(|problems| panic!("{problems:?}"));
    let options = Options { channels: channels.to_vec(), ..Options::default() };
    let mut recorder = McapRecorder::create(path, &options, &assembly.topology).unwrap();
    let mut witness = Witness(vec![]);
    let plan = Plan { duration: 0.02, rate: 100.0 };
    let observers: &mut [&mut dyn Observer] = &mut [&mut witness, &mut recorder];
    run(&mut assembly.simulation, &plan, observers, &AtomicBool::new(false));
    (assembly, witness, recorder)
}

#[test]
fn every_measure_of_every_element_comes_back_bit_by_bit() {
    let directory = tempfile::tempdir().unwrap();
    for dimension in [2, 3] {
        let path = directory.path().join(format!("{dimension}.mcap"));
        let mut channels: Vec<Channel> =
            MEASURES.iter().map(|measure| serde_json::from_value(measure.name.into()).unwrap()).collect();
        channels.push(Channel::State);
        let (assembly, witness, recorder) = recorded(&scene(dimension), &channels, &path);
        recorder.finish().unwrap();
        let per_body = if dimension == 2 { 4 } else { 12 };
        let mut trajectory = Trajectory::open(&path).unwrap();
        assert_eq!(trajectory.times().len(), 3);
        for measure in &MEASURES {
            for (frame, states) in witness.0.iter().enumerate() {
                assert_eq!(states.len(), 2 * per_body);
                let rows = trajectory.elements(measure, frame).unwrap();
                let mut expected = vec![];
                states.iter().for_each(|state| measure.write(state, &mut expected));
                assert_eq!(rows.values, expected, "{} in frame {frame}", measure.name);
                assert_eq!((rows.fields.len(), rows.unit.as_str()), (measure.fields.len(), measure.unit));
                let body = |name: &str, first| BodyRows { name: name.to_owned(), first, count: per_body };
                assert_eq!(rows.bodies, [body("a", 0), body("b", per_body)]);
                // The centroid of the vertices of the element in the topology.
                let x = trajectory.positions(frame).unwrap();
                let last = &assembly.topology.bodies[2];
                let cell: Vec<usize> = match dimension {
                    2 => last.triangles[per_body - 1].iter().map(|v| *v as usize).collect(),
                    _ => last.tetrahedra[per_body - 1].iter().map(|v| *v as usize).collect(),
                };
                for c in 0..dimension {
                    let mean = cell.iter().map(|v| x[v * dimension + c]).sum::<f64>() / cell.len() as f64;
                    let place = rows.places[3 * (2 * per_body - 1) + c];
                    assert!((place - mean).abs() < 1e-15 * 4.0, "{place} is not {mean}");
                }
            }
        }
        assert_ne!(witness.0[0], witness.0[2], "they swing");
    }
}

#[test]
fn only_measures_that_are_named_are_computed() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let (_, witness, recorder) = recorded(&scene(2), &[Channel::State], &path);
    recorder.finish().unwrap();
    assert!(witness.0.iter().all(Vec::is_empty));
    let von_mises = Channel::VonMises.measure().unwrap();
    let error = Trajectory::open(&path).unwrap().elements(von_mises, 0).unwrap_err();
    assert!(error.to_string().contains("has no channel /elements/von-mises"), "{error}");

    let path = directory.path().join("b.mcap");
    let (_, witness, recorder) = recorded(&scene(2), &[Channel::VonMises], &path);
    recorder.finish().unwrap();
    assert_eq!(witness.0[0].len(), 8);
    let info = info(&path).unwrap();
    let topics: Vec<&str> = info.topics.iter().map(|topic| topic.topic.as_str()).collect();
    assert_eq!(topics, ["/elements/von-mises", "/tf"]);
    assert_eq!((info.frames, Trajectory::open(&path).unwrap().times().len()), (3, 3));
}

#[test]
fn a_kill_loses_no_measure() {
    let directory = tempfile::tempdir().unwrap();
    for (number, channels) in [
        vec![Channel::VonMises],
        vec![Channel::Jacobian, Channel::CauchyStress, Channel::Mesh],
        vec![Channel::GreenStrain, Channel::Energy, Channel::State],
        vec![Channel::NodalStress],
        vec![Channel::Zz],
        vec![Channel::VonMises, Channel::Zz, Channel::NodalVonMises, Channel::NodalStress, Channel::Mesh],
    ]
    .into_iter()
    .enumerate()
    {
        let path = directory.path().join(format!("{number}.mcap"));
        let (_, _, recorder) = recorded(&scene(3), &channels, &path);
        let part = remains(&path, "killed");
        assert_eq!(info(&part).unwrap().frames, 3);
        let out = part.with_extension("");
        assert_eq!(recover(&part, &out, false).unwrap().frames, 3, "{channels:?}");
        let outcome = info(&out).unwrap().outcome.unwrap();
        recorder.finish_with(&outcome).unwrap();
        assert!(std::fs::read(out).unwrap() == std::fs::read(path).unwrap(), "{channels:?}");
    }
}

#[test]
fn a_frame_without_the_states_of_its_elements_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let scene = scene(2);
    let assembly = scene.assemble(UnstableStep::Refuse).unwrap_or_else(|problems| panic!("{problems:?}"));
    let options = Options { channels: vec![Channel::Jacobian], ..Options::default() };
    let path = directory.path().join("a.mcap");
    let mut recorder = McapRecorder::create(&path, &options, &assembly.topology).unwrap();
    let (x, v) = (assembly.simulation.positions(), assembly.simulation.velocities());
    let states = assembly.simulation.element_states();
    let frame = |elements| Frame {
        load_factor: None,
        index: 0,
        step: 0,
        time: 0.0,
        dimension: 2,
        x: &x,
        v: &v,
        diagnostics: None,
        elements,
        points: None,
        reactions: None,
        contacts: None,
        nodal_stress: None,
        contact_tractions: None,
        stress_error: None,
        work: pliant::observer::Work::default(),
    };
    let error = recorder.record(&frame(None)).unwrap_err();
    let expected = "frame 0 has no states of elements, which the channel /elements/jacobian records";
    assert_eq!(error.to_string(), expected);
    let error = recorder.record(&frame(Some(&states[..7]))).unwrap_err();
    assert!(matches!(error, RecordError::ElementCount { expected: 8, found: 7, .. }));
    recorder.record(&frame(Some(&states))).unwrap();
}
