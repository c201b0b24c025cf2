//! Forces of pins and the energy balance, from the scene to the reader.

use std::sync::atomic::AtomicBool;

use super::remains;
use crate::McapRecorder;
use crate::Options;
use crate::read::{Column, Trajectory, info, recover};
use pliant::diagnostics::{Balance, Reaction};
use pliant::observer::{Frame, Observer, ObserverError};
use pliant::run::{Plan, run};
use pliant_scene::assembly::UnstableStep;
use pliant_scene::{Scene, Source};

/// A damped bar above a wall, between two pins, one moving and the other released.
const BAR: &str = "dimension = 2
time = { integrator = 'velocity-verlet', step = 1e-3, duration = 0.1 }
world = { gravity = ['sin(t)', -9.81], ether_drag = 0.5, walls = [{ normal = [0, 1], offset = -0.01 }] }
[output]
channels = ['energy', 'reactions']
[[body]]
name = 'bar'
mesh = { grid = { cells = [4, 1], size = [2, 0.5] } }
elastic = { neo-hookean = { young = 1e4, poisson = 0.3 } }
damping = { mass_proportional = 0.5 }
mass = { density = 10.0 }
load = [{ force = [0, '-3 * t'] }]
pin = [
    { name = 'left', half_space = { normal = [1, 0], offset = 0 }, motion = { displacement = [0, '0.1 * t'] \
    } },
    { half_space = { normal = [-1, 0], offset = -2 }, until = 0.05 },
]
";

/// Reactions of every frame.
#[derive(Default)]
struct Witness(Vec<(f64, Vec<Reaction>, Balance)>);

impl Observer for Witness {
    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        let balance = frame.diagnostics.unwrap().balance.unwrap_or_default();
        self.0.push((frame.time, frame.reactions.unwrap().to_vec(), balance));
        Ok(())
    }
}

fn column<'a>(columns: &'a [Column], name: &str) -> &'a [f64] {
    let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
    &columns.iter().find(|column| column.name == name).unwrap_or_else(|| panic!("{name} in {names:?}")).values
}

#[test]
fn reactions_and_the_balance_come_back_bit_by_bit_from_the_recording() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let scene = Scene::from_toml(BAR).unwrap_or_else(|error| panic!("{error}"));
    let mut assembly = scene.assemble(UnstableStep::Refuse).unwrap_or_else(|problems| panic!("{problems:?}"));
    let reactions = assembly.simulation.reaction_names();
    assert_eq!(reactions, ["bar/left", "bar/pin1", "wall0"]);
    let options = Options { channels: scene.output.channels.clone(), reactions, ..Options::default() };
    let mut recorder = McapRecorder::create(&path, &options, &assembly.topology).unwrap();
    let mut witness = Witness::default();
    let observers: &mut [&mut dyn Observer] = &mut [&mut witness, &mut recorder];
    run(&mut assembly.simulation, &Plan { duration: 0.1, rate: 50.0 }, observers, &AtomicBool::new(false));
    let part = remains(&path, "killed");
    let out = part.with_extension("");
    assert_eq!(recover(&part, &out, false).unwrap().frames, 6);
    let outcome = info(&out).unwrap().outcome.unwrap();
    recorder.finish_with(&outcome).unwrap();
    assert!(std::fs::read(out).unwrap() == std::fs::read(&path).unwrap(), "a kill loses no reaction");

    let found = info(&path).unwrap();
    let topics: Vec<(&str, u64)> = found.topics.iter().map(|t| (t.topic.as_str(), t.messages)).collect();
    assert_eq!(topics, [("/energy", 6), ("/reactions", 6)]);
    let mut trajectory = Trajectory::open(&path).unwrap();
    let (reactions, energy) = (trajectory.reactions().unwrap(), trajectory.energy().unwrap());
    assert_eq!(witness.0.len(), 6);
    for (i, (time, expected, balance)) in witness.0.iter().enumerate() {
        assert_eq!(column(&reactions, "time")[i], *time);
        // The second pin is released halfway.
        assert_eq!(expected.len(), if *time < 0.055 { 3 } else { 2 }, "{time}");
        for reaction in expected {
            let Reaction { name, force, moment, about } = reaction;
            // The bar touches the wall only at times.
            assert!(force[1] != 0.0 || name == "wall0", "{reaction:?}");
            for (field, values) in [("force", force), ("moment", moment), ("about", about)] {
                for (c, value) in values.iter().enumerate() {
                    assert_eq!(column(&reactions, &format!("{name}.{field}[{c}]"))[i], *value);
                }
            }
        }
        if expected.len() == 2 {
            assert!(column(&reactions, "bar/pin1.force[0]")[i].is_nan(), "who has let go holds nothing");
        }
        let Balance { motion, loads, gravity, ether_drag, damping, friction, walls } = *balance;
        // Contact is with walls only, which have no friction.
        assert_eq!(friction, None);
        let parts = [
            ("motion", motion),
            ("loads", loads),
            ("gravity", gravity),
            ("ether_drag", ether_drag),
            ("damping", damping),
            ("walls", walls),
        ];
        for (name, value) in parts {
            let found = column(&energy, &format!("balance.{name}"))[i];
            // Before the first step there is no work and no dissipation.
            assert_eq!(value.is_some(), i > 0);
            assert!(value.map_or(found.is_nan(), |value| value == found), "{name}: {found}");
            assert!(i < 5 || found != 0.0, "{name} is nothing");
        }
    }
}

#[test]
fn reactions_without_a_pin_are_a_mistake_where_they_stand() {
    let (before, _) = BAR.split_once("pin = [").unwrap();
    let without_walls = before.replace(", walls = [{ normal = [0, 1], offset = -0.01 }]", "");
    assert_ne!(without_walls, before);
    let source = Source::new("scene.toml", without_walls);
    let text = source.scene().unwrap_err().to_string();
    for says in [
        "5:23",
        "channel `reactions` is about pins, obstacles and walls, and the scene has none",
        "give a body a `pin`",
    ] {
        assert!(text.contains(says), "{says:?} is not in\n{text}");
    }
}
